"""Workspace of one regime of a motion: the places of its numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy.motion.calls import copy, evaluate, moved
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
    y, new : array
        Unknowns at the beginning of a step, and at its end.
    rates, rates_at_end : array
        Their rates there.
    stages, step, scales, dense : array
        Of a step of order eight: its stages, of which the rates there are the first and the last;
        its block (see `steppers.unrolled`), and of this the scales of the unknowns and the rows of
        dense output.
    within, rates_within, slopes : array
        Unknowns within the step, their rates, and slopes of dense output.
    before, after, between : array
        Columns of the points at the beginning of the step, at its end, and within it.
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
    rates: Array
    rates_at_end: Array
    stages: Array
    step: Array
    scales: Array
    dense: Array
    within: Array
    rates_within: Array
    slopes: Array
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


def workspace(block, y, unknowns, scales, states, functions, given):
    """The workspace of a regime, in a block of that size; `given` are its last six members."""
    new, columns = moved(block, SIZES), PSIS + states
    own = moved(new, unknowns)
    dense = moved(own, unknowns)
    stages = moved(dense, ROWS * unknowns)
    within = moved(stages, ALL_STAGES * unknowns)
    before = moved(within, 3 * unknowns)
    copy(scales, own, unknowns)
    step = stages, moved(stages, STAGES * unknowns), stages, block, own, dense
    inside = within, moved(within, unknowns), moved(within, 2 * unknowns)
    points = before, moved(before, columns), moved(before, 2 * columns), moved(before, 3 * columns)
    equations = functions[0], functions[1], functions[2], functions[FUNCTIONS - 1]
    return Workspace(unknowns, y, new, *step, *inside, *points, *equations, *given)


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
