"""Steps of order eight, DOP853 of SciPy written out: as plain Python, and as the compiler has them.

The tableau, the error and the controller of step lengths are those of `scipy.integrate.DOP853`.
"""

from __future__ import annotations

import math

from scipy.integrate import DOP853

from rsfstudy.motion.calls import evaluate, moved
from rsfstudy.motion.steppers import BUDGET_SPENT, NO_STEP, Stepper
from rsfstudy.motion.steppers.unrolled import (
    ALL_STAGES,
    ERROR,
    EXTRA,
    LENGTH,
    ROWS,
    STAGES,
    TOLERANCE,
)
from rsfstudy.motion.workspace import rate_of_step, spend
from rsfstudy.slider.equations import LONGEST_STEP

#: Weights of the stages of dense output, and of all stages in its rows.
_EXTRA_WEIGHTS, _DENSE_WEIGHTS = (tuple(x.ravel().tolist()) for x in (DOP853.A_EXTRA, DOP853.D))
#: Weights of the stages before each stage, of which the last is the end of the step, and in its
#: errors of fifth and third order.
_STAGE_WEIGHTS = tuple(map(tuple, [*DOP853.A[:STAGES, :STAGES].tolist(), DOP853.B.tolist()]))
_FIFTH, _THIRD = tuple(DOP853.E5.tolist()), tuple(DOP853.E3.tolist())
_SAFETY, _LEAST, _MOST, _EXPONENT = 0.9, 0.2, 10.0, -1.0 / 8.0


def begin(motion, space):
    """Start the clock of the equations."""
    motion.clock = 0.0
    evaluate(space.rate, space.y, space.y, space.p, space.rates)
    spend(motion, 1)
    if motion.length == 0.0:
        motion.length = min(first_length(space, motion.direction, motion.tolerance), LONGEST_STEP)
        spend(motion, 1)


def attempt(motion, space, longest):
    """Length of the step that could be taken; not positive where there is none."""
    towards = math.nextafter(motion.clock, motion.direction * math.inf)
    shortest = 10.0 * abs(towards - motion.clock)
    length = max(min(motion.length, longest), shortest)
    rejected = False
    space.step[TOLERANCE], motion.pace = motion.tolerance, 0.0
    while length >= shortest:
        motion.end = motion.clock + length * motion.direction
        motion.taken = motion.end - motion.clock
        length = abs(motion.taken)
        take(motion, space)
        if motion.spent_slow + motion.spent_fast > motion.budget:
            return BUDGET_SPENT
        error = space.step[ERROR]
        if error < 1.0:
            motion.length = stretched(length, error, rejected)
            motion.is_dense = 0
            return length
        length, rejected = shortened(length, error), True
    return NO_STEP


def take(motion, space):
    """Take a step of the length that is stated, whatever its error."""
    space.step[LENGTH] = motion.taken
    evaluate(space.attempt, space.y, space.stages, space.p, space.step)
    spend(motion, STAGES)


def reach(motion, space, length):
    """Take a step against time, which is the last unknown, up to when the segment ends; its clock
    runs as time does at its beginning, when it has that length. Returns 0 where its error is too
    large.
    """
    motion.pace, motion.taken = space.rates[space.unknowns - 1], length
    motion.end, motion.is_dense = motion.clock + length, 0
    error = take_at_pace(motion, space)
    spend(motion, STAGES)
    if motion.spent_slow + motion.spent_fast > motion.budget:
        return BUDGET_SPENT
    if error < 1.0:
        motion.length = max(motion.length, stretched(length, error, False))
        return length
    motion.length = shortened(length, error)
    return 0.0


