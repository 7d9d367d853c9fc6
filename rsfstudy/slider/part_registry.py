"""Registry that lists the slots of scenes, the available parts and their fields.

The registry lists the parts that can fill each slot, and the fields that the parts add to a scene.
A user-defined part is a class that is derived from the base class of a slot. A user-defined part is
registered by its name when the part is first used in a process. If a notebook cell with the class
is run again, the new class replaces the old class. The registry rejects a class whose name belongs
to another part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from inspect import Parameter, getattr_static, signature
from types import FunctionType
from typing import Any, TypeVar

from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import Quantity, is_valid_variable_name
from rsfstudy.slider import dynamics, fluid, laws, loading, noise, normal_stress, temperature
from rsfstudy.slider.field_name_hints import replace_law_alias_by_law_name
from rsfstudy.slider.parts import (
    Part,
    is_boolean_field,
    list_part_field_names,
    list_part_field_quantities,
)
from rsfstudy.slider.quantities_required_by_parts import check_names_of_needed_quantities
from rsfstudy.slider.slider_parameters import SliderParameters
from rsfstudy.slider.user_loadings import UserLoading

DecoratedFunction = TypeVar("DecoratedFunction", bound=Callable[..., Any])
#: User-defined part: the class of a part, or a loading object such as a protocol.
UserPart = type[Part] | UserLoading


@dataclass(frozen=True)
class PartSlot:
    """Slot of a scene. Each slot of a scene contains one part.

    Parameters
    ----------
    name : str
        Name of the slot.
    base_class : type
        Base class of the parts.
    built_in_parts : mapping of str to type
        Built-in parts by name.
    default_part_name : str
        Name of the default part.
    long_name : str
        Description of the slot.
    user_parts : dict of str to type or UserLoading, optional
        User-defined parts that have been used in this process, by name.
    omits_default_from_stored_scenes : bool, default: False
        If True, the name of the default part is omitted from the keys of cells and from stored
        scenes. Use True for every slot that is added in a later version of rsfstudy, so that
        existing journals and files stay valid.
    """

    name: str
    base_class: type[Part]
    built_in_parts: Mapping[str, type[Part]]
    default_part_name: str
    long_name: str
    user_parts: dict[str, UserPart] = field(default_factory=dict)
    omits_default_from_stored_scenes: bool = False

    @property
    def quantity_of_selecting_field(self) -> Quantity:
        """``Quantity`` that describes the scene field with the name of the slot."""
        return Quantity(self.name, "", "", self.long_name)

    @cached_property
    def part_class_by_selecting_field(self) -> Mapping[str, type[Part]]:
        """Mapping from each field that selects a part to the class of this part."""
        return {
            part.field_name_that_selects_part: part
            for part in self.built_in_parts.values()
            if part.field_name_that_selects_part
        }


PART_SLOTS: tuple[PartSlot, ...] = (
    PartSlot("law", laws.LawBase, laws.BUILT_IN_LAW_CLASS_BY_NAME, "slip", "state evolution law"),
    PartSlot(
        "normal_stress",
        normal_stress.NormalStress,
        normal_stress.BUILT_IN_NORMAL_STRESS_CLASS_BY_NAME,
        "variable",
        "normal stress condition",
    ),
    PartSlot(
        "fluid",
        fluid.Fluid,
        fluid.BUILT_IN_FLUID_CLASS_BY_NAME,
        "drained",
        "fluid in the pores of the fault",
    ),
    PartSlot(
        "dynamics",
        dynamics.Dynamics,
        dynamics.BUILT_IN_DYNAMICS_CLASS_BY_NAME,
        "quasi_static",
        "force that balances the spring in addition to friction",
    ),
    PartSlot(
        "loading",
        loading.Loading,
        loading.BUILT_IN_LOADING_CLASS_BY_NAME,
        "step",
        "motion of the load point",
    ),
    PartSlot(
        "temperature",
        temperature.Temperature,
        temperature.BUILT_IN_TEMPERATURE_CLASS_BY_NAME,
        "isothermal",
        "temperature of the fault",
        omits_default_from_stored_scenes=True,
    ),
    PartSlot(
        "loading_noise",
        noise.Noise,
        noise.BUILT_IN_NOISE_CLASS_BY_NAME,
        "none",
        "noise that is added to the loading",
        omits_default_from_stored_scenes=True,
    ),
)
#: Slots whose part is selected by name. In the other slots, the values of fields such as
#: ``inertia`` select the part.
SLOTS_WITH_PART_CHOSEN_BY_NAME = tuple(
    slot for slot in PART_SLOTS if not slot.part_class_by_selecting_field
)
_ALL_PART_CLASSES: tuple[type[Part], ...] = (
    SliderParameters,
    *(part for slot in PART_SLOTS for part in slot.built_in_parts.values()),
)
#: Mapping from field names to the built-in parts that declare the fields.
PART_CLASS_BY_FIELD_NAME: Mapping[str, type[Part]] = {
    name: part for part in reversed(_ALL_PART_CLASSES) for name in list_part_field_names(part)
}
#: Quantities that describe the fields of a scene.
SCENE_FIELD_QUANTITIES: tuple[Quantity, ...] = (
    *(slot.quantity_of_selecting_field for slot in SLOTS_WITH_PART_CHOSEN_BY_NAME),
    *(about for part in _ALL_PART_CLASSES for about in list_part_field_quantities(part)),
)
#: Names of the fields of a scene.
SCENE_FIELD_NAMES: tuple[str, ...] = tuple(
    dict.fromkeys(about.name for about in SCENE_FIELD_QUANTITIES)
)
#: Fields that were added in later versions of rsfstudy, with their default values. Scenes list such
#: a field only if it has a value. The keys of cells and stored scenes also omit the default value.
DEFAULTS_OMITTED_FROM_STORED_SCENES: dict[str, Any] = {
    **{
        slot.name: slot.default_part_name
        for slot in PART_SLOTS
        if slot.omits_default_from_stored_scenes
    },
    **{
        name: part.__dataclass_fields__[name].default
        for name, part in PART_CLASS_BY_FIELD_NAME.items()
        if part.__dataclass_fields__[name].metadata.get("omit_if_default")
    },
}
#: Names of the slots.
PART_SLOT_NAMES: frozenset[str] = frozenset(slot.name for slot in PART_SLOTS)
#: Names of the fields whose values select a part.
PART_SELECTING_FIELDS: tuple[str, ...] = tuple(
    name for slot in PART_SLOTS for name in slot.part_class_by_selecting_field
)


def collect_scene_field_defaults() -> dict[str, Any]:
    """Return the default values of all fields of a scene.

    Returns
    -------
    dict of str to object
        Default values by field name. The default of a slot such as ``dynamics`` is None if fields
        such as ``inertia`` select the part.
    """
    choices = {
        slot.name: slot.default_part_name if slot in SLOTS_WITH_PART_CHOSEN_BY_NAME else None
        for slot in PART_SLOTS
    }
    fields = {
        name: part.__dataclass_fields__[name].default
        for name, part in PART_CLASS_BY_FIELD_NAME.items()
    }
    return {
        name: {**choices, **fields}[name] for name in dict.fromkeys((*SCENE_FIELD_NAMES, *choices))
    }


class _UnsetDefault:
    """Placeholder that signatures show as the default of optional keyword arguments."""

    def __repr__(self) -> str:
        """Return the text that ``help`` displays."""
        return "<unset>"


def add_scene_fields_to_signature(
    *extra_field_names: str,
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Return a decorator that adds the fields of scenes to the signature of a function.

    The signature is used for code completion in editors. The decorated function takes the fields as
    ``**kwargs``.

    Parameters
    ----------
    *extra_field_names : str
        Names of additional keyword arguments.

    Returns
    -------
    callable
        Decorator.
    """

    def decorate(function: DecoratedFunction) -> DecoratedFunction:
        stated = signature(function)
        *first, last = stated.parameters.values()
        names = (*collect_scene_field_defaults(), *extra_field_names)
        unset = _UnsetDefault()
        fields = [Parameter(name, Parameter.KEYWORD_ONLY, default=unset) for name in names]
        function.__signature__ = stated.replace(parameters=[*first, *fields, last])  # type: ignore[attr-defined]
        return function

    return decorate


