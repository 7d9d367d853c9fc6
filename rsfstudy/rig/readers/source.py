"""Sources of data, and the tables that readers return.

A ``Source`` is a file or an object that contains data. A reader converts a source to a ``Table``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from rsfstudy.error_boundary import check_regular_file
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.rig.columns import HEADING_PATTERN, Column, ColumnSpec, check_heading_lengths
from rsfstudy.rig.units import find_size_of_units

#: Number of bytes at the beginning of a file that are used to recognise the format.
_BYTES_OF_FILE_SIGNATURE = 8192


@dataclass(frozen=True, eq=False)
class Source:
    """File or object that contains a table.

    Parameters
    ----------
    origin : str, Path or object
        Path of a file, or an object such as a mapping or a DataFrame.
    decimal : {".", ","}, default: "."
        Decimal separator of text files.
    sheet : str, default: ""
        Name of a sheet of a workbook, or name of a group of a TDMS file. If the string is empty,
        the first sheet or group is read.
    content : bytes, optional
        Bytes of the file. By default, the bytes are read from the path. Readers of compressed files
        pass the decompressed bytes.
    """

    origin: Any
    decimal: str = "."
    sheet: str = ""
    content: bytes | None = None

    @property
    def is_file(self) -> bool:
        """True if the source is a file."""
        return isinstance(self.origin, str | Path)

    @property
    def path(self) -> Path:
        """Path of the file."""
        return Path(self.origin)

    @cached_property
    def signature(self) -> bytes:
        """First bytes of the file, or empty bytes if the source is an object."""
        if not self.is_file:
            return b""
        if self.content is not None:
            return self.content[:_BYTES_OF_FILE_SIGNATURE]
        check_regular_file("record", self.origin)
        if not self.path.exists():
            raise DataError(f"the file {self.origin} does not exist")
        return self._read(_BYTES_OF_FILE_SIGNATURE)

    def read_bytes(self) -> bytes:
        """Return all bytes of the file.

        Returns
        -------
        bytes
            Bytes of the file.

        Raises
        ------
        DataError
            If the file cannot be read.
        """
        return self._read(-1) if self.content is None else self.content

    def _read(self, count: int) -> bytes:
        try:
            with self.path.open("rb") as file:
                return file.read(count)
        except OSError as error:
            raise DataError(f"{self.path}: cannot be read: {error.strerror}") from error


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of a source, which are converted to numbers when selected.

    Parameters
    ----------
    headings : sequence of str
        Headings of all columns, such as ``Time (s)`` or ``Time``.
    location : str
        Location of the headings for error messages.
    load_values : callable
        Function that converts the numbers of a column. The function takes the index of the column
        and the name of the quantity, and returns a ``Column``. The units of the column are an empty
        string unless the units follow from the type of the numbers.
    has_headings : bool, default: True
        False if the columns have no headings. In this case, the headings are the column numbers,
        counted from 1.
    default_units : bool, default: False
        True if no column has units. The columns are then in the default units.
    has_only_columns : bool, default: False
        True if an unknown heading is an error, because each heading must be the name of a usable
        column.

    Raises
    ------
    InvalidValue
        If a heading is too long.
    """

    headings: Sequence[str]
    location: str
    load_values: Callable[[int, str], Column]
    has_headings: bool = True
    default_units: bool = False
    has_only_columns: bool = False
    _indices: dict[str, list[int]] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        """Check the lengths of the headings, and build the index of headings."""
        check_heading_lengths(self.headings, self.location)
        names: dict[str, list[int]] = {}
        for index, heading in enumerate(self.headings):
            self._indices.setdefault(heading, []).append(index)
            if (match := HEADING_PATTERN.fullmatch(heading)) and match[1] != heading:
                names.setdefault(match[1], []).append(index)
        # A complete heading takes precedence over a heading without its units.
        for name, indices in names.items():
            self._indices.setdefault(name, indices)

    def find_column(self, heading: str) -> int:
        """Return the index of a column.

        Parameters
        ----------
        heading : str
            Complete heading, heading without its units, or number of the column, counted from 1.

        Returns
        -------
        int
            Index of the column, counted from 0.

        Raises
        ------
        InvalidValue
            If no column or more than one column has the heading.
        """
        found = self._indices.get(heading, [])
        if len(found) == 1:
            return found[0]
        if not found and heading.isdecimal() and 1 <= int(heading[:9]) <= len(self.headings):
            return int(heading) - 1
        rule = (
            (f"is the heading of {len(found)} columns, but must be the heading of exactly one")
            if found
            else "is not a heading of the table"
        )
        remedy = f"Columns can also be selected by their numbers, from 1 to {len(self.headings)}."
        raise InvalidValue(
            "column", heading, rule, choices=self.headings, remedy=remedy
        ).with_location(self.location)

    def units_of_heading(self, index: int) -> str:
        """Return the units in a heading.

        Parameters
        ----------
        index : int
            Index of the column.

        Returns
        -------
        str
            Units. The string is empty if the heading contains no units.
        """
        match = HEADING_PATTERN.fullmatch(self.headings[index])
        return (match[2] or "").strip() if match else ""

    def read_column(self, quantity_name: str, selection: ColumnSpec) -> Column:
        """Read a selected column.

        Parameters
        ----------
        quantity_name : str
            Name of the quantity for error messages.
        selection : ColumnSpec
            Heading of the column with units, scale and offset. If the units in the file are missing
            or unknown, the units of the selection are used.

        Returns
        -------
        Column
            Scaled values of the column, with their units.

        Raises
        ------
        InvalidValue
            If the column does not exist, if the units of the selection contradict the units of the
            file, or if a value is not a number.
        """
        heading, units, scale, offset = selection
        index = self.find_column(heading)
        of_file = self.units_of_heading(index)
        if scale == 1.0 and _differ_in_size(units, of_file):
            remedy = f"Write '{self.headings[index]}', or correct the heading in the file."
            raise InvalidValue(
                quantity_name, units, f"contradicts the units in the file, {of_file}", remedy=remedy
            ).with_location(self.location)
        column = self.load_values(index, quantity_name)
        values = column.values
        if (scale, offset) != (1.0, 0.0):
            values = values * scale + offset
        return column._replace(values=values, units=column.units or units or of_file)


