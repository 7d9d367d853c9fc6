"""Tables of numbers with units, from CSV files.

`read_table` is the main function.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rsfstudy._deprecation import add_former_member_names, build_getattr_for_former_names
from rsfstudy.error_boundary import check_regular_file, error_boundary
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.quantities import split_heading_into_name_and_units
from rsfstudy.rig.units import parse_number

__getattr__ = build_getattr_for_former_names(__name__)

#: Characters of tables that `numpy.loadtxt` can parse.
_CHARACTERS_OF_PLAIN_NUMERIC_TABLES = frozenset("0123456789+-.eE \t\r\n")
_EXAMPLE_OF_TABLE_HEADER = "velocity (um/s), distance (um), a (1)"
_NUMBER_PATTERN = r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*"
#: Pattern of a heading that is followed by a scale and an offset.
_HEADING_WITH_SCALE_AND_OFFSET_PATTERN = re.compile(
    rf"(.*\S)\s*\*\s*(-?){_NUMBER_PATTERN}(?:([-+]){_NUMBER_PATTERN})?"
)
#: Pattern of a heading with optional units in brackets.
HEADING_PATTERN = re.compile(r"\s*([^(\[]+?)\s*(?:[(\[]([^)\]]*)[)\]])?\s*")
#: Maximum length of a heading. The limit is necessary because the time for matching a pattern
#: increases with the square of the length of the heading.
_MAX_HEADING_LENGTH = 200


class ColumnSpec(NamedTuple):
    """Selection of a column in a file.

    Parameters
    ----------
    heading : str
        Heading of the column.
    units : str, default: ""
        Units of the column.
    scale : float, default: 1.0
        Factor by which raw numbers are multiplied.
    offset : float, default: 0.0
        Number to add to each value after the multiplication by ``scale``.
    """

    heading: str
    units: str = ""
    scale: float = 1.0
    offset: float = 0.0


#: Function that selects columns of a file. The two arguments of the function are a list of headings
#: and a description of the location of the headings.
ColumnChoosingFunction = Callable[[list[str], str], dict[str, ColumnSpec]]


def check_heading_length(heading: str) -> None:
    """Raise an error if a heading is too long to be parsed.

    Parameters
    ----------
    heading : str
        Heading to check.

    Raises
    ------
    InvalidValue
        If the heading is too long.
    """
    if len(heading) > _MAX_HEADING_LENGTH:
        rule = f"must have at most {_MAX_HEADING_LENGTH} characters (it has {len(heading):,})"
        raise InvalidValue(
            "heading", heading, rule, remedy=f"Write it as in {_EXAMPLE_OF_TABLE_HEADER}."
        )


def check_heading_lengths(headings: Iterable[str], file_description: str) -> None:
    """Check the length of all headings of a file.

    Parameters
    ----------
    headings : iterable of str
        Headings in the order of the columns.
    file_description : str
        Name of the file for error messages.

    Raises
    ------
    InvalidValue
        If a heading is too long. The error message contains the number of the column.
    """
    for column, heading in enumerate(headings, start=1):
        try:
            check_heading_length(heading)
        except InvalidValue as error:
            raise error.with_location(f"{file_description}, column {column}") from error


def _parse_column_spec_given_as_list(column_choice: Any) -> ColumnSpec:
    """Parse a column selection with heading, units, scale and offset."""
    rule = "must be a heading, or a list of a heading, its units, a scale and an offset"
    remedy = "Write ('Time (s)', 's', 0.001), for example."
    wrong = InvalidValue("column", column_choice, rule, remedy=remedy)
    column_choice = (
        column_choice.tolist() if isinstance(column_choice, np.ndarray) else column_choice
    )
    if not isinstance(column_choice, Sequence) or not 1 <= len(column_choice) <= len(
        ColumnSpec._fields
    ):
        raise wrong
    heading, units, *numbers = (*column_choice, "")[: max(2, len(column_choice))]
    # Columns of xlook files may be selected by their numbers.
    if not isinstance(heading, str | int) or not isinstance(units, str):
        raise wrong
    check_heading_length(str(heading))
    try:
        return ColumnSpec(str(heading), units, *map(float, numbers))
    except (TypeError, ValueError, OverflowError) as error:
        raise wrong from error


def parse_column_spec(column_choice: Any, headings: Collection[str]) -> ColumnSpec:
    """Parse the selection of a column.

    Parameters
    ----------
    column_choice : str or sequence
        A sequence of heading, units, scale and offset, or a string such as ``lp (um) * 0.1 + 5``.
        The units in brackets are optional, even if the heading in the file contains units.
    headings : collection of str
        Headings of the file.

    Returns
    -------
    ColumnSpec
        Selected column.

    Raises
    ------
    InvalidValue
        If the selection has another type, or if the heading is too long.
    """
    if not isinstance(column_choice, str):
        return _parse_column_spec_given_as_list(column_choice)
    check_heading_length(column_choice)
    raw = (
        None
        if column_choice in headings
        else _HEADING_WITH_SCALE_AND_OFFSET_PATTERN.fullmatch(column_choice)
    )
    scale, offset = 1.0, 0.0
    if raw:
        column_choice, scale = raw[1], float(raw[2] + raw[3])
        offset = float((raw[4] or "") + (raw[5] or "0"))
    match = HEADING_PATTERN.fullmatch(column_choice)
    units = (match[2] or "").strip() if match else ""
    heading = column_choice if column_choice in headings or not match else match[1]
    return ColumnSpec(heading, units, scale, offset)


@add_former_member_names
class Column(NamedTuple):
    """Column of a table.

    Parameters
    ----------
    values : ndarray
        Values of the column, as an array of shape (rows,). Empty fields are NaN.
    units : str
        Units of the values.
    column_number : int, default: 0
        Number of the column in the file, counted from 1.
    line_numbers : ndarray, optional
        Line number of each value in the file.
    path : str, default: ""
        Path of the file. The string is empty if the column does not come from a file.
    """

    values: np.ndarray
    units: str
    column_number: int = 0
    line_numbers: np.ndarray = np.empty(0, dtype=int)
    path: str = ""

    def location(self, row: int) -> str:
        """Return the location of a value for error messages.

        Parameters
        ----------
        row : int
            Index of the value.

        Returns
        -------
        str
            File, line and column of the value, or the number of the sample.
        """
        if not self.path:
            return f"sample {row + 1}"
        return f"{self.path}, line {self.line_numbers[row]}, column {self.column_number}"

    def check_values(self, quantity_name: str, invalid_mask: np.ndarray, rule: str) -> None:
        """Raise an error for the first invalid value.

        Parameters
        ----------
        quantity_name : str
            Name of the quantity.
        invalid_mask : ndarray of bool
            True for each invalid value.
        rule : str
            Rule that the values must satisfy.

        Raises
        ------
        InvalidValue
            If a value is invalid. The error message contains the location of the value.
        """
        if invalid_mask.any():
            row = int(np.argmax(invalid_mask))
            raise InvalidValue(quantity_name, float(self.values[row]), rule).with_location(
                self.location(row)
            )


def select_columns_of_arrays(source: Any, columns: Mapping[str, Any]) -> dict[str, Column]:
    """Select columns of a mapping, a dataset or a data frame.

    Parameters
    ----------
    source : mapping of str to array, xarray.Dataset or pandas.DataFrame
        Arrays by name. The units of dataset variables are read from their attribute ``units``.
    columns : mapping of str to str, tuple or ColumnSpec
        Selection of each column, as in `parse_column_spec`.

    Returns
    -------
    dict of str to Column
        Columns by name.

    Raises
    ------
    InvalidValue
        If a column is missing, has more than one dimension, or contains values that are not real
        numbers.
    """
    variables = source.variables if hasattr(source, "data_vars") else source
    # A dictionary keeps the order and is fast to search.
    names = dict.fromkeys(map(str, variables))
    found = {}
    for key, told in columns.items():
        heading, units, scale, offset = parse_column_spec(told, names)
        if heading not in names:
            raise InvalidValue("column", heading, "is not in the record", choices=names)
        values, of_times = _to_floats_and_units(key, source[heading])
        if values.ndim != 1:
            raise InvalidValue(key, values.shape, "must lie along one dimension")
        units = of_times or units or str(getattr(source[heading], "attrs", {}).get("units", ""))
        found[key] = Column(values * scale + offset, units)
    return found


def _to_floats_and_units(column_name: str, values: Any) -> tuple[np.ndarray, str]:
    """Convert an array to floats, and return the units that its type implies.

    Masked values become NaN. Times are converted to seconds. Dates are converted to seconds since
    the first date.
    """
    kind = getattr(getattr(values, "dtype", None), "kind", "")
    if kind == "c":
        raise InvalidValue(column_name, values.dtype.name, "must be real numbers")
    if kind not in ("m", "M"):
        try:
            return np.ma.asarray(values, dtype=float).filled(math.nan), ""
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidValue(column_name, values, "must be a list of numbers") from error
    times = np.asarray(values, dtype=f"{'datetime' if kind == 'M' else 'timedelta'}64[ns]")
    first = times[:1] if times.ndim else times
    return (times - first if kind == "M" else times) / np.timedelta64(1, "s"), "s"


@error_boundary
def read_table(
    path: str | Path, columns: Mapping[str, Any] | ColumnChoosingFunction | None = None
) -> dict[str, Column]:
    r"""Read columns of a CSV file or of a text file.

    The columns may be separated by commas, semicolons, tabs or blanks.

    Parameters
    ----------
    path : str or Path
        Path of the file.
    columns : mapping of str to (str, str) or str, optional
        Heading and units of each column, for example ``{"time": ("t", "s")}`` or ``{"time": "t
        (s)"}``. By default, all columns are read, and the first line must contain their names and
        units, as in ``velocity (um/s), distance (um)``. You can also pass a function with two
        arguments, a list of headings and a description of the location of the headings. The
        function must return a mapping of column names to column selections.

    Returns
    -------
    dict of str to Column
        Columns by name. Each column has an array ``values`` and a string ``units``.

    Raises
    ------
    DataError
        If the file does not exist or is not a text file.
    InvalidValue
        If the header does not contain the selected columns, or if a field is not a number. The
        error message contains the line and the column.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import rsfstudy
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "table.csv"
    >>> _ = path.write_text("velocity (um/s), distance (um)\n1, 100\n10, 200\n")
    >>> table = rsfstudy.read_table(path)
    >>> table["velocity"].values
    array([ 1., 10.])
    >>> table["distance"].units
    'um'
    """
    check_regular_file("table", path)
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            between = _detect_delimiter(file.readline())
            file.seek(0)
            text = file.read()
        read = csv.reader(io.StringIO(text), delimiter=between, skipinitialspace=between == " ")
        line, header = next(((n, row) for n, row in enumerate(read, start=1) if any(row)), (1, []))
        headings = [name.strip() for name in header]
        values, lines = _read_plain_numeric_table(text, between, line, len(header))
        if values is None:
            rows = [(n, row) for n, row in enumerate(read, start=line + 1) if any(row)]
    except (OSError, UnicodeError, csv.Error) as error:
        raise DataError(f"{path}: cannot be read as CSV ({error})") from error
    check_heading_lengths(headings, f"{path}, line {line}")
    if not header:
        remedy = f"Its first line reads, for instance, {_EXAMPLE_OF_TABLE_HEADER}."
        raise InvalidValue("table", str(path), "has no header", remedy=remedy)
    if values is None:
        lines = np.array([n for n, _row in rows], dtype=int)
        for n, row in rows:
            if len(row) != len(header):
                rule = f"has {len(row)} fields, and the header {len(header)}"
                remedy = "Numbers have a decimal point." if len(row) > len(header) else ""
                wrong = InvalidValue("line", between.join(row), rule, remedy=remedy)
                raise wrong.with_location(f"{path}, line {n}")
    wanted: Any
    if isinstance(columns, Mapping):
        wanted = {name: parse_column_spec(told, headings) for name, told in columns.items()}
    else:
        wanted = (columns or _choose_all_columns_of_header)(headings, f"{path}, line {line}")
    if not isinstance(wanted, Mapping):
        rule = "must be a mapping, or a function that returns one"
        raise InvalidValue("columns", columns, rule)
    found = {}
    places, counts = {h: n for n, h in enumerate(headings)}, Counter(headings)
    for name, (heading, units, scale, offset) in wanted.items():
        if counts[heading] != 1:
            rule = f"heads {counts[heading]} columns, and must head one"
            raise InvalidValue("column", heading, rule, choices=headings).with_location(
                f"{path}, line {line}"
            )
        place = places[heading]
        column = Column(np.empty(0), units, place + 1, lines, str(path))
        below = (
            [
                _parse_number_in_table_field(name, row[place], column, n)
                for n, (_line, row) in enumerate(rows)
            ]
            if values is None
            else values[:, place]
        )
        found[name] = column._replace(values=np.array(below, dtype=float) * scale + offset)
    return found


def _read_plain_numeric_table(
    text: str, delimiter: str, header_line_count: int, column_count: int
) -> tuple[np.ndarray | None, np.ndarray]:
    """Read a table that contains only finite numbers and delimiters.

    The function returns the numbers and their line numbers. If the table contains other characters,
    the function returns None instead of the numbers. A table with other characters has to be read
    line by line.
    """
    body = "".join(text.split("\n", header_line_count)[header_line_count:])
    lines = header_line_count + 1 + np.arange(body.count("\n") + (not body.endswith("\n")))
    if (
        delimiter == " "
        or not body.strip()
        or not set(body) <= _CHARACTERS_OF_PLAIN_NUMERIC_TABLES | {delimiter}
    ):
        return None, lines
    try:
        found = np.loadtxt(io.StringIO(body), delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None, lines
    plain = found.shape == (len(lines), column_count) and bool(np.isfinite(found).all())
    return (found if plain else None), lines


def _detect_delimiter(header: str) -> str:
    """Detect the delimiter: a tab, a semicolon, a comma or a blank."""
    return next(
        (mark for mark in "\t;," if mark in header), " " if not {"(", "["} & {*header} else ","
    )


def _choose_all_columns_of_header(
    headings: list[str], file_description: str
) -> dict[str, ColumnSpec]:
    """Select all columns of a file whose header contains names and units."""
    found: dict[str, ColumnSpec] = {}
    for n, heading in enumerate(headings, start=1):
        stated = split_heading_into_name_and_units(heading)
        if stated is None:
            remedy = f"Write the header as in {_EXAMPLE_OF_TABLE_HEADER}."
            rule = "names no column with its units"
            raise InvalidValue("header", heading, rule, remedy=remedy).with_location(
                f"{file_description}, column {n}"
            )
        name, units = stated
        if name in found:
            raise InvalidValue("column", name, "stands twice in the header").with_location(
                file_description
            )
        found[name] = ColumnSpec(heading, units)
    return found


def _parse_number_in_table_field(column_name: str, text: str, column: Column, row: int) -> float:
    if not text.strip():
        return math.nan
    found = parse_number(text)
    if found is None:
        alone = "Write digits alone, as in 1.5e-3; units stand in the header."
        remedy = "Write a decimal point." if "," in text else alone
        wrong = InvalidValue(column_name, text, "is no number", remedy=remedy)
        raise wrong.with_location(column.location(row))
    if not math.isfinite(found):
        raise InvalidValue(column_name, text.strip(), "must be finite").with_location(
            column.location(row)
        )
    return found