# ---- user-defined parts --------------------------------------------------------------------------

#: Names of the attributes that every scene has in addition to its fields. The module ``scene`` adds
#: the names to this set.
RESERVED_SCENE_ATTRIBUTE_NAMES: set[str] = set()
#: Classes of user-defined parts that have been checked.
_CHECKED_USER_PART_CLASSES: set[type[Part]] = set()


def get_part_class(part: UserPart) -> type[Part]:
    """Return the class of a part.

    Parameters
    ----------
    part : type or UserLoading
        Class of a part, or a loading object such as a protocol.

    Returns
    -------
    type
        Class of the part. If `part` is a class, the function returns `part` itself.
    """
    return part if isinstance(part, type) else type(part)


def find_slot_of_part_class(part_class: type[Part]) -> PartSlot:
    """Return the slot that a part class can fill.

    Parameters
    ----------
    part_class : type
        Class of a part.

    Returns
    -------
    PartSlot
        Slot from whose base class the part is derived.
    """
    return next(slot for slot in PART_SLOTS if issubclass(part_class, slot.base_class))


def check_and_register_part(slot: PartSlot, part: Any) -> UserPart:
    """Check and register a part that is passed as a class or an object.

    Parameters
    ----------
    slot : PartSlot
        Slot that the part should fill.
    part : type or UserLoading
        Part to check.

    Returns
    -------
    type or UserLoading
        The part.

    Raises
    ------
    InvalidValue
        If the part cannot fill the slot.
    """
    found: UserPart = part
    if part in slot.built_in_parts.values() and slot in SLOTS_WITH_PART_CHOSEN_BY_NAME:
        return found
    if isinstance(part, UserLoading) and slot.base_class is loading.Loading:
        _check_part_name(slot, part)
    elif part not in _CHECKED_USER_PART_CLASSES or find_slot_of_part_class(part) is not slot:
        _check_user_part(slot, part)
    register_user_parts([found])
    return found


