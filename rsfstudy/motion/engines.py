"""What integrates motions: SciPy, or what Numba has compiled of the same equations."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from typing import Any

from rsfstudy.errors import InvalidValue

SCIPY, COMPILED = "scipy", "compiled"
ENGINES = (SCIPY, COMPILED)


@dataclass
class Compiling:
    """What has been compiled in this process; found in the cache, it does not count.

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
    """What has to be installed for an engine, in words; empty where nothing has."""
    try:
        check_engine(name)
    except InvalidValue:
        if name != COMPILED:
            raise
        return "needs Numba (pip install 'rsfstudy[fast]')"
    return ""


def check_engine(name: str) -> None:
    """Raise InvalidValue for an engine that is unknown, or not installed."""
    if name not in ENGINES:
        raise InvalidValue("engine", name, "is unknown", choices=ENGINES)
    if name == COMPILED:
        compiled_engine()


def is_installed(name: str) -> bool:
    """Whether an engine can be used here, as far as one can tell without loading it."""
    return name == SCIPY or importlib.util.find_spec("numba") is not None


@cache
def compiled_engine() -> Any:
    """The compiled engine.

    Raises
    ------
    InvalidValue
        Where Numba is not installed.
    """
    try:
        return importlib.import_module("rsfstudy.motion.compiled.engine")
    except ImportError as error:
        rule = f"needs Numba, which cannot be imported ({error})"
        remedy = "Install it: pip install 'rsfstudy[fast]'."
        raise InvalidValue("engine", COMPILED, rule, remedy=remedy) from error


def versions(name: str) -> dict[str, str]:
    """Versions of what decides the numbers of an engine, beside those of SciPy."""
    if name == SCIPY:
        return {}
    # loading it would make each command wait
    from importlib.metadata import PackageNotFoundError, version

    try:
        return {"numba": version("numba"), "llvmlite": version("llvmlite")}
    except PackageNotFoundError:
        return {"numba": "not installed"}
