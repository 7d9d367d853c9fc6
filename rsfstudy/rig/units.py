"""Functions that convert quantities with units to SI units.

A quantity is a number followed by a unit, for example ``5 MPa``. This module converts common units
without pint, and uses pint for other units. Only names of units are passed to pint, because pint
would interpret numbers in a unit as factors. Conversion factors are fractions, so that each
conversion is rounded only once. For example, 0.01 mm and 10 um are converted to the same number.
"""

from __future__ import annotations

import importlib
import math
import re
from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from rsfstudy.axes import Axis
from rsfstudy.errors import InvalidValue

#: Conversion factor to SI units, and the exponents of kilogram, metre, second, kelvin and mole.
SiFactorAndBaseUnitExponents = tuple[Fraction, tuple[int, ...]]

_STRESS_EXPONENTS, _FORCE_EXPONENTS, _ENERGY_EXPONENTS = (
    (1, -1, -2, 0, 0),
    (1, 1, -2, 0, 0),
    (1, 2, -2, 0, 0),
)
_LENGTH_EXPONENTS, _TIME_EXPONENTS = (0, 1, 0, 0, 0), (0, 0, 1, 0, 0)
_SI_FACTOR_AND_EXPONENTS_BY_UNIT: Mapping[str, tuple[str | int, tuple[int, ...]]] = {
    "kg": (1, (1, 0, 0, 0, 0)),
    **{
        f"{p}Pa": (x, _STRESS_EXPONENTS)
        for p, x in (("", "1"), ("k", "1e3"), ("M", "1e6"), ("G", "1e9"))
    },
    "bar": ("1e5", _STRESS_EXPONENTS),
    **{f"{p}N": (x, _FORCE_EXPONENTS) for p, x in (("", "1"), ("k", "1e3"), ("M", "1e6"))},
    "m": (1, _LENGTH_EXPONENTS),
    "cm": ("1e-2", _LENGTH_EXPONENTS),
    "mm": ("1e-3", _LENGTH_EXPONENTS),
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm", "micron", "microns"), ("1e-6", _LENGTH_EXPONENTS)),
    "nm": ("1e-9", _LENGTH_EXPONENTS),
    "ms": ("1e-3", _TIME_EXPONENTS),
    **dict.fromkeys(("s", "sec", "seconds"), (1, _TIME_EXPONENTS)),
    "min": (60, _TIME_EXPONENTS),
    "Hz": (1, (0, 0, -1, 0, 0)),
    "kHz": ("1e3", (0, 0, -1, 0, 0)),
    "h": (3600, _TIME_EXPONENTS),
    "day": (86400, _TIME_EXPONENTS),
    "year": (31557600, _TIME_EXPONENTS),
    **{f"{p}J": (x, _ENERGY_EXPONENTS) for p, x in (("", "1"), ("k", "1e3"), ("M", "1e6"))},
    "K": (1, (0, 0, 0, 1, 0)),
    "mol": (1, (0, 0, 0, 0, 1)),
}
_EXACT_FACTOR_AND_EXPONENTS_BY_UNIT: Mapping[str, SiFactorAndBaseUnitExponents] = {
    name: (Fraction(size), of) for name, (size, of) in _SI_FACTOR_AND_EXPONENTS_BY_UNIT.items()
}
_NUMBER_PATTERN = re.compile(
    r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|nan|[-+]?inf"
)
#: Pattern of a unit name with an optional power. Powers have a single digit, so that conversion
#: factors do not overflow.
_UNIT_WITH_POWER_PATTERN = (
    r"([A-Za-z\u00b5\u03bc](?:[A-Za-z\u00b5\u03bc0-9_]*[A-Za-z\u00b5\u03bc])?)"
    r"(?:(?:\^|\*\*)?([-+]?[1-9]))?"
)
_UNIT_WITH_SIGNED_POWER_PATTERN = re.compile(rf"(/?)\s*{_UNIT_WITH_POWER_PATTERN}")
#: Pattern of a product of units that is divided by other units. Each divisor needs a separate
#: slash, because units such as ``Pa/m s`` are ambiguous.
_UNIT_PATTERN = re.compile(
    rf"(?:1(?=\s*/)|{_UNIT_WITH_POWER_PATTERN}(?:(?:\s*[*.\u00b7]\s*|\s+){_UNIT_WITH_POWER_PATTERN})*)?(?:\s*/\s*{_UNIT_WITH_POWER_PATTERN})*"
)
#: Maximum number of characters of a quantity. The limit is necessary because the time for matching
#: a pattern increases with the square of the length of the string.
_MAX_QUANTITY_TEXT_LENGTH = 200
_PINT_INSTALL_ADVICE = "Install pint (pip install 'rsfstudy[units]')"
#: Rule and remedy of the error if a quantity per fault area is not divided by the fault area.
_RULE_AND_REMEDY_BY_UNITS_PER_AREA = {
    "Pa": ("must be a stress, not a force", "Divide the force by the fault area."),
    "Pa/m": (
        "must be a stress divided by a displacement, not a force divided by a displacement",
        "Divide the force by the fault area, for example '0.04 MPa/um'.",
    ),
    "kg/m^2": (
        "must be a mass per fault area, not a mass",
        "Divide the mass by the fault area, for example '1e4 kg/m^2'.",
    ),
}


