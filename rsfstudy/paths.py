"""Checks of paths before the file system is asked about them."""

from __future__ import annotations

import os
from pathlib import Path

from rsfstudy.errors import InvalidValue

#: Most bytes of a file name and of a path on the usual file systems.
LONGEST_NAME, LONGEST_PATH = 255, 4096


def check_path(name: str, path: str | Path) -> None:
    """Check that a file system can hold a path.

    Parameters
    ----------
    name : str
        The argument or option, for the error.
    path : str or Path

    Raises
    ------
    InvalidValue
        If the path or one of its parts is too long, or is not text.
    """
    text = str(path)
    try:
        parts = [len(os.fsencode(part)) for part in (text, *Path(text).parts)]
    except UnicodeError as error:
        raise InvalidValue(name, text, "must be a path, in characters that exist") from error
    if "\0" in text:
        raise InvalidValue(name, text, "must be a path, without the null character")
    rule = ""
    if parts[0] > LONGEST_PATH:
        rule = f"must have at most {LONGEST_PATH:,} bytes (it has {parts[0]:,})"
    elif max(parts[1:], default=0) > LONGEST_NAME:
        rule = f"must have at most {LONGEST_NAME} bytes in each part (got {max(parts[1:]):,})"
    if rule:
        raise InvalidValue(name, text, rule, remedy="Choose a shorter name.")
