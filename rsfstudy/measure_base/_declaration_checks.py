"""Checks of the values of a measure, so that a lattice and a file can store them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.motion import DEFAULT_RTOL, MAX_RTOL, MIN_RTOL, Accuracy

OutputValue = float | np.ndarray
#: What an axis can hold.
PlainValue = int | float | str | bool


def check_cost(work: object, expected_work: Callable[[Accuracy], float]) -> None:
    """Raise ``InvalidValue`` if the typical or the expected work is not a positive number."""
    if not isinstance(work, int | float) or not 0 < work < np.inf:
        raise InvalidValue("typical_work", work, "must be a number greater than 0")
    for rtol in (MIN_RTOL, DEFAULT_RTOL, MAX_RTOL):
        expected = expected_work(Accuracy(rtol))
        if not 0 < expected < np.inf:
            raise InvalidValue("expected_work", expected, f"must exceed 0, at rtol {rtol:g}")


def check_description(measure: str, describe: Callable[[], Mapping[str, Any]]) -> None:
    """Raise ``InvalidValue`` if a file could not store the description of a measure."""
    try:
        name: object = json.loads(json.dumps(describe()))["name"]
    except (TypeError, ValueError) as error:
        remedy = "Use Python's own numbers and texts, and tuples of them."
        rule = f"is no plain data ({error})"
        raise InvalidValue("measure", measure, rule, remedy=remedy) from error
    if not isinstance(name, str):
        raise InvalidValue("name", name, "must be a text, in a measure")


def check_coordinate(name: str, values: Any) -> None:
    """Raise InvalidValue for coordinate values that do not tell points apart, or that no file can
    hold.
    """
    array = np.asarray(values)
    if isinstance(values, np.ma.MaskedArray) or array.ndim != 1 or not array.size:
        raise InvalidValue(name, values, "must be a list of coordinate values")
    texts = array.dtype.kind in "OU" and all(isinstance(text, str) for text in array)
    # no file holds the half and the long floats of NumPy
    numbers = array.dtype.kind in "iufb" and array.dtype.char not in "eg"
    if texts:
        texts = "\0" not in "".join(array).encode().decode()
    if not texts and not (numbers and np.isfinite(array).all()):
        raise InvalidValue(name, values, "must be finite numbers, or texts, on an inner dimension")
    if len(set(array.tolist())) < array.size:
        raise InvalidValue(name, values, "has a value that stands twice on its inner dimension")


def check_output(
    declared: Mapping[str, tuple[str, ...]],
    coordinates: Mapping[str, np.ndarray],
    name: str,
    value: Any,
) -> OutputValue:
    """A measured number, or an array of them, as NumPy's or Python's own."""
    if name not in declared:
        raise InvalidValue("measured", name, "is not declared", choices=declared)
    if isinstance(value, np.ma.MaskedArray):
        raise InvalidValue(name, value, "is masked, and must be a real number")
    array = np.asarray(value)
    if array.dtype.kind not in "iufb":
        raise InvalidValue(name, value, "must be a real number")
    shape = tuple(len(coordinates[dim]) for dim in declared[name])
    if array.shape != shape:
        rule = f"has the shape {array.shape} and must have {shape}"
        raise InvalidValue("measured", name, rule)
    return array if shape else array.item()


def check_field_value(name: str, value: Any, current: PlainValue, is_integer: bool) -> Any:
    """A value of the kind that a field holds at present; axes hold whole numbers as float."""
    if _describe_kind(value) != _describe_kind(current):
        raise InvalidValue(name, value, f"must be {_describe_kind(current)}, as {current!r} is")
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidValue(name, value, "must be finite")
    if is_integer and value != int(value):
        raise InvalidValue(name, value, "must be a whole number")
    return int(value) if is_integer else value


def _describe_kind(value: object) -> str:
    if isinstance(value, bool):
        return "a flag"
    if isinstance(value, str):
        return "a text"
    return "a number" if isinstance(value, int | float) else "something else"


def check_evaluations(spent: Any) -> int:
    """Right-hand sides as a file can hold them."""
    if not isinstance(spent, int | np.integer) or not 0 <= spent < 2**63:
        raise InvalidValue("rhs_evaluations", spent, "must be a whole number from 0 to 2**63 - 1")
    return int(spent)