def parse_number(text: str) -> float | None:
    """Parse a number with ASCII digits and a decimal point.

    Parameters
    ----------
    text : str
        String to parse.

    Returns
    -------
    float or None
        Number, or None if the string is not a number.
    """
    return float(text) if _NUMBER_PATTERN.fullmatch(text.strip()) else None


def split_number_and_units(text: str) -> tuple[float | None, str]:
    """Split a string into a number and the units that follow the number.

    Parameters
    ----------
    text : str
        String to split.

    Returns
    -------
    number : float or None
        Number, or None if the string does not start with a number.
    units : str
        Units that follow the number. The string is empty if there is no number.
    """
    match = _NUMBER_PATTERN.match(text.strip())
    return (float(match[0]), text.strip()[match.end() :].strip()) if match else (None, "")


def convert_to_si(quantity_name: str, value: Any, si_units: str) -> float:
    """Convert a quantity to SI units.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity for error messages.
    value : float, str or pint.Quantity
        Value to convert. A plain number is already in SI units. A string is a number followed by a
        unit, for example "5 MPa", "0.1 MPa/um" or "1 um s^-1".
    si_units : str
        SI units of the quantity.

    Returns
    -------
    float
        Value in SI units.

    Raises
    ------
    InvalidValue
        If the value is not a finite number, or if its units are unknown or incompatible.
    """
    return float(convert_to_si_as_fraction(quantity_name, value, si_units))


def convert_to_si_as_fraction(quantity_name: str, value: Any, si_units: str) -> Fraction:
    """Convert a quantity to an exact fraction in SI units.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity for error messages.
    value : float, str or pint.Quantity
        Value to convert, as in `convert_to_si`.
    si_units : str
        SI units of the quantity.

    Returns
    -------
    Fraction
        Value in SI units.

    Raises
    ------
    InvalidValue
        If the value is not a finite number, or if its units are unknown or incompatible.
    """
    if isinstance(value, str):
        found: Any = _convert_quantity_text_to_si(quantity_name, value, si_units)
    elif hasattr(value, "to") and hasattr(value, "magnitude"):
        found = _convert_pint_quantity_to_si(quantity_name, value, value, si_units)
    else:
        found = Axis.convert_to_plain_value(quantity_name, value)
    if isinstance(found, bool) or not isinstance(found, int | float | Fraction):
        remedy = f"Pass a number in {si_units}, or a string with units."
        raise InvalidValue(quantity_name, value, "is not a quantity", remedy=remedy)
    if isinstance(value, int) and math.isinf(_convert_to_float_or_infinity(found)):
        raise InvalidValue(quantity_name, value, "is too large for a floating-point number")
    if not math.isfinite(_convert_to_float_or_infinity(found)):
        raise InvalidValue(quantity_name, value, "must be finite")
    return Fraction(found)


def compute_conversion_factor(quantity_name: str, stated_units: str, target_units: str) -> Fraction:
    """Compute the conversion factor between two units.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity for error messages.
    stated_units : str
        Units to convert from.
    target_units : str
        SI units to convert to.

    Returns
    -------
    Fraction
        Conversion factor.

    Raises
    ------
    InvalidValue
        If the units are unknown or incompatible.
    """
    return convert_to_si_as_fraction(quantity_name, f"1 {stated_units}", target_units)


