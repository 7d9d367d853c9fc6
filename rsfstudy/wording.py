"""Formatting of numbers, lists and settings as text, for tables, titles and messages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

#: Most values of a list that are shown.
_MOST_SHOWN = 8
#: Numbers of more digits than a reader wants.
_LONG = re.compile(r"(?<![\w.])\d+\.\d{6,}(?:e[+-]?\d+)?")


def flags_of(attributes: Mapping[str, Any]) -> dict[float, str]:
    """Return the meaning of each flag value, from CF attributes.

    The mapping is empty for a variable without flags.
    """
    words = str(attributes.get("flag_meanings", "")).split()
    return dict(zip(np.ravel(attributes.get("flag_values", [])).tolist(), words, strict=False))


def is_list(value: Any) -> bool:
    """True of several values, which an axis lays out."""
    if isinstance(value, np.ndarray):
        return value.ndim == 1
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def settings(overrides: Mapping[str, Any]) -> str:
    """Overrides as one types them, long lists and numbers cut short."""
    texts = {
        name: value if isinstance(value, list) else [value] for name, value in overrides.items()
    }
    told = ", ".join(f"{name}={listed(values)}" for name, values in texts.items())
    return _LONG.sub(lambda found: short(float(found[0])), told)


def listed(values: Sequence[Any], between: str = ",") -> str:
    """Values one after the other, long lists cut short."""
    shown = [short(value) for value in values]
    return between.join(shown if len(shown) <= _MOST_SHOWN else [*shown[:3], "...", shown[-1]])


def counted(count: int, noun: str) -> str:
    """How many there are, as in "1 cell"."""
    return f"{count:,} {noun}{'s' * (count != 1)}"


def short(value: Any) -> str:
    """A value with the digits a reader wants."""
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)


def stated(fields: Mapping[str, Any]) -> str:
    """Fields that have a value, with it."""
    return ", ".join(f"{n} = {short(value)}" for n, value in fields.items() if value is not None)
