"""Explicit Runge-Kutta stepper of order eight, which Numba can compile.

The tableau, the error estimate and the step size control are the same as in
``scipy.integrate.DOP853``. The Python engine calls the functions as methods of
``OrderEightStepper``, and the compiled loop calls them directly.
"""

from __future__ import annotations

import math

from scipy.integrate import DOP853

from rsfstudy.motion.array_operations import advance_pointer_by_items, evaluate_function_into_array
from rsfstudy.motion.max_step_length import MAX_STEP_LENGTH
from rsfstudy.motion.steppers import BUDGET_SPENT, NO_STEP, Stepper
from rsfstudy.motion.steppers.unrolled_runge_kutta_step import (
    DENSE_ROW_COUNT,
    ERROR_INDEX,
    EXTRA_STAGE_COUNT,
    LENGTH_INDEX,
    STAGE_COUNT,
    STAGE_COUNT_WITH_DENSE_OUTPUT,
    TOLERANCE_INDEX,
)
from rsfstudy.motion.workspace import count_evaluations, evaluate_rates_by_independent_variable

#: Runge-Kutta weights for dense output. ``_EXTRA_WEIGHTS`` defines the additional stages of dense
#: output. ``_DENSE_WEIGHTS`` contains the weights of all stages in the coefficients of dense
#: output.
_EXTRA_WEIGHTS, _DENSE_WEIGHTS = (tuple(x.ravel().tolist()) for x in (DOP853.A_EXTRA, DOP853.D))
#: Runge-Kutta weights of each stage. The last row contains the weights for the end of the step.
_RUNGE_KUTTA_STAGE_WEIGHTS = tuple(
    map(tuple, [*DOP853.A[:STAGE_COUNT, :STAGE_COUNT].tolist(), DOP853.B.tolist()])
)
#: Weights of the stages in the error estimates of order five and three.
_FIFTH_ORDER_WEIGHTS, _THIRD_ORDER_WEIGHTS = tuple(DOP853.E5.tolist()), tuple(DOP853.E3.tolist())
#: Constants of the step size control.
_SAFETY_FACTOR, _MIN_FACTOR, _MAX_FACTOR, _ERROR_EXPONENT = 0.9, 0.2, 10.0, -1.0 / 8.0


def begin_integration_of_regime(motion, workspace):
    """Evaluate the initial derivatives, and select the first step size.

    See ``Stepper.begin_regime``.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    """
    motion.clock = 0.0
    evaluate_function_into_array(
        workspace.functions.fill_rates,
        workspace.y,
        workspace.y,
        workspace.parameters,
        workspace.rates,
    )
    count_evaluations(motion, 1)
    if motion.next_step_length == 0.0:
        motion.next_step_length = min(
            select_initial_step_length(workspace, motion.direction, motion.tolerance),
            MAX_STEP_LENGTH,
        )
        count_evaluations(motion, 1)


def attempt_step(motion, workspace, max_length):
    """Take one step whose local error is within the tolerance.

    See ``Stepper.attempt_step``.

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
        Size of the step, ``NO_STEP`` or ``BUDGET_SPENT``.
    """
    towards = math.nextafter(motion.clock, motion.direction * math.inf)
    shortest = 10.0 * abs(towards - motion.clock)
    length = max(min(motion.next_step_length, max_length), shortest)
    rejected = False
    workspace.order_eight_step_block[TOLERANCE_INDEX], motion.time_per_step = motion.tolerance, 0.0
    while length >= shortest:
        motion.end = motion.clock + length * motion.direction
        motion.step_length = motion.end - motion.clock
        length = abs(motion.step_length)
        take_step_without_error_test(motion, workspace)
        if motion.evaluations_slow + motion.evaluations_fast > motion.budget:
            return BUDGET_SPENT
        error = workspace.order_eight_step_block[ERROR_INDEX]
        if error < 1.0:
            motion.next_step_length = increase_step_length(length, error, rejected)
            motion.is_dense = 0
            return length
        length, rejected = reduce_step_length(length, error), True
    return NO_STEP


def take_step_without_error_test(motion, workspace):
    """Take one step of size ``motion.step_length`` without an error test.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    """
    workspace.order_eight_step_block[LENGTH_INDEX] = motion.step_length
    evaluate_function_into_array(
        workspace.functions.attempt_step,
        workspace.y,
        workspace.stage_rates,
        workspace.parameters,
        workspace.order_eight_step_block,
    )
    count_evaluations(motion, STAGE_COUNT)