def multiply_by_exact_fraction(values: Any, factor: Fraction) -> Any:
    """Multiply numbers by a conversion factor and round only once.

    The function multiplies the decimal representation of each number, so that numbers in files and
    numbers in strings are converted to identical results.

    Parameters
    ----------
    values : float or ndarray
        Numbers to multiply.
    factor : Fraction
        Conversion factor.

    Returns
    -------
    float or ndarray
        Product of each number and the conversion factor.
    """
    # Arrays of coordinates often repeat their values, so each value is multiplied once.
    if isinstance(values, np.ndarray):
        each, places = np.unique(values, return_inverse=True)
        return np.array([multiply_by_exact_fraction(x, factor) for x in each.tolist()])[
            places
        ].reshape(values.shape)
    return (
        _convert_to_float_or_infinity(_convert_shortest_decimal_to_fraction(values) * factor)
        if math.isfinite(values)
        else values
    )


def _convert_shortest_decimal_to_fraction(number: float) -> Fraction:
    """Return the shortest decimal fraction that rounds to a number."""
    return Fraction(repr(float(number)))


def _convert_to_float_or_infinity(number: Fraction | float) -> float:
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _convert_quantity_text_to_si(quantity_name: str, text: str, si_units: str) -> Fraction | float:
    """Convert a string with a number and units to SI units.

    Infinite numbers and NaN are returned unchanged.
    """
    if len(text) > _MAX_QUANTITY_TEXT_LENGTH:
        rule = f"is not a quantity, because it has more than {_MAX_QUANTITY_TEXT_LENGTH} characters"
        remedy = f"Write a number and its units, for example '2.5 {si_units.removesuffix('1')}'."
        raise InvalidValue(quantity_name, text, rule, remedy=remedy)
    match = _NUMBER_PATTERN.match(text.strip())
    powers = _parse_unit_powers(text.strip()[match.end() :].strip()) if match else None
    if match is None or powers is None:
        example = f"2.5 {si_units}".removesuffix(" 1")
        units_hint = "" if si_units == "1" else ", followed by its units"
        remedy = f"Write a number with a decimal point{units_hint}, for example '{example}'."
        raise InvalidValue(quantity_name, text, "is not a quantity", remedy=remedy)
    number = float(match[0])
    if not math.isfinite(number):
        return number
    stated = _convert_shortest_decimal_to_fraction(number)
    if not all(unit in _EXACT_FACTOR_AND_EXPONENTS_BY_UNIT for unit, _power in powers):
        size = _compute_si_factor_with_pint(quantity_name, text, powers, si_units)
        return stated * Fraction(size) if math.isfinite(size) else size
    scale, exponents = _compute_si_factor_of_known_units(powers)
    wanted = _compute_si_factor_of_known_units(
        _parse_unit_powers(si_units.removeprefix("1")) or []
    )[1]
    if exponents == (wanted[0], wanted[1] + 2, *wanted[2:]):
        for per_area_units, (rule, remedy) in _RULE_AND_REMEDY_BY_UNITS_PER_AREA.items():
            powers_per_area = _parse_unit_powers(per_area_units) or []
            if wanted == _compute_si_factor_of_known_units(powers_per_area)[1]:
                raise InvalidValue(quantity_name, text, rule, remedy=remedy)
    if exponents != wanted:
        raise _build_incompatible_units_error(quantity_name, text, si_units)
    return stated * scale


def _build_incompatible_units_error(quantity_name: str, value: Any, units: str) -> InvalidValue:
    if units == "1":
        return InvalidValue(quantity_name, value, "must be a number without units")
    if isinstance(value, str) and not value.strip(" 0123456789.+-"):
        remedy = f"Write the units after the number, for example '{value.strip()} {units}'."
        return InvalidValue(quantity_name, value, "has no units", remedy=remedy)
    rule = f"has units that are incompatible with {units}"
    return InvalidValue(quantity_name, value, rule, remedy=f"Use {units} or multiples of {units}.")


