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
    find_user_stepper,
    unknown_engine_error,
)

if TYPE_CHECKING:
    import numpy as np


def check_engine_is_usable(name: str) -> None:
    """Raise InvalidValue for an engine that is unknown, or not installed."""
    if name not in ENGINES and not find_user_stepper(name):
        raise unknown_engine_error(name)
    if name == COMPILED:
        import_compiled_engine()


def create_stepper(
    engine_name: str, equations_by_regime: Any, method_by_regime: Mapping[str, str]
) -> Any:
    """Stepper of a motion through regimes with these systems of equations; 0, which
    stands for it, where it is compiled.
    """
    if engine_name == COMPILED:
        return 0
    stepper = _stepper_classes_by_engine().get(engine_name) or next(
        iter(find_user_stepper(engine_name)), None
    )
    if stepper is None:
        raise unknown_engine_error(engine_name)
    return stepper(equations_by_regime, method_by_regime)


@cache
def _stepper_classes_by_engine() -> dict[str, Any]:
    """The steppers of plain Python, by the names of engines."""
    order_eight = importlib.import_module("rsfstudy.motion.steppers.order_eight")
    scipy = importlib.import_module("rsfstudy.motion.steppers.scipy")
    return {PYTHON: order_eight.OrderEightStepper, SCIPY: scipy.SciPyStepper}


@cache
def import_compiled_engine() -> Any:
    """The compiled engine.

    Raises
    ------
    InvalidValue
        Where Numba is not installed.
    """
    try:
        return importlib.import_module("rsfstudy.motion.compiled.numba_backend")
    except ImportError as error:
        rule = f"needs Numba, which cannot be imported ({error})"
        remedy = "Install it: pip install 'rsfstudy[fast]'."
        raise InvalidValue("engine", COMPILED, rule, remedy=remedy) from error


def call_array_function_by_engine(
    function: Callable[..., None], engine_name: str, *arrays: np.ndarray
) -> None:
    """Call a function of arrays as an engine does: compiled, or on memoryviews."""
    if engine_name == COMPILED:
        import_compiled_engine().compile_array_function(
            function, *(array.ndim for array in arrays)
        )(*arrays)
    else:
        function(*(memoryview(array) for array in arrays))  # type: ignore[arg-type]
