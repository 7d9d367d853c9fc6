"""Backend that compiles the event loop with Numba and runs the compiled loop.

The loop is compiled once for all motions, and the equations are compiled once for each combination
of parts. ``compile_equations_of_scene`` compiles all functions of a scene in advance.
"""

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
    build_compilation_error,
    check_function_never_raises,
)
from rsfstudy.motion.compiled.compile_cache import (
    compile_cfuncs_and_get_addresses,
    compile_or_load_function,
)
from rsfstudy.motion.in_place_functions import build_in_place_functions
from rsfstudy.motion.motion_loop import advance_motion
from rsfstudy.motion.regime_switching import RegimeSwitchThresholds
from rsfstudy.slider import EquationsOfMotion, FloatTuple, NumericFunction, Scene

_ARRAY_TYPE, _TABLE_TYPE = types.float64[::1], types.float64[:, ::1]
_NUMBA_TYPE_OF_SWITCH_THRESHOLDS = types.UniTuple(
    types.float64, len(RegimeSwitchThresholds._fields)
)
_NUMBA_TYPE_OF_LOOP_CONSTANTS = types.Tuple(
    (_ARRAY_TYPE, types.int64[:, ::1], _NUMBA_TYPE_OF_SWITCH_THRESHOLDS, _ARRAY_TYPE, _ARRAY_TYPE)
)


#: Without the call of ``gc.freeze`` at exit, garbage collection of Numba objects delays the exit of
#: Python by a third of a second.
atexit.register(gc.freeze)


class NumbaBackend:
    """Backend that runs the compiled event loop.

    The methods are documented in ``python_backend.PythonBackend``.
    """

    def pack_initial_motion_state(self, field_values: tuple[tuple[str, float], ...]) -> bytes:
        """Return the initial values of all motion state fields as bytes.

        See ``python_backend.PythonBackend.pack_initial_motion_state``.

        Parameters
        ----------
        field_values : tuple of (str, float)
            Names and values of the fields with nonzero initial values.

        Returns
        -------
        bytes
            Bytes of a record with the data type ``MOTION_STATE_DTYPE``.
        """
        return _pack_initial_state_bytes(field_values)

    def create_motion_state(
        self, initial_state: bytes, values_set_by_caller: tuple[float, ...]
    ) -> NumbaMotionState:
        """Create the state of a motion.

        See ``python_backend.PythonBackend.create_motion_state``.

        Parameters
        ----------
        initial_state : bytes
            Initial values of the fields, from ``pack_initial_motion_state``.
        values_set_by_caller : tuple of float
            Values of the fields in ``array_layout.MOTION_STATE_FIELDS_SET_BY_CALLER``.

        Returns
        -------
        NumbaMotionState
            State of the motion.
        """
        return NumbaMotionState(initial_state, values_set_by_caller)

    def build_function_table(
        self, equations_by_regime: tuple[EquationsOfMotion, ...]
    ) -> np.ndarray:
        """Build the table of function addresses.

        See ``python_backend.PythonBackend.build_function_table``.

        Parameters
        ----------
        equations_by_regime : tuple of EquationsOfMotion
            Equations of the slow manifold. If the scene has inertia, the second item contains the
            inertial equations of motion in ruptures.

        Returns
        -------
        ndarray of int, shape (2, FUNCTION_TABLE_COLUMN_COUNT)
            Addresses of the functions, one row per regime.
        """
        return _build_function_address_table(
            *map(get_compiled_function_addresses, equations_by_regime)
        )

    def convert_arrays_for_motion_loop(self, *arrays: np.ndarray) -> Sequence[np.ndarray]:
        """Return the arrays unchanged.

        See ``python_backend.PythonBackend.convert_arrays_for_motion_loop``.

        Parameters
        ----------
        *arrays : ndarray
            Arrays that the loop reads or fills.

        Returns
        -------
        tuple of ndarray
            The arguments, unchanged.
        """
        return arrays

    def convert_parameters_for_motion_loop(self, parameters: Sequence[float]) -> Any:
        """Convert the parameters of a scene to an array.

        See ``python_backend.PythonBackend.convert_parameters_for_motion_loop``.

        Parameters
        ----------
        parameters : sequence of float
            Parameters of the scene.

        Returns
        -------
        ndarray
            Parameters as an array of floats.
        """
        return np.array(parameters)

    def get_motion_loop_function(self) -> Any:
        """Return the compiled event loop.

        See ``python_backend.PythonBackend``.
        """
        return compile_or_load_motion_loop()


