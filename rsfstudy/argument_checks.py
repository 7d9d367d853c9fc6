"""Functions that check arguments against the annotations of a signature.

Public functions accept any object that behaves like the annotated type. If a public function fails
with a Python exception, the checks find the argument that caused the failure.
"""

from __future__ import annotations

import inspect
import itertools
import math
import os
import re
import sys
import types
import typing
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any, ForwardRef, Literal, TypeVar, Union

from rsfstudy.errors import InvalidValue, shorten_text

#: Maximum number of items of a list that is passed as an argument. A ``range`` or an array that
#: repeats a single value can be longer than any list that fits in memory.
MAX_ITEMS_OF_LIST_ARGUMENT = 2**20
#: Maximum number of items, and maximum number of nesting levels, that the checks examine in an
#: argument.
_MAX_CHECKED_ITEMS, _MAX_CHECKED_NESTING_LEVELS = 1000, 4
#: Mapping from the import aliases that annotations use to module names.
_MODULE_BY_IMPORT_ALIAS = {"xr": "xarray", "pd": "pandas", "np": "numpy"}
#: Pattern of the error messages of xarray about a missing array dimension.
_MISSING_DIMENSION_MESSAGE_PATTERN = re.compile(
    r"'(.+?)' (?:not found in array dimensions|is not a valid dimension)"
)
#: Descriptions of simple types for error messages.
_DESCRIPTION_BY_TYPE: Mapping[Any, str] = {
    str: "a string",
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    Path: "a path",
    type(None): "None",
    type: "a class",
    object: "an object",
}


def check_argument_lengths(arguments: Mapping[str, Any]) -> None:
    """Reject a ``range`` or a zero-stride array that has too many items.

    The other checks iterate over all items, so they would take too long for such an argument. The
    maximum length is ``MAX_ITEMS_OF_LIST_ARGUMENT``.

    Parameters
    ----------
    arguments : mapping of str to object
        Values by argument name.

    Raises
    ------
    InvalidValue
        If an argument is too long. The error names the argument.
    """
    for name, value in arguments.items():
        for part in _iterate_nested_values(value, _MAX_CHECKED_NESTING_LEVELS):
            if _is_too_long_lazy_sequence(part):
                rule = f"has more than {MAX_ITEMS_OF_LIST_ARGUMENT:,} items"
                raise InvalidValue(name, part, rule, remedy="Pass a shorter list.")


def find_string_instead_of_list_error(
    function: Callable[..., Any], arguments: Mapping[str, Any], raised_exception: Exception
) -> InvalidValue | None:
    """Return an error if a string was passed in place of a list of strings.

    If a function expects a list but receives a string, the function iterates over the characters of
    the string. The error of the function therefore refers to a single character. If several strings
    were passed in place of lists, only the first argument is reported.

    Parameters
    ----------
    function : callable
        Function that failed.
    arguments : mapping of str to object
        Arguments of the function, as in ``inspect.BoundArguments``.
    raised_exception : Exception
        Exception that the function raised.

    Returns
    -------
    InvalidValue or None
        Error that names the argument. The value is None if no string was passed in place of a list.
    """
    for name, value, annotation in _iterate_annotated_arguments(function, arguments):
        blamed = getattr(raised_exception, "value", None)
        if not isinstance(value, str) or (isinstance(blamed, str) and blamed == value):
            continue
        if _allows_list_of_strings(annotation) and not matches_annotation(value, annotation):
            rule, remedy = (
                f"must be {describe_type(annotation)}",
                f"Write [{shorten_text(value)!r}].",
            )
            return InvalidValue(name, value, rule, remedy=remedy)
    return None


def find_type_mismatch_error(
    function: Callable[..., Any], arguments: Mapping[str, Any], remedy: str
) -> InvalidValue | None:
    """Return an error for the first argument that has the wrong type.

    Parameters
    ----------
    function : callable
        Function that failed.
    arguments : mapping of str to object
        Arguments of the function, as in ``inspect.BoundArguments``.
    remedy : str
        Last sentence of the error message.

    Returns
    -------
    InvalidValue or None
        Error that names the argument. The value is None if all arguments match their annotations.
    """
    for name, value, annotation in _iterate_annotated_arguments(function, arguments):
        if not matches_annotation(value, annotation):
            rule = f"must be {describe_type(annotation)}"
            return InvalidValue(name, value, rule, remedy=remedy)
    return None


