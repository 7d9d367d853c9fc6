"""One time for a motion whose regimes have clocks of their own, and what is observed along it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rsfstudy.core.stepping import Step
from rsfstudy.equations import Point
from rsfstudy.scene import Scene

#: What is observed along a motion, in this order.
OBSERVED = (
    "time",
    "slip",
    "log10_slip_rate",
    "shear_stress",
    "normal_stress_ratio",
    "state_variable",
)


def timed(scene: Scene, moving: Iterator[Step]) -> Iterator[tuple[Step, float]]:
    """Steps of a motion (with its clock), each with the time at which its regime began."""
    begin = latest = 0.0
    equations = None
    for step in moving:
        if step.equations is not equations:
            equations, begin = step.equations, latest
        yield step, begin
        latest = begin + elapsed(scene, step, step.end)


def elapsed(scene: Scene, step: Step, clock: float) -> float:
    """Time in D_c/V_* since the regime of a step began."""
    if step.equations.regime == "inertial":
        return clock * scene.inertial_time
    return float(step.state_at(clock)[2]) if clock > 0.0 else 0.0


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
        1.0 + scene.cot_phi * point.friction,
        point.imbalance - scene.b * point.log_rate,
    )
