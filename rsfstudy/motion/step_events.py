"""Detection of events within a step, and recording of samples.

``append_events_in_step`` and ``record_step`` are called by ``motion_loop.integrate_one_regime``
after each step. Each event occurs at a root of a quantity, such as a derivative of ln V. If the
quantity changes sign between the ends of the step, the root is located with dense output. Samples
are recorded at even intervals within each step, or at requested times or slips.
"""

from __future__ import annotations

import math
from typing import Any

from rsfstudy.motion.array_layout import (
    APPARENT_FRICTION,
    APPARENT_FRICTION_RATE,
    EVENT_CLOCK,
    EVENT_CODE,
    EVENT_EVALUATIONS,
    EVENT_POINT,
    EVENT_REGIME,
    EVENT_SLIP,
    EVENT_SPECIFICATION_COLUMNS,
    EVENT_TIME,
    FIRST_STATE,
    FRICTION_COEFFICIENT,
    FRICTIONAL_STRESS,
    KINK_CODE,
    LOG_SLIP_RATE,
    LOG_SLIP_RATE_GROWTH,
    MAXIMUM,
    MINIMUM,
    NORMAL_STRESS_RATIO,
    RECORD_AT_TIMES,
    RECORD_NEVER,
    RECORD_WITHIN_STEPS,
    RISE,
    SETTLED,
    SLOW_REGIME,
    SPEC_KIND,
    SPEC_LEVEL,
    SPEC_MAX_DISTANCE,
    SPEC_MAX_FRICTION_DISTANCE,
    SPEC_MAY_DEFER,
    SPEC_QUANTITY,
    SPEC_TERMINAL,
    SPRING_STRESS,
    START_CODE,
    STATE_VARIABLE,
    STEADY_STATE_DISTANCE,
    STEADY_STATE_OFFSET,
)
from rsfstudy.motion.array_operations import advance_pointer_by_items
from rsfstudy.motion.recording import (
    FIRST_STATE_COLUMN,
    REGIME_COLUMN,
    SAMPLE_COLUMN,
    SAMPLES_PER_STEP,
)
from rsfstudy.motion.regime_switching import (
    compute_inertia_effect_over_limit,
    compute_margin_to_termination,
)
from rsfstudy.motion.root_finding import build_root_finder
from rsfstudy.motion.step_integration import (
    evaluate_point_at_clock,
    time_at_step_begin,
    time_at_step_end,
    time_since_regime_start,
)
from rsfstudy.motion.steppers import interpolate_unknowns
from rsfstudy.parts import LOAD_VELOCITY, LOG_LOAD_VELOCITY, STIFFNESS, B

#: Conditions whose roots are located in addition to the requested events: the end of the regime, a
#: target time, and the termination of the motion. The values are floats because Numba would compile
#: a separate function for each integer literal.
SWITCH_CONDITION, TIME_CONDITION, TERMINATION_CONDITION = -1.0, -2.0, -3.0
#: Factor for the level of a SETTLED event. A SETTLED event occurs if two conditions are met. The
#: first condition compares all unknowns with the level. The second condition compares the slip rate
#: and the sum of the states with the level multiplied by the factor. Without the second condition,
#: the decrease of one initially very large unknown could end the motion although the slip rate
#: still changes.
SETTLED_LEVEL_FACTOR_FOR_RATE_AND_STATES = 10.0
#: Return values of ``find_jump_side_of_event``.
NO_EVENT, BEFORE_JUMP, AFTER_JUMP = range(3)


def evaluate_event_quantity(event_spec, point_columns, parameters):
    """Return the quantity that changes sign at an event.

    For an extremum, the result is the derivative of the requested quantity. For a crossing, the
    result is the difference between the requested quantity and the level.

    Parameters
    ----------
    event_spec : array
        Row of the table of event specifications.
    point_columns : array of shape (FIRST_STATE + states,)
        Point of the motion. The columns are numbered in ``array_layout``.
    parameters : array
        Parameters of the scene.

    Returns
    -------
    float
        Derivative or difference. The sign changes at the event.
    """
    if event_spec[SPEC_KIND] == MAXIMUM or event_spec[SPEC_KIND] == MINIMUM:
        if event_spec[SPEC_QUANTITY] == LOG_SLIP_RATE:
            return point_columns[LOG_SLIP_RATE_GROWTH]
        if event_spec[SPEC_QUANTITY] == APPARENT_FRICTION:
            return point_columns[APPARENT_FRICTION_RATE]
        return parameters[LOG_LOAD_VELOCITY] - point_columns[LOG_SLIP_RATE]
    return point_columns[int(event_spec[SPEC_QUANTITY])] - event_spec[SPEC_LEVEL]


