"""Errors of readers whose libraries are not installed."""

from __future__ import annotations

from rsfstudy.errors import DataError
from rsfstudy.rig.readers.source import Source


def missing_library_error(source: Source, format_name: str, extra: str, library: str) -> DataError:
    """Return the error for a file that requires an uninstalled library.

    Parameters
    ----------
    source : Source
        File.
    format_name : str
        Name of the format with an indefinite article.
    extra : str
        Name of the optional dependency group (extra) of rsfstudy.
    library : str
        Name of the library.

    Returns
    -------
    DataError
        Error with the command that installs the library.
    """
    return DataError(
        f"{source.origin}: is {format_name}, which requires the library {library}. Install the "
        f"library: pip install 'rsfstudy[{extra}]'."
    )