def _check_user_part(slot: PartSlot, part: Any) -> None:
    """Raise ``InvalidValue`` if a class cannot fill a slot."""
    if not isinstance(part, type) or not issubclass(part, slot.base_class):
        rule = f"is not a class that defines the {slot.name} of a scene"
        remedy = f"Derive a class from {slot.base_class.__module__}.{slot.base_class.__name__}."
        raise InvalidValue(slot.name, part, rule, remedy=remedy)
    params = vars(part).get("__dataclass_params__")
    if params is None or not params.frozen:
        remedy = "Add the decorator @dataclass(frozen=True, kw_only=True) to the class."
        raise InvalidValue(slot.name, part, "must be a frozen dataclass", remedy=remedy)
    _check_part_name(slot, part)
    _check_part_fields(slot, part)
    _check_unknowns_excluded_from_distance(slot, part)
    check_names_of_needed_quantities(slot.name, part)
    for name in part.list_required_function_names():
        function = getattr_static(part, name, None)
        if not isinstance(getattr(function, "__func__", None), FunctionType):
            rule, remedy = (
                (f"does not define {name}"),
                f"Write {name} = staticmethod(a plain function).",
            )
            raise InvalidValue(slot.name, part, rule, remedy=remedy)


def _check_unknowns_excluded_from_distance(slot: PartSlot, part: type[Part]) -> None:
    """Raise ``InvalidValue`` if ``excluded_from_distance`` is invalid.

    Each name in ``excluded_from_distance`` must be the name of an unknown of the part.
    """
    excluded: Any = part.excluded_from_distance
    unknowns = [about.name for about in part.unknowns]
    if isinstance(excluded, str):
        rule, remedy = "must be a tuple of names", f"Write ({excluded!r},)."
        raise InvalidValue("excluded_from_distance", excluded, rule, remedy=remedy)
    for name in excluded:
        if name not in unknowns:
            rule = f"is not an unknown of the {slot.name} {part.name}"
            raise InvalidValue("excluded_from_distance", name, rule, choices=unknowns)


