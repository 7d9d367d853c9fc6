"""Functions that record a motion and estimate the errors of results read at one instant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rsfstudy.motion import (
    Event,
    EventKind,
    EventSpecification,
    Integrator,
    MotionRecorder,
    MotionStopped,
    estimate_neglected_inertia_error,
)
from rsfstudy.slider import Scene

#: Minimum error estimate of a result, divided by the requested relative accuracy. The minimum is
#: necessary because two runs may have the same error by chance.
ERROR_FLOOR_OVER_RTOL = 0.01
#: Minimum error estimate of the friction coefficient at a single instant, as a fraction of a times
#: the requested relative accuracy. Without this minimum, 22 of 7,071 results of random holds have
#: errors of up to 22 times their estimates. With the minimum, four results have errors of up to 1.7
#: times their estimates (study ``coverage``).
_FRICTION_ERROR_FLOOR_OVER_A_TIMES_RTOL = 0.1


class RecordedMotion(NamedTuple):
    """Record of a motion from the beginning of a loading segment.

    Parameters
    ----------
    events_at_segment_starts : list of Event
        Events at the beginning of the first recorded loading segment and of all later segments.
    friction_before_segments : list of float
        Friction coefficient immediately before the beginning of each segment. If the scene has
        inertia, the motion approaches the slow manifold within the inertial time after the
        beginning of a segment. The friction coefficient immediately after the beginning of a
        segment is the value on the slow manifold.
    peak_event : Event or None
        Requested extremum, or None if the motion has no extremum.
    end_event : Event
        Last event of the motion.
    recorded_rows : ndarray, shape (n, columns)
        Recorded samples. The columns are documented in ``rsfstudy.motion.recording``.
    neglected_inertia_error : ndarray, shape (n,)
        Error of ln V due to neglected inertia, accumulated up to each row. See
        ``rsfstudy.motion.neglected_inertia_error``.
    """

    events_at_segment_starts: list[Event]
    friction_before_segments: list[float]
    peak_event: Event | None
    end_event: Event
    recorded_rows: np.ndarray
    neglected_inertia_error: np.ndarray

    @property
    def start_event(self) -> Event:
        """Event at the beginning of the record."""
        return self.events_at_segment_starts[0]

    def get_neglected_inertia_error_until(self, time: float) -> float:
        """Return the error of ln V that results from neglecting inertia.

        Parameters
        ----------
        time : float
            Time up to which the error accumulates, in units of D_c/V_*.

        Returns
        -------
        float
            Error of ln V at this time, or at the end of the record if the record ends earlier.
        """
        row = min(int(np.searchsorted(self.recorded_rows[:, 0], time)), len(self.recorded_rows) - 1)
        return float(self.neglected_inertia_error[row])


def record_motion_until_peak(
    scene: Scene,
    integrator: Integrator,
    event_specs: Sequence[EventSpecification],
    first_segment_index: int,
    peak_segment_index: int,
    *,
    end_time: float = math.inf,
    allow_early_stop: bool = False,
) -> RecordedMotion:
    """Record a motion up to its first extremum in a loading segment.

    If there is no extremum, the record ends at the beginning of the next segment. If ``end_time``
    is given, the record ends at this time.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    integrator : Integrator
        Integrator with the requested accuracy.
    event_specs : sequence of EventSpecification
        Specification of the extremum, followed by other events that may end the motion.
    first_segment_index : int
        Index of the loading segment at which the record begins.
    peak_segment_index : int
        Index of the loading segment that contains the extremum.
    end_time : float, default: inf
        End time in units of D_c/V_*.
    allow_early_stop : bool, default: False
        If True, a ``MotionStopped`` exception after the extremum is ignored.

    Returns
    -------
    RecordedMotion
        The record and its extremum.

    Raises
    ------
    MotionStopped
        If the motion cannot continue.
    """
    recording, begun, peak = MotionRecorder(), list[Event](), None
    try:
        for event in integrator.follow(
            scene,
            event_specs,
            with_time=True,
            recording=recording,
            until=end_time,
        ):
            if event.kind in (EventKind.START, EventKind.SEGMENT_START):
                begun.append(event)
            elif (
                event.specification == event_specs[0]
                and len(begun) == peak_segment_index + 1
                and peak is None
            ):
                peak = event
            if end_time == math.inf and (peak is not None or len(begun) > peak_segment_index + 1):
                break
    except MotionStopped:
        if peak is None or not allow_early_stop:
            raise
    rows, start = recording.as_table(scene), Integrator.compute_point_before_start(scene)
    slow = recording.get_or_add_regime_index(scene.dynamics.regime_name)
    neglected = estimate_neglected_inertia_error(scene, rows, slow, start.log_slip_rate)
    shown = rows[:, 0] >= begun[first_segment_index].time
    rows, neglected = rows[shown], neglected[shown]
    # The other samples of the step that ends at the first row are not part of the record.
    rows[0, MotionRecorder.SAMPLE_NUMBER_COLUMN_INDEX] = 0.0
    friction, later = (
        MotionRecorder.get_friction_coefficient(rows),
        begun[max(first_segment_index, 1) :],
    )
    before = [float(friction[rows[:, 0] == each.time][0]) for each in later]
    if first_segment_index == 0:
        before.insert(0, start.apparent_friction)
    return RecordedMotion(begun[first_segment_index:], before, peak, event, rows, neglected)


def compute_motion_relative_to_start(
    start_event: Event, path_variables: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Return quantities along a record, with time and slip measured from the beginning.

    Parameters
    ----------
    start_event : Event
        Event at the beginning of the record.
    path_variables : mapping of str to ndarray
        Quantities along the record.

    Returns
    -------
    dict of str to ndarray
        Time and slip since the beginning, friction coefficient, and logarithm of the slip rate.
    """
    found = {name: path_variables[name] for name in ("friction_coefficient", "log10_slip_rate")}
    return {
        "time": path_variables["time"] - start_event.time,
        "slip": path_variables["slip"] - path_variables["slip"][0],
        **found,
    }


