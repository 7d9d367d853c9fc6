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
from rsfstudy.motion.columns import filling
from rsfstudy.motion.compiled.building import called_by_address, called_from_python
from rsfstudy.motion.compiled.refusal import check_raises_nothing, refused
from rsfstudy.motion.handover import Limits
from rsfstudy.motion.loop import advance
from rsfstudy.slider.equations import Equations, between_ruptures, in_rupture, without_mass
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.scene import Scene

_ARRAY, _TABLE = types.float64[::1], types.float64[:, ::1]
_LIMITS = types.UniTuple(types.float64, len(Limits._fields))
_PLAN = types.Tuple((_ARRAY, types.int64[:, ::1], _LIMITS, _ARRAY, _ARRAY))


#: The many objects of a compiler take a third of a second to be looked through as a process ends.
atexit.register(gc.freeze)


class Compiled:
    """The loop, compiled, and its arguments (see `running.Plain`)."""

    def initial(self, fields: tuple[tuple[str, float], ...]) -> bytes:
        return _initial(fields)

    def state(self, initial: bytes, called_with: tuple[float, ...]) -> CompiledState:
        return CompiledState(initial, called_with)

    def table(self, systems: tuple[Equations, ...]) -> np.ndarray:
        return _table(*map(addresses, systems))

    def passed(self, *arrays: np.ndarray) -> Sequence[np.ndarray]:
        return arrays

    def numbers(self, p: Sequence[float]) -> Any:
        return np.array(p)

    def advance(self) -> Any:
        return compiled_loop()


class CompiledState:
    """The state of a motion as a record."""

    def __init__(self, initial: bytes, called_with: tuple[float, ...]) -> None:
        self._bytes = bytearray(initial)
        layout.CALLED_WITH.pack_into(self._bytes, 0, *called_with)
        self.memory = np.frombuffer(self._bytes, layout.MOTION)

    def says(self) -> tuple[int, ...]:
        """Right-hand sides by regime, steps, events, rows, and Jacobians."""
        return layout.SAYS.unpack_from(self._bytes, layout.CALLED_WITH.size)

    def field(self, name: str) -> float:
        """One of its fields."""
        return float(self.memory[name][0])


def prepare(scene: Scene, *, clock: bool) -> None:
    """Compile what motions of such a scene need, with time or without it, or find it in the cache.
    What carries no time may also be a path that leaves mass out.

    Raises
    ------
    InvalidValue
        Where a part of the scene cannot be compiled.
    """
    compiled_loop()
    addresses(between_ruptures(scene, clock=clock))
    if scene.has_mass:
        addresses(in_rupture(scene, clock=clock))
    if scene.has_mass and not clock:
        addresses(without_mass(scene, clock=False))


@lru_cache(maxsize=256)
def _initial(fields: tuple[tuple[str, float], ...]) -> bytes:
    """The state that motions begin with, as bytes: records are copied one field after the other."""
    memory = np.zeros(1, layout.MOTION)
    for name, value in fields:
        memory[name] = value
    return memory.tobytes()


@cache
def _table(slow: tuple[int, ...], fast: tuple[int, ...] = ()) -> np.ndarray:
    """The table of addresses; both regimes know of the balance between ruptures."""
    rows = np.zeros((2, layout.FUNCTIONS), dtype=np.int64)
    rows[layout.SLOW, : len(slow)], rows[layout.FAST, : len(fast)] = slow, fast
    rows[layout.FAST, -1] = rows[layout.SLOW, -1]
    return rows


@cache
def compiled_loop() -> Any:
    """The compiled loop of motions."""
    memory = types.Array(numba.from_dtype(layout.MOTION), 1, "C")
    tables = _ARRAY, _TABLE, _ARRAY, _TABLE, _TABLE, types.int64
    signature = types.int64(memory, _ARRAY, _ARRAY, _ARRAY, _PLAN, *tables)
    return called_from_python(advance, signature)


def of_floats(function: Function, *arguments: float | Numbers) -> Any:
    """A function of floats and of tuples of floats, compiled for arguments of this form.

    Raises
    ------
    InvalidValue
        Where a function of a part cannot be compiled, or raises.
    """
    return _of_floats(function, *[len(x) if isinstance(x, tuple) else 0 for x in arguments])


@cache
def _of_floats(function: Function, *lengths: int) -> Any:
    check_raises_nothing(function)
    floats = (types.UniTuple(types.float64, n) if n else types.float64 for n in lengths)
    try:
        return called_from_python(function, tuple(floats))
    except NumbaError as error:
        raise refused(error) from error


@cache
def of_arrays(function: Function, *dimensions: int) -> Any:
    """A function of arrays of so many dimensions, compiled."""
    kinds = (types.Array(types.float64, count, "C") for count in dimensions)
    return called_from_python(function, tuple(kinds))


def addresses(equations: Equations) -> tuple[int, ...]:
    """Addresses of the compiled functions of a system of equations, in the order of `Filling`.

    Raises
    ------
    InvalidValue
        Where a function of a part cannot be compiled, or raises.
    """
    return _addresses(tuple(filter(None, filling(equations))), equations)


_ADDRESSES: dict[tuple[Any, ...], tuple[int, ...]] = {}


def _addresses(functions: tuple[Any, ...], equations: Equations) -> tuple[int, ...]:
    if functions not in _ADDRESSES:
        for function in (equations.rate, equations.point):
            check_raises_nothing(function)
        try:
            _ADDRESSES[functions] = called_by_address(functions)
        except NumbaError as error:
            raise refused(error) from error
    return _ADDRESSES[functions]
