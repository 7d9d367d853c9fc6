"""Steps of one regime: taken, looked into, and cut short."""

from __future__ import annotations

import math

from rsfstudy.motion.array_calls import copy_values, evaluate
from rsfstudy.motion.layout import (
    BUDGET_EXCEEDED,
    FAST_REGIME,
    FIRST_STATE,
    INVALID_STEP,
    LOG_SLIP_RATE,
    NO_STEP_POSSIBLE,
    NORMAL_STRESS_RATIO,
    STEP_TAKEN,
)
from rsfstudy.motion.longest_step import LONGEST_STEP, compute_longest_step
from rsfstudy.motion.steppers import attempt, retake, step_to_segment_end, unknowns_at
from rsfstudy.motion.workspace import count_evaluations, step_rates
from rsfstudy.parts import LOG_LOAD_VELOCITY

#: What slopes of dense output may differ by from rates over a step, in local tolerances; how often
#: a step is halved for that, and by how much the next may be longer; and how far apart, over the
#: length of the step, values of dense output give its slopes.
MAX_SLOPE_ERROR, MAX_HALVINGS, GROWTH_FACTOR, SLOPE_SPACING = 300.0, 6, 1.3, 5e-3


def regime_time(motion, space, y):
    """Time since the regime began, at some unknowns; NaN where nothing tells it."""
    if not motion.has_clock:
        return math.nan
    unit = space.limits.inertial_time if motion.regime == FAST_REGIME else 1.0
    return unit * y[space.unknowns - 1]


def time_at_begin(motion, space):
    """Time since the start, at the beginning of the step."""
    return motion.regime_start_time + regime_time(motion, space, space.y)


def time_at_end(motion, space):
    """Time since the start, at the end of the step."""
    return motion.regime_start_time + regime_time(motion, space, space.y_end)


def take_step(motion, space):
    """Take a step whose local error is allowed; why not, where there is none."""
    longest = LONGEST_STEP
    if motion.clock_is_path_length:
        longest = compute_longest_step(
            space.point_at_begin[LOG_SLIP_RATE],
            space.point_at_begin[NORMAL_STRESS_RATIO],
            space.parameters[LOG_LOAD_VELOCITY],
        )
    longest *= motion.step_limit_factor
    if motion.recording_mode:
        longest = min(longest, motion.dense_output_limit)
    length = 0.0
    if motion.kinks_ahead > 0:
        length = step_to_kink(motion, space, min(longest, motion.next_step_length))
    if length == 0.0:
        length = attempt(motion, space, longest)
    motion.steps += 1
    if length <= 0.0:
        return NO_STEP_POSSIBLE if length == 0.0 else BUDGET_EXCEEDED
    total = 0.0
    for i in range(space.unknowns):
        total += space.y_end[i]
    if motion.end == motion.clock or not math.isfinite(total):
        return INVALID_STEP
    return STEP_TAKEN


def step_to_kink(motion, space, longest):
    """Length of a step that ends at the next kink, if that is not farther; else 0."""
    left = motion.end_time - time_at_begin(motion, space)
    length = left / regime_time(motion, space, space.rates)
    return step_to_segment_end(motion, space, length) if 0.0 < length <= longest else 0.0


def halve_unresolved_step(motion, space):
    """Halve the step of a recorded motion until what lies within it is known as well as its
    end: where stability limits steps, and not accuracy, dense output is far less accurate.
    """
    for _ in range(MAX_HALVINGS):
        if is_resolved(motion, space):
            motion.dense_output_limit *= GROWTH_FACTOR
            return
        retake(motion, space, motion.clock + 0.5 * (motion.end - motion.clock))
        motion.next_step_length = motion.dense_output_limit = abs(motion.step_length)


def is_resolved(motion, space):
    """True if the slopes of dense output are the rates there, as well as is wanted.

    With an error e of dense output, they differ by its own slope, a few times e over the length of
    the step, and by what the rates make of e, as much where stability limits the step.
    """
    for i in range(space.unknowns):
        space.rates_within[i] = 0.0
    for part in (0.3, 0.7):
        clock = motion.clock + part * motion.step_length
        for i in range(space.unknowns):
            space.dense_slopes[i] = 0.0
        for shift, weight in ((2.0, -1.0), (1.0, 8.0), (-1.0, -8.0), (-2.0, 1.0)):
            unknowns_at(motion, space, clock + shift * SLOPE_SPACING * motion.step_length)
            for i in range(space.unknowns):
                space.dense_slopes[i] += weight / (12.0 * SLOPE_SPACING) * space.y_within[i]
        unknowns_at(motion, space, clock)
        count_evaluations(motion, 1)
        step_rates(motion, space, space.y_within, space.rates_within)
        for i in range(space.unknowns):
            differ = abs(motion.step_length * space.rates_within[i] - space.dense_slopes[i])
            size = space.scales[i] + max(abs(space.y[i]), abs(space.y_end[i]))
            # a number that is none is not resolved
            if not differ <= MAX_SLOPE_ERROR * motion.tolerance * size:
                return False
    return True


def evaluate_point_at(motion, space, clock):
    """Fill in what the slider does at a clock within the step."""
    unknowns_at(motion, space, clock)
    count_evaluations(motion, 1)
    evaluate(space.rate, space.y_within, space.y_within, space.parameters, space.rates_within)
    evaluate(space.point, space.y_within, space.rates_within, space.parameters, space.point_within)


def truncate_at(motion, space, clock):
    """Let the step end at a clock within it."""
    if clock != motion.end:
        evaluate_point_at(motion, space, clock)
        copy_values(space.point_within, space.point_at_end, FIRST_STATE + motion.states)
        copy_values(space.y_within, space.y_end, space.unknowns)
        motion.end = clock
