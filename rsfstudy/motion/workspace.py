"""Workspace of one regime of a motion: the places of its numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy.motion.calls import evaluate, moved
from rsfstudy.motion.handover import Limits
from rsfstudy.motion.layout import FUNCTIONS, PSIS, SLOW
from rsfstudy.motion.steppers.unrolled import ALL_STAGES, ROWS, SIZES, STAGES

Array = Any
#: Time by the clock of a step that stands for none.
LEAST = 1e-300


class Workspace(NamedTuple):
    """Arrays of one regime, which are indexed only, and what it works with.

    Attributes
    ----------
    unknowns : int
        How many unknowns there are.
    y, new, within : array
        Unknowns at the beginning of a step, at its end, and within it.
    rates, rates_at_end, rates_within : array
        Their rates there.
    slopes : array
        Slopes of dense output.
    stages, step, scales, dense : array
        Of a step of order eight: its stages; its block (see `steppers.unrolled`), and of this the
        scales of the unknowns and the rows of dense output.
    before, after, between : array
        Columns of the points there.
    when : array
        Clocks at which events happen within a step.
    rate, point, attempt, balance : function
        The equations (see `columns`).
    specs : array
        Event specifications, one row of numbers after the other.
    specified : int
        How many rows.
    p, p_before : array
        The numbers of the scene, and what they were before the last kink.
    limits : Limits
        When to change between the regimes; none is read where there is no mass.
    stepper : object
        What takes the steps.
    """

    unknowns: int
    y: Array
    new: Array
    within: Array
    rates: Array
    rates_at_end: Array
    rates_within: Array
    slopes: Array
    stages: Array
    step: Array
    scales: Array
    dense: Array
    before: Array
    after: Array
    between: Array
    when: Array
    rate: Any
    point: Any
    attempt: Any
    balance: Any
    specs: Array
    specified: int
    p: Array
    p_before: Array
    limits: Limits
    stepper: Any


def size(unknowns: int, states: int, specs: int) -> int:
    """Length of a workspace."""
    of_unknowns = 1 + ROWS + 1 + ALL_STAGES + 1 + 1 + 1
    return SIZES + of_unknowns * unknowns + 3 * (PSIS + states) + specs


def workspace(
    block, y, unknowns, scales, states, functions, specs, specified, p, p_before, limits, stepper
):
    """The workspace of a regime, in a block of that size."""
    new = moved(block, SIZES)
    own = moved(new, unknowns)
    dense = moved(own, unknowns)
    stages = moved(dense, ROWS * unknowns)
    within = moved(stages, ALL_STAGES * unknowns)
    rates_within = moved(within, unknowns)
    slopes = moved(rates_within, unknowns)
    before = moved(slopes, unknowns)
    after = moved(before, PSIS + states)
    between = moved(after, PSIS + states)
    when = moved(between, PSIS + states)
    copy(scales, own, unknowns)
    return Workspace(
        unknowns,
        y,
        new,
        within,
        stages,
        moved(stages, STAGES * unknowns),
        rates_within,
        slopes,
        stages,
        block,
        own,
        dense,
        before,
        after,
        between,
        when,
        functions[0],
        functions[1],
        functions[2],
        functions[FUNCTIONS - 1],
        specs,
        specified,
        p,
        p_before,
        limits,
        stepper,
    )


def copy(source, target, count):
    """Copy so many numbers."""
    for i in range(count):
        target[i] = source[i]


def rate_of_step(motion, space, y, result):
    """Fill in the rates at some unknowns by the clock of the step."""
    evaluate(space.rate, y, y, space.p, result)
    if motion.pace > 0.0:
        slower = motion.pace / max(result[space.unknowns - 1], LEAST)
        for i in range(space.unknowns):
            result[i] *= slower


def spend(motion: Any, evaluations: int) -> None:
    """Count right-hand sides."""
    if motion.regime == SLOW:
        motion.spent_slow += evaluations
    else:
        motion.spent_fast += evaluations
