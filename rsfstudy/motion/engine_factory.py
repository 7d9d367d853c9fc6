"""Functions that create a stepper, or import the compiled engine, by the name of the engine."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from rsfstudy.errors import InvalidValue
from rsfstudy.motion import engines
from rsfstudy.motion.engines import (
    COMPILED,
    ENGINE_NAMES,
    PYTHON,
    SCIPY,
    build_unknown_engine_error,
    find_user_stepper,
)

if TYPE_CHECKING:
    import numpy as np


def check_engine_is_usable(engine_name: str) -> None:
    """Raise InvalidValue if an engine is unknown or not installed.

    Parameters
    ----------
    engine_name : str
        Name of the engine.

    Raises
    ------
    InvalidValue
        If the engine is unknown, or if it is the compiled engine and Numba is not installed.
    """
    if engine_name not in ENGINE_NAMES and not find_user_stepper(engine_name):
        raise build_unknown_engine_error(engine_name)
    if engine_name == COMPILED:
        import_compiled_engine()


def create_stepper(
    engine_name: str, equations_by_regime: Iterable[Any], method_by_regime: Mapping[str, str]
) -> Any:
    """Create the stepper of a motion.

    Parameters
    ----------
    engine_name : str
        Name of the engine.
    equations_by_regime : iterable of EquationsOfMotion
        Equations of each regime. The compiled engine ignores this argument.
    method_by_regime : mapping of str to str
        Name of the SciPy solver for each regime.

    Returns
    -------
    Stepper or int
        Stepper. For the compiled engine the result is 0, because the compiled loop does not need a
        stepper object.

    Raises
    ------
    InvalidValue
        If the engine is unknown.
    """
    if engine_name == COMPILED:
        return 0
    stepper = _import_stepper_classes_by_engine().get(engine_name) or next(
        iter(find_user_stepper(engine_name)), None
    )
    if stepper is None:
        raise build_unknown_engine_error(engine_name)
    return stepper(tuple(equations_by_regime), method_by_regime)


@cache
def _import_stepper_classes_by_engine() -> dict[str, Any]:
    """Return a mapping from the names of the SciPy and Python engines to stepper classes."""
    order_eight = importlib.import_module("rsfstudy.motion.steppers.order_eight")
    scipy = importlib.import_module("rsfstudy.motion.steppers.scipy")
    return {PYTHON: order_eight.OrderEightStepper, SCIPY: scipy.SciPyStepper}


@cache
def import_compiled_engine() -> Any:
    """Import the compiled engine.

    Returns
    -------
    module
        Module ``compiled.numba_backend``.

    Raises
    ------
    InvalidValue
        If Numba is not installed.
    """
    try:
        return importlib.import_module("rsfstudy.motion.compiled.numba_backend")
    except ImportError as error:
        rule = f"requires Numba, which cannot be imported ({error})"
        remedy = "Install Numba: pip install 'rsfstudy[fast]'."
        raise InvalidValue("engine", COMPILED, rule, remedy=remedy) from error


def call_array_function_with_engine(
    function: Callable[..., None], engine_name: str, *arrays: np.ndarray
) -> None:
    """Call an array function. The compiled engine compiles the function first.

    Parameters
    ----------
    function : callable
        Function that fills arrays.
    engine_name : str
        Name of the engine. The function is compiled if the engine is ``"compiled"``.
    *arrays : ndarray
        Arguments of the function. In plain Python, the function receives memory views.
    """
    if engine_name == COMPILED:
        import_compiled_engine().compile_function_of_arrays(
            function, *(array.ndim for array in arrays)
        )(*arrays)
    else:
        function(*(memoryview(array) for array in arrays))  # type: ignore[arg-type]


class Engine:
    """Namespace that contains the engine names and the functions that find and check engines."""

    SCIPY, PYTHON, COMPILED = engines.ENGINE_NAMES
    #: Names of the engines of the package, without user-defined steppers.
    NAMES = engines.ENGINE_NAMES
    #: Record of the compilations in this process.
    compilation_log = engines.compilation_log

    is_installed = staticmethod(engines.is_engine_installed)
    check_is_usable = staticmethod(check_engine_is_usable)
    import_compiled_engine = staticmethod(import_compiled_engine)
    find_user_stepper = staticmethod(find_user_stepper)
    register_user_steppers = staticmethod(engines.register_user_steppers)
