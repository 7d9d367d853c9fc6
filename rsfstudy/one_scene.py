"""What a user calls for one scene: its critical step or limit cycle; and quantities in SI units."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import DEFAULT_RTOL, Accuracy
from rsfstudy.slider.scene import Scene
from rsfstudy.vocabulary import quantity


def critical_step(
    scene: Scene,
    of: str = "load_velocity_ratio",
    direction: str = "up",
    *,
    rtol: float = DEFAULT_RTOL,
) -> xr.Dataset:
    """The critical step of one scene.

    Parameters
    ----------
    scene : Scene
        The slider; whatever value it holds for the quantity sought is ignored.
    of : {"load_velocity_ratio", "displacement_step"}
        What is stepped. After a displacement step the load point is held unless the scene states
        its `load_velocity_ratio`.
    direction : {"up", "down"}
        Steps that increase, or decrease.
    rtol : float
        Relative accuracy of V_0/V_* - 1, or of the displacement.

    Returns
    -------
    xarray.Dataset
        The critical value, its numerical error, and the values beside it that were verified as
        stable and as unstable; the status, the message and the work.
    """
    return _measured(CriticalStep(of=of, direction=direction), scene, rtol)


def limit_cycle(scene: Scene, *, rtol: float = DEFAULT_RTOL) -> xr.Dataset:
    """The stick-slip limit cycle of one scene.

    Parameters
    ----------
    scene : Scene
        The slider, with the load point velocity after the step; usually with inertia.
    rtol : float
        Relative accuracy of the recurrence interval and the stress drops, and of ln V.

    Returns
    -------
    xarray.Dataset
        Recurrence interval, static and dynamic stress drop and range of slip rate, each with its
        numerical error; the orbit along ``phase``; the status (``no_limit_cycle`` where the motion
        settles), the message and the work.
    """
    return _measured(LimitCycle(), scene, rtol)


def to_si(
    dataset: xr.Dataset,
    *,
    normal_stress: float,
    slip_distance: float,
    reference_rate: float | None = None,
) -> xr.Dataset:
    """A dataset with its dimensionless quantities in SI units.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results, or a trajectory: variables whose attribute ``scale`` says what they are measured
        in.
    normal_stress : float
        sigma_* in Pa.
    slip_distance : float
        D_c in m.
    reference_rate : float, optional
        V_*/D_c in 1/s; by default that of the dataset, where it holds one.

    Raises
    ------
    InvalidValue
        For scales that are not positive, or a dataset that does not say its `reference_rate`.
    """
    if reference_rate is None:
        if "reference_rate" not in dataset or dataset["reference_rate"].ndim:
            raise InvalidValue(
                "reference_rate", None, "is not one number in the dataset", remedy="State it."
            )
        reference_rate = float(dataset["reference_rate"])
    scales = {
        "sigma_*": (normal_stress, "Pa"),
        "D_c": (slip_distance, "m"),
        "V_*": (slip_distance * reference_rate, "m s-1"),
        "D_c/V_*": (1.0 / reference_rate, "s"),
        "sigma_*/D_c": (normal_stress / slip_distance, "Pa m-1"),
    }
    for of, (scale, _units) in scales.items():
        if not 0.0 < scale < float("inf"):
            raise InvalidValue(of, scale, "must be positive and finite")
    result = dataset.copy()
    for name, values in dataset.variables.items():
        scale, units = scales.get(values.attrs.get("scale", ""), (1.0, ""))
        if units:
            about = {k: v for k, v in values.attrs.items() if k != "scale"} | {"units": units}
            result[name] = (values.dims, values.values * scale, about)
    return result


def _measured(measure: Measure, scene: Scene, rtol: float) -> xr.Dataset:
    """A measure's named numbers as a small dataset that bears the names of the lattice."""
    outcome = measure(scene, Accuracy(rtol))
    dataset = xr.Dataset(coords=dict(measure.inner_coordinates))
    dataset["reference_rate"] = ((), scene.reference_rate, {"units": "s-1"})
    own = {about.name: about for about in measure.quantities}
    for name, dims in measure.variables.items():
        about = quantity(name, own)
        attrs = {"long_name": about.long_name, "units": about.units, "scale": about.scale}
        missing = np.full([dataset.sizes[d] for d in dims], np.nan)
        values = outcome.values.get(name, missing)
        dataset[name] = (dims, values, {k: v for k, v in attrs.items() if v})
    dataset["rhs_evaluations"] = ((), outcome.rhs_evaluations)
    dataset.attrs = {
        "scene": json.dumps(scene.as_dict()),
        "rtol": rtol,
        "status": outcome.status.label,
        "message": outcome.message,
    }
    return dataset.set_coords("reference_rate")
