"""What lies within a step: events, located where a quantity changes sign and reported in their
order; and samples, evenly within each step, or at clocks or times asked for.
"""

from __future__ import annotations

import math
from typing import Any

from rsfstudy.motion.calls import moved
from rsfstudy.motion.handover import margin, weight_of_mass
from rsfstudy.motion.layout import (
    AT_TIMES,
    BEGIN,
    CLOCK,
    CODE,
    COEFFICIENT,
    DISTANCE,
    ENDS,
    EVENT_REGIME,
    FARTHEST,
    FARTHEST_FRICTION,
    FRICTION,
    GROWTH,
    IMBALANCE,
    KIND,
    KINK,
    LEVEL,
    LOG_RATE,
    MAXIMUM,
    MINIMUM,
    NEVER,
    OF,
    POINT,
    PSIS,
    RATIO,
    READING,
    READING_GROWTH,
    RISE,
    SETTLED,
    SLIP,
    SLOW,
    SPECIFIED,
    SPENT,
    SPRING,
    STATE,
    TIME,
    WAITS,
    WITHIN_STEPS,
)
from rsfstudy.motion.recording import PLACE, REGIME, SAMPLES, STATES
from rsfstudy.motion.roots import root_of
from rsfstudy.motion.steppers import unknowns_at
from rsfstudy.motion.steps import elapsed, passed_at_begin, passed_at_end, point_within
from rsfstudy.slider.places import LOAD_VELOCITY, LOG_LOAD_RATE, STIFFNESS, B

#: What is read off a step beside event specifications: how far the regime is from being left, time
#: less that which is looked for, and how far the motion is from its end.
#: Not whole numbers, of each of which the compiler would make a case of its own.
EXCESS, PASSED, MARGIN = -1.0, -2.0, -3.0
#: Level of settling for slip rate and the sum of the states of the law, relative to the level for
#: all unknowns. One huge unknown cannot end a motion whose slip rate still changes.
LENIENT = 10.0
#: Where something happens between two points.
NOWHERE, BEFORE, AFTER = range(3)


def quantity(spec, columns, p):
    """Quantity that changes sign where it happens: a slope, or the distance from a level."""
    if spec[KIND] == MAXIMUM or spec[KIND] == MINIMUM:
        if spec[OF] == LOG_RATE:
            return columns[GROWTH]
        if spec[OF] == READING:
            return columns[READING_GROWTH]
        return p[LOG_LOAD_RATE] - columns[LOG_RATE]
    return columns[int(spec[OF])] - spec[LEVEL]


def spec_of(space, number):
    """One of the event specifications."""
    return moved(space.specs, len(SPECIFIED) * number)


def waits(space):
    """True if the asker can wait for anything; for the beginning then, too."""
    found = False
    for w in range(space.specified):
        found = found or spec_of(space, w)[WAITS] != 0.0
    return found


def excess(motion, space, columns):
    """Not negative where the slow manifold has to be left; always negative elsewhere."""
    if motion.regime != SLOW or not motion.has_mass:
        return -1.0
    missing = columns[SPRING] - columns[FRICTION]
    return weight_of_mass(columns[LOG_RATE], missing, space.limits) - 1.0


def happens(spec, before, after, direction):
    """True if a quantity that changes so has done what is watched for."""
    upwards = spec[KIND] == RISE or spec[KIND] == MINIMUM
    # against the clock, slopes change sign the other way round
    if direction < 0.0 and (spec[KIND] == MAXIMUM or spec[KIND] == MINIMUM):
        upwards = not upwards
    if upwards:
        return before < 0.0 <= after
    return before > 0.0 >= after


def reading(clock, given):
    """Quantity of a specification, `EXCESS`, `PASSED` or `MARGIN`, at a clock within the step."""
    what, motion, space = given
    if what == PASSED:
        unknowns_at(motion, space, clock)
        return motion.started + elapsed(motion, space, space.within) - motion.target
    point_within(motion, space, clock)
    if what == EXCESS:
        return excess(motion, space, space.between)
    if what == MARGIN:
        return margin(space.between[LOG_RATE], space.between[RATIO], space.p[LOAD_VELOCITY])
    return quantity(spec_of(space, int(what)), space.between, space.p)


_root = root_of(reading)


def located(what, at_begin, at_end, motion, space):
    """Clock within the step at which a reading, given at both ends, changes sign, to 1e-13 of the
    step.
    """
    width = abs(motion.end - motion.clock)
    finest, relative = (1e-15 * width, 1e-15) if what == PASSED else (1e-13 * width, 1e-14)
    given = what, motion, space
    return _root(motion.clock, motion.end, at_begin, at_end, finest, relative, given)


