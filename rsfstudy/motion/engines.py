"""Names of the engines that integrate motions: SciPy, Python and compiled.

A user-defined stepper (ODE integrator) can be selected as an engine. The module ``engine_factory``
creates steppers and loads the compiled engine.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import is_valid_variable_name

SCIPY, PYTHON, COMPILED = "scipy", "python", "compiled"
ENGINE_NAMES = (SCIPY, PYTHON, COMPILED)
#: User-defined steppers that are registered in this process.
_USER_STEPPER_CLASS_BY_NAME: dict[str, type] = {}


def resolve_engine_name(engine: Any) -> str:
    """Return the name of an engine, and register user-defined steppers.

    Parameters
    ----------
    engine : str or type
        Name of an engine, or a subclass of ``Stepper``. A subclass is registered under its
        attribute ``name``.

    Returns
    -------
    str
        Name of the engine.

    Raises
    ------
    InvalidValue
        If the engine name is unknown. The exception is also raised if a class is not a stepper, has
        no valid name, or has the name of another engine.
    """
    if not isinstance(engine, type):
        if not isinstance(engine, str) or not (
            engine in ENGINE_NAMES or is_valid_variable_name(engine)
        ):
            raise build_unknown_engine_error(engine)
        return engine
    base = importlib.import_module("rsfstudy.motion.steppers").Stepper
    name: Any = getattr(engine, "name", None)
    if not issubclass(engine, base):
        remedy = f"Derive a class from {base.__module__}.{base.__name__}."
        raise InvalidValue("engine", engine, "is not a subclass of Stepper", remedy=remedy)
    if not isinstance(name, str) or not is_valid_variable_name(name):
        rule = f"must have a Python identifier as its name (got {name!r})"
        raise InvalidValue("engine", engine, rule, remedy='Write name = "..." in its class.')
    known = _USER_STEPPER_CLASS_BY_NAME.get(name, engine)
    if name in ENGINE_NAMES or _get_module_and_name_of_stepper(
        known
    ) != _get_module_and_name_of_stepper(engine):
        rule = f"has the name {name!r}, which another engine already has"
        raise InvalidValue("engine", engine, rule, remedy="Choose another name.")
    _USER_STEPPER_CLASS_BY_NAME[name] = engine
    return name


def find_user_stepper(stepper_name: str) -> tuple[type, ...]:
    """Find a user-defined stepper by its name.

    Parameters
    ----------
    stepper_name : str
        Name of the stepper.

    Returns
    -------
    tuple of type
        Tuple with the stepper class, or an empty tuple if no stepper has this name.
    """
    return (
        (_USER_STEPPER_CLASS_BY_NAME[stepper_name],)
        if stepper_name in _USER_STEPPER_CLASS_BY_NAME
        else ()
    )


def register_user_steppers(steppers: Iterable[type]) -> None:
    """Register user-defined steppers without checks.

    Worker processes call this function. A stepper replaces a previously registered stepper with the
    same name.

    Parameters
    ----------
    steppers : iterable of type
        Stepper classes.
    """
    for stepper in steppers:
        _USER_STEPPER_CLASS_BY_NAME[stepper.name] = stepper  # type: ignore[attr-defined]


def _get_module_and_name_of_stepper(stepper: type) -> tuple[str, str]:
    """Return the module and the name of a stepper class.

    The module and the name do not change if a class is defined again, for example in a notebook.
    """
    return stepper.__module__, stepper.__qualname__


def build_unknown_engine_error(engine: Any) -> InvalidValue:
    """Return the error for a name or class that is not an engine.

    Parameters
    ----------
    engine : object
        Value that is not an engine.

    Returns
    -------
    InvalidValue
        Error with the allowed choices.
    """
    return InvalidValue(
        "engine", engine, "is unknown", choices=(*ENGINE_NAMES, *_USER_STEPPER_CLASS_BY_NAME)
    )


@dataclass
class CompilationLog:
    """Log that counts the compilations in this process and adds up the compilation times.

    Compiled programs that were loaded from the cache are not counted.

    Parameters
    ----------
    compiled_program_count : int, default: 0
        Number of compiled programs.
    total_compilation_seconds : float, default: 0.0
        Total compilation time in seconds.
    compilation_context_factory : callable, optional
        Function that returns a context manager for the compilation. A time limit or a timer can use
        the context manager to exclude the compilation time. By default, the context manager does
        nothing.
    """

    compiled_program_count: int = 0
    total_compilation_seconds: float = 0.0
    compilation_context_factory: Callable[[], AbstractContextManager[None]] = contextlib.nullcontext


compilation_log = CompilationLog()


def is_engine_installed(engine: str) -> bool:
    """Return True if the packages of an engine are installed.

    The function checks the installation without importing the packages.

    Parameters
    ----------
    engine : str
        Name of the engine.

    Returns
    -------
    bool
        True if the engine does not need Numba, or if Numba is installed.
    """
    return engine != COMPILED or importlib.util.find_spec("numba") is not None
