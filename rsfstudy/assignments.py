"""What is typed as AXIS=VALUES or AXIS=VALUE, for ``--set`` and ``--cell``."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import numpy as np

from rsfstudy.declare.study import Study
from rsfstudy.errors import InvalidValue

_SPACED = "must read start:stop:count, two finite numbers and a count"
_MOST_POINTS = 1_000_000


def overrides(study: Study, settings: tuple[str, ...]) -> dict[str, Any]:
    labels = {label for axis in study.axes for label in axis.labels or ()}
    values_by_name: dict[str, Any] = {}
    for text in settings:
        name, values = setting(text, labels)
        if name in values_by_name:
            raise InvalidValue("--set", text, f"sets {name} twice")
        values_by_name[name] = values
    return values_by_name


def place(text: str) -> tuple[str, str]:
    """One ``AXIS=VALUE``, the value as it is."""
    name, equals, value = text.partition("=")
    if not equals:
        raise InvalidValue("--cell", text, "must read AXIS=VALUE, as in b_over_a=2")
    return name, value


def setting(text: str, labels: Collection[str]) -> tuple[str, Any]:
    """One ``AXIS=VALUES``: a label, a single value, a comma list, or start:stop:count."""
    name, equals, values = text.partition("=")
    if not equals or not name.strip() or not values.strip():
        raise InvalidValue("--set", text, "must read AXIS=VALUES, as in b_over_a=2,3,4")
    if values.strip() in labels:
        return name.strip(), [values.strip()]
    parts = [part.strip() for part in values.split(",")]
    if len(parts) > 1:
        if not all(parts):
            raise InvalidValue("--set", text, "leaves a value out")
        return name.strip(), [_value(part) for part in parts]
    if values.count(":") == 2:
        return name.strip(), _spaced(text, *values.split(":"))
    if ":" in values:
        raise InvalidValue("--set", text, _SPACED)
    return name.strip(), _value(parts[0])


def _spaced(text: str, start: str, stop: str, count: str) -> list[float]:
    try:
        first, last, points = float(start), float(stop), int(count)
    except ValueError as error:
        raise InvalidValue("--set", text, _SPACED) from error
    if not (math.isfinite(first) and math.isfinite(last) and 1 <= points <= _MOST_POINTS):
        raise InvalidValue("--set", text, f"{_SPACED}, from 1 to {_MOST_POINTS:,}")
    spaced: list[float] = np.linspace(first, last, points).tolist()
    return spaced


def _value(text: str) -> Any:
    flags = {"true": True, "false": False}
    if text.lower() in flags:
        return flags[text.lower()]
    try:
        return float(text)
    except ValueError:
        return text
