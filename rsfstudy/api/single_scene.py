"""Functions for one scene: its critical step or limit cycle; and quantities in SI units."""

from __future__ import annotations

import json
import math
import warnings
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.api.simulation import check_scene, motion_variable_attributes
from rsfstudy.error_boundary import error_boundary
from rsfstudy.errors import NoResultWarning, RsfStudyWarning
from rsfstudy.execution import provenance_attributes
from rsfstudy.measures import CriticalStep, LimitCycle, Measure
from rsfstudy.motion import (
    DEFAULT_EVALUATION_BUDGET,
    DEFAULT_RTOL,
    SCIPY,
    Accuracy,
    check_engine_is_usable,
)
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.rig import convert_dataset_units, convert_to_si, read_si_scales
from rsfstudy.slider import Scene
from rsfstudy.status import Status
from rsfstudy.vocabulary import find_quantity


@error_boundary
def critical_step(
    scene: Scene,
    of: str = "load_velocity_ratio",
    direction: str = "up",
    *,
    rtol: float = DEFAULT_RTOL,
    engine: Any = SCIPY,
    budget: int = DEFAULT_EVALUATION_BUDGET,
) -> xr.Dataset:
    """The critical step of one scene.

    Parameters
    ----------
    scene : Scene
        The slider; whatever value it holds for the quantity sought is ignored.
    of : {"load_velocity_ratio", "displacement_step", "normal_stress_step"}
        What is stepped; "velocity_step" is another name of "load_velocity_ratio". After a step of
        displacement or of normal stress the load point is held unless the scene states its
        `load_velocity_ratio`. Steps of normal stress, which trigger by
        a fall (`direction="down"`), need normal stress that is "imposed" or "variable".
    direction : {"up", "down"}
        Steps that increase, or decrease.
    rtol : float
        Relative accuracy of V_0/V_* - 1, of the displacement, or of the logarithm of normal stress.
    engine : {"scipy", "python", "compiled"}, or type
        What integrates motions; compiled, which needs Numba, is much faster. A stepper of your own
        is given by its class.
    budget : int
        Right-hand sides it may evaluate before it ends as `work_budget_spent`.

    Returns
    -------
    xarray.Dataset
        The critical value, its numerical error, and the values beside it that were verified as
        stable and as unstable; the status, the message and the work.

    Warns
    -----
    NoResultWarning
        Where there is no critical step, with the status and the message; its numbers are NaN.
    UserWarning
        Where the instability norm is hardly faster than the load point, as on rigs whose period is
        short: ``instability_slip_rate`` tells how fast it is.
    """
    return _measure_scene_to_dataset(
        CriticalStep(of=of, direction=direction), scene, Accuracy(rtol, budget, engine=engine)
    )


@error_boundary
def limit_cycle(
    scene: Scene,
    *,
    events: int = LimitCycle.events,
    rtol: float = DEFAULT_RTOL,
    engine: Any = SCIPY,
    budget: int = DEFAULT_EVALUATION_BUDGET,
) -> xr.Dataset:
    """The stick-slip limit cycle of one scene.

    Parameters
    ----------
    scene : Scene
        The slider, with the load point velocity after the step; usually with inertia.
    events : int
        Most events to wait for a cycle that repeats.
    rtol : float
        Relative accuracy of the recurrence interval and the stress drops, and of ln V.
    engine, budget
        As in `critical_step`.

    Returns
    -------
    xarray.Dataset
        Recurrence interval, static and dynamic stress drop and range of slip rate, each with its
        numerical error: from one maximum of spring stress to the next; where the motion repeats
        itself after several events only, as the message then says, those of the event with the
        fastest peak. The orbit along ``phase``; the status (``no_limit_cycle`` where the motion
        settles), the message and the work.

    Warns
    -----
    NoResultWarning
        Where there is no cycle, with the status and the message; its numbers are NaN.
    """
    return _measure_scene_to_dataset(
        LimitCycle(events=events), scene, Accuracy(rtol, budget, engine=engine)
    )


