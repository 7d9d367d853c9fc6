"""Compiled forms of functions of the loop: pointers to numbers, calls of equations
by their addresses, and the steps of order eight.

The loop is compiled once, for all equations; the equations once for each combination of parts.
Arrays would be passed from function to function as ten words each, and counted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from rsfstudy.motion import calls, recording, steppers
from rsfstudy.motion.recording import COEFFICIENTS, HALF, PLACE, SAMPLES
from rsfstudy.motion.steppers import order_eight

_POINTER = types.CPointer(types.float64)
#: ``function(y, rates, p, result)``: all pointers to numbers, of which some are not read.
_DOUBLES = ir.DoubleType().as_pointer()
_FUNCTION = ir.FunctionType(ir.VoidType(), [_DOUBLES] * 4)


@intrinsic  # type: ignore[untyped-decorator]
def _called(_context: Any, function: Any, y: Any, rates: Any, p: Any, result: Any) -> Any:
    def code(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        function, *pointers = arguments
        builder.call(builder.inttoptr(function, _FUNCTION.as_pointer()), pointers)
        return target.get_dummy_value()

    return types.void(types.int64, *[_POINTER] * 4), code


@intrinsic  # type: ignore[untyped-decorator]
def _first(_context: Any, array: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.create_struct_proxy(signature.args[0])(context, builder, arguments[0]).data

    return _POINTER(array), code


@intrinsic  # type: ignore[untyped-decorator]
def _moved(_context: Any, pointer: Any, numbers: Any) -> Any:
    def code(_target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        pointer, numbers = arguments
        return builder.gep(pointer, [numbers])

    return _POINTER(_POINTER, types.int64), code


def evaluate(function, y, rates, p, result):
    """Have a function of the equations fill `result`."""
    _called(function, y, rates, p, result)


def first_of(array):
    """A pointer to the first number of an array, which its caller keeps alive."""
    return _first(array)


def moved(pointer, numbers):
    """A pointer so many numbers further on."""
    return _moved(pointer, numbers)


def copy(source, target, count):
    """Copy so many numbers."""
    for i in range(count):
        target[i] = source[i]


def at_rows(columns, at, found):
    """Fill in values of columns between rows (see `recording.at_rows`)."""
    last, weights = columns.shape[1] - 1, np.empty(SAMPLES + 1)
    for i in range(len(at)):
        if not 0.0 <= at[i] <= last:  # of a record that is not finite
            found[:, i] = math.nan
            continue
        after = math.ceil(at[i])
        within = int(columns[PLACE, after])
        begin = after - (within or min(after, 1))
        part = at[i] - begin
        row, share = begin + int(part), part - int(part)
        if share == 0.0 or within == 0:
            for c in range(len(found)):
                found[c, i] = columns[c, row]
                if share > 0.0:
                    found[c, i] = (1.0 - share) * columns[c, row] + share * columns[c, row + 1]
            continue
        for k in range(SAMPLES + 1):
            weights[k] = 0.0
            for power in range(SAMPLES, -1, -1):
                weights[k] = weights[k] * (part / HALF - 1.0) + COEFFICIENTS[power][k]
        for c in range(len(found)):
            found[c, i] = 0.0
            for k in range(SAMPLES + 1):
                found[c, i] += weights[k] * columns[c, min(begin + k, last)]


#: What stands in place of which function.
IN_PLACE: Mapping[Any, Any] = {
    calls.evaluate: evaluate,
    calls.first_of: first_of,
    calls.moved: moved,
    calls.copy: copy,
    recording.at_rows: at_rows,
    steppers.begin: order_eight.begin,
    steppers.attempt: order_eight.attempt,
    steppers.reach: order_eight.reach,
    steppers.unknowns_at: order_eight.unknowns_at,
    steppers.retake: order_eight.retake,
}
