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

from rsfstudy.motion import array_calls, recording, steppers
from rsfstudy.motion.recording import (
    HALF_SAMPLES,
    INTERPOLATION_COEFFICIENTS,
    SAMPLE_COLUMN,
    SAMPLES_PER_STEP,
)
from rsfstudy.motion.steppers import order_eight

_FLOAT_POINTER = types.CPointer(types.float64)
#: ``function(y, rates, p, result)``: all pointers to numbers, of which some are not read.
_DOUBLE_POINTER = ir.DoubleType().as_pointer()
_FUNCTION_TYPE = ir.FunctionType(ir.VoidType(), [_DOUBLE_POINTER] * 4)


@intrinsic  # type: ignore[untyped-decorator]
def _call_address(_context: Any, function: Any, y: Any, rates: Any, p: Any, result: Any) -> Any:
    def code(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        function, *pointers = arguments
        builder.call(builder.inttoptr(function, _FUNCTION_TYPE.as_pointer()), pointers)
        return target.get_dummy_value()

    return types.void(types.int64, *[_FLOAT_POINTER] * 4), code


@intrinsic  # type: ignore[untyped-decorator]
def _data_pointer(_context: Any, array: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.create_struct_proxy(signature.args[0])(context, builder, arguments[0]).data

    return _FLOAT_POINTER(array), code


@intrinsic  # type: ignore[untyped-decorator]
def _offset_pointer(_context: Any, pointer: Any, numbers: Any) -> Any:
    def code(_target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        pointer, numbers = arguments
        return builder.gep(pointer, [numbers])

    return _FLOAT_POINTER(_FLOAT_POINTER, types.int64), code


def evaluate(function, y, rates, p, result):
    """Have a function of the equations fill `result`."""
    _call_address(function, y, rates, p, result)


def as_pointer(array):
    """A pointer to the first number of an array, which its caller keeps alive."""
    return _data_pointer(array)


def offset_by(pointer, count):
    """A pointer so many numbers further on."""
    return _offset_pointer(pointer, count)


def copy_values(source, target, count):
    """Copy so many numbers."""
    for i in range(count):
        target[i] = source[i]


def interpolate_rows(columns, row_positions, result):
    """Fill in values of columns between rows (see `recording.interpolate_rows`)."""
    last, weights = columns.shape[1] - 1, np.empty(SAMPLES_PER_STEP + 1)
    for i in range(len(row_positions)):
        if not 0.0 <= row_positions[i] <= last:  # of a record that is not finite
            result[:, i] = math.nan
            continue
        after = math.ceil(row_positions[i])
        within = int(columns[SAMPLE_COLUMN, after])
        begin = after - (within or min(after, 1))
        part = row_positions[i] - begin
        row, share = begin + int(part), part - int(part)
        if share == 0.0 or within == 0:
            for c in range(len(result)):
                result[c, i] = columns[c, row]
                if share > 0.0:
                    result[c, i] = (1.0 - share) * columns[c, row] + share * columns[c, row + 1]
            continue
        for k in range(SAMPLES_PER_STEP + 1):
            weights[k] = 0.0
            for power in range(SAMPLES_PER_STEP, -1, -1):
                weights[k] = (
                    weights[k] * (part / HALF_SAMPLES - 1.0) + INTERPOLATION_COEFFICIENTS[power][k]
                )
        for c in range(len(result)):
            result[c, i] = 0.0
            for k in range(SAMPLES_PER_STEP + 1):
                result[c, i] += weights[k] * columns[c, min(begin + k, last)]


#: What stands in place of which function.
REPLACEMENTS: Mapping[Any, Any] = {
    array_calls.evaluate: evaluate,
    array_calls.as_pointer: as_pointer,
    array_calls.offset_by: offset_by,
    array_calls.copy_values: copy_values,
    recording.interpolate_rows: interpolate_rows,
    steppers.begin: order_eight.begin,
    steppers.attempt: order_eight.attempt,
    steppers.step_to_segment_end: order_eight.step_to_segment_end,
    steppers.unknowns_at: order_eight.unknowns_at,
    steppers.retake: order_eight.retake,
}
