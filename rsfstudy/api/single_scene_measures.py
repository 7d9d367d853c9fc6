"""Functions that compute critical steps and limit cycles, and convert datasets to SI units."""

from __future__ import annotations

import json
import math
import warnings
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.api.simulation import (
    build_motion_variable_attributes,
    check_integrator_is_usable,
    check_is_scene,
)
from rsfstudy.errors import NoResultWarning, RsfStudyWarning
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.execution import build_provenance_attributes
from rsfstudy.measures import CriticalStep, LimitCycle, Measure
from rsfstudy.motion import Accuracy, Engine, Integrator
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.rig import DatasetUnits, convert_to_si
from rsfstudy.slider import Scene
from rsfstudy.status import Status
from rsfstudy.vocabulary import find_quantity


@raise_only_rsfstudy_errors
def critical_step(
    scene: Scene,
    of: str = "load_velocity_ratio",
    direction: str = "up",
    *,
    rtol: float = Accuracy.DEFAULT_RTOL,
    engine: Any = Engine.SCIPY,
    budget: int = Accuracy.DEFAULT_BUDGET,
    integrator: Integrator | None = None,
) -> xr.Dataset:
    r"""Compute the smallest step that causes an instability.

    Parameters
    ----------
    scene : Scene
        Scene of the slider. The value of the stepped quantity in the scene is ignored.
    of : str, default: "load_velocity_ratio"
        Quantity that is stepped: "load_velocity_ratio", "displacement_step" or
        "normal_stress_step". "velocity_step" is an alias of "load_velocity_ratio". After a step of
        displacement or normal stress, the load point does not move, unless the scene specifies
        ``load_velocity_ratio``. Steps of normal stress require a normal stress that is "imposed" or
        "variable". If a decrease of normal stress triggers the instability, pass
        ``direction="down"``.
    direction : {"up", "down"}, default: "up"
        Direction of the step.
    rtol : float, default: 1e-7
        Relative tolerance of the critical step. The tolerance applies to :math:`V_0/V_* - 1`, to
        the displacement, or to the logarithm of the normal stress ratio.
    engine : {"scipy", "python", "compiled"} or type, default: "scipy"
        Engine that integrates the motions. "compiled" is much faster, and requires Numba. A
        user-defined stepper is passed as a class.
    budget : int, default: 500,000
        Largest number of right-hand side evaluations. If the budget is exceeded, the status is
        ``work_budget_spent``.
    integrator : Integrator, optional
        Argument of ``Measure.compute``, which a user-defined measure passes on. The integrator
        replaces ``rtol``, ``engine`` and ``budget``. The right-hand side evaluations are added to
        the count of the cell, and no warning is emitted.

    Returns
    -------
    xarray.Dataset
        Dataset with scalar variables. The critical value is ``critical_velocity_ratio`` (in V_*),
        ``critical_displacement`` (in D_c) or ``critical_normal_stress_step`` (in sigma_*). The
        dataset also contains the numerical error ``<name>_error`` and two steps that verify the
        critical value. The slider settles after the step ``<name>_stable`` and becomes unstable
        after the step ``<name>_unstable``. ``rhs_evaluations`` is the number of right-hand side
        evaluations. The attributes ``status`` and ``message`` describe the outcome. If there is no
        critical step, the critical value is NaN.

    Raises
    ------
    InvalidValue
        If ``scene`` is not a scene, or if ``of`` or ``direction`` is not one of the choices.

    Warns
    -----
    NoResultWarning
        If there is no critical step.
    UserWarning
        If the instability norm is close to the load point velocity, for example because the period
        of a rig is short. The coordinate ``instability_slip_rate`` contains the instability norm as
        a slip rate in V_*.

    See Also
    --------
    rsfstudy.measures.CriticalStep : Equations and references of the measure.
    rsfstudy.limit_cycle : Compute the limit cycle of a scene.

    Notes
    -----
    The critical step depends on the instability norm of the scene, and the error does not include
    this dependence.

    Under the slowness law at constant normal stress and :math:`k \ge k_{cr}`, every quasi-static
    motion stays bounded [1]_. The result is then the smallest step after which the slip rate
    reaches the instability norm. This step grows without limit as the norm increases.

    References
    ----------
    .. [1] Ranjith, K., & Rice, J. R. (1999). Stability of quasi-static slip in a single degree of
       freedom elastic system with rate and state dependent friction. J. Mech. Phys. Solids, 47,
       1207-1218.

    Examples
    --------
    At constant normal stress and critical stiffness, the critical displacement is
    :math:`D_c\,a/(b - a)`.

    >>> from rsfstudy import Scene, critical_step
    >>> scene = Scene(normal_stress="constant", b_over_a=2.0)
    >>> result = critical_step(scene, of="displacement_step", rtol=1e-5)
    >>> round(result["critical_displacement"].item(), 4)
    1.0
    """
    return _compute_measure_as_dataset(
        CriticalStep(of=of, direction=direction),
        scene,
        integrator or Integrator(Accuracy(rtol, budget, engine=engine)),
        is_used_by_other_measure=integrator is not None,
    )


