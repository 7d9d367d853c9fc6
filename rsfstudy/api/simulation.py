"""One motion of one scene, as a labelled trajectory."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Sequence
from numbers import Real
from typing import Any, Never

import numpy as np
import xarray as xr

from rsfstudy.error_boundary import error_boundary
from rsfstudy.errors import IncompleteWarning, InvalidValue, NoResultWarning, shorten_text
from rsfstudy.execution import provenance_attributes
from rsfstudy.motion import (
    DEFAULT_EVALUATION_BUDGET,
    DEFAULT_RTOL,
    FIRST_STATE_COLUMN,
    MOTION_VARIABLES,
    REGIME_COLUMN,
    SAMPLE_COLUMN,
    SCIPY,
    Accuracy,
    Event,
    EventKind,
    MotionStopped,
    Recording,
    WorkMeter,
    check_engine_is_usable,
    integrate_events,
    larger_budget_remedy,
    recorded_friction_coefficient,
    recorded_load_point_displacement,
    rise,
)
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.parts import SEGMENT_START, SEGMENT_VELOCITY
from rsfstudy.quantities import Quantity
from rsfstudy.slider import RUPTURE_REGIME, MotionPoint, SampledHistory, Scene, UserLoading
from rsfstudy.status import Status
from rsfstudy.vocabulary import find_quantity

#: Times that follow each other differ by so many floating-point numbers, and by so much, at least:
#: they still differ in other units, where each is rounded anew.
_MIN_TIME_ULPS, _MIN_TIME_DIFFERENCE = 4, 1e-290

#: Time that a step is followed for, and load point displacement beyond what a protocol states.
_DEFAULT_DURATION, _DISPLACEMENT_AFTER_PROTOCOL = 50.0, 20.0
_NOTHING_STEPPED_MESSAGE = (
    "nothing is stepped: the motion is steady sliding at V_*. State load_velocity_ratio, "
    "displacement_step, hold_time, velocity_steps, loading or initial_state in the scene."
)
_INSTABILITY_TIME_LONG_NAME = "time at which slip rate first passed the instability norm"
_INSTABILITY_TIME_QUANTITY = Quantity(
    "instability_time", "$t V_*/D_c$", "1", _INSTABILITY_TIME_LONG_NAME, "D_c/V_*"
)
#: Attribute that says from when on a motion is no physics.
BEYOND_NORM_ATTRIBUTE_NAME = "beyond_instability_norm"
#: Attribute that holds time, slip and point of the end of a motion.
MOTION_END_ATTRIBUTE_NAME = "end"
#: Slip rate over that of the load point that counts as instability where the load point alone
#: reaches the norm, as it may where the period is not that of the slider.
_INSTABILITY_SLIP_RATE_OVER_LOAD_RATE = 1e6
#: Variables along motions that are made of spring stress.
_VARIABLES_OF_SPRING_STRESS = ("shear_stress", "friction_coefficient")
#: Those of our own dynamics; others stand behind them.
_STANDARD_REGIMES = ("quasi_static", "slow_manifold", RUPTURE_REGIME, "quasi_dynamic")


@error_boundary
def simulate(
    scene: Scene,
    *extra_positional_arguments: Never,
    duration: float | None = None,
    times: Sequence[float] | np.ndarray | None = None,
    start: xr.Dataset | None = None,
    rtol: float = DEFAULT_RTOL,
    budget: int = DEFAULT_EVALUATION_BUDGET,
    engine: Any = SCIPY,
    accuracy: Accuracy | None = None,
    meter: WorkMeter | None = None,
) -> xr.Dataset:
    """Follow the motion of a scene from the instant after its step.

    Parameters
    ----------
    scene : Scene
        The slider, its effects and its loading.
    duration : float, optional
        Time to follow it for, in D_c/V_*. By default 50; of a protocol, all that it states, and 20
        D_c of the load point beyond where it does not say how long its last segment lasts.
    times : sequence of float, optional
        Times in D_c/V_* at which to tell what the slider does, to the accuracy of the motion; with
        mass, but for the inertial time after a step, in which slip rate follows: of that only where
        it ends is told. By default all of it is told, several times within each step.
    start : xarray.Dataset, optional
        A motion of this scene, from whose end it goes on as if uninterrupted: time, slip and
        loading do. A duration counts from there.
    rtol : float
        Accuracy of the motion.
    budget : int
        Right-hand sides it may cost.
    engine : {"scipy", "python", "compiled"}, or type
        What integrates; compiled, which needs Numba, is much faster. A stepper of your own is given
        by its class.
    accuracy, meter : Accuracy and WorkMeter, optional
        The arguments of `Measure.compute`, if you call `simulate` in a user-defined measure. They
        replace `rtol`, `budget` and `engine`; the right-hand sides count as work of the cell, and a
        motion that cannot go on ends the cell with its status.

    Returns
    -------
    xarray.Dataset
        ``slip``, ``log10_slip_rate``, ``shear_stress`` (of the spring), ``frictional_stress``,
        ``normal_stress_ratio`` (effective), ``state_variable``, ``regime``, and what a rig reads,
        ``load_point_displacement`` and ``friction_coefficient`` (spring stress over normal stress
        less pore pressure outside the fault), along ``time``; ``porosity`` and ``pore_pressure`` of
        a dilatant fault; and of a law with several states ``state_1``, ``state_2`` and so on, each
        freed of what stress has taken from it: where stress takes nothing, they add up to
        ``state_variable``.
        Time strictly increases: where a quantity jumps at an instant, what it was is kept at that
        time and what it then is a few floating-point numbers later, as are the points of a rupture
        too short for its times to differ. A motion that cannot go on ends early, with its
        ``status`` and ``message`` in the attributes. With radiation damping, ``shear_stress`` is
        the spring stress less the damping stress at V_*, ``eta V_*``, so that it equals the
        frictional stress in steady sliding at V_*. Beyond the instability norm a motion with
        neither mass nor radiation damping is no physics: from when on, say ``instability_time`` and
        the attribute ``beyond_instability_norm``. (Where the load point itself is beyond the norm:
        from a million times its velocity.)

    Raises
    ------
    InvalidValue
        For a start that is no motion of this scene with an end; for a duration that is not positive
        and finite, or is given without its name; and for times that do not increase, or beside a
        duration.

    Warns
    -----
    IncompleteWarning
        Where the motion ends early, with the status and the reason.
    NoResultWarning
        Where nothing is stepped: the slider goes on as it began, in steady sliding at V_*. And
        where it passes the instability norm with neither mass nor radiation damping.
    """
    if extra_positional_arguments:
        remedy = f"Write duration={shorten_text(extra_positional_arguments[0])}, in D_c/V_*."
        raise InvalidValue(
            "simulate", extra_positional_arguments[0], "is given without a name", remedy=remedy
        )
    check_scene(scene)
    since = None if start is None else _read_end_of_motion(start, scene)
    began = since.time if since else 0.0
    at = _check_requested_times(times, duration, began)
    if at is not None:
        duration = float(at[-1]) - began
    duration = _loading_duration(scene) - began if duration is None else duration
    known = isinstance(duration, int | float | np.number) and not isinstance(duration, bool)
    if not (known and 0.0 < duration < math.inf):
        remedy = "It is in D_c/V_*; rig.dimensionless converts units of a rig."
        raise InvalidValue("duration", duration, "must be positive and finite", remedy=remedy)
    is_alone = accuracy is None and meter is None
    if is_alone:
        accuracy = Accuracy(rtol, budget, engine=engine)
        meter = WorkMeter(budget, engine=accuracy.engine)
    if not (isinstance(accuracy, Accuracy) and isinstance(meter, WorkMeter)):
        rule = "must be an Accuracy and a WorkMeter"
        remedy = "Pass accuracy=accuracy, meter=meter, as Measure.compute receives them."
        raise InvalidValue("accuracy, meter", (accuracy, meter), rule, remedy=remedy)
    check_engine_is_usable(accuracy.engine)
    if is_alone and not scene.is_perturbed:
        warnings.warn(_NOTHING_STEPPED_MESSAGE, NoResultWarning, stacklevel=3)
    spent, by_regime = meter.evaluations, dict(meter.evaluations_by_regime)
    recording = Recording(list(_STANDARD_REGIMES), at)
    status, message, limit, passed = (
        Status.OK,
        "",
        _log_slip_rate_limit_of_instability(scene),
        math.nan,
    )
    watches = [rise("log_slip_rate", limit)] if limit < math.inf else []
    until = began + duration if at is None else float(at[-1])
    moving = integrate_events(
        scene, accuracy, meter, watches, recording=recording, until=until, resume_from=since
    )
    try:
        for last in moving:
            if math.isnan(passed) and (last.specification or last.point.log_slip_rate >= limit):
                passed = last.time
    except MotionStopped as halt:
        if not is_alone:
            raise
        status, message = halt.status, str(halt)
        if status is Status.WORK_BUDGET_SPENT:
            message += larger_budget_remedy(budget)
    seen = recording.as_table(scene)
    seen = with_increasing_times(seen) if at is None else seen
    dataset = _recording_to_dataset(scene, seen, recording.regime_names)
    dataset = dataset.assign_attrs(
        {
            "title": f"Motion of a spring-slider, {scene.law} law",
            "Conventions": "CF-1.11",
            "scene": json.dumps(scene.describe()),
            "effects": " ".join(scene.effects) or "none",
            "status": status.label,
            "message": message,
            "duration": duration,
            "told": "as it moves" if at is None else "at times that were asked for",
            "rtol": accuracy.rtol,
            "budget": accuracy.budget,
            "engine": accuracy.engine,
            "rhs_evaluations": meter.evaluations - spent,
            "rhs_evaluations_by_regime": json.dumps(
                {
                    regime: n - by_regime.get(regime, 0)
                    for regime, n in meter.evaluations_by_regime.items()
                }
            ),
            **provenance_attributes("rsfstudy.simulate"),
        }
    )
    if status is Status.OK:
        dataset.attrs[MOTION_END_ATTRIBUTE_NAME] = json.dumps((last.time, last.slip, last.point))
    if isinstance(scene.parts.loading, SampledHistory):
        dataset = dataset.assign(history_samples=_build_history_variable(scene.parts.loading))
    if passed >= 0.0:
        text = f"from {passed:.9g} D_c/V_* on, with neither mass nor radiation damping: no physics"
        dataset[_INSTABILITY_TIME_QUANTITY.name] = (
            (),
            passed,
            _INSTABILITY_TIME_QUANTITY.attributes,
        )
        dataset = dataset.assign_attrs({BEYOND_NORM_ATTRIBUTE_NAME: text})
        if is_alone:
            warnings.warn(f"beyond the instability norm {text}", NoResultWarning, stacklevel=3)
    if status is not Status.OK:
        text = f"the motion ends after {max([0.0, *seen[-1:, 0]]):.6g} of {duration:g} D_c/V_*"
        warnings.warn(f"{text}: {status.label} ({message})", IncompleteWarning, stacklevel=3)
    return copy_with_cf_encoding(dataset)


def _recording_to_dataset(
    scene: Scene, recorded_rows: np.ndarray, regime_names: Sequence[str]
) -> xr.Dataset:
    """Convert the rows of a recording to a dataset along time."""
    fluid = scene.parts.fluid.unknowns
    columns = {
        find_quantity(name): recorded_rows[:, column]
        for column, name in enumerate(MOTION_VARIABLES)
    }
    first = FIRST_STATE_COLUMN + scene.state_count - len(fluid)
    columns |= {about: recorded_rows[:, first + i] for i, about in enumerate(fluid)}
    if scene.parts.law.state_count > 1:
        of_law = range(scene.parts.law.state_count)
        columns |= {
            _state_quantity(i + 1): recorded_rows[:, FIRST_STATE_COLUMN + i] for i in of_law
        }
    columns[find_quantity("load_point_displacement")] = recorded_load_point_displacement(
        scene, recorded_rows
    )
    columns[find_quantity("friction_coefficient")] = recorded_friction_coefficient(recorded_rows)
    dataset = xr.Dataset(
        {
            q.name: ("time", values, motion_variable_attributes(q, scene))
            for q, values in columns.items()
        }
    )
    flags = {
        "long_name": find_quantity("regime").long_name,
        "flag_values": np.arange(len(regime_names), dtype=np.int8),
        "flag_meanings": " ".join(regime_names),
    }
    dataset["regime"] = "time", recorded_rows[:, REGIME_COLUMN].astype(np.int8), flags
    about_rate = find_quantity("reference_rate").attributes
    dataset["reference_rate"] = (), scene.reference_rate, about_rate
    return dataset.set_coords(["slip", "reference_rate"])


def motion_variable_attributes(quantity: Quantity, scene: Scene) -> dict[str, Any]:
    """Return the attributes of a variable of a motion.

    If the scene has radiation damping, spring stress is reported minus the radiation damping stress
    at V_*. Spring stress and frictional stress are then equal at V_*.
    """
    attributes = quantity.attributes
    if quantity.name in _VARIABLES_OF_SPRING_STRESS and scene.dynamics.radiated_stress_slope(0.0):
        attributes["long_name"] += " less the radiation damping stress at V_star"
    return attributes


def _state_quantity(state_number: int) -> Quantity:
    about = (
        f"state {state_number} of the law, as a part of the friction coefficient, freed of stress"
    )
    return Quantity(f"state_{state_number}", rf"$\Psi_{{{state_number}}}$", "1", about)


def _read_end_of_motion(motion: object, scene: Scene) -> Event:
    """The end of a motion of a scene, from which it can go on."""
    if not isinstance(motion, xr.Dataset) or MOTION_END_ATTRIBUTE_NAME not in motion.attrs:
        remedy = "Give a motion that simulate returned, and that lasted as long as was asked."
        raise InvalidValue("start", motion, "is no motion with an end", remedy=remedy)
    if json.loads(motion.attrs["scene"]) != json.loads(json.dumps(scene.describe())):
        remedy = "Give the scene of the motion itself, motion.rsf.scene."
        raise InvalidValue("start", motion.attrs["title"], "is of another scene", remedy=remedy)
    time, slip, numbers = json.loads(motion.attrs[MOTION_END_ATTRIBUTE_NAME])
    point = MotionPoint._make(tuple(x) if isinstance(x, list) else x for x in numbers)
    return Event(EventKind.END, None, time, slip, point, "", 0, 0.0)


def _build_history_variable(history: SampledHistory) -> xr.Variable:
    """The samples of a history, by which its scene can be made again."""
    about = {
        "long_name": "time, load point velocity, fall and rate of normal stress of the loading",
        "of_stress": int(history.of_stress),
        **({"of_pressure": 1} if history.of_pressure else {}),
    }
    return xr.Variable(("history_sample", "history_column"), history.sample_table, about)


def _log_slip_rate_limit_of_instability(scene: Scene) -> float:
    """ln(V/V_*) beyond which a motion is no physics."""
    if scene.has_mass or scene.dynamics.radiated_stress_slope(0.0):
        return math.inf
    loads = np.asarray(scene.parts.loading.segment_table)[:, SEGMENT_VELOCITY]
    fastest = math.log(max(1.0, float(abs(loads).max())))
    norm = scene.log_instability_rate
    return norm if norm > fastest else fastest + math.log(_INSTABILITY_SLIP_RATE_OVER_LOAD_RATE)


def _loading_duration(scene: Scene) -> float:
    """Time that the loading of a scene takes."""
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
    """Times that were asked for, checked."""
    if times is None:
        return None
    if duration is not None:
        raise InvalidValue("duration", duration, "give duration or times, not both")
    given = np.array(times, dtype=object)
    if not all(isinstance(time, Real) and not isinstance(time, bool) for time in given.flat):
        raise InvalidValue("times", times, "must be numbers, in D_c/V_*")
    at = given.astype(float)
    right = (
        at.ndim == 1
        and at.size
        and np.isfinite(at).all()
        and at[0] >= start_time
        and at[-1] > start_time
    )
    if not right or not (np.diff(at) > 0.0).all():
        rule = f"must increase from {start_time:g} or later, and be finite"
        raise InvalidValue("times", times, rule)
    return at


def with_increasing_times(table: np.ndarray) -> np.ndarray:
    """A recorded motion whose times strictly increase.

    A regime or segment begins with a row at the time at which another has ended. It takes the place
    of one that holds the same; where they differ, it follows a few floating-point numbers later, as
    do rows of a rupture shorter than the spacing of those numbers.
    """
    same = (np.diff(np.delete(table, [REGIME_COLUMN, SAMPLE_COLUMN], axis=1), axis=0) == 0.0).all(
        axis=1
    )
    table = table[~np.append(same, np.zeros(min(len(table), 1), dtype=bool))]
    times, earliest = table[:, 0].tolist(), -math.inf
    for place, time in enumerate(times):
        times[place] = max(time, earliest)
        earliest = times[place] + max(_MIN_TIME_ULPS * math.ulp(times[place]), _MIN_TIME_DIFFERENCE)
    table[:, 0] = times
    return table


def check_scene(value: object) -> None:
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
        remedy = "Make one, rsfstudy.Scene(...); rsfstudy.run computes studies."
        raise InvalidValue("scene", value, "is no scene", remedy=remedy)