def get_event_specification(workspace, spec_index):
    """Return the table row of an event specification.

    Parameters
    ----------
    workspace : Workspace
        Arrays of the regime.
    spec_index : int
        Index of the event specification.

    Returns
    -------
    array
        Row of the table. The columns are ``array_layout.EVENT_SPECIFICATION_COLUMNS``.
    """
    return advance_pointer_by_items(
        workspace.event_specs, len(EVENT_SPECIFICATION_COLUMNS) * spec_index
    )


def has_deferrable_event(workspace):
    """Return True if the report of any requested event may be deferred.

    Parameters
    ----------
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    bool
        True if at least one event specification has the flag ``SPEC_MAY_DEFER``.
    """
    found = False
    for w in range(workspace.event_spec_count):
        found = found or get_event_specification(workspace, w)[SPEC_MAY_DEFER] != 0.0
    return found


def compute_excess_over_switch_threshold(motion, workspace, point_columns):
    """Return the excess of the inertia effect over the slow-manifold limit.

    The excess is at least zero if the motion must leave the slow manifold. In ruptures, and for
    motions without inertia, the function returns -1.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    point_columns : array of shape (FIRST_STATE + states,)
        Point of the motion. The columns are numbered in ``array_layout``.

    Returns
    -------
    float
        Ratio of the inertia effect to its limit, minus 1.
    """
    if motion.regime != SLOW_REGIME or not motion.has_mass:
        return -1.0
    missing = point_columns[SPRING_STRESS] - point_columns[FRICTIONAL_STRESS]
    return (
        compute_inertia_effect_over_limit(
            point_columns[LOG_SLIP_RATE], missing, workspace.switch_thresholds
        )
        - 1.0
    )


def has_event_occurred(event_spec, quantity_before, quantity_after, clock_direction):
    """Return True if a quantity changes sign in the direction of an event.

    Parameters
    ----------
    event_spec : array
        Row of the table of event specifications.
    quantity_before : float
        Value of ``evaluate_event_quantity`` at the beginning of the interval.
    quantity_after : float
        Value of ``evaluate_event_quantity`` at the end of the interval.
    clock_direction : float
        Direction of the independent variable, 1 or -1.

    Returns
    -------
    bool
        True if the event occurs between the beginning and the end of the interval.
    """
    upwards = event_spec[SPEC_KIND] == RISE or event_spec[SPEC_KIND] == MINIMUM
    # If the integration runs backward, derivatives change sign in the opposite direction.
    if clock_direction < 0.0 and (
        event_spec[SPEC_KIND] == MAXIMUM or event_spec[SPEC_KIND] == MINIMUM
    ):
        upwards = not upwards
    if upwards:
        return quantity_before < 0.0 <= quantity_after
    return quantity_before > 0.0 >= quantity_after


def evaluate_condition_at_clock(clock, condition_context):
    """Evaluate a condition within the step, for the root finder.

    Parameters
    ----------
    clock : float
        Independent variable, between the beginning and the end of the step.
    condition_context : tuple of (float, record, Workspace)
        Condition, state of the motion and arrays of the regime. The condition is the index of an
        event specification, ``SWITCH_CONDITION``, ``TIME_CONDITION`` or ``TERMINATION_CONDITION``.

    Returns
    -------
    float
        Value of the condition. The value is zero at the root.
    """
    what, motion, workspace = condition_context
    if what == TIME_CONDITION:
        interpolate_unknowns(motion, workspace, clock)
        return (
            motion.regime_start_time
            + time_since_regime_start(motion, workspace, workspace.y_within)
            - motion.target_time
        )
    evaluate_point_at_clock(motion, workspace, clock)
    if what == SWITCH_CONDITION:
        return compute_excess_over_switch_threshold(motion, workspace, workspace.point_within)
    if what == TERMINATION_CONDITION:
        return compute_margin_to_termination(
            workspace.point_within[LOG_SLIP_RATE],
            workspace.point_within[NORMAL_STRESS_RATIO],
            workspace.parameters[LOAD_VELOCITY],
        )
    return evaluate_event_quantity(
        get_event_specification(workspace, int(what)), workspace.point_within, workspace.parameters
    )


