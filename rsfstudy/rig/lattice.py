"""Lattices over rigs: axes in units, and the fields of scenes that each cell has by them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from rsfstudy.declare.axis import Axis, Row, alike, columns, plain, spread
from rsfstudy.declare.wording import is_list
from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import is_name
from rsfstudy.rig.quantities import (
    FIELDS,
    FULL,
    OF_AXIS,
    ON_AXIS,
    SCALES,
    STATED,
    UNITS,
    check_together,
    is_friction,
    of_scene,
    stated,
    units_of,
)
from rsfstudy.rig.scales import BESIDE, scales_of_rig
from rsfstudy.rig.units import exact, factor, parted, spaced, times
from rsfstudy.slider.scene import Scene

if TYPE_CHECKING:
    from rsfstudy.declare.study import Study
    from rsfstudy.rig.laboratory import Laboratory


# ---- axes ----------------------------------------------------------------------------------------


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
        zipped = isinstance(values, Mapping) and any(map(_is_point, values.values()))
        return in_units(Axis(dimension, values) if zipped else _table(dimension, values, units))
    assert isinstance(units, str)
    if isinstance(values, str) and ":" in values:
        values = spaced(dimension, values, values)
    listed = [values] if isinstance(values, str) else values
    if not is_list(listed) or not len(listed):
        return Axis(dimension, values)
    name = _name(dimension, listed[0])
    if _si_units(name, listed[0]) is None:
        return Axis(dimension, values)
    units = units or _stated_units(listed[0]) or str(_si_units(name, listed[0]))
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
    size, found = _size(name, units), []
    kind = "1/m" if name == "stiffness" and is_friction(f"1 {units}") else _si_units(name, "1")
    for value in values:
        number, written = parted(value) if isinstance(value, str) else (plain(name, value), units)
        if isinstance(number, float) and written == units:
            found.append(number)
        else:
            found.append(float(exact(name, value, str(kind)) / size))
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
            name = _name(given, value)
            si = _si_units(name, value)
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
        name = _name(given, column[0])
        si = _si_units(name, column[0])
        if si is None:
            found[given] = column
            continue
        units[name] = along.units.get(given) or _stated_units(column[0]) or si
        found[name] = numbers_in(name, column, units[name])
    return Axis(along.dimension, found, units, along.drawn)


def _table(dimension: str, table: Any, units: Any) -> Axis:
    return Axis.cases(table, units=units or None, dimension=dimension)


def _is_point(value: Any) -> bool:
    """True of the fields at a label, or of a rig."""
    return isinstance(value, Mapping) or hasattr(value, "on_axis")


def _check(along: Axis) -> None:
    """Refuse units of another kind, and quantities of a rig that are not positive."""
    for name, units in along.units.items():
        _size(name, units)
        for row in along.rows:
            if not _is_meant(name, row.get(name, 1.0)):
                raise InvalidValue(name, row[name], "must be positive")


def _is_meant(name: str, number: Any) -> bool:
    """False of a quantity of a rig that is not positive."""
    return name not in OF_AXIS or (isinstance(number, float) and number > 0.0)


def _name(name: str, value: Any) -> str:
    """The name on an axis of what bears another in a rig or, as a ratio, in a scene."""
    quantity = not isinstance(value, str) or parted(value)[0] is not None
    if name in ON_AXIS and quantity:
        return ON_AXIS[name]
    if not is_name(name):
        return name  # which a scene refuses
    short = name.removesuffix("_ratio")
    return short if FULL.get(short) == name and units_of(name, value) else name


def _si_units(name: str, value: Any) -> str | None:
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


def _size(name: str, units: str) -> Fraction:
    """Factor to SI units; of a stiffness that is friction over displacement to 1/m."""
    if name == "stiffness" and is_friction(f"1 {units}"):
        return factor(name, units, "1/m")
    si = _si_units(name, f"1 {units}")
    if si is None:
        raise InvalidValue(name, units, "is no quantity of a rig, nor in units of one")
    return factor(name, units, si)


# ---- cells ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cells:
    """The cells of a study of a rig: axes in units, turned into fields of scenes.

    What the base scene has in units of its rig (all but ratios) stays what it is in SI units where
    an axis varies a scale.

    Parameters
    ----------
    laboratory : Laboratory
        What is fixed.
    base : Scene
        A scene of it.
    axes : sequence of Axis

    Raises
    ------
    InvalidValue
        For a scene that is not of that rig, and for axes that leave out what it states.
    """

    laboratory: Laboratory
    base: Scene
    axes: Sequence[Axis]

    def __post_init__(self) -> None:
        theirs = self.base.as_dict()
        for name, value in of_scene(self.laboratory.as_dict()).items():
            if name != "inertia" and not _alike(theirs.get(name), value):
                rule = f"is not that of the laboratory, {value:g}"
                remedy = "Make the base of its study with laboratory.scene(...)."
                raise InvalidValue(name, theirs.get(name), rule, remedy=remedy)
        for along in self.axes:
            for row in along.rows:
                lacks = [name for name in self.laboratory.on_axis if name not in row]
                if lacks and not {ON_AXIS.get(name, name) for name in SCALES} & set(lacks):
                    rule = f"does not state {lacks[0]}, which the laboratory of the study does"
                    raise InvalidValue(along.dimension, dict(row), rule, remedy="State it.")

    @property
    def units(self) -> dict[str, str]:
        """Units of the fields that axes state in units, by the names that they have there."""
        return {name: units for along in self.axes for name, units in along.units.items()}

    def rig(self, row: Row) -> dict[str, Any]:
        """The quantities of the rig in SI units, where axes have these values or arrays."""
        found, units = dict(self.laboratory.as_dict()), self.units
        for name in OF_AXIS:
            if name in units and row.get(name) is not None:
                found[OF_AXIS[name]] = times(row[name], _size(name, units[name]))
        in_friction = is_friction(f"1 {units.get('stiffness', '')}")
        if row.get("stiffness") is not None and in_friction:
            found["stiffness"] = found["stiffness"] * found["normal_stress"]
        check_together(found)
        return found

    def fields(self, row: Row) -> dict[str, Any]:
        """The fields of scenes that differ from the base, where axes have these values.

        Parameters
        ----------
        row : mapping of str to value, or to ndarray of float
        """
        units, rig = self.units, self.rig(row)
        here, found = _scales(rig), {}
        if set(OF_AXIS) & set(units) & set(row):
            found = self._held(here) | of_scene(rig)
            if "period" in self.laboratory.as_dict() and not self.base.has_mass:
                found.pop("inertia", None)  # it was left out
        for name, value in row.items():
            field = FULL.get(name, name)
            if name not in units:
                found[name] = value
            elif name not in OF_AXIS:
                scale = FIELDS[field].scale
                in_si = times(value, _size(name, units[name]))
                found[field] = in_si / (here[scale] if scale else 1.0)
        return found

    def _held(self, here: Mapping[str, Any]) -> dict[str, Any]:
        """Fields of the base that stay what they are in SI units."""
        base = _scales(self.laboratory.as_dict())
        held = {
            name: value * (base[FIELDS[name].scale] / here[FIELDS[name].scale])
            for name, value in self.base.as_dict().items()
            if _is_scaled(name) and isinstance(value, float) and value != 0.0
        }
        if "radiation_damping" in held:  # eta is held: its stress goes with V_*
            held["radiation_damping"] = held["radiation_damping"] * (here["V_*"] / base["V_*"])
        return held

    def beside(self) -> dict[str, tuple[tuple[str, ...], np.ndarray]]:
        """Dimensionless fields and scales, over the dimensions that they depend on.

        Returns
        -------
        dict
            By name, dimensions and values; a field that bears the name of an axis in units is
            called ``dimensionless_...`` here.
        """
        along = [axis for axis in self.axes if axis.units]
        shape = tuple(len(axis) for axis in along)
        found: dict[str, np.ndarray] = {}
        for rows in alike(along):
            numbers: dict[str, Any] = {}
            for place, axis in enumerate(along):
                shaped = [-1 if p == place else 1 for p in range(len(along))]
                for name, value in axis.rows[rows[place][0]].items():
                    if isinstance(value, float):
                        column = [axis.rows[n][name] for n in rows[place].tolist()]
                        numbers[name] = np.array(column).reshape(shaped)
            for name, values in self._named(numbers).items():
                whole = found.setdefault(name, np.full(shape, np.nan))
                whole[np.ix_(*rows)] = values
        return {name: _squeezed(along, values) for name, values in found.items()}

    def _named(self, row: Mapping[str, Any]) -> dict[str, Any]:
        units, rig = self.units, self.rig(row)
        scales_ = {ON_AXIS.get(name, name): rig[name] for name in SCALES}
        found = {name: value for name, value in scales_.items() if name not in units}
        for name, value in self.fields(row).items():
            if isinstance(value, bool | str) or (name in row and name not in units):
                continue
            if name not in units:
                found[name] = value
            elif FIELDS[name].scale:
                found[BESIDE + name] = value
        return found


def _alike(theirs: Any, value: Any) -> bool:
    # both were made of the same numbers, by hand perhaps: what rounding leaves is far below
    return isinstance(theirs, float) and math.isclose(theirs, value, rel_tol=1e-9)


def _scales(rig: Mapping[str, Any]) -> dict[str, Any]:
    """Value of 1 in SI units, by what quantities are measured in."""
    return {name: scale.factor for name, scale in scales_of_rig(rig).items()}


def _squeezed(along: Sequence[Axis], values: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
    """Values without the dimensions along which they are the same."""
    kept: list[str] = []
    for place, axis in reversed(list(enumerate(along))):
        first = values.take([0], axis=place)
        if np.array_equal(np.broadcast_to(first, values.shape), values, equal_nan=True):
            values = values.take(0, axis=place)
        else:
            kept.insert(0, axis.dimension)
    return tuple(kept), values


# ---- other rigs ----------------------------------------------------------------------------------


def on(study: Study, laboratory: Laboratory) -> Study:
    """A study of no rig on a rig: what its axes, its base and the ranges of its fits hold without
    dimension is turned into SI units, and what the rig states takes the place of theirs.
    """
    scales_ = _scales(laboratory.as_dict())
    axes: list[Axis] = []
    every: dict[str, float] = {}
    for along in study.axes:
        sizes = {n: scales_[FIELDS[n].scale] for n in along.fields if _is_scaled(n)}
        every |= sizes
        rows = [
            {n: v * sizes[n] if n in sizes and v is not None else v for n, v in row.items()}
            for row in along.rows
        ]
        units = {n: UNITS[FIELDS[n].scale] for n in sizes}
        axes.append(along.with_rows(rows, units, along.drawn))
    reductions = [_in_range(each, every.get(getattr(each, "on", ""))) for each in study.reductions]
    changes = of_scene(laboratory.as_dict())
    if {"inertia", "radiation_damping"} & set(changes):  # in place of what the study has
        changes = {"inertia": False, "radiation_damping": 0.0, **changes}
    base = study.base.with_(**changes)
    return replace(study, laboratory=laboratory, base=base, axes=axes, reductions=reductions)


def _in_range(reduction: Any, size: float | None) -> Any:
    """A reduction whose range, if it has any, is in SI units."""
    span = getattr(reduction, "within", None)
    if size is None or span is None:
        return reduction
    return replace(reduction, within=tuple(size * end for end in span))


def _is_scaled(name: str) -> bool:
    return name in FIELDS and bool(FIELDS[name].scale) and not name.endswith("_ratio")


# ---- other values --------------------------------------------------------------------------------


def override(study: Study, name: str, value: Any) -> dict[str, Any]:
    """What changes in a study of a rig by another value of a quantity, or by a list of them; empty
    where the name is none of a quantity.
    """
    laboratory, values = study.laboratory, list(value) if is_list(value) else [value]
    if laboratory is None or not values:
        return {}
    name = _name(name, values[0])
    for index, along in enumerate(study.axes):
        if name in along.units:
            units = along.units[name]
            if along.is_plain:
                changed = axis(name, values, "" if isinstance(values[0], str) else units)
            else:
                changed = spread(along, name, numbers_in(name, values, units))
            return {"axes": (*study.axes[:index], changed, *study.axes[index + 1 :])}
    if _si_units(name, values[0]) is None:
        return {}
    made = axis(name, values)
    if is_list(value):
        return {"axes": (made, *study.axes)}
    fields = Cells(laboratory, study.base, [made]).fields(made.rows[0])
    found: dict[str, Any] = {"base": study.base.with_(**fields)}
    if name in OF_AXIS:
        quantity = OF_AXIS[name]
        si = stated(quantity, value, laboratory.normal_stress)
        found["laboratory"] = replace(laboratory, **{quantity: si})
    return found
