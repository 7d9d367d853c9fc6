"""Names of the engines that integrate motions: SciPy, Python steppers, and compiled steppers.

The classes and functions that the names stand for are created in `engine_factory`.
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
from rsfstudy.quantities import is_variable_name

SCIPY, PYTHON, COMPILED = "scipy", "python", "compiled"
ENGINES = (SCIPY, PYTHON, COMPILED)
#: Steppers of a user's own, by name, as far as they are known in this process.
_USER_STEPPERS: dict[str, type] = {}


def engine_name(engine: Any) -> str:
    """The name of an engine that is given by its name, or by the class of a stepper of a user's
    own, for which its name stands from then on.

    Raises
    ------
    InvalidValue
        For a class that is no stepper, or has no name of its own.
    """
    if not isinstance(engine, type):
        if not isinstance(engine, str) or not (engine in ENGINES or is_variable_name(engine)):
            raise unknown_engine_error(engine)
        return engine
    base = importlib.import_module("rsfstudy.motion.steppers").Stepper
    name: Any = getattr(engine, "name", None)
    if not issubclass(engine, base):
        remedy = f"Derive a class from {base.__module__}.{base.__name__}."
        raise InvalidValue("engine", engine, "is no stepper", remedy=remedy)
    if not isinstance(name, str) or not is_variable_name(name):
        rule = f"must be named by a Python identifier, not {name!r}"
        raise InvalidValue("engine", engine, rule, remedy='Write name = "..." in its class.')
    known = _USER_STEPPERS.get(name, engine)
    if name in ENGINES or _qualified_name_of_stepper(known) != _qualified_name_of_stepper(engine):
        rule = f"takes the name {name!r}, which stands for another engine"
        raise InvalidValue("engine", engine, rule, remedy="Give it another name.")
    _USER_STEPPERS[name] = engine
    return name


def find_user_stepper(stepper_name: str) -> tuple[type, ...]:
    """The stepper of a user's own that a name stands for; none where it stands for none."""
    return (_USER_STEPPERS[stepper_name],) if stepper_name in _USER_STEPPERS else ()


def register_user_steppers(steppers: Iterable[type]) -> None:
    """Have the names of steppers that were checked stand for them, whatever they stood for."""
    for stepper in steppers:
        _USER_STEPPERS[stepper.name] = stepper  # type: ignore[attr-defined]


def _qualified_name_of_stepper(stepper: type) -> tuple[str, str]:
    """Module and name of a stepper, which an earlier definition of it shares."""
    return stepper.__module__, stepper.__qualname__


def unknown_engine_error(engine: Any) -> InvalidValue:
    """Return the error for a name or class that is not an engine."""
    return InvalidValue("engine", engine, "is unknown", choices=(*ENGINES, *_USER_STEPPERS))


@dataclass
class CompilationLog:
    """Record of what has been compiled in this process; found in the cache, it does not count.

    Attributes
    ----------
    compiled_program_count : int
    total_compilation_seconds : float
        Time it took.
    context_while_compiling : callable
        Gives the context in which to compile: whoever limits or measures time leaves it out.
    """

    compiled_program_count: int = 0
    total_compilation_seconds: float = 0.0
    context_while_compiling: Callable[[], AbstractContextManager[None]] = contextlib.nullcontext


compilation_log = CompilationLog()


def is_engine_installed(engine: str) -> bool:
    """True if an engine can be used here, as far as one can tell without loading it."""
    return engine != COMPILED or importlib.util.find_spec("numba") is not None
