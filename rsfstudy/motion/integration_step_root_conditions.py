"""Conditions whose roots are located within a step.

An event occurs when a function of time, for example a derivative of ln V, becomes zero. The end of
a regime, a requested time and the termination of the motion are also roots of functions. These
functions are called conditions. If a condition changes sign between the ends of the step,
``locate_sign_change`` finds the root with dense output.
"""

from __future__ import annotations

from rsfstudy.motion.array_layout import (
    APPARENT_FRICTION,
    APPARENT_FRICTION_RATE,
    EVENT_SPECIFICATION_COLUMNS,
    FRICTIONAL_STRESS,
    LOG_SLIP_RATE,
    LOG_SLIP_RATE_GROWTH,
    MAXIMUM,
    MINIMUM,
    NORMAL_STRESS_RATIO,
    RISE,
    SLOW_REGIME,
    SPEC_KIND,
    SPEC_LEVEL,
    SPEC_MAY_REPORT_LATER,
    SPEC_QUANTITY,
    SPRING_STRESS,
)
from rsfstudy.motion.array_operations import advance_pointer_by_items
from rsfstudy.motion.integration_steps import (
    compute_time_since_regime_start,
    evaluate_point_within_step,
)
from rsfstudy.motion.regime_switching import (
    compute_inertia_effect_over_limit,
    compute_margin_to_motion_termination,
)
from rsfstudy.motion.root_finding import build_root_finder
from rsfstudy.motion.steppers import interpolate_unknowns
from rsfstudy.parts import LOAD_VELOCITY, LOG_LOAD_VELOCITY

#: Conditions whose roots are located in addition to the requested events: the end of the regime, a
#: target time, and the termination of the motion. The values are floats because Numba would compile
#: a separate function for each integer literal.
SWITCH_CONDITION, TIME_CONDITION, TERMINATION_CONDITION = -1.0, -2.0, -3.0


def evaluate_event_function(event_spec, point_columns, parameters):
    """Return the quantity that changes sign at an event.

    For an extremum, the result is the derivative of the requested quantity. For a crossing, the
    result is the difference between the requested quantity and the level.

    Parameters
    ----------
    event_spec : array
        Row of the table of event specifications.
    point_columns : array of shape (FIRST_STATE + states,)
        Point of the motion. The column indices are defined in ``array_layout``.
    parameters : array
        Parameters of the scene.

    Returns
    -------
    float
        Derivative or difference. The sign changes at the event.
    """
    if event_spec[SPEC_KIND] == MAXIMUM or event_spec[SPEC_KIND] == MINIMUM:
        if event_spec[SPEC_QUANTITY] == LOG_SLIP_RATE:
            return point_columns[LOG_SLIP_RATE_GROWTH]
        if event_spec[SPEC_QUANTITY] == APPARENT_FRICTION:
            return point_columns[APPARENT_FRICTION_RATE]
        return parameters[LOG_LOAD_VELOCITY] - point_columns[LOG_SLIP_RATE]
    return point_columns[int(event_spec[SPEC_QUANTITY])] - event_spec[SPEC_LEVEL]


def get_event_specification(workspace, spec_index):
    """Return the table row of an event specification.

    Parameters
    ----------
    workspace : Workspace
        Arrays of the regime.
    spec_index : int
        Index of the event specification.

    Returns
    -------
    array
        Row of the table. The columns are ``array_layout.EVENT_SPECIFICATION_COLUMNS``.
    """
    return advance_pointer_by_items(
        workspace.event_specs, len(EVENT_SPECIFICATION_COLUMNS) * spec_index
    )


def may_any_event_be_reported_later(workspace):
    """Return True if any requested event may be reported later than it occurs.

    Parameters
    ----------
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    bool
        True if at least one event specification has the flag ``SPEC_MAY_REPORT_LATER``.
    """
    found = False
    for w in range(workspace.event_spec_count):
        found = found or get_event_specification(workspace, w)[SPEC_MAY_REPORT_LATER] != 0.0
    return found


