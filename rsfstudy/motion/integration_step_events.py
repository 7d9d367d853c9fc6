"""Functions that detect the events within an integration step and at jumps in the loading.

``append_events_in_step`` is called by ``motion_loop.integrate_one_regime`` after each step. The
module ``integration_step_root_conditions`` locates the events.
"""

from __future__ import annotations

import math
from typing import Any

from rsfstudy.motion.array_layout import (
    EVENT_CLOCK,
    EVENT_CODE,
    EVENT_EVALUATIONS,
    EVENT_POINT,
    EVENT_REGIME,
    EVENT_SLIP,
    EVENT_TIME,
    FRICTION_COEFFICIENT,
    KINK_CODE,
    LOG_SLIP_RATE,
    MAXIMUM,
    MINIMUM,
    SETTLED,
    SPEC_KIND,
    SPEC_LEVEL,
    SPEC_MAX_DISTANCE,
    SPEC_MAX_FRICTION_DISTANCE,
    SPEC_MAY_REPORT_LATER,
    SPEC_QUANTITY,
    SPEC_TERMINAL,
    SPRING_STRESS,
    START_CODE,
    STEADY_STATE_DISTANCE,
    STEADY_STATE_OFFSET,
)
from rsfstudy.motion.integration_step_root_conditions import (
    evaluate_event_function,
    get_event_specification,
    has_event_occurred,
    locate_sign_change,
)
from rsfstudy.motion.integration_steps import (
    compute_slip_since_motion_start,
    compute_time_at_step_begin,
    compute_time_at_step_end,
    compute_time_since_regime_start,
    evaluate_point_within_step,
)
from rsfstudy.parts import LOAD_VELOCITY, LOG_LOAD_VELOCITY, B

#: Factor for the level of a SETTLED event. A SETTLED event occurs if two conditions are met. The
#: first condition compares all unknowns with the level. The second condition compares the slip rate
#: and the sum of the states with the level multiplied by the factor. Without the second condition,
#: the decrease of one initially very large unknown could end the motion although the slip rate
#: still changes.
SETTLED_LEVEL_FACTOR_FOR_RATE_AND_STATES = 10.0
#: Return values of ``find_jump_side_of_event``.
NO_EVENT, BEFORE_JUMP, AFTER_JUMP = range(3)


def append_event_row(
    motion, event_table, event_code, independent_variable, time, point_columns, parameters
):
    """Append an event to the event table.

    Parameters
    ----------
    motion : record
        State of the motion.
    event_table : array of shape (rows, EVENT_POINT + FIRST_STATE + states)
        Output table of events.
    event_code : float
        Index of an event specification, or a code such as ``START_CODE``.
    independent_variable : float
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
        independent_variable,
    )
    event_table[n, EVENT_TIME] = motion.time + time
    event_table[n, EVENT_SLIP] = compute_slip_since_motion_start(
        motion, independent_variable, time, point_columns[SPRING_STRESS], parameters
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
    passed = compute_time_at_step_end(motion, workspace)
    append_event_row(
        motion,
        event_table,
        float(event_code),
        motion.end,
        passed,
        workspace.point_at_end,
        workspace.parameters,
    )


def append_regime_or_segment_start_events(motion, workspace, last_point, event_table):
    """Append the events at the start of a regime or segment.

    The first event is the start of the regime or segment. The start event of a segment is omitted
    if the loading does not report the start of this segment. The function also appends requested
    events that occur at the jump between the previous and the new regime or segment.

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
    p, passed = workspace.parameters, compute_time_at_step_begin(motion, workspace)
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
    """Determine if an event at a jump is reported before or after the jump.

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
        evaluate_event_function(event_spec, point_before, parameters_before),
        evaluate_event_function(event_spec, point_after, parameters_after),
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
                evaluate_event_function(spec, workspace.point_at_begin, p),
                evaluate_event_function(spec, workspace.point_at_end, p),
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
            passed = compute_time_at_step_end(motion, workspace)
            append_event_row(
                motion, event_table, float(first), clock, passed, workspace.point_at_end, p
            )
        else:
            evaluate_point_within_step(motion, workspace, clock)
            passed = motion.regime_start_time + compute_time_since_regime_start(
                motion, workspace, workspace.y_within
            )
            append_event_row(
                motion, event_table, float(first), clock, passed, workspace.point_within, p
            )
        spec = get_event_specification(workspace, first)
        urgent = max(urgent, 1 if spec[SPEC_MAY_REPORT_LATER] else 2)
        if spec[SPEC_TERMINAL]:
            return 3
    return urgent
