"""Workspace that contains the arrays, functions and constants for integrating one regime.

``motion_loop.advance_motion`` creates a workspace for each regime, and steppers receive it as an
argument. The arrays are written by the following functions. Functions without a module name belong
to ``motion_loop``, ``regime_starts`` or ``integration_step_truncation``.

=========================================  ====================================================
Arrays                                     Written by
=========================================  ====================================================
y                                          set_initial_unknowns_of_regime,
                                           move_step_begin_to_step_end
rates                                      stepper (at the start of a regime),
                                           move_step_begin_to_step_end
y_end, rates_at_end                        stepper (each step),
                                           integration_steps.truncate_step_at (y_end only)
stage_rates, order_eight_step_block,       steppers.order_eight
dense_output_rows
y_within                                   stepper (each interpolation), has_rupture_regime_ended
rates_within, point_within                 integration_steps.evaluate_point_within_step,
                                           integration_steps.is_dense_output_accurate
                                           (rates_within),
                                           has_rupture_regime_ended (point_within)
dense_slopes                               integration_steps.is_dense_output_accurate
point_at_begin                             integrate_one_regime (at its start),
                                           move_step_begin_to_step_end
point_at_end                               integrate_one_regime (each step),
                                           repeat_step_to_segment_end_time,
                                           integration_steps.truncate_step_at
event_clocks, event_specs                  integration_step_events.locate_events_in_step
parameters, parameters_before              start_next_segment
=========================================  ====================================================
"""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.motion.array_layout import FIRST_STATE, SLOW_REGIME
from rsfstudy.motion.array_operations import (
    advance_pointer_by_items,
    copy_values,
    evaluate_function_into_array,
)
from rsfstudy.motion.in_place_functions import InPlaceFunctions
from rsfstudy.motion.regime_switching import RegimeSwitchThresholds
from rsfstudy.motion.steppers.unrolled_runge_kutta_step import (
    DENSE_ROW_COUNT,
    HEADER_SIZE,
    STAGE_COUNT,
    STAGE_COUNT_WITH_DENSE_OUTPUT,
)

ArrayOrPointer = Any
#: Positive number that replaces a zero derivative of time, to avoid a division by zero.
REPLACEMENT_OF_ZERO_TIME_DERIVATIVE = 1e-300


@add_former_member_names
class Workspace(NamedTuple):
    """Arrays, functions and constants that the event loop needs to integrate one regime.

    In compiled code, the arrays are represented by pointers, which only support indexing.

    Parameters
    ----------
    unknown_count : int
        Number of unknowns.
    y, y_end : array of shape (unknown_count,)
        Unknowns at the beginning and at the end of the step.
    rates, rates_at_end : array of shape (unknown_count,)
        Derivatives of the unknowns at the beginning and at the end of the step.
    stage_rates : array
        Derivatives in all stages of an order-eight step. The arrays ``rates`` and ``rates_at_end``
        are part of this array.
    order_eight_step_block : array
        Header, final unknowns, scales and dense output of an order-eight step. See
        ``steppers.unrolled_runge_kutta_step``.
    scales : array of shape (unknown_count,)
        Scales of the unknowns. The allowed error of an unknown is the tolerance multiplied by the
        sum of its scale and its magnitude.
    dense_output_rows : array
        Coefficients of the dense output of an order-eight step.
    y_within, rates_within : array of shape (unknown_count,)
        Unknowns within the step, and their derivatives.
    dense_slopes : array of shape (unknown_count,)
        Derivatives of the dense output.
    point_at_begin, point_at_end, point_within : array
        Points of the motion at the beginning of the step, at the end of the step, and within the
        step. See the column indices in ``array_layout``.
    event_clocks : array of shape (event_spec_count,)
        Values of the independent variable at the events of the step, or NaN for events that do not
        occur.
    functions : InPlaceFunctions
        Functions of the equations, which are the row of the regime in the function table. In
        compiled code, functions are represented by addresses.
    event_specs : array
        Flattened table of event specifications.
    event_spec_count : int
        Number of event specifications.
    parameters, parameters_before : array
        Parameters of the scene after and before the last kink of the loading.
    switch_thresholds : RegimeSwitchThresholds
        Thresholds for changes between the regimes. All thresholds are NaN if the scene has no
        inertia.
    stepper : Stepper
        Stepper of the motion.
    """

    unknown_count: int
    y: ArrayOrPointer
    y_end: ArrayOrPointer
    rates: ArrayOrPointer
    rates_at_end: ArrayOrPointer
    stage_rates: ArrayOrPointer
    order_eight_step_block: ArrayOrPointer
    scales: ArrayOrPointer
    dense_output_rows: ArrayOrPointer
    y_within: ArrayOrPointer
    rates_within: ArrayOrPointer
    dense_slopes: ArrayOrPointer
    point_at_begin: ArrayOrPointer
    point_at_end: ArrayOrPointer
    point_within: ArrayOrPointer
    event_clocks: ArrayOrPointer
    functions: InPlaceFunctions
    event_specs: ArrayOrPointer
    event_spec_count: int
    parameters: ArrayOrPointer
    parameters_before: ArrayOrPointer
    switch_thresholds: RegimeSwitchThresholds
    stepper: Any