def step_to_segment_end(motion, workspace, approximate_length):
    """Take one step to the end of the loading segment.

    Time is the last unknown, and its value at the end of the segment is known. The function
    therefore integrates this step with an independent variable that is proportional to time. The
    constant of proportionality is chosen so that, at the beginning of the step, this variable
    advances at the same rate as the usual independent variable. See
    ``Stepper.step_to_segment_end``.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    approximate_length : float
        Estimate of the step size.

    Returns
    -------
    float
        Size of the step, ``BUDGET_SPENT``, or 0 if the error of the step exceeds the tolerance.
    """
    motion.time_per_step, motion.step_length = (
        workspace.rates[workspace.unknown_count - 1],
        approximate_length,
    )
    motion.end, motion.is_dense = motion.clock + approximate_length, 0
    error = take_step_with_time_as_variable(motion, workspace)
    count_evaluations(motion, STAGE_COUNT)
    if motion.evaluations_slow + motion.evaluations_fast > motion.budget:
        return BUDGET_SPENT
    if error < 1.0:
        motion.next_step_length = max(
            motion.next_step_length, increase_step_length(approximate_length, error, False)
        )
        return approximate_length
    motion.next_step_length = reduce_step_length(approximate_length, error)
    return 0.0


def take_step_with_time_as_variable(motion, workspace):
    """Take one step with time as the independent variable, and return the error ratio.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    float
        Local error divided by the tolerance. The step is accurate enough if the value is below 1.
    """
    count, y, new, stages, length = (
        workspace.unknown_count,
        workspace.y,
        workspace.y_end,
        workspace.stage_rates,
        motion.step_length,
    )
    for s in range(1, STAGE_COUNT + 1):
        for i in range(count):
            together = 0.0
            for j in range(s):
                together += _RUNGE_KUTTA_STAGE_WEIGHTS[s][j] * stages[j * count + i]
            new[i] = y[i] + length * together
        evaluate_rates_by_independent_variable(
            motion, workspace, new, advance_pointer_by_items(stages, s * count)
        )
    fifth = third = 0.0
    for i in range(count):
        of_fifth = of_third = 0.0
        for j in range(STAGE_COUNT + 1):
            of_fifth += _FIFTH_ORDER_WEIGHTS[j] * stages[j * count + i]
            of_third += _THIRD_ORDER_WEIGHTS[j] * stages[j * count + i]
        allowed = motion.tolerance * (workspace.scales[i] + max(abs(y[i]), abs(new[i])))
        fifth += (of_fifth / allowed) * (of_fifth / allowed)
        third += (of_third / allowed) * (of_third / allowed)
    both = fifth + 0.01 * third
    return length * fifth / math.sqrt(both * count) if both != 0.0 else 0.0


def retake_step(motion, workspace, independent_variable):
    """Repeat the current step up to an earlier point.

    See ``Stepper.retake_step``.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    independent_variable : float
        Independent variable at the new end of the step.
    """
    motion.end, motion.step_length, motion.is_dense = (
        independent_variable,
        independent_variable - motion.clock,
        0,
    )
    motion.time_per_step = 0.0
    take_step_without_error_test(motion, workspace)


def interpolate_unknowns(motion, workspace, independent_variable):
    """Use the dense output to interpolate the unknowns within the step.

    See ``Stepper.interpolate_unknowns``.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    independent_variable : float
        Value of the independent variable between the beginning and the end of the step.
    """
    if not motion.is_dense:
        prepare_dense_output(motion, workspace, motion.step_length)
        count_evaluations(motion, EXTRA_STAGE_COUNT)
        motion.is_dense = 1
    evaluate_dense_output(workspace, (independent_variable - motion.clock) / motion.step_length)


def increase_step_length(length, error_over_tolerance, was_rejected_before):
    """Compute the size of the next step after an accepted step.

    Parameters
    ----------
    length : float
        Size of the accepted step.
    error_over_tolerance : float
        Local error of the accepted step, divided by the tolerance.
    was_rejected_before : bool
        True if an attempt with a larger step size was rejected before this step was accepted. In
        this case, the step size does not increase.

    Returns
    -------
    float
        Size of the next step.
    """
    factor = (
        _MAX_FACTOR
        if error_over_tolerance == 0.0
        else min(_MAX_FACTOR, _SAFETY_FACTOR * error_over_tolerance**_ERROR_EXPONENT)
    )
    return length * (min(1.0, factor) if was_rejected_before else factor)


def reduce_step_length(length, error_over_tolerance):
    """Compute the size of the next attempt after a rejected step.

    Parameters
    ----------
    length : float
        Size of the rejected step.
    error_over_tolerance : float
        Local error of the rejected step, divided by the tolerance. The value may be NaN.

    Returns
    -------
    float
        Size of the next attempt.
    """
    factor = _SAFETY_FACTOR * error_over_tolerance**_ERROR_EXPONENT
    return length * (factor if factor > _MIN_FACTOR else _MIN_FACTOR)


