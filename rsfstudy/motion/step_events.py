"""What lies within a step: events, located where a quantity changes sign and reported in their
order; and samples, evenly within each step, or at clocks or times asked for.
"""

from __future__ import annotations

import math
from typing import Any

from rsfstudy.motion.array_calls import offset_by
from rsfstudy.motion.layout import (
    APPARENT_FRICTION,
    APPARENT_FRICTION_RATE,
    EVENT_CLOCK,
    EVENT_CODE,
    EVENT_EVALUATIONS,
    EVENT_POINT,
    EVENT_REGIME,
    EVENT_SLIP,
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
    SPECIFICATION_COLUMNS,
    SPRING_STRESS,
    START_CODE,
    STATE_VARIABLE,
    STEADY_STATE_DISTANCE,
    STEADY_STATE_OFFSET,
)
from rsfstudy.motion.recording import (
    FIRST_STATE_COLUMN,
    REGIME_COLUMN,
    SAMPLE_COLUMN,
    SAMPLES_PER_STEP,
)
from rsfstudy.motion.regime_switching import inertia_weight, termination_margin
from rsfstudy.motion.roots import build_root_finder
from rsfstudy.motion.steppers import unknowns_at
from rsfstudy.motion.steps import evaluate_point_at, regime_time, time_at_begin, time_at_end
from rsfstudy.parts import LOAD_VELOCITY, LOG_LOAD_VELOCITY, STIFFNESS, B

#: What is read off a step beside event specifications: how far the regime is from being left, time
#: less that which is looked for, and how far the motion is from its end.
#: Not whole numbers, of each of which the compiler would make a case of its own.
SWITCH_CONDITION, TIME_CONDITION, TERMINATION_CONDITION = -1.0, -2.0, -3.0
#: Level of settling for slip rate and the sum of the states of the law, relative to the level for
#: all unknowns. One huge unknown cannot end a motion whose slip rate still changes.
FRICTION_DISTANCE_FACTOR = 10.0
#: Where something happens between two points.
NO_EVENT, BEFORE_JUMP, AFTER_JUMP = range(3)


def evaluate_quantity(spec, columns, p):
    """Quantity that changes sign where it happens: a slope, or the distance from a level."""
    if spec[SPEC_KIND] == MAXIMUM or spec[SPEC_KIND] == MINIMUM:
        if spec[SPEC_QUANTITY] == LOG_SLIP_RATE:
            return columns[LOG_SLIP_RATE_GROWTH]
        if spec[SPEC_QUANTITY] == APPARENT_FRICTION:
            return columns[APPARENT_FRICTION_RATE]
        return p[LOG_LOAD_VELOCITY] - columns[LOG_SLIP_RATE]
    return columns[int(spec[SPEC_QUANTITY])] - spec[SPEC_LEVEL]


def get_specification(space, number):
    """One of the event specifications."""
    return offset_by(space.specs, len(SPECIFICATION_COLUMNS) * number)


def has_deferrable_event(space):
    """True if the asker can wait for anything; for the beginning then, too."""
    found = False
    for w in range(space.spec_count):
        found = found or get_specification(space, w)[SPEC_MAY_DEFER] != 0.0
    return found


def switch_excess(motion, space, columns):
    """Not negative where the slow manifold has to be left; always negative elsewhere."""
    if motion.regime != SLOW_REGIME or not motion.has_mass:
        return -1.0
    missing = columns[SPRING_STRESS] - columns[FRICTIONAL_STRESS]
    return inertia_weight(columns[LOG_SLIP_RATE], missing, space.limits) - 1.0


def has_crossed(spec, before, after, direction):
    """True if a quantity that changes so has done what is watched for."""
    upwards = spec[SPEC_KIND] == RISE or spec[SPEC_KIND] == MINIMUM
    # against the clock, slopes change sign the other way round
    if direction < 0.0 and (spec[SPEC_KIND] == MAXIMUM or spec[SPEC_KIND] == MINIMUM):
        upwards = not upwards
    if upwards:
        return before < 0.0 <= after
    return before > 0.0 >= after


