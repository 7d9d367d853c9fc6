"""Functions that convert equations of motion to functions that fill arrays.

The event loop calls the equations through functions that fill arrays. The functions of
``slider.equations.EquationsOfMotion`` take and return tuples of floats.
``build_in_place_functions`` converts these functions to functions that fill arrays. Compiled
functions cannot raise exceptions. Each function therefore first fills its results with NaN. The
values remain NaN if the equations raise an exception in compiled code.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from rsfstudy.motion.array_layout import FIRST_STATE, LOG_SLIP_RATE
from rsfstudy.motion.steppers import unrolled_runge_kutta_step
from rsfstudy.slider import EquationsOfMotion, FloatTuple, NumericFunction


class InPlaceFunctions(NamedTuple):
    """Functions that evaluate a system of equations, in the order of the function table.

    Each function has the arguments ``(y, rates, p, result)``, and fills the ``result`` array. The
    only exception is ``attempt_step``, whose arguments are ``(y, stages, p, step)``.

    Parameters
    ----------
    fill_rates : callable
        Function that fills in the derivatives of the unknowns.
    fill_motion_point : callable
        Function that fills an array with the values of a point of the motion.
    attempt_step : callable
        Function that attempts one step. See ``steppers.unrolled_runge_kutta_step``.
    fill_force_balance : callable or None
        Function that fills in ln(V/V_*) and friction on the slow manifold. The value is None for
        the inertial equations of motion in ruptures.
    """

    fill_rates: NumericFunction
    fill_motion_point: NumericFunction
    attempt_step: NumericFunction
    fill_force_balance: NumericFunction | None


def build_in_place_functions(equations: EquationsOfMotion) -> InPlaceFunctions:
    """Convert the functions of a system of equations to functions that fill arrays.

    Parameters
    ----------
    equations : EquationsOfMotion
        System of equations.

    Returns
    -------
    InPlaceFunctions
        Functions that fill arrays. All scenes with the same combination of parts share these
        functions.
    """
    rate, point, balance = (
        equations.rate_function,
        equations.motion_point_function,
        equations.force_balance_function,
    )
    return _build_in_place_functions_cached(
        rate,
        point,
        balance,
        len(equations.unknown_names),
        equations.state_count,
        len(equations.parameters),
    )


@cache
def _build_in_place_functions_cached(
    rate_function: NumericFunction,
    motion_point_function: NumericFunction,
    force_balance_function: NumericFunction | None,
    unknown_count: int,
    state_count: int,
    parameter_count: int,
) -> InPlaceFunctions:
    """Build the in-place functions once for each combination of scene parts."""
    of_unknowns, numbers = (
        build_array_unpacking_function(unknown_count),
        build_array_unpacking_function(parameter_count),
    )
    return InPlaceFunctions(
        fill_rates=build_fill_rates_function(rate_function, of_unknowns, numbers, unknown_count),
        fill_motion_point=build_fill_motion_point_function(
            motion_point_function, of_unknowns, numbers, state_count
        ),
        attempt_step=unrolled_runge_kutta_step.build_step_attempt_function(
            rate_function, unknown_count, numbers
        ),
        fill_force_balance=force_balance_function
        and build_fill_force_balance_function(
            force_balance_function,
            build_array_unpacking_function(state_count, first_index=1),
            numbers,
        ),
    )


def build_fill_rates_function(
    rate_function: NumericFunction,
    unpack_unknowns: NumericFunction,
    unpack_parameters: NumericFunction,
    unknown_count: int,
) -> NumericFunction:
    """Build the function that fills in the derivatives of the unknowns.

    Parameters
    ----------
    rate_function : callable
        Right-hand side of the equations.
    unpack_unknowns, unpack_parameters : callable
        Functions that convert arrays to tuples.
    unknown_count : int
        Number of unknowns.

    Returns
    -------
    callable
        Function ``fill_rates(y, rates, p, result)``.
    """

    def fill_rates(y, rates, p, result):  # type: ignore[no-untyped-def]
        for i in range(unknown_count):
            result[i] = math.nan
        changes = rate_function(unpack_unknowns(y), unpack_parameters(p))
        for i in range(unknown_count):
            result[i] = changes[i]

    return fill_rates


def build_fill_motion_point_function(
    motion_point_function: NumericFunction,
    unpack_unknowns: NumericFunction,
    unpack_parameters: NumericFunction,
    state_count: int,
) -> NumericFunction:
    """Build the function that fills an array with a point of the motion.

    Parameters
    ----------
    motion_point_function : callable
        Function that returns a ``MotionPoint`` for the unknowns and their derivatives.
    unpack_unknowns, unpack_parameters : callable
        Functions that convert arrays to tuples.
    state_count : int
        Number of states.

    Returns
    -------
    callable
        Function ``fill_motion_point(y, rates, p, result)``.
    """

    def fill_motion_point(y, rates, p, result):  # type: ignore[no-untyped-def]
        result[LOG_SLIP_RATE] = math.nan
        point = motion_point_function(
            unpack_unknowns(y), unpack_unknowns(rates), unpack_parameters(p)
        )
        columns = point[:FIRST_STATE]
        for i in range(FIRST_STATE):
            result[i] = columns[i]
        for i in range(state_count):
            result[FIRST_STATE + i] = point.psis[i]

    return fill_motion_point


def build_fill_force_balance_function(
    force_balance_function: NumericFunction,
    unpack_states: NumericFunction,
    unpack_parameters: NumericFunction,
) -> NumericFunction:
    """Build the function that solves the force balance on the slow manifold.

    Parameters
    ----------
    force_balance_function : callable
        Function that returns ln(V/V_*), friction and the state shift.
    unpack_states, unpack_parameters : callable
        Functions that convert arrays to tuples.

    Returns
    -------
    callable
        Function ``fill_force_balance(y, rates, p, result)``. The function fills in ln(V/V_*) and
        friction for the spring stress and the states in ``y``.
    """

    def fill_force_balance(y, rates, p, result):  # type: ignore[no-untyped-def]
        result[0] = result[1] = math.nan
        log_slip_rate, friction, _shift = force_balance_function(
            y[0], unpack_states(y), unpack_parameters(p)
        )
        result[0] = log_slip_rate
        result[1] = friction

    return fill_force_balance


@cache
def build_array_unpacking_function(
    item_count: int, first_index: int = 0
) -> Callable[..., FloatTuple]:
    """Build a function that converts items of an array to a tuple.

    Parameters
    ----------
    item_count : int
        Number of items.
    first_index : int, default: 0
        Index of the first item.

    Returns
    -------
    callable
        Function that takes an array and returns a tuple of float.
    """
    made: dict[str, Any] = {}
    listed = ", ".join(f"y[{i}]" for i in range(first_index, first_index + item_count))
    exec(f"def unpacked(y):\n    return ({listed},)", made)
    function: Callable[..., FloatTuple] = made["unpacked"]
    return function