def estimate_error_at_instant(
    value: float,
    refined_value: float,
    friction_derivative: float,
    scene: Scene,
    integrator: Integrator,
    neglected_inertia_error: float = 0.0,
) -> float:
    r"""Estimate the error of a result that is read at a single instant.

    If the machine is stiff, numerical stability limits the time steps. Two runs may then have the
    same error at a single instant by chance. The error estimate therefore also includes a small
    fraction of the result, and the effect of a small error in the friction coefficient that
    determines the result.

    Parameters
    ----------
    value : float
        Result of the first run.
    refined_value : float
        Result of the refined run.
    friction_derivative : float
        Derivative of the result with respect to the friction coefficient from which the result is
        read.
    scene : Scene
        Scene of the motion.
    integrator : Integrator
        Integrator with the requested accuracy.
    neglected_inertia_error : float, default: 0.0
        Error of ln V that both runs share, because both runs neglect the same part of inertia.

    Returns
    -------
    float
        Error in the units of the result.

    Notes
    -----
    Let :math:`y` and :math:`y'` be the results of the first and of the refined run,
    :math:`\epsilon` the requested accuracy, and :math:`e` the error of :math:`\ln V` due to
    neglected inertia. The error is

    .. math:: 3\,|y - y'| + 0.01\,\epsilon\,|y| + (0.1\,\epsilon + e)\,a\,|dy/d\mu|,

    because friction changes by :math:`a` if :math:`\ln V` changes by 1.
    """
    friction = (
        integrator.result_tolerance(_FRICTION_ERROR_FLOOR_OVER_A_TIMES_RTOL)
        + neglected_inertia_error
    ) * scene.a
    error = integrator.estimate_error(value, refined_value, ERROR_FLOOR_OVER_RTOL)
    return error + friction * abs(friction_derivative)


def estimate_errors_at_instants(
    values: Mapping[str, float],
    refined_values: Mapping[str, float],
    friction_derivatives: Mapping[str, float],
    scene: Scene,
    integrator: Integrator,
    neglected_inertia_errors: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """Estimate the errors of several results that are read at single instants.

    The function ``estimate_error_at_instant`` documents the estimate.

    Parameters
    ----------
    values : mapping of str to float
        Results of the first run by name.
    refined_values : mapping of str to float
        Results of the refined run by name.
    friction_derivatives : mapping of str to float
        Derivatives of the results with respect to the friction coefficient.
    scene : Scene
        Scene of the motion.
    integrator : Integrator
        Integrator with the requested accuracy.
    neglected_inertia_errors : mapping of str to float, optional
        Errors of ln V by name of the result. By default, all errors are zero.

    Returns
    -------
    dict of str to float
        Errors by name, as ``<name>_error``.
    """
    shared = neglected_inertia_errors or dict.fromkeys(values, 0.0)
    return {
        f"{name}_error": estimate_error_at_instant(
            value, refined_values[name], friction_derivatives[name], scene, integrator, shared[name]
        )
        for name, value in values.items()
    }


def compute_settled_friction_flag(scene: Scene, *, is_friction_constant: bool) -> float:
    """Return 1 if friction has settled at the end of a record, and 0 if not.

    Friction has settled if it is nearly constant and if small perturbations of steady sliding do
    not grow.

    Parameters
    ----------
    scene : Scene
        Scene with the last loading segment of the record.
    is_friction_constant : bool
        True if friction is nearly constant at the end of the record.

    Returns
    -------
    float
        1, 0, or NaN if the growth rate of small perturbations is zero within its error.
    """
    if not is_friction_constant:
        return 0.0
    growth = scene.compute_largest_linear_growth_rate(scene.log_load_velocity)
    if growth is not None and growth.is_zero_within_error:
        return math.nan
    return 0.0 if growth is not None and growth.is_positive else 1.0