def compute_workspace_size(unknown_count: int, state_count: int, event_spec_count: int) -> int:
    """Compute the length of the array that holds a workspace.

    Parameters
    ----------
    unknown_count : int
        Largest number of unknowns of a regime.
    state_count : int
        Number of states.
    event_spec_count : int
        Number of event specifications.

    Returns
    -------
    int
        Number of floats.
    """
    of_unknowns = 1 + DENSE_ROW_COUNT + 1 + STAGE_COUNT_WITH_DENSE_OUTPUT + 1 + 1 + 1
    return (
        HEADER_SIZE
        + of_unknowns * unknown_count
        + 3 * (FIRST_STATE + state_count)
        + event_spec_count
    )


def create_workspace(
    workspace_block,
    y,
    unknown_count,
    unknown_scales,
    state_count,
    functions,
    members_shared_by_regimes,
):
    """Create the workspace of a regime within a block of memory.

    Parameters
    ----------
    workspace_block : array
        Memory of the arrays. See ``compute_workspace_size``.
    y : array
        Unknowns at the beginning of the step.
    unknown_count : int
        Number of unknowns of the regime.
    unknown_scales : array of shape (unknown_count,)
        Scales of the unknowns.
    state_count : int
        Number of states.
    functions : sequence
        Row of the function table.
    members_shared_by_regimes : tuple
        Values of the last six fields of the workspace, which both regimes share.

    Returns
    -------
    Workspace
        Workspace of the regime.
    """
    new, columns = advance_pointer_by_items(workspace_block, HEADER_SIZE), FIRST_STATE + state_count
    own = advance_pointer_by_items(new, unknown_count)
    dense = advance_pointer_by_items(own, unknown_count)
    stages = advance_pointer_by_items(dense, DENSE_ROW_COUNT * unknown_count)
    within = advance_pointer_by_items(stages, STAGE_COUNT_WITH_DENSE_OUTPUT * unknown_count)
    before = advance_pointer_by_items(within, 3 * unknown_count)
    copy_values(unknown_scales, own, unknown_count)
    step = (
        stages,
        advance_pointer_by_items(stages, STAGE_COUNT * unknown_count),
        stages,
        workspace_block,
        own,
        dense,
    )
    inside = (
        within,
        advance_pointer_by_items(within, unknown_count),
        advance_pointer_by_items(within, 2 * unknown_count),
    )
    points = (
        before,
        advance_pointer_by_items(before, columns),
        advance_pointer_by_items(before, 2 * columns),
        advance_pointer_by_items(before, 3 * columns),
    )
    row = InPlaceFunctions(functions[0], functions[1], functions[2], functions[3])
    return Workspace(
        unknown_count, y, new, *step, *inside, *points, row, *members_shared_by_regimes
    )


def evaluate_rates_by_independent_variable(motion, workspace, y, result):
    """Evaluate the derivatives with respect to the step's independent variable.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Workspace of the regime.
    y : array of shape (unknown_count,)
        Unknowns.
    result : array of shape (unknown_count,)
        Output array of the derivatives. If ``motion.time_per_step`` is positive, the independent
        variable of the step is proportional to time.
    """
    evaluate_function_into_array(workspace.functions.fill_rates, y, y, workspace.parameters, result)
    if motion.time_per_step > 0.0:
        slower = motion.time_per_step / max(
            result[workspace.unknown_count - 1], REPLACEMENT_OF_ZERO_TIME_DERIVATIVE
        )
        for i in range(workspace.unknown_count):
            result[i] *= slower


def count_evaluations(motion: Any, evaluation_count: int) -> None:
    """Add right-hand side evaluations to the counter of the current regime.

    Parameters
    ----------
    motion : record
        State of the motion.
    evaluation_count : int
        Number of evaluations.
    """
    if motion.regime == SLOW_REGIME:
        motion.evaluations_slow += evaluation_count
    else:
        motion.evaluations_fast += evaluation_count
