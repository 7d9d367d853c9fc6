"""Checks of what a study is declared of: its parts, their names, and what its axes vary."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rsfstudy.axes.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import TAKEN, Measure
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.quantity import is_name
from rsfstudy.reduce import Reduction
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.quantities import FULL
from rsfstudy.slider.assembly import without_meaning
from rsfstudy.slider.registry import FIELDS, SLOT_NAMES, by_class
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.synonyms import instead_of_field
from rsfstudy.vocabulary import QUANTITIES
from rsfstudy.wording import listed, short

if TYPE_CHECKING:
    from rsfstudy.declare.study import Study


#: What parts of a study are made of, one of them or a list; the laboratory may be left out.
_ONE = {"base": Scene, "measure": Measure, "accuracy": Accuracy, "laboratory": Laboratory}
_LISTS = {"axes": Axis, "reductions": Reduction, "claims": Claim, "references": str}


def parts(study: Study) -> None:
    """Refuse parts of other types."""
    for name, kind in (_ONE | _LISTS).items():
        given = getattr(study, name)
        if name in _LISTS and not isinstance(given, list | tuple):
            raise InvalidValue(name, given, f"must be a list of {kind.__name__} objects")
        for value in given if name in _LISTS else [given]:
            if not isinstance(value, kind) and not (name == "laboratory" and value is None):
                raise InvalidValue(name, value, f"must be made of {kind.__name__} objects")
    if not study.axes:
        raise InvalidValue("axes", study.axes, "must hold at least one axis")


def names(study: Study) -> None:
    """Refuse names that results bear already, and reductions of what is not measured."""
    study.measure.check()
    known = list(study.measure.variables)
    for reduction in study.reductions:
        if not is_name(reduction.name) or reduction.name in TAKEN:
            raise InvalidValue("reduction", reduction.name, "names something else, or nothing")
        if reduction.of not in known:
            raise InvalidValue("reduction of", reduction.of, "is not measured", choices=known)
        known.append(reduction.name)
    taken = {*known, *study.measure.inner_coordinates, *(TAKEN - set(FIELDS))}
    for axis in study.axes:
        sought(study, axis.fields)
        for name in (axis.dimension, *axis.fields):
            if name in taken:
                raise InvalidValue("axis", name, "is the name of something measured")


def sought(study: Study, fields: Sequence[str]) -> None:
    """Refuse to set what the measure solves for."""
    for name in fields:
        if {name, FULL.get(name)} & set(study.measure.sought):
            rule = f"{study.measure.name} solves for {name}; it cannot be an axis or be set"
            raise InvalidValue(name, "...", rule, remedy="Leave it out.")


def own_fields(study: Study) -> None:
    """Refuse parts with a field whose name something else in the results bears already."""
    taken = {*study.measure.variables, *study.measure.inner_coordinates}
    taken |= {*TAKEN, *QUANTITIES, *(reduction.name for reduction in study.reductions)}
    for name in study.scene_fields[len(FIELDS) :]:
        if name in taken - SLOT_NAMES:
            rule, remedy = "is the name of something else", "Rename the field of your part."
            raise InvalidValue("field", name, rule, remedy=remedy)


def fields(study: Study) -> None:
    """Refuse axes over unknown fields, and over fields of the measure that decide which numbers
    it gives, because all cells of a lattice have the same numbers.
    """
    in_units = study.rig.units if study.rig else {}
    known = dict.fromkeys((*study.scene_fields, *study.measure.plain_fields, *in_units))
    for axis in study.axes:
        if not axis.is_plain and axis.dimension in (*study.scene_fields, *axis.fields):
            rule = "is a field: a zipped axis needs a name of its own"
            raise InvalidValue("axis", axis.dimension, rule)
        if axis.units and study.rig is None:
            remedy = "Give the study its rig: Study(laboratory=rig)."
            raise InvalidValue("axis", axis.dimension, "is in units of a rig", remedy=remedy)
        for name in axis.fields:
            if name not in known:
                rule = (
                    "is not a field of a scene, nor a number, flag or text of the measure "
                    f"{study.measure.name}"
                )
                raise unknown("field", name, rule, known)
    varied = [axis.rows for axis in study.axes if not set(axis.fields) <= study.of_scene]
    given = _given(study.measure)
    for rows in itertools.product(*varied):
        measure = study.measure.with_(**study.split(rows)[1])
        if _given(measure) != given:
            present = study.measure.plain_fields.items()
            guilty = [n for n, v in measure.plain_fields.items() if (n, v) not in present]
            rule = "decides which numbers are measured, which all cells must share"
            remedy = "Make a study of each value."
            raise InvalidValue("axis", ", ".join(guilty), rule, remedy=remedy)


def override(study: Study, axis: Axis, name: str, value: Any) -> None:
    """Refuse another value of a field that some points of an axis state, and that others take from
    the base.
    """
    stating = [point for point, row in zip(axis.points, axis.rows, strict=True) if name in row]
    if axis.is_plain or not 0 < len(stating) < len(axis):
        return
    parts = study.own_parts
    for point, row in zip(axis.points, axis.rows, strict=True):
        held = by_class({**study.base.as_dict(), **row}, parts)
        if name in row or not held.get(name) or name in without_meaning(held, parts.values()):
            continue
        some = listed(stating, ", ")
        rule = f"is stated by some points of {axis.dimension} alone ({some}), and that of {point} "
        rule += f"is {short(held[name])}: it would stay"
        remedy = f"Select points of one kind too, as in '{axis.dimension}={stating[0]}'."
        raise InvalidValue(name, value, rule, remedy=remedy)


def apart(axes: Sequence[Axis]) -> None:
    """Refuse axes that repeat a dimension or vary the same field."""
    taken: dict[str, str] = {}
    for axis in axes:
        for name in {FULL.get(n, n) for n in (axis.dimension, *axis.fields)}:
            if name in taken:
                rule = f"varies {name!r}, as {taken[name]!r} does already"
                raise InvalidValue("axis", axis.dimension, rule)
            taken[name] = axis.dimension


def unknown(of: str, name: str, rule: str, known: Collection[str]) -> InvalidValue:
    remedy = instead_of_field(name)
    return InvalidValue(of, name, rule, remedy=remedy, choices=() if remedy else known)


def _given(measure: Measure) -> str:
    """The numbers a measure gives, and the fields it looks for; as text, where NaN equals NaN."""
    inner = {name: np.asarray(at).tolist() for name, at in measure.inner_coordinates.items()}
    return repr((measure.headline, dict(measure.variables), inner, measure.sought))
