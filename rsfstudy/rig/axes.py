"""Axes of studies of a rig, in units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from rsfstudy.axes.axis import Axis, Row, plain
from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import is_name
from rsfstudy.rig.quantities import FULL, OF_AXIS, ON_AXIS, STATED, UNITS, is_friction, units_of
from rsfstudy.rig.units import exact, factor, number_and_units, spaced
from rsfstudy.wording import is_list


def axis(dimension: str, values: Any, units: str | Mapping[str, str] = "") -> Axis:
    """An axis in the units that its first value states; a field that has none as it is.

    Parameters
    ----------
    dimension : str
        A quantity of a rig, or a field of a scene.
    values : sequence of quantity, str, or mapping
        A text is ``first:last:count``, or ``first:last:count:log``, and units. A mapping has the
        fields of each label, or a rig, and each field is in SI units then; or it is a table, as
        `Axis.cases` takes one.
    units : str, or mapping of str to str
        Of plain numbers; of the columns of a table. SI units by default.

    Raises
    ------
    InvalidValue
        For a value that is no quantity, of another kind, or of a rig and not positive.
    """
    if not is_name(dimension):
        return Axis(dimension, values)  # which refuses it
    if hasattr(values, "keys"):
        if isinstance(values, Mapping) and any(
            isinstance(point, Mapping) or hasattr(point, "on_axis") for point in values.values()
        ):
            return in_units(Axis(dimension, values))
        stated: Any = units or None
        return in_units(Axis.cases(values, units=stated, dimension=dimension))
    assert isinstance(units, str)
    if isinstance(values, str) and ":" in values:
        values = spaced(dimension, values, values)
    listed = [values] if isinstance(values, str) else values
    if not is_list(listed) or not len(listed):
        return Axis(dimension, values)
    return _plain([{dimension: value} for value in listed], {dimension: units})


def in_units(along: Axis) -> Axis:
    """An axis of a study of a rig, whose plain numbers are in SI units, as everywhere in a rig."""
    if along.is_plain:
        return _plain(along.rows, along.units)
    rows, units = _converted(along.rows, along.units, by_column=along.is_numbered)
    return along.with_rows(rows, units, along.drawn)


def _plain(rows: Sequence[Row], units: Mapping[str, str]) -> Axis:
    """An axis of one field."""
    found, stated = _converted(rows, units, by_column=True)
    (name,) = found[0]
    return Axis(name, [row[name] for row in found], stated)


def _converted(
    rows: Sequence[Row], units: Mapping[str, str], *, by_column: bool
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Rows whose fields have the names and units that they have on axes, and these units: those of
    the axis, those of the first value of a column, or SI units.
    """
    found: list[dict[str, Any]] = [{} for _row in rows]
    stated: dict[str, str] = {}
    quantities: dict[str, list[tuple[dict[str, Any], Any]]] = {}
    for row, new in zip(rows, found, strict=True):
        for given, value in row.items():
            example = rows[0][given] if by_column else value
            name = name_on_axis(given, example)
            si = si_units(name, example)
            new[name if si else given] = value
            if si:
                quantities.setdefault(name, []).append((new, value))
                ours = _stated_units(value) if by_column else ""
                stated.setdefault(name, units.get(given) or ours or si)
            elif units.get(given):
                factor_to_si(given, units[given])  # which refuses what is none of a rig
    for name, held in quantities.items():
        numbers = numbers_in(name, [value for _row, value in held], stated[name])
        for (row, _value), number in zip(held, numbers, strict=True):
            row[name] = number
    return found, stated


def numbers_in(name: str, values: Sequence[Any], units: str) -> list[float]:
    """Values of a quantity in some units, which those have that are plain numbers."""
    scale, found = factor_to_si(name, units), []
    kind = "1/m" if name == "stiffness" and is_friction(f"1 {units}") else si_units(name, "1")
    for value in values:
        number, written = (
            number_and_units(value) if isinstance(value, str) else (plain(name, value), units)
        )
        if isinstance(number, float) and written == units:
            found.append(number)
        else:
            found.append(float(exact(name, value, str(kind)) / scale))
    wrong = [
        value for number, value in zip(found, values, strict=True) if not _is_possible(name, number)
    ]
    if wrong:
        of = f", and {len(wrong)} of {len(found)} are not" if len(found) > 1 else ""
        raise InvalidValue(name, wrong[0], f"must be positive{of}")
    return found


def _is_possible(name: str, number: Any) -> bool:
    """False of a quantity of a rig that is not positive."""
    return name not in OF_AXIS or (isinstance(number, float) and number > 0.0)


def name_on_axis(name: str, value: Any) -> str:
    """The name on an axis of what bears another in a rig or, as a ratio, in a scene."""
    quantity = not isinstance(value, str) or number_and_units(value)[0] is not None
    if name in ON_AXIS and quantity:
        return ON_AXIS[name]
    if not is_name(name):
        return name  # which a scene refuses
    short = name.removesuffix("_ratio")
    return short if FULL.get(short) == name and units_of(name, value) else name


def si_units(name: str, value: Any) -> str | None:
    """SI units of a value on an axis; None where it is none in units."""
    if value is None or isinstance(value, bool):
        return None
    if name in OF_AXIS:
        return STATED[OF_AXIS[name]].units
    if name in FULL:
        return UNITS["V_*"]
    return units_of(name, value)


def _stated_units(value: Any) -> str:
    return number_and_units(value)[1] if isinstance(value, str) else ""


def factor_to_si(name: str, units: str) -> Fraction:
    """Factor to SI units; of a stiffness that is friction over displacement to 1/m."""
    if name == "stiffness" and is_friction(f"1 {units}"):
        return factor(name, units, "1/m")
    si = si_units(name, f"1 {units}")
    if si is None:
        raise InvalidValue(name, units, "is no quantity of a rig, nor in units of one")
    return factor(name, units, si)
