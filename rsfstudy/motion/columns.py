"""The equations of a scene as the loop of motions calls them: functions that fill arrays.

They are made of the functions of floats of `slider.equations.Equations`. What the compiler makes of
them cannot raise: where a function does, the numbers that were to be filled in are NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from rsfstudy.motion.layout import LOG_RATE, PSIS
from rsfstudy.motion.steppers import unrolled
from rsfstudy.slider.equations import Equations
from rsfstudy.slider.parts import Function, Numbers


class Filling(NamedTuple):
    """Functions ``(y, rates, p, result)`` that fill arrays, in the order of the table of functions
    (`layout`); `attempt` is ``(y, stages, p, step)``, and the last is missing in ruptures.
    """

    rates: Function
    point: Function
    attempt: Function
    balance: Function | None


def filling(equations: Equations) -> Filling:
    """The functions that fill arrays for a system of equations; the same ones for all scenes of the
    same parts.
    """
    rate, point, balance = equations.rate, equations.point, equations.balance
    return _filling(
        rate, point, balance, len(equations.unknowns), equations.states, len(equations.p)
    )


@cache
def _filling(
    rate: Function,
    point: Function,
    balance: Function | None,
    unknowns: int,
    states: int,
    count: int,
) -> Filling:
    of_unknowns, numbers = unpacking(unknowns), unpacking(count)
    return Filling(
        rates=rates_into(rate, of_unknowns, numbers, unknowns),
        point=point_into(point, of_unknowns, numbers, states),
        attempt=unrolled.attempt(rate, unknowns, numbers),
        balance=balance and balance_into(balance, unpacking(states, first=1), numbers),
    )


def rates_into(rate_of: Function, unknowns: Function, numbers: Function, count: int) -> Function:
    """Function that fills in the rates of so many unknowns."""

    def fill_rates(y, rates, p, result):  # type: ignore[no-untyped-def]
        for i in range(count):
            result[i] = math.nan
        changes = rate_of(unknowns(y), numbers(p))
        for i in range(count):
            result[i] = changes[i]

    return fill_rates


def point_into(point_of: Function, unknowns: Function, numbers: Function, states: int) -> Function:
    """Function that fills in the columns of a point, of unknowns and their rates."""

    def fill_point(y, rates, p, result):  # type: ignore[no-untyped-def]
        result[LOG_RATE] = math.nan
        point = point_of(unknowns(y), unknowns(rates), numbers(p))
        columns = point[:PSIS]
        for i in range(PSIS):
            result[i] = columns[i]
        for i in range(states):
            result[PSIS + i] = point.psis[i]

    return fill_point


def balance_into(balance_of: Function, psis_of: Function, numbers: Function) -> Function:
    """Function that fills in ln(V/V_*) and friction on the slow manifold, at a spring stress and
    states.
    """

    def fill_balance(y, rates, p, result):  # type: ignore[no-untyped-def]
        result[0] = result[1] = math.nan
        log_slip_rate, friction, _shift = balance_of(y[0], psis_of(y), numbers(p))
        result[0] = log_slip_rate
        result[1] = friction

    return fill_balance


@cache
def unpacking(count: int, first: int = 0) -> Callable[..., Numbers]:
    """A function that makes a tuple of so many numbers of an array."""
    made: dict[str, Any] = {}
    listed = ", ".join(f"y[{i}]" for i in range(first, first + count))
    exec(f"def unpacked(y):\n    return ({listed},)", made)
    function: Callable[..., Numbers] = made["unpacked"]
    return function
