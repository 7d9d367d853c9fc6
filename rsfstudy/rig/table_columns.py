"""Classes and functions that represent table columns and parse column selections.

A column selection contains the heading and the units of the column, a scale and an offset.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.errors import InvalidValue

#: Table header that error messages show as an example.
EXAMPLE_OF_TABLE_HEADER = "velocity (um/s), distance (um), a (1)"
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


class ColumnSelection(NamedTuple):
    """Selection of a column in a file.

    Parameters
    ----------
    heading : str
        Heading of the column.
    units : str, default: ""
        Units of the column.
    scale_factor : float, default: 1.0
        Factor by which the numbers in the file are multiplied.
    offset : float, default: 0.0
        Number to add to each value after the multiplication by ``scale_factor``.
    """

    heading: str
    units: str = ""
    scale_factor: float = 1.0
    offset: float = 0.0


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
            "heading",
            heading,
            rule,
            remedy="Write a short heading, with the units in parentheses after the name, for "
            f"example {EXAMPLE_OF_TABLE_HEADER}.",
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
        If a heading is too long. The error message contains the column number.
    """
    for column, heading in enumerate(headings, start=1):
        try:
            check_heading_length(heading)
        except InvalidValue as error:
            raise error.with_location(f"{file_description}, column {column}") from error


def _parse_column_selection_tuple(column_choice: Any) -> ColumnSelection:
    """Parse a column selection that consists of a heading, units, a scale and an offset."""
    rule = "must be a heading, or a list with a heading, units, a scale and an offset"
    remedy = "Write, for example, ('Time (s)', 's', 0.001)."
    wrong = InvalidValue("column", column_choice, rule, remedy=remedy)
    column_choice = (
        column_choice.tolist() if isinstance(column_choice, np.ndarray) else column_choice
    )
    if not isinstance(column_choice, Sequence) or not 1 <= len(column_choice) <= len(
        ColumnSelection._fields
    ):
        raise wrong
    heading, units, *numbers = (*column_choice, "")[: max(2, len(column_choice))]
    # Columns of xlook files may be selected by their numbers.
    if not isinstance(heading, str | int) or not isinstance(units, str):
        raise wrong
    check_heading_length(str(heading))
    try:
        return ColumnSelection(str(heading), units, *map(float, numbers))
    except (TypeError, ValueError, OverflowError) as error:
        raise wrong from error


def parse_column_selection(column_choice: Any, headings: Collection[str]) -> ColumnSelection:
    """Parse the selection of a column.

    Parameters
    ----------
    column_choice : str or sequence
        Column selection. The selection is a sequence of heading, units, scale and offset, or a
        string such as ``lp (um) * 0.1 + 5``. The units in brackets are optional, even if the
        heading in the file contains units.
    headings : collection of str
        Headings of the file.

    Returns
    -------
    ColumnSelection
        Selected column.

    Raises
    ------
    InvalidValue
        If the selection is neither a string nor a sequence, or if the heading is too long.
    """
    if not isinstance(column_choice, str):
        return _parse_column_selection_tuple(column_choice)
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
    return ColumnSelection(heading, units, scale, offset)


@add_former_member_names
class Column(NamedTuple):
    """Column of a table.

    Parameters
    ----------
    values : ndarray
        Values of the column, as an array of shape (rows,). Empty fields are NaN.
    units : str
        Units of the values.
    one_based_column_number : int, default: 0
        Number of the column in the file, counted from 1.
    line_numbers : ndarray, optional
        Line number of each value in the file.
    file_path : str, default: ""
        Path of the file. The string is empty if the column does not come from a file.
    """

    values: np.ndarray
    units: str
    one_based_column_number: int = 0
    line_numbers: np.ndarray = np.empty(0, dtype=int)
    file_path: str = ""

    def format_location_of_row(self, row_index: int) -> str:
        """Return the location of a value for error messages.

        Parameters
        ----------
        row_index : int
            Index of the value.

        Returns
        -------
        str
            File, line and column of the value, or the number of the sample.
        """
        if not self.file_path:
            return f"sample {row_index + 1}"
        return (
            f"{self.file_path}, line {self.line_numbers[row_index]}, column "
            f"{self.one_based_column_number}"
        )

    def raise_for_invalid_values(
        self, quantity_name: str, invalid_mask: np.ndarray, rule: str
    ) -> None:
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
                self.format_location_of_row(row)
            )
