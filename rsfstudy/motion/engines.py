"""Engines that integrate motions: SciPy, steps of our own in plain Python, or those compiled by
Numba.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import is_name
from rsfstudy.slider.parts import Numbers

if TYPE_CHECKING:
    import numpy as np

SCIPY, PYTHON, COMPILED = "scipy", "python", "compiled"
ENGINES = (SCIPY, PYTHON, COMPILED)
#: Steppers of a user's own, by name, as far as they are known in this process.
_OWN: dict[str, type] = {}


def named(engine: Any) -> str:
    """The name of an engine that is given by its name, or by the class of a stepper of a user's
    own, for which its name stands from then on.

    Raises
    ------
    InvalidValue
        For a class that is no stepper, or has no name of its own.
    """
    if not isinstance(engine, type):
        if not isinstance(engine, str) or not (engine in ENGINES or is_name(engine)):
            raise _unknown(engine)
        return engine
    base = importlib.import_module("rsfstudy.motion.steppers").Stepper
    name: Any = getattr(engine, "name", None)
    if not issubclass(engine, base):
        remedy = f"Derive a class from {base.__module__}.{base.__name__}."
        raise InvalidValue("engine", engine, "is no stepper", remedy=remedy)
    if not isinstance(name, str) or not is_name(name):
        rule = f"must be named by a Python identifier, not {name!r}"
        raise InvalidValue("engine", engine, rule, remedy='Write name = "..." in its class.')
    known = _OWN.get(name, engine)
    if name in ENGINES or _origin(known) != _origin(engine):
        rule = f"takes the name {name!r}, which stands for another engine"
        raise InvalidValue("engine", engine, rule, remedy="Give it another name.")
    _OWN[name] = engine
    return name


def own_stepper(name: str) -> tuple[type, ...]:
    """The stepper of a user's own that a name stands for; none where it stands for none."""
    return (_OWN[name],) if name in _OWN else ()


def know(steppers: Iterable[type]) -> None:
    """Have the names of steppers that were checked stand for them, whatever they stood for."""
    for stepper in steppers:
        _OWN[stepper.name] = stepper  # type: ignore[attr-defined]


def _origin(stepper: type) -> tuple[str, str]:
    """Module and name of a stepper, which an earlier definition of it shares."""
    return stepper.__module__, stepper.__qualname__


def _unknown(engine: Any) -> InvalidValue:
    return InvalidValue("engine", engine, "is unknown", choices=(*ENGINES, *_OWN))


@dataclass
class Compiling:
    """Record of what has been compiled in this process; found in the cache, it does not count.

    Attributes
    ----------
    programs : int
    seconds : float
        Time it took.
    aside : callable
        Gives the context in which to compile: whoever limits or measures time leaves it out.
    """

    programs: int = 0
    seconds: float = 0.0
    aside: Callable[[], AbstractContextManager[None]] = contextlib.nullcontext


compiling = Compiling()


def lacking(name: str) -> str:
    """Packages that an engine lacks, in words; empty where none."""
    try:
        check_engine(name)
    except InvalidValue:
        if name != COMPILED:
            raise
        return "needs Numba (pip install 'rsfstudy[fast]')"
    return ""


def check_engine(name: str) -> None:
    """Raise InvalidValue for an engine that is unknown, or not installed."""
    if name not in ENGINES and name not in _OWN:
        raise _unknown(name)
    if name == COMPILED:
        compiled_engine()


def is_installed(name: str) -> bool:
    """True if an engine can be used here, as far as one can tell without loading it."""
    return name != COMPILED or importlib.util.find_spec("numba") is not None


def stepper_of(name: str, systems: Any, methods: Mapping[str, str]) -> Any:
    """Stepper of a motion through regimes with these systems of equations; 0, which
    stands for it, where it is compiled.
    """
    if name == COMPILED:
        return 0
    kinds = {**_OWN, **_steppers()}
    if name not in kinds:
        raise _unknown(name)
    return kinds[name](systems, methods)


@cache
def _steppers() -> dict[str, Any]:
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


def of_floats(function: Callable[..., Any], name: str, *arguments: float | Numbers) -> Any:
    """A function of floats and of tuples of floats as an engine calls it: compiled, for arguments
    of this form, where its loop is.
    """
    return compiled_engine().of_floats(function, *arguments) if name == COMPILED else function


def on_arrays(function: Callable[..., None], name: str, *arrays: np.ndarray) -> None:
    """Call a function of arrays as an engine does: compiled, or on memoryviews."""
    if name == COMPILED:
        compiled_engine().of_arrays(function, *(array.ndim for array in arrays))(*arrays)
    else:
        function(*(memoryview(array) for array in arrays))  # type: ignore[arg-type]


def versions(name: str) -> dict[str, str]:
    """Versions of what decides the numbers of an engine, beside those of SciPy."""
    if name != COMPILED:
        return {}
    # loading it would make each command wait
    from importlib.metadata import PackageNotFoundError, version

    try:
        return {"numba": version("numba"), "llvmlite": version("llvmlite")}
    except PackageNotFoundError:
        return {"numba": "not installed"}
