"""Functions that check the results and options that a measure declares.

The checks ensure that a lattice and a NetCDF file can store all values.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.motion import Accuracy

#: Type of a result: a number, or an array along inner dimensions.
OutputValue = float | np.ndarray
#: Type of the values of an axis.
PlainValue = int | float | str | bool


def check_declared_cost_estimates(
    typical_rhs_evaluations: object, expected_work: Callable[[Accuracy], float]
) -> None:
    """Check that the typical and the expected work are positive numbers.

    Parameters
    ----------
    typical_rhs_evaluations : object
        Typical number of right-hand-side evaluations.
    expected_work : callable
        Function that returns the expected number of evaluations at an accuracy.

    Raises
    ------
    InvalidValue
        If a number is not positive and finite.
    """
    if (
        not isinstance(typical_rhs_evaluations, int | float)
        or not 0 < typical_rhs_evaluations < np.inf
    ):
        raise InvalidValue(
            "typical_rhs_evaluations", typical_rhs_evaluations, "must be a number greater than 0"
        )
    for tolerance in (Accuracy.MIN_RTOL, Accuracy.DEFAULT_RTOL, Accuracy.MAX_RTOL):
        expected = expected_work(Accuracy(tolerance))
        if not 0 < expected < np.inf:
            rule = "must be finite and greater than 0"
            raise InvalidValue(f"expected_work at rtol={tolerance:g}", expected, rule)


def check_measure_description(
    measure_name: str, describe_measure: Callable[[], Mapping[str, Any]]
) -> None:
    """Check that a file can store the description of a measure.

    Parameters
    ----------
    measure_name : str
        Name of the measure.
    describe_measure : callable
        Function that returns the description as a dictionary.

    Raises
    ------
    InvalidValue
        If the description is not plain data, or if its name is not a string.
    """
    try:
        name: object = json.loads(json.dumps(describe_measure()))["name"]
    except (TypeError, ValueError) as error:
        remedy = "Use Python numbers, strings, and tuples of numbers or strings."
        raise InvalidValue(
            f"measure {measure_name!r}",
            ...,
            f"must contain only plain data, because it is stored as JSON ({error})",
            remedy=remedy,
        ) from error
    if not isinstance(name, str):
        raise InvalidValue("name", name, "must be a string").with_location("measure")


def check_coordinate_values(dimension_name: str, coordinate_values: Any) -> None:
    """Check the coordinate values of an inner dimension.

    Parameters
    ----------
    dimension_name : str
        Name of the dimension.
    coordinate_values : array_like
        Coordinate values.

    Raises
    ------
    InvalidValue
        If the values are not one-dimensional, not finite or not unique, or if a file could not
        store them.
    """
    array = np.asarray(coordinate_values)
    if isinstance(coordinate_values, np.ma.MaskedArray) or array.ndim != 1 or not array.size:
        raise InvalidValue(dimension_name, coordinate_values, "must be a list of coordinate values")
    texts = array.dtype.kind in "OU" and all(isinstance(text, str) for text in array)
    # NetCDF has no half-precision and no extended-precision floats.
    numbers = array.dtype.kind in "iufb" and array.dtype.char not in "eg"
    if texts:
        texts = "\0" not in "".join(array).encode().decode()
    if not texts and not (numbers and np.isfinite(array).all()):
        raise InvalidValue(
            dimension_name,
            coordinate_values,
            "must contain finite numbers or strings, because it is an inner dimension",
        )
    if len(set(array.tolist())) < array.size:
        raise InvalidValue(
            dimension_name,
            coordinate_values,
            "must contain different values, because it is an inner dimension",
        )


def check_output_value(
    dimensions_by_output: Mapping[str, tuple[str, ...]],
    coordinates: Mapping[str, np.ndarray],
    output_name: str,
    value: Any,
) -> OutputValue:
    """Check one result of a measure.

    Parameters
    ----------
    dimensions_by_output : mapping of str to tuple of str
        Inner dimensions of each declared result.
    coordinates : mapping of str to ndarray
        Coordinate values of each inner dimension.
    output_name : str
        Name of the result.
    value : object
        Value of the result.

    Returns
    -------
    float, int, bool or ndarray
        A Python number if the result is scalar, and otherwise an array.

    Raises
    ------
    InvalidValue
        If the result is undeclared, is not a real number, or has the wrong shape.
    """
    if output_name not in dimensions_by_output:
        raise InvalidValue("measured", output_name, "is not declared", choices=dimensions_by_output)
    if isinstance(value, np.ma.MaskedArray):
        raise InvalidValue(output_name, value, "is masked, but must be a real number")
    array = np.asarray(value)
    if array.dtype.kind not in "iufb":
        raise InvalidValue(output_name, value, "must be a real number")
    shape = tuple(len(coordinates[dim]) for dim in dimensions_by_output[output_name])
    if array.shape != shape:
        rule = f"has the shape {array.shape}, but must have the shape {shape}"
        raise InvalidValue("measured", output_name, rule)
    return array if shape else array.item()


def check_field_value(
    field_name: str, value: Any, current_value: PlainValue, must_be_integer: bool
) -> Any:
    """Check a new value for a measure field.

    Parameters
    ----------
    field_name : str
        Name of the field.
    value : object
        New value.
    current_value : int, float, str or bool
        Present value, which must have the same type as the new value.
    must_be_integer : bool
        True if the field holds an integer. The new value may still be a float, because axes store
        integers as floats.

    Returns
    -------
    int, float, str or bool
        The new value, as an integer if ``must_be_integer`` is True.

    Raises
    ------
    InvalidValue
        If the new value has another type, is not finite, or is not an integer.
    """
    if _describe_value_type(value) != _describe_value_type(current_value):
        raise InvalidValue(
            field_name,
            value,
            f"must be {_describe_value_type(current_value)}, such as {current_value!r}",
        )
    if isinstance(value, float) and not math.isfinite(value):
        raise InvalidValue(field_name, value, "must be finite")
    if must_be_integer and value != int(value):
        raise InvalidValue(field_name, value, "must be a whole number")
    return int(value) if must_be_integer else value


def _describe_value_type(value: object) -> str:
    if isinstance(value, bool):
        return "a flag"
    if isinstance(value, str):
        return "a string"
    return "a number" if isinstance(value, int | float) else "something else"


def check_evaluation_count(evaluation_count: Any) -> int:
    """Check that a file can store a number of right-hand-side evaluations.

    Parameters
    ----------
    evaluation_count : object
        Number of evaluations.

    Returns
    -------
    int
        Number of evaluations as a Python integer.

    Raises
    ------
    InvalidValue
        If the number is not an integer from 0 to 2**63 - 1.
    """
    if not isinstance(evaluation_count, int | np.integer) or not 0 <= evaluation_count < 2**63:
        raise InvalidValue(
            "rhs_evaluations", evaluation_count, "must be a whole number from 0 to 2**63 - 1"
        )
    return int(evaluation_count)
