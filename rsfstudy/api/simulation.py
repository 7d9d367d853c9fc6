"""Functions that integrate the motion of a scene and convert the motion to a dataset.

The main function is ``simulate``.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Sequence
from numbers import Real
from typing import Any, Never

import numpy as np
import xarray as xr

from rsfstudy.errors import IncompleteWarning, InvalidValue, NoResultWarning, shorten_text
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.execution import build_provenance_attributes
from rsfstudy.motion import (
    Accuracy,
    Engine,
    Event,
    EventKind,
    Integrator,
    MotionRecorder,
    MotionStopped,
    accept_deprecated_accuracy_and_meter,
    rise,
)
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.parts import SEGMENT_START, SEGMENT_VELOCITY
from rsfstudy.quantities import Quantity
from rsfstudy.slider import MotionPoint, SampledHistory, Scene, UserLoading
from rsfstudy.status import Status
from rsfstudy.vocabulary import find_quantity

#: Minimum difference of successive times, in spacings of floating-point numbers and as an absolute
#: value. The times remain different when they are rounded in a conversion to other units.
_MIN_TIME_ULPS, _MIN_TIME_DIFFERENCE = 4, 1e-290

#: Default duration of a motion after a step, in D_c/V_*, and default load point displacement during
#: the last segment of a protocol, in D_c.
_DEFAULT_DURATION, _DISPLACEMENT_AFTER_PROTOCOL = 50.0, 20.0
_UNPERTURBED_SCENE_MESSAGE = (
    "the scene has no step, so the slider slides steadily at V_*. Set load_velocity_ratio, "
    "displacement_step, hold_time, velocity_steps, loading or initial_state in the scene."
)
_INSTABILITY_TIME_LONG_NAME = "time at which the slip rate first exceeded the instability norm"
_INSTABILITY_TIME_QUANTITY = Quantity(
    "instability_time", "$t V_*/D_c$", "1", _INSTABILITY_TIME_LONG_NAME, "D_c/V_*"
)
#: Attribute that contains the time after which a motion has no physical meaning.
UNPHYSICAL_MOTION_ATTRIBUTE_NAME = "beyond_instability_norm"
#: Attribute that contains the time, the slip and the state of the slider at the end of a motion.
MOTION_END_STATE_ATTRIBUTE_NAME = "end"
#: Limit of the ratio of slip rate to load point velocity. The limit defines instability if the load
#: point velocity exceeds the limit of the slip rate (instability norm). The load point velocity may
#: exceed the instability norm if the period of the scene is not the period of the slider.
_INSTABILITY_SLIP_RATE_OVER_LOAD_RATE = 1e6
#: Variables of motions that are computed from spring stress.
_VARIABLES_DERIVED_FROM_SPRING_STRESS = ("shear_stress", "friction_coefficient")
#: Names of the regimes (forms of the equations of motion) of the built-in dynamics. Regimes of
#: user-defined dynamics have larger codes.
_BUILT_IN_REGIME_NAMES = (
    "quasi_static",
    "slow_manifold",
    Scene.RUPTURE_REGIME,
    "quasi_dynamic",
)


@raise_only_rsfstudy_errors
@accept_deprecated_accuracy_and_meter
def simulate(
    scene: Scene,
    *extra_positional_arguments: Never,
    duration: float | None = None,
    times: Sequence[float] | np.ndarray | None = None,
    start: xr.Dataset | None = None,
    rtol: float = Accuracy.DEFAULT_RTOL,
    budget: int = Accuracy.DEFAULT_BUDGET,
    engine: Any = Engine.SCIPY,
    integrator: Integrator | None = None,
) -> xr.Dataset:
    """Integrate the motion of a scene.

    At time 0, immediately after the step of the loading, the motion starts from the initial values
    of the scene.

    Parameters
    ----------
    scene : Scene
        Scene to integrate.
    *extra_positional_arguments : Never
        All other arguments are keyword-only. A positional argument raises ``InvalidValue``.
    duration : float, optional
        Duration in D_c/V_*. By default, the motion includes the whole loading. If the last segment
        of the loading has no end, the motion includes 20 D_c of load point displacement in this
        segment, or 50 D_c/V_* if the load point is held. If the loading has only one segment, the
        default is 50.
    times : array_like of shape (n,), optional
        Increasing times in D_c/V_* at which to return the motion, instead of ``duration``. With
        inertia, slip rate adjusts to a step within the inertial time. If a requested time is within
        this adjustment, the function returns the values at the end of the adjustment. By default,
        several times per integration step are returned.
    start : xarray.Dataset, optional
        Previous motion of the same scene. The new motion begins at the end of the previous motion.
        Time, slip and loading continue without interruption, and ``duration`` is counted from the
        end of the previous motion.
    rtol : float, default: 1e-7
        Relative tolerance of the motion.
    budget : int, default: 500,000
        Largest number of right-hand side evaluations.
    engine : {"scipy", "python", "compiled"} or type, default: "scipy"
        Engine that integrates the motion. "compiled" is much faster, and requires Numba. A
        user-defined stepper is passed as a class.
    integrator : Integrator, optional
        Integrator of a study cell. In a user-defined measure, pass the argument ``integrator`` of
        the method ``compute``. The integrator replaces ``rtol``, ``budget`` and ``engine``. The
        right-hand side evaluations are added to the count of the cell. If the motion cannot
        continue, the cell ends with the status of the motion. The former arguments ``accuracy`` and
        ``meter`` are deprecated.

    Returns
    -------
    xarray.Dataset
        Motion along the dimension ``time`` with n rows. Quantities are dimensionless, with stress
        in sigma_*, slip in D_c, time in D_c/V_* and slip rate in V_*.

        - ``slip``, ``log10_slip_rate`` and ``state_variable`` describe the slider. For laws with
          several states, ``state_1``, ``state_2`` and so on are the states, excluding changes due
          to normal stress. If normal stress does not affect the states, the sum of the states
          is ``state_variable``.
        - ``shear_stress`` is the spring stress. With radiation damping, the damping stress at V_*
          is subtracted from the spring stress, so that spring stress equals frictional stress in
          steady sliding at V_*.
        - ``frictional_stress`` is the frictional resistance, and ``normal_stress_ratio`` is the
          effective normal stress in sigma_*.
        - ``load_point_displacement`` and ``friction_coefficient`` are the values that a laboratory
          rig measures. The friction coefficient is spring stress divided by the difference of
          normal stress and the pore pressure outside the fault.
        - ``porosity`` and ``pore_pressure`` exist if the fluid is dilatant. If the fluid is
          thermal, ``pore_pressure`` exists, and ``porosity`` exists only with dilatancy.
        - ``temperature_rise`` exists if the temperature changes.
        - ``regime`` is an integer code for the equations of motion that were used. The attribute
          ``flag_meanings`` of ``regime`` lists the names of the codes.
        - ``instability_time`` exists if the scene has neither inertia nor radiation damping, and
          the slip rate exceeds the limit of the slip rate (instability norm).

        The attributes include ``scene``, ``status``, ``message``, ``duration``, ``rtol``,
        ``budget``, ``engine`` and ``rhs_evaluations``. If the motion cannot continue, it ends
        early, and the attributes ``status`` and ``message`` contain the reason.

    Raises
    ------
    InvalidValue
        If ``start`` is not a complete motion of this scene, if the duration is not positive and
        finite, if the times do not increase, or if both ``times`` and ``duration`` are passed.

    Warns
    -----
    IncompleteWarning
        If the motion ends early.
    NoResultWarning
        If the scene has no step, so that the slider slides steadily at V_*, or if the slip rate
        exceeds the instability norm and the scene has neither inertia nor radiation damping.

    See Also
    --------
    rsfstudy.critical_step : Compute the critical step of a scene.
    rsfstudy.limit_cycle : Compute the limit cycle of a scene.
    rsfstudy.plot_motion : Plot a motion.

    Notes
    -----
    Time strictly increases. If a quantity changes discontinuously, the row at the time of the
    discontinuity contains the value before the discontinuity, and the next row contains the value
    after the discontinuity. The times of the two rows differ by a few spacings of floating-point
    numbers. If a rupture is shorter than the floating-point resolution of time, the times of its
    rows also differ by a few spacings.

    Without inertia and radiation damping, a motion has no physical meaning after the slip rate has
    exceeded the instability norm. The variable ``instability_time`` and the attribute
    ``beyond_instability_norm`` contain the time at which the slip rate first exceeds the
    instability norm. If the load point velocity itself exceeds the norm, the limit of the slip rate
    is :math:`10^6` times the load point velocity.

    Examples
    --------
    >>> from rsfstudy import Scene, simulate
    >>> scene = Scene(
    ...     normal_stress="constant", mu_star=0.6, stiffness_ratio=2.0, load_velocity_ratio=2.0
    ... )
    >>> motion = simulate(scene, times=[1.0, 5.0, 10.0])
    >>> motion["friction_coefficient"].values.round(4)
    array([0.5841, 0.5901, 0.59  ])
    """
    if extra_positional_arguments:
        remedy = (
            f"Write duration={shorten_text(extra_positional_arguments[0])}. The unit of duration "
            "is D_c/V_*."
        )
        raise InvalidValue(
            "simulate()",
            extra_positional_arguments[0],
            "accepts optional arguments by name only",
            remedy=remedy,
        )
    check_is_scene(scene)
    since = None if start is None else _read_final_state_of_motion(start, scene)
    began = since.time if since else 0.0
    at = _check_requested_times(times, duration, began)
    if at is not None:
        duration = float(at[-1]) - began
    duration = _compute_default_duration(scene) - began if duration is None else duration
    known = isinstance(duration, int | float | np.number) and not isinstance(duration, bool)
    if not (known and 0.0 < duration < math.inf):
        rule, remedy = "must be a positive, finite number in units of D_c/V_*", ""
        given: object = duration
        if isinstance(given, str):
            rule = "must be a number in units of D_c/V_*"
            remedy = "To convert a duration with units, use rig.dimensionless."
        raise InvalidValue("duration", duration, rule, remedy=remedy)
    is_alone = integrator is None
    if integrator is None:
        integrator = Integrator(Accuracy(rtol, budget, engine=engine))
    check_integrator_is_usable(integrator)
    if is_alone and not scene.is_perturbed:
        warnings.warn(_UNPERTURBED_SCENE_MESSAGE, NoResultWarning, stacklevel=3)
    spent, by_regime = integrator.evaluations, dict(integrator.work_meter.evaluations_by_regime)
    recording = MotionRecorder(list(_BUILT_IN_REGIME_NAMES), at)
    status, message, limit, passed = (
        Status.OK,
        "",
        _compute_log_instability_slip_rate(scene),
        math.nan,
    )
    watches = [rise("log_slip_rate", limit)] if limit < math.inf else []
    until = began + duration if at is None else float(at[-1])
    moving = integrator.follow(scene, watches, recording=recording, until=until, resume_from=since)
    try:
        for last in moving:
            if math.isnan(passed) and (last.specification or last.point.log_slip_rate >= limit):
                passed = last.time
    except MotionStopped as halt:
        if not is_alone:
            raise
        status, message = halt.status, str(halt)
        if status is Status.WORK_BUDGET_SPENT:
            message += integrator.work_meter.larger_budget_advice
    seen = recording.as_table(scene)
    seen = make_row_times_strictly_increasing(seen) if at is None else seen
    dataset = _convert_recording_to_dataset(scene, seen, recording.regime_names)
    dataset = dataset.assign_attrs(
        {
            "title": f"Motion of a spring-slider, {scene.law} law",
            "Conventions": "CF-1.11",
            "scene": json.dumps(scene.describe()),
            "effects": " ".join(scene.effects) or "none",
            "status": status.label,
            "message": message,
            "duration": duration,
            "output_times": "all time steps" if at is None else "requested times",
            "rtol": integrator.rtol,
            "budget": integrator.accuracy.budget,
            "engine": integrator.engine,
            "rhs_evaluations": integrator.evaluations - spent,
            "rhs_evaluations_by_regime": json.dumps(
                {
                    regime: n - by_regime.get(regime, 0)
                    for regime, n in integrator.work_meter.evaluations_by_regime.items()
                }
            ),
            **build_provenance_attributes("rsfstudy.simulate"),
        }
    )
    if status is Status.OK:
        dataset.attrs[MOTION_END_STATE_ATTRIBUTE_NAME] = json.dumps(
            (last.time, last.slip, last.point)
        )
    if isinstance(scene.parts.loading, SampledHistory):
        dataset = dataset.assign(
            history_samples=_build_loading_history_variable(scene.parts.loading)
        )
    if passed >= 0.0:
        text = (
            f"after {passed:.9g} D_c/V_* without inertia or radiation damping, so the motion "
            "has no physical meaning"
        )
        dataset[_INSTABILITY_TIME_QUANTITY.name] = (
            (),
            passed,
            _INSTABILITY_TIME_QUANTITY.variable_attributes,
        )
        dataset = dataset.assign_attrs({UNPHYSICAL_MOTION_ATTRIBUTE_NAME: text})
        if is_alone:
            warnings.warn(
                f"the slip rate exceeds the instability norm {text}", NoResultWarning, stacklevel=3
            )
    if status is not Status.OK:
        text = f"the motion ends after {max([0.0, *seen[-1:, 0]]):.6g} of {duration:g} D_c/V_*"
        warnings.warn(f"{text}: {status.label} ({message})", IncompleteWarning, stacklevel=3)
    return copy_with_cf_encoding(dataset)


def check_integrator_is_usable(integrator: Any) -> None:
    """Check the integrator of a public function.

    Parameters
    ----------
    integrator : Integrator
        Argument of the function.

    Raises
    ------
    InvalidValue
        If the argument is not an integrator, or if its engine is not installed.
    """
    if not isinstance(integrator, Integrator):
        remedy = "Pass integrator=integrator, as Measure.compute receives it."
        raise InvalidValue("integrator", integrator, "must be an Integrator", remedy=remedy)
    Engine.check_is_usable(integrator.engine)


def _convert_recording_to_dataset(
    scene: Scene, recorded_rows: np.ndarray, regime_names: Sequence[str]
) -> xr.Dataset:
    """Convert a recorded motion to a dataset with the dimension ``time``."""
    fluid = scene.parts.fluid.unknowns
    columns = {
        find_quantity(name): recorded_rows[:, column]
        for column, name in enumerate(MotionRecorder.MOTION_VARIABLE_NAMES)
    }
    first = MotionRecorder.FIRST_STATE_COLUMN_INDEX + scene.state_count - len(fluid)
    columns |= {about: recorded_rows[:, first + i] for i, about in enumerate(fluid)}
    after_law = MotionRecorder.FIRST_STATE_COLUMN_INDEX + scene.parts.law.state_count
    heat = scene.parts.temperature.unknowns
    columns |= {about: recorded_rows[:, after_law + i] for i, about in enumerate(heat)}
    if scene.parts.law.state_count > 1:
        of_law = range(scene.parts.law.state_count)
        columns |= {
            _build_state_variable_quantity(i + 1): recorded_rows[
                :, MotionRecorder.FIRST_STATE_COLUMN_INDEX + i
            ]
            for i in of_law
        }
    columns[find_quantity("load_point_displacement")] = (
        MotionRecorder.compute_load_point_displacement(scene, recorded_rows)
    )
    columns[find_quantity("friction_coefficient")] = MotionRecorder.get_friction_coefficient(
        recorded_rows
    )
    dataset = xr.Dataset(
        {
            q.name: ("time", values, build_motion_variable_attributes(q, scene))
            for q, values in columns.items()
        }
    )
    flags = {
        "long_name": find_quantity("regime").long_name,
        "flag_values": np.arange(len(regime_names), dtype=np.int8),
        "flag_meanings": " ".join(regime_names),
    }
    dataset["regime"] = (
        "time",
        recorded_rows[:, MotionRecorder.REGIME_COLUMN_INDEX].astype(np.int8),
        flags,
    )
    about_rate = find_quantity("reference_rate").variable_attributes
    dataset["reference_rate"] = (), scene.reference_rate, about_rate
    return dataset.set_coords(["slip", "reference_rate"])


def build_motion_variable_attributes(quantity: Quantity, scene: Scene) -> dict[str, Any]:
    """Return the attributes of a variable of a motion.

    In a scene with radiation damping, the radiation damping stress at V_* is subtracted from
    variables that are derived from the spring stress. The long names of these variables mention the
    subtraction. Because of the subtraction, spring stress and frictional stress are equal in steady
    sliding at V_*.

    Parameters
    ----------
    quantity : Quantity
        Quantity of the variable.
    scene : Scene
        Scene of the motion.

    Returns
    -------
    dict
        Attributes of the variable.
    """
    attributes = quantity.variable_attributes
    if (
        quantity.name in _VARIABLES_DERIVED_FROM_SPRING_STRESS
        and scene.dynamics.radiated_stress_slope(0.0)
    ):
        attributes["long_name"] += " minus the radiation damping stress at V_star"
    return attributes


def _build_state_variable_quantity(state_number: int) -> Quantity:
    """Return the ``Quantity`` that describes one state variable of a law with several states."""
    about = (
        f"contribution of state {state_number} of the law to the friction coefficient, without "
        "changes due to stress"
    )
    return Quantity(f"state_{state_number}", rf"$\Psi_{{{state_number}}}$", "1", about)


def _read_final_state_of_motion(motion: object, scene: Scene) -> Event:
    """Return the state of the slider at the end of a stored motion."""
    if not isinstance(motion, xr.Dataset) or MOTION_END_STATE_ATTRIBUTE_NAME not in motion.attrs:
        remedy = "Pass a motion from simulate that did not end early."
        raise InvalidValue("start", motion, "must be a complete motion", remedy=remedy)
    if json.loads(motion.attrs["scene"]) != json.loads(json.dumps(scene.describe())):
        remedy = "Pass the scene of the motion, motion.rsf.scene."
        raise InvalidValue(
            "start", motion.attrs["title"], "must be the scene of the motion", remedy=remedy
        )
    time, slip, numbers = json.loads(motion.attrs[MOTION_END_STATE_ATTRIBUTE_NAME])
    point = MotionPoint._make(tuple(x) if isinstance(x, list) else x for x in numbers)
    return Event(EventKind.END, None, time, slip, point, "", 0, 0.0)


def _build_loading_history_variable(history: SampledHistory) -> xr.Variable:
    """Convert the samples of a loading history to a variable.

    The loading of the scene can be recreated from the variable.
    """
    about = {
        "long_name": "time, load point velocity, decrease and rate of normal stress of the loading",
        "of_stress": int(history.of_stress),
        **({"of_pressure": 1} if history.of_pressure else {}),
    }
    return xr.Variable(("history_sample", "history_column"), history.sample_table, about)


def _compute_log_instability_slip_rate(scene: Scene) -> float:
    """Return the value of ln(V/V_*) above which a motion is unphysical."""
    if scene.has_mass or scene.dynamics.radiated_stress_slope(0.0):
        return math.inf
    loads = np.asarray(scene.parts.loading.segment_table)[:, SEGMENT_VELOCITY]
    fastest = math.log(max(1.0, float(abs(loads).max())))
    norm = scene.log_slip_rate_at_instability
    return norm if norm > fastest else fastest + math.log(_INSTABILITY_SLIP_RATE_OVER_LOAD_RATE)


def _compute_default_duration(scene: Scene) -> float:
    """Return the default duration of a motion, given its loading."""
    loading = scene.parts.loading
    stated = float(loading.segment_table[-1][SEGMENT_START])
    if isinstance(loading, SampledHistory) or (
        isinstance(loading, UserLoading) and loading.duration > stated
    ):
        return loading.duration
    if len(loading.segments) == 1:
        return _DEFAULT_DURATION
    return stated + (
        _DISPLACEMENT_AFTER_PROTOCOL / abs(scene.load_velocity)
        if scene.load_velocity
        else _DEFAULT_DURATION
    )


def _check_requested_times(
    times: Any, duration: float | None, start_time: float
) -> np.ndarray | None:
    """Check the requested times, and convert them to an array of shape (n,).

    The result is None if no times are requested.
    """
    if times is None:
        return None
    if duration is not None:
        raise InvalidValue(
            "duration",
            duration,
            "cannot be combined with 'times'. Pass either 'duration' or 'times'",
        )
    given = np.array(times, dtype=object)
    if not all(isinstance(time, Real) and not isinstance(time, bool) for time in given.flat):
        raise InvalidValue("times", times, "must contain numbers, in units of D_c/V_*")
    at = given.astype(float)
    right = (
        at.ndim == 1
        and at.size
        and np.isfinite(at).all()
        and at[0] >= start_time
        and at[-1] > start_time
    )
    if not right or not (np.diff(at) > 0.0).all():
        rule = (
            f"must be a one-dimensional list of increasing finite numbers that begins at "
            f"{start_time:g} or later"
        )
        raise InvalidValue("times", times, rule)
    return at


def make_row_times_strictly_increasing(recorded_rows: np.ndarray) -> np.ndarray:
    """Return a recorded motion with strictly increasing times.

    The first row of a regime (form of the equations of motion) has the same time as the last row of
    the previous regime. The first row of a segment of the loading has the same time as the last row
    of the previous segment. If the two rows are equal, the first row is removed. Otherwise, the
    time of the second row is increased by a few units in the last place. Some ruptures are so short
    that successive times are equal in floating-point arithmetic. These times are increased in the
    same way.

    Parameters
    ----------
    recorded_rows : numpy.ndarray of shape (rows, columns)
        Recorded motion. The first column is time.

    Returns
    -------
    numpy.ndarray
        Recorded motion with strictly increasing times.
    """
    same = (
        np.diff(
            np.delete(
                recorded_rows,
                [MotionRecorder.REGIME_COLUMN_INDEX, MotionRecorder.SAMPLE_NUMBER_COLUMN_INDEX],
                axis=1,
            ),
            axis=0,
        )
        == 0.0
    ).all(axis=1)
    recorded_rows = recorded_rows[
        ~np.append(same, np.zeros(min(len(recorded_rows), 1), dtype=bool))
    ]
    times, earliest = recorded_rows[:, 0].tolist(), -math.inf
    for place, time in enumerate(times):
        times[place] = max(time, earliest)
        earliest = times[place] + max(_MIN_TIME_ULPS * math.ulp(times[place]), _MIN_TIME_DIFFERENCE)
    recorded_rows[:, 0] = times
    return recorded_rows


def check_is_scene(value: object) -> None:
    """Raise ``InvalidValue`` if an object is not a scene.

    Parameters
    ----------
    value : object
        Object to check.

    Raises
    ------
    InvalidValue
        If the object is not a scene.
    """
    if not isinstance(value, Scene):
        remedy = "Create a scene with rsfstudy.Scene(...). For studies, use rsfstudy.run."
        raise InvalidValue("scene", value, "must be a Scene", remedy=remedy)
