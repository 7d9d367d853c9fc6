"""Functions that build the parts of a scene from the values of its fields.

The function ``build_scene_parts`` creates the parts, and ``build_field_lookup`` assigns each field
to its part.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import dynamics, fluid, laws, loading, noise, normal_stress, temperature
from rsfstudy.slider.field_name_hints import (
    hint_for_unknown_field,
    hint_for_unknown_part_name,
)
from rsfstudy.slider.noise.none import NoNoise
from rsfstudy.slider.part_registry import (
    PART_CLASS_BY_FIELD_NAME,
    PART_SELECTING_FIELDS,
    PART_SLOT_NAMES,
    PART_SLOTS,
    SLOTS_WITH_PART_CHOSEN_BY_NAME,
    PartSlot,
    UserPart,
    check_and_register_part,
    collect_scene_field_quantities,
    get_part_class,
    replace_part_or_alias_by_part_name,
)
from rsfstudy.slider.parts import Part, list_part_field_names, validate_field_value
from rsfstudy.slider.slider_parameters import (
    ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS,
    SliderParameters,
    add_default_stiffness_ratio,
)
from rsfstudy.slider.temperature.isothermal import Isothermal
from rsfstudy.slider.user_loadings import UserLoading


class SceneParts(NamedTuple):
    """Slider parameters and parts of a scene, with one part per slot.

    Parameters
    ----------
    slider_parameters : SliderParameters
        Parameters that every slider has.
    law : LawBase
        State evolution law.
    normal_stress : NormalStress
        Normal stress condition.
    fluid : Fluid
        Pore fluid.
    dynamics : Dynamics
        Dynamics.
    loading : Loading
        Loading history.
    temperature : Temperature
        Temperature of the fault.
    loading_noise : Noise
        Noise that is added to the loading.
    """

    slider_parameters: SliderParameters
    law: laws.LawBase
    normal_stress: normal_stress.NormalStress
    fluid: fluid.Fluid
    dynamics: dynamics.Dynamics
    loading: loading.Loading
    temperature: temperature.Temperature = Isothermal()
    loading_noise: noise.Noise = NoNoise()


def build_scene_parts(field_values: Mapping[str, Any]) -> SceneParts:
    """Build the parts of a scene from its fields.

    Parameters
    ----------
    field_values : mapping of str to object
        Values of the fields by name. Fields with the value None are ignored.

    Returns
    -------
    SceneParts
        Parts with the values of the fields.

    Raises
    ------
    InvalidValue
        If a name is not a field, or if a value violates its rule or does not apply in this scene.
    """
    chosen = tuple(_select_part_for_slot(slot, field_values) for slot in PART_SLOTS)
    layout = build_field_lookup(tuple(map(get_part_class, chosen)))
    values = _group_values_by_part_index(field_values, layout)
    made: list[Any] = [
        part(**values.get(place, {})) if isinstance(part, type) else part
        for place, part in enumerate(chosen, start=1)
    ]
    return SceneParts(SliderParameters(**add_default_stiffness_ratio(values.get(0, {}))), *made)


def replace_field_values(
    scene_parts: SceneParts, changed_field_values: Mapping[str, Any]
) -> SceneParts:
    """Return parts with new values of some fields.

    Parameters
    ----------
    scene_parts : SceneParts
        Parts of a scene.
    changed_field_values : mapping of str to object
        New values by field name. Each field must belong to one of the parts.

    Returns
    -------
    SceneParts
        Parts with the new values. Parts without a changed field are reused.

    Raises
    ------
    InvalidValue
        If a value violates its rule or does not apply to the parts.
    """
    made: list[Any] = list(scene_parts)
    for place, values in _group_values_by_part_index(
        changed_field_values, build_field_lookup(tuple(map(type, scene_parts[1:])))
    ).items():
        if any(name in values for name in ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS):
            values = {
                **dict.fromkeys(ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS),
                **add_default_stiffness_ratio(values),
            }
        made[place] = replace(made[place], **values)
    return SceneParts._make(made)


def _group_values_by_part_index(
    field_values: Mapping[str, Any], field_lookup: FieldLookup
) -> dict[int, dict[str, Any]]:
    """Validate the field values, and group them by the index of their part.

    Fields with the value None are omitted.
    """
    values: dict[int, dict[str, Any]] = {}
    kinds, places, idle = (
        field_lookup.part_classes,
        field_lookup.part_index_by_field,
        field_lookup.value_by_inactive_field,
    )
    for name, value in field_values.items():
        place = places.get(name)
        if place is not None:
            if value is not None:
                values.setdefault(place, {})[name] = validate_field_value(kinds[place], name, value)
        elif name in idle:
            # A field that selects another part is accepted if its value does not select the part.
            if value is None or value is idle[name]:
                continue
            owner = PART_CLASS_BY_FIELD_NAME[name]
            if name != owner.field_name_that_selects_part or validate_field_value(
                owner, name, value
            ):
                raise field_lookup.rejecting_part_class_by_field[name].build_field_rejection_error(
                    name, value
                )
        elif name not in PART_SLOT_NAMES:
            raise _build_unknown_field_error(name, value, field_lookup)
    return values


def _select_part_for_slot(slot: PartSlot, field_values: Mapping[str, Any]) -> UserPart:
    """Return the part that the fields select for a slot."""
    value = field_values.get(slot.name)
    if isinstance(value, type | UserLoading):
        return check_and_register_part(slot, value)
    if isinstance(value, str) and value in slot.user_parts and value not in slot.built_in_parts:
        return slot.user_parts[value]
    if not slot.part_class_by_selecting_field:
        name = replace_part_or_alias_by_part_name(
            slot.name, field_values.get(slot.name, slot.default_part_name)
        )
        if not isinstance(name, str) or name not in slot.built_in_parts:
            choices = (*slot.built_in_parts, *slot.user_parts)
            remedy = hint_for_unknown_part_name(slot.name, name, choices)
            raise InvalidValue(slot.name, name, "is unknown", choices=choices, remedy=remedy)
        return slot.built_in_parts[name]
    if value is not None:
        others = ", ".join(slot.part_class_by_selecting_field) or "the other fields"
        remedy = f"To select a built-in loading, set its field: {others}."
        raise InvalidValue(slot.name, value, "is unknown", choices=slot.user_parts, remedy=remedy)
    for caller, part in slot.part_class_by_selecting_field.items():
        value = field_values.get(caller)
        if value is not None and validate_field_value(part, caller, value):
            return part
    return slot.built_in_parts[slot.default_part_name]


class FieldLookup(NamedTuple):
    """Table that assigns each field to a part of the scene.

    Parameters
    ----------
    part_classes : tuple of type
        Classes of the parts, starting with ``SliderParameters``.
    part_index_by_field : mapping of str to int
        Index of the part that owns each field.
    rejecting_part_class_by_field : mapping of str to type
        Class of the part that rejects each field, by field name. The mapping contains the fields
        that do not belong to any part of the scene.
    value_by_inactive_field : mapping of str to object
        Values of the fields that do not belong to any part of the scene.
    inapplicable_field_names : frozenset of str
        Names of the fields that do not apply to the scene, whatever their values are. Fields that
        would select another part are not included.
    slot_names_with_part_chosen_by_name : tuple of str
        Names of the slots whose parts are selected by name.
    all_field_names : tuple of str
        Names of all fields, including the fields of user-defined parts.
    names_of_fields_not_selecting_a_part : frozenset of str
        Names of the fields that do not select a part.
    """

    part_classes: tuple[type[Part], ...]
    part_index_by_field: Mapping[str, int]
    rejecting_part_class_by_field: Mapping[str, type[Part]]
    value_by_inactive_field: Mapping[str, Any]
    inapplicable_field_names: frozenset[str]
    slot_names_with_part_chosen_by_name: tuple[str, ...]
    all_field_names: tuple[str, ...]
    names_of_fields_not_selecting_a_part: frozenset[str]


@cache
def build_field_lookup(part_classes: tuple[type[Part], ...]) -> FieldLookup:
    """Build the table that assigns scene fields to parts, given the part classes.

    Parameters
    ----------
    part_classes : tuple of type
        Classes of the parts in the order of the slots.

    Returns
    -------
    FieldIndex
        Assignment of the fields to the parts.

    Raises
    ------
    InvalidValue
        If two parts have a field with the same name.
    """
    kinds: tuple[type[Part], ...] = (SliderParameters, *part_classes)
    filled = list(zip(PART_SLOTS, part_classes, strict=True))
    owned = {slot.name: part for slot, part in filled if part not in slot.built_in_parts.values()}
    places = {
        name: place for place, part in enumerate(kinds) for name in list_part_field_names(part)
    }
    if len(places) < sum(len(list_part_field_names(part)) for part in kinds):
        names = ", ".join(part.name for part in owned.values())
        raise InvalidValue(
            "parts", names, "have fields with the same name", remedy="Rename one of the fields."
        )
    refusing: dict[str, type[Part]] = {}
    idle: dict[str, Any] = {}
    foreign: set[str] = set()
    for slot, part in filled:
        for other in slot.built_in_parts.values():
            for name in set(list_part_field_names(other)) - set(places):
                refusing[name] = part
                calls = name == other.field_name_that_selects_part
                idle[name] = other.__dataclass_fields__[name].default if calls else None
                if not calls or slot.name in owned:
                    foreign.add(name)
    named = tuple(
        slot.name
        for slot in PART_SLOTS
        if slot in SLOTS_WITH_PART_CHOSEN_BY_NAME or slot.name in owned
    )
    fields = tuple(collect_scene_field_quantities(owned.values()))
    plain = frozenset(fields) - {*PART_SLOT_NAMES, *PART_SELECTING_FIELDS}
    return FieldLookup(kinds, places, refusing, idle, frozenset(foreign), named, fields, plain)


def find_inapplicable_fields(
    field_values: Mapping[str, Any], user_parts: Iterable[UserPart] = ()
) -> frozenset[str]:
    """Find the fields that do not apply to the selected parts.

    Parameters
    ----------
    field_values : mapping of str to object
        Field values that select the parts.
    user_parts : iterable of type or UserLoading, optional
        User-defined parts whose fields are also examined.

    Returns
    -------
    frozenset of str
        Names of the fields that belong to other parts. The set is empty if the values do not select
        valid parts.
    """
    try:
        layout = build_field_lookup(
            tuple(get_part_class(_select_part_for_slot(slot, field_values)) for slot in PART_SLOTS)
        )
    except InvalidValue:
        return frozenset()
    of_others = {
        name for part in user_parts for name in list_part_field_names(get_part_class(part))
    }
    return layout.inapplicable_field_names | (of_others - set(layout.part_index_by_field))


def find_user_parts(scene_parts: SceneParts) -> dict[str, UserPart]:
    """Find the user-defined parts of a scene.

    Parameters
    ----------
    scene_parts : SceneParts
        Parts of the scene.

    Returns
    -------
    dict of str to type or UserLoading
        User-defined parts by slot. Protocols and sampled histories are included as objects, and
        other parts as classes.
    """
    filled = zip(PART_SLOTS, scene_parts[1:], strict=True)
    return {
        slot.name: part if isinstance(part, UserLoading) else type(part)
        for slot, part in filled
        if type(part) not in slot.built_in_parts.values()
    }


def _build_unknown_field_error(name: str, value: Any, field_lookup: FieldLookup) -> InvalidValue:
    """Return the error for an unknown field name."""
    for slot, part in zip(PART_SLOTS, field_lookup.part_classes[1:], strict=True):
        known = map(get_part_class, slot.user_parts.values())
        owner = next((other for other in known if name in list_part_field_names(other)), None)
        if owner is not None:
            rule = f"does not apply to {slot.name}={part.name!r}"
            remedy = f"Omit {name}, or set {slot.name}={owner.name!r}."
            return InvalidValue(name, value, rule, remedy=remedy)
    remedy, rule = hint_for_unknown_field(name), "is not a scene field"
    # If the name is a known synonym of a field, a list of similar names would be misleading.
    return InvalidValue(
        "field", name, rule, choices=() if remedy else field_lookup.all_field_names, remedy=remedy
    )
