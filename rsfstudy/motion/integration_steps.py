"""Functions that integrate, refine and truncate a single step.

In each step, the event loop calls ``take_step`` first. The other functions evaluate the motion
within the step, or change the end of the step.
"""

from __future__ import annotations

import math

from rsfstudy.motion.array_layout import (
    BUDGET_EXCEEDED,
    FAST_REGIME,
    FIRST_STATE,
    INVALID_STEP,
    LOG_SLIP_RATE,
    NO_STEP_POSSIBLE,
    NORMAL_STRESS_RATIO,
    STEP_TAKEN_CODE,
)
from rsfstudy.motion.array_operations import copy_values, evaluate_function_into_array
from rsfstudy.motion.max_step_length import MAX_STEP_LENGTH, compute_max_step_length
from rsfstudy.motion.steppers import (
    attempt_step,
    interpolate_unknowns,
    retake_step,
    step_to_segment_end,
)
from rsfstudy.motion.workspace import count_evaluations, evaluate_rates_by_independent_variable
from rsfstudy.parts import LOAD_VELOCITY, LOG_LOAD_VELOCITY, STIFFNESS

#: Constants of ``halve_step_until_dense_output_is_accurate``. ``MAX_SLOPE_ERROR`` limits the error
#: of the derivative of dense output, multiplied by the step size and divided by the local
#: tolerance. ``MAX_HALVINGS`` is the maximum number of times that a step is halved. After a step
#: with accurate dense output, the limit of the step size is multiplied by ``GROWTH_FACTOR``.
#: ``SLOPE_SPACING`` is the spacing of the finite differences of dense output, divided by the step
#: size.
MAX_SLOPE_ERROR, MAX_HALVINGS, GROWTH_FACTOR, SLOPE_SPACING = 300.0, 6, 1.3, 5e-3


def compute_time_since_regime_start(motion, workspace, y):
    """Return the time since the start of the regime.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    y : array of shape (unknown_count,)
        Unknowns, or their derivatives.

    Returns
    -------
    float
        Time in D_c/V_*, or NaN if time is not an unknown.
    """
    if not motion.has_clock:
        return math.nan
    unit = workspace.switch_thresholds.inertial_time if motion.regime == FAST_REGIME else 1.0
    return unit * y[workspace.unknown_count - 1]


def compute_time_at_step_begin(motion, workspace):
    """Return the time from the start of the segment to the start of the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    float
        Time in D_c/V_*, or NaN if time is not an unknown.
    """
    return motion.regime_start_time + compute_time_since_regime_start(
        motion, workspace, workspace.y
    )


def compute_time_at_step_end(motion, workspace):
    """Return the time from the start of the segment to the end of the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    float
        Time in D_c/V_*, or NaN if time is not an unknown.
    """
    return motion.regime_start_time + compute_time_since_regime_start(
        motion, workspace, workspace.y_end
    )


def compute_slip_since_motion_start(motion, independent_variable, time, spring_stress, parameters):
    r"""Compute the slip since the start of the motion.

    Slip is the independent variable of a rigid slider. For other sliders, slip is computed from the
    spring stress :math:`f = f_0 + K (V_0 t - \delta)`, after the change in spring stress due to
    noise has been subtracted.

    Parameters
    ----------
    motion : record
        State of the motion.
    independent_variable : float
        Independent variable at the point.
    time : float
        Time since the start of the loading segment, in D_c/V_*.
    spring_stress : float
        Spring stress at the point, in sigma_*.
    parameters : array
        Parameters of the scene.

    Returns
    -------
    float
        Slip in D_c.
    """
    if motion.slip_is_clock:
        return independent_variable
    if motion.noise_rate_index > 0:
        spring_stress -= parameters[motion.noise_rate_index] * time
    return motion.slip + (
        parameters[LOAD_VELOCITY] * time
        - (spring_stress - motion.spring_stress) / parameters[STIFFNESS]
    )


def take_step(motion, workspace):
    """Take one step whose local error is within the tolerance.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    int
        ``STEP_TAKEN_CODE``, ``NO_STEP_POSSIBLE``, ``BUDGET_EXCEEDED`` or ``INVALID_STEP``. A step
        is invalid if its size is zero or if its end is not finite.
    """
    longest = MAX_STEP_LENGTH
    if motion.clock_is_path_length:
        longest = compute_max_step_length(
            workspace.point_at_begin[LOG_SLIP_RATE],
            workspace.point_at_begin[NORMAL_STRESS_RATIO],
            workspace.parameters[LOG_LOAD_VELOCITY],
        )
    longest *= motion.step_limit_factor
    if motion.recording_mode:
        longest = min(longest, motion.dense_output_limit)
    length = 0.0
    if motion.kinks_ahead > 0:
        length = take_step_to_next_loading_kink(
            motion, workspace, min(longest, motion.next_step_length)
        )
    if length == 0.0:
        length = attempt_step(motion, workspace, longest)
    motion.steps += 1
    if length <= 0.0:
        return NO_STEP_POSSIBLE if length == 0.0 else BUDGET_EXCEEDED
    total = 0.0
    for i in range(workspace.unknown_count):
        total += workspace.y_end[i]
    if motion.end == motion.clock or not math.isfinite(total):
        return INVALID_STEP
    return STEP_TAKEN_CODE


