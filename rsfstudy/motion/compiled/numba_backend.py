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

from rsfstudy.motion import array_layout
from rsfstudy.motion.compiled.compilation_errors import (
    check_function_never_raises,
    compilation_error,
)
from rsfstudy.motion.compiled.compile_cache import compile_cfunc_addresses, compile_function
from rsfstudy.motion.in_place_functions import build_in_place_functions
from rsfstudy.motion.motion_loop import advance_motion
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
_SWITCH_THRESHOLDS_TYPE = types.UniTuple(types.float64, len(SwitchThresholds._fields))
_LOOP_CONSTANTS_TYPE = types.Tuple(
    (_ARRAY_TYPE, types.int64[:, ::1], _SWITCH_THRESHOLDS_TYPE, _ARRAY_TYPE, _ARRAY_TYPE)
)


#: The many objects of a compiler take a third of a second to be looked through as a process ends.
atexit.register(gc.freeze)


class NumbaBackend:
    """The loop, compiled, and its arguments (see `driver.PythonBackend`)."""

    def initial_state_values(self, field_values: tuple[tuple[str, float], ...]) -> bytes:
        return _pack_initial_state_bytes(field_values)

    def create_motion_state(
        self, initial_state: bytes, call_arguments: tuple[float, ...]
    ) -> NumbaMotionState:
        return NumbaMotionState(initial_state, call_arguments)

    def build_function_table(self, equations_by_regime: tuple[Equations, ...]) -> np.ndarray:
        return _build_function_table(*map(compiled_function_addresses, equations_by_regime))

    def as_loop_arguments(self, *arrays: np.ndarray) -> Sequence[np.ndarray]:
        return arrays

    def as_loop_parameters(self, parameters: Sequence[float]) -> Any:
        return np.array(parameters)

    def get_loop_function(self) -> Any:
        return get_compiled_loop()


class NumbaMotionState:
    """The state of a motion as a record."""

    def __init__(self, initial: bytes, called_with: tuple[float, ...]) -> None:
        self._bytes = bytearray(initial)
        array_layout.CALL_FORMAT.pack_into(self._bytes, 0, *called_with)
        self.memory = np.frombuffer(self._bytes, array_layout.MOTION_STATE_DTYPE)

    def work_and_row_counters(self) -> tuple[int, ...]:
        """Right-hand sides by regime, steps, events, rows, and Jacobians."""
        return array_layout.COUNTER_FORMAT.unpack_from(self._bytes, array_layout.CALL_FORMAT.size)

    def get_state_field(self, field_name: str) -> float:
        """One of its fields."""
        return float(self.memory[field_name][0])


def compile_equations_of_scene(scene: Scene, *, with_time: bool) -> None:
    """Compile what motions of such a scene need, with time or without it, or find it in the cache.
    What carries no time may also be a path that leaves mass out.

    Raises
    ------
    InvalidValue
        Where a part of the scene cannot be compiled.
    """
    get_compiled_loop()
    compiled_function_addresses(equations_between_ruptures(scene, with_time=with_time))
    if scene.has_mass:
        compiled_function_addresses(equations_in_rupture(scene, with_time=with_time))
    if scene.has_mass and not with_time:
        compiled_function_addresses(equations_without_mass(scene, with_time=False))


@lru_cache(maxsize=256)
def _pack_initial_state_bytes(field_values: tuple[tuple[str, float], ...]) -> bytes:
    """The state that motions begin with, as bytes: records are copied one field after the other."""
    memory = np.zeros(1, array_layout.MOTION_STATE_DTYPE)
    for name, value in field_values:
        memory[name] = value
    return memory.tobytes()


@cache
def _build_function_table(
    slow_regime_addresses: tuple[int, ...], fast_regime_addresses: tuple[int, ...] = ()
) -> np.ndarray:
    """The table of addresses; both regimes know of the balance between ruptures."""
    rows = np.zeros((2, array_layout.FUNCTIONS_PER_REGIME), dtype=np.int64)
    (
        rows[array_layout.SLOW_REGIME, : len(slow_regime_addresses)],
        rows[array_layout.FAST_REGIME, : len(fast_regime_addresses)],
    ) = slow_regime_addresses, fast_regime_addresses
    rows[array_layout.FAST_REGIME, -1] = rows[array_layout.SLOW_REGIME, -1]
    return rows


@cache
def get_compiled_loop() -> Any:
    """The compiled loop of motions."""
    memory = types.Array(numba.from_dtype(array_layout.MOTION_STATE_DTYPE), 1, "C")
    tables = _ARRAY_TYPE, _TABLE_TYPE, _ARRAY_TYPE, _TABLE_TYPE, _TABLE_TYPE, types.int64
    signature = types.int64(
        memory, _ARRAY_TYPE, _ARRAY_TYPE, _ARRAY_TYPE, _LOOP_CONSTANTS_TYPE, *tables
    )
    return compile_function(advance_motion, signature)


def compile_scalar_function(function: Function, *arguments: float | Numbers) -> Any:
    """A function of floats and of tuples of floats, compiled for arguments of this form.

    Raises
    ------
    InvalidValue
        Where a function of a part cannot be compiled, or raises.
    """
    return _compile_scalar_function_cached(
        function, *[len(x) if isinstance(x, tuple) else 0 for x in arguments]
    )


@cache
def _compile_scalar_function_cached(function: Function, *argument_lengths: int) -> Any:
    check_function_never_raises(function)
    floats = (types.UniTuple(types.float64, n) if n else types.float64 for n in argument_lengths)
    try:
        return compile_function(function, tuple(floats))
    except NumbaError as error:
        raise compilation_error(error) from error


@cache
def compile_array_function(function: Function, *argument_dimensions: int) -> Any:
    """A function of arrays of so many dimensions, compiled."""
    kinds = (types.Array(types.float64, count, "C") for count in argument_dimensions)
    return compile_function(function, tuple(kinds))


def compiled_function_addresses(equations: Equations) -> tuple[int, ...]:
    """Addresses of the compiled functions of a system of equations, in the order of
    `InPlaceFunctions`.

    Raises
    ------
    InvalidValue
        Where a function of a part cannot be compiled, or raises.
    """
    return _compile_or_reuse_addresses(
        tuple(filter(None, build_in_place_functions(equations))), equations
    )


_COMPILED_ADDRESS_CACHE: dict[tuple[Any, ...], tuple[int, ...]] = {}


def _compile_or_reuse_addresses(
    functions: tuple[Any, ...], equations: Equations
) -> tuple[int, ...]:
    if functions not in _COMPILED_ADDRESS_CACHE:
        for function in (equations.rate_function, equations.point_function):
            check_function_never_raises(function)
        try:
            _COMPILED_ADDRESS_CACHE[functions] = compile_cfunc_addresses(functions)
        except NumbaError as error:
            raise compilation_error(error) from error
    return _COMPILED_ADDRESS_CACHE[functions]
