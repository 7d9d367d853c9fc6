"""Steps of one system of equations, for the compiler: taken, looked into, and cut short."""

from __future__ import annotations

import math

import numpy as np

from rsfstudy.motion.compiled.calls import evaluate
from rsfstudy.motion.compiled.order_eight import (
    copy,
    first_length,
    interpolate,
    prepare_interpolation,
    shortened,
    stretched,
)
from rsfstudy.motion.compiled.room import spend
from rsfstudy.motion.compiled.table import (
    BUDGET_SPENT,
    FAST,
    LOG_RATE,
    NO_LENGTH,
    NO_STEP,
    PSIS,
    RATIO,
)
from rsfstudy.motion.compiled.unrolled import ERROR, EXTRA, LENGTH, STAGES
from rsfstudy.slider.equations import LONGEST_STEP, stride
from rsfstudy.slider.slots import LOG_LOAD_RATE

#: What `take_step` returns where it has taken one.
TAKEN = -1


def elapsed(now, room, y, limits):
    """Time since the regime began, at some unknowns; NaN where nothing tells it."""
    if not now.has_clock:
        return math.nan
    unit = limits.inertial_time if now.regime == FAST else 1.0
    return unit * y[room.unknowns - 1]


def begin(now, room):
    """Start the clock of the equations."""
    now.clock = 0.0
    evaluate(room.rates, room.y, room.y, room.p, room.stages)
    now.length = min(first_length(room, now.direction, now.tolerance), LONGEST_STEP)
    spend(now, 2)


def take_step(now, room):
    """Take a step whose local error is allowed; why not, where there is none."""
    longest = LONGEST_STEP
    if now.strides:
        longest = stride(room.before[LOG_RATE], room.before[RATIO], room.p[LOG_LOAD_RATE])
    longest *= now.finer
    shortest = 10.0 * abs(np.nextafter(now.clock, now.direction * np.inf) - now.clock)
    length = attempted(now, room, longest, shortest)
    now.steps += 1
    if length <= 0.0:
        return NO_STEP if length == 0.0 else BUDGET_SPENT
    total = 0.0
    for i in range(room.unknowns):
        total += room.new[i]
    if now.end == now.clock or not math.isfinite(total):
        return NO_LENGTH
    return TAKEN


def attempted(now, room, longest, shortest):
    """Length of the step that could be taken; 0 where it would be too short, and less where the
    budget is spent.
    """
    length = max(min(now.length, longest), shortest)
    rejected = False
    while length >= shortest:
        now.end = now.clock + length * now.direction
        now.taken = now.end - now.clock
        length = abs(now.taken)
        room.step[LENGTH] = now.taken
        evaluate(room.attempt, room.y, room.stages, room.p, room.step)
        spend(now, STAGES)
        if now.spent_slow + now.spent_fast > now.budget:
            return -1.0
        error = room.step[ERROR]
        if error < 1.0:
            now.length = stretched(length, error, rejected)
            now.is_dense = 0
            return length
        length, rejected = shortened(length, error), True
    return 0.0


def retake(now, room, clock):
    """Take the step anew, to a clock within it."""
    now.end, now.taken, now.is_dense = clock, clock - now.clock, 0
    room.step[LENGTH] = now.taken
    evaluate(room.attempt, room.y, room.stages, room.p, room.step)
    spend(now, STAGES)


def unknowns_at(now, room, clock):
    """Fill in the unknowns at a clock within the step."""
    if not now.is_dense:
        prepare_interpolation(room, now.taken)
        spend(now, EXTRA)
        now.is_dense = 1
    interpolate(room, (clock - now.clock) / now.taken)


def point_within(now, room, clock):
    """Fill in what the slider does at a clock within the step."""
    unknowns_at(now, room, clock)
    spend(now, 1)
    evaluate(room.rates, room.within, room.within, room.p, room.rates_within)
    evaluate(room.point, room.within, room.rates_within, room.p, room.between)


def cut(now, room, clock):
    """Let the step end at a clock within it."""
    if clock != now.end:
        point_within(now, room, clock)
        copy(room.between, room.after, PSIS + now.states)
        copy(room.within, room.new, room.unknowns)
        now.end = clock