def _check_part_name(slot: PartSlot, part: UserPart) -> None:
    """Raise ``InvalidValue`` if the name of a part is invalid or in use."""
    name: object = getattr(part, "name", None)
    rule = (
        ""
        if is_valid_variable_name(name)
        else (f"must have a Python identifier as its name (got {name!r})")
    )
    for other in PART_SLOTS:
        if name in other.built_in_parts:
            rule = f"has the name {name!r} of a part of rsfstudy"
        elif name in other.user_parts and _get_module_and_qualified_name(
            other.user_parts[name]
        ) != _get_module_and_qualified_name(part):
            rule = (
                f"has the name {name!r} of "
                f"{'.'.join(_get_module_and_qualified_name(other.user_parts[name]))}"
            )
    if rule:
        remedy = f'Define another name = "..." in {_get_module_and_qualified_name(part)[1]}.'
        raise InvalidValue(slot.name, part, rule, remedy=remedy)


def _get_module_and_qualified_name(part: UserPart) -> tuple[str, str]:
    """Return the module and the qualified name under which a part is defined.

    The names do not change if a notebook cell with the definition is run again.
    """
    return get_part_class(part).__module__, get_part_class(part).__qualname__


def _check_part_fields(slot: PartSlot, part: type[Part]) -> None:
    """Raise ``InvalidValue`` if a field of a part is invalid.

    A field of a part must have a description. The name of the field must not be in use.
    """
    what = f"field of {part.__qualname__}"
    for stated in fields(part):
        name, about, owner = (
            stated.name,
            stated.metadata.get("about"),
            PART_CLASS_BY_FIELD_NAME.get(stated.name),
        )
        if about is None:
            rule, state = (
                ("has neither a description nor a rule for its values"),
                ("Declare the field with number() or flag()."),
            )
            raise InvalidValue(what, name, rule, remedy=state)
        if not is_valid_variable_name(name):
            rule = "must be a Python identifier in Unicode normalisation form NFC"
            raise InvalidValue(what, name, rule)
        if owner is None:
            taken = name in RESERVED_SCENE_ATTRIBUTE_NAMES | PART_SLOT_NAMES
        else:  # Another part of the slot may declare the field with a different rule.
            known = owner.__dataclass_fields__[name].metadata["about"]
            taken = about != known or owner not in slot.built_in_parts.values()
        if taken:
            rule = "is already the name of a field of "
            rule += owner.name if owner else "every scene"
            raise InvalidValue(what, name, rule, remedy="Choose another name.")


def register_user_parts(parts: Iterable[UserPart]) -> None:
    """Register user-defined parts that have already been checked.

    The parts are registered by name. A new part replaces an earlier part with the same name.

    Parameters
    ----------
    parts : iterable of type or UserLoading
        Parts to register.
    """
    for part in parts:
        slot = find_slot_of_part_class(get_part_class(part))
        if slot.user_parts.get(part.name) is not part:
            slot.user_parts[part.name] = part
            _CHECKED_USER_PART_CLASSES.add(get_part_class(part))


def replace_part_or_alias_by_part_name(field_name: str, value: Any) -> Any:
    """Convert a part class, or a synonym of a law, to the name of the part.

    Parameters
    ----------
    field_name : str
        Name of the field.
    value : object
        Value of the field. A user-defined part is registered.

    Returns
    -------
    object
        Name of the part or law. Other values are returned unchanged.

    Raises
    ------
    InvalidValue
        If the part cannot fill the slot.
    """
    for slot in PART_SLOTS if isinstance(value, type | UserLoading) else ():
        if slot.name == field_name:
            return check_and_register_part(slot, value).name
    return (
        replace_law_alias_by_law_name(value)
        if field_name == "law" and isinstance(value, str)
        else value
    )


