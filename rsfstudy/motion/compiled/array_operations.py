"""Functions that compiled code uses in place of the Python functions of the event loop.

The compiled loop uses pointers instead of arrays, and calls the equations through their addresses.
The loop is therefore compiled only once for all systems of equations. Pointers are also faster than
arrays, because Numba passes each array as ten machine words and counts the references to the array.
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

from rsfstudy.motion import array_operations, recording, steppers
from rsfstudy.motion.recording import (
    HALF_SAMPLES,
    SAMPLE_INTERPOLATION_COEFFICIENTS,
    SAMPLE_NUMBER_COLUMN,
    SAMPLES_PER_INTEGRATION_STEP,
)
from rsfstudy.motion.steppers import order_eight

_NUMBA_FLOAT_POINTER_TYPE = types.CPointer(types.float64)
#: Numba type of the function ``function(y, rates, p, result)``, whose arguments are pointers to
#: floats.
_LLVM_DOUBLE_POINTER_TYPE = ir.DoubleType().as_pointer()
_LLVM_TYPE_OF_IN_PLACE_FUNCTION = ir.FunctionType(ir.VoidType(), [_LLVM_DOUBLE_POINTER_TYPE] * 4)


@intrinsic  # type: ignore[untyped-decorator]
def _call_function_at_address(
    _context: Any, function: Any, y: Any, rates: Any, parameters: Any, result: Any
) -> Any:
    """Generate code that calls a function at an address."""

    def code(target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        function, *pointers = arguments
        builder.call(
            builder.inttoptr(function, _LLVM_TYPE_OF_IN_PLACE_FUNCTION.as_pointer()), pointers
        )
        return target.get_dummy_value()

    return types.void(types.int64, *[_NUMBA_FLOAT_POINTER_TYPE] * 4), code


@intrinsic  # type: ignore[untyped-decorator]
def _get_array_data_pointer(_context: Any, array: Any) -> Any:
    """Generate code that returns a pointer to the first item of an array."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.create_struct_proxy(signature.args[0])(context, builder, arguments[0]).data

    return _NUMBA_FLOAT_POINTER_TYPE(array), code


@intrinsic  # type: ignore[untyped-decorator]
def _advance_pointer(_context: Any, pointer: Any, item_count: Any) -> Any:
    """Generate code that moves a pointer by a number of items."""

    def code(_target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        pointer, numbers = arguments
        return builder.gep(pointer, [numbers])

    return _NUMBA_FLOAT_POINTER_TYPE(_NUMBA_FLOAT_POINTER_TYPE, types.int64), code


def evaluate_function_into_array(function, y, rates, parameters, result):
    """Call a function that fills an output array.

    Parameters
    ----------
    function : int
        Address of the function.
    y, rates, parameters : pointer
        Arguments of the function.
    result : pointer
        Output array.
    """
    _call_function_at_address(function, y, rates, parameters, result)


def convert_array_to_pointer(array):
    """Return a pointer to the first item of an array.

    Parameters
    ----------
    array : ndarray
        Array to convert. The caller must keep a reference to the array.

    Returns
    -------
    pointer
        Pointer to the first item.
    """
    return _get_array_data_pointer(array)


def advance_pointer_by_items(pointer, item_count):
    """Move a pointer by a number of items.

    Parameters
    ----------
    pointer : pointer
        Pointer to an item of an array.
    item_count : int
        Number of items to skip.

    Returns
    -------
    pointer
        Pointer to a later item.
    """
    return _advance_pointer(pointer, item_count)


def copy_values(source, target, item_count):
    """Copy the first items of an array to another array.

    Parameters
    ----------
    source, target : pointer
        Array to copy from, and array to copy to.
    item_count : int
        Number of items.
    """
    for i in range(item_count):
        target[i] = source[i]


def interpolate_at_fractional_rows(columns, row_positions, result):
    """Interpolate columns at fractional row numbers.

    The result is the same as the result of ``recording.interpolate_at_fractional_rows``.

    Parameters
    ----------
    columns : array of shape (columns, rows)
        Columns of the recorded motion.
    row_positions : array of shape (points,)
        Fractional row numbers.
    result : array of shape (result columns, points)
        Output array. Row ``i`` contains the interpolated values of column ``i``. The output array
        may have fewer rows than there are columns.
    """
    last, weights = columns.shape[1] - 1, np.empty(SAMPLES_PER_INTEGRATION_STEP + 1)
    for i in range(len(row_positions)):
        if not 0.0 <= row_positions[i] <= last:  # The recording may contain NaN.
            result[:, i] = math.nan
            continue
        after = math.ceil(row_positions[i])
        within = int(columns[SAMPLE_NUMBER_COLUMN, after])
        begin = after - (within or min(after, 1))
        part = row_positions[i] - begin
        row, share = begin + int(part), part - int(part)
        if share == 0.0 or within == 0:
            for c in range(len(result)):
                result[c, i] = columns[c, row]
                if share > 0.0:
                    result[c, i] = (1.0 - share) * columns[c, row] + share * columns[c, row + 1]
            continue
        for k in range(SAMPLES_PER_INTEGRATION_STEP + 1):
            weights[k] = 0.0
            for power in range(SAMPLES_PER_INTEGRATION_STEP, -1, -1):
                weights[k] = (
                    weights[k] * (part / HALF_SAMPLES - 1.0)
                    + SAMPLE_INTERPOLATION_COEFFICIENTS[power][k]
                )
        for c in range(len(result)):
            result[c, i] = 0.0
            for k in range(SAMPLES_PER_INTEGRATION_STEP + 1):
                result[c, i] += weights[k] * columns[c, min(begin + k, last)]


#: Mapping of each Python function to the function that replaces it in compiled code.
COMPILED_REPLACEMENT_BY_PYTHON_FUNCTION: Mapping[Any, Any] = {
    array_operations.evaluate_function_into_array: evaluate_function_into_array,
    array_operations.convert_array_to_pointer: convert_array_to_pointer,
    array_operations.advance_pointer_by_items: advance_pointer_by_items,
    array_operations.copy_values: copy_values,
    recording.interpolate_at_fractional_rows: interpolate_at_fractional_rows,
    steppers.begin_integration_of_regime: order_eight.begin_integration_of_regime,
    steppers.attempt_step: order_eight.attempt_step,
    steppers.step_to_segment_end: order_eight.step_to_segment_end,
    steppers.interpolate_unknowns: order_eight.interpolate_unknowns,
    steppers.retake_step: order_eight.retake_step,
}
