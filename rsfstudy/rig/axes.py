"""Axes of studies of a rig, in units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from rsfstudy.axes.axis import Axis, Row, columns, plain
from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import is_name
from rsfstudy.rig.quantities import FULL, OF_AXIS, ON_AXIS, STATED, UNITS, is_friction, units_of
from rsfstudy.rig.units import exact, factor, parted, spaced
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
    name = named(dimension, listed[0])
    if si_units(name, listed[0]) is None:
        return Axis(dimension, values)
    units = units or _stated_units(listed[0]) or str(si_units(name, listed[0]))
    return Axis(name, numbers_in(name, listed, units), {name: units})


def in_units(along: Axis) -> Axis:
    """An axis of a study of a rig, whose plain numbers are in SI units, as everywhere in a rig."""
    if along.is_numbered:
        return _numbered(along)
    if along.units:
        _check(along)
        return along
    if along.labels is not None:
        return _zipped(along)
    return axis(along.dimension, [row[along.dimension] for row in along.rows])


def numbers_in(name: str, values: Sequence[Any], units: str) -> list[float]:
    """Values of a quantity in some units, which those have that are plain numbers."""
    scale, found = size(name, units), []
    kind = "1/m" if name == "stiffness" and is_friction(f"1 {units}") else si_units(name, "1")
    for value in values:
        number, written = parted(value) if isinstance(value, str) else (plain(name, value), units)
        if isinstance(number, float) and written == units:
            found.append(number)
        else:
            found.append(float(exact(name, value, str(kind)) / scale))
    wrong = [
        value for number, value in zip(found, values, strict=True) if not _is_meant(name, number)
    ]
    if wrong:
        of = f", and {len(wrong)} of {len(found)} are not" if len(found) > 1 else ""
        raise InvalidValue(name, wrong[0], f"must be positive{of}")
    return found


def _zipped(along: Axis) -> Axis:
    """A zipped axis, whose fields are in SI units where they are in units."""
    units: dict[str, str] = {}
    rows: dict[str, Row] = {}
    for label, row in zip(along.labels or (), along.rows, strict=True):
        rows[label] = found = {}
        for given, value in row.items():
            name = named(given, value)
            si = si_units(name, value)
            if si is None:
                found[given] = value
            else:
                found[name] = numbers_in(name, [value], si)[0]
                units[name] = si
    return Axis(along.dimension, rows, units)


def _numbered(along: Axis) -> Axis:
    """An axis of samples or cases, whose fields are in the units stated, or in SI units."""
    found: dict[str, Any] = {}
    units: dict[str, str] = {}
    for given, column in columns(along.rows).items():
        name = named(given, column[0])
        si = si_units(name, column[0])
        if si is None:
            found[given] = column
            continue
        units[name] = along.units.get(given) or _stated_units(column[0]) or si
        found[name] = numbers_in(name, column, units[name])
    return Axis(along.dimension, found, units, along.drawn)


def _check(along: Axis) -> None:
    """Refuse units of another kind, and quantities of a rig that are not positive."""
    for name, units in along.units.items():
        size(name, units)
        for row in along.rows:
            if not _is_meant(name, row.get(name, 1.0)):
                raise InvalidValue(name, row[name], "must be positive")


def _is_meant(name: str, number: Any) -> bool:
    """False of a quantity of a rig that is not positive."""
    return name not in OF_AXIS or (isinstance(number, float) and number > 0.0)


def named(name: str, value: Any) -> str:
    """The name on an axis of what bears another in a rig or, as a ratio, in a scene."""
    quantity = not isinstance(value, str) or parted(value)[0] is not None
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
    return parted(value)[1] if isinstance(value, str) else ""


def size(name: str, units: str) -> Fraction:
    """Factor to SI units; of a stiffness that is friction over displacement to 1/m."""
    if name == "stiffness" and is_friction(f"1 {units}"):
        return factor(name, units, "1/m")
    si = si_units(name, f"1 {units}")
    if si is None:
        raise InvalidValue(name, units, "is no quantity of a rig, nor in units of one")
    return factor(name, units, si)
