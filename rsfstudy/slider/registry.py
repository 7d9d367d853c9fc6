"""Registry of the slots, parts and fields of scenes.

The registry lists the parts that can fill each slot, and the fields that the parts add to a scene.
A user-defined part is a class that is derived from the base class of a slot. The part is registered
by its name when it is first used in a process. If a notebook cell with the class is run again, the
new class replaces the old class. The registry rejects a name that belongs to another part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from inspect import Parameter, getattr_static, signature
from types import FunctionType
from typing import Any, TypeVar

from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import Quantity, is_variable_name
from rsfstudy.slider import dynamics, fluid, laws, loading, normal_stress
from rsfstudy.slider.hints import canonical_law_name
from rsfstudy.slider.parts import Part, field_names, field_quantities, is_boolean_field
from rsfstudy.slider.protocols import UserLoading
from rsfstudy.slider.requirements import check_declared_needs
from rsfstudy.slider.slider_parameters import SliderParameters

F = TypeVar("F", bound=Callable[..., Any])
#: User-defined part: the class of a part, or a loading object such as a protocol.
UserPart = type[Part] | UserLoading


@dataclass(frozen=True)
class Slot:
    """Slot of a scene, which is filled by one part.

    Parameters
    ----------
    name : str
        Name of the slot.
    base : type
        Base class of the parts.
    choices : mapping of str to type
        Built-in parts by name.
    default : str
        Name of the default part.
    long_name : str
        Description of the slot.
    user_parts : dict of str to type or UserLoading, optional
        User-defined parts by name that have been used in this process.
    """

    name: str
    base: type[Part]
    choices: Mapping[str, type[Part]]
    default: str
    long_name: str
    user_parts: dict[str, UserPart] = field(default_factory=dict)

    @property
    def quantity(self) -> Quantity:
        """Quantity that describes the slot as a field."""
        return Quantity(self.name, "", "", self.long_name)

    @cached_property
    def selectors(self) -> Mapping[str, type[Part]]:
        """Mapping from field names to the parts that the fields select."""
        return {part.selected_by: part for part in self.choices.values() if part.selected_by}


SLOTS: tuple[Slot, ...] = (
    Slot("law", laws.LawBase, laws.BUILT_IN_PARTS, "slip", "state evolution law"),
    Slot(
        "normal_stress",
        normal_stress.NormalStress,
        normal_stress.BUILT_IN_PARTS,
        "variable",
        "normal stress condition",
    ),
    Slot("fluid", fluid.Fluid, fluid.BUILT_IN_PARTS, "drained", "fluid in the pores of the fault"),
    Slot(
        "dynamics",
        dynamics.Dynamics,
        dynamics.BUILT_IN_PARTS,
        "quasi_static",
        "what balances the spring besides friction",
    ),
    Slot("loading", loading.Loading, loading.BUILT_IN_PARTS, "step", "what the load point does"),
)
#: Slots whose part is selected by name. In the other slots, the values of fields select the part.
NAMED_SLOTS = tuple(slot for slot in SLOTS if not slot.selectors)
_ALL_PARTS: tuple[type[Part], ...] = (
    SliderParameters,
    *(part for slot in SLOTS for part in slot.choices.values()),
)
#: Built-in part that owns each field.
FIELD_OWNERS: Mapping[str, type[Part]] = {
    name: part for part in reversed(_ALL_PARTS) for name in field_names(part)
}
#: Quantities that describe the fields of a scene.
FIELD_QUANTITIES: tuple[Quantity, ...] = (
    *(slot.quantity for slot in NAMED_SLOTS),
    *(about for part in _ALL_PARTS for about in field_quantities(part)),
)
#: Names of the fields of a scene.
FIELD_NAMES: tuple[str, ...] = tuple(dict.fromkeys(about.name for about in FIELD_QUANTITIES))
#: Names of the fields that are included among the values of a scene only if the user sets them.
OMITTED_IF_NONE: frozenset[str] = frozenset(
    name
    for name, part in FIELD_OWNERS.items()
    if part.__dataclass_fields__[name].metadata.get("omit_if_none")
)
#: Names of the slots.
SLOT_NAMES: frozenset[str] = frozenset(slot.name for slot in SLOTS)
#: Names of the fields whose values select a part.
SELECTOR_FIELDS: tuple[str, ...] = tuple(name for slot in SLOTS for name in slot.selectors)


def field_defaults() -> dict[str, Any]:
    """Return the default values of all fields of a scene.

    Returns
    -------
    dict of str to object
        Default values by field name. The default of a slot is None if other fields select the part.
    """
    choices = {slot.name: slot.default if slot in NAMED_SLOTS else None for slot in SLOTS}
    fields = {name: part.__dataclass_fields__[name].default for name, part in FIELD_OWNERS.items()}
    return {name: {**choices, **fields}[name] for name in dict.fromkeys((*FIELD_NAMES, *choices))}


def with_field_signature(*extra_names: str) -> Callable[[F], F]:
    """Return a decorator that adds the fields of scenes to a signature.

    The signature is used for code completion in editors. The decorated function takes the fields as
    ``**kwargs``.

    Parameters
    ----------
    *extra_names : str
        Further names to add.

    Returns
    -------
    callable
        Decorator.
    """

    def decorate(function: F) -> F:
        stated = signature(function)
        *first, last = stated.parameters.values()
        names = (*field_defaults(), *extra_names)
        fields = [Parameter(name, Parameter.KEYWORD_ONLY, default=...) for name in names]
        function.__signature__ = stated.replace(parameters=[*first, *fields, last])  # type: ignore[attr-defined]
        return function

    return decorate


# ---- user-defined parts --------------------------------------------------------------------------

#: Names of the attributes of every scene, except for its fields. The module ``scene`` adds the
#: names.
RESERVED_NAMES: set[str] = set()
#: Classes that have been checked.
_CHECKED_CLASSES: set[type[Part]] = set()


def part_class(part: UserPart) -> type[Part]:
    """Return the class of a part.

    Parameters
    ----------
    part : type or UserLoading
        Class of a part, or a loading object such as a protocol.

    Returns
    -------
    type
        The class itself, or the class of the loading.
    """
    return part if isinstance(part, type) else type(part)


def find_slot(part_class: type[Part]) -> Slot:
    """Return the slot that a class of parts fills.

    Parameters
    ----------
    part_class : type
        Class of a part.

    Returns
    -------
    Slot
        Slot with a base class of the part.
    """
    return next(slot for slot in SLOTS if issubclass(part_class, slot.base))


def resolve_part(slot: Slot, part: Any) -> UserPart:
    """Check and register a part that is passed as a class or an object.

    Parameters
    ----------
    slot : Slot
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
    if part in slot.choices.values() and slot in NAMED_SLOTS:
        return found
    if isinstance(part, UserLoading) and slot.base is loading.Loading:
        _check_part_name(slot, part)
    elif part not in _CHECKED_CLASSES or find_slot(part) is not slot:
        _check_part(slot, part)
    register_parts([found])
    return found