def evaluate_condition(clock, given):
    """Quantity of a specification, `SWITCH_CONDITION`, `TIME_CONDITION` or `TERMINATION_CONDITION`,
    at a clock within the step.
    """
    what, motion, space = given
    if what == TIME_CONDITION:
        unknowns_at(motion, space, clock)
        return (
            motion.regime_start_time
            + regime_time(motion, space, space.y_within)
            - motion.target_time
        )
    evaluate_point_at(motion, space, clock)
    if what == SWITCH_CONDITION:
        return switch_excess(motion, space, space.point_within)
    if what == TERMINATION_CONDITION:
        return termination_margin(
            space.point_within[LOG_SLIP_RATE],
            space.point_within[NORMAL_STRESS_RATIO],
            space.parameters[LOAD_VELOCITY],
        )
    return evaluate_quantity(
        get_specification(space, int(what)), space.point_within, space.parameters
    )


_find_root = build_root_finder(evaluate_condition)


def locate_crossing(condition, at_begin, at_end, motion, space):
    """Clock within the step at which a reading, given at both ends, changes sign, to 1e-13 of the
    step.
    """
    width = abs(motion.end - motion.clock)
    finest, relative = (
        (1e-15 * width, 1e-15) if condition == TIME_CONDITION else (1e-13 * width, 1e-14)
    )
    given = condition, motion, space
    return _find_root(motion.clock, motion.end, at_begin, at_end, finest, relative, given)


def add_event(motion, events, code, clock, time, columns, p):
    """Add an event to the table."""
    n = motion.event_rows
    events[n, EVENT_CODE], events[n, EVENT_REGIME], events[n, EVENT_CLOCK] = (
        code,
        motion.regime,
        clock,
    )
    events[n, EVENT_TIME] = motion.time + time
    events[n, EVENT_SLIP] = slip_since_start(motion, clock, time, columns[SPRING_STRESS], p)
    events[n, EVENT_EVALUATIONS] = motion.evaluations_slow + motion.evaluations_fast
    for i in range(events.shape[1] - EVENT_POINT):
        events[n, EVENT_POINT + i] = columns[i]
    motion.event_rows = n + 1


def report_step_end(motion, space, events, code):
    """Tell of the end of the step, by a code."""
    passed = time_at_end(motion, space)
    add_event(motion, events, float(code), motion.end, passed, space.point_at_end, space.parameters)


def slip_since_start(motion, clock, time, spring_stress, p):
    """Slip since the start: the clock of a rigid slider; else from the spring, ``f = f_0 + K (V_0 t
    - slip)``.
    """
    if motion.slip_is_clock:
        return clock
    return motion.slip + (
        p[LOAD_VELOCITY] * time - (spring_stress - motion.spring_stress) / p[STIFFNESS]
    )


def report_start(motion, space, last, events):
    """Tell that a regime or segment has begun, and what happened on the way to it from the last
    point of the one before: at the more extreme of both, or at the first beyond a level. Returns
    whether that ends the motion.
    """
    p, passed = space.parameters, time_at_begin(motion, space)
    p_before = space.parameters_before if motion.pending_start == KINK_CODE else p
    if motion.pending_start != KINK_CODE or motion.kinks_ahead < motion.reported_kinks:
        add_event(
            motion,
            events,
            float(motion.pending_start),
            motion.clock,
            passed,
            space.point_at_begin,
            p,
        )
    if motion.pending_start == START_CODE:
        return False
    for w in range(space.spec_count):
        spec = get_specification(space, w)
        jumps = find_jump_side(spec, last, p_before, space.point_at_begin, p)
        if jumps != NO_EVENT:
            columns = last if jumps == BEFORE_JUMP else space.point_at_begin
            add_event(motion, events, float(w), motion.clock, passed, columns, p)
            if spec[SPEC_TERMINAL]:
                return True
    return False


