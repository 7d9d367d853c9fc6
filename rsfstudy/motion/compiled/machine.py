"""What is compiled: the course of motions, once for all; and the equations of a combination of
parts.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numba
from numba import types
from numba.core.errors import NumbaError

from rsfstudy.motion.compiled import equations, unrolled
from rsfstudy.motion.compiled.building import called_by_address, called_from_python
from rsfstudy.motion.compiled.course import advance
from rsfstudy.motion.compiled.refusal import check_raises_nothing, refused
from rsfstudy.motion.compiled.table import NOW
from rsfstudy.motion.handover import Limits
from rsfstudy.slider.parts import Function

_ARRAY, _TABLE = types.float64[::1], types.float64[:, ::1]
_ADDRESSES = types.int64[:, ::1]
_LIMITS = types.UniTuple(types.float64, len(Limits._fields))


@cache
def course() -> Any:
    """The compiled course of motions."""
    memory = types.Array(numba.from_dtype(NOW), 1, "C")
    arrays = _ARRAY, _ARRAY, _ADDRESSES, _ARRAY, _ARRAY, _TABLE, _TABLE, _TABLE
    return called_from_python(advance, types.int64(memory, *arrays, _LIMITS, _ARRAY))


@cache
def addresses(
    rate: Function,
    point: Function,
    balance: Function | None,
    unknowns: int,
    states: int,
    numbers: int,
) -> tuple[int, ...]:
    """Where the compiled functions of a system of equations are, in the order of `Room`.

    Parameters
    ----------
    rate, point, balance : callable
        The functions of floats of `slider.equations.Equations`.
    unknowns, states, numbers : int
        How many it has.

    Raises
    ------
    InvalidValue
        Where a function of a part cannot be compiled, or raises.
    """
    for function in (rate, point):
        check_raises_nothing(function)
    places = equations.places(rate, point, balance, unknowns, states, numbers)
    wanted = [equations.fill_rates, equations.fill_point, unrolled.attempt(unknowns)]
    wanted += [equations.fill_balance] if balance is not None else []
    try:
        return called_by_address(wanted, places)
    except NumbaError as error:
        raise refused(error) from error
