"""Reader of binary xlook files."""

from __future__ import annotations

import numpy as np

from rsfstudy.errors import DataError
from rsfstudy.rig.readers.tables_from_files_or_objects import (
    LazyTable,
    TableSource,
    append_units_to_headings,
)
from rsfstudy.rig.table_columns import Column

#: Layout of xlook files. The constants are the size of the file header in bytes, the size of each
#: column header in bytes, and the number of column headers. The data of an xlook file follow the
#: headers.
_HEADER_BYTES, _COLUMN_HEADER_BYTES, _MAX_COLUMNS = 36, 84, 32
_DATA_START_BYTE = _HEADER_BYTES + _COLUMN_HEADER_BYTES * _MAX_COLUMNS
#: List of supported formats for the error message about other formats.
_READABLE_FORMATS_FOR_MESSAGE = "text, Excel, MATLAB, TDMS, NetCDF and xlook"


def is_binary_file(source: TableSource) -> bool:
    """Return True if the beginning of a file contains a null byte.

    The xlook format has no signature. For this reason, all other binary formats must be tested
    before this function is called.

    Parameters
    ----------
    source : TableSource
        File.

    Returns
    -------
    bool
        True if the file may be an xlook file.
    """
    return b"\0" in source.first_bytes_of_file[:_DATA_START_BYTE]


def read_xlook_file(source: TableSource) -> LazyTable:
    """Read a binary xlook file.

    The file is big-endian. The file contains a file header, column headers of 84 bytes each, and
    one float32 array per column. In xlook files, the column named ``time`` contains sampling
    intervals instead of times. The function replaces this column by the cumulative sum of the
    intervals.

    Parameters
    ----------
    source : TableSource
        Binary file.

    Returns
    -------
    LazyTable
        Columns of the file, with the units in the file.

    Raises
    ------
    DataError
        If the file is not an xlook file, or if the file is truncated.
    """
    data, path = source.read_all_bytes(), source.path_or_object
    used = int.from_bytes(data[24:28], "big")
    if not 0 < used <= _MAX_COLUMNS:
        raise DataError(
            f"{path}: has an unknown binary format. Formats that can be read: "
            f"{_READABLE_FORMATS_FOR_MESSAGE}. "
            "Export the table as a CSV file. If the file were an xlook file, it would have "
            f"{used} columns."
        )
    if len(data) < _DATA_START_BYTE:
        raise DataError(f"{path}: ends within the headers of an xlook file")
    names, units, columns, begin = [], [], [], _DATA_START_BYTE
    for number in range(used):
        start = _HEADER_BYTES + _COLUMN_HEADER_BYTES * number
        header = data[start : start + _COLUMN_HEADER_BYTES]
        name, unit = (
            part.split(b"\0")[0].decode("ascii", "replace").strip()
            for part in (header[:13], header[13:26])
        )
        count = int.from_bytes(header[80:84], "big")
        if begin + 4 * count > len(data):
            raise DataError(f"{path}: ends within column {number + 1}, {name!r}")
        names.append(name)
        units.append(unit)
        columns.append((begin, count))
        begin += 4 * count

    # The last sample of a column may be missing.
    longest = max(count for _start, count in columns)
    common = min(count for _start, count in columns if count >= longest - 1)

    def load(index: int, quantity_name: str) -> Column:
        start, count = columns[index]
        values = np.frombuffer(data, ">f4", min(count, common), start).astype(float)
        values = np.cumsum(values) if quantity_name == "time" else values
        return Column(values, "", index + 1)

    return LazyTable(append_units_to_headings(names, units), str(path), load)
