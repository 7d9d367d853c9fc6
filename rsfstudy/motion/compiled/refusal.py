"""Says which part of a slider cannot be compiled, and where."""

from __future__ import annotations

import dis
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parts import Function, Part

_EQUATIONS = "the equations"
_PLACE = re.compile(r'\n+File "(?P<file>.+?)", line (?P<line>\d+)')


def check_raises_nothing(function: Function, seen: set[Function] | None = None) -> None:
    """Raise InvalidValue where a function, or one that it reaches, raises: what is called by its
    address cannot.
    """
    seen = set() if seen is None else seen
    if function in seen:
        return
    seen.add(function)
    for instruction in dis.get_instructions(function):
        if instruction.opname == "RAISE_VARARGS":
            code = function.__code__
            where = f"{function.__name__}, {code.co_filename}, line {code.co_firstlineno}"
            rule = (
                f"cannot compile {_what_stands_in(code.co_filename)} ({where}): it raises an error"
            )
            remedy = "Return math.nan instead, which ends the motion; or use the engine scipy."
            raise InvalidValue("engine", "compiled", rule, remedy=remedy)
    named = (function.__globals__.get(name) for name in function.__code__.co_names)
    for reached in (*named, *(cell.cell_contents for cell in function.__closure__ or ())):
        if isinstance(reached, FunctionType):
            check_raises_nothing(reached, seen)


def refused(error: Exception) -> InvalidValue:
    """Error of Numba, with the part and the line: its text begins with the innermost function."""
    text, what, where = str(error), _EQUATIONS, ""
    places = list(_PLACE.finditer(text))
    of_parts = [place for place in places if _what_stands_in(place["file"]) != _EQUATIONS]
    for place in (of_parts or places)[:1]:
        what, where = _what_stands_in(place["file"]), f" ({place['file']}, line {place['line']})"
        text = text[: place.start()]
    cause = text.strip().rpartition("\n")[2]
    rule = f"cannot compile {what}{where}: {cause}"
    remedy = "Compute with numbers, tuples and math only, or use the engine scipy."
    return InvalidValue("engine", "compiled", rule, remedy=remedy)


def _what_stands_in(file: str) -> str:
    """The parts that a file defines, in words, or the equations."""
    names = [part.name for part in _parts() if _file_of(part) == _path(file)]
    return f"the part {' or '.join(names)}" if names else _EQUATIONS


def _parts(of: type[Part] = Part) -> Iterator[type[Part]]:
    """All parts there are in this process, the latest definition first."""
    for part in reversed(of.__subclasses__()):
        yield from _parts(part)
        if "name" in vars(part):
            yield part


def _file_of(part: type[Part]) -> Path | None:
    try:
        return _path(inspect.getfile(part))
    except (OSError, TypeError):  # defined in a notebook
        return None


def _path(file: str) -> Path:
    return Path(file).resolve()