@raise_only_rsfstudy_errors
def limit_cycle(
    scene: Scene,
    *,
    events: int = LimitCycle.events,
    rtol: float = Accuracy.DEFAULT_RTOL,
    engine: Any = Engine.SCIPY,
    budget: int = Accuracy.DEFAULT_BUDGET,
    integrator: Integrator | None = None,
) -> xr.Dataset:
    r"""Compute the stick-slip limit cycle of a scene.

    Parameters
    ----------
    scene : Scene
        Scene of the slider, usually with inertia or radiation damping. ``load_velocity_ratio`` is
        the load point velocity of the cycle.
    events : int, default: 300
        Largest number of events until the motion repeats.
    rtol : float, default: 1e-7
        Relative tolerance of the recurrence interval and the stress drops, and tolerance of
        :math:`\ln(V/V_*)`.
    engine : {"scipy", "python", "compiled"} or type, default: "scipy"
        Engine that integrates the motions. "compiled" is much faster, and requires Numba. A
        user-defined stepper is passed as a class.
    budget : int, default: 500,000
        Largest number of right-hand side evaluations. If the budget is exceeded, the status is
        ``work_budget_spent``.
    integrator : Integrator, optional
        Argument of ``Measure.compute``, which a user-defined measure passes on. The integrator
        replaces ``rtol``, ``engine`` and ``budget``. The right-hand side evaluations are added to
        the count of the cell, and no warning is emitted.

    Returns
    -------
    xarray.Dataset
        Dataset with scalar variables and with the orbit along the dimension ``phase`` (400 points).
        The scalars include ``recurrence_interval`` (in D_c/V_*), ``static_stress_drop`` and
        ``dynamic_stress_drop`` (in sigma_*), the range of slip rate, and ``rhs_evaluations``. The
        numerical error of a variable is ``<name>_error``. A cycle begins and ends at a maximum of
        spring stress. If the motion repeats only after several events, the results describe the
        event with the highest slip rate, and the message reports the number of events. The
        attribute ``status`` is ``no_limit_cycle`` if the motion settles. If there is no limit
        cycle, the results are NaN.

    Raises
    ------
    InvalidValue
        If ``scene`` is not a scene, or if ``events`` is not a positive integer.

    Warns
    -----
    NoResultWarning
        If there is no limit cycle. The warning contains the status and the message.

    See Also
    --------
    rsfstudy.measures.LimitCycle : Definitions and error estimates of the measure.
    rsfstudy.plot_motion : Plot the orbit.

    Examples
    --------
    >>> from rsfstudy import Scene, limit_cycle
    >>> scene = Scene(normal_stress="constant", stiffness_ratio=0.8, radiation_damping=1e-3)
    >>> cycle = limit_cycle(scene, rtol=1e-4)
    >>> round(cycle["recurrence_interval"].item(), 3)
    9.061
    """
    return _compute_measure_as_dataset(
        LimitCycle(events=events),
        scene,
        integrator or Integrator(Accuracy(rtol, budget, engine=engine)),
        is_used_by_other_measure=integrator is not None,
    )


