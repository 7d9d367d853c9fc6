"""Names, quantities, types, defaults and checks of scene fields.

The class ``SceneFields`` is the interface to the scene fields for other packages. The functions are
defined in the modules ``part_registry``, ``scene_assembly`` and ``field_name_hints``.
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
    """Fields of scenes, and the user-defined parts that add fields to scenes."""

    #: Names, quantities and types of the fields of built-in parts.
    NAMES = part_registry.SCENE_FIELD_NAMES
    QUANTITIES = part_registry.SCENE_FIELD_QUANTITIES
    TYPES = part_registry.SCENE_FIELD_TYPES
    #: Fields whose values are parts, and fields that determine which part is used.
    SLOT_NAMES = part_registry.SLOT_NAMES
    SELECTING_A_PART = part_registry.PART_SELECTING_FIELDS
    #: Slots of a scene, and the available parts for each slot.
    SLOTS = part_registry.SLOTS
    #: Values that are omitted from stored scenes.
    OMITTED_DEFAULTS = part_registry.OMITTED_DEFAULTS
    #: Alternative fields for the stiffness. A scene has at most one of these fields.
    ALTERNATIVE_STIFFNESS = slider_parameters.ALTERNATIVE_STIFFNESS_FIELDS

    names_of_part = staticmethod(parts.field_names)
    types_with_user_parts = staticmethod(part_registry.scene_field_types)
    defaults = staticmethod(part_registry.scene_field_defaults)
    quantities_with_user_parts = staticmethod(part_registry.scene_field_quantities)
    quantities_with_values = staticmethod(part_registry.quantities_with_values)
    add_to_signature = staticmethod(part_registry.add_scene_fields_to_signature)
    normalise_value = staticmethod(part_registry.normalise_field_value)
    find_inapplicable = staticmethod(scene_assembly.find_inapplicable_fields)
    hint_for_unknown = staticmethod(field_name_hints.hint_for_unknown_field)
    register_user_parts = staticmethod(part_registry.register_user_parts)
    replace_names_by_user_parts = staticmethod(part_registry.replace_names_by_user_parts)
