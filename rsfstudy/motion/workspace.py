"""Workspace of one regime of a motion: the places of its numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy._deprecation import renamed_members
from rsfstudy.motion.array_calls import copy_values, evaluate, offset_by
from rsfstudy.motion.layout import FIRST_STATE, FUNCTIONS_PER_REGIME, SLOW_REGIME
from rsfstudy.motion.regime_switching import SwitchThresholds
from rsfstudy.motion.steppers.unrolled_step import (
    DENSE_ROW_COUNT,
    HEADER_SIZE,
    STAGE_COUNT,
    TOTAL_STAGE_COUNT,
)

Array = Any
#: Time by the clock of a step that stands for none.
MIN_TIME_RATE = 1e-300


@renamed_members
class Workspace(NamedTuple):
    """Arrays of one regime, which are indexed only, and what it works with.

    Attributes
    ----------
    unknowns : int
        How many unknowns there are.
    y, y_end : array
        Unknowns at the beginning of a step, and at its end.
    rates, rates_at_end : array
        Their rates there.
    stages, step_block, scales, dense_rows : array
        Of a step of order eight: its stages, of which the rates there are the first and the last;
        its block (see `steppers.unrolled`), and of this the scales of the unknowns and the rows of
        dense output.
    y_within, rates_within, dense_slopes : array
        Unknowns within the step, their rates, and slopes of dense output.
    point_at_begin, point_at_end, point_within : array
        Columns of the points at the beginning of the step, at its end, and within it.
    event_clocks : array
        Clocks at which events happen within a step.
    rate, point, attempt, balance : function
        The equations (see `inplace`).
    specs : array
        Event specifications, one row of numbers after the other.
    spec_count : int
        How many rows.
    parameters, parameters_before : array
        The numbers of the scene, and what they were before the last kink.
    limits : SwitchThresholds
        When to change between the regimes; none is read where there is no mass.
    stepper : object
        What takes the steps.
    """

    unknowns: int
    y: Array
    y_end: Array
    rates: Array
    rates_at_end: Array
    stages: Array
    step_block: Array
    scales: Array
    dense_rows: Array
    y_within: Array
    rates_within: Array
    dense_slopes: Array
    point_at_begin: Array
    point_at_end: Array
    point_within: Array
    event_clocks: Array
    rate: Any
    point: Any
    attempt: Any
    balance: Any
    specs: Array
    spec_count: int
    parameters: Array
    parameters_before: Array
    limits: SwitchThresholds
    stepper: Any


def workspace_size(unknowns: int, states: int, specs: int) -> int:
    """Length of a workspace."""
    of_unknowns = 1 + DENSE_ROW_COUNT + 1 + TOTAL_STAGE_COUNT + 1 + 1 + 1
    return HEADER_SIZE + of_unknowns * unknowns + 3 * (FIRST_STATE + states) + specs


def create_workspace(block, y, unknowns, scales, states, functions, shared_members):
    """The workspace of a regime, in a block of that size; `shared_members` are its last six
    members.
    """
    new, columns = offset_by(block, HEADER_SIZE), FIRST_STATE + states
    own = offset_by(new, unknowns)
    dense = offset_by(own, unknowns)
    stages = offset_by(dense, DENSE_ROW_COUNT * unknowns)
    within = offset_by(stages, TOTAL_STAGE_COUNT * unknowns)
    before = offset_by(within, 3 * unknowns)
    copy_values(scales, own, unknowns)
    step = stages, offset_by(stages, STAGE_COUNT * unknowns), stages, block, own, dense
    inside = within, offset_by(within, unknowns), offset_by(within, 2 * unknowns)
    points = (
        before,
        offset_by(before, columns),
        offset_by(before, 2 * columns),
        offset_by(before, 3 * columns),
    )
    equations = functions[0], functions[1], functions[2], functions[FUNCTIONS_PER_REGIME - 1]
    return Workspace(unknowns, y, new, *step, *inside, *points, *equations, *shared_members)


def step_rates(motion, space, y, result):
    """Fill in the rates at some unknowns by the clock of the step."""
    evaluate(space.rate, y, y, space.parameters, result)
    if motion.time_per_step > 0.0:
        slower = motion.time_per_step / max(result[space.unknowns - 1], MIN_TIME_RATE)
        for i in range(space.unknowns):
            result[i] *= slower


def count_evaluations(motion: Any, evaluations: int) -> None:
    """Count right-hand sides."""
    if motion.regime == SLOW_REGIME:
        motion.evaluations_slow += evaluations
    else:
        motion.evaluations_fast += evaluations