def _check_part(slot: Slot, part: Any) -> None:
    """Raise ``InvalidValue`` if a class cannot fill a slot."""
    if not isinstance(part, type) or not issubclass(part, slot.base):
        rule = f"is no class that fills the slot {slot.name}"
        remedy = f"Derive a class from {slot.base.__module__}.{slot.base.__name__}."
        raise InvalidValue(slot.name, part, rule, remedy=remedy)
    params = vars(part).get("__dataclass_params__")
    if params is None or not params.frozen:
        remedy = "Write @dataclass(frozen=True, kw_only=True) above its class."
        raise InvalidValue(slot.name, part, "must be a frozen dataclass", remedy=remedy)
    _check_part_name(slot, part)
    _check_part_fields(slot, part)
    _check_excluded_unknowns(slot, part)
    check_declared_needs(slot.name, part)
    for name in part.required_functions():
        function = getattr_static(part, name, None)
        if not isinstance(getattr(function, "__func__", None), FunctionType):
            rule, remedy = f"states no {name}", f"Write {name} = staticmethod(a plain function)."
            raise InvalidValue(slot.name, part, rule, remedy=remedy)


def _check_excluded_unknowns(slot: Slot, part: type[Part]) -> None:
    """Raise ``InvalidValue`` if ``excluded_from_distance`` is invalid.

    Each name must be the name of an unknown of the part.
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


def _check_part_name(slot: Slot, part: UserPart) -> None:
    """Raise ``InvalidValue`` if the name of a part is invalid or in use."""
    name: object = getattr(part, "name", None)
    rule = "" if is_variable_name(name) else f"must be named by a Python identifier, not {name!r}"
    for other in SLOTS:
        if name in other.choices:
            rule = f"takes the name of a part of rsfstudy, {name!r}"
        elif name in other.user_parts and _origin(other.user_parts[name]) != _origin(part):
            rule = f"takes the name {name!r} of {'.'.join(_origin(other.user_parts[name]))}"
    if rule:
        remedy = f'Write name = "..." in {_origin(part)[1]}.'
        raise InvalidValue(slot.name, part, rule, remedy=remedy)


def _origin(part: UserPart) -> tuple[str, str]:
    """Return the module and the qualified name of the definition of a part.

    The result is the same if a notebook cell with the definition is run again.
    """
    return part_class(part).__module__, part_class(part).__qualname__


def _check_part_fields(slot: Slot, part: type[Part]) -> None:
    """Raise ``InvalidValue`` if a field of a part is invalid.

    A field must have a description, and its name must not be in use.
    """
    what = f"field of {part.__qualname__}"
    for stated in fields(part):
        name, about, owner = (
            stated.name,
            stated.metadata.get("about"),
            FIELD_OWNERS.get(stated.name),
        )
        if about is None:
            rule, state = "says neither what it is nor its rule", "State it by number() or flag()."
            raise InvalidValue(what, name, rule, remedy=state)
        if not is_variable_name(name):
            rule = "must be a Python identifier, its accents composed (NFC)"
            raise InvalidValue(what, name, rule)
        if owner is None:
            taken = name in RESERVED_NAMES | SLOT_NAMES
        else:  # Another part of the slot may have the same field with another rule.
            known = owner.__dataclass_fields__[name].metadata["about"]
            taken = about != known or owner not in slot.choices.values()
        if taken:
            rule = "is the name of something else, of "
            rule += owner.name if owner else "every scene"
            raise InvalidValue(what, name, rule, remedy="Give it another name.")


def register_parts(parts: Iterable[UserPart]) -> None:
    """Register the names of parts that have been checked.

    An earlier part with the same name is replaced.

    Parameters
    ----------
    parts : iterable of type or UserLoading
        Parts to register.
    """
    for part in parts:
        slot = find_slot(part_class(part))
        if slot.user_parts.get(part.name) is not part:
            slot.user_parts[part.name] = part
            _CHECKED_CLASSES.add(part_class(part))


def normalise_field_value(field: str, value: Any) -> Any:
    """Convert a part or the synonym of a law to a name.

    Parameters
    ----------
    field : str
        Name of the field.
    value : object
        Value of the field. A user-defined part is registered.

    Returns
    -------
    object
        Name of the part or law, or the value itself.

    Raises
    ------
    InvalidValue
        If the part cannot fill the slot.
    """
    for slot in SLOTS if isinstance(value, type | UserLoading) else ():
        if slot.name == field:
            return resolve_part(slot, value).name
    return canonical_law_name(value) if field == "law" and isinstance(value, str) else value


def names_to_parts(values: Mapping[str, Any], parts: Mapping[str, UserPart]) -> Mapping[str, Any]:
    """Replace the names of user-defined parts by the parts themselves.

    Parameters
    ----------
    values : mapping of str to object
        Field values.
    parts : mapping of str to type or UserLoading
        User-defined parts by name.

    Returns
    -------
    mapping of str to object
        Field values with parts instead of names.
    """
    if not parts:
        return values
    texts = {n: values[n] for n in SLOT_NAMES & set(values) if isinstance(values[n], str)}
    return {**values, **{name: parts.get(text, text) for name, text in texts.items()}}


def scene_fields(parts: Iterable[UserPart]) -> dict[str, Quantity]:
    """Return the fields of scenes that may contain the given parts.

    Parameters
    ----------
    parts : iterable of type or UserLoading
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
    found = {about.name: about for about in FIELD_QUANTITIES}
    for kind in map(part_class, parts):
        for about in (find_slot(kind).quantity, *field_quantities(kind)):
            if found.setdefault(about.name, about) != about:
                rule = "is the name of something else, of another part"
                raise InvalidValue(f"field of {kind.name}", about.name, rule)
    return found


