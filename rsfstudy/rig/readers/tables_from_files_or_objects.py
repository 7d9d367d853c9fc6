"""Classes that represent the sources of data and the tables that readers return.

A ``TableSource`` is a file or an object that contains data. A reader converts a source to a
``LazyTable``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.exception_conversion import check_regular_file
from rsfstudy.rig.table_columns import (
    HEADING_PATTERN,
    Column,
    ColumnSelection,
    check_heading_lengths,
)
from rsfstudy.rig.units import find_si_factor_and_exponents

#: Number of bytes at the beginning of a file that are used to recognise the format.
_FILE_SIGNATURE_BYTE_COUNT = 8192


@dataclass(frozen=True, eq=False)
class TableSource:
    """File or object that contains a table.

    Parameters
    ----------
    path_or_object : str, Path or object
        Path of a file, or an object such as a mapping or a DataFrame.
    decimal_separator : {".", ","}, default: "."
        Decimal separator of text files.
    sheet_or_group_name : str, default: ""
        Name of a sheet of a workbook, or name of a group of a TDMS file. If the string is empty,
        the first sheet or group is read.
    file_bytes : bytes, optional
        Bytes of the file. By default, the bytes are read from the path. Readers of compressed files
        pass the decompressed bytes.
    """

    path_or_object: Any
    decimal_separator: str = "."
    sheet_or_group_name: str = ""
    file_bytes: bytes | None = None

    @property
    def is_file(self) -> bool:
        """True if the source is a file."""
        return isinstance(self.path_or_object, str | Path)

    @property
    def path(self) -> Path:
        """Path of the file."""
        return Path(self.path_or_object)

    @cached_property
    def first_bytes_of_file(self) -> bytes:
        """First bytes of the file, or empty bytes if the source is an object."""
        if not self.is_file:
            return b""
        if self.file_bytes is not None:
            return self.file_bytes[:_FILE_SIGNATURE_BYTE_COUNT]
        check_regular_file("record", self.path_or_object)
        if not self.path.exists():
            raise DataError(f"the file {self.path_or_object} does not exist")
        return self._read_bytes_from_path(_FILE_SIGNATURE_BYTE_COUNT)

    def read_all_bytes(self) -> bytes:
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
        return self._read_bytes_from_path(-1) if self.file_bytes is None else self.file_bytes

    def _read_bytes_from_path(self, byte_count: int) -> bytes:
        try:
            with self.path.open("rb") as file:
                return file.read(byte_count)
        except OSError as error:
            raise DataError(f"{self.path}: cannot be read: {error.strerror}") from error


@dataclass(frozen=True, eq=False)
class LazyTable:
    """Table of a source, whose columns are converted to numbers only when they are selected.

    Parameters
    ----------
    headings : sequence of str
        Headings of all columns, such as ``Time (s)`` or ``Time``.
    heading_location : str
        Location of the headings for error messages.
    numeric_column_loader : callable
        Function that converts the numbers of a column. The function takes the index of the column
        and the name of the quantity, and returns a ``Column``. The units of the column are an empty
        string unless the units follow from the type of the numbers.
    has_headings : bool, default: True
        False if the columns have no headings. In this case, the headings are the column numbers,
        counted from 1.
    columns_have_no_units : bool, default: False
        True if no column has units. The columns are then in the default units.
    headings_are_column_names : bool, default: False
        True if an unknown heading is an error, because each heading must be the name of a usable
        column.

    Raises
    ------
    InvalidValue
        If a heading is too long.
    """

    headings: Sequence[str]
    heading_location: str
    numeric_column_loader: Callable[[int, str], Column]
    has_headings: bool = True
    columns_have_no_units: bool = False
    headings_are_column_names: bool = False
    _column_indices_by_heading: dict[str, list[int]] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        """Check the lengths of the headings, and build the index of headings."""
        check_heading_lengths(self.headings, self.heading_location)
        names: dict[str, list[int]] = {}
        for index, heading in enumerate(self.headings):
            self._column_indices_by_heading.setdefault(heading, []).append(index)
            if (match := HEADING_PATTERN.fullmatch(heading)) and match[1] != heading:
                names.setdefault(match[1], []).append(index)
        # A complete heading takes precedence over a heading without its units.
        for name, indices in names.items():
            self._column_indices_by_heading.setdefault(name, indices)

    def find_column_index(self, heading_or_number: str) -> int:
        """Return the index of a column.

        Parameters
        ----------
        heading_or_number : str
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
        found = self._column_indices_by_heading.get(heading_or_number, [])
        if len(found) == 1:
            return found[0]
        if (
            not found
            and heading_or_number.isdecimal()
            and 1 <= int(heading_or_number[:9]) <= len(self.headings)
        ):
            return int(heading_or_number) - 1
        rule = (
            (f"is the heading of {len(found)} columns, but must be the heading of exactly one")
            if found
            else "is not a heading of the table"
        )
        remedy = f"Columns can also be selected by their numbers, from 1 to {len(self.headings)}."
        raise InvalidValue(
            "column", heading_or_number, rule, choices=self.headings, remedy=remedy
        ).with_location(self.heading_location)

    def parse_units_of_heading(self, column_index: int) -> str:
        """Return the units in a heading.

        Parameters
        ----------
        column_index : int
            Index of the column.

        Returns
        -------
        str
            Units. The string is empty if the heading contains no units.
        """
        match = HEADING_PATTERN.fullmatch(self.headings[column_index])
        return (match[2] or "").strip() if match else ""

    def read_column(self, quantity_name: str, column_selection: ColumnSelection) -> Column:
        """Read a selected column.

        Parameters
        ----------
        quantity_name : str
            Name of the quantity for error messages.
        column_selection : ColumnSelection
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
        heading, units, scale, offset = column_selection
        index = self.find_column_index(heading)
        of_file = self.parse_units_of_heading(index)
        if scale == 1.0 and _differ_in_conversion_factor(units, of_file):
            remedy = f"Write '{self.headings[index]}', or correct the heading in the file."
            raise InvalidValue(
                quantity_name, units, f"contradicts the units in the file, {of_file}", remedy=remedy
            ).with_location(self.heading_location)
        column = self.numeric_column_loader(index, quantity_name)
        values = column.values
        if (scale, offset) != (1.0, 0.0):
            values = values * scale + offset
        return column._replace(values=values, units=column.units or units or of_file)


def _differ_in_conversion_factor(units: str, other_units: str) -> bool:
    """Return True if two compatible units have different conversion factors."""
    one, other = find_si_factor_and_exponents(units), find_si_factor_and_exponents(other_units)
    return one is not None and other is not None and one[1] == other[1] and one[0] != other[0]


def append_units_to_headings(headings: Sequence[str], units: Sequence[str]) -> list[str]:
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
    headings: Sequence[str],
    column_arrays: Sequence[np.ndarray],
    heading_location: str,
    path: str = "",
) -> LazyTable:
    """Build a table of numeric arrays.

    Parameters
    ----------
    headings : sequence of str
        Headings of the columns.
    column_arrays : sequence of ndarray
        Values of each column, as arrays of shape (rows,).
    heading_location : str
        Location of the headings for error messages.
    path : str, default: ""
        Path of the file.

    Returns
    -------
    LazyTable
        Table with the arrays.
    """

    def load(index: int, quantity_name: str) -> Column:
        array = column_arrays[index]
        if array.dtype.kind not in "fiub":
            raise InvalidValue(
                quantity_name, array.dtype.name, "must be real numbers"
            ).with_location(f"{heading_location}, column {index + 1}")
        rows = np.arange(1, len(array) + 1)
        return Column(array.astype(float), "", index + 1, rows, path)

    return LazyTable(headings, heading_location, load)
