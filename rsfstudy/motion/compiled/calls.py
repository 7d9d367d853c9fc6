"""Calls from the compiled motion to the compiled equations of a scene, by their addresses.

The motion is compiled once, for all equations; the equations once for each combination of parts.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_ADDRESS = types.int64
#: ``function(y, rates, p, result)``: all pointers to numbers, of which some are not read.
_DOUBLES = ir.DoubleType().as_pointer()
_FUNCTION = ir.FunctionType(ir.VoidType(), [_DOUBLES] * 4)


@intrinsic  # type: ignore[untyped-decorator]
def _called(_context: Any, function: Any, y: Any, rates: Any, p: Any, result: Any) -> Any:
    def code(_target: Any, builder: Any, _signature: Any, addresses: Any) -> Any:
        function, *arguments = addresses
        pointers = [builder.inttoptr(address, _DOUBLES) for address in arguments]
        builder.call(builder.inttoptr(function, _FUNCTION.as_pointer()), pointers)
        return _target.get_dummy_value()

    return types.void(*[_ADDRESS] * 5), code


def evaluate(function, y, rates, p, result):
    """Have a function of the equations fill `result`."""
    _called(function, y.ctypes.data, rates.ctypes.data, p.ctypes.data, result.ctypes.data)