_find_clock_where_condition_is_zero = build_root_finder(evaluate_condition_at_clock)


def locate_sign_change(condition, value_at_begin, value_at_end, motion, workspace):
    """Locate the root of a condition within the step.

    The tolerance of the root is 1e-15 of the step size for ``TIME_CONDITION``, and 1e-13 of the
    step size for all other conditions.

    Parameters
    ----------
    condition : float
        Index of an event specification, ``SWITCH_CONDITION``, ``TIME_CONDITION`` or
        ``TERMINATION_CONDITION``.
    value_at_begin : float
        Value of the condition at the beginning of the step.
    value_at_end : float
        Value of the condition at the end of the step.
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    float
        Independent variable at the root.
    """
    width = abs(motion.end - motion.clock)
    finest, relative = (
        (1e-15 * width, 1e-15) if condition == TIME_CONDITION else (1e-13 * width, 1e-14)
    )
    given = condition, motion, workspace
    return _find_clock_where_condition_is_zero(
        motion.clock, motion.end, value_at_begin, value_at_end, finest, relative, given
    )


def append_event_row(motion, event_table, event_code, clock, time, point_columns, parameters):
    """Append an event to the event table.

    Parameters
    ----------
    motion : record
        State of the motion.
    event_table : array of shape (rows, EVENT_POINT + FIRST_STATE + states)
        Output table of events.
    event_code : float
        Index of an event specification, or a code such as ``START_CODE``.
    clock : float
        Independent variable at the event.
    time : float
        Time of the event since the start of the loading segment, in D_c/V_*.
    point_columns : array of shape (FIRST_STATE + states,)
        Point of the motion at the event.
    parameters : array
        Parameters of the scene.
    """
    n = motion.event_rows
    event_table[n, EVENT_CODE], event_table[n, EVENT_REGIME], event_table[n, EVENT_CLOCK] = (
        event_code,
        motion.regime,
        clock,
    )
    event_table[n, EVENT_TIME] = motion.time + time
    event_table[n, EVENT_SLIP] = slip_since_start(
        motion, clock, time, point_columns[SPRING_STRESS], parameters
    )
    event_table[n, EVENT_EVALUATIONS] = motion.evaluations_slow + motion.evaluations_fast
    for i in range(event_table.shape[1] - EVENT_POINT):
        event_table[n, EVENT_POINT + i] = point_columns[i]
    motion.event_rows = n + 1


def append_step_end_event(motion, workspace, event_table, event_code):
    """Append an event at the end of the step to the event table.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    event_table : array of shape (rows, EVENT_POINT + FIRST_STATE + states)
        Output table of events.
    event_code : int
        Code of the event, ``END_CODE`` or ``SAMPLED_CODE``.
    """
    passed = time_at_step_end(motion, workspace)
    append_event_row(
        motion,
        event_table,
        float(event_code),
        motion.end,
        passed,
        workspace.point_at_end,
        workspace.parameters,
    )


def slip_since_start(motion, clock, time, spring_stress, parameters):
    r"""Compute the slip since the start of the motion.

    Slip is the independent variable of a rigid slider. For other sliders, slip is computed from the
    spring stress :math:`f = f_0 + K (V_0 t - \delta)`.

    Parameters
    ----------
    motion : record
        State of the motion.
    clock : float
        Independent variable at the point.
    time : float
        Time since the start of the loading segment, in D_c/V_*.
    spring_stress : float
        Spring stress at the point, in sigma_*.
    parameters : array
        Parameters of the scene.

    Returns
    -------
    float
        Slip in D_c.
    """
    if motion.slip_is_clock:
        return clock
    return motion.slip + (
        parameters[LOAD_VELOCITY] * time
        - (spring_stress - motion.spring_stress) / parameters[STIFFNESS]
    )


