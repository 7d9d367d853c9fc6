"""Reader that loads tables from Excel and OpenDocument workbooks."""

from __future__ import annotations

import importlib.util
import io
import math
import zipfile
from typing import Any

import numpy as np
import pandas as pd

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.rig.readers.missing_libraries import build_missing_library_error
from rsfstudy.rig.readers.tables_from_files_or_objects import LazyTable, TableSource
from rsfstudy.rig.readers.text_layout import detect_text_layout
from rsfstudy.rig.table_columns import EXAMPLE_OF_TABLE_HEADER, Column
from rsfstudy.rig.units import parse_number

_ZIP_SIGNATURE, _OLE_SIGNATURE = b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
#: Names of files that identify a zip archive as a workbook.
_ZIP_MEMBERS_OF_WORKBOOKS = ("xl/workbook.xml", "xl/workbook.bin", "content.xml")
#: Libraries that read workbooks, and the names of the corresponding pandas engines.
_PANDAS_ENGINE_BY_LIBRARY = {"python_calamine": "calamine", "openpyxl": "openpyxl"}
#: File name extensions of workbooks. The extension identifies a workbook if the zip archive is
#: damaged.
_WORKBOOK_FILE_SUFFIXES = (".xlsx", ".xlsm", ".xlsb", ".ods")
#: Maximum number of bytes of an unpacked workbook.
_MAX_UNPACKED_WORKBOOK_BYTES = 2**31
#: Number of rows at the beginning of a sheet that are searched for the header.
_MAX_ROWS_SEARCHED_FOR_HEADER = 1000
#: Character that joins the cells of a row to a line of text for the detection of the header.
_CELL_SEPARATOR = "\t"


def is_workbook(source: TableSource) -> bool:
    """Return True if the file is a workbook.

    Parameters
    ----------
    source : TableSource
        File.

    Returns
    -------
    bool
        True if the file is an Excel or OpenDocument workbook.
    """
    if source.first_bytes_of_file.startswith(_OLE_SIGNATURE):
        return True
    if not source.first_bytes_of_file.startswith(_ZIP_SIGNATURE):
        return False
    files = [name for name, _size in _list_zip_members_and_sizes(source)]
    return bool({*files} & {*_ZIP_MEMBERS_OF_WORKBOOKS}) or (
        not files and source.path.suffix.lower() in _WORKBOOK_FILE_SUFFIXES
    )


def read_workbook(source: TableSource) -> LazyTable:
    """Read a table from a sheet of a workbook.

    Parameters
    ----------
    source : TableSource
        Workbook. By default, the first sheet is read.

    Returns
    -------
    LazyTable
        Columns of the sheet.

    Raises
    ------
    DataError
        If no library for workbooks is installed, or if the file is damaged.
    InvalidValue
        If the workbook has no sheet with the given name.
    """
    engines = [
        engine
        for library, engine in _PANDAS_ENGINE_BY_LIBRARY.items()
        if importlib.util.find_spec(library)
    ]
    if not engines:
        raise build_missing_library_error(source, "an Excel workbook", "excel", "python-calamine")
    if (
        sum(size for _name, size in _list_zip_members_and_sizes(source))
        > _MAX_UNPACKED_WORKBOOK_BYTES
    ):
        raise DataError(
            f"{source.path_or_object}: unpacks to more than {_MAX_UNPACKED_WORKBOOK_BYTES:,} bytes"
        )
    try:
        engine: Any = engines[0]
        book = pd.ExcelFile(io.BytesIO(source.read_all_bytes()), engine=engine)
    except Exception as error:  # The libraries raise errors of many types.
        raise DataError(
            f"{source.path_or_object}: cannot be read as a workbook ({error})"
        ) from error
    with book:
        names = [*map(str, book.sheet_names)]
        if source.sheet_or_group_name and source.sheet_or_group_name not in names:
            raise InvalidValue(
                "sheet", source.sheet_or_group_name, "is not a sheet of the workbook", choices=names
            )
        sheet = source.sheet_or_group_name or names[0]
        try:
            cells = pd.read_excel(book, sheet_name=sheet, header=None)
        except Exception as error:
            raise DataError(
                f"{source.path_or_object}: cannot read sheet {sheet!r} ({error})"
            ) from error
    return _build_table_of_cells(
        cells, f"{source.path_or_object}, sheet {sheet!r}", source.decimal_separator
    )


def _list_zip_members_and_sizes(source: TableSource) -> list[tuple[str, int]]:
    """Return the names and the unpacked sizes of the files in a zip archive.

    The list is empty if the file is damaged or is not a zip archive.
    """
    if not source.first_bytes_of_file.startswith(_ZIP_SIGNATURE):
        return []
    try:
        with zipfile.ZipFile(io.BytesIO(source.read_all_bytes())) as archive:
            return [(file.filename, file.file_size) for file in archive.infolist()]
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return []


def _build_table_of_cells(
    cells: pd.DataFrame, sheet_description: str, decimal_separator: str
) -> LazyTable:
    """Detect the header in the cells of a sheet, and build a table of the cells below it."""
    cells = cells.dropna(axis="columns", how="all")
    numbers = cells.columns.to_numpy() + 1
    lines = [
        _CELL_SEPARATOR.join(
            "" if cell is None or cell != cell else _format_cell_on_one_line(cell) for cell in row
        )
        for row in cells.head(_MAX_ROWS_SEARCHED_FOR_HEADER).itertuples(index=False)
    ]
    layout = detect_text_layout([f"sep={_CELL_SEPARATOR}", *lines], decimal_separator)
    if not layout.headings:
        remedy = (
            "Add a first row with a heading for each column. In each heading, write the "
            f"units in parentheses after the name, for example {EXAMPLE_OF_TABLE_HEADER}."
        )
        raise InvalidValue("table", sheet_description, "has no header", remedy=remedy)
    # The line with the separator comes before the cells.
    body = cells.iloc[layout.first_line_number_after_header - 2 :]
    body = body[~body.isna().all(axis="columns")]
    rows = body.index.to_numpy() + 1

    def load(index: int, quantity_name: str) -> Column:
        column = Column(np.empty(0), "", int(numbers[index]), rows, sheet_description)
        values = body.iloc[:, index]
        if values.dtype.kind in "fiu":
            return column._replace(values=values.to_numpy(dtype=float))
        found = [
            _convert_cell_to_number(cell, quantity_name, column, n) for n, cell in enumerate(values)
        ]
        return column._replace(values=np.array(found))

    has_headings = layout.header_line_number > 0
    location = (
        f"{sheet_description}, line {layout.header_line_number - 1}"
        if has_headings
        else sheet_description
    )
    return LazyTable(layout.headings, location, load, has_headings)


def _format_cell_on_one_line(cell: object) -> str:
    return " ".join(str(cell).split())


def _convert_cell_to_number(cell: Any, quantity_name: str, column: Column, row_index: int) -> float:
    if cell is None or cell != cell or cell == "":
        return math.nan
    number = cell if isinstance(cell, int | float) else parse_number(str(cell).replace(",", "."))
    if number is None or not math.isfinite(number):
        remedy = "Format the cells of the column as numbers."
        wrong = InvalidValue(quantity_name, str(cell), "is not a number", remedy=remedy)
        raise wrong.with_location(column.format_location_of_row(row_index))
    return float(number)
