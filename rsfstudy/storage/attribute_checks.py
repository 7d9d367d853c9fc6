"""Functions that check the variables in results files and the attributes of the variables.

The checks are needed because other programs may have written or changed the files.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, shorten_text

#: Maximum length of string attributes in characters, by attribute name.
_MAX_LENGTH_BY_TEXT_ATTRIBUTE = {
    "long_name": 2000,
    "units": 200,
    "scale": 200,
    "symbol": 500,
    "flag_meanings": 20_000,
    "comment": 100_000,
    "loading": 200,
}
_INVALID_ATTRIBUTE_REMEDY = "Correct it with xarray, or run the study again."


def check_variable_attributes(dataset: xr.Dataset) -> None:
    """Check the type and length of the attributes that rsfstudy uses.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to check.

    Raises
    ------
    DataError
        If an attribute has the wrong type or is too long, or if the number of flag values differs
        from the number of flag meanings.
    """
    for name, values in dataset.variables.items():
        for key, most in _MAX_LENGTH_BY_TEXT_ATTRIBUTE.items():
            if key in values.attrs:
                _check_text_attribute(f"{shorten_text(name)}.{key}", values.attrs[key], most)
        _check_flag_values_and_meanings(str(name), values.attrs)


def check_motion_variables_are_numeric(dataset: xr.Dataset) -> None:
    """Check that the variables with the same dimensions as ``slip`` are numeric.

    If the dataset is a motion, these variables have one value at each recorded time.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to check.

    Raises
    ------
    DataError
        If a variable is not numeric.
    """
    along = dataset["slip"].dims if "slip" in dataset.variables else ()
    for name, values in dataset.variables.items():
        if along and values.dims == along and values.dtype.kind not in "fiub":
            raise DataError(
                f"{shorten_text(name)} is {values.dtype}, but must be numeric. "
                f"{_INVALID_ATTRIBUTE_REMEDY}"
            )


def _check_text_attribute(attribute_path: str, value: object, max_characters: int) -> None:
    """Check the type and length of a string attribute."""
    if not isinstance(value, str):
        raise DataError(
            f"{attribute_path} is {shorten_text(value)}, but must be a string. "
            f"{_INVALID_ATTRIBUTE_REMEDY}"
        )
    if len(value) > max_characters:
        raise DataError(
            f"{attribute_path} has {len(value):,} characters, but the maximum is "
            f"{max_characters:,}. {_INVALID_ATTRIBUTE_REMEDY}"
        )


def _check_flag_values_and_meanings(variable_name: str, attributes: Mapping[Any, Any]) -> None:
    """Check that flag values are numbers, and that each value has a meaning."""
    if not {"flag_values", "flag_meanings"} & set(attributes):
        return
    values = np.ravel(attributes.get("flag_values", ()))
    meanings = str(attributes.get("flag_meanings", "")).split()
    if values.dtype.kind not in "iuf" or len(values) != len(meanings):
        raise DataError(
            f"{shorten_text(variable_name)}.flag_values must contain one number for each of the "
            f"{len(meanings)} flag_meanings (got {shorten_text(values.tolist())}). "
            f"{_INVALID_ATTRIBUTE_REMEDY}"
        )
