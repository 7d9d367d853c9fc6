"""Creation of engines from their names: steppers of Python engines, and the compiled engine."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from rsfstudy.errors import InvalidValue
from rsfstudy.motion.engines import (
    COMPILED,
    ENGINES,
    PYTHON,
    SCIPY,
    unknown_engine_error,
    user_stepper,
)

if TYPE_CHECKING:
    import numpy as np


def check_engine(name: str) -> None:
    """Raise InvalidValue for an engine that is unknown, or not installed."""
    if name not in ENGINES and not user_stepper(name):
        raise unknown_engine_error(name)
    if name == COMPILED:
        compiled_engine()


def create_stepper(name: str, systems: Any, methods: Mapping[str, str]) -> Any:
    """Stepper of a motion through regimes with these systems of equations; 0, which
    stands for it, where it is compiled.
    """
    if name == COMPILED:
        return 0
    stepper = _python_steppers().get(name) or next(iter(user_stepper(name)), None)
    if stepper is None:
        raise unknown_engine_error(name)
    return stepper(systems, methods)


@cache
def _python_steppers() -> dict[str, Any]:
    """The steppers of plain Python, by the names of engines."""
    order_eight = importlib.import_module("rsfstudy.motion.steppers.order_eight")
    scipy = importlib.import_module("rsfstudy.motion.steppers.scipy")
    return {PYTHON: order_eight.OrderEight, SCIPY: scipy.SciPyStepper}


@cache
def compiled_engine() -> Any:
    """The compiled engine.

    Raises
    ------
    InvalidValue
        Where Numba is not installed.
    """
    try:
        return importlib.import_module("rsfstudy.motion.compiled.machine")
    except ImportError as error:
        rule = f"needs Numba, which cannot be imported ({error})"
        remedy = "Install it: pip install 'rsfstudy[fast]'."
        raise InvalidValue("engine", COMPILED, rule, remedy=remedy) from error


def call_with_arrays(function: Callable[..., None], name: str, *arrays: np.ndarray) -> None:
    """Call a function of arrays as an engine does: compiled, or on memoryviews."""
    if name == COMPILED:
        compiled_engine().compile_array_function(function, *(array.ndim for array in arrays))(
            *arrays
        )
    else:
        function(*(memoryview(array) for array in arrays))  # type: ignore[arg-type]