@error_boundary
def to_si(
    dataset: xr.Dataset,
    *,
    normal_stress: Any = None,
    slip_distance: Any = None,
    reference_rate: Any = None,
) -> xr.Dataset:
    """A dataset in SI units, all of it: stress in Pa, slip in m, time in s, slip rates in m/s.

    What is no ratio any more is not called one: ``critical_velocity``, ``load_velocity`` and
    ``effective_normal_stress``; ``slip_rate`` stands beside its logarithm. Pure numbers, such as
    friction and that logarithm, stay as they are, and so does porosity, for want of a
    compressibility.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results, or a trajectory: variables whose attribute ``scale`` says what they are measured
        in.
    normal_stress : quantity
        sigma_*: a number in Pa, or a text with units ("5 MPa").
    slip_distance : quantity
        D_c, in m ("10 um").
    reference_rate : quantity
        V_*/D_c, in 1/s.

    A dataset that holds one of these, as results of a rig hold all, needs none, and is converted by
    its own, cell by cell.

    Raises
    ------
    InvalidValue
        For scales that are no quantities or not positive; for one that the dataset does not hold
        and is not stated, or that is stated and is not that of all its cells.
    DataError
        For a dataset that is in other units already, or not of rsfstudy; or where the scale of an
        axis varies along another.
    """
    units = {"normal_stress": "Pa", "slip_distance": "m", "reference_rate": "1/s"}
    given = (normal_stress, slip_distance, reference_rate)
    stated = {
        name: convert_to_si(name, value, units[name])
        for name, value in zip(units, given, strict=True)
        if value is not None
    }
    return convert_dataset_units(dataset, read_si_scales(dataset, **stated), "Pa", "m", "s")


def _measure_scene_to_dataset(measure: Measure, scene: Scene, accuracy: Accuracy) -> xr.Dataset:
    """A measure's named numbers as a small dataset that bears the names of the lattice; those that
    are None are missing.
    """
    check_scene(scene)
    check_engine_is_usable(accuracy.engine)
    outcome = measure(scene, accuracy)
    if outcome.status is not Status.OK:
        why = outcome.message or outcome.status.meaning
        text = f"{measure.name} has no number: {outcome.status.label} ({why})"
        warnings.warn(text, NoResultWarning, stacklevel=4)
    elif outcome.message:
        warnings.warn(outcome.message, RsfStudyWarning, stacklevel=4)
    own, inner = {about.name: about for about in measure.quantities}, measure.inner_coordinates
    variables: dict[str, Any] = {}
    for name, dims in measure.variables.items():
        values = outcome.values.get(name)
        if values is None:
            values = np.full([len(inner[dim]) for dim in dims], np.nan)
        variables[name] = dims, values, motion_variable_attributes(find_quantity(name, own), scene)
    work = "rhs_evaluations"
    variables[work] = (), outcome.rhs_evaluations, find_quantity(work).attributes
    rate = (), scene.reference_rate, find_quantity("reference_rate").attributes
    norm = (
        (),
        math.exp(scene.log_instability_rate),
        find_quantity("instability_slip_rate").attributes,
    )
    what = measure.name.replace("_", " ").capitalize()
    about = {
        "title": f"{what} of a spring-slider, {scene.law} law",
        "Conventions": "CF-1.11",
        "scene": json.dumps(scene.describe()),
        "rtol": accuracy.rtol,
        "engine": accuracy.engine,
        "status": outcome.status.label,
        "message": outcome.message,
        **provenance_attributes(f"rsfstudy.{measure.name}"),
    }
    coordinates: dict[str, Any] = {
        **{
            name: (name, values, find_quantity(name, own).attributes)
            for name, values in inner.items()
        },
        "reference_rate": rate,
        "instability_slip_rate": norm,
    }
    return copy_with_cf_encoding(xr.Dataset(variables, coordinates, about))
