"""Checks of what a measure declares and gives: so that a lattice, and a file, can hold it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.motion.accuracy import DEFAULT_RTOL, LOOSEST_RTOL, TIGHTEST_RTOL, Accuracy
from rsfstudy.quantity import Quantity, is_name
from rsfstudy.slider.registry import FIELDS

if TYPE_CHECKING:
    from rsfstudy.measures import Measure

Value = float | np.ndarray
#: What an axis can hold.
Plain = int | float | str | bool


def check(measure: Measure, taken: frozenset[str]) -> None:
    """Raise InvalidValue where a measure declares what no lattice, or no file, can hold."""
    _check_names(measure, taken)
    for name, values in measure.inner_coordinates.items():
        _check_coordinate(name, values)
    _check_cost(measure)
    _check_description(measure)


def _check_names(measure: Measure, taken: frozenset[str]) -> None:
    """Raise InvalidValue for numbers, dimensions or quantities that are none, or named twice."""
    stated = [name for about in measure.outputs for name in about.names]
    variables = measure.variables
    names = [*(stated or variables), *measure.inner_coordinates]
    if not variables:
        raise InvalidValue("variables", {}, f"must name a number, in measure {measure.name}")
    if measure.headline not in variables:
        raise InvalidValue("headline", measure.headline, "is not measured", choices=variables)
    for name in names:
        if not is_name(name) or name in taken - {*measure.sought} or names.count(name) > 1:
            rule = f"names something else, or nothing, in measure {measure.name}"
            raise InvalidValue("variable", name, rule)
    for name, dims in variables.items():
        if not isinstance(dims, tuple | list) or len(set(dims)) < len(dims):
            raise InvalidValue("dimensions", dims, f"of {name!r} must be names, each once")
        for dim in dims:
            if dim not in measure.inner_coordinates:
                raise InvalidValue("dimension", dim, f"of {name!r} has no coordinate values")
    known = {*names, *measure.plain_fields}
    for about in measure.quantities:
        if not isinstance(about, Quantity) or about.name not in known:
            odd = about.name if isinstance(about, Quantity) else about
            raise InvalidValue("quantities", odd, "describes nothing measured", choices=known)
    for name in measure.sought:
        if name not in FIELDS:
            raise InvalidValue("sought", name, "is not a field of a scene", choices=FIELDS)


def _check_cost(measure: Measure) -> None:
    """Raise InvalidValue for work that is no number above 0."""
    work: object = measure.typical_work
    if not isinstance(work, int | float) or not 0 < work < np.inf:
        raise InvalidValue("typical_work", work, "must be a number greater than 0")
    for rtol in (TIGHTEST_RTOL, DEFAULT_RTOL, LOOSEST_RTOL):
        expected = measure.expected_work(Accuracy(rtol))
        if not 0 < expected < np.inf:
            raise InvalidValue("expected_work", expected, f"must exceed 0, at rtol {rtol:g}")


def _check_description(measure: Measure) -> None:
    """Raise InvalidValue where a file could not hold the description."""
    try:
        name: object = json.loads(json.dumps(measure.describe()))["name"]
    except (TypeError, ValueError) as error:
        remedy = "Use Python's own numbers and texts, and tuples of them."
        rule = f"is no plain data ({error})"
        raise InvalidValue("measure", measure.name, rule, remedy=remedy) from error
    if not isinstance(name, str):
        raise InvalidValue("name", name, "must be a text, in a measure")


def _check_coordinate(name: str, values: Any) -> None:
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


def number(
    declared: Mapping[str, tuple[str, ...]], inner: Mapping[str, np.ndarray], name: str, value: Any
) -> Value:
    """A measured number, or an array of them, as NumPy's or Python's own."""
    if name not in declared:
        raise InvalidValue("measured", name, "is not declared", choices=declared)
    if isinstance(value, np.ma.MaskedArray):
        raise InvalidValue(name, value, "is masked, and must be a real number")
    array = np.asarray(value)
    if array.dtype.kind not in "iufb":
        raise InvalidValue(name, value, "must be a real number")
    shape = tuple(len(inner[dim]) for dim in declared[name])
    if array.shape != shape:
        rule = f"has the shape {array.shape} and must have {shape}"
        raise InvalidValue("measured", name, rule)
    return array if shape else array.item()


def alike(name: str, value: Any, present: Plain, whole: bool) -> Any:
    """A value of the kind that a field holds at present; axes hold whole numbers as float."""
    if _kind(value) != _kind(present):
        raise InvalidValue(name, value, f"must be {_kind(present)}, as {present!r} is")
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidValue(name, value, "must be finite")
    if whole and value != int(value):
        raise InvalidValue(name, value, "must be a whole number")
    return int(value) if whole else value


def _kind(value: object) -> str:
    if isinstance(value, bool):
        return "a flag"
    if isinstance(value, str):
        return "a text"
    return "a number" if isinstance(value, int | float) else "something else"


def count(spent: Any) -> int:
    """Right-hand sides as a file can hold them."""
    if not isinstance(spent, int | np.integer) or not 0 <= spent < 2**63:
        raise InvalidValue("rhs_evaluations", spent, "must be a whole number from 0 to 2**63 - 1")
    return int(spent)