@raise_only_rsfstudy_errors
def to_si(
    dataset: xr.Dataset,
    *,
    normal_stress: Any = None,
    slip_distance: Any = None,
    reference_rate: Any = None,
) -> xr.Dataset:
    r"""Convert a dataset to SI units.

    Stress is converted to Pa, slip to m, time to s and slip rate to m/s.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or a dataset of one scene. The attribute ``scale`` of each variable
        contains the unit by which the variable is normalised.
    normal_stress : quantity, optional
        Scale of stress :math:`\sigma_*`, such as "5 MPa", or a number in Pa.
    slip_distance : quantity, optional
        Scale of slip :math:`D_c`, such as "10 um", or a number in m.
    reference_rate : quantity, optional
        Scale of rates :math:`V_*/D_c`, such as "0.1 1/s", or a number in 1/s.

    Returns
    -------
    xarray.Dataset
        Dataset in SI units. Variables that are no longer ratios are renamed to
        ``critical_velocity``, ``load_velocity`` and ``effective_normal_stress``. ``slip_rate`` is
        added next to its logarithm. Dimensionless variables, such as friction and the logarithm of
        slip rate, are unchanged. Porosity is also unchanged, because the compressibility is
        unknown.

    Raises
    ------
    InvalidValue
        If a scale is not a positive quantity, if a scale is missing, or if a scale differs from the
        scale in the dataset.
    DataError
        If the dataset has already been converted, if rsfstudy has not created the dataset, or if
        the scale of an axis varies along another axis.

    Notes
    -----
    A scale that the dataset contains need not be passed. The results of a study with a rig contain
    all scales, and each cell is converted with the scales of its own rig.

    Examples
    --------
    >>> from rsfstudy import Scene, simulate, to_si
    >>> scene = Scene(load_velocity_ratio=2.0, reference_rate=0.1)
    >>> motion = simulate(scene, times=[0.5, 1.0])
    >>> converted = to_si(motion, normal_stress="5 MPa", slip_distance="10 um")
    >>> converted["time"].values
    array([ 5., 10.])
    """
    units = {"normal_stress": "Pa", "slip_distance": "m", "reference_rate": "1/s"}
    given = (normal_stress, slip_distance, reference_rate)
    stated = {
        name: convert_to_si(name, value, units[name])
        for name, value in zip(units, given, strict=True)
        if value is not None
    }
    return DatasetUnits(dataset).convert_to_units("Pa", "m", "s", **stated)


def _compute_measure_as_dataset(
    measure: Measure, scene: Scene, integrator: Integrator, *, is_used_by_other_measure: bool
) -> xr.Dataset:
    """Compute a measure of a scene, and return the outputs as a dataset.

    The variables have the same names as in the results of studies. Outputs without a value are NaN.
    Pass ``is_used_by_other_measure=True`` if another measure uses the results. In this case, the
    function emits no warnings, and the right-hand-side evaluations are added to the evaluation
    count of the integrator.
    """
    check_is_scene(scene)
    check_integrator_is_usable(integrator)
    outcome = (
        measure.run_nested(scene, integrator)
        if is_used_by_other_measure
        else measure(scene, integrator.accuracy)
    )
    if is_used_by_other_measure:
        pass
    elif outcome.status is not Status.OK:
        why = outcome.message or outcome.status.meaning
        text = f"{measure.name} has no result: {outcome.status.label} ({why})"
        warnings.warn(text, NoResultWarning, stacklevel=4)
    elif outcome.message:
        warnings.warn(outcome.message, RsfStudyWarning, stacklevel=4)
    own, inner = {about.name: about for about in measure.quantities}, measure.output_coordinates
    variables: dict[str, Any] = {}
    for name, dims in measure.variables.items():
        values = outcome.values.get(name)
        if values is None:
            values = np.full([len(inner[dim]) for dim in dims], np.nan)
        variables[name] = (
            dims,
            values,
            build_motion_variable_attributes(find_quantity(name, own), scene),
        )
    work = "rhs_evaluations"
    variables[work] = (), outcome.rhs_evaluations, find_quantity(work).variable_attributes
    rate = (), scene.reference_rate, find_quantity("reference_rate").variable_attributes
    norm = (
        (),
        math.exp(scene.log_slip_rate_at_instability),
        find_quantity("instability_slip_rate").variable_attributes,
    )
    what = measure.name.replace("_", " ").capitalize()
    about = {
        "title": f"{what} of a spring-slider, {scene.law} law",
        "Conventions": "CF-1.11",
        "scene": json.dumps(scene.describe()),
        "rtol": integrator.rtol,
        "engine": integrator.engine,
        "status": outcome.status.label,
        "message": outcome.message,
        **build_provenance_attributes(f"rsfstudy.{measure.name}"),
    }
    coordinates: dict[str, Any] = {
        **{
            name: (name, values, find_quantity(name, own).variable_attributes)
            for name, values in inner.items()
        },
        "reference_rate": rate,
        "instability_slip_rate": norm,
    }
    return copy_with_cf_encoding(xr.Dataset(variables, coordinates, about))
