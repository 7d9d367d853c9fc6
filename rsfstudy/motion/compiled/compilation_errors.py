"""Error messages for equations that cannot be compiled.

The messages name the user-defined part of the scene and the source line that cause the error.
"""

from __future__ import annotations

import dis
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

from rsfstudy.errors import InvalidValue
from rsfstudy.parts import Part
from rsfstudy.slider import NumericFunction

_ERROR_SUBJECT_FOR_UNKNOWN_PART = "the equations"
_NUMBA_ERROR_LOCATION_PATTERN = re.compile(r'\n+File "(?P<file>.+?)", line (?P<line>\d+)')


def check_function_never_raises(
    function: NumericFunction, already_checked_functions: set[NumericFunction] | None = None
) -> None:
    """Raise InvalidValue if a function contains a raise statement.

    Functions that are called through their addresses cannot raise exceptions. The check includes
    all functions that the function calls.

    Parameters
    ----------
    function : callable
        Function to check.
    already_checked_functions : set of callable, optional
        Functions that were already checked. Newly checked functions are added to the set.

    Raises
    ------
    InvalidValue
        If one of the functions contains a raise statement.
    """
    already_checked_functions = (
        set() if already_checked_functions is None else already_checked_functions
    )
    if function in already_checked_functions:
        return
    already_checked_functions.add(function)
    for instruction in dis.get_instructions(function):
        if instruction.opname == "RAISE_VARARGS":
            code = function.__code__
            where = f"{function.__name__}, {code.co_filename}, line {code.co_firstlineno}"
            rule = (
                f"cannot compile {_describe_scene_parts_in_file(code.co_filename)} ({where}): it "
                "raises an error"
            )
            remedy = "Return math.nan instead, which ends the motion, or use engine='scipy'."
            raise InvalidValue("engine", "compiled", rule, remedy=remedy)
    named = (function.__globals__.get(name) for name in function.__code__.co_names)
    for reached in (*named, *(cell.cell_contents for cell in function.__closure__ or ())):
        if isinstance(reached, FunctionType):
            check_function_never_raises(reached, already_checked_functions)


def build_compilation_error(numba_error: Exception) -> InvalidValue:
    """Convert a Numba error to an error that names the part and the source line.

    Parameters
    ----------
    numba_error : Exception
        Numba error. Its message begins with the innermost function.

    Returns
    -------
    InvalidValue
        Error with a message for the user.
    """
    text, what, where = str(numba_error), _ERROR_SUBJECT_FOR_UNKNOWN_PART, ""
    places = list(_NUMBA_ERROR_LOCATION_PATTERN.finditer(text))
    of_parts = [
        place
        for place in places
        if _describe_scene_parts_in_file(place["file"]) != _ERROR_SUBJECT_FOR_UNKNOWN_PART
    ]
    for place in (of_parts or places)[:1]:
        what, where = (
            _describe_scene_parts_in_file(place["file"]),
            f" ({place['file']}, line {place['line']})",
        )
        text = text[: place.start()]
    cause = text.strip().rpartition("\n")[2]
    rule = f"cannot compile {what}{where}: {cause}"
    remedy = "Use only numbers, tuples and the module math, or use engine='scipy'."
    return InvalidValue("engine", "compiled", rule, remedy=remedy)


def _describe_scene_parts_in_file(source_file: str) -> str:
    """Describe the scene parts that are defined in a source file, for error messages."""
    names = [
        part.name
        for part in _iterate_named_scene_part_classes()
        if _find_source_file_of_scene_part(part) == _resolve_path(source_file)
    ]
    return f"the part {' or '.join(names)}" if names else _ERROR_SUBJECT_FOR_UNKNOWN_PART


def _iterate_named_scene_part_classes(base_class: type[Part] = Part) -> Iterator[type[Part]]:
    """Yield all scene part classes defined in this process, latest first."""
    for part in reversed(base_class.__subclasses__()):
        yield from _iterate_named_scene_part_classes(part)
        if "name" in vars(part):
            yield part


def _find_source_file_of_scene_part(part_class: type[Part]) -> Path | None:
    """Return the source file of a part class, or None if the class has no source file."""
    try:
        return _resolve_path(inspect.getfile(part_class))
    except (OSError, TypeError):  # Classes that are defined in a notebook have no source file.
        return None


def _resolve_path(file: str) -> Path:
    """Return the absolute path of a file."""
    return Path(file).resolve()
