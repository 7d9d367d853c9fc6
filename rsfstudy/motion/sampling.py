"""Sampling along a motion: evenly within its steps, or at clocks or times asked for."""

from __future__ import annotations

from rsfstudy.motion.detection import PASSED, located, slipped
from rsfstudy.motion.layout import (
    AT_TIMES,
    FRICTION,
    LOG_RATE,
    NEVER,
    PSIS,
    RATIO,
    READING,
    SPRING,
    STATE,
    WITHIN_STEPS,
)
from rsfstudy.motion.recording import PLACE, REGIME, SAMPLES, STATES
from rsfstudy.motion.steps import elapsed, passed_at_begin, passed_at_end, point_within


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
