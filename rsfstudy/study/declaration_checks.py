"""Checks of what a study is declared of: its parts, their names, and what its axes vary."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from rsfstudy.axes import Axis
from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import format_list, format_value
from rsfstudy.measures import RESERVED_NAMES, Measure
from rsfstudy.motion import Accuracy
from rsfstudy.quantities import is_variable_name
from rsfstudy.rig import RATIO_FIELD_BY_DIMENSIONAL_NAME, LatticeScenesOnRig, Rig
from rsfstudy.slider import (
    FIELD_NAMES,
    SLOT_NAMES,
    Scene,
    UserPart,
    find_inapplicable_fields,
    hint_for_unknown_field,
    replace_names_by_user_parts,
)
from rsfstudy.study.claims import Claim
from rsfstudy.study.reductions.application import Reduction
from rsfstudy.vocabulary import QUANTITY_BY_NAME

#: Types of the parts of a study, and types of the items of its lists. The rig is optional.
_TYPES_OF_STUDY_FIELDS = {"base": Scene, "measure": Measure, "accuracy": Accuracy, "rig": Rig}
_ITEM_TYPES_OF_STUDY_LISTS = {
    "axes": Axis,
    "reductions": Reduction,
    "claims": Claim,
    "references": str,
}


def check_types(study_fields: Mapping[str, Any]) -> None:
    """Raise InvalidValue if the attributes of a study have wrong types."""
    for name, kind in (_TYPES_OF_STUDY_FIELDS | _ITEM_TYPES_OF_STUDY_LISTS).items():
        given = study_fields[name]
        if name in _ITEM_TYPES_OF_STUDY_LISTS and not isinstance(given, list | tuple):
            raise InvalidValue(name, given, f"must be a list of {kind.__name__} objects")
        for value in given if name in _ITEM_TYPES_OF_STUDY_LISTS else [given]:
            if not isinstance(value, kind) and not (name == "rig" and value is None):
                raise InvalidValue(name, value, f"must be made of {kind.__name__} objects")
    if not study_fields["axes"]:
        raise InvalidValue("axes", study_fields["axes"], "must hold at least one axis")


def check_name_clashes(
    measure: Measure, reductions: Sequence[Reduction], axes: Sequence[Axis]
) -> None:
    """Raise InvalidValue for names that are taken, and for reductions of unknown results."""
    measure.check()
    known = list(measure.variables)
    for reduction in reductions:
        if not is_variable_name(reduction.name) or reduction.name in RESERVED_NAMES:
            raise InvalidValue("reduction", reduction.name, "names something else, or nothing")
        if reduction.of not in known:
            raise InvalidValue("reduction of", reduction.of, "is not measured", choices=known)
        known.append(reduction.name)
    taken = {*known, *measure.inner_coordinates, *(RESERVED_NAMES - set(FIELD_NAMES))}
    for axis in axes:
        check_fields_not_solved_for(measure, axis.fields)
        for name in (axis.dimension, *axis.fields):
            if name in taken:
                raise InvalidValue("axis", name, "is the name of something measured")


def check_fields_not_solved_for(measure: Measure, field_names: Sequence[str]) -> None:
    """Raise InvalidValue if the measure solves for one of the fields."""
    for name in field_names:
        if {name, RATIO_FIELD_BY_DIMENSIONAL_NAME.get(name)} & set(measure.solved_fields):
            rule = f"{measure.name} solves for {name}; it cannot be an axis or be set"
            raise InvalidValue(name, "...", rule, remedy="Leave it out.")


def check_user_fields(
    measure: Measure, reductions: Sequence[Reduction], user_field_names: Sequence[str]
) -> None:
    """Raise InvalidValue if a field of a user-defined part has the name of another variable."""
    taken = {*measure.variables, *measure.inner_coordinates}
    taken |= {*RESERVED_NAMES, *QUANTITY_BY_NAME, *(reduction.name for reduction in reductions)}
    for name in user_field_names[len(FIELD_NAMES) :]:
        if name in taken - SLOT_NAMES:
            rule, remedy = "is the name of something else", "Rename the field of your part."
            raise InvalidValue("field", name, rule, remedy=remedy)


def check_axis_fields(
    measure: Measure,
    axes: Sequence[Axis],
    scene_field_names: Sequence[str],
    rig_scenes: LatticeScenesOnRig | None,
) -> None:
    """Raise InvalidValue for axes over unknown fields, and for units without a rig."""
    in_units = rig_scenes.units if rig_scenes else {}
    known = dict.fromkeys((*scene_field_names, *measure.plain_fields, *in_units))
    for axis in axes:
        if not axis.is_single_field and axis.dimension in (*scene_field_names, *axis.fields):
            rule = "is a field: a zipped axis needs a name of its own"
            raise InvalidValue("axis", axis.dimension, rule)
        if axis.units and rig_scenes is None:
            remedy = "Give the study its rig: Study(rig=rig)."
            raise InvalidValue("axis", axis.dimension, "is in units of a rig", remedy=remedy)
        for name in axis.fields:
            if name not in known:
                rule = (
                    "is not a field of a scene, nor a number, flag or text of the measure "
                    f"{measure.name}"
                )
                raise unknown_name_error("field", name, rule, known)


def check_outputs_do_not_vary(
    measure: Measure, measure_field_changes: Iterable[Mapping[str, Any]]
) -> None:
    """Raise InvalidValue if a change of the measure's fields changes which results it has.

    All cells of a lattice must have the same results.
    """
    given = _describe_measure_outputs(measure)
    for changed in (measure.with_(**values) for values in measure_field_changes):
        if _describe_measure_outputs(changed) != given:
            present = measure.plain_fields.items()
            guilty = [n for n, v in changed.plain_fields.items() if (n, v) not in present]
            rule = "decides which numbers are measured, which all cells must share"
            remedy = "Make a study of each value."
            raise InvalidValue("axis", ", ".join(guilty), rule, remedy=remedy)


def check_override_of_partly_set_field(
    base_scene: Scene,
    user_parts: Mapping[str, UserPart],
    axis: Axis,
    field_name: str,
    new_value: Any,
) -> None:
    """Refuse another value of a field that some points of an axis state, and that others take from
    the base.
    """
    stating = [
        point for point, row in zip(axis.point_names, axis.rows, strict=True) if field_name in row
    ]
    if axis.is_single_field or not 0 < len(stating) < len(axis):
        return
    for point, row in zip(axis.point_names, axis.rows, strict=True):
        held = replace_names_by_user_parts({**base_scene.as_dict(), **row}, user_parts)
        if (
            field_name in row
            or not held.get(field_name)
            or field_name in find_inapplicable_fields(held, user_parts.values())
        ):
            continue
        some = format_list(stating, ", ")
        rule = f"is stated by some points of {axis.dimension} alone ({some}), and that of {point} "
        rule += f"is {format_value(held[field_name])}: it would stay"
        remedy = f"Select points of one kind too, as in '{axis.dimension}={stating[0]}'."
        raise InvalidValue(field_name, new_value, rule, remedy=remedy)


def check_axes_are_distinct(axes: Sequence[Axis]) -> None:
    """Refuse axes that repeat a dimension or vary the same field."""
    taken: dict[str, str] = {}
    for axis in axes:
        for name in {
            RATIO_FIELD_BY_DIMENSIONAL_NAME.get(n, n) for n in (axis.dimension, *axis.fields)
        }:
            if name in taken:
                rule = f"varies {name!r}, as {taken[name]!r} does already"
                raise InvalidValue("axis", axis.dimension, rule)
            taken[name] = axis.dimension


def unknown_name_error(
    argument_name: str, unknown_name: str, rule: str, known_names: Collection[str]
) -> InvalidValue:
    remedy = hint_for_unknown_field(unknown_name)
    return InvalidValue(
        argument_name, unknown_name, rule, remedy=remedy, choices=() if remedy else known_names
    )


def _describe_measure_outputs(measure: Measure) -> str:
    """The numbers a measure gives, and the fields it looks for; as text, where NaN equals NaN."""
    inner = {name: np.asarray(at).tolist() for name, at in measure.inner_coordinates.items()}
    return repr((measure.primary_output, dict(measure.variables), inner, measure.solved_fields))
