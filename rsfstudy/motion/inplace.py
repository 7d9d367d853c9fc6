"""The equations of a scene as the loop of motions calls them: functions that fill arrays.

They are made of the functions of floats of `slider.equations.Equations`. What the compiler makes of
them cannot raise: where a function does, the numbers that were to be filled in are NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from rsfstudy.motion.layout import FIRST_STATE, LOG_SLIP_RATE
from rsfstudy.motion.steppers import unrolled_step
from rsfstudy.slider import Equations, Function, Numbers


class InPlaceFunctions(NamedTuple):
    """Functions ``(y, rates, p, result)`` that fill arrays, in the order of the table of functions
    (`layout`); `attempt` is ``(y, stages, p, step)``, and the last is missing in ruptures.
    """

    rates: Function
    point: Function
    attempt: Function
    balance: Function | None


def in_place_functions(equations: Equations) -> InPlaceFunctions:
    """The functions that fill arrays for a system of equations; the same ones for all scenes of the
    same parts.
    """
    rate, point, balance = (
        equations.rate_function,
        equations.point_function,
        equations.balance_function,
    )
    return _build_in_place(
        rate,
        point,
        balance,
        len(equations.unknowns),
        equations.state_count,
        len(equations.parameters),
    )


@cache
def _build_in_place(
    rate: Function,
    point: Function,
    balance: Function | None,
    unknowns: int,
    states: int,
    parameters: int,
) -> InPlaceFunctions:
    of_unknowns, numbers = unpack_function(unknowns), unpack_function(parameters)
    return InPlaceFunctions(
        rates=fill_rates_function(rate, of_unknowns, numbers, unknowns),
        point=fill_point_function(point, of_unknowns, numbers, states),
        attempt=unrolled_step.build_attempt_function(rate, unknowns, numbers),
        balance=balance
        and fill_balance_function(balance, unpack_function(states, first=1), numbers),
    )


def fill_rates_function(
    rate_of: Function, unpack_unknowns: Function, unpack_parameters: Function, count: int
) -> Function:
    """Function that fills in the rates of so many unknowns."""

    def fill_rates(y, rates, p, result):  # type: ignore[no-untyped-def]
        for i in range(count):
            result[i] = math.nan
        changes = rate_of(unpack_unknowns(y), unpack_parameters(p))
        for i in range(count):
            result[i] = changes[i]

    return fill_rates


def fill_point_function(
    point_of: Function, unpack_unknowns: Function, unpack_parameters: Function, states: int
) -> Function:
    """Function that fills in the columns of a point, of unknowns and their rates."""

    def fill_point(y, rates, p, result):  # type: ignore[no-untyped-def]
        result[LOG_SLIP_RATE] = math.nan
        point = point_of(unpack_unknowns(y), unpack_unknowns(rates), unpack_parameters(p))
        columns = point[:FIRST_STATE]
        for i in range(FIRST_STATE):
            result[i] = columns[i]
        for i in range(states):
            result[FIRST_STATE + i] = point.psis[i]

    return fill_point


def fill_balance_function(
    balance_of: Function, unpack_states: Function, unpack_parameters: Function
) -> Function:
    """Function that fills in ln(V/V_*) and friction on the slow manifold, at a spring stress and
    states.
    """

    def fill_balance(y, rates, p, result):  # type: ignore[no-untyped-def]
        result[0] = result[1] = math.nan
        log_slip_rate, friction, _shift = balance_of(y[0], unpack_states(y), unpack_parameters(p))
        result[0] = log_slip_rate
        result[1] = friction

    return fill_balance


@cache
def unpack_function(count: int, first: int = 0) -> Callable[..., Numbers]:
    """A function that makes a tuple of so many numbers of an array."""
    made: dict[str, Any] = {}
    listed = ", ".join(f"y[{i}]" for i in range(first, first + count))
    exec(f"def unpacked(y):\n    return ({listed},)", made)
    function: Callable[..., Numbers] = made["unpacked"]
    return function