def find_unusable_value_error(
    arguments: Mapping[str, Any], raised_exception: Exception, remedy: str
) -> InvalidValue | None:
    """Return an error for the first argument that may have caused an exception.

    The function looks for non-finite or very large numbers, strings that UTF-8 cannot encode,
    invalid file names, indices out of range, unknown names, and callables that raise exceptions.

    Parameters
    ----------
    arguments : mapping of str to object
        Values by argument name.
    raised_exception : Exception
        Exception that the function raised.
    remedy : str
        Last sentence of the error message.

    Returns
    -------
    InvalidValue or None
        Error that names the argument. The value is None if no argument may have caused the
        exception.
    """
    for name, value in arguments.items():
        for part in _iterate_nested_values(value, _MAX_CHECKED_NESTING_LEVELS):
            if isinstance(part, float) and not math.isfinite(part):
                return InvalidValue(name, value, "must be finite", remedy=remedy)
            if isinstance(part, int) and abs(part) >= 2**63:
                return InvalidValue(name, value, "is too large", remedy=remedy)
            if isinstance(part, str) and not _is_encodable_as_utf8(part):
                return InvalidValue(name, value, "must be a string that can be encoded as UTF-8")
        if (dimension := _find_missing_dimension_in_error(value, raised_exception)) is not None:
            rule, dims = f"has no dimension {shorten_text(dimension)!r}", map(str, value.dims)
            return InvalidValue(name, value, rule, choices=dims, remedy=remedy)
        if isinstance(raised_exception, OSError) and _is_substring_of_path(
            value, raised_exception.filename
        ):
            rule = f"cannot be used as a file name: {raised_exception.strerror}"
            return InvalidValue(name, value, rule, remedy=remedy)
        is_outside = isinstance(raised_exception, IndexError) or "out of bounds" in str(
            raised_exception
        )
        if is_outside and isinstance(value, Integral):
            return InvalidValue(name, value, "is out of range", remedy=remedy)
        if isinstance(value, str) and value == _find_missing_name_in_error(raised_exception):
            return InvalidValue(name, value, "is unknown", remedy=remedy)
        if name != "self" and callable(value) and _was_raised_by(value, raised_exception):
            rule = (
                f"raised an error when it was called ({type(raised_exception).__name__}: "
                f"{shorten_text(raised_exception)})"
            )
            return InvalidValue(name, value, rule, remedy=remedy)
    return None


def _find_missing_dimension_in_error(value: Any, error: Exception) -> str | None:
    """Return the array dimension that xarray reports as missing."""
    found = (
        _MISSING_DIMENSION_MESSAGE_PATTERN.search(str(error))
        if hasattr(type(value), "to_dataset")
        else None
    )
    return found[1] if found and found[1] not in value.dims else None


def _is_substring_of_path(value: object, path: object) -> bool:
    """Return True if a string or path is a substring of another path."""
    is_path = isinstance(value, str | os.PathLike) and isinstance(path, str | os.PathLike)
    return is_path and str(value) in str(path)


def _find_missing_name_in_error(error: Exception) -> object:
    """Return the name that a KeyError or AttributeError reports as missing.

    The result is None if the exception contains no name.
    """
    if isinstance(error, KeyError) and error.args:
        return error.args[0]
    return getattr(error, "name", None)


def _was_raised_by(function: Callable[..., Any], error: Exception) -> bool:
    """Return True if a function raised an exception.

    The result is True for every ``TypeError``, because the call may not match the signature.
    """
    code, trace = getattr(function, "__code__", None), error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code is code:
            return True
        trace = trace.tb_next
    return isinstance(error, TypeError)


def convert_numpy_number_to_python(value: Any) -> Any:
    """Convert a NumPy number or Boolean to a Python object.

    Parameters
    ----------
    value : object
        Value of an argument.

    Returns
    -------
    object
        Python number or Boolean. Any other value is returned unchanged.
    """
    kind = type(value)
    is_scalar = kind.__module__ == "numpy" and hasattr(kind, "item") and kind.__name__ != "ndarray"
    return value.item() if is_scalar and value.dtype.kind in "biuf" else value