def _parse_unit_powers(unit_text: str) -> list[tuple[str, int]] | None:
    """Parse a product or quotient of units into unit names and powers.

    The function returns None if the string is not a product or quotient of units.
    """
    if not _UNIT_PATTERN.fullmatch(unit_text):
        return None
    found = _UNIT_WITH_SIGNED_POWER_PATTERN.findall(unit_text)
    return [(name, int(power or 1) * (-1 if over else 1)) for over, name, power in found]


def _compute_si_factor_of_known_units(
    units_and_powers: Iterable[tuple[str, int]],
) -> SiFactorAndBaseUnitExponents:
    """Multiply powers of units that rsfstudy can convert without pint."""
    scale, exponents = Fraction(1), [0] * 5
    for name, power in units_and_powers:
        size, of = _EXACT_FACTOR_AND_EXPONENTS_BY_UNIT[name]
        scale *= size**power
        exponents = [e + power * o for e, o in zip(exponents, of, strict=True)]
    return scale, tuple(exponents)


def _compute_si_factor_with_pint(
    quantity_name: str, text: str, units_and_powers: Iterable[tuple[str, int]], si_units: str
) -> float:
    try:
        pint = importlib.import_module("pint")
    except ImportError as error:
        usual = ", ".join(
            n for n in _EXACT_FACTOR_AND_EXPONENTS_BY_UNIT if n != "kg" and n.isascii()
        )
        remedy = f"{_PINT_INSTALL_ADVICE}, use the units {usual}, or pass a number in {si_units}."
        remedy = _suggest_unit_with_other_capitals(units_and_powers) or remedy
        raise InvalidValue(
            quantity_name,
            text,
            "has units that are unknown without the library pint",
            remedy=remedy,
        ) from error
    registry = pint.get_application_registry()
    try:
        unit = math.prod(registry.parse_units(unit) ** power for unit, power in units_and_powers)
    except Exception as error:  # Both pint and the Python parser may raise errors of other types.
        remedy = (
            _suggest_unit_with_other_capitals(units_and_powers)
            or f"Write, for example, '2.5 {si_units}'."
        )
        rule = f"has units that are unknown to the library pint ({error})"
        raise InvalidValue(quantity_name, text, rule, remedy=remedy) from error
    # Zero does not convert to zero if the unit is logarithmic or has an offset.
    if (
        _convert_pint_quantity_to_si(quantity_name, text, registry.Quantity(0.0, unit), si_units)
        != 0.0
    ):
        raise _build_incompatible_units_error(quantity_name, text, si_units)
    return float(
        _convert_pint_quantity_to_si(quantity_name, text, registry.Quantity(1.0, unit), si_units)
    )


def _suggest_unit_with_other_capitals(units_and_powers: Iterable[tuple[str, int]]) -> str:
    """Suggest known units that differ from an unknown unit only in letter case."""
    for name, _power in units_and_powers:
        meant = [
            known
            for known in _EXACT_FACTOR_AND_EXPONENTS_BY_UNIT
            if known.lower() == name.lower() and known != name
        ]
        if meant:
            return f"Did you mean {' or '.join(meant)} instead of {name}?"
    return ""


def _convert_pint_quantity_to_si(
    quantity_name: str, value: Any, pint_quantity: Any, si_units: str
) -> Any:
    """Return the value of a pint quantity in SI units."""
    try:
        magnitude = pint_quantity.to(si_units).magnitude
    except Exception as error:
        raise _build_incompatible_units_error(quantity_name, value, si_units) from error
    return Axis.convert_to_plain_value(quantity_name, magnitude)


def find_si_factor_and_exponents(units: str) -> SiFactorAndBaseUnitExponents | None:
    """Return the conversion factor and the exponents of common units.

    Parameters
    ----------
    units : str
        Product or quotient of units, such as "MPa" or "um/s".

    Returns
    -------
    (Fraction, (int, int, int)) or None
        Conversion factor to SI units, and the exponents of kilogram, metre and second. The value is
        None if the string is not a product or quotient of known units.
    """
    powers = _parse_unit_powers(units) if 0 < len(units) <= _MAX_QUANTITY_TEXT_LENGTH else None
    if not powers or not all(
        name in _EXACT_FACTOR_AND_EXPONENTS_BY_UNIT for name, _power in powers
    ):
        return None
    return _compute_si_factor_of_known_units(powers)