def select_initial_step_length(workspace, integration_direction, tolerance):
    """Select the size of the first step of a regime.

    The algorithm needs one evaluation of the right-hand side.

    Parameters
    ----------
    workspace : Workspace
        Arrays of the regime, with the initial unknowns and their derivatives.
    integration_direction : float
        Direction of the step, 1 or -1.
    tolerance : float
        Local error tolerance.

    Returns
    -------
    float
        Step size.

    References
    ----------
    Hairer, E., Norsett, S. P. and Wanner, G. (1993), Solving Ordinary Differential Equations I,
    section II.4.
    """
    y, first, count = workspace.y, workspace.rates, workspace.unknown_count
    d0 = d1 = 0.0
    for i in range(count):
        scale = tolerance * (workspace.scales[i] + abs(y[i]))
        d0 += (y[i] / scale) * (y[i] / scale)
        d1 += (first[i] / scale) * (first[i] / scale)
    d0, d1 = math.sqrt(d0 / count), math.sqrt(d1 / count)
    trial = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    for i in range(count):
        workspace.y_end[i] = y[i] + trial * integration_direction * first[i]
    evaluate_function_into_array(
        workspace.functions.fill_rates, workspace.y_end, y, workspace.parameters, workspace.y_within
    )
    d2 = 0.0
    for i in range(count):
        scale = tolerance * (workspace.scales[i] + abs(y[i]))
        change = (workspace.y_within[i] - first[i]) / scale
        d2 += change * change
    d2 = math.sqrt(d2 / count) / trial
    if d1 <= 1e-15 and d2 <= 1e-15:
        length = max(1e-6, trial * 1e-3)
    else:
        length = (0.01 / max(d1, d2)) ** -_ERROR_EXPONENT
    return min(100.0 * trial, length)


def prepare_dense_output(motion, workspace, step_length):
    """Compute the coefficients of the dense output of the step.

    The function evaluates the right-hand side three times.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime, with the stages of the step.
    step_length : float
        Size of the step.
    """
    count, y, stages, rows = (
        workspace.unknown_count,
        workspace.y,
        workspace.stage_rates,
        workspace.dense_output_rows,
    )
    for s in range(EXTRA_STAGE_COUNT):
        for i in range(count):
            together = 0.0
            for j in range(STAGE_COUNT + 1 + s):
                together += (
                    _EXTRA_WEIGHTS[s * STAGE_COUNT_WITH_DENSE_OUTPUT + j] * stages[j * count + i]
                )
            workspace.y_within[i] = y[i] + step_length * together
        rates = advance_pointer_by_items(stages, (STAGE_COUNT + 1 + s) * count)
        evaluate_rates_by_independent_variable(motion, workspace, workspace.y_within, rates)
    for i in range(count):
        change = workspace.y_end[i] - y[i]
        first, last = stages[i], stages[STAGE_COUNT * count + i]
        rows[i] = change
        rows[count + i] = step_length * first - change
        rows[2 * count + i] = 2.0 * change - step_length * (last + first)
        for r in range(DENSE_ROW_COUNT - 3):
            together = 0.0
            for j in range(STAGE_COUNT_WITH_DENSE_OUTPUT):
                together += (
                    _DENSE_WEIGHTS[r * STAGE_COUNT_WITH_DENSE_OUTPUT + j] * stages[j * count + i]
                )
            rows[(3 + r) * count + i] = step_length * together


def evaluate_dense_output(workspace, step_fraction):
    """Evaluate the dense output within the step.

    Parameters
    ----------
    workspace : Workspace
        Arrays of the regime, with the coefficients of the dense output.
    step_fraction : float
        Distance from the beginning of the step, divided by the step size.
    """
    for i in range(workspace.unknown_count):
        value = 0.0
        for r in range(DENSE_ROW_COUNT):
            row = workspace.dense_output_rows[
                (DENSE_ROW_COUNT - 1 - r) * workspace.unknown_count + i
            ]
            value = (value + row) * (step_fraction if r % 2 == 0 else 1.0 - step_fraction)
        workspace.y_within[i] = workspace.y[i] + value


class OrderEightStepper(Stepper):
    """Explicit Runge-Kutta stepper of order eight in plain Python.

    The stepper is useful for debugging, because a debugger can follow every stage of a step.

    Parameters
    ----------
    systems : tuple of EquationsOfMotion
        Equations of each regime, indexed by ``motion.regime``.
    methods : mapping of str to str
        Ignored, because the stepper has a single method.
    """

    name = "python"
    begin_regime = staticmethod(begin_integration_of_regime)
    attempt_step = staticmethod(attempt_step)
    step_to_segment_end = staticmethod(step_to_segment_end)
    interpolate_unknowns = staticmethod(interpolate_unknowns)
    retake_step = staticmethod(retake_step)
