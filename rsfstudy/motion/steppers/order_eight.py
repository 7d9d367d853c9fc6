"""Steps of order eight, DOP853 of SciPy written out: as plain Python, and as the compiler has them.

The tableau, the error and the controller of step lengths are those of `scipy.integrate.DOP853`.
"""

from __future__ import annotations

import math

from scipy.integrate import DOP853

from rsfstudy.motion.array_calls import evaluate, offset_by
from rsfstudy.motion.longest_step import LONGEST_STEP
from rsfstudy.motion.steppers import BUDGET_SPENT, NO_STEP, Stepper
from rsfstudy.motion.steppers.unrolled_step import (
    DENSE_ROW_COUNT,
    ERROR_INDEX,
    EXTRA_STAGE_COUNT,
    LENGTH_INDEX,
    STAGE_COUNT,
    TOLERANCE_INDEX,
    TOTAL_STAGE_COUNT,
)
from rsfstudy.motion.workspace import count_evaluations, step_rates

#: Weights of the stages of dense output, and of all stages in its rows.
_EXTRA_WEIGHTS, _DENSE_WEIGHTS = (tuple(x.ravel().tolist()) for x in (DOP853.A_EXTRA, DOP853.D))
#: Weights of the stages before each stage, of which the last is the end of the step, and in its
#: errors of fifth and third order.
_STAGE_WEIGHTS = tuple(
    map(tuple, [*DOP853.A[:STAGE_COUNT, :STAGE_COUNT].tolist(), DOP853.B.tolist()])
)
_FIFTH_ORDER_WEIGHTS, _THIRD_ORDER_WEIGHTS = tuple(DOP853.E5.tolist()), tuple(DOP853.E3.tolist())
_SAFETY_FACTOR, _MIN_FACTOR, _MAX_FACTOR, _ERROR_EXPONENT = 0.9, 0.2, 10.0, -1.0 / 8.0


def begin(motion, space):
    """Start the clock of the equations."""
    motion.clock = 0.0
    evaluate(space.rate, space.y, space.y, space.parameters, space.rates)
    count_evaluations(motion, 1)
    if motion.next_step_length == 0.0:
        motion.next_step_length = min(
            select_initial_step_length(space, motion.direction, motion.tolerance), LONGEST_STEP
        )
        count_evaluations(motion, 1)


def attempt(motion, space, longest):
    """Length of the step that could be taken; not positive where there is none."""
    towards = math.nextafter(motion.clock, motion.direction * math.inf)
    shortest = 10.0 * abs(towards - motion.clock)
    length = max(min(motion.next_step_length, longest), shortest)
    rejected = False
    space.step_block[TOLERANCE_INDEX], motion.time_per_step = motion.tolerance, 0.0
    while length >= shortest:
        motion.end = motion.clock + length * motion.direction
        motion.step_length = motion.end - motion.clock
        length = abs(motion.step_length)
        take_step_of_length(motion, space)
        if motion.evaluations_slow + motion.evaluations_fast > motion.budget:
            return BUDGET_SPENT
        error = space.step_block[ERROR_INDEX]
        if error < 1.0:
            motion.next_step_length = increase_step_length(length, error, rejected)
            motion.is_dense = 0
            return length
        length, rejected = reduce_step_length(length, error), True
    return NO_STEP


def take_step_of_length(motion, space):
    """Take a step of the length that is stated, whatever its error."""
    space.step_block[LENGTH_INDEX] = motion.step_length
    evaluate(space.attempt, space.y, space.stages, space.parameters, space.step_block)
    count_evaluations(motion, STAGE_COUNT)


def step_to_segment_end(motion, space, length):
    """Take a step against time, which is the last unknown, up to when the segment ends; its clock
    runs as time does at its beginning, when it has that length. Returns 0 where its error is too
    large.
    """
    motion.time_per_step, motion.step_length = space.rates[space.unknowns - 1], length
    motion.end, motion.is_dense = motion.clock + length, 0
    error = take_step_at_pace(motion, space)
    count_evaluations(motion, STAGE_COUNT)
    if motion.evaluations_slow + motion.evaluations_fast > motion.budget:
        return BUDGET_SPENT
    if error < 1.0:
        motion.next_step_length = max(
            motion.next_step_length, increase_step_length(length, error, False)
        )
        return length
    motion.next_step_length = reduce_step_length(length, error)
    return 0.0


def take_step_at_pace(motion, space):
    """Take a step by the clock of a pace; returns its local error over what is allowed."""
    count, y, new, stages, length = (
        space.unknowns,
        space.y,
        space.y_end,
        space.stages,
        motion.step_length,
    )
    for s in range(1, STAGE_COUNT + 1):
        for i in range(count):
            together = 0.0
            for j in range(s):
                together += _STAGE_WEIGHTS[s][j] * stages[j * count + i]
            new[i] = y[i] + length * together
        step_rates(motion, space, new, offset_by(stages, s * count))
    fifth = third = 0.0
    for i in range(count):
        of_fifth = of_third = 0.0
        for j in range(STAGE_COUNT + 1):
            of_fifth += _FIFTH_ORDER_WEIGHTS[j] * stages[j * count + i]
            of_third += _THIRD_ORDER_WEIGHTS[j] * stages[j * count + i]
        allowed = motion.tolerance * (space.scales[i] + max(abs(y[i]), abs(new[i])))
        fifth += (of_fifth / allowed) * (of_fifth / allowed)
        third += (of_third / allowed) * (of_third / allowed)
    both = fifth + 0.01 * third
    return length * fifth / math.sqrt(both * count) if both != 0.0 else 0.0


