"""Functions that read tables of numbers with units from files.

`read_table` is the main function.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rsfstudy._deprecation import build_getattr_for_former_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.quantities import split_heading_into_name_and_units
from rsfstudy.rig.readers import read_table_from_source
from rsfstudy.rig.readers.tables_from_files_or_objects import LazyTable
from rsfstudy.rig.table_columns import (
    EXAMPLE_OF_TABLE_HEADER,
    Column,
    ColumnSelection,
    parse_column_selection,
)

__getattr__ = build_getattr_for_former_names(__name__)

#: Function that selects columns of a file. The two arguments of the function are a list of headings
#: and a description of the location of the headings.
ColumnChoosingFunction = Callable[[list[str], str], dict[str, ColumnSelection]]


@raise_only_rsfstudy_errors
def read_table(
    path: str | Path,
    columns: Mapping[str, Any] | ColumnChoosingFunction | None = None,
    *,
    decimal: str = ".",
) -> dict[str, Column]:
    r"""Read columns of a CSV file or of a text file.

    The columns may be separated by commas, semicolons, tabs or blanks. Files in other formats are
    read with the same readers as in `rsfstudy.read_record`.

    Parameters
    ----------
    path : str or Path
        Path of the file.
    columns : mapping of str to (str, str) or str, optional
        Heading and units of each column, for example ``{"time": ("t", "s")}`` or ``{"time": "t
        (s)"}``. By default, all columns are read, and the first line must contain their names and
        units, as in ``velocity (um/s), distance (um)``. You can also pass a function that takes two
        arguments: the list of headings, and a string that describes the location of the headings.
        The function must return a mapping of column names to column selections.
    decimal : {".", ","}, default: "."
        Decimal separator of a text file.

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
    table = read_table_from_source(path, decimal_separator=decimal)
    headings = dict.fromkeys(table.headings)
    wanted: Any
    if isinstance(columns, Mapping):
        wanted = {name: parse_column_selection(told, headings) for name, told in columns.items()}
    elif columns is None:
        wanted = _choose_all_columns_of_header(table)
    else:
        wanted = columns([*table.headings], table.heading_location)
    if not isinstance(wanted, Mapping):
        rule = "must be a mapping, or a function that returns one"
        raise InvalidValue("columns", columns, rule)
    return {name: table.read_column(name, spec) for name, spec in wanted.items()}


def _choose_all_columns_of_header(
    table: LazyTable,
) -> dict[str, ColumnSelection]:
    """Select all columns of a file whose header contains names and units."""
    found: dict[str, ColumnSelection] = {}
    if not table.has_headings:
        remedy = (
            "Add a first line with a heading for each column. In each heading, write the "
            f"units in parentheses after the name, for example {EXAMPLE_OF_TABLE_HEADER}."
        )
        raise InvalidValue("table", table.heading_location, "has no header", remedy=remedy)
    for n, heading in enumerate(table.headings, start=1):
        stated = split_heading_into_name_and_units(heading)
        if stated is None:
            remedy = (
                "In each heading, write the units in parentheses after the name, for "
                f"example {EXAMPLE_OF_TABLE_HEADER}."
            )
            rule = "does not consist of a name and units"
            raise InvalidValue("heading", heading, rule, remedy=remedy).with_location(
                f"{table.heading_location}, column {n}"
            )
        name, units = stated
        if name in found:
            raise InvalidValue("column", name, "occurs twice in the header").with_location(
                table.heading_location
            )
        found[name] = ColumnSelection(heading, units)
    return found
