"""Names of unsupported file formats, and remedies for error messages."""

from __future__ import annotations

from typing import NoReturn

from rsfstudy.errors import DataError
from rsfstudy.rig.readers.tables_from_files_or_objects import TableSource

_ADVICE_TO_READ_IN_PYTHON = "Read the file in Python, and pass a mapping of arrays or a DataFrame"
_ADVICE_TO_EXPORT_AS_CSV = "Export the table as a CSV file"
#: Names and remedies of unsupported formats, indexed by the first bytes of a file.
_FORMAT_AND_ADVICE_BY_FILE_SIGNATURE = {
    b"\x93NUMPY": ("a file of NumPy", f"{_ADVICE_TO_READ_IN_PYTHON}: numpy.load."),
    b"PAR1": ("a Parquet file", f"{_ADVICE_TO_READ_IN_PYTHON}: pandas.read_parquet."),
    b"ARROW1": ("a Feather file", f"{_ADVICE_TO_READ_IN_PYTHON}: pandas.read_feather."),
    b"SQLite format 3": ("a SQLite database", f"{_ADVICE_TO_READ_IN_PYTHON}: pandas.read_sql."),
    b"\x80\x04\x95": (
        "a pickle",
        f"{_ADVICE_TO_READ_IN_PYTHON}, if you trust its author: pandas.read_pickle.",
    ),
    b"\x80\x05\x95": (
        "a pickle",
        f"{_ADVICE_TO_READ_IN_PYTHON}, if you trust its author: pandas.read_pickle.",
    ),
    b"PK\x03\x04": ("a zip archive", "Unpack the archive, and read the file in it."),
    b"7z\xbc\xaf": ("a 7z archive", "Unpack the archive, and read the file in it."),
    b"Rar!": ("a RAR archive", "Unpack the archive, and read the file in it."),
    b"(\xb5/\xfd": ("compressed by Zstandard", "Decompress it: zstd -d FILE."),
    b"\x1f\x8b": ("compressed twice", "Decompress it once: gunzip FILE."),
    b"%PDF": ("a PDF document", f"{_ADVICE_TO_EXPORT_AS_CSV}."),
    b"\x89PNG": ("a PNG image", f"{_ADVICE_TO_EXPORT_AS_CSV}."),
    b"\xff\xd8\xff": ("a JPEG image", f"{_ADVICE_TO_EXPORT_AS_CSV}."),
    b"{\\rtf": ("an RTF document", f"{_ADVICE_TO_EXPORT_AS_CSV}."),
}


def is_unsupported_format(source: TableSource) -> bool:
    """Return True if the format of a file is known but unsupported.

    Parameters
    ----------
    source : TableSource
        File.

    Returns
    -------
    bool
        True if the first bytes of the file identify an unsupported format.
    """
    return source.first_bytes_of_file.startswith((*_FORMAT_AND_ADVICE_BY_FILE_SIGNATURE,))


def raise_unsupported_format_error(source: TableSource) -> NoReturn:
    """Raise an error that names the format of a file and suggests a remedy.

    Parameters
    ----------
    source : TableSource
        File.

    Raises
    ------
    DataError
        Always.
    """
    mark = next(
        mark
        for mark in _FORMAT_AND_ADVICE_BY_FILE_SIGNATURE
        if source.first_bytes_of_file.startswith(mark)
    )
    name, remedy = _FORMAT_AND_ADVICE_BY_FILE_SIGNATURE[mark]
    raise DataError(f"{source.path_or_object}: is {name}. {remedy}")
