"""Error that readers raise if a required library is not installed."""

from __future__ import annotations

from rsfstudy.errors import DataError
from rsfstudy.rig.readers.tables_from_files_or_objects import TableSource


def build_missing_library_error(
    source: TableSource, format_name: str, pip_extra_name: str, library_name: str
) -> DataError:
    """Return the error for a file that requires an uninstalled library.

    Parameters
    ----------
    source : TableSource
        File.
    format_name : str
        Name of the format with an indefinite article.
    pip_extra_name : str
        Name of the optional dependency group (extra) of rsfstudy.
    library_name : str
        Name of the library.

    Returns
    -------
    DataError
        Error with the command that installs the library.
    """
    return DataError(
        f"{source.path_or_object}: is {format_name}, which requires the library "
        f"{library_name}. Install the "
        f"library: pip install 'rsfstudy[{pip_extra_name}]'."
    )
