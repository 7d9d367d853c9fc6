"""Steps of one system of equations, for the compiler: taken, looked into, and cut short."""

from __future__ import annotations

import math

import numpy as np

from rsfstudy.motion.compiled.calls import evaluate
from rsfstudy.motion.compiled.order_eight import (
    EXTRA,
    STAGES,
    attempt,
    copy,
    error_norm,
    first_length,
    interpolate,
    interpolated,
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
    RATIO,
    SLOW,
)
from rsfstudy.slider.equations import LONGEST_STEP, stride
from rsfstudy.slider.slots import LOG_LOAD_RATE

#: What `take_step` returns where it has taken one.
TAKEN = -1


def rates_of(now):
    """Address of the rates of the unknowns."""
    return now.slow_rates if now.regime == SLOW else now.fast_rates


def fill_point(now, y, rates, p, columns):
    """Fill in what the slider does, at unknowns with these rates."""
    evaluate(now.slow_point if now.regime == SLOW else now.fast_point, y, rates, p, columns)


def elapsed(now, clock, y, limits):
    """Time since the regime began; NaN where nothing tells it."""
    if now.regime == FAST:
        return clock * limits.inertial_time
    return y[now.unknowns - 1] if now.has_clock else math.nan


def begin(now, room, p):
    """Start the clock of the equations."""
    rates = rates_of(now)
    now.clock = 0.0
    evaluate(rates, room.y, room.y, p, room.stages[0])
    length = first_length(
        room.y, room.stages, room.new, now.direction, room.scales, now.tolerance, rates, p
    )
    now.length = min(length, LONGEST_STEP)
    spend(now, 2)


def take_step(now, room, limits, p):
    """Take a step whose local error is allowed; why not, where there is none.

    Where steps become shorter than the spacing of floating-point numbers around it, the clock
    starts anew.
    """
    longest = LONGEST_STEP
    if now.regime == SLOW and now.strides:
        longest = stride(room.before[LOG_RATE], room.before[RATIO], p[LOG_LOAD_RATE])
    longest *= now.finer
    while True:
        shortest = 10.0 * abs(np.nextafter(now.clock, now.direction * np.inf) - now.clock)
        length = attempted(now, room, longest, shortest, p)
        now.steps += 1
        if length > 0.0:
            break
        if length < 0.0:
            return BUDGET_SPENT
        if now.clock == 0.0 or not now.anew:
            return NO_STEP
        now.started += elapsed(now, now.clock, room.y, limits)
        begin(now, room, p)
    total = 0.0
    for i in range(len(room.new)):
        total += room.new[i]
    if now.end == now.clock or not math.isfinite(total):
        return NO_LENGTH
    return TAKEN


def attempted(now, room, longest, shortest, p):
    """Length of the step that could be taken; 0 where it would be too short, and less where the
    budget is spent.
    """
    length = max(min(now.length, longest), shortest)
    rejected = False
    while length >= shortest:
        now.end = now.clock + length * now.direction
        now.taken = now.end - now.clock
        length = abs(now.taken)
        attempt(room.y, room.stages, now.taken, room.new, rates_of(now), p)
        spend(now, STAGES)
        if now.spent_slow + now.spent_fast > now.budget:
            return -1.0
        error = error_norm(room.y, room.new, room.stages, length, room.scales, now.tolerance)
        if error < 1.0:
            now.length = stretched(length, error, rejected)
            now.is_dense = 0
            return length
        length, rejected = shortened(length, error), True
    return 0.0


def unknowns_at(now, room, clock, p):
    """Fill in the unknowns at a clock within the step."""
    if not now.is_dense:
        interpolate(
            room.y, room.new, room.within, room.stages, now.taken, room.dense, rates_of(now), p
        )
        spend(now, EXTRA)
        now.is_dense = 1
    interpolated(room.y, room.dense, (clock - now.clock) / now.taken, room.within)


def point_within(now, room, clock, p):
    """Fill in what the slider does at a clock within the step."""
    unknowns_at(now, room, clock, p)
    spend(now, 1)
    rates = room.stages[STAGES + EXTRA]  # not needed once dense output is there
    evaluate(rates_of(now), room.within, room.within, p, rates)
    fill_point(now, room.within, rates, p, room.between)


def cut(now, room, clock, p):
    """Let the step end at a clock within it."""
    if clock != now.end:
        point_within(now, room, clock, p)
        copy(room.between, room.after)
        copy(room.within, room.new)
        now.end = clock
