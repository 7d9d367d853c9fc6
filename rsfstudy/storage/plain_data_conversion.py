"""Functions that convert plain data, such as decoded JSON, to annotated types.

We convert and check plain data with msgspec for three reasons. First, msgspec is a single package
of 0.5 MB without dependencies, and its import takes 17 ms (pydantic: four packages, 10 MB, 50 ms;
cattrs: three packages, 41 ms). Second, msgspec is strict by default, whereas cattrs converts
strings to numbers. Third, msgspec supports the existing dataclasses, and its error messages contain
the path of the invalid entry.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from types import MappingProxyType
from typing import Any, get_type_hints

import msgspec

from rsfstudy.errors import DataError, InvalidValue, shorten_text


def build_invalid_entry_error(path_in_file: str, reason: str) -> DataError:
    """Build the error for an invalid entry of a results file.

    Parameters
    ----------
    path_in_file : str
        Path of the entry.
    reason : str
        Reason why the entry is invalid. The message consists of the path and the reason.

    Returns
    -------
    DataError
        Error to raise.
    """
    return DataError(
        f"{shorten_text(path_in_file).lstrip('.')} {reason}. The file was edited, or was not "
        "written by this version of rsfstudy. Run the study again."
    )


def convert_plain_data(plain_data: Any, annotated_type: Any, path_in_file: str) -> Any:
    """Convert plain data to an annotated type.

    Parameters
    ----------
    plain_data : object
        Decoded JSON.
    annotated_type : type
        Type or type annotation. If the type is a typed dictionary, the function drops unknown keys.
    path_in_file : str
        Path of the value in the file, for error messages.

    Returns
    -------
    object
        Value of the annotated type.

    Raises
    ------
    DataError
        If the value cannot be converted. The message contains the path of the value, for example
        ``declaration.claims[3].id``.
    """
    try:
        return msgspec.convert(plain_data, annotated_type)
    except (msgspec.ValidationError, OverflowError, RecursionError) as error:
        why, _, within = str(error).rpartition(" - at `$")
        place, why = (
            (f"{path_in_file}{within.rstrip('`')}", why) if why else (path_in_file, str(error))
        )
        if field := re.fullmatch("Object .* (required|unknown) field `(.*)`", why):
            rule = "is missing" if field[1] == "required" else "is unknown"
            raise build_invalid_entry_error(f"{place}.{field[2]}", rule) from error
        raise build_invalid_entry_error(place, f"is invalid ({shorten_text(why)})") from error


@cache
def create_msgspec_struct_type(name: str, type_by_field: tuple[tuple[str, Any], ...]) -> Any:
    """Create a struct that has only required fields and rejects unknown fields.

    Parameters
    ----------
    name : str
        Name of the struct.
    type_by_field : tuple of tuple of (str, type)
        Names and types of the fields.

    Returns
    -------
    type
        Struct.
    """
    return msgspec.defstruct(name, type_by_field, forbid_unknown_fields=True)


def build_dataclass_from_plain_data(
    plain_data: Any,
    dataclass_type: Any,
    path_in_file: str,
    preset_field_values: Mapping[str, Any] = MappingProxyType({}),
    integer_type: Any = int,
) -> Any:
    """Build an instance of a dataclass from plain data.

    Parameters
    ----------
    plain_data : mapping of str to object
        Values of all fields that are not in ``preset_field_values``.
    dataclass_type : type
        Dataclass to instantiate.
    path_in_file : str
        Path of the data in the file, for error messages.
    preset_field_values : mapping of str to object, optional
        Values of fields that need no conversion.
    integer_type : type, default: int
        Type to which integer fields are converted, for example an integer type with an upper limit.

    Returns
    -------
    object
        Instance of ``dataclass_type``.

    Raises
    ------
    DataError
        If a field is missing, unknown or invalid.
    """
    hints = get_type_hints(dataclass_type)
    types = tuple(
        (field.name, integer_type if hints[field.name] is int else hints[field.name])
        for field in fields(dataclass_type)
        if field.name not in preset_field_values
    )
    values = convert_plain_field_values(plain_data, types, path_in_file)
    return construct_from_field_values(
        dataclass_type, {**values, **preset_field_values}, path_in_file
    )


def convert_plain_field_values(
    plain_data: Any, type_by_field: tuple[tuple[str, Any], ...], path_in_file: str
) -> dict[str, Any]:
    """Convert the values of a mapping to the types of its fields.

    Parameters
    ----------
    plain_data : mapping of str to object
        Values of all fields.
    type_by_field : tuple of tuple of (str, type)
        Names and types of the fields.
    path_in_file : str
        Path of the data in the file, for error messages.

    Returns
    -------
    dict of str to object
        Converted values.

    Raises
    ------
    DataError
        If a field is missing, unknown or invalid.
    """
    struct = create_msgspec_struct_type("Stored", type_by_field)
    return msgspec.structs.asdict(convert_plain_data(plain_data, struct, path_in_file))


def construct_from_field_values(
    constructor: Any, field_values: Mapping[str, Any], path_in_file: str
) -> Any:
    """Call a constructor, and add the location in the file to its error messages.

    Parameters
    ----------
    constructor : callable
        Function or class that accepts the fields as keyword arguments.
    field_values : mapping of str to object
        Values of the fields.
    path_in_file : str
        Path of the values in the file, for error messages.

    Returns
    -------
    object
        Created object.

    Raises
    ------
    DataError
        If the constructor rejects a value. The message contains the path of the value.
    """
    try:
        return constructor(**field_values)
    except InvalidValue as error:
        raise build_invalid_entry_error(
            f"{path_in_file}.{error.name}", f"is invalid ({error})"
        ) from error
