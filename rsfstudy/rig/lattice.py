"""Lattices over rigs: the fields of scenes that each cell has by axes in units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rsfstudy.axes.axis import Axis, Row, places_by_kind
from rsfstudy.errors import InvalidValue
from rsfstudy.rig.axes import factor_to_si
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.quantities import (
    FIELDS,
    FULL,
    OF_AXIS,
    ON_AXIS,
    SCALES,
    check_together,
    is_friction,
    is_scaled,
    of_scene,
)
from rsfstudy.rig.scales import BESIDE, scales_of_rig
from rsfstudy.rig.units import times
from rsfstudy.slider.scene import Scene


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
                found[OF_AXIS[name]] = times(row[name], factor_to_si(name, units[name]))
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
        here, found = factors(rig), {}
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
                in_si = times(value, factor_to_si(name, units[name]))
                found[field] = in_si / (here[scale] if scale else 1.0)
        return found

    def _held(self, here: Mapping[str, Any]) -> dict[str, Any]:
        """Fields of the base that stay what they are in SI units."""
        base = factors(self.laboratory.as_dict())
        held = {
            name: value * (base[FIELDS[name].scale] / here[FIELDS[name].scale])
            for name, value in self.base.as_dict().items()
            if is_scaled(name) and isinstance(value, float) and value != 0.0
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
        # of an axis of one point a second one tells what depends on it
        alone = {axis.dimension for axis in self.axes if len(axis) == 1 and axis.is_plain}
        along = [_doubled(a) if a.dimension in alone else a for a in self.axes if a.units]
        shape = tuple(len(axis) for axis in along)
        found: dict[str, np.ndarray] = {}
        for rows in places_by_kind(along):
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
        squeezed = {name: _squeezed(along, values) for name, values in found.items()}
        return {
            name: (dims, values[tuple(slice(1 if d in alone else None) for d in dims)])
            for name, (dims, values) in squeezed.items()
        }

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


def factors(rig: Mapping[str, Any]) -> dict[str, Any]:
    """Value of 1 in SI units, by what quantities are measured in."""
    return {name: scale.factor for name, scale in scales_of_rig(rig).items()}


def _doubled(axis: Axis) -> Axis:
    """An axis of one point, with another near it."""
    (row,) = axis.rows
    near = {
        name: 1.01 * value if isinstance(value, float) else value for name, value in row.items()
    }
    return axis.with_rows([row, near], axis.units)


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
