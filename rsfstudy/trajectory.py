"""One motion of one scene, as a labelled trajectory."""

from __future__ import annotations

import json
import math

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.motion.accuracy import DEFAULT_BUDGET, DEFAULT_RTOL, Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import Kind
from rsfstudy.motion.recording import OBSERVED, SAMPLES, observed
from rsfstudy.motion.stepping import Halt, Meter
from rsfstudy.slider.equations import IN_RUPTURE
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status
from rsfstudy.vocabulary import quantity

#: Those of our own dynamics; others stand behind them.
_REGIMES = ("quasi_static", "slow_manifold", IN_RUPTURE, "quasi_dynamic")


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
    regimes = dict.fromkeys(_REGIMES)
    status, message = Status.OK, ""
    moving = follow(scene, Accuracy(rtol, budget), meter, samples=SAMPLES, until=duration)
    try:
        for event in moving:
            if event.kind is not Kind.END:  # the last sample is there
                regimes[event.regime] = None
                rows += [(*observed(scene, event), list(regimes).index(event.regime))]
    except Halt as halt:
        status, message = halt.status, str(halt)
    dataset = _dataset(np.array(rows).reshape(-1, len(OBSERVED) + 1), list(regimes))
    dataset["reference_rate"] = ((), scene.reference_rate, {"units": "s-1"})
    dataset = dataset.set_coords(["time", "slip", "reference_rate"])
    return dataset.assign_attrs(
        {
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
    )


def _dataset(samples: np.ndarray, regimes: list[str]) -> xr.Dataset:
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
            "flag_values": np.arange(len(regimes), dtype=np.int8),
            "flag_meanings": " ".join(regimes),
        },
    )
    return dataset
