"""Error boundary of public functions: what they raise is an error of rsfstudy.

Whatever goes wrong within one, and is no error of ours yet, becomes one that says
what was asked, what went wrong and what to do.
"""

from __future__ import annotations

import bdb
import difflib
import functools
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, Self, TypeVar

from rsfstudy.errors import DataError, InvalidValue, RsfStudyError, brief

P = ParamSpec("P")
T = TypeVar("T")


def error_boundary(function: Callable[P, T]) -> Callable[P, T]:
    """The function, with errors of ours only.

    Of a call with a dataset, or on one, any other becomes a `DataError`, of all others an
    `InvalidValue`; where it arose is kept as the cause. A call that does not fit the signature is
    Python's own `TypeError`; what is a warning stays one, and who quits a debugger leaves.
    """
    signature = inspect.signature(function)

    @functools.wraps(function)
    def answered(*args: P.args, **options: P.kwargs) -> T:
        try:
            given = signature.bind(*args, **options).arguments
        except TypeError as error:
            taken = ", ".join(signature.parameters)
            raise TypeError(f"{function.__name__}() {error}; it takes {taken}") from None
        try:
            return function(*args, **options)
        except (RsfStudyError, Warning, bdb.BdbQuit):
            raise
        except Exception as error:
            raise _told(function.__name__, given, error) from error

    return answered


class CheckedKeywords:
    """Base of declarations that reports unknown keywords together with the valid ones.

    Raises
    ------
    TypeError
        If a keyword is no parameter of the class.
    """

    def __new__(cls, *args: Any, **keywords: Any) -> Self:
        """Create an instance once all keywords are known to be parameters."""
        kind: type = cls
        valid = _parameters(kind)
        for name in keywords if valid else ():
            if name not in valid:
                close = difflib.get_close_matches(name, valid, n=1)
                hint = f" Did you mean {close[0]!r}?" if close else ""
                names = ", ".join(valid)
                raise TypeError(
                    f"{cls.__name__}() has no parameter {name!r}.{hint} It takes {names}."
                )
        return super().__new__(cls)


@functools.cache
def _parameters(cls: type) -> tuple[str, ...]:
    """Return the names of the parameters of a class; none if it takes any keyword."""
    parameters = inspect.signature(cls.__init__).parameters  # type: ignore[misc]
    takes_any = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    return () if takes_any else tuple(parameters)[1:]


def user_stacklevel() -> int:
    """The ``stacklevel`` by which a warning of whoever asks names the line of the user's."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").startswith("rsfstudy."):
        level, frame = level + 1, frame.f_back
    return level


def _told(name: str, given: dict[str, Any], error: Exception) -> RsfStudyError:
    """The error for a call that went wrong."""
    why = in_words(error)
    if any(hasattr(value, "data_vars") or name == "self" for name, value in given.items()):
        return DataError(
            f"{name} cannot be had of this dataset ({why}): it is not as rsfstudy made it. "
            "Ask the dataset as it was opened, or run the study again."
        )
    shown = {key: value for key, value in given.items() if value is not None}
    remedy = f"help(rsfstudy.{name}) says what it takes."
    return InvalidValue(name, shown, f"cannot be answered ({why})", remedy=remedy)


def in_words(error: BaseException) -> str:
    """Kind of an error and what it says, if it can say anything."""
    try:
        return f"{type(error).__name__}: {brief(error)}"
    except Exception:  # its text may raise as well
        return type(error).__name__


def check_file(name: str, path: str | Path) -> None:
    """Refuse what is there and no file: reading a pipe or a device may never end."""
    try:
        is_other = Path(path).exists() and not Path(path).is_file()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidValue(name, str(path), f"cannot be the path of a file: {reason}") from error
    if is_other:
        remedy = "Name a file."
        raise InvalidValue(name, str(path), "is a directory, a pipe or a device", remedy=remedy)
