"""Functions that format numbers, lists and settings for tables and messages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

#: Maximum length of a list that is printed without abbreviation.
_MAX_LISTED_VALUES = 8
#: Pattern of decimal numbers with at least six decimal places. These numbers are rounded in titles
#: and messages.
_LONG_DECIMAL_NUMBER_PATTERN = re.compile(r"(?<![\w.])\d+\.\d{6,}(?:e[+-]?\d+)?")


def read_flag_meanings(variable_attributes: Mapping[str, Any]) -> dict[float, str]:
    """Read the mapping from flag values to their meanings from CF attributes.

    Parameters
    ----------
    variable_attributes : mapping of str to object
        Attributes of a variable.

    Returns
    -------
    dict of float to str
        Meanings by flag value. The dictionary is empty for a variable without flags.
    """
    words = str(variable_attributes.get("flag_meanings", "")).split()
    return dict(
        zip(np.ravel(variable_attributes.get("flag_values", [])).tolist(), words, strict=False)
    )


def is_sequence_of_axis_values(value: Any) -> bool:
    """Return True if a value is a sequence that can define the points of an axis.

    Parameters
    ----------
    value : object
        Value of an override.

    Returns
    -------
    bool
        True for one-dimensional arrays and for sequences other than strings and bytes.
    """
    if isinstance(value, np.ndarray):
        return value.ndim == 1
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def format_overrides(overrides: Mapping[str, Any]) -> str:
    """Format overrides in the syntax of the command line.

    Long lists are abbreviated, and long decimal numbers are rounded to six significant digits.

    Parameters
    ----------
    overrides : mapping of str to object
        Value or list of values of each overridden field.

    Returns
    -------
    str
        Text such as ``b_over_a=2,3, law=slip``.
    """
    texts = {
        name: value if isinstance(value, list) else [value] for name, value in overrides.items()
    }
    told = ", ".join(f"{name}={format_abbreviated_list(values)}" for name, values in texts.items())
    return _LONG_DECIMAL_NUMBER_PATTERN.sub(
        lambda found: format_number_or_text(float(found[0])), told
    )


def format_abbreviated_list(values: Sequence[Any], separator: str = ",") -> str:
    """Format a list of values, and abbreviate a long list.

    Parameters
    ----------
    values : sequence
        Values to format.
    separator : str, default: ","
        String between two values.

    Returns
    -------
    str
        All values if there are at most eight. Otherwise the first three values and the last value,
        with an ellipsis between them.
    """
    shown = [format_number_or_text(value) for value in values]
    return separator.join(
        shown if len(shown) <= _MAX_LISTED_VALUES else [*shown[:3], "...", shown[-1]]
    )


def format_count_with_noun(count: int, noun: str) -> str:
    """Format a count with a noun, such as "1 cell" or "2 cells".

    Parameters
    ----------
    count : int
        Number of objects.
    noun : str
        Singular noun. The plural is formed by adding "s".

    Returns
    -------
    str
        Count with a thousands separator, followed by the noun.
    """
    return f"{count:,} {noun}{'s' * (count != 1)}"


def format_number_or_text(value: Any) -> str:
    """Format a value as text, and round floats to six significant digits.

    Parameters
    ----------
    value : object
        Value to format.

    Returns
    -------
    str
        Formatted value.
    """
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)


def format_fields_except_none(fields: Mapping[str, Any]) -> str:
    """Format the names and values of fields, and omit fields whose value is None.

    Parameters
    ----------
    fields : mapping of str to object
        Values by field name.

    Returns
    -------
    str
        Text such as ``a = 0.01, law = slip``.
    """
    return ", ".join(
        f"{n} = {format_number_or_text(value)}" for n, value in fields.items() if value is not None
    )


def format_duration(seconds: float) -> str:
    """Format a duration with a suitable unit.

    Parameters
    ----------
    seconds : float
        Duration in s.

    Returns
    -------
    str
        Duration such as "2.5 s", "3 min 20 s" or "1 h 5 min".
    """
    if seconds < 0.05:
        return "less than 0.1 s"
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