class NumbaMotionState:
    """State of a motion, stored in a NumPy structured array.

    Parameters
    ----------
    initial : bytes
        Initial values of the fields.
    called_with : tuple of float
        Values of the fields in ``array_layout.MOTION_STATE_FIELDS_SET_BY_CALLER``.

    Attributes
    ----------
    motion_state_array : ndarray of MOTION_STATE_DTYPE, shape (1,)
        Argument ``motion_state_array`` of the event loop.
    """

    def __init__(self, initial: bytes, called_with: tuple[float, ...]) -> None:
        self._bytes = bytearray(initial)
        array_layout.CALL_FORMAT.pack_into(self._bytes, 0, *called_with)
        self.motion_state_array = np.frombuffer(self._bytes, array_layout.MOTION_STATE_DTYPE)

    def get_evaluation_and_table_row_counts(self) -> tuple[int, ...]:
        """Return the counters of evaluations, steps and table rows.

        Returns
        -------
        tuple of int
            Right-hand side evaluations in the slow and in the fast regime, steps, event rows,
            recorded rows and Jacobians.
        """
        return array_layout.COUNTER_FORMAT.unpack_from(self._bytes, array_layout.CALL_FORMAT.size)

    def set_remaining_loading_kink_count(self, count: int) -> None:
        """Set the number of remaining kinks.

        Parameters
        ----------
        count : int
            Number of remaining kinks.
        """
        self.motion_state_array["kinks_ahead"] = count

    def get_motion_state_field(self, field_name: str) -> float:
        """Return the value of a field of the motion state.

        Parameters
        ----------
        field_name : str
            Name of the field.

        Returns
        -------
        float
            Value of the field.
        """
        return float(self.motion_state_array[field_name][0])


def compile_equations_of_scene(scene: Scene, *, include_time_equation: bool) -> None:
    """Compile the equations of a scene, or load them from the cache.

    Parameters
    ----------
    scene : Scene
        Scene of the motions.
    include_time_equation : bool
        If True, the equations include time as an unknown. If False, the equations without inertia
        are also compiled, because closed orbits are integrated with these equations.

    Raises
    ------
    InvalidValue
        If a part of the scene cannot be compiled.
    """
    compile_or_load_motion_loop()
    get_compiled_function_addresses(
        scene.equations_between_ruptures(with_time=include_time_equation)
    )
    if scene.has_mass:
        get_compiled_function_addresses(scene.equations_in_rupture(with_time=include_time_equation))
    if scene.has_mass and not include_time_equation:
        get_compiled_function_addresses(scene.equations_without_mass(with_time=False))


@lru_cache(maxsize=256)
def _pack_initial_state_bytes(field_values: tuple[tuple[str, float], ...]) -> bytes:
    """Pack the initial values of the motion state into bytes.

    Copying bytes is faster than copying a NumPy record field by field.
    """
    memory = np.zeros(1, array_layout.MOTION_STATE_DTYPE)
    for name, value in field_values:
        memory[name] = value
    return memory.tobytes()


@cache
def _build_function_address_table(
    slow_regime_addresses: tuple[int, ...], fast_regime_addresses: tuple[int, ...] = ()
) -> np.ndarray:
    """Build the table of function addresses.

    Both rows of the table contain the address of the force balance function of the slow manifold.
    """
    rows = np.zeros((2, array_layout.FUNCTION_TABLE_COLUMN_COUNT), dtype=np.int64)
    (
        rows[array_layout.SLOW_REGIME, : len(slow_regime_addresses)],
        rows[array_layout.FAST_REGIME, : len(fast_regime_addresses)],
    ) = slow_regime_addresses, fast_regime_addresses
    rows[array_layout.FAST_REGIME, -1] = rows[array_layout.SLOW_REGIME, -1]
    return rows