def _differ_in_size(units: str, other_units: str) -> bool:
    """Return True if two compatible units have different conversion factors."""
    one, other = find_size_of_units(units), find_size_of_units(other_units)
    return one is not None and other is not None and one[1] == other[1] and one[0] != other[0]


def merge_headings_with_units(headings: Sequence[str], units: Sequence[str]) -> list[str]:
    """Add units to headings that contain no units.

    Parameters
    ----------
    headings, units : sequence of str
        Headings and units of the columns. Units may be enclosed in brackets.

    Returns
    -------
    list of str
        Headings such as ``Time (s)``.
    """
    return [
        heading if not bare or heading.endswith((")", "]")) else f"{heading} ({bare})"
        for heading, bare in zip(headings, (text.strip(" ()[]") for text in units), strict=True)
    ]


def build_table_of_arrays(
    names: Sequence[str], values: Sequence[np.ndarray], location: str, path: str = ""
) -> Table:
    """Build a table of numeric arrays.

    Parameters
    ----------
    names : sequence of str
        Headings of the columns.
    values : sequence of ndarray
        Values of each column, as arrays of shape (rows,).
    location : str
        Location of the headings for error messages.
    path : str, default: ""
        Path of the file.

    Returns
    -------
    Table
        Table with the arrays.
    """

    def load(index: int, quantity_name: str) -> Column:
        array = values[index]
        if array.dtype.kind not in "fiub":
            raise InvalidValue(
                quantity_name, array.dtype.name, "must be real numbers"
            ).with_location(f"{location}, column {index + 1}")
        rows = np.arange(1, len(array) + 1)
        return Column(array.astype(float), "", index + 1, rows, path)

    return Table(names, location, load)