def matches_annotation(
    value: object, annotation: Any, max_nesting: int = _MAX_CHECKED_NESTING_LEVELS
) -> bool:
    """Return True if a value has the annotated type or behaves like this type.

    Lists, tuples and arrays are interchangeable, and so are Python and NumPy numbers. A Boolean is
    not accepted as a number.

    Parameters
    ----------
    value : object
        Value of an argument.
    annotation : object
        Evaluated annotation. ``Any`` and type variables match every value.
    max_nesting : int, optional
        Maximum depth of nested containers to check. Items at deeper levels are accepted. The
        default is 4.

    Returns
    -------
    bool
        True if the value matches the annotation.
    """
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation is Any or isinstance(annotation, TypeVar | ForwardRef | str) or not max_nesting:
        return True
    if origin in (Union, types.UnionType):
        return any(matches_annotation(value, each, max_nesting) for each in arguments)
    if origin is Literal:
        return any(type(value) is type(each) and value == each for each in arguments)
    if origin is not None:
        return _is_matching_container(value, origin, arguments, max_nesting - 1)
    if annotation in (bool, int, float):
        return _is_number_of_type(value, annotation)
    if annotation is Path:
        return isinstance(value, str | os.PathLike)
    if annotation is None:
        return value is None
    return isinstance(value, annotation) if isinstance(annotation, type) else True


def describe_type(annotation: Any) -> str:
    """Return a description of an annotated type for messages.

    Parameters
    ----------
    annotation : object
        Evaluated annotation.

    Returns
    -------
    str
        Noun phrase such as "a number" or "a list".
    """
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (Union, types.UnionType):
        words = list(dict.fromkeys(describe_type(each) for each in arguments))
        return " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))
    if origin is Literal:
        return f"one of {', '.join(map(repr, arguments))}"
    if origin is type:
        return "a class"
    kind = origin or annotation
    if kind in _DESCRIPTION_BY_TYPE:
        return _DESCRIPTION_BY_TYPE[kind]
    if kind is Callable or not isinstance(kind, type):
        return "a function"
    is_plain = kind.__module__ in ("builtins", "collections", "collections.abc")
    if is_plain and issubclass(kind, Mapping):
        return "a mapping"
    if kind is tuple and arguments and Ellipsis not in arguments:
        return f"a tuple of ({', '.join(map(describe_type, arguments))})"
    if is_plain and issubclass(kind, Iterable):
        items = [describe_type(each) for each in arguments[:1] if each is not Any]
        return "a list" + "".join(f" in which each item is {item}" for item in items)
    package = kind.__module__.partition(".")[0]
    name = f"{package}.{kind.__name__}"
    return f"an {name}" if name[0] in "aeioux" else f"a {name}"


def _is_number_of_type(value: object, number_type: type) -> bool:
    """Return True if a value is a number or Boolean of the annotated type."""
    name = type(value).__name__
    is_flag = name in ("bool", "bool_")  # Python and NumPy Booleans
    if number_type is bool or is_flag:
        return number_type is bool and is_flag
    if not isinstance(value, Real) or name == "timedelta64":  # a subclass of np.signedinteger
        return False
    return number_type is float or isinstance(value, Integral)


def _is_matching_container(
    value: object, container_type: Any, item_annotations: tuple[Any, ...], nesting_levels: int
) -> bool:
    """Return True if a value is a container with matching type and items."""
    if not isinstance(container_type, type) or issubclass(container_type, type):
        return isinstance(value, type)
    if container_type in (Callable, typing.get_origin(Callable[..., Any])):
        return callable(value)
    if issubclass(container_type, Mapping):
        # A dataset is a mapping, but is never meant as a mapping argument.
        if not isinstance(value, Mapping) or hasattr(type(value), "data_vars"):
            return False
        pairs = itertools.islice(value.items(), _MAX_CHECKED_ITEMS)
        return not item_annotations or all(
            matches_annotation(key, item_annotations[0], nesting_levels)
            and matches_annotation(item, item_annotations[1], nesting_levels)
            for key, item in pairs
        )
    if not issubclass(container_type, Iterable):
        return isinstance(value, container_type)
    if not _behaves_like_container(value, container_type):
        return False
    items = list(itertools.islice(typing.cast(Iterable[Any], value), _MAX_CHECKED_ITEMS))
    if container_type is tuple and item_annotations and Ellipsis not in item_annotations:
        return len(items) == len(item_annotations) and all(
            matches_annotation(item, each, nesting_levels)
            for item, each in zip(items, item_annotations, strict=True)
        )
    return all(
        matches_annotation(item, item_annotations[0], nesting_levels)
        for item in items
        if item_annotations
    )


