"""Readers that load tables from files or from objects in memory.

Each module of this package reads one group of file formats. A reader consists of two functions: the
first function checks if a source has the format of the reader, based on its first bytes or its
type, and the second function converts the source to a ``LazyTable``. To add a format, write the
two functions, and add them to ``FORMAT_TESTS_AND_READERS``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.rig.readers.arrays_and_netcdf import (
    is_mapping_or_dataframe,
    is_netcdf_file,
    is_record_object,
    is_xarray_dataset,
    read_columns_of_record,
    read_mapping_or_dataframe,
    read_netcdf_file,
    read_xarray_dataset,
)
from rsfstudy.rig.readers.compressed_files import decompress_file, is_compressed_file
from rsfstudy.rig.readers.matlab_files import is_matlab_file, read_matlab_file
from rsfstudy.rig.readers.spreadsheets import is_workbook, read_workbook
from rsfstudy.rig.readers.tables_from_files_or_objects import LazyTable, TableSource
from rsfstudy.rig.readers.tdms_files import is_tdms_file, read_tdms_file
from rsfstudy.rig.readers.text_files import is_text_file, read_text_file
from rsfstudy.rig.readers.unsupported_formats import (
    is_unsupported_format,
    raise_unsupported_format_error,
)
from rsfstudy.rig.readers.xlook_files import is_binary_file, read_xlook_file

#: Readers in the order in which they are tried. The first function of each pair recognises a
#: source, and the second function reads the source. A reader of compressed files returns a source
#: with the decompressed bytes.
FORMAT_TESTS_AND_READERS: list[
    tuple[Callable[[TableSource], bool], Callable[[TableSource], LazyTable | TableSource]]
] = [
    (is_record_object, read_columns_of_record),
    (is_xarray_dataset, read_xarray_dataset),
    (is_mapping_or_dataframe, read_mapping_or_dataframe),
    (is_compressed_file, decompress_file),
    (is_workbook, read_workbook),
    (is_matlab_file, read_matlab_file),
    (is_tdms_file, read_tdms_file),
    (is_netcdf_file, read_netcdf_file),
    (is_unsupported_format, raise_unsupported_format_error),
    (is_text_file, read_text_file),
    (is_binary_file, read_xlook_file),
]


def read_table_from_source(
    path_or_object: Any, *, decimal_separator: str = ".", sheet_or_group_name: str = ""
) -> LazyTable:
    """Read a table from a file or an object in any known format.

    Parameters
    ----------
    path_or_object : str, Path, mapping, pandas.DataFrame, xarray.Dataset or Record
        Path of a file, or object that contains the columns.
    decimal_separator : {".", ","}, default: "."
        Decimal separator of text files.
    sheet_or_group_name : str, default: ""
        Sheet of a workbook, or group of a TDMS file. By default, the first sheet or group is read.

    Returns
    -------
    LazyTable
        Columns of the source.

    Raises
    ------
    DataError
        If the file does not exist or cannot be read, or if its format is unknown.
    InvalidValue
        If the type of the object is not supported, or if the decimal separator is unknown.
    """
    if decimal_separator not in (".", ","):
        raise InvalidValue("decimal", decimal_separator, "is unknown", choices=(".", ","))
    return _read_with_first_matching_reader(
        TableSource(path_or_object, decimal_separator, sheet_or_group_name)
    )


def _read_with_first_matching_reader(source: TableSource) -> LazyTable:
    """Read a source with the first reader that recognises it."""
    for recognises, read in FORMAT_TESTS_AND_READERS:
        if recognises(source):
            found = read(source)
            return (
                found if isinstance(found, LazyTable) else _read_with_first_matching_reader(found)
            )
    if source.is_file:
        raise DataError(
            f"{source.path_or_object}: has an unknown format. Export the table as a CSV file."
        )
    remedy = "Pass the path of a file, a mapping of arrays, a DataFrame, a Dataset or a Record."
    raise InvalidValue("record", source.path_or_object, "is not a record", remedy=remedy)