def retake(motion, space, clock):
    """Take the step anew, to a clock within it."""
    motion.end, motion.step_length, motion.is_dense = clock, clock - motion.clock, 0
    motion.time_per_step = 0.0
    take_step_of_length(motion, space)


def unknowns_at(motion, space, clock):
    """Fill in the unknowns at a clock within the step."""
    if not motion.is_dense:
        prepare_interpolation(motion, space, motion.step_length)
        count_evaluations(motion, EXTRA_STAGE_COUNT)
        motion.is_dense = 1
    interpolate(space, (clock - motion.clock) / motion.step_length)


def increase_step_length(length, error, rejected):
    """Length of the step after one that was accepted with this error."""
    factor = (
        _MAX_FACTOR if error == 0.0 else min(_MAX_FACTOR, _SAFETY_FACTOR * error**_ERROR_EXPONENT)
    )
    return length * (min(1.0, factor) if rejected else factor)


def reduce_step_length(length, error):
    """Length of the next attempt after one that was rejected; its error may be no number."""
    factor = _SAFETY_FACTOR * error**_ERROR_EXPONENT
    return length * (factor if factor > _MIN_FACTOR else _MIN_FACTOR)


def select_initial_step_length(space, direction, tolerance):
    """Length of the first step, by two evaluations of the rates."""
    y, first, count = space.y, space.rates, space.unknowns
    d0 = d1 = 0.0
    for i in range(count):
        scale = tolerance * (space.scales[i] + abs(y[i]))
        d0 += (y[i] / scale) * (y[i] / scale)
        d1 += (first[i] / scale) * (first[i] / scale)
    d0, d1 = math.sqrt(d0 / count), math.sqrt(d1 / count)
    trial = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    for i in range(count):
        space.y_end[i] = y[i] + trial * direction * first[i]
    evaluate(space.rate, space.y_end, y, space.parameters, space.y_within)
    d2 = 0.0
    for i in range(count):
        scale = tolerance * (space.scales[i] + abs(y[i]))
        change = (space.y_within[i] - first[i]) / scale
        d2 += change * change
    d2 = math.sqrt(d2 / count) / trial
    if d1 <= 1e-15 and d2 <= 1e-15:
        length = max(1e-6, trial * 1e-3)
    else:
        length = (0.01 / max(d1, d2)) ** -_ERROR_EXPONENT
    return min(100.0 * trial, length)


def prepare_interpolation(motion, space, length):
    """Fill in the rows of dense output, by three more evaluations of the rates."""
    count, y, stages, rows = space.unknowns, space.y, space.stages, space.dense_rows
    for s in range(EXTRA_STAGE_COUNT):
        for i in range(count):
            together = 0.0
            for j in range(STAGE_COUNT + 1 + s):
                together += _EXTRA_WEIGHTS[s * TOTAL_STAGE_COUNT + j] * stages[j * count + i]
            space.y_within[i] = y[i] + length * together
        rates = offset_by(stages, (STAGE_COUNT + 1 + s) * count)
        step_rates(motion, space, space.y_within, rates)
    for i in range(count):
        change = space.y_end[i] - y[i]
        first, last = stages[i], stages[STAGE_COUNT * count + i]
        rows[i] = change
        rows[count + i] = length * first - change
        rows[2 * count + i] = 2.0 * change - length * (last + first)
        for r in range(DENSE_ROW_COUNT - 3):
            together = 0.0
            for j in range(TOTAL_STAGE_COUNT):
                together += _DENSE_WEIGHTS[r * TOTAL_STAGE_COUNT + j] * stages[j * count + i]
            rows[(3 + r) * count + i] = length * together


def interpolate(space, fraction):
    """Unknowns at a part of a step from its beginning."""
    for i in range(space.unknowns):
        value = 0.0
        for r in range(DENSE_ROW_COUNT):
            row = space.dense_rows[(DENSE_ROW_COUNT - 1 - r) * space.unknowns + i]
            value = (value + row) * (fraction if r % 2 == 0 else 1.0 - fraction)
        space.y_within[i] = space.y[i] + value


class OrderEight(Stepper):
    """DOP853 in plain Python: every step can be followed with a debugger."""

    name = "python"
    begin = staticmethod(begin)
    attempt = staticmethod(attempt)
    step_to_segment_end = staticmethod(step_to_segment_end)
    unknowns_at = staticmethod(unknowns_at)
    retake = staticmethod(retake)
