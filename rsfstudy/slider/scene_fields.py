"""Class that provides the names, quantities, types, defaults and checks of scene fields.

The class ``SceneFields`` is the interface to the scene fields for other packages. The functions of
this class are defined in the modules ``part_registry``, ``scene_assembly`` and
``field_name_hints``.
"""

from __future__ import annotations

from rsfstudy.slider import (
    field_name_hints,
    part_registry,
    parts,
    scene_assembly,
    slider_parameters,
)


class SceneFields:
    """Class that describes scene fields and registers user-defined parts, which add fields."""

    #: Names, quantities and types of the fields of built-in parts.
    NAMES = part_registry.SCENE_FIELD_NAMES
    QUANTITIES = part_registry.SCENE_FIELD_QUANTITIES
    VALUE_TYPE_BY_NAME = part_registry.PYTHON_TYPE_BY_SCENE_FIELD
    #: Fields whose values are parts, and fields that determine which part is used.
    PART_SLOT_NAMES = part_registry.PART_SLOT_NAMES
    PART_SELECTING_FIELD_NAMES = part_registry.PART_SELECTING_FIELDS
    #: Slots of a scene, and the available parts for each slot.
    PART_SLOTS = part_registry.PART_SLOTS
    #: Values that are omitted from stored scenes.
    DEFAULTS_OMITTED_FROM_STORED_SCENES = part_registry.DEFAULTS_OMITTED_FROM_STORED_SCENES
    #: Alternative fields for the stiffness. A scene has at most one of these fields.
    ALTERNATIVE_NAMES_FOR_STIFFNESS = slider_parameters.ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS

    list_part_field_names = staticmethod(parts.list_part_field_names)
    map_field_names_to_value_types = staticmethod(
        part_registry.collect_python_types_of_scene_fields
    )
    map_field_names_to_defaults = staticmethod(part_registry.collect_scene_field_defaults)
    map_field_names_to_quantities = staticmethod(part_registry.collect_scene_field_quantities)
    iterate_quantities_with_values = staticmethod(part_registry.iterate_quantities_with_values)
    add_fields_to_signature = staticmethod(part_registry.add_scene_fields_to_signature)
    replace_part_or_alias_by_part_name = staticmethod(
        part_registry.replace_part_or_alias_by_part_name
    )
    find_inapplicable_fields = staticmethod(scene_assembly.find_inapplicable_fields)
    build_hint_for_unknown_field = staticmethod(field_name_hints.hint_for_unknown_field)
    register_user_parts = staticmethod(part_registry.register_user_parts)
    replace_names_by_user_parts = staticmethod(part_registry.replace_names_by_user_parts)