def replace_names_by_user_parts(
    field_values: Mapping[str, Any], user_parts_by_name: Mapping[str, UserPart]
) -> Mapping[str, Any]:
    """Replace the names of user-defined parts by the parts themselves.

    Parameters
    ----------
    field_values : mapping of str to object
        Field values.
    user_parts_by_name : mapping of str to type or UserLoading
        User-defined parts by name.

    Returns
    -------
    mapping of str to object
        Field values with parts instead of names.
    """
    if not user_parts_by_name:
        return field_values
    texts = {
        n: field_values[n]
        for n in PART_SLOT_NAMES & set(field_values)
        if isinstance(field_values[n], str)
    }
    return {
        **field_values,
        **{name: user_parts_by_name.get(text, text) for name, text in texts.items()},
    }


def collect_scene_field_quantities(user_parts: Iterable[UserPart]) -> dict[str, Quantity]:
    """Return all fields of scenes, including the fields of user-defined parts.

    Parameters
    ----------
    user_parts : iterable of type or UserLoading
        User-defined parts.

    Returns
    -------
    dict of str to Quantity
        Quantities by field name.

    Raises
    ------
    InvalidValue
        If two parts have different fields with the same name.
    """
    found = {about.name: about for about in SCENE_FIELD_QUANTITIES}
    for kind in map(get_part_class, user_parts):
        for about in (
            find_slot_of_part_class(kind).quantity_of_selecting_field,
            *list_part_field_quantities(kind),
        ):
            if found.setdefault(about.name, about) != about:
                rule = "is already the name of a field of another part"
                raise InvalidValue(f"field of {kind.name}", about.name, rule)
    return found


def collect_python_types_of_scene_fields(user_parts: Iterable[UserPart]) -> Mapping[str, Any]:
    """Return the types of the fields of scenes.

    Parameters
    ----------
    user_parts : iterable of type or UserLoading
        User-defined parts that the scenes may contain.

    Returns
    -------
    mapping of str to type
        Types by field name. The type includes None if some parts of the slot lack the field.
    """
    kinds: dict[str, Any] = dict.fromkeys(PART_SLOT_NAMES, str)
    classes = tuple(map(get_part_class, user_parts))
    filling: dict[str, list[type[Part]]] = {"": [SliderParameters]}
    filling |= {slot.name: [*slot.built_in_parts.values()] for slot in PART_SLOTS}
    for own_kind in classes:
        filling[find_slot_of_part_class(own_kind).name].append(own_kind)
    for every in filling.values():
        for part in every:
            for name in list_part_field_names(part):
                kind: Any = bool if is_boolean_field(part, name) else float
                stated = name == part.field_name_that_selects_part or all(
                    name in list_part_field_names(one) for one in every
                )
                stated = stated and name not in DEFAULTS_OMITTED_FROM_STORED_SCENES
                default = part.__dataclass_fields__[name].default
                kinds[name] = kind if stated and default is not None else kind | None
    return {name: kinds[name] for name in collect_scene_field_quantities(classes)}


#: Types of the fields of scenes without user-defined parts.
PYTHON_TYPE_BY_SCENE_FIELD = collect_python_types_of_scene_fields(())


def iterate_quantities_with_values(
    field_values: Mapping[str, Any], user_parts: Iterable[UserPart] = ()
) -> Iterator[tuple[Quantity, object]]:
    """Iterate over the fields that have a value.

    Parameters
    ----------
    field_values : mapping of str to object
        Field values.
    user_parts : iterable of type or UserLoading, optional
        User-defined parts whose fields may be included.

    Yields
    ------
    quantity : Quantity
        Description of the field.
    value : object
        Value of the field, which is not None.
    """
    about = collect_scene_field_quantities(user_parts)
    for name, value in field_values.items():
        if value is not None:
            yield about.get(name, Quantity(name, "", "", "")), value