def add_event(motion, events, code, clock, passed, columns, p):
    """Add an event to the table."""
    n = motion.events
    events[n, CODE], events[n, EVENT_REGIME], events[n, CLOCK] = code, motion.regime, clock
    events[n, TIME] = motion.time + passed
    events[n, SLIP] = slipped(motion, clock, passed, columns[SPRING], p)
    events[n, SPENT] = motion.spent_slow + motion.spent_fast
    for i in range(events.shape[1] - POINT):
        events[n, POINT + i] = columns[i]
    motion.events = n + 1


def report_end(motion, space, events, code):
    """Tell of the end of the step, by a code."""
    passed = passed_at_end(motion, space)
    add_event(motion, events, float(code), motion.end, passed, space.after, space.p)


def slipped(motion, clock, passed, spring_stress, p):
    """Slip since the start: the clock of a rigid slider; else from the spring, ``f = f_0 + K (V_0 t
    - slip)``.
    """
    if motion.slip_is_clock:
        return clock
    return motion.slip + (
        p[LOAD_VELOCITY] * passed - (spring_stress - motion.spring_stress) / p[STIFFNESS]
    )


def report_beginning(motion, space, last, events):
    """Tell that a regime or segment has begun, and what happened on the way to it from the last
    point of the one before: at the more extreme of both, or at the first beyond a level. Returns
    whether that ends the motion.
    """
    p, passed = space.p, passed_at_begin(motion, space)
    p_before = space.p_before if motion.begins == KINK else p
    if motion.begins != KINK or motion.kinks < motion.reported:
        add_event(motion, events, float(motion.begins), motion.clock, passed, space.before, p)
    if motion.begins == BEGIN:
        return False
    for w in range(space.specified):
        spec = spec_of(space, w)
        jumps = between(spec, last, p_before, space.before, p)
        if jumps != NOWHERE:
            columns = last if jumps == BEFORE else space.before
            add_event(motion, events, float(w), motion.clock, passed, columns, p)
            if spec[ENDS]:
                return True
    return False


def between(spec: Any, last: Any, p_last: Any, first: Any, p_first: Any) -> int:
    """Where what is watched for happens as a motion jumps from the last point of one regime or
    segment to the first of another: `NOWHERE`; or at the more extreme one, or the first beyond the
    level, which is `BEFORE` or `AFTER` the jump.
    """
    if spec[KIND] == SETTLED:
        return NOWHERE
    if not happens(spec, quantity(spec, last, p_last), quantity(spec, first, p_first), 1.0):
        return NOWHERE
    x, y = last[LOG_RATE], first[LOG_RATE]
    kept = (spec[KIND] == MAXIMUM and x > y) or (spec[KIND] == MINIMUM and x < y)
    return BEFORE if kept and spec[OF] == LOG_RATE else AFTER


def detect(motion, space):
    """Find when each thing watched for happens within the step; NaN where it does not. Returns how
    many do.
    """
    count, p = 0, space.p
    for w in range(space.specified):
        spec = spec_of(space, w)
        space.when[w] = math.nan
        if spec[KIND] == SETTLED:
            against = motion.reverses and p[LOAD_VELOCITY] * space.after[COEFFICIENT] < 0.0
            if motion.kinks > 0 or against:
                continue
            apart = abs(space.after[LOG_RATE] - p[LOG_LOAD_RATE])
            away = max(apart, space.after[DISTANCE] / abs(p[B]))
            friction = max(apart, abs(space.after[IMBALANCE]) / abs(p[B]))
            spec[FARTHEST] = max(spec[FARTHEST], away)
            spec[FARTHEST_FRICTION] = max(spec[FARTHEST_FRICTION], friction)
            near = away < spec[LEVEL] * spec[FARTHEST]
            if near and friction < LENIENT * spec[LEVEL] * spec[FARTHEST_FRICTION]:
                space.when[w] = motion.end
        else:
            before, after = quantity(spec, space.before, p), quantity(spec, space.after, p)
            changes = before < 0.0 <= after or before > 0.0 >= after
            if changes and happens(spec, before, after, motion.direction):
                space.when[w] = located(float(w), before, after, motion, space)
        if not math.isnan(space.when[w]):
            count += 1
    return count