def append_start_events(motion, workspace, last_point, event_table):
    """Append the events at the start of a regime or segment.

    The first event is the start of the regime or segment, unless the start of the segment is not
    reported. The function also appends requested events that occur at the jump between the previous
    and the new regime or segment.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    last_point : array of shape (FIRST_STATE + states,)
        Last point of the motion before the start of the regime or segment.
    event_table : array of shape (rows, EVENT_POINT + FIRST_STATE + states)
        Output table of events.

    Returns
    -------
    bool
        True if an appended event ends the motion.
    """
    p, passed = workspace.parameters, time_at_step_begin(motion, workspace)
    p_before = workspace.parameters_before if motion.pending_start == KINK_CODE else p
    if motion.pending_start != KINK_CODE or motion.kinks_ahead < motion.reported_kinks:
        append_event_row(
            motion,
            event_table,
            float(motion.pending_start),
            motion.clock,
            passed,
            workspace.point_at_begin,
            p,
        )
    if motion.pending_start == START_CODE:
        return False
    for w in range(workspace.event_spec_count):
        spec = get_event_specification(workspace, w)
        jumps = find_jump_side_of_event(spec, last_point, p_before, workspace.point_at_begin, p)
        if jumps != NO_EVENT:
            columns = last_point if jumps == BEFORE_JUMP else workspace.point_at_begin
            append_event_row(motion, event_table, float(w), motion.clock, passed, columns, p)
            if spec[SPEC_TERMINAL]:
                return True
    return False


def find_jump_side_of_event(
    event_spec: Any,
    point_before: Any,
    parameters_before: Any,
    point_after: Any,
    parameters_after: Any,
) -> int:
    """Find the side of a jump at which a requested event is reported.

    Parameters
    ----------
    event_spec : array
        Row of the table of event specifications.
    point_before, point_after : array
        Columns of the points before and after the jump.
    parameters_before, parameters_after : array
        Parameters of the scene before and after the jump.

    Returns
    -------
    int
        ``NO_EVENT`` if the event does not occur. For an extremum of ln V, ``BEFORE_JUMP`` or
        ``AFTER_JUMP`` identifies the more extreme point. For other events the result is
        ``AFTER_JUMP``.
    """
    if event_spec[SPEC_KIND] == SETTLED:
        return NO_EVENT
    if not has_event_occurred(
        event_spec,
        evaluate_event_quantity(event_spec, point_before, parameters_before),
        evaluate_event_quantity(event_spec, point_after, parameters_after),
        1.0,
    ):
        return NO_EVENT
    x, y = point_before[LOG_SLIP_RATE], point_after[LOG_SLIP_RATE]
    kept = (event_spec[SPEC_KIND] == MAXIMUM and x > y) or (
        event_spec[SPEC_KIND] == MINIMUM and x < y
    )
    return BEFORE_JUMP if kept and event_spec[SPEC_QUANTITY] == LOG_SLIP_RATE else AFTER_JUMP


def locate_events_in_step(motion, workspace):
    """Locate all requested events within the step, and return their number.

    The function fills ``workspace.event_clocks`` with the values of the independent variable at the
    events, or NaN for events that do not occur.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    int
        Number of events in the step.
    """
    count, p = 0, workspace.parameters
    for w in range(workspace.event_spec_count):
        spec = get_event_specification(workspace, w)
        workspace.event_clocks[w] = math.nan
        if spec[SPEC_KIND] == SETTLED:
            against = (
                motion.may_reverse
                and p[LOAD_VELOCITY] * workspace.point_at_end[FRICTION_COEFFICIENT] < 0.0
            )
            if motion.kinks_ahead > 0 or against:
                continue
            apart = abs(workspace.point_at_end[LOG_SLIP_RATE] - p[LOG_LOAD_VELOCITY])
            away = max(apart, workspace.point_at_end[STEADY_STATE_DISTANCE] / abs(p[B]))
            friction = max(apart, abs(workspace.point_at_end[STEADY_STATE_OFFSET]) / abs(p[B]))
            spec[SPEC_MAX_DISTANCE] = max(spec[SPEC_MAX_DISTANCE], away)
            spec[SPEC_MAX_FRICTION_DISTANCE] = max(spec[SPEC_MAX_FRICTION_DISTANCE], friction)
            near = away < spec[SPEC_LEVEL] * spec[SPEC_MAX_DISTANCE]
            if (
                near
                and friction
                < SETTLED_LEVEL_FACTOR_FOR_RATE_AND_STATES
                * spec[SPEC_LEVEL]
                * spec[SPEC_MAX_FRICTION_DISTANCE]
            ):
                workspace.event_clocks[w] = motion.end
        else:
            before, after = (
                evaluate_event_quantity(spec, workspace.point_at_begin, p),
                evaluate_event_quantity(spec, workspace.point_at_end, p),
            )
            changes = before < 0.0 <= after or before > 0.0 >= after
            if changes and has_event_occurred(spec, before, after, motion.direction):
                workspace.event_clocks[w] = locate_sign_change(
                    float(w), before, after, motion, workspace
                )
        if not math.isnan(workspace.event_clocks[w]):
            count += 1
    return count