def take_step_to_next_loading_kink(motion, workspace, max_length):
    """Take a step to the next kink of the loading, and return the step size.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    max_length : float
        Maximum step size.

    Returns
    -------
    float
        Size of the step, ``BUDGET_SPENT``, or 0 if no step was taken. The function takes no step if
        the kink is farther away than ``max_length``, or if the stepper cannot take this step.
    """
    left = motion.end_time - compute_time_at_step_begin(motion, workspace)
    length = left / compute_time_since_regime_start(motion, workspace, workspace.rates)
    return step_to_segment_end(motion, workspace, length) if 0.0 < length <= max_length else 0.0


def halve_step_until_dense_output_is_accurate(motion, workspace):
    """Halve the step until its dense output is accurate.

    The event loop calls this function for steps that are recorded. If numerical stability limits
    the step size, the dense output is much less accurate than the solution at the end of the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    """
    for _ in range(MAX_HALVINGS):
        if is_dense_output_accurate(motion, workspace):
            motion.dense_output_limit *= GROWTH_FACTOR
            return
        retake_step(motion, workspace, motion.clock + 0.5 * (motion.end - motion.clock))
        motion.next_step_length = motion.dense_output_limit = abs(motion.step_length)


def is_dense_output_accurate(motion, workspace):
    """Return True if the dense output of the step is accurate.

    The function compares the derivatives of dense output with the right-hand side at two points of
    the step. Let h be the step size and e the error of dense output. The derivatives then differ by
    a few times e/h, plus the change in the right-hand side caused by e. If stability limits the
    step size, the two terms are of similar size.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    bool
        True if the derivatives agree within ``MAX_SLOPE_ERROR`` times the tolerance.
    """
    for i in range(workspace.unknown_count):
        workspace.rates_within[i] = 0.0
    for part in (0.3, 0.7):
        clock = motion.clock + part * motion.step_length
        for i in range(workspace.unknown_count):
            workspace.dense_slopes[i] = 0.0
        for shift, weight in ((2.0, -1.0), (1.0, 8.0), (-1.0, -8.0), (-2.0, 1.0)):
            interpolate_unknowns(
                motion, workspace, clock + shift * SLOPE_SPACING * motion.step_length
            )
            for i in range(workspace.unknown_count):
                workspace.dense_slopes[i] += weight / (12.0 * SLOPE_SPACING) * workspace.y_within[i]
        interpolate_unknowns(motion, workspace, clock)
        count_evaluations(motion, 1)
        evaluate_rates_by_independent_variable(
            motion, workspace, workspace.y_within, workspace.rates_within
        )
        for i in range(workspace.unknown_count):
            differ = abs(motion.step_length * workspace.rates_within[i] - workspace.dense_slopes[i])
            size = workspace.scales[i] + max(abs(workspace.y[i]), abs(workspace.y_end[i]))
            # The negation rejects NaN.
            if not differ <= MAX_SLOPE_ERROR * motion.tolerance * size:
                return False
    return True


def evaluate_point_within_step(motion, workspace, independent_variable):
    """Compute ``workspace.point_within`` at a value of the independent variable.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    independent_variable : float
        Value of the independent variable between the beginning and the end of the step.
    """
    interpolate_unknowns(motion, workspace, independent_variable)
    count_evaluations(motion, 1)
    evaluate_function_into_array(
        workspace.functions.fill_rates,
        workspace.y_within,
        workspace.y_within,
        workspace.parameters,
        workspace.rates_within,
    )
    evaluate_function_into_array(
        workspace.functions.fill_motion_point,
        workspace.y_within,
        workspace.rates_within,
        workspace.parameters,
        workspace.point_within,
    )


def truncate_step_at(motion, workspace, independent_variable):
    """Truncate the step at a value of the independent variable within the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    independent_variable : float
        Value of the independent variable between the beginning and the end of the step.
    """
    if independent_variable != motion.end:
        evaluate_point_within_step(motion, workspace, independent_variable)
        copy_values(workspace.point_within, workspace.point_at_end, FIRST_STATE + motion.states)
        copy_values(workspace.y_within, workspace.y_end, workspace.unknown_count)
        motion.end = independent_variable
