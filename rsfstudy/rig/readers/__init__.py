"""Readers of tables in files and in memory.

Each module of this package reads one group of file formats. A reader consists of two functions: the
first function checks if a source has the format of the reader, based on its first bytes or its
type, and the second function converts the source to a ``Table``. To add a format, write the two
functions, and add them to ``READERS``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.rig.readers.arrays import (
    is_arrays,
    is_dataset,
    is_netcdf,
    is_record,
    read_arrays,
    read_columns_of_record,
    read_dataset,
    read_netcdf,
)
from rsfstudy.rig.readers.compressed_files import decompress, is_compressed
from rsfstudy.rig.readers.matlab_files import is_matlab, read_matlab
from rsfstudy.rig.readers.source import Source, Table
from rsfstudy.rig.readers.spreadsheets import is_workbook, read_workbook
from rsfstudy.rig.readers.tdms_files import is_tdms, read_tdms
from rsfstudy.rig.readers.text_files import is_text, read_text
from rsfstudy.rig.readers.unknown_files import is_known_but_unreadable, refuse_format
from rsfstudy.rig.readers.xlook_files import is_binary, read_xlook

#: Readers in the order in which they are tried. The first function of each pair recognises a
#: source, and the second function reads the source. A reader of compressed files returns a source
#: with the decompressed bytes.
READERS: list[tuple[Callable[[Source], bool], Callable[[Source], Table | Source]]] = [
    (is_record, read_columns_of_record),
    (is_dataset, read_dataset),
    (is_arrays, read_arrays),
    (is_compressed, decompress),
    (is_workbook, read_workbook),
    (is_matlab, read_matlab),
    (is_tdms, read_tdms),
    (is_netcdf, read_netcdf),
    (is_known_but_unreadable, refuse_format),
    (is_text, read_text),
    (is_binary, read_xlook),
]


def read_source(origin: Any, *, decimal: str = ".", sheet: str = "") -> Table:
    """Read a table from a file or an object in any known format.

    Parameters
    ----------
    origin : str, Path, mapping, pandas.DataFrame, xarray.Dataset or Record
        Path of a file, or object that contains the columns.
    decimal : {".", ","}, default: "."
        Decimal separator of text files.
    sheet : str, default: ""
        Sheet of a workbook, or group of a TDMS file. By default, the first sheet or group is read.

    Returns
    -------
    Table
        Columns of the source.

    Raises
    ------
    DataError
        If the file does not exist or cannot be read, or if its format is unknown.
    InvalidValue
        If the type of the object is not supported, or if the decimal separator is unknown.
    """
    if decimal not in (".", ","):
        raise InvalidValue("decimal", decimal, "is unknown", choices=(".", ","))
    return _read(Source(origin, decimal, sheet))


def _read(source: Source) -> Table:
    """Read a source with the first reader that recognises it."""
    for recognises, read in READERS:
        if recognises(source):
            found = read(source)
            return found if isinstance(found, Table) else _read(found)
    if source.is_file:
        raise DataError(f"{source.origin}: has an unknown format. Export the table as a CSV file.")
    remedy = "Pass the path of a file, a mapping of arrays, a DataFrame, a Dataset or a Record."
    raise InvalidValue("record", source.origin, "is not a record", remedy=remedy)
