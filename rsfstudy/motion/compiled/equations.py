"""The equations of a scene as the compiled motion calls them: functions that fill arrays.

They wrap the functions of floats that SciPy calls, for which the names below stand. What is called
by its address cannot raise: where a function does, the numbers that were to be filled in are NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from rsfstudy.motion.compiled.table import (
    COEFFICIENT,
    FRICTION,
    GROWTH,
    IMBALANCE,
    LOG_RATE,
    PSI,
    PSIS,
    RATIO,
    READING,
    READING_GROWTH,
    SPRING,
    STATE,
    UNREST,
)
from rsfstudy.slider.parts import Function, Numbers

UNKNOWNS = STATES = 0


def _open(*_arguments: Any) -> NoReturn:
    raise TypeError("a place in the compiled equations that nothing has filled")


def unknowns(y):
    """The unknowns as a tuple."""
    _open(y)


def numbers(p):
    """The numbers of a scene as a tuple."""
    _open(p)


def psis_of(y):
    """The states, behind the spring stress, as a tuple."""
    _open(y)


def rate_of(state, p):
    """Rates of the unknowns."""
    _open(state, p)


def point_of(state, rates, p):
    """What the slider does."""
    _open(state, rates, p)


def balance_of(spring, psis, p):
    """ln(V/V_*) and friction on the slow manifold."""
    _open(spring, psis, p)


def fill_rates(y, rates, p, result):
    """The rates of the unknowns."""
    for i in range(UNKNOWNS):
        result[i] = math.nan
    changes = rate_of(unknowns(y), numbers(p))
    for i in range(UNKNOWNS):
        result[i] = changes[i]


def fill_point(y, rates, p, result):
    """The columns of a point."""
    result[LOG_RATE] = math.nan
    point = point_of(unknowns(y), unknowns(rates), numbers(p))
    result[LOG_RATE] = point.log_rate
    result[GROWTH] = point.growth
    result[SPRING] = point.spring
    result[FRICTION] = point.friction
    result[PSI] = point.psi
    result[STATE] = point.state
    result[IMBALANCE] = point.imbalance
    result[UNREST] = point.unrest
    result[COEFFICIENT] = point.coefficient
    result[RATIO] = point.normal_stress
    result[READING] = point.reading
    result[READING_GROWTH] = point.reading_growth
    for i in range(STATES):
        result[PSIS + i] = point.psis[i]


def fill_balance(y, rates, p, result):
    """ln(V/V_*) and friction on the slow manifold, at a spring stress and states."""
    result[0] = result[1] = math.nan
    log_rate, friction, _shift = balance_of(y[0], psis_of(y), numbers(p))
    result[0] = log_rate
    result[1] = friction


def unpacking(count: int, first: int = 0) -> Callable[..., Numbers]:
    """A function that makes a tuple of so many numbers of an array."""
    made: dict[str, Any] = {}
    listed = ", ".join(f"y[{i}]" for i in range(first, first + count))
    exec(f"def unpacked(y):\n    return ({listed},)", made)
    function: Callable[..., Numbers] = made["unpacked"]
    return function


def places(
    rate: Function,
    point: Function,
    balance: Function | None,
    unknowns: int,
    states: int,
    count: int,
) -> Mapping[str, Any]:
    """What the names of this module stand for, for functions of floats and so many numbers."""
    return {
        "UNKNOWNS": unknowns,
        "STATES": states,
        "unknowns": unpacking(unknowns),
        "numbers": unpacking(count),
        "psis_of": unpacking(states, first=1),
        "rate_of": rate,
        "point_of": point,
        "balance_of": balance,
    }