def find_jump_side(spec: Any, last: Any, p_last: Any, first: Any, p_first: Any) -> int:
    """Where what is watched for happens as a motion jumps from the last point of one regime or
    segment to the first of another: `NO_EVENT`; or at the more extreme one, or the first beyond the
    level, which is before (`BEFORE_JUMP`) or after (`AFTER_JUMP`) the jump.
    """
    if spec[SPEC_KIND] == SETTLED:
        return NO_EVENT
    if not has_crossed(
        spec, evaluate_quantity(spec, last, p_last), evaluate_quantity(spec, first, p_first), 1.0
    ):
        return NO_EVENT
    x, y = last[LOG_SLIP_RATE], first[LOG_SLIP_RATE]
    kept = (spec[SPEC_KIND] == MAXIMUM and x > y) or (spec[SPEC_KIND] == MINIMUM and x < y)
    return BEFORE_JUMP if kept and spec[SPEC_QUANTITY] == LOG_SLIP_RATE else AFTER_JUMP


def detect_events(motion, space):
    """Find when each thing watched for happens within the step; NaN where it does not. Returns how
    many do.
    """
    count, p = 0, space.parameters
    for w in range(space.spec_count):
        spec = get_specification(space, w)
        space.event_clocks[w] = math.nan
        if spec[SPEC_KIND] == SETTLED:
            against = (
                motion.may_reverse
                and p[LOAD_VELOCITY] * space.point_at_end[FRICTION_COEFFICIENT] < 0.0
            )
            if motion.kinks_ahead > 0 or against:
                continue
            apart = abs(space.point_at_end[LOG_SLIP_RATE] - p[LOG_LOAD_VELOCITY])
            away = max(apart, space.point_at_end[STEADY_STATE_DISTANCE] / abs(p[B]))
            friction = max(apart, abs(space.point_at_end[STEADY_STATE_OFFSET]) / abs(p[B]))
            spec[SPEC_MAX_DISTANCE] = max(spec[SPEC_MAX_DISTANCE], away)
            spec[SPEC_MAX_FRICTION_DISTANCE] = max(spec[SPEC_MAX_FRICTION_DISTANCE], friction)
            near = away < spec[SPEC_LEVEL] * spec[SPEC_MAX_DISTANCE]
            if (
                near
                and friction
                < FRICTION_DISTANCE_FACTOR * spec[SPEC_LEVEL] * spec[SPEC_MAX_FRICTION_DISTANCE]
            ):
                space.event_clocks[w] = motion.end
        else:
            before, after = (
                evaluate_quantity(spec, space.point_at_begin, p),
                evaluate_quantity(spec, space.point_at_end, p),
            )
            changes = before < 0.0 <= after or before > 0.0 >= after
            if changes and has_crossed(spec, before, after, motion.direction):
                space.event_clocks[w] = locate_crossing(float(w), before, after, motion, space)
        if not math.isnan(space.event_clocks[w]):
            count += 1
    return count


def report_events(motion, space, events):
    """Tell what happens within the step, in its order. Returns 0 where nothing does, 1 where the
    asker can wait for it, 2 where not, and 3 where it ends the motion.
    """
    urgent, p = 0, space.parameters
    for _ in range(detect_events(motion, space)):
        first = -1
        for w in range(space.spec_count):
            later = (
                first >= 0
                and motion.direction * (space.event_clocks[w] - space.event_clocks[first]) >= 0.0
            )
            if not math.isnan(space.event_clocks[w]) and not later:
                first = w
        clock = space.event_clocks[first]
        space.event_clocks[first] = math.nan
        if clock == motion.end:
            passed = time_at_end(motion, space)
            add_event(motion, events, float(first), clock, passed, space.point_at_end, p)
        else:
            evaluate_point_at(motion, space, clock)
            passed = motion.regime_start_time + regime_time(motion, space, space.y_within)
            add_event(motion, events, float(first), clock, passed, space.point_within, p)
        spec = get_specification(space, first)
        urgent = max(urgent, 1 if spec[SPEC_MAY_DEFER] else 2)
        if spec[SPEC_TERMINAL]:
            return 3
    return urgent


# ---- samples -------------------------------------------------------------------------------------


def record_regime_start(motion, space, rows):
    """Record where a regime begins."""
    if motion.recording_mode == RECORD_WITHIN_STEPS:
        record_point(
            motion,
            rows,
            motion.clock,
            motion.regime_start_time,
            space.point_at_begin,
            space.parameters,
        )
        rows[motion.recorded_rows - 1, SAMPLE_COLUMN] = 0.0


