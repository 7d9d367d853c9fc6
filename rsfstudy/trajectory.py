"""One motion of one scene, as a labelled trajectory."""

from __future__ import annotations

import json
import math

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from rsfstudy.errors import InvalidValue
from rsfstudy.motion.accuracy import DEFAULT_BUDGET, DEFAULT_RTOL, Accuracy
from rsfstudy.motion.regimes import motion
from rsfstudy.motion.stepping import Halt, Meter, Step
from rsfstudy.motion.timeline import OBSERVED, elapsed, observed, timed
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status
from rsfstudy.vocabulary import quantity

REGIMES = ("quasi_static", "slow_manifold", "inertial", "quasi_dynamic")
#: Points stored per integration step: enough for a smooth curve.
_POINTS_PER_STEP = 4


def simulate(
    scene: Scene,
    *,
    duration: float = 50.0,
    rtol: float = DEFAULT_RTOL,
    budget: int = DEFAULT_BUDGET,
) -> xr.Dataset:
    """Follow the motion of a scene from the instant after its step.

    Parameters
    ----------
    scene : Scene
        The slider, its effects and its loading.
    duration : float
        Time to follow it for, in D_c/V_*.
    rtol : float
        Accuracy of the motion.
    budget : int
        Right-hand sides it may cost.

    Returns
    -------
    xarray.Dataset
        ``time``, ``slip``, ``log10_slip_rate``, ``shear_stress`` (of the spring),
        ``frictional_stress``, ``normal_stress_ratio``, ``state_variable`` and ``regime`` along
        ``sample``. A motion that cannot go on ends early, with its ``status`` and ``message`` in
        the attributes.

    Raises
    ------
    InvalidValue
        For a duration that is not positive and finite.
    """
    if not 0.0 < duration < math.inf:
        raise InvalidValue("duration", duration, "must be positive and finite")
    meter = Meter(budget)
    rows: list[tuple[float, ...]] = []
    status, message = Status.OK, ""
    try:
        _follow(scene, duration, Accuracy(rtol, budget), meter, rows)
    except Halt as halt:
        status, message = halt.status, str(halt)
    return _dataset(
        scene, np.array(rows).reshape(-1, len(OBSERVED) + 1), status, message, rtol, meter
    )


def _follow(
    scene: Scene,
    duration: float,
    accuracy: Accuracy,
    meter: Meter,
    rows: list[tuple[float, ...]],
) -> None:
    """Append samples up to `duration`; stretches of one regime have clocks of their own."""
    equations = None
    for step, begin in timed(scene, motion(scene, accuracy, meter, clock=True)):
        if step.equations is not equations:
            equations = step.equations
            rows.append(_sample(scene, step, step.start, begin))
        last = begin + elapsed(scene, step, step.end) >= duration
        if last:
            step = _until(scene, step, duration - begin)
        clocks = np.linspace(step.start, step.end, _POINTS_PER_STEP + 1)[1:].tolist()
        rows += [_sample(scene, step, clock, begin) for clock in clocks]
        if last:
            return


def _until(scene: Scene, step: Step, duration: float) -> Step:
    """The part of a step that ends this long after its regime began."""
    if elapsed(scene, step, step.end) <= duration:
        return step
    # clocks of slip are as short as slip is slow
    finest = 1e-15 * abs(step.end - step.start)
    clock = brentq(
        lambda c: elapsed(scene, step, c) - duration, step.start, step.end, xtol=finest, rtol=1e-15
    )
    return step.until(float(clock))


def _sample(scene: Scene, step: Step, clock: float, begin: float) -> tuple[float, ...]:
    point = step.before if clock == step.start else step.point_at(clock)
    time = begin + elapsed(scene, step, clock)
    # slip is counted from the start, before which the spring was displaced by the step
    row = observed(scene, point, time, scene.spring_stress_step)
    return (*row, REGIMES.index(step.equations.regime))


def _dataset(
    scene: Scene,
    samples: np.ndarray,
    status: Status,
    message: str,
    rtol: float,
    meter: Meter,
) -> xr.Dataset:
    dataset = xr.Dataset()
    for column, name in enumerate(OBSERVED):
        about = quantity(name)
        attrs = {"long_name": about.long_name, "units": about.units, "scale": about.scale}
        dataset[name] = ("sample", samples[:, column], {k: v for k, v in attrs.items() if v})
    dataset["regime"] = (
        "sample",
        samples[:, -1].astype(np.int8),
        {
            "long_name": quantity("regime").long_name,
            "flag_values": np.arange(len(REGIMES), dtype=np.int8),
            "flag_meanings": " ".join(REGIMES),
        },
    )
    dataset["reference_rate"] = ((), scene.reference_rate, {"units": "s-1"})
    dataset = dataset.set_coords(["time", "slip", "reference_rate"])
    dataset.attrs = {
        "title": f"Motion of a spring-slider, {scene.law} law",
        "Conventions": "CF-1.11",
        "scene": json.dumps(scene.as_dict()),
        "effects": " ".join(scene.effects) or "none",
        "status": status.label,
        "message": message,
        "rtol": rtol,
        "rhs_evaluations": meter.spent,
        "rhs_evaluations_by_regime": json.dumps(meter.by_regime),
    }
    return dataset
