"""Options and column selection that all functions for reading records share.

The functions `read_record`, `events` and `history` use different columns of a file. `read_columns`
reads the columns that one of these functions can use, from a source in any format.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

from rsfstudy.errors import CallError, InvalidValue, shorten_text
from rsfstudy.rig.readers import read_table_from_source
from rsfstudy.rig.readers.tables_from_files_or_objects import LazyTable
from rsfstudy.rig.record_column_detection import (
    AcceptedRecordColumns,
    check_column_values_are_finite,
    read_selected_and_detected_columns,
)
from rsfstudy.rig.row_selection import RowSelection
from rsfstudy.rig.table_columns import Column
from rsfstudy.rig.units import (
    compute_conversion_factor,
    convert_to_si,
    find_si_factor_and_exponents,
)

#: Exponents of the base units in a unit of force (see the module ``units``).
_BASE_UNIT_EXPONENTS_OF_FORCE = (1, 1, -2, 0, 0)
#: Columns that may contain a force instead of a stress.
_COLUMNS_THAT_MAY_CONTAIN_FORCES = ("shear_stress", "normal_stress")


@dataclass(frozen=True)
class RecordReadingOptions(RowSelection):
    """Options shared by all functions that read records.

    The class `RowSelection` describes the options that are not listed here.

    Parameters
    ----------
    decimal : {".", ","}, default: "."
        Decimal separator of a text file.
    sheet : str, default: ""
        Sheet of a workbook, or group of a TDMS file. By default, the first sheet or group is read.
    area : quantity, optional
        Area of the fault, such as "25 cm2". Forces are divided by the area.
    """

    decimal: str = "."
    sheet: str = ""
    area: Any = None

    @classmethod
    def from_keywords(cls, function_name: str, keywords: Mapping[str, Any]) -> RecordReadingOptions:
        """Create the options from the keyword arguments of a function.

        Parameters
        ----------
        function_name : str
            Name of the function for error messages.
        keywords : mapping of str to object
            Options by name.

        Returns
        -------
        RecordReadingOptions
            Validated options.

        Raises
        ------
        CallError
            If a keyword is unknown.
        InvalidValue
            If a value is invalid.
        """
        known = [field.name for field in fields(cls)]
        for name in keywords:
            if name not in known:
                close = difflib.get_close_matches(shorten_text(name), known, n=1)
                hint = "".join(f" Did you mean {each!r}?" for each in close)
                raise CallError(
                    f"{function_name}() has no parameter {shorten_text(name)!r}.{hint} The options "
                    f"of reading are {', '.join(known)}."
                )
        return cls(**keywords)


class ColumnsReadFromSource(NamedTuple):
    """Columns that were selected from a source, and the table that contains the columns.

    Parameters
    ----------
    columns_by_name : dict of str to Column
        Columns by name, with their units. All values are finite.
    source_table : LazyTable
        Table from which the columns were read.
    row_selection_descriptions : list of str
        Descriptions of the row selection that was applied.
    """

    columns_by_name: dict[str, Column]
    source_table: LazyTable
    row_selection_descriptions: list[str]


def read_columns(
    source: Any,
    selected_columns: Mapping[str, Any] | None,
    accepted_columns: AcceptedRecordColumns,
    reading_options: RecordReadingOptions,
) -> ColumnsReadFromSource:
    """Read the columns of a source that the calling function accepts.

    Parameters
    ----------
    source : str, Path, mapping, pandas.DataFrame, xarray.Dataset or Record
        Path of a file in any known format, or object that contains the columns.
    selected_columns : mapping of str to str or tuple, or None
        Heading and units of columns by name.
    accepted_columns : AcceptedRecordColumns
        Columns that the calling function can use.
    reading_options : RecordReadingOptions
        Reading options.

    Returns
    -------
    ColumnsReadFromSource
        Columns with the selected rows.

    Raises
    ------
    DataError
        If the file cannot be read.
    InvalidValue
        If a column is unknown or has no units, or if a value is not a finite number.
    """
    table = read_table_from_source(
        source, decimal_separator=reading_options.decimal, sheet_or_group_name=reading_options.sheet
    )
    found = read_selected_and_detected_columns(table, selected_columns, accepted_columns)
    found = {
        name: _convert_force_to_stress(name, column, reading_options.area)
        for name, column in found.items()
    }
    processing: list[str] = []
    if found:
        found, processing = reading_options.keep_rows_between_limits(found)
    check_column_values_are_finite(found)
    return ColumnsReadFromSource(found, table, processing)


def _convert_force_to_stress(column_name: str, column: Column, fault_area: Any) -> Column:
    """Divide a force by the area of the fault."""
    size = find_si_factor_and_exponents(column.units)
    if (
        column_name not in _COLUMNS_THAT_MAY_CONTAIN_FORCES
        or size is None
        or size[1] != _BASE_UNIT_EXPONENTS_OF_FORCE
    ):
        return column
    if fault_area is None:
        rule = "must be a stress, not a force"
        remedy = (
            "Pass the fault area, by which the force is divided: area='25 cm2' (--area '25 cm2')."
        )
        raise InvalidValue(column_name, column.units, rule, remedy=remedy)
    square_metres = convert_to_si("area", fault_area, "m2")
    if not square_metres > 0.0:
        raise InvalidValue("area", fault_area, "must be positive")
    newtons = float(compute_conversion_factor(column_name, column.units, "kg m s-2"))
    return column._replace(values=column.values * (newtons / square_metres), units="Pa")