def field_types(parts: Iterable[UserPart]) -> Mapping[str, Any]:
    """Return the types of the fields of scenes.

    Parameters
    ----------
    parts : iterable of type or UserLoading
        User-defined parts that the scenes may contain.

    Returns
    -------
    mapping of str to type
        Types by field name. The type includes None if some parts of the slot lack the field.
    """
    kinds: dict[str, Any] = dict.fromkeys(SLOT_NAMES, str)
    classes = tuple(map(part_class, parts))
    filling: dict[str, list[type[Part]]] = {"": [SliderParameters]}
    filling |= {slot.name: [*slot.choices.values()] for slot in SLOTS}
    for own_kind in classes:
        filling[find_slot(own_kind).name].append(own_kind)
    for every in filling.values():
        for part in every:
            for name in field_names(part):
                kind: Any = bool if is_boolean_field(part, name) else float
                stated = name == part.selected_by or all(name in field_names(one) for one in every)
                default = part.__dataclass_fields__[name].default
                kinds[name] = kind if stated and default is not None else kind | None
    return {name: kinds[name] for name in scene_fields(classes)}


#: Types of the fields of scenes without user-defined parts.
FIELD_TYPES = field_types(())


def quantities_with_values(
    values: Mapping[str, Any], parts: Iterable[UserPart] = ()
) -> Iterator[tuple[Quantity, object]]:
    """Iterate over the fields that have a value.

    Parameters
    ----------
    values : mapping of str to object
        Field values.
    parts : iterable of type or UserLoading, optional
        User-defined parts whose fields may be included.

    Yields
    ------
    quantity : Quantity
        Description of the field.
    value : object
        Value of the field, which is not None.
    """
    about = scene_fields(parts)
    for name, value in values.items():
        if value is not None:
            yield about.get(name, Quantity(name, "", "", "")), value
