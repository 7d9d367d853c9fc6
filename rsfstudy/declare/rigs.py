"""Studies on rigs: named ones on a rig of the user's, and those of a rig with other values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rsfstudy.axes.axis import Axis
from rsfstudy.rig.axes import axis as axis_in_units
from rsfstudy.rig.axes import factor_to_si
from rsfstudy.rig.laboratory import Laboratory, instability_norm
from rsfstudy.rig.lattice import Cells, factors
from rsfstudy.rig.quantities import FIELDS, OF_AXIS, SHOWN, UNITS, is_scaled, of_scene, stated
from rsfstudy.rig.units import times

if TYPE_CHECKING:
    from rsfstudy.declare.study import Study


def on(study: Study, laboratory: Laboratory) -> Study:
    """A study of no rig on a rig: what its axes and the ranges of its fits hold without dimension
    is turned into units of the rig, as it is shown, and what it states takes the place of theirs.
    """
    sizes_of = factors(laboratory.as_dict())
    axes: list[Axis] = []
    every: dict[str, float] = {}
    for along in study.axes:
        scales = {n: FIELDS[n].scale for n in along.fields if is_scaled(n)}
        units = {n: SHOWN.get(UNITS[scale], UNITS[scale]) for n, scale in scales.items()}
        sizes = {n: times(sizes_of[s], 1 / factor_to_si(n, units[n])) for n, s in scales.items()}
        every |= sizes
        rows = [
            {n: v * sizes[n] if n in sizes and v is not None else v for n, v in row.items()}
            for row in along.rows
        ]
        axes.append(along.with_rows(rows, units, along.drawn))
    reductions = [_in_range(each, every.get(getattr(each, "on", ""))) for each in study.reductions]
    changes = of_scene(laboratory.as_dict())
    if {"inertia", "radiation_damping"} & set(changes):  # in place of what the study has
        changes = {"inertia": False, "radiation_damping": 0.0, **changes}
    base = study.base.with_(**changes)
    return replace(study, laboratory=laboratory, base=base, axes=axes, reductions=reductions)


def _in_range(reduction: Any, scale: float | None) -> Any:
    """A reduction whose range, if it has any, is in units."""
    span = getattr(reduction, "within", None)
    if scale is None or span is None:
        return reduction
    return replace(reduction, within=tuple(scale * end for end in span))


def fixed(study: Study, name: str, value: Any) -> dict[str, Any]:
    """What changes in a study of a rig by another value of a quantity that is no axis of it."""
    laboratory = study.laboratory
    assert laboratory is not None
    if name == "instability_norm":
        norm = instability_norm(laboratory, value, study.base)
        return {"base": study.base.with_(instability_norm=norm)}
    made = axis_in_units(name, [value])
    fields = Cells(laboratory, study.base, [made]).fields(made.rows[0])
    found: dict[str, Any] = {"base": study.base.with_(**fields)}
    if name in OF_AXIS:
        quantity = OF_AXIS[name]
        si = stated(quantity, value, laboratory.normal_stress)
        found["laboratory"] = replace(laboratory, **{quantity: si})
    return found
