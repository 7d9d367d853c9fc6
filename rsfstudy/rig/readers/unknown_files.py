"""Names of unsupported file formats, and remedies for error messages."""

from __future__ import annotations

from typing import NoReturn

from rsfstudy.errors import DataError
from rsfstudy.rig.readers.source import Source

_READ_IT = "Read the file in Python, and pass a mapping of arrays or a DataFrame"
_EXPORT_IT = "Export the table as a CSV file"
#: Names and remedies of unsupported formats, indexed by the first bytes of a file.
_FORMATS = {
    b"\x93NUMPY": ("a file of NumPy", f"{_READ_IT}: numpy.load."),
    b"PAR1": ("a Parquet file", f"{_READ_IT}: pandas.read_parquet."),
    b"ARROW1": ("a Feather file", f"{_READ_IT}: pandas.read_feather."),
    b"SQLite format 3": ("a SQLite database", f"{_READ_IT}: pandas.read_sql."),
    b"\x80\x04\x95": ("a pickle", f"{_READ_IT}, if you trust its author: pandas.read_pickle."),
    b"\x80\x05\x95": ("a pickle", f"{_READ_IT}, if you trust its author: pandas.read_pickle."),
    b"PK\x03\x04": ("a zip archive", "Unpack the archive, and read the file in it."),
    b"7z\xbc\xaf": ("a 7z archive", "Unpack the archive, and read the file in it."),
    b"Rar!": ("a RAR archive", "Unpack the archive, and read the file in it."),
    b"(\xb5/\xfd": ("compressed by Zstandard", "Decompress it: zstd -d FILE."),
    b"\x1f\x8b": ("compressed twice", "Decompress it once: gunzip FILE."),
    b"%PDF": ("a PDF document", f"{_EXPORT_IT}."),
    b"\x89PNG": ("a PNG image", f"{_EXPORT_IT}."),
    b"\xff\xd8\xff": ("a JPEG image", f"{_EXPORT_IT}."),
    b"{\\rtf": ("an RTF document", f"{_EXPORT_IT}."),
}


def is_known_but_unreadable(source: Source) -> bool:
    """Return True if the format of a file is known but unsupported.

    Parameters
    ----------
    source : Source
        File.

    Returns
    -------
    bool
        True if the first bytes of the file identify an unsupported format.
    """
    return source.signature.startswith((*_FORMATS,))


def refuse_format(source: Source) -> NoReturn:
    """Raise an error that names the format of a file and suggests a remedy.

    Parameters
    ----------
    source : Source
        File.

    Raises
    ------
    DataError
        Always.
    """
    mark = next(mark for mark in _FORMATS if source.signature.startswith(mark))
    name, remedy = _FORMATS[mark]
    raise DataError(f"{source.origin}: is {name}. {remedy}")
