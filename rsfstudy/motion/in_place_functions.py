"""The equations of a scene as the loop of motions calls them: functions that fill arrays.

They are made of the functions of floats of `slider.equations.Equations`. What the compiler makes of
them cannot raise: where a function does, the numbers that were to be filled in are NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from rsfstudy.motion.array_layout import FIRST_STATE, LOG_SLIP_RATE
from rsfstudy.motion.steppers import unrolled_step
from rsfstudy.slider import Equations, Function, Numbers


class InPlaceFunctions(NamedTuple):
    """Functions ``(y, rates, p, result)`` that fill arrays, in the order of the table of functions
    (`layout`); `attempt` is ``(y, stages, p, step)``, and the last is missing in ruptures.
    """

    fill_rates: Function
    fill_point: Function
    attempt_step: Function
    fill_balance: Function | None


def build_in_place_functions(equations: Equations) -> InPlaceFunctions:
    """The functions that fill arrays for a system of equations; the same ones for all scenes of the
    same parts.
    """
    rate, point, balance = (
        equations.rate_function,
        equations.point_function,
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
    rate_function: Function,
    point_function: Function,
    force_balance_function: Function | None,
    unknown_count: int,
    state_count: int,
    parameter_count: int,
) -> InPlaceFunctions:
    of_unknowns, numbers = (
        build_unpack_function(unknown_count),
        build_unpack_function(parameter_count),
    )
    return InPlaceFunctions(
        fill_rates=build_fill_rates_function(rate_function, of_unknowns, numbers, unknown_count),
        fill_point=build_fill_point_function(point_function, of_unknowns, numbers, state_count),
        attempt_step=unrolled_step.build_step_attempt_function(
            rate_function, unknown_count, numbers
        ),
        fill_balance=force_balance_function
        and build_fill_balance_function(
            force_balance_function, build_unpack_function(state_count, first_index=1), numbers
        ),
    )


def build_fill_rates_function(
    rate_function: Function,
    unpack_unknowns: Function,
    unpack_parameters: Function,
    unknown_count: int,
) -> Function:
    """Function that fills in the rates of so many unknowns."""

    def fill_rates(y, rates, p, result):  # type: ignore[no-untyped-def]
        for i in range(unknown_count):
            result[i] = math.nan
        changes = rate_function(unpack_unknowns(y), unpack_parameters(p))
        for i in range(unknown_count):
            result[i] = changes[i]

    return fill_rates


def build_fill_point_function(
    point_function: Function,
    unpack_unknowns: Function,
    unpack_parameters: Function,
    state_count: int,
) -> Function:
    """Function that fills in the columns of a point, of unknowns and their rates."""

    def fill_point(y, rates, p, result):  # type: ignore[no-untyped-def]
        result[LOG_SLIP_RATE] = math.nan
        point = point_function(unpack_unknowns(y), unpack_unknowns(rates), unpack_parameters(p))
        columns = point[:FIRST_STATE]
        for i in range(FIRST_STATE):
            result[i] = columns[i]
        for i in range(state_count):
            result[FIRST_STATE + i] = point.psis[i]

    return fill_point


def build_fill_balance_function(
    force_balance_function: Function, unpack_states: Function, unpack_parameters: Function
) -> Function:
    """Function that fills in ln(V/V_*) and friction on the slow manifold, at a spring stress and
    states.
    """

    def fill_balance(y, rates, p, result):  # type: ignore[no-untyped-def]
        result[0] = result[1] = math.nan
        log_slip_rate, friction, _shift = force_balance_function(
            y[0], unpack_states(y), unpack_parameters(p)
        )
        result[0] = log_slip_rate
        result[1] = friction

    return fill_balance


@cache
def build_unpack_function(item_count: int, first_index: int = 0) -> Callable[..., Numbers]:
    """A function that makes a tuple of so many numbers of an array."""
    made: dict[str, Any] = {}
    listed = ", ".join(f"y[{i}]" for i in range(first_index, first_index + item_count))
    exec(f"def unpacked(y):\n    return ({listed},)", made)
    function: Callable[..., Numbers] = made["unpacked"]
    return function
