"""Checks of study declarations.

The functions check types and names, and check which fields the axes vary. The constructor of
``Study`` calls most of these functions.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from rsfstudy.axes import Axis
from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import format_abbreviated_list, format_number_or_text
from rsfstudy.measures import RESERVED_NAMES, Measure
from rsfstudy.motion import Accuracy
from rsfstudy.quantities import is_valid_variable_name
from rsfstudy.rig import Rig, RigAxes, RigAxesToScenesConverter
from rsfstudy.slider import Scene, SceneFields, UserPart
from rsfstudy.study.claims import Claim
from rsfstudy.study.reductions.reduction_application import Reduction
from rsfstudy.vocabulary import QUANTITY_BY_NAME

#: Required types of the attributes of a study, and of the items of its list attributes. The rig is
#: optional.
_TYPES_OF_STUDY_FIELDS = {"base": Scene, "measure": Measure, "accuracy": Accuracy, "rig": Rig}
_ITEM_TYPES_OF_STUDY_LISTS = {
    "axes": Axis,
    "reductions": Reduction,
    "claims": Claim,
    "references": str,
}


def check_study_field_types(study_fields: Mapping[str, Any]) -> None:
    """Raise InvalidValue if the attributes of a study have wrong types.

    Parameters
    ----------
    study_fields : mapping of str to object
        Attributes of the study by name.

    Raises
    ------
    InvalidValue
        If an attribute has a wrong type, or if there are no axes.
    """
    for name, kind in (_TYPES_OF_STUDY_FIELDS | _ITEM_TYPES_OF_STUDY_LISTS).items():
        given, is_list = study_fields[name], name in _ITEM_TYPES_OF_STUDY_LISTS
        if is_list and not isinstance(given, list | tuple):
            raise InvalidValue(name, given, f"must be a list of {kind.__name__} objects")
        for value in given if is_list else [given]:
            if not isinstance(value, kind) and not (name == "rig" and value is None):
                rule = f"must be a {kind.__name__} object"
                rule = f"must contain {kind.__name__} objects" if is_list else rule
                raise InvalidValue(name, value, rule)
    if not study_fields["axes"]:
        raise InvalidValue("axes", study_fields["axes"], "must contain at least one axis")


def check_name_clashes(
    measure: Measure, reductions: Sequence[Reduction], axes: Sequence[Axis]
) -> None:
    """Raise InvalidValue if a name is unknown, reserved or used twice.

    Parameters
    ----------
    measure : Measure
        Measure of the study.
    reductions : sequence of Reduction
        Reductions of the study.
    axes : sequence of Axis
        Axes of the study.

    Raises
    ------
    InvalidValue
        If a reduction or an axis has a name that is already used or reserved, if a reduction
        reduces an unknown variable, or if the measure solves for a field of an axis.
    """
    measure.check()
    known = list(measure.variables)
    for reduction in reductions:
        if not is_valid_variable_name(reduction.name):
            rule = "must be a valid Python identifier, because it is used as a variable name"
            raise InvalidValue("name of the reduction", reduction.name, rule)
        if reduction.name in RESERVED_NAMES:
            remedy = "Rename the reduction."
            raise InvalidValue("reduction", reduction.name, "has a reserved name", remedy=remedy)
        if reduction.of not in known:
            raise InvalidValue(
                "variable",
                reduction.of,
                "is not a result of the study",
                choices=known,
            )
        known.append(reduction.name)
    taken = {*known, *measure.output_coordinates, *(RESERVED_NAMES - set(SceneFields.NAMES))}
    for axis in axes:
        check_fields_not_solved_by_measure(measure, axis.fields)
        for name in (axis.dimension, *axis.fields):
            if name in taken:
                remedy = "Rename the result or the field of the axis."
                raise InvalidValue("axis", name, "has the same name as a result", remedy=remedy)


def check_fields_not_solved_by_measure(measure: Measure, field_names: Sequence[str]) -> None:
    """Raise InvalidValue if one of the fields is computed by the measure.

    Parameters
    ----------
    measure : Measure
        Measure of the study.
    field_names : sequence of str
        Names of the fields to check.

    Raises
    ------
    InvalidValue
        If the measure solves for one of the fields, or for a ratio that is equivalent to one of the
        fields.
    """
    for name in field_names:
        if {name, RigAxes.RATIO_FIELD_BY_DIMENSIONAL_NAME.get(name)} & set(measure.solved_fields):
            rule = f"is computed by {measure.name}, so it cannot be an axis or an override"
            raise InvalidValue(name, ..., rule, remedy=f"Omit {name}.")


def check_user_field_names_are_unused(
    measure: Measure, reductions: Sequence[Reduction], scene_field_names: Sequence[str]
) -> None:
    """Raise InvalidValue if a user-defined part has a reserved field name.

    Parameters
    ----------
    measure : Measure
        Measure of the study.
    reductions : sequence of Reduction
        Reductions of the study.
    scene_field_names : sequence of str
        Names of all scene fields. The fields of user-defined parts follow the built-in fields.

    Raises
    ------
    InvalidValue
        If a field has the name of a result, of a reduction, or of a quantity in the vocabulary.
    """
    taken = {*measure.variables, *measure.output_coordinates}
    taken |= {*RESERVED_NAMES, *QUANTITY_BY_NAME, *(reduction.name for reduction in reductions)}
    for name in scene_field_names[len(SceneFields.NAMES) :]:
        if name in taken - SceneFields.PART_SLOT_NAMES:
            rule, remedy = (
                "is already used for another quantity",
                ("Rename the field of the user-defined part."),
            )
            raise InvalidValue("field", name, rule, remedy=remedy)


def check_axis_fields_and_units(
    measure: Measure,
    axes: Sequence[Axis],
    scene_field_names: Sequence[str],
    axis_unit_converter: RigAxesToScenesConverter | None,
) -> None:
    """Raise InvalidValue if an axis has unknown fields or unexpected units.

    Parameters
    ----------
    measure : Measure
        Measure of the study.
    axes : sequence of Axis
        Axes of the study.
    scene_field_names : sequence of str
        Names of all scene fields.
    axis_unit_converter : RigAxesToScenesConverter or None
        Converter of axis values with units, or None if the study has no rig.

    Raises
    ------
    InvalidValue
        If an axis varies an unknown field, if a zipped axis has the name of a field, or if an axis
        has units and the study has no rig.
    """
    in_units = axis_unit_converter.units_by_axis_name if axis_unit_converter else {}
    known = dict.fromkeys((*scene_field_names, *measure.scalar_field_values, *in_units))
    for axis in axes:
        if not axis.varies_single_field and axis.dimension in (*scene_field_names, *axis.fields):
            rule = "has the same name as a field, which is not permitted for a zipped axis"
            raise InvalidValue("axis", axis.dimension, rule, remedy="Rename the axis.")
        if axis.units and axis_unit_converter is None:
            remedy = "Pass the rig to the study: Study(rig=rig)."
            raise InvalidValue(
                "axis", axis.dimension, "has units, but the study has no rig", remedy=remedy
            )
        for name in axis.fields:
            if name not in known:
                rule = (
                    "is unknown. The name must be a scene field, or a field of the "
                    f"{measure.name} measure that is a number, a flag or a string"
                )
                raise build_unknown_name_error("field", name, rule, known)


def check_outputs_are_same_in_all_cells(
    measure: Measure, measure_field_changes_of_cells: Iterable[Mapping[str, Any]]
) -> None:
    """Raise InvalidValue if the cells of a study have different result variables.

    All cells of a lattice must have the same result variables.

    Parameters
    ----------
    measure : Measure
        Measure of the study.
    measure_field_changes_of_cells : iterable of mapping of str to object
        New values of measure fields in each cell, by field name.

    Raises
    ------
    InvalidValue
        If the measure computes different variables in different cells.
    """
    given = _describe_measure_outputs(measure)
    for changed in (measure.with_(**values) for values in measure_field_changes_of_cells):
        if _describe_measure_outputs(changed) != given:
            present = measure.scalar_field_values.items()
            guilty = [n for n, v in changed.scalar_field_values.items() if (n, v) not in present]
            rule = (
                "cannot vary along an axis, because it determines which variables are computed, "
                "and all cells of a study must compute the same variables"
            )
            names = ", ".join(guilty)
            remedy = f"Create a separate study for each value of {names!r}."
            raise InvalidValue("field", names, rule, remedy=remedy)


def check_field_is_set_at_all_axis_points(
    base_scene: Scene,
    user_parts: Mapping[str, UserPart],
    axis: Axis,
    field_name: str,
    new_value: Any,
) -> None:
    """Raise InvalidValue if an overridden field is set at only some axis points.

    At the other axis points, the field has the value of the base scene, and the override would not
    change this value. The override is accepted if, at the other axis points, the value is None or
    zero, or the field does not apply to the scene.

    Parameters
    ----------
    base_scene : Scene
        Base scene of the study.
    user_parts : mapping of str to type or UserLoading
        User-defined parts by name.
    axis : Axis
        Axis of the study.
    field_name : str
        Name of the field to override.
    new_value : object
        New value, which is shown in the error message.

    Raises
    ------
    InvalidValue
        If the override would change the field at only some of the axis points.
    """
    stating = [
        point for point, row in zip(axis.point_names, axis.rows, strict=True) if field_name in row
    ]
    if axis.varies_single_field or not 0 < len(stating) < len(axis):
        return
    for point, row in zip(axis.point_names, axis.rows, strict=True):
        held = SceneFields.replace_names_by_user_parts({**base_scene.as_dict(), **row}, user_parts)
        if (
            field_name in row
            or not held.get(field_name)
            or field_name in SceneFields.find_inapplicable_fields(held, user_parts.values())
        ):
            continue
        some = format_abbreviated_list(stating, ", ")
        rule = (
            f"is set only at some points of {axis.dimension} ({some}). The override would not "
            f"change the value at {point}, "
        )
        rule += f"which is {format_number_or_text(held[field_name])}"
        remedy = (
            f"Also select points that set the field, for example '{axis.dimension}={stating[0]}'."
        )
        raise InvalidValue(field_name, new_value, rule, remedy=remedy)


def check_axes_are_distinct(axes: Sequence[Axis]) -> None:
    """Raise InvalidValue if two axes have the same dimension or the same field.

    Parameters
    ----------
    axes : sequence of Axis
        Axes of the study.

    Raises
    ------
    InvalidValue
        If an axis varies the dimension or field of a preceding axis. A velocity and its ratio to
        the reference velocity are regarded as the same field.
    """
    taken: dict[str, str] = {}
    for axis in axes:
        for name in {
            RigAxes.RATIO_FIELD_BY_DIMENSIONAL_NAME.get(n, n)
            for n in (axis.dimension, *axis.fields)
        }:
            if name in taken:
                rule = f"varies the field {name!r}, which axis {taken[name]!r} already varies"
                remedy = "Remove one of the two axes."
                raise InvalidValue("axis", axis.dimension, rule, remedy=remedy)
            taken[name] = axis.dimension


def build_unknown_name_error(
    argument_name: str, unknown_name: str, violated_rule_text: str, known_names: Collection[str]
) -> InvalidValue:
    """Create the error for an unknown name.

    Parameters
    ----------
    argument_name : str
        Name of the argument that contains the unknown name.
    unknown_name : str
        Unknown name.
    violated_rule_text : str
        Rule that the name violates.
    known_names : collection of str
        Known names. The error message lists similar known names, unless there is a hint for the
        unknown name.

    Returns
    -------
    InvalidValue
        Error to raise.
    """
    remedy = SceneFields.build_hint_for_unknown_field(unknown_name)
    return InvalidValue(
        argument_name,
        unknown_name,
        violated_rule_text,
        remedy=remedy,
        choices=() if remedy else known_names,
    )


def _describe_measure_outputs(measure: Measure) -> str:
    """Describe the results of a measure and the fields that the measure solves for.

    The description is a string, so that two descriptions with NaN values can be equal. As numbers,
    two NaN values are never equal.
    """
    inner = {name: np.asarray(at).tolist() for name, at in measure.output_coordinates.items()}
    return repr((measure.primary_output, dict(measure.variables), inner, measure.solved_fields))