def append_events_in_step(motion, workspace, event_table):
    """Append the requested events within the step to the event table.

    The events are appended in the order of their occurrence.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    event_table : array of shape (rows, EVENT_POINT + FIRST_STATE + states)
        Output table of events.

    Returns
    -------
    int
        0 if there are no events, 1 if all events may be reported later, 2 if an event must be
        reported after this step, and 3 if an event ends the motion.
    """
    urgent, p = 0, workspace.parameters
    for _ in range(locate_events_in_step(motion, workspace)):
        first = -1
        for w in range(workspace.event_spec_count):
            later = (
                first >= 0
                and motion.direction * (workspace.event_clocks[w] - workspace.event_clocks[first])
                >= 0.0
            )
            if not math.isnan(workspace.event_clocks[w]) and not later:
                first = w
        clock = workspace.event_clocks[first]
        workspace.event_clocks[first] = math.nan
        if clock == motion.end:
            passed = time_at_step_end(motion, workspace)
            append_event_row(
                motion, event_table, float(first), clock, passed, workspace.point_at_end, p
            )
        else:
            evaluate_point_at_clock(motion, workspace, clock)
            passed = motion.regime_start_time + time_since_regime_start(
                motion, workspace, workspace.y_within
            )
            append_event_row(
                motion, event_table, float(first), clock, passed, workspace.point_within, p
            )
        spec = get_event_specification(workspace, first)
        urgent = max(urgent, 1 if spec[SPEC_MAY_DEFER] else 2)
        if spec[SPEC_TERMINAL]:
            return 3
    return urgent


# ---- samples -------------------------------------------------------------------------------------


def record_regime_start(motion, workspace, recording_table):
    """Record the beginning of a regime.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    """
    if motion.recording_mode == RECORD_WITHIN_STEPS:
        append_recorded_row(
            motion,
            recording_table,
            motion.clock,
            motion.regime_start_time,
            workspace.point_at_begin,
            workspace.parameters,
        )
        recording_table[motion.recorded_rows - 1, SAMPLE_COLUMN] = 0.0


def is_step_recorded(motion, workspace, requested_samples):
    """Return True if samples are recorded within the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    requested_samples : array
        Times in D_c/V_* or slips in D_c at which to record the motion, in increasing order.

    Returns
    -------
    bool
        In the mode ``RECORD_AT_TIMES``, True if the next requested time is before the end of the
        step. In the modes ``RECORD_WITHIN_STEPS`` and ``RECORD_AT_CLOCKS``, always True.
    """
    if motion.recording_mode != RECORD_AT_TIMES:
        return motion.recording_mode != RECORD_NEVER
    end = time_at_step_end(motion, workspace) + motion.time
    return (
        motion.samples_taken < len(requested_samples)
        and requested_samples[motion.samples_taken] < end
    )


def record_step(motion, workspace, recording_table, requested_samples, is_motion_over):
    """Record samples of the step, and return True after the last requested sample.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    requested_samples : array
        Times in D_c/V_* or slips in D_c at which to record the motion, in increasing order.
    is_motion_over : bool
        True if the motion or the loading segment ends with the step. Requested times up to
        ``motion.end_time`` are then recorded in spite of rounding errors.

    Returns
    -------
    bool
        True if the last requested sample was recorded in this step.
    """
    if motion.recording_mode == RECORD_WITHIN_STEPS:
        record_step_evenly_spaced(motion, workspace, recording_table)
        return False
    before = motion.samples_taken
    record_requested_samples(motion, workspace, recording_table, requested_samples, is_motion_over)
    return before < motion.samples_taken == len(requested_samples)


