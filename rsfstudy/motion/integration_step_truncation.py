"""Functions that truncate a step at the end of a regime, segment or motion."""

from __future__ import annotations

from rsfstudy.motion.array_layout import (
    FIRST_STATE,
    LOG_SLIP_RATE,
    LOG_SLIP_RATE_GROWTH,
    NORMAL_STRESS_RATIO,
    SLOW_REGIME,
    SPRING_STRESS,
)
from rsfstudy.motion.array_operations import evaluate_function_into_array
from rsfstudy.motion.integration_step_root_conditions import (
    SWITCH_CONDITION,
    TERMINATION_CONDITION,
    TIME_CONDITION,
    compute_excess_over_switch_threshold,
    locate_sign_change,
)
from rsfstudy.motion.integration_steps import (
    compute_time_at_step_begin,
    compute_time_at_step_end,
    compute_time_since_regime_start,
    truncate_step_at,
)
from rsfstudy.motion.regime_switching import (
    CONTINUES,
    compute_margin_to_motion_termination,
    find_termination_status,
    is_slip_slow_enough_for_slow_manifold,
    should_switch_back_to_slow_manifold,
)
from rsfstudy.motion.steppers import retake_step
from rsfstudy.parts import LOAD_VELOCITY

#: Number of iterations that correct the end of the last step of a loading segment.
SEGMENT_END_CORRECTION_ITERATIONS = 2


def is_step_end_valid(motion, workspace):
    """Return True if the motion is valid during at least part of the step.

    If the motion terminates within the step, the function truncates the step at that point.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    bool
        False if the motion is already invalid at the beginning of the step.
    """
    columns, velocity = workspace.point_at_end, workspace.parameters[LOAD_VELOCITY]
    motion.final_normal_stress = columns[NORMAL_STRESS_RATIO]
    motion.termination = find_termination_status(
        columns[LOG_SLIP_RATE], motion.final_normal_stress, velocity
    )
    if motion.termination == CONTINUES:
        return True
    at_begin = compute_margin_to_motion_termination(
        workspace.point_at_begin[LOG_SLIP_RATE],
        workspace.point_at_begin[NORMAL_STRESS_RATIO],
        velocity,
    )
    at_end = compute_margin_to_motion_termination(
        columns[LOG_SLIP_RATE], columns[NORMAL_STRESS_RATIO], velocity
    )
    if at_begin <= 0.0:
        return False
    truncate_step_at(
        motion,
        workspace,
        locate_sign_change(TERMINATION_CONDITION, at_begin, at_end, motion, workspace),
    )
    return True


def truncate_step_at_end_of_regime_or_segment(motion, workspace):
    """Truncate the step at the end of the regime or of the loading segment.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    leaves_regime : bool
        True if the motion must leave the slow manifold.
    is_over : bool
        True if the loading segment ends in this step.
    """
    before, after = (
        compute_excess_over_switch_threshold(motion, workspace, workspace.point_at_begin),
        compute_excess_over_switch_threshold(motion, workspace, workspace.point_at_end),
    )
    leaves = after >= 0.0 > before
    if leaves:
        truncate_step_at(
            motion,
            workspace,
            locate_sign_change(SWITCH_CONDITION, before, after, motion, workspace),
        )
    if motion.time_per_step > 0.0 and motion.end == motion.clock + motion.step_length:
        return leaves, True
    over = compute_time_at_step_end(motion, workspace) >= motion.end_time
    if over:
        motion.target_time = motion.end_time
        at_begin = compute_time_at_step_begin(motion, workspace) - motion.end_time
        at_end = compute_time_at_step_end(motion, workspace) - motion.end_time
        repeat_step_to_segment_end_time(
            motion,
            workspace,
            locate_sign_change(TIME_CONDITION, at_begin, at_end, motion, workspace),
        )
    return leaves, over


def repeat_step_to_segment_end_time(motion, workspace, independent_variable):
    """Repeat the step so that it ends at the end time of the segment.

    If numerical stability limits the step size, the dense output is much less accurate than the
    solution at the end of the step. The function therefore repeats the step more than once. After
    each repetition, the function corrects ``independent_variable`` for the remaining time between
    the end of the step and the end of the segment.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    independent_variable : float
        Estimate of the independent variable at the end time, computed from dense output.
    """
    for _ in range(SEGMENT_END_CORRECTION_ITERATIONS):
        retake_step(motion, workspace, independent_variable)
        late = compute_time_at_step_end(motion, workspace) - motion.end_time
        independent_variable -= late / compute_time_since_regime_start(
            motion, workspace, workspace.rates_at_end
        )
    evaluate_function_into_array(
        workspace.functions.fill_motion_point,
        workspace.y_end,
        workspace.rates_at_end,
        workspace.parameters,
        workspace.point_at_end,
    )


def has_rupture_regime_ended(motion, workspace):
    """Return True if the motion can return to the slow manifold.

    If the slip rate is small enough, the function evaluates the slow manifold at the spring stress
    and the states at the end of the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    bool
        True if the motion is in a rupture, and if the slip rate and the inertia effect are small
        enough for the slow manifold. See ``regime_switching.should_switch_back_to_slow_manifold``.
    """
    if motion.regime == SLOW_REGIME or not is_slip_slow_enough_for_slow_manifold(
        workspace.point_at_end[LOG_SLIP_RATE], workspace.switch_thresholds
    ):
        return False
    columns, below = workspace.point_at_end, workspace.point_within
    workspace.y_within[0] = columns[SPRING_STRESS]
    for i in range(motion.states):
        workspace.y_within[1 + i] = columns[FIRST_STATE + i]
    evaluate_function_into_array(
        workspace.functions.fill_force_balance,
        workspace.y_within,
        workspace.y_within,
        workspace.parameters,
        below,
    )
    missing = columns[SPRING_STRESS] - below[1]
    return should_switch_back_to_slow_manifold(
        columns[LOG_SLIP_RATE],
        columns[LOG_SLIP_RATE_GROWTH],
        below[0],
        missing,
        workspace.switch_thresholds,
    )
