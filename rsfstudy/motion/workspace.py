"""Workspace of one regime of a motion: the places of its numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy._deprecation import renamed_members
from rsfstudy.motion.array_layout import FIRST_STATE, FUNCTIONS_PER_REGIME, SLOW_REGIME
from rsfstudy.motion.array_operations import copy_values, evaluate_in_place, offset_pointer
from rsfstudy.motion.regime_switching import SwitchThresholds
from rsfstudy.motion.steppers.unrolled_step import (
    DENSE_ROW_COUNT,
    HEADER_SIZE,
    STAGE_COUNT,
    TOTAL_STAGE_COUNT,
)

Array = Any
#: Time by the clock of a step that stands for none.
MIN_TIME_PER_CLOCK = 1e-300


@renamed_members
class Workspace(NamedTuple):
    """Arrays of one regime, which are indexed only, and what it works with.

    Attributes
    ----------
    unknown_count : int
        How many unknowns there are.
    y, y_end : array
        Unknowns at the beginning of a step, and at its end.
    rates, rates_at_end : array
        Their rates there.
    stage_rates, order_eight_step_block, scales, dense_output_rows : array
        Of a step of order eight: its stages, of which the rates there are the first and the last;
        its block (see `steppers.unrolled`), and of this the scales of the unknowns and the rows of
        dense output.
    y_within, rates_within, dense_slopes : array
        Unknowns within the step, their rates, and slopes of dense output.
    point_at_begin, point_at_end, point_within : array
        Columns of the points at the beginning of the step, at its end, and within it.
    event_clocks : array
        Clocks at which events happen within a step.
    fill_rates, fill_point, attempt_step, fill_balance : function
        The equations (see `inplace`).
    event_specs : array
        Event specifications, one row of numbers after the other.
    event_spec_count : int
        How many rows.
    parameters, parameters_before : array
        The numbers of the scene, and what they were before the last kink.
    switch_thresholds : SwitchThresholds
        When to change between the regimes; none is read where there is no mass.
    stepper : object
        What takes the steps.
    """

    unknown_count: int
    y: Array
    y_end: Array
    rates: Array
    rates_at_end: Array
    stage_rates: Array
    order_eight_step_block: Array
    scales: Array
    dense_output_rows: Array
    y_within: Array
    rates_within: Array
    dense_slopes: Array
    point_at_begin: Array
    point_at_end: Array
    point_within: Array
    event_clocks: Array
    fill_rates: Any
    fill_point: Any
    attempt_step: Any
    fill_balance: Any
    event_specs: Array
    event_spec_count: int
    parameters: Array
    parameters_before: Array
    switch_thresholds: SwitchThresholds
    stepper: Any


def workspace_size(unknown_count: int, state_count: int, event_spec_count: int) -> int:
    """Length of a workspace."""
    of_unknowns = 1 + DENSE_ROW_COUNT + 1 + TOTAL_STAGE_COUNT + 1 + 1 + 1
    return (
        HEADER_SIZE
        + of_unknowns * unknown_count
        + 3 * (FIRST_STATE + state_count)
        + event_spec_count
    )


def create_workspace(
    workspace_block, y, unknown_count, unknown_scales, state_count, functions, shared_members
):
    """The workspace of a regime, in a block of that size; `shared_members` are its last six
    members.
    """
    new, columns = offset_pointer(workspace_block, HEADER_SIZE), FIRST_STATE + state_count
    own = offset_pointer(new, unknown_count)
    dense = offset_pointer(own, unknown_count)
    stages = offset_pointer(dense, DENSE_ROW_COUNT * unknown_count)
    within = offset_pointer(stages, TOTAL_STAGE_COUNT * unknown_count)
    before = offset_pointer(within, 3 * unknown_count)
    copy_values(unknown_scales, own, unknown_count)
    step = (
        stages,
        offset_pointer(stages, STAGE_COUNT * unknown_count),
        stages,
        workspace_block,
        own,
        dense,
    )
    inside = (
        within,
        offset_pointer(within, unknown_count),
        offset_pointer(within, 2 * unknown_count),
    )
    points = (
        before,
        offset_pointer(before, columns),
        offset_pointer(before, 2 * columns),
        offset_pointer(before, 3 * columns),
    )
    equations = functions[0], functions[1], functions[2], functions[FUNCTIONS_PER_REGIME - 1]
    return Workspace(unknown_count, y, new, *step, *inside, *points, *equations, *shared_members)


def fill_rates_by_step_clock(motion, workspace, y, result):
    """Fill in the rates at some unknowns by the clock of the step."""
    evaluate_in_place(workspace.fill_rates, y, y, workspace.parameters, result)
    if motion.time_per_step > 0.0:
        slower = motion.time_per_step / max(result[workspace.unknown_count - 1], MIN_TIME_PER_CLOCK)
        for i in range(workspace.unknown_count):
            result[i] *= slower


def count_evaluations(motion: Any, evaluation_count: int) -> None:
    """Count right-hand sides."""
    if motion.regime == SLOW_REGIME:
        motion.evaluations_slow += evaluation_count
    else:
        motion.evaluations_fast += evaluation_count