@cache
def compile_or_load_motion_loop() -> Any:
    """Compile the event loop, or load it from the cache.

    Returns
    -------
    Dispatcher
        Compiled ``motion_loop.advance_motion``.
    """
    memory = types.Array(numba.from_dtype(array_layout.MOTION_STATE_DTYPE), 1, "C")
    tables = _ARRAY_TYPE, _TABLE_TYPE, _ARRAY_TYPE, _TABLE_TYPE, _TABLE_TYPE, types.int64
    signature = types.int64(
        memory, _ARRAY_TYPE, _ARRAY_TYPE, _ARRAY_TYPE, _NUMBA_TYPE_OF_LOOP_CONSTANTS, *tables
    )
    return compile_or_load_function(advance_motion, signature)


def compile_function_of_floats(function: NumericFunction, *arguments: float | FloatTuple) -> Any:
    """Compile a function whose arguments are floats or tuples of floats.

    Parameters
    ----------
    function : callable
        Function to compile.
    *arguments : float or tuple of float
        Example arguments, from which the argument types are determined.

    Returns
    -------
    Dispatcher
        Compiled function.

    Raises
    ------
    InvalidValue
        If the function cannot be compiled or contains a raise statement.
    """
    return _compile_function_of_floats_cached(
        function, *[len(x) if isinstance(x, tuple) else 0 for x in arguments]
    )


@cache
def _compile_function_of_floats_cached(function: NumericFunction, *argument_lengths: int) -> Any:
    """Compile a function whose arguments are floats or tuples of given lengths."""
    check_function_never_raises(function)
    floats = (types.UniTuple(types.float64, n) if n else types.float64 for n in argument_lengths)
    try:
        return compile_or_load_function(function, tuple(floats))
    except NumbaError as error:
        raise build_compilation_error(error) from error


@cache
def compile_function_of_arrays(function: NumericFunction, *argument_dimensions: int) -> Any:
    """Compile a function whose arguments are arrays.

    Parameters
    ----------
    function : callable
        Function to compile.
    *argument_dimensions : int
        Number of dimensions of each array.

    Returns
    -------
    Dispatcher
        Compiled function.
    """
    kinds = (types.Array(types.float64, count, "C") for count in argument_dimensions)
    return compile_or_load_function(function, tuple(kinds))


def get_compiled_function_addresses(equations: EquationsOfMotion) -> tuple[int, ...]:
    """Return the addresses of the compiled functions of a system of equations.

    Parameters
    ----------
    equations : EquationsOfMotion
        System of equations.

    Returns
    -------
    tuple of int
        Addresses in the order of ``in_place_functions.InPlaceFunctions``.

    Raises
    ------
    InvalidValue
        If a function of a part cannot be compiled or contains a raise statement.
    """
    return _compile_functions_or_reuse_addresses(
        tuple(filter(None, build_in_place_functions(equations))), equations
    )


_COMPILED_FUNCTION_ADDRESS_CACHE: dict[tuple[Any, ...], tuple[int, ...]] = {}


def _compile_functions_or_reuse_addresses(
    functions: tuple[Any, ...], equations: EquationsOfMotion
) -> tuple[int, ...]:
    """Compile functions that fill arrays, unless they are already compiled."""
    if functions not in _COMPILED_FUNCTION_ADDRESS_CACHE:
        for function in (equations.rate_function, equations.motion_point_function):
            check_function_never_raises(function)
        try:
            _COMPILED_FUNCTION_ADDRESS_CACHE[functions] = compile_cfuncs_and_get_addresses(
                functions
            )
        except NumbaError as error:
            raise build_compilation_error(error) from error
    return _COMPILED_FUNCTION_ADDRESS_CACHE[functions]