def take_at_pace(motion, space):
    """Take a step by the clock of a pace; returns its local error over what is allowed."""
    count, y, new, stages, length = space.unknowns, space.y, space.new, space.stages, motion.taken
    for s in range(1, STAGES + 1):
        for i in range(count):
            together = 0.0
            for j in range(s):
                together += _STAGE_WEIGHTS[s][j] * stages[j * count + i]
            new[i] = y[i] + length * together
        rate_of_step(motion, space, new, moved(stages, s * count))
    fifth = third = 0.0
    for i in range(count):
        of_fifth = of_third = 0.0
        for j in range(STAGES + 1):
            of_fifth += _FIFTH[j] * stages[j * count + i]
            of_third += _THIRD[j] * stages[j * count + i]
        allowed = motion.tolerance * (space.scales[i] + max(abs(y[i]), abs(new[i])))
        fifth += (of_fifth / allowed) * (of_fifth / allowed)
        third += (of_third / allowed) * (of_third / allowed)
    both = fifth + 0.01 * third
    return length * fifth / math.sqrt(both * count) if both != 0.0 else 0.0


def retake(motion, space, clock):
    """Take the step anew, to a clock within it."""
    motion.end, motion.taken, motion.is_dense = clock, clock - motion.clock, 0
    motion.pace = 0.0
    take(motion, space)


def unknowns_at(motion, space, clock):
    """Fill in the unknowns at a clock within the step."""
    if not motion.is_dense:
        prepare_interpolation(motion, space, motion.taken)
        spend(motion, EXTRA)
        motion.is_dense = 1
    interpolate(space, (clock - motion.clock) / motion.taken)


def stretched(length, error, rejected):
    """Length of the step after one that was accepted with this error."""
    factor = _MOST if error == 0.0 else min(_MOST, _SAFETY * error**_EXPONENT)
    return length * (min(1.0, factor) if rejected else factor)


def shortened(length, error):
    """Length of the next attempt after one that was rejected; its error may be no number."""
    factor = _SAFETY * error**_EXPONENT
    return length * (factor if factor > _LEAST else _LEAST)


def first_length(space, direction, tolerance):
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
        space.new[i] = y[i] + trial * direction * first[i]
    evaluate(space.rate, space.new, y, space.p, space.within)
    d2 = 0.0
    for i in range(count):
        scale = tolerance * (space.scales[i] + abs(y[i]))
        change = (space.within[i] - first[i]) / scale
        d2 += change * change
    d2 = math.sqrt(d2 / count) / trial
    if d1 <= 1e-15 and d2 <= 1e-15:
        length = max(1e-6, trial * 1e-3)
    else:
        length = (0.01 / max(d1, d2)) ** -_EXPONENT
    return min(100.0 * trial, length)


def prepare_interpolation(motion, space, length):
    """Fill in the rows of dense output, by three more evaluations of the rates."""
    count, y, stages, rows = space.unknowns, space.y, space.stages, space.dense
    for s in range(EXTRA):
        for i in range(count):
            together = 0.0
            for j in range(STAGES + 1 + s):
                together += _EXTRA_WEIGHTS[s * ALL_STAGES + j] * stages[j * count + i]
            space.within[i] = y[i] + length * together
        rates = moved(stages, (STAGES + 1 + s) * count)
        rate_of_step(motion, space, space.within, rates)
    for i in range(count):
        change = space.new[i] - y[i]
        first, last = stages[i], stages[STAGES * count + i]
        rows[i] = change
        rows[count + i] = length * first - change
        rows[2 * count + i] = 2.0 * change - length * (last + first)
        for r in range(ROWS - 3):
            together = 0.0
            for j in range(ALL_STAGES):
                together += _DENSE_WEIGHTS[r * ALL_STAGES + j] * stages[j * count + i]
            rows[(3 + r) * count + i] = length * together


def interpolate(space, part):
    """Unknowns at a part of a step from its beginning."""
    for i in range(space.unknowns):
        value = 0.0
        for r in range(ROWS):
            row = space.dense[(ROWS - 1 - r) * space.unknowns + i]
            value = (value + row) * (part if r % 2 == 0 else 1.0 - part)
        space.within[i] = space.y[i] + value


class OrderEight(Stepper):
    """DOP853 in plain Python: every step can be followed with a debugger."""

    name = "python"
    begin = staticmethod(begin)
    attempt = staticmethod(attempt)
    reach = staticmethod(reach)
    unknowns_at = staticmethod(unknowns_at)
    retake = staticmethod(retake)
