"""Function that validates a path before the file system is accessed."""

from __future__ import annotations

from pathlib import Path

from rsfstudy.errors import InvalidValue

#: Maximum number of bytes of a file name and of a path on common file systems.
MAX_NAME_BYTES, MAX_PATH_BYTES = 255, 4096


def check_path_is_valid(argument_name: str, path: str | Path) -> Path:
    """Check that a path is valid, even if no file or directory exists there.

    Parameters
    ----------
    argument_name : str
        Name of the argument or option, for the error message.
    path : str or Path
        Path of a file or directory.

    Returns
    -------
    Path
        The path as a ``Path`` object.

    Raises
    ------
    InvalidValue
        If the path is empty, cannot be encoded, or is rejected by the operating system, or if the
        path or one of its components is too long.
    """
    text = str(path)
    if not text:
        remedy = 'Pass the path of a file or a directory. To use the current directory, pass ".".'
        raise InvalidValue(argument_name, text, "is empty", remedy=remedy)
    try:
        parts = [len(part.encode()) for part in (text, *Path(text).parts)]
    except UnicodeError as error:  # NetCDF files cannot store such a path
        raise InvalidValue(
            argument_name, text, "must be a string that can be encoded as UTF-8"
        ) from error
    if "\0" in text:
        raise InvalidValue(argument_name, text, "must be a path without the null character")
    rule = ""
    if parts[0] > MAX_PATH_BYTES:
        rule = f"must have at most {MAX_PATH_BYTES:,} bytes (it has {parts[0]:,})"
    elif max(parts[1:], default=0) > MAX_NAME_BYTES:
        rule = f"must have at most {MAX_NAME_BYTES} bytes in each part (got {max(parts[1:]):,})"
    if rule:
        raise InvalidValue(argument_name, text, rule, remedy="Choose a shorter name.")
    try:
        Path(path).exists()
    except OSError as error:
        raise InvalidValue(argument_name, text, f"cannot be used: {error.strerror}") from error
    return Path(path)
