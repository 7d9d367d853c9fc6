"""Studies on rigs: named ones on a rig of the user's, and those of a rig with other values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rsfstudy.axes.axis import Axis, spread
from rsfstudy.rig.axes import axis as axis_in_units
from rsfstudy.rig.axes import named, numbers_in, si_units
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.lattice import Cells, factors
from rsfstudy.rig.quantities import FIELDS, OF_AXIS, UNITS, is_scaled, of_scene, stated
from rsfstudy.wording import is_list

if TYPE_CHECKING:
    from rsfstudy.declare.study import Study


def on(study: Study, laboratory: Laboratory) -> Study:
    """A study of no rig on a rig: what its axes, its base and the ranges of its fits hold without
    dimension is turned into SI units, and what the rig states takes the place of theirs.
    """
    sizes_of = factors(laboratory.as_dict())
    axes: list[Axis] = []
    every: dict[str, float] = {}
    for along in study.axes:
        sizes = {n: sizes_of[FIELDS[n].scale] for n in along.fields if is_scaled(n)}
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


def _in_range(reduction: Any, scale: float | None) -> Any:
    """A reduction whose range, if it has any, is in SI units."""
    span = getattr(reduction, "within", None)
    if scale is None or span is None:
        return reduction
    return replace(reduction, within=tuple(scale * end for end in span))


def override(study: Study, name: str, value: Any) -> dict[str, Any]:
    """What changes in a study of a rig by another value of a quantity, or by a list of them; empty
    where the name is none of a quantity.
    """
    laboratory, values = study.laboratory, list(value) if is_list(value) else [value]
    if laboratory is None or not values:
        return {}
    name = named(name, values[0])
    for index, along in enumerate(study.axes):
        if name in along.units:
            units = along.units[name]
            if along.is_plain:
                changed = axis_in_units(name, values, "" if isinstance(values[0], str) else units)
            else:
                changed = spread(along, name, numbers_in(name, values, units))
            return {"axes": (*study.axes[:index], changed, *study.axes[index + 1 :])}
    if si_units(name, values[0]) is None:
        return {}
    made = axis_in_units(name, values)
    if is_list(value):
        return {"axes": (made, *study.axes)}
    fields = Cells(laboratory, study.base, [made]).fields(made.rows[0])
    found: dict[str, Any] = {"base": study.base.with_(**fields)}
    if name in OF_AXIS:
        quantity = OF_AXIS[name]
        si = stated(quantity, value, laboratory.normal_stress)
        found["laboratory"] = replace(laboratory, **{quantity: si})
    return found
