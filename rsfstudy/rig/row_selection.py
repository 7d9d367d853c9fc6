"""Functions and classes that select, filter and thin the rows of a record during reading."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import FILTER_KINDS, LOW_PASS_ORDERS, Filter
from rsfstudy.rig.table_columns import Column
from rsfstudy.rig.units import (
    compute_conversion_factor,
    convert_to_si,
    find_si_factor_and_exponents,
    split_number_and_units,
)

#: Columns that may limit the rows, indexed by the exponents of their units (see the module
#: ``units``).
_COLUMN_BY_BASE_UNIT_EXPONENTS: Mapping[tuple[int, ...], str] = {
    (0, 0, 1, 0, 0): "time",
    (0, 1, 0, 0, 0): "displacement",
}
_REMEDY_FOR_INVALID_ROW_LIMIT = "Pass, for example, '100 s' or '2 mm', or a number in s."
#: Default units of columns without units.
_DEFAULT_UNITS_BY_COLUMN = {"time": "s", "displacement": "um", "slip": "um"}


@dataclass(frozen=True)
class RowSelection:
    """Options that define how the rows of a record are selected, filtered and thinned.

    Parameters
    ----------
    rows : (int, int), optional
        Numbers of the first and the last row, counted from 1. By default, all rows are read.
    begin, end : quantity, optional
        Time or load point displacement at which the selected rows begin and end, such as "100 s" or
        "2 mm". A number is a time in s.
    thin : int, default: 1
        Thinning factor. After the filter, every ``thin``-th row is kept.
    filter : str, default: ""
        Filter for friction or stress with its averaging time or corner frequency, such as
        "mean 1 s" or "butterworth_2 2 Hz".

    Raises
    ------
    InvalidValue
        If the type of an option is wrong, or if the filter is unknown.
    """

    rows: Sequence[int] | None = None
    begin: Any = None
    end: Any = None
    thin: int = 1
    filter: str = ""

    def __post_init__(self) -> None:
        """Check the row numbers and the thinning."""
        if self.rows is not None and not _is_pair_of_row_numbers(self.rows):
            rule = "must be the numbers of the first and the last row, counted from 1"
            raise InvalidValue("rows", self.rows, rule, remedy="Pass, for example, rows=(1, 5000).")
        if not isinstance(self.thin, int) or isinstance(self.thin, bool) or self.thin < 1:
            raise InvalidValue("thin", self.thin, "must be a whole number, 1 or more")
        parse_smoothing_filter(self.filter)

    def keep_rows_between_limits(
        self, columns: Mapping[str, Column]
    ) -> tuple[dict[str, Column], list[str]]:
        """Select the rows between the limits.

        Parameters
        ----------
        columns : mapping of str to Column
            Columns by name.

        Returns
        -------
        columns : dict of str to Column
            Columns with the selected rows.
        processing : list of str
            Description of the selection. The list is empty if all rows were selected.

        Raises
        ------
        InvalidValue
            If no row lies between the limits, or if a limit refers to a missing column.
        """
        count = min(len(column.values) for column in columns.values())
        first, last = (1, count) if self.rows is None else (self.rows[0], min(self.rows[1], count))
        first -= 1
        if self.begin is not None:
            first = max(first, self._find_row_index_of_limit("begin", self.begin, columns))
        if self.end is not None:
            last = min(last, self._find_row_index_of_limit("end", self.end, columns))
        if first >= last:
            stated = {"rows": self.rows, "begin": self.begin, "end": self.end}
            stated = {key: value for key, value in stated.items() if value is not None}
            rule = f"must select at least one row of the record, which has {count:,} rows"
            raise InvalidValue(" and ".join(map(repr, stated)), stated, rule)
        if (first, last) == (0, count):
            return dict(columns), []
        kept = slice(first, last)
        cut = {
            name: of._replace(values=of.values[kept], line_numbers=of.line_numbers[kept])
            for name, of in columns.items()
        }
        return cut, [f"rows {first + 1} to {last} of {count}"]

    def _find_row_index_of_limit(
        self, limit_name: str, limit: Any, columns: Mapping[str, Column]
    ) -> int:
        """Convert a limit to the index of the first row, or to the end index."""
        if isinstance(limit, bool) or not isinstance(limit, int | float | str):
            raise InvalidValue(
                limit_name,
                limit,
                "is neither a time nor a displacement",
                remedy=_REMEDY_FOR_INVALID_ROW_LIMIT,
            )
        text = limit if isinstance(limit, str) else f"{limit!r} s"
        size = find_si_factor_and_exponents(split_number_and_units(text)[1])
        key = _COLUMN_BY_BASE_UNIT_EXPONENTS.get(size[1]) if size else None
        if key is None:
            raise InvalidValue(
                limit_name,
                limit,
                "is neither a time nor a displacement",
                remedy=_REMEDY_FOR_INVALID_ROW_LIMIT,
            )
        if key == "displacement" and key not in columns:
            key = "slip"
        if key not in columns:
            rule = f"requires the column {key.replace('slip', 'displacement')}"
            raise InvalidValue(
                limit_name, limit, rule, remedy="To select rows by number, pass rows=(first, last)."
            )
        column = columns[key]
        si = "s" if key == "time" else "m"
        units = column.units or _DEFAULT_UNITS_BY_COLUMN[key]
        value = convert_to_si(limit_name, text, si) / float(
            compute_conversion_factor(key, units, si)
        )
        inside = column.values >= value if limit_name == "begin" else column.values <= value
        if not inside.any():
            rule = (
                f"is outside the record, which covers {column.values[0]:g} to "
                f"{column.values[-1]:g} {units}"
            )
            raise InvalidValue(limit_name, limit, rule)
        if limit_name == "begin":
            return int(np.argmax(inside))
        return len(inside) - int(np.argmax(inside[::-1]))

    def filter_and_thin_columns(
        self, columns: Mapping[str, np.ndarray], filtered_column_names: Sequence[str]
    ) -> tuple[dict[str, np.ndarray], list[str]]:
        """Filter friction or stress, and keep only one of every ``thin`` rows.

        Parameters
        ----------
        columns : mapping of str to ndarray
            Columns by name. If a filter is applied, the column ``time`` is in s.
        filtered_column_names : sequence of str
            Names of the columns to filter.

        Returns
        -------
        columns : dict of str to ndarray
            Filtered and thinned columns. Rows whose averaging interval extends beyond the record
            are removed.
        processing : list of str
            Descriptions of the filter and of the thinning.

        Raises
        ------
        InvalidValue
            If the record has no time, or if the filter is not compatible with the sampling
            intervals.
        """
        found, processing = dict(columns), []
        if chosen := parse_smoothing_filter(self.filter):
            if "time" not in found:
                remedy = "Omit the filter."
                raise InvalidValue(
                    "filter", self.filter, "requires the column 'time'", remedy=remedy
                )
            time = found["time"]
            kept = chosen.find_fully_averaged_rows(time)
            found |= {
                name: chosen.filter_recorded_values(time, found[name])
                for name in filtered_column_names
            }
            found = {name: values[kept] for name, values in found.items()}
            processing.append(f"{' and '.join(filtered_column_names)} filtered by {self.filter}")
        if self.thin > 1:
            found = {name: values[:: self.thin].copy() for name, values in found.items()}
            processing.append(f"one of every {self.thin} rows")
        return found, processing


def _is_pair_of_row_numbers(rows: Any) -> bool:
    """Return True if a value is a pair of increasing positive integers."""
    if not isinstance(rows, list | tuple) or len(rows) != 2:
        return False
    is_integer = all(isinstance(row, int) and not isinstance(row, bool) for row in rows)
    return is_integer and 1 <= rows[0] <= rows[1]


def parse_smoothing_filter(filter_text: str) -> Filter | None:
    """Create a filter from a string with units.

    Parameters
    ----------
    filter_text : str
        Kind of filter, and averaging time or corner frequency, such as "mean 1 s" or
        "butterworth_2 2 Hz".

    Returns
    -------
    Filter or None
        Filter, or None if the string is empty.

    Raises
    ------
    InvalidValue
        If the kind is unknown, or if the units are not units of time or frequency.
    """
    if not filter_text:
        return None
    kind, _, size = str(filter_text).partition(" ")
    if kind not in FILTER_KINDS:
        remedy = "Pass, for example, 'mean 1 s' or 'butterworth_2 2 Hz'."
        raise InvalidValue("filter", filter_text, "is unknown", choices=FILTER_KINDS, remedy=remedy)
    if not size:
        what = "a corner frequency" if kind in LOW_PASS_ORDERS else "an averaging time"
        example = "2 Hz" if kind in LOW_PASS_ORDERS else "1 s"
        rule = f"must contain {what} after the filter type"
        raise InvalidValue(
            "filter", filter_text, rule, remedy=f"Pass, for example, '{kind} {example}'."
        )
    number = convert_to_si("filter", size, "1/s" if kind in LOW_PASS_ORDERS else "s")
    if not 0.0 < number < math.inf:
        raise InvalidValue("filter", filter_text, "must have a positive size")
    return Filter(kind, number)