def compute_excess_over_switch_threshold(motion, workspace, point_columns):
    """Return the ratio of the inertia effect to its limit, minus 1.

    If the result is zero or positive, the motion must leave the slow manifold. In ruptures, and for
    motions without inertia, the function returns -1.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    point_columns : array of shape (FIRST_STATE + states,)
        Point of the motion. The column indices are defined in ``array_layout``.

    Returns
    -------
    float
        Ratio of the inertia effect to its limit, minus 1.
    """
    if motion.regime != SLOW_REGIME or not motion.has_mass:
        return -1.0
    missing = point_columns[SPRING_STRESS] - point_columns[FRICTIONAL_STRESS]
    return (
        compute_inertia_effect_over_limit(
            point_columns[LOG_SLIP_RATE], missing, workspace.switch_thresholds
        )
        - 1.0
    )


def has_event_occurred(event_spec, quantity_before, quantity_after, integration_direction):
    """Return True if a quantity changes sign in the direction that defines an event.

    Parameters
    ----------
    event_spec : array
        Row of the table of event specifications.
    quantity_before : float
        Value of ``evaluate_event_function`` at the beginning of the interval.
    quantity_after : float
        Value of ``evaluate_event_function`` at the end of the interval.
    integration_direction : float
        Direction of the independent variable, 1 or -1.

    Returns
    -------
    bool
        True if the event occurs between the beginning and the end of the interval.
    """
    upwards = event_spec[SPEC_KIND] == RISE or event_spec[SPEC_KIND] == MINIMUM
    # If the integration runs backward, derivatives change sign in the opposite direction.
    if integration_direction < 0.0 and (
        event_spec[SPEC_KIND] == MAXIMUM or event_spec[SPEC_KIND] == MINIMUM
    ):
        upwards = not upwards
    if upwards:
        return quantity_before < 0.0 <= quantity_after
    return quantity_before > 0.0 >= quantity_after


def evaluate_root_condition(independent_variable, condition_context):
    """Evaluate a condition within the step. The root finder calls this function.

    Parameters
    ----------
    independent_variable : float
        Value of the independent variable between the beginning and the end of the step.
    condition_context : tuple of (float, record, Workspace)
        Condition, state of the motion and arrays of the regime. The condition is the index of an
        event specification, ``SWITCH_CONDITION``, ``TIME_CONDITION`` or ``TERMINATION_CONDITION``.

    Returns
    -------
    float
        Value of the condition. The value is zero at the root.
    """
    what, motion, workspace = condition_context
    if what == TIME_CONDITION:
        interpolate_unknowns(motion, workspace, independent_variable)
        return (
            motion.regime_start_time
            + compute_time_since_regime_start(motion, workspace, workspace.y_within)
            - motion.target_time
        )
    evaluate_point_within_step(motion, workspace, independent_variable)
    if what == SWITCH_CONDITION:
        return compute_excess_over_switch_threshold(motion, workspace, workspace.point_within)
    if what == TERMINATION_CONDITION:
        return compute_margin_to_motion_termination(
            workspace.point_within[LOG_SLIP_RATE],
            workspace.point_within[NORMAL_STRESS_RATIO],
            workspace.parameters[LOAD_VELOCITY],
        )
    return evaluate_event_function(
        get_event_specification(workspace, int(what)), workspace.point_within, workspace.parameters
    )


_find_root_of_condition = build_root_finder(evaluate_root_condition)


def locate_sign_change(condition, value_at_begin, value_at_end, motion, workspace):
    """Locate the root of a condition within the step.

    The tolerance of the root is 1e-15 times the step size for ``TIME_CONDITION``, and 1e-13 times
    the step size for all other conditions.

    Parameters
    ----------
    condition : float
        Index of an event specification, ``SWITCH_CONDITION``, ``TIME_CONDITION`` or
        ``TERMINATION_CONDITION``.
    value_at_begin : float
        Value of the condition at the beginning of the step.
    value_at_end : float
        Value of the condition at the end of the step.
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.

    Returns
    -------
    float
        Independent variable at the root.
    """
    width = abs(motion.end - motion.clock)
    finest, relative = (
        (1e-15 * width, 1e-15) if condition == TIME_CONDITION else (1e-13 * width, 1e-14)
    )
    given = condition, motion, workspace
    return _find_root_of_condition(
        motion.clock, motion.end, value_at_begin, value_at_end, finest, relative, given
    )