def is_step_recorded(motion, space, samples):
    """True if the step is recorded between its ends."""
    if motion.recording_mode != RECORD_AT_TIMES:
        return motion.recording_mode != RECORD_NEVER
    end = time_at_end(motion, space) + motion.time
    return motion.samples_taken < len(samples) and samples[motion.samples_taken] < end


def record_step(motion, space, rows, samples, over):
    """Record the step; returns whether all that was asked for has been recorded with it. Where the
    motion is `over`, it ends when that was asked for, whatever the last digit.
    """
    if motion.recording_mode == RECORD_WITHIN_STEPS:
        record_evenly_spaced(motion, space, rows)
        return False
    before = motion.samples_taken
    record_requested(motion, space, rows, samples, over)
    return before < motion.samples_taken == len(samples)


def record_evenly_spaced(motion, space, rows):
    """Record the step evenly along its clock, up to its end."""
    for sample in range(1, SAMPLES_PER_STEP):
        clock = motion.clock + (motion.end - motion.clock) * (sample / SAMPLES_PER_STEP)
        record_at_clock(motion, space, rows, clock)
        rows[motion.recorded_rows - 1, SAMPLE_COLUMN] = sample
    passed = time_at_end(motion, space)
    record_point(motion, rows, motion.end, passed, space.point_at_end, space.parameters)
    rows[motion.recorded_rows - 1, SAMPLE_COLUMN] = SAMPLES_PER_STEP


def record_requested(motion, space, rows, samples, over):
    """Record the step where that is asked for, at times or at clocks, which grow."""
    at_begin, at_end = motion.clock, motion.end
    if motion.recording_mode == RECORD_AT_TIMES:
        at_begin = time_at_begin(motion, space)
        at_end = time_at_end(motion, space)
    last = motion.end_time if over else at_end
    while (
        motion.samples_taken < len(samples) and samples[motion.samples_taken] - motion.time <= last
    ):
        asked = samples[motion.samples_taken] - motion.time
        motion.samples_taken += 1
        if asked <= at_begin:
            passed = time_at_begin(motion, space)
            record_point(motion, rows, motion.clock, passed, space.point_at_begin, space.parameters)
        elif asked >= at_end:
            passed = time_at_end(motion, space)
            record_point(motion, rows, motion.end, passed, space.point_at_end, space.parameters)
        else:
            clock = asked
            if motion.recording_mode == RECORD_AT_TIMES:
                motion.target_time = asked
                clock = locate_crossing(
                    TIME_CONDITION, at_begin - asked, at_end - asked, motion, space
                )
            record_at_clock(motion, space, rows, clock)


def record_at_clock(motion, space, rows, clock):
    """Record the slider at a clock within the step."""
    evaluate_point_at(motion, space, clock)
    passed = motion.regime_start_time + regime_time(motion, space, space.y_within)
    record_point(motion, rows, clock, passed, space.point_within, space.parameters)


def record_point(motion, rows, clock, time, columns, p):
    """Add what is recorded of a point (see `recording.pack_row`)."""
    n = motion.recorded_rows
    rows[n, 0] = motion.time + (motion.end_time if time > motion.end_time else time)
    rows[n, 1] = slip_since_start(motion, clock, time, columns[SPRING_STRESS], p)
    rows[n, 2], rows[n, 3], rows[n, 4] = (
        columns[LOG_SLIP_RATE],
        columns[SPRING_STRESS],
        columns[FRICTIONAL_STRESS],
    )
    rows[n, 5], rows[n, 6], rows[n, 7] = (
        columns[NORMAL_STRESS_RATIO],
        columns[STATE_VARIABLE],
        columns[APPARENT_FRICTION],
    )
    rows[n, REGIME_COLUMN], rows[n, SAMPLE_COLUMN] = motion.regime, 0.0
    for i in range(motion.states):
        rows[n, FIRST_STATE_COLUMN + i] = columns[FIRST_STATE + i]
    motion.recorded_rows = n + 1
