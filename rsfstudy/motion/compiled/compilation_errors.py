"""Says which part of a slider cannot be compiled, and where."""

from __future__ import annotations

import dis
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

from rsfstudy.errors import InvalidValue
from rsfstudy.parts import Part
from rsfstudy.slider import Function

_EQUATIONS_TEXT = "the equations"
_NUMBA_ERROR_LOCATION_PATTERN = re.compile(r'\n+File "(?P<file>.+?)", line (?P<line>\d+)')


def check_function_never_raises(
    function: Function, checked_functions: set[Function] | None = None
) -> None:
    """Raise InvalidValue where a function, or one that it reaches, raises: what is called by its
    address cannot.
    """
    checked_functions = set() if checked_functions is None else checked_functions
    if function in checked_functions:
        return
    checked_functions.add(function)
    for instruction in dis.get_instructions(function):
        if instruction.opname == "RAISE_VARARGS":
            code = function.__code__
            where = f"{function.__name__}, {code.co_filename}, line {code.co_firstlineno}"
            rule = (
                f"cannot compile {_describe_parts_defined_in(code.co_filename)} ({where}): it "
                "raises an error"
            )
            remedy = "Return math.nan instead, which ends the motion; or use the engine scipy."
            raise InvalidValue("engine", "compiled", rule, remedy=remedy)
    named = (function.__globals__.get(name) for name in function.__code__.co_names)
    for reached in (*named, *(cell.cell_contents for cell in function.__closure__ or ())):
        if isinstance(reached, FunctionType):
            check_function_never_raises(reached, checked_functions)


def compilation_error(error: Exception) -> InvalidValue:
    """Error of Numba, with the part and the line: its text begins with the innermost function."""
    text, what, where = str(error), _EQUATIONS_TEXT, ""
    places = list(_NUMBA_ERROR_LOCATION_PATTERN.finditer(text))
    of_parts = [
        place for place in places if _describe_parts_defined_in(place["file"]) != _EQUATIONS_TEXT
    ]
    for place in (of_parts or places)[:1]:
        what, where = (
            _describe_parts_defined_in(place["file"]),
            f" ({place['file']}, line {place['line']})",
        )
        text = text[: place.start()]
    cause = text.strip().rpartition("\n")[2]
    rule = f"cannot compile {what}{where}: {cause}"
    remedy = "Compute with numbers, tuples and math only, or use the engine scipy."
    return InvalidValue("engine", "compiled", rule, remedy=remedy)


def _describe_parts_defined_in(source_file: str) -> str:
    """The parts that a file defines, in words, or the equations."""
    names = [
        part.name
        for part in _iterate_part_classes()
        if _source_file_of_part(part) == _resolve_path(source_file)
    ]
    return f"the part {' or '.join(names)}" if names else _EQUATIONS_TEXT


def _iterate_part_classes(base_class: type[Part] = Part) -> Iterator[type[Part]]:
    """All parts there are in this process, the latest definition first."""
    for part in reversed(base_class.__subclasses__()):
        yield from _iterate_part_classes(part)
        if "name" in vars(part):
            yield part


def _source_file_of_part(part_class: type[Part]) -> Path | None:
    try:
        return _resolve_path(inspect.getfile(part_class))
    except (OSError, TypeError):  # defined in a notebook
        return None


def _resolve_path(file: str) -> Path:
    return Path(file).resolve()
