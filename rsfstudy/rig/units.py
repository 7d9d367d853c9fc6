"""Numbers with units: the usual ones of a rig are known here, all others to pint."""

from __future__ import annotations

import importlib
import math
import re
from collections.abc import Mapping
from numbers import Real
from typing import Any

from rsfstudy.errors import InvalidValue

#: A factor to SI, and the exponents of kilogram, metre and second.
Unit = tuple[float, tuple[int, int, int]]

_STRESS, _LENGTH, _TIME = (1, -1, -2), (0, 1, 0), (0, 0, 1)
_KNOWN: Mapping[str, Unit] = {
    "1": (1.0, (0, 0, 0)),
    "kg": (1.0, (1, 0, 0)),
    **{f"{p}Pa": (x, _STRESS) for p, x in (("", 1.0), ("k", 1e3), ("M", 1e6), ("G", 1e9))},
    "bar": (1e5, _STRESS),
    "m": (1.0, _LENGTH),
    "cm": (1e-2, _LENGTH),
    "mm": (1e-3, _LENGTH),
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm", "micron"), (1e-6, _LENGTH)),
    "nm": (1e-9, _LENGTH),
    "ms": (1e-3, _TIME),
    "s": (1.0, _TIME),
    "min": (60.0, _TIME),
    "h": (3600.0, _TIME),
    "day": (86400.0, _TIME),
    "year": (365.25 * 86400.0, _TIME),
}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|nan|[-+]?inf)\s*(.*?)\s*")
_POWER = re.compile(r"(.*?[A-Za-z1\u00b5\u03bc])\s*(?:\^|\*\*)?\s*([-+]?\d+)?")
_PINT = "Install pint (pip install 'rsfstudy[units]')"


def in_si(name: str, value: Any, units: str) -> float:
    """A quantity in SI units.

    Parameters
    ----------
    name : str
        What it is the value of.
    value : float, str or pint.Quantity
        A plain number is in SI units already; a text has units, as in "5 MPa".
    units : str
        The SI units.

    Raises
    ------
    InvalidValue
        For what is no finite number, and for units that are unknown or of another kind.
    """
    if isinstance(value, str):
        number = _of_text(name, value, units)
    elif hasattr(value, "to") and hasattr(value, "magnitude"):
        number = _converted(name, value, value, units)
    elif type(value) is not bool and isinstance(value, Real):
        number = float(value)
    else:
        remedy = f"Give a number in {units}, or a text with units."
        raise InvalidValue(name, value, "is no quantity", remedy=remedy)
    if not math.isfinite(number):
        raise InvalidValue(name, value, "must be finite")
    return number


def factor(name: str, stated: str, units: str) -> float:
    """What one of the units that were stated is in SI units; raises as `in_si`."""
    return in_si(name, f"1 {stated}", units)


def _of_text(name: str, text: str, units: str) -> float:
    match = _QUANTITY.fullmatch(text)
    if not match:
        remedy = f"Write a number and its units, as in '2.5 {units}'."
        raise InvalidValue(name, text, "is no quantity", remedy=remedy)
    known, wanted = _parsed(match[2] or "1"), _parsed(units)
    if known is None:
        return _by_pint(name, text, units)
    assert wanted is not None
    if known[1] != wanted[1]:
        raise _misfit(name, text, units)
    return float(match[1]) * known[0] / wanted[0]


def _misfit(name: str, value: Any, units: str) -> InvalidValue:
    rule = f"has units of another kind than {units}"
    return InvalidValue(name, value, rule, remedy=f"Give it in {units}, or a multiple of it.")


def _parsed(units: str) -> Unit | None:
    """Units that are known here, multiplied and divided; None of others."""
    scale, exponents = 1.0, [0, 0, 0]
    for place, side in enumerate(units.split("/")):
        for text in filter(None, re.split(r"[\s.*\u00b7]+", side.replace("**", "^"))):
            match = _POWER.fullmatch(text)
            if not match or match[1] not in _KNOWN:
                return None
            power = int(match[2] or 1) * (-1 if place else 1)
            size, of = _KNOWN[match[1]]
            scale *= size**power
            exponents = [e + power * o for e, o in zip(exponents, of, strict=True)]
    return scale, (exponents[0], exponents[1], exponents[2])


def _by_pint(name: str, text: str, units: str) -> float:
    try:
        pint = importlib.import_module("pint")
    except ImportError as error:
        usual = ", ".join(n for n in _KNOWN if n not in ("1", "kg") and n.isascii())
        remedy = f"{_PINT}, write it in {usual}, or give a number in {units}."
        raise InvalidValue(
            name, text, "has units that are not known here", remedy=remedy
        ) from error
    try:
        quantity = pint.get_application_registry().Quantity(text)
    except Exception as error:  # of its own, of tokenize and of Python's parser
        remedy = f"Write it as in '2.5 {units}'."
        rule = f"has units that pint does not know ({error})"
        raise InvalidValue(name, text, rule, remedy=remedy) from error
    return _converted(name, text, quantity, units)


def _converted(name: str, value: Any, quantity: Any, units: str) -> float:
    try:
        return float(quantity.to(units).magnitude)
    except Exception as error:
        raise _misfit(name, value, units) from error