def report(motion, space, events):
    """Tell what happens within the step, in its order. Returns 0 where nothing does, 1 where the
    asker can wait for it, 2 where not, and 3 where it ends the motion.
    """
    urgent, p = 0, space.p
    for _ in range(detect(motion, space)):
        first = -1
        for w in range(space.specified):
            later = first >= 0 and motion.direction * (space.when[w] - space.when[first]) >= 0.0
            if not math.isnan(space.when[w]) and not later:
                first = w
        clock = space.when[first]
        space.when[first] = math.nan
        if clock == motion.end:
            passed = passed_at_end(motion, space)
            add_event(motion, events, float(first), clock, passed, space.after, p)
        else:
            point_within(motion, space, clock)
            passed = motion.started + elapsed(motion, space, space.within)
            add_event(motion, events, float(first), clock, passed, space.between, p)
        spec = spec_of(space, first)
        urgent = max(urgent, 1 if spec[WAITS] else 2)
        if spec[ENDS]:
            return 3
    return urgent


# ---- samples -------------------------------------------------------------------------------------


def record_begin(motion, space, rows):
    """Record where a regime begins."""
    if motion.records == WITHIN_STEPS:
        record_point(motion, rows, motion.clock, motion.started, space.before, space.p)
        rows[motion.recorded - 1, PLACE] = 0.0


def is_recorded(motion, space, samples):
    """True if the step is recorded between its ends."""
    if motion.records != AT_TIMES:
        return motion.records != NEVER
    end = passed_at_end(motion, space) + motion.time
    return motion.sampled < len(samples) and samples[motion.sampled] < end


def record(motion, space, rows, samples, over):
    """Record the step; returns whether all that was asked for has been recorded with it. Where the
    motion is `over`, it ends when that was asked for, whatever the last digit.
    """
    if motion.records == WITHIN_STEPS:
        record_evenly(motion, space, rows)
        return False
    before = motion.sampled
    record_asked(motion, space, rows, samples, over)
    return before < motion.sampled == len(samples)


def record_evenly(motion, space, rows):
    """Record the step evenly along its clock, up to its end."""
    for sample in range(1, SAMPLES):
        clock = motion.clock + (motion.end - motion.clock) * (sample / SAMPLES)
        record_within(motion, space, rows, clock)
        rows[motion.recorded - 1, PLACE] = sample
    passed = passed_at_end(motion, space)
    record_point(motion, rows, motion.end, passed, space.after, space.p)
    rows[motion.recorded - 1, PLACE] = SAMPLES


def record_asked(motion, space, rows, samples, over):
    """Record the step where that is asked for, at times or at clocks, which grow."""
    at_begin, at_end = motion.clock, motion.end
    if motion.records == AT_TIMES:
        at_begin = passed_at_begin(motion, space)
        at_end = passed_at_end(motion, space)
    last = motion.lasts if over else at_end
    while motion.sampled < len(samples) and samples[motion.sampled] - motion.time <= last:
        asked = samples[motion.sampled] - motion.time
        motion.sampled += 1
        if asked <= at_begin:
            passed = passed_at_begin(motion, space)
            record_point(motion, rows, motion.clock, passed, space.before, space.p)
        elif asked >= at_end:
            passed = passed_at_end(motion, space)
            record_point(motion, rows, motion.end, passed, space.after, space.p)
        else:
            clock = asked
            if motion.records == AT_TIMES:
                motion.target = asked
                clock = located(PASSED, at_begin - asked, at_end - asked, motion, space)
            record_within(motion, space, rows, clock)


def record_within(motion, space, rows, clock):
    """Record the slider at a clock within the step."""
    point_within(motion, space, clock)
    passed = motion.started + elapsed(motion, space, space.within)
    record_point(motion, rows, clock, passed, space.between, space.p)


def record_point(motion, rows, clock, passed, columns, p):
    """Add what is recorded of a point (see `recording.row`)."""
    n = motion.recorded
    rows[n, 0] = motion.time + (motion.lasts if passed > motion.lasts else passed)
    rows[n, 1] = slipped(motion, clock, passed, columns[SPRING], p)
    rows[n, 2], rows[n, 3], rows[n, 4] = columns[LOG_RATE], columns[SPRING], columns[FRICTION]
    rows[n, 5], rows[n, 6], rows[n, 7] = columns[RATIO], columns[STATE], columns[READING]
    rows[n, REGIME], rows[n, PLACE] = motion.regime, 0.0
    for i in range(motion.states):
        rows[n, STATES + i] = columns[PSIS + i]
    motion.recorded = n + 1
