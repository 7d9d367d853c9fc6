"""Base class of scenes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Self

from rsfstudy._deprecation import translate_former_member_name
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.quantities import HtmlTableMixin, Quantity
from rsfstudy.slider.field_name_hints import hint_for_positional_argument
from rsfstudy.slider.part_registry import (
    DEFAULTS_OMITTED_FROM_STORED_SCENES,
    PART_SLOT_NAMES,
    SLOTS_WITH_PART_CHOSEN_BY_NAME,
    UserPart,
    add_scene_fields_to_signature,
    iterate_quantities_with_values,
)
from rsfstudy.slider.scene_assembly import (
    FieldLookup,
    SceneParts,
    build_field_lookup,
    build_scene_parts,
    find_inapplicable_fields,
    find_user_parts,
    replace_field_values,
)
from rsfstudy.slider.scene_caching import cached_attribute
from rsfstudy.slider.slider_parameters import ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS

#: Names of internal scene attributes, which ``dir`` does not list.
_ATTRIBUTES_HIDDEN_FROM_DIR = frozenset(
    {
        "field_lookup",
        "result_cache",
        "friction_law_functions",
        "parameter_values",
        "friction_parameter_values",
        "stored_fields",
        "with_segment",
        "iterate_quantities_with_values",
    }
)


@make_methods_raise_rsfstudy_errors
class SceneBase(HtmlTableMixin):
    """Base class of scenes.

    The class makes the fields of all parts available as attributes of the scene.

    Parameters
    ----------
    parts : SceneParts, optional
        Parts of the scene. By default, the parts are built from the values of the fields.
    **given : object
        Values of the fields.
    """

    parts: SceneParts

    def __init__(self, parts: SceneParts | None = None, /, **given: Any) -> None:
        """Build and check the parts of the scene."""
        if parts is None:
            parts = build_scene_parts(given)
        elif not isinstance(parts, SceneParts):
            raise build_positional_argument_error(parts)
        object.__setattr__(self, "parts", parts)
        self._check_parts_and_compatibility()

    def _check_parts_and_compatibility(self) -> None:
        """Raise ``InvalidValue`` if the parts are incompatible."""

    def __getattr__(self, name: str) -> Any:
        """Return the value of a field. Each field belongs to a part of the scene."""
        if name.startswith("_"):
            raise AttributeError(name)
        layout = self.field_lookup
        if name in layout.part_index_by_field:
            return getattr(self.parts[layout.part_index_by_field[name]], name)
        if name in layout.slot_names_with_part_chosen_by_name:
            return getattr(self.parts, name).name
        if name in layout.value_by_inactive_field:
            return layout.value_by_inactive_field[name]
        if (new := translate_former_member_name(SceneBase, name)) == name:
            raise AttributeError(f"a {SceneBase.__name__} has no field or attribute {name!r}")
        return getattr(self, new)

    def __repr__(self) -> str:
        """Return Python code that creates the scene."""
        return f"Scene({', '.join(f'{k}={v!r}' for k, v in self.as_dict().items())})"

    def __dir__(self) -> list[str]:
        """Return the names of the public attributes and of the fields with a value."""
        # Fields without a value may be properties that are computed from other fields.
        stated = {name for name, value in self.as_dict().items() if value is not None}
        names = {*super().__dir__(), *stated} - _ATTRIBUTES_HIDDEN_FROM_DIR
        return [name for name in names if not name.startswith("_")]

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the function and the arguments with which pickle creates the scene."""
        return type(self), (self.parts,)

    @cached_attribute
    def field_lookup(self) -> FieldLookup:
        """Index that assigns each field to a part of the scene."""
        return build_field_lookup(tuple(map(type, self.parts[1:])))

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as plain Python values.

        Some slots, such as ``temperature``, did not exist in the first file format. If such a slot
        contains its default part, the slot is omitted from the dictionary.

        Returns
        -------
        dict of str to object
            Values by field name.
        """
        values = dict(self.field_lookup.value_by_inactive_field)
        for name in self.field_lookup.slot_names_with_part_chosen_by_name:
            values[name] = getattr(self.parts, name).name
        for part in self.parts:
            values |= vars(part)
        return {
            name: values[name]
            for name in self.field_lookup.all_field_names
            if name not in DEFAULTS_OMITTED_FROM_STORED_SCENES
            or values[name]
            != (DEFAULTS_OMITTED_FROM_STORED_SCENES[name] if name in PART_SLOT_NAMES else None)
        }

    def stored_fields(self) -> dict[str, Any]:
        """Return the fields that identify the scene in files and in journals.

        Returns
        -------
        dict of str to object
            Values by field name. A field that was added to rsfstudy in a later version is omitted
            if the field has its default value (see ``number``). The files and journals of earlier
            versions therefore remain valid.
        """
        values = self.as_dict()
        for name, default in DEFAULTS_OMITTED_FROM_STORED_SCENES.items():
            if name in values and values[name] == default:
                del values[name]
        return values

    def describe(self) -> dict[str, Any]:
        """Return the stored fields and the contents of a user-defined loading.

        Returns
        -------
        dict of str to object
            Values by field name, as ``stored_fields`` returns them. If the loading is a protocol,
            the dictionary also contains the segments in the format that ``protocol`` accepts. If
            the loading is a sampled history, the dictionary also contains the digest of the
            samples.
        """
        history = (
            self.parts.loading.describe()
            if "loading" in self.field_lookup.slot_names_with_part_chosen_by_name
            else {}
        )
        return self.stored_fields() | history

    @property
    def user_parts(self) -> tuple[UserPart, ...]:
        """User-defined parts of the scene."""
        return tuple(find_user_parts(self.parts).values())

    def iterate_quantities_with_values(self) -> Iterator[tuple[Quantity, object]]:
        """Iterate over the fields that have a value.

        Returns
        -------
        iterator of (Quantity, object)
            Pairs of the quantity that describes a field and the value of the field.
        """
        return iterate_quantities_with_values(self.as_dict(), self.user_parts)

    @add_scene_fields_to_signature()
    def with_(self, **changes: Any) -> Self:
        """Return a copy of the scene with new values of some fields.

        The method checks the new values. If a change replaces a part of the scene, fields that do
        not exist in the new part are dropped. If you set ``stiffness``, the copy has no
        ``stiffness_ratio``, and vice versa.

        Parameters
        ----------
        **changes : object
            New values by field name.

        Returns
        -------
        Scene
            New scene.

        Raises
        ------
        InvalidValue
            If a value is invalid in the new scene.
        """
        if all(
            n in self.field_lookup.names_of_fields_not_selecting_a_part and value is not None
            for n, value in changes.items()
        ):
            return type(self)(replace_field_values(self.parts, changes))
        theirs = find_user_parts(self.parts)
        kept = {**self.as_dict(), **theirs}
        dropped = find_inapplicable_fields({**kept, **changes}, theirs.values())
        if any(changes.get(name) is not None for name in ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS):
            dropped |= {*ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS}
        return type(self)(**{name: kept[name] for name in kept if name not in dropped} | changes)


def build_positional_argument_error(value: Any) -> InvalidValue:
    """Return the error for a positional argument of ``Scene``.

    Parameters
    ----------
    value : object
        Value of the argument.

    Returns
    -------
    InvalidValue
        Error whose message suggests the name of the field.
    """
    remedy = hint_for_positional_argument(
        value, {slot.name: slot.built_in_parts for slot in SLOTS_WITH_PART_CHOSEN_BY_NAME}
    )
    return InvalidValue("Scene()", value, "accepts keyword arguments only", remedy=remedy)
