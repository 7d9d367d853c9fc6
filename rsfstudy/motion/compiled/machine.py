"""The loop of motions, compiled once for all; and the equations of a combination of parts."""

from __future__ import annotations

import atexit
import gc
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core.errors import NumbaError

from rsfstudy.motion import layout
from rsfstudy.motion.compiled.compile_cache import compile_cfuncs, compile_function
from rsfstudy.motion.compiled.diagnostics import check_no_raise, compilation_error
from rsfstudy.motion.inplace import in_place_functions
from rsfstudy.motion.loop import advance
from rsfstudy.motion.regime_switching import SwitchThresholds
from rsfstudy.slider import (
    Equations,
    Function,
    Numbers,
    Scene,
    equations_between_ruptures,
    equations_in_rupture,
    equations_without_mass,
)

_ARRAY_TYPE, _TABLE_TYPE = types.float64[::1], types.float64[:, ::1]
_THRESHOLDS_TYPE = types.UniTuple(types.float64, len(SwitchThresholds._fields))
_PLAN_TYPE = types.Tuple(
    (_ARRAY_TYPE, types.int64[:, ::1], _THRESHOLDS_TYPE, _ARRAY_TYPE, _ARRAY_TYPE)
)


#: The many objects of a compiler take a third of a second to be looked through as a process ends.
atexit.register(gc.freeze)


class NumbaBackend:
    """The loop, compiled, and its arguments (see `driver.PythonBackend`)."""

    def initial_values(self, fields: tuple[tuple[str, float], ...]) -> bytes:
        return _pack_initial_values(fields)

    def create_state(self, initial: bytes, called_with: tuple[float, ...]) -> NumbaMotionState:
        return NumbaMotionState(initial, called_with)

    def function_table(self, systems: tuple[Equations, ...]) -> np.ndarray:
        return _build_function_table(*map(function_addresses, systems))

    def as_arguments(self, *arrays: np.ndarray) -> Sequence[np.ndarray]:
        return arrays

    def as_parameters(self, p: Sequence[float]) -> Any:
        return np.array(p)

    def loop_function(self) -> Any:
        return compiled_loop()


class NumbaMotionState:
    """The state of a motion as a record."""

    def __init__(self, initial: bytes, called_with: tuple[float, ...]) -> None:
        self._bytes = bytearray(initial)
        layout.CALL_FORMAT.pack_into(self._bytes, 0, *called_with)
        self.memory = np.frombuffer(self._bytes, layout.MOTION)

    def counters(self) -> tuple[int, ...]:
        """Right-hand sides by regime, steps, events, rows, and Jacobians."""
        return layout.COUNTER_FORMAT.unpack_from(self._bytes, layout.CALL_FORMAT.size)

    def get_field(self, name: str) -> float:
        """One of its fields."""
        return float(self.memory[name][0])


def compile_scene(scene: Scene, *, with_time: bool) -> None:
    """Compile what motions of such a scene need, with time or without it, or find it in the cache.
    What carries no time may also be a path that leaves mass out.

    Raises
    ------
    InvalidValue
        Where a part of the scene cannot be compiled.
    """
    compiled_loop()
    function_addresses(equations_between_ruptures(scene, clock=with_time))
    if scene.has_mass:
        function_addresses(equations_in_rupture(scene, clock=with_time))
    if scene.has_mass and not with_time:
        function_addresses(equations_without_mass(scene, clock=False))


@lru_cache(maxsize=256)
def _pack_initial_values(fields: tuple[tuple[str, float], ...]) -> bytes:
    """The state that motions begin with, as bytes: records are copied one field after the other."""
    memory = np.zeros(1, layout.MOTION)
    for name, value in fields:
        memory[name] = value
    return memory.tobytes()


@cache
def _build_function_table(slow: tuple[int, ...], fast: tuple[int, ...] = ()) -> np.ndarray:
    """The table of addresses; both regimes know of the balance between ruptures."""
    rows = np.zeros((2, layout.FUNCTIONS_PER_REGIME), dtype=np.int64)
    rows[layout.SLOW_REGIME, : len(slow)], rows[layout.FAST_REGIME, : len(fast)] = slow, fast
    rows[layout.FAST_REGIME, -1] = rows[layout.SLOW_REGIME, -1]
    return rows


@cache
def compiled_loop() -> Any:
    """The compiled loop of motions."""
    memory = types.Array(numba.from_dtype(layout.MOTION), 1, "C")
    tables = _ARRAY_TYPE, _TABLE_TYPE, _ARRAY_TYPE, _TABLE_TYPE, _TABLE_TYPE, types.int64
    signature = types.int64(memory, _ARRAY_TYPE, _ARRAY_TYPE, _ARRAY_TYPE, _PLAN_TYPE, *tables)
    return compile_function(advance, signature)


def compile_scalar_function(function: Function, *arguments: float | Numbers) -> Any:
    """A function of floats and of tuples of floats, compiled for arguments of this form.

    Raises
    ------
    InvalidValue
        Where a function of a part cannot be compiled, or raises.
    """
    return _compile_scalar_function(
        function, *[len(x) if isinstance(x, tuple) else 0 for x in arguments]
    )


@cache
def _compile_scalar_function(function: Function, *lengths: int) -> Any:
    check_no_raise(function)
    floats = (types.UniTuple(types.float64, n) if n else types.float64 for n in lengths)
    try:
        return compile_function(function, tuple(floats))
    except NumbaError as error:
        raise compilation_error(error) from error


@cache
def compile_array_function(function: Function, *dimensions: int) -> Any:
    """A function of arrays of so many dimensions, compiled."""
    kinds = (types.Array(types.float64, count, "C") for count in dimensions)
    return compile_function(function, tuple(kinds))


def function_addresses(equations: Equations) -> tuple[int, ...]:
    """Addresses of the compiled functions of a system of equations, in the order of
    `InPlaceFunctions`.

    Raises
    ------
    InvalidValue
        Where a function of a part cannot be compiled, or raises.
    """
    return _compile_addresses(tuple(filter(None, in_place_functions(equations))), equations)


_ADDRESS_CACHE: dict[tuple[Any, ...], tuple[int, ...]] = {}


def _compile_addresses(functions: tuple[Any, ...], equations: Equations) -> tuple[int, ...]:
    if functions not in _ADDRESS_CACHE:
        for function in (equations.rate_function, equations.point_function):
            check_no_raise(function)
        try:
            _ADDRESS_CACHE[functions] = compile_cfuncs(functions)
        except NumbaError as error:
            raise compilation_error(error) from error
    return _ADDRESS_CACHE[functions]