def _behaves_like_container(value: object, container_type: type) -> bool:
    """Return True if a value behaves like a container type."""
    if isinstance(value, str | bytes):
        return False
    dimensions = getattr(value, "ndim", None)
    if isinstance(dimensions, int):  # the module numpy has a function ndim
        return dimensions > 0
    if issubclass(container_type, Sequence | tuple):
        return isinstance(value, Sequence)
    return isinstance(value, Collection if issubclass(container_type, Collection) else Iterable)


def _allows_list_of_strings(annotation: Any) -> bool:
    """Return True if an annotation allows a list of strings."""
    origin, items = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (Union, types.UnionType):
        return any(map(_allows_list_of_strings, items))
    return origin in (Sequence, Collection, Iterable, list, tuple) and matches_annotation(
        "", items[0]
    )


def _iterate_annotated_arguments(
    function: Callable[..., Any], arguments: Mapping[str, Any]
) -> Iterator[tuple[str, Any, Any]]:
    """Yield the name, value and annotation of each argument.

    Arguments without an annotation and arguments that equal their default value are omitted.
    """
    for name, parameter in inspect.signature(function).parameters.items():
        if name not in arguments or parameter.annotation is parameter.empty or name == "self":
            continue
        value, annotation = arguments[name], _evaluate_annotation(function, parameter.annotation)
        if parameter.kind is parameter.VAR_KEYWORD:
            yield from ((key, each, annotation) for key, each in value.items())
        elif parameter.kind is parameter.VAR_POSITIONAL:
            yield from ((name, each, annotation) for each in value)
        elif value is not parameter.default:
            yield name, value, annotation


class _AnnotationEvaluationNamespace(dict[str, Any]):
    """Namespace in which string annotations are evaluated.

    The namespace contains the global names of the module. Other names are looked up among the known
    import aliases and among the classes of all rsfstudy modules that are loaded.
    """

    def __missing__(self, name: str) -> Any:
        """Look up a name that is not a global name of the module."""
        module = sys.modules.get(_MODULE_BY_IMPORT_ALIAS.get(name, ""))
        if module is not None:
            return module
        for home, module in list(sys.modules.items()):
            found = vars(module).get(name) if home.startswith("rsfstudy.") else None
            if isinstance(found, type) and found.__name__ == name:
                return found
        raise KeyError(name)


def _evaluate_annotation(function: Callable[..., Any], annotation: Any) -> Any:
    """Evaluate an annotation, or return ``Any`` if a name is unknown."""
    annotation = getattr(annotation, "__forward_arg__", annotation)
    if not isinstance(annotation, str):
        return annotation
    known = getattr(inspect.unwrap(function), "__globals__", {})
    names = {name: kind for name, kind in known.items() if kind is not Any or name == "Any"}
    try:
        return eval(annotation, {}, _AnnotationEvaluationNamespace(names))
    except (NameError, AttributeError, TypeError):
        return Any


def _iterate_nested_values(value: object, nesting_levels: int) -> Iterator[Any]:
    """Yield a value and, recursively, the first items of each list or mapping."""
    yield value
    if not nesting_levels or isinstance(value, range):
        return
    if isinstance(value, Mapping):
        value = list(itertools.islice(value.values(), _MAX_CHECKED_ITEMS))
    if isinstance(value, list | tuple | set | frozenset):
        for item in itertools.islice(value, _MAX_CHECKED_ITEMS):
            yield from _iterate_nested_values(item, nesting_levels - 1)


def _is_too_long_lazy_sequence(value: Any) -> bool:
    """Return True if a lazy sequence exceeds ``MAX_ITEMS_OF_LIST_ARGUMENT`` items.

    A lazy sequence is a ``range``, or an array with a stride of zero. The memory of a lazy sequence
    does not grow with the number of items.
    """
    if isinstance(value, range):
        return bool(value) and (value[-1] - value[0]) // value.step >= MAX_ITEMS_OF_LIST_ARGUMENT
    is_array = type(value).__module__ == "numpy" and hasattr(value, "strides")
    return is_array and 0 in value.strides and value.size > MAX_ITEMS_OF_LIST_ARGUMENT


def _is_encodable_as_utf8(text: str) -> bool:
    """Return True if a string can be encoded as UTF-8 and contains no null characters."""
    try:
        return "\0" not in text.encode().decode()
    except UnicodeError:
        return False
