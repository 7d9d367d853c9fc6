"""What a user calls for one scene: its critical step or limit cycle; and quantities in SI units."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import DEFAULT_RTOL, Accuracy
from rsfstudy.motion.engines import SCIPY, check_engine
from rsfstudy.rig.scales import scaled, scales
from rsfstudy.slider.scene import Scene
from rsfstudy.vocabulary import quantity


def critical_step(
    scene: Scene,
    of: str = "load_velocity_ratio",
    direction: str = "up",
    *,
    rtol: float = DEFAULT_RTOL,
    engine: str = SCIPY,
) -> xr.Dataset:
    """The critical step of one scene.

    Parameters
    ----------
    scene : Scene
        The slider; whatever value it holds for the quantity sought is ignored.
    of : {"load_velocity_ratio", "displacement_step", "normal_stress_step"}
        What is stepped. After a step of displacement or of normal stress the load point is held
        unless the scene states its `load_velocity_ratio`. Steps of normal stress, which trigger by
        a fall (`direction="down"`), need normal stress that is "imposed" or "variable".
    direction : {"up", "down"}
        Steps that increase, or decrease.
    rtol : float
        Relative accuracy of V_0/V_* - 1, of the displacement, or of the logarithm of normal stress.
    engine : {"scipy", "compiled"}
        What integrates motions; compiled, which needs Numba, is much faster.

    Returns
    -------
    xarray.Dataset
        The critical value, its numerical error, and the values beside it that were verified as
        stable and as unstable; the status, the message and the work.
    """
    return _measured(CriticalStep(of=of, direction=direction), scene, rtol, engine)


def limit_cycle(scene: Scene, *, rtol: float = DEFAULT_RTOL, engine: str = SCIPY) -> xr.Dataset:
    """The stick-slip limit cycle of one scene.

    Parameters
    ----------
    scene : Scene
        The slider, with the load point velocity after the step; usually with inertia.
    rtol : float
        Relative accuracy of the recurrence interval and the stress drops, and of ln V.
    engine : {"scipy", "compiled"}
        As in `critical_step`.

    Returns
    -------
    xarray.Dataset
        Recurrence interval, static and dynamic stress drop and range of slip rate, each with its
        numerical error; the orbit along ``phase``; the status (``no_limit_cycle`` where the motion
        settles), the message and the work.
    """
    return _measured(LimitCycle(), scene, rtol, engine)


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
    return scaled(dataset, scales(normal_stress, slip_distance, reference_rate))


def _measured(measure: Measure, scene: Scene, rtol: float, engine: str) -> xr.Dataset:
    """A measure's named numbers as a small dataset that bears the names of the lattice."""
    check_engine(engine)
    outcome = measure(scene, Accuracy(rtol, engine=engine))
    own = {about.name: about for about in measure.quantities}
    inner = measure.inner_coordinates
    variables: dict[str, Any] = {}
    for name, dims in measure.variables.items():
        about = quantity(name, own)
        attrs = {"long_name": about.long_name, "units": about.units, "scale": about.scale}
        missing = np.full([len(inner[dim]) for dim in dims], np.nan)
        values = outcome.values.get(name, missing)
        variables[name] = (dims, values, {k: v for k, v in attrs.items() if v})
    variables["rhs_evaluations"] = ((), outcome.rhs_evaluations)
    rate = ((), scene.reference_rate, {"units": "s-1"})
    dataset = xr.Dataset(variables, coords={**inner, "reference_rate": rate})
    dataset.attrs = {
        "scene": json.dumps(scene.describe()),
        "rtol": rtol,
        "engine": engine,
        "status": outcome.status.label,
        "message": outcome.message,
    }
    return dataset