def record_step_evenly_spaced(motion, workspace, recording_table):
    """Record ``SAMPLES_PER_STEP`` samples of the step.

    The last sample is the end of the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    """
    for sample in range(1, SAMPLES_PER_STEP):
        clock = motion.clock + (motion.end - motion.clock) * (sample / SAMPLES_PER_STEP)
        record_at_clock(motion, workspace, recording_table, clock)
        recording_table[motion.recorded_rows - 1, SAMPLE_COLUMN] = sample
    passed = time_at_step_end(motion, workspace)
    append_recorded_row(
        motion, recording_table, motion.end, passed, workspace.point_at_end, workspace.parameters
    )
    recording_table[motion.recorded_rows - 1, SAMPLE_COLUMN] = SAMPLES_PER_STEP


def record_requested_samples(motion, workspace, recording_table, requested_samples, is_motion_over):
    """Record the requested samples within the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    requested_samples : array
        Times in D_c/V_* or slips in D_c at which to record the motion, in increasing order.
    is_motion_over : bool
        If True, the function also records the requested times between the end of the step and
        ``motion.end_time``.
    """
    at_begin, at_end = motion.clock, motion.end
    if motion.recording_mode == RECORD_AT_TIMES:
        at_begin = time_at_step_begin(motion, workspace)
        at_end = time_at_step_end(motion, workspace)
    last = motion.end_time if is_motion_over else at_end
    while (
        motion.samples_taken < len(requested_samples)
        and requested_samples[motion.samples_taken] - motion.time <= last
    ):
        asked = requested_samples[motion.samples_taken] - motion.time
        motion.samples_taken += 1
        if asked <= at_begin:
            passed = time_at_step_begin(motion, workspace)
            append_recorded_row(
                motion,
                recording_table,
                motion.clock,
                passed,
                workspace.point_at_begin,
                workspace.parameters,
            )
        elif asked >= at_end:
            passed = time_at_step_end(motion, workspace)
            append_recorded_row(
                motion,
                recording_table,
                motion.end,
                passed,
                workspace.point_at_end,
                workspace.parameters,
            )
        else:
            clock = asked
            if motion.recording_mode == RECORD_AT_TIMES:
                motion.target_time = asked
                clock = locate_sign_change(
                    TIME_CONDITION, at_begin - asked, at_end - asked, motion, workspace
                )
            record_at_clock(motion, workspace, recording_table, clock)


def record_at_clock(motion, workspace, recording_table, clock):
    """Record a sample at a value of the independent variable within the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    clock : float
        Independent variable, between the beginning and the end of the step.
    """
    evaluate_point_at_clock(motion, workspace, clock)
    passed = motion.regime_start_time + time_since_regime_start(
        motion, workspace, workspace.y_within
    )
    append_recorded_row(
        motion, recording_table, clock, passed, workspace.point_within, workspace.parameters
    )


def append_recorded_row(motion, recording_table, clock, time, point_columns, parameters):
    """Append a point of the motion to the recording table.

    The columns of the new row are in the order of ``recording.pack_recorded_row``.

    Parameters
    ----------
    motion : record
        State of the motion.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    clock : float
        Independent variable at the point.
    time : float
        Time since the start of the loading segment, in D_c/V_*.
    point_columns : array of shape (FIRST_STATE + states,)
        Point of the motion. The columns are numbered in ``array_layout``.
    parameters : array
        Parameters of the scene.
    """
    n = motion.recorded_rows
    recording_table[n, 0] = motion.time + (motion.end_time if time > motion.end_time else time)
    recording_table[n, 1] = slip_since_start(
        motion, clock, time, point_columns[SPRING_STRESS], parameters
    )
    recording_table[n, 2], recording_table[n, 3], recording_table[n, 4] = (
        point_columns[LOG_SLIP_RATE],
        point_columns[SPRING_STRESS],
        point_columns[FRICTIONAL_STRESS],
    )
    recording_table[n, 5], recording_table[n, 6], recording_table[n, 7] = (
        point_columns[NORMAL_STRESS_RATIO],
        point_columns[STATE_VARIABLE],
        point_columns[APPARENT_FRICTION],
    )
    recording_table[n, REGIME_COLUMN], recording_table[n, SAMPLE_COLUMN] = motion.regime, 0.0
    for i in range(motion.states):
        recording_table[n, FIRST_STATE_COLUMN + i] = point_columns[FIRST_STATE + i]
    motion.recorded_rows = n + 1
