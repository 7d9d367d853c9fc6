"""Formatting of numbers, lists and settings as text, for tables, titles and messages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

#: Most values of a list that are shown.
_MAX_LISTED_VALUES = 8
#: Numbers of more digits than a reader wants.
_LONG_DECIMAL_NUMBER_PATTERN = re.compile(r"(?<![\w.])\d+\.\d{6,}(?:e[+-]?\d+)?")


def read_flag_meanings(attributes: Mapping[str, Any]) -> dict[float, str]:
    """Return the meaning of each flag value, from CF attributes.

    The mapping is empty for a variable without flags.
    """
    words = str(attributes.get("flag_meanings", "")).split()
    return dict(zip(np.ravel(attributes.get("flag_values", [])).tolist(), words, strict=False))


def is_sequence_of_axis_values(value: Any) -> bool:
    """True of several values, which an axis lays out."""
    if isinstance(value, np.ndarray):
        return value.ndim == 1
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def format_overrides(overrides: Mapping[str, Any]) -> str:
    """Overrides as one types them, long lists and numbers cut short."""
    texts = {
        name: value if isinstance(value, list) else [value] for name, value in overrides.items()
    }
    told = ", ".join(f"{name}={format_list(values)}" for name, values in texts.items())
    return _LONG_DECIMAL_NUMBER_PATTERN.sub(lambda found: format_value(float(found[0])), told)


def format_list(values: Sequence[Any], separator: str = ",") -> str:
    """Values one after the other, long lists cut short."""
    shown = [format_value(value) for value in values]
    return separator.join(
        shown if len(shown) <= _MAX_LISTED_VALUES else [*shown[:3], "...", shown[-1]]
    )


def pluralize(count: int, noun: str) -> str:
    """How many there are, as in "1 cell"."""
    return f"{count:,} {noun}{'s' * (count != 1)}"


def format_value(value: Any) -> str:
    """A value with the digits a reader wants."""
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)


def format_nonempty_fields(fields: Mapping[str, Any]) -> str:
    """Fields that have a value, with it."""
    return ", ".join(
        f"{n} = {format_value(value)}" for n, value in fields.items() if value is not None
    )
