"""Functions that convert datasets to plain-text tables for commands and reports."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from rsfstudy.formatting import format_number_or_text, read_flag_meanings
from rsfstudy.quantities import read_units_or_reference_scale
from rsfstudy.vocabulary import find_quantity

#: Maximum number of cells in a table that shows a selection of cells.
MAX_ROWS_IN_THINNED_TABLE = 24
#: Maximum number of significant digits of a float.
_MAX_SIGNIFICANT_DIGITS = 15


@dataclass(frozen=True)
class TextTable:
    """Table whose cells are strings.

    Parameters
    ----------
    rows : sequence of mapping of str to str
        Rows of the table. The keys are the column headings.
    caption : str, optional
        Caption of the table.
    wrappable_columns : collection of str, optional
        Headings of the columns that contain prose. Lines of prose may be broken between words.
    last_column_colours : sequence of str, optional
        Colour of the last cell of each row.
    unformatted_rows : sequence of mapping of str to object, optional
        Unformatted numbers and labels of each row, for JSON output.
    """

    rows: Sequence[Mapping[str, str]]
    caption: str = ""
    wrappable_columns: Collection[str] = ()
    last_column_colours: Sequence[str] = ()
    unformatted_rows: Sequence[Mapping[str, Any]] = ()


class TextTableColumn(NamedTuple):
    """Table column that shows a variable of a dataset.

    Parameters
    ----------
    heading : str
        Heading of the column.
    variable_name : str
        Name of the variable.
    format_function : callable
        Function that formats a value of the variable.
    key_in_unformatted_rows : str, default: ""
        Key of the value in ``TextTable.unformatted_rows``. If the key is empty, the value is
        stored with the coordinates of the row.
    """

    heading: str
    variable_name: str
    format_function: Callable[[Any], str]
    key_in_unformatted_rows: str = ""


def format_number_or_dash(value: float, format_specification: str = ".8g") -> str:
    """Format a number, or return a dash for NaN.

    Parameters
    ----------
    value : float
        Number to format.
    format_specification : str, default: ".8g"
        Format specification.

    Returns
    -------
    str
        Formatted number.
    """
    return "-" if np.isnan(value) else format(value, format_specification)


def format_rounded_to_error(value: float, error: float) -> str:
    """Format a number, rounded to the place of the second significant digit of its error.

    Parameters
    ----------
    value : float
        Number to format.
    error : float
        Error of the number.

    Returns
    -------
    str
        Formatted number. If the error is zero, NaN, or larger than the number, the number has eight
        significant digits.
    """
    if not 0.0 < error < abs(value):
        return format_number_or_dash(value)
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(error)) + 2
    return format(value, f".{min(digits, _MAX_SIGNIFICANT_DIGITS)}g")


def build_single_scene_result_table(dataset: xr.Dataset) -> TextTable:
    """Build a table of the scalar variables in a single-scene dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset of one scene, such as a critical step.

    Returns
    -------
    TextTable
        Table with one row per variable: name, value with units, error estimate, and description.
        Codes of categorical variables are replaced by their meanings.
    """
    rows, numbers = [], []
    for name, values in dataset.data_vars.items():
        if values.dims or str(name).removesuffix("_error") in set(dataset) - {name}:
            continue
        value, error = values.item(), float(dataset.get(f"{name}_error", np.nan))
        units, flags = format_units(values), read_flag_meanings(values.attrs)
        text = flags.get(value, format_rounded_to_error(value, error))
        description = str(values.attrs.get("long_name", ""))
        row = {
            "number": str(name),
            "value": text if units == "1" or text == "-" else f"{text} {units}",
            "error": format_number_or_dash(error, ".1e"),
            "description": description,
        }
        rows.append(row)
        number = {"value": flags.get(value, value), "error": error, "units": units}
        numbers.append({"name": str(name), **number, "description": description})
    return TextTable(rows, wrappable_columns={"description"}, unformatted_rows=numbers)


def format_units(variable: xr.DataArray) -> str:
    """Format the units of a variable.

    Parameters
    ----------
    variable : xarray.DataArray
        Variable with the attribute ``units`` or ``scale``.

    Returns
    -------
    str
        Units of the variable, or the scale by which the variable was divided. The string is "1" if
        the variable is a pure number.
    """
    units = re.sub(
        r" (s|[num]?m)-1\b", r"/\1", read_units_or_reference_scale(variable.attrs) or "1"
    )
    return re.sub(r" \((\w+)\)-1| (\(.*?\))-1", r"/\1\2", units)


def format_axis_name(axis_coordinate: xr.DataArray) -> str:
    """Format the name of an axis, with its units.

    Parameters
    ----------
    axis_coordinate : xarray.DataArray
        Coordinate of the axis.

    Returns
    -------
    str
        Name of the axis. If the units of the axis differ from the units in the vocabulary, the name
        is followed by the units in brackets.
    """
    name, units = str(axis_coordinate.name), axis_coordinate.attrs.get("units", "1")
    return name if units in ("1", find_quantity(name).units) else f"{name} ({units})"


def build_table_along_dimensions(
    dataset: xr.Dataset,
    dimensions: Iterable[Hashable],
    columns: Sequence[TextTableColumn],
    caption: str = "",
    wrappable_columns: Collection[str] = (),
) -> TextTable:
    """Build a table with one row for each combination of coordinate values.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with the variables of the columns.
    dimensions : iterable of hashable
        Dimensions of the rows. Each combination of points on these dimensions has one row.
    columns : sequence of Column
        Columns to the right of the coordinates.
    caption : str, optional
        Caption of the table.
    wrappable_columns : collection of str, optional
        Headings of the columns that contain prose. Lines of prose may be broken between words.

    Returns
    -------
    TextTable
        Table whose rows contain the coordinates of a point and the formatted values. Each entry of
        ``unformatted_rows`` has the key ``coordinates`` and the keys of the columns. Codes of
        categorical variables are replaced by their labels.
    """
    dims, rows, values = list(map(str, dimensions)), [], []
    flags = {
        column.key_in_unformatted_rows: read_flag_meanings(dataset[column.variable_name].attrs)
        for column in columns
    }
    for at in np.ndindex(*(dataset.sizes[d] for d in dims)):
        one = dataset.isel(dict(zip(dims, at, strict=True)))
        cells = {column: one[column.variable_name].item() for column in columns}
        rows.append(
            {format_axis_name(one[d]): format_number_or_text(one[d].item()) for d in dims}
            | {column.heading: column.format_function(value) for column, value in cells.items()}
        )
        fields = {
            column.variable_name: value
            for column, value in cells.items()
            if not column.key_in_unformatted_rows
        }
        found: dict[str, Any] = {"coordinates": {d: one[d].item() for d in dims} | fields}
        for column, value in cells.items():
            if column.key_in_unformatted_rows:
                found[column.key_in_unformatted_rows] = flags[column.key_in_unformatted_rows].get(
                    value, value
                )
        values.append(found)
    return TextTable(rows, caption, wrappable_columns, unformatted_rows=values)
