"""One time for a motion whose regimes have clocks of their own, and what is observed along it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from rsfstudy.motion.stepping import Step
from rsfstudy.slider.forms import Point
from rsfstudy.slider.scene import Scene

#: What is observed along a motion, in this order.
OBSERVED = (
    "time",
    "slip",
    "log10_slip_rate",
    "shear_stress",
    "frictional_stress",
    "normal_stress_ratio",
    "state_variable",
)

#: Samples within each integration step of a recorded motion.
_SAMPLES = 4


def timed(scene: Scene, moving: Iterator[Step]) -> Iterator[tuple[Step, float]]:
    """Steps of a motion (with its clock), each with the time at which its regime began."""
    begin = latest = 0.0
    equations = None
    for step in moving:
        # the inertial clock is time: where it starts anew, so does the count
        if step.equations is not equations or (_tells_time(step) and step.start == 0.0):
            equations, begin = step.equations, latest
        yield step, begin
        latest = begin + elapsed(scene, step, step.end)


def elapsed(scene: Scene, step: Step, clock: float) -> float:
    """Time in D_c/V_* since the regime of a step began."""
    return clock * scene.inertial_time if _tells_time(step) else float(step.state_at(clock)[2])


def _tells_time(step: Step) -> bool:
    return step.equations.regime == "inertial"


def observed(scene: Scene, point: Point, time: float, origin: float) -> tuple[float, ...]:
    """The quantities of `OBSERVED` at a point; slip is counted from where spring stress was
    `origin`.

    Slip follows from the spring: f = origin + K (V_0 t - slip).
    """
    return (
        time,
        scene.load_velocity * time - (point.spring - origin) / scene.stiffness,
        point.log_rate / math.log(10.0),
        scene.mu_star + point.spring,
        scene.mu_star + point.friction,
        point.normal_stress,
        point.state,
    )


def sampled(scene: Scene, step: Step, begin: float, origin: float) -> Iterator[tuple[float, ...]]:
    """What is observed at evenly spaced clocks of a step, both ends included."""
    for clock in np.linspace(step.start, step.end, _SAMPLES + 1).tolist():
        point = step.before if clock == step.start else step.point_at(clock)
        yield observed(scene, point, begin + elapsed(scene, step, clock), origin)


def along_path(rows: Sequence[tuple[float, ...]], points: int) -> dict[str, np.ndarray]:
    """Observed rows at points spread evenly along the path, half by its length in time, ln V and
    stress, half by the steps the integrator took, which are short where the path bends.
    """
    table = np.array(rows)
    table = table[np.append(True, (np.diff(table, axis=0) != 0.0).any(axis=1))]
    seen = table[:, [OBSERVED.index(n) for n in ("time", "log10_slip_rate", "shear_stress")]]
    spread = np.ptp(seen, axis=0)
    strides = np.abs(np.diff(seen, axis=0) / np.where(spread > 0.0, spread, 1.0)).sum(axis=1)
    strides = strides / strides.sum() + 1.0 / len(strides)
    path = np.concatenate([[0.0], np.cumsum(strides)])
    at = np.linspace(0.0, path[-1], points)
    return {name: np.interp(at, path, table[:, i]) for i, name in enumerate(OBSERVED)}
