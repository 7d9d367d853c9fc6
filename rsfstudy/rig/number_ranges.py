"""Ranges of numbers with units."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.rig.units import parse_number

_RANGE_SYNTAX_RULE = (
    "must contain a range of the form start:stop:count, where start and stop are finite numbers "
    "and count is a whole number"
)
_LOG_RANGE_SYNTAX_REMEDY = (
    "For logarithmic spacing, append :log, for example hold_time=1:1e5:30:log."
)
_MAX_POINTS_OF_RANGE = 1_000_000


def expand_range(
    argument_name: str, argument_text: str, range_text: str
) -> list[float] | list[str]:
    """Expand a range such as "1:100:20:log" to a list of numbers.

    Parameters
    ----------
    argument_name : str
        Name of the argument for error messages.
    argument_text : str
        Complete argument, for error messages.
    range_text : str
        Range as ``first:last:count`` or ``first:last:count:log``, optionally followed by units.

    Returns
    -------
    list of float or list of str
        Numbers, or strings with units if the range has units.

    Raises
    ------
    InvalidValue
        If the string is not a range.
    """
    *before, last = range_text.split(":")
    last, _, units = last.strip().partition(" ")
    found = _expand_range_without_units(argument_name, argument_text, [*before, last])
    return [f"{number!r} {units.strip()}" for number in found] if units.strip() else found


def _expand_range_without_units(
    argument_name: str, argument_text: str, range_parts: Sequence[str]
) -> list[float]:
    spacing = range_parts[3].strip().lower() if len(range_parts) == 4 else ""
    first, last, points = map(
        parse_number, range_parts[:3] if len(range_parts) in (3, 4) else ["", "", ""]
    )
    if first is None or last is None or points is None or spacing not in ("", "log"):
        raise InvalidValue(
            argument_name, argument_text, _RANGE_SYNTAX_RULE, remedy=_LOG_RANGE_SYNTAX_REMEDY
        )
    finite = math.isfinite(first) and math.isfinite(last)
    if not finite or points not in range(1, _MAX_POINTS_OF_RANGE + 1):
        raise InvalidValue(
            argument_name,
            argument_text,
            f"{_RANGE_SYNTAX_RULE} from 1 to {_MAX_POINTS_OF_RANGE:,}",
        )
    if spacing and min(first, last) <= 0.0:
        remedy = "Use positive values, or remove :log."
        raise InvalidValue(
            argument_name,
            argument_text,
            "must have positive start and stop values for logarithmic spacing",
            remedy=remedy,
        )
    laid = np.geomspace if spacing else np.linspace
    return [float(x) for x in laid(first, last, int(points))]
