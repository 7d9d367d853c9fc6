"""The registry of parts and fields: the slots of a slider, what may fill each, and the fields that
these bring to a scene.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any, NamedTuple, get_type_hints

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity
from rsfstudy.slider import dynamics, fluid, laws, loading, normal_stress, own
from rsfstudy.slider.numbers import SPRING, Slider, with_spring
from rsfstudy.slider.parts import Part, checked, is_flag, names_of, quantities_of
from rsfstudy.slider.protocol import Protocol
from rsfstudy.slider.synonyms import instead_of_choice, instead_of_field, instead_of_unnamed

#: A part of a user's own: its class, whose fields are fields of the scene; or a protocol, which is
#: data.
Own = type[Part] | Protocol


class Parts(NamedTuple):
    """What a scene is made of: the numbers that every slider has, and what fills each slot."""

    slider: Slider
    law: laws.LawOfStates
    normal_stress: normal_stress.NormalStress
    fluid: fluid.Fluid
    dynamics: dynamics.Dynamics
    loading: loading.Loading


@dataclass(frozen=True)
class Slot:
    """What a scene has one of.

    Attributes
    ----------
    name : str
        What it is called.
    base : type
        What all of its parts are derived from.
    choices : mapping of str to type
        The parts of rsfstudy, by name.
    default : str
        The one that is meant where none is named.
    long_name : str
        What it is.
    own : dict of str to type or Protocol
        Parts of the user's own, by name, as far as they are known in this process.
    """

    name: str
    base: type[Part]
    choices: Mapping[str, type[Part]]
    default: str
    long_name: str
    own: dict[str, Own] = field(default_factory=dict)

    @cached_property
    def callers(self) -> Mapping[str, type[Part]]:
        """The fields that call for a part by their values."""
        return {part.called_by: part for part in self.choices.values() if part.called_by}

    @cached_property
    def is_named(self) -> bool:
        """Whether a field of a scene names the choice; else the value of another calls for it."""
        return not self.callers


SLOTS: tuple[Slot, ...] = (
    Slot("law", laws.LawOfStates, laws.PARTS, "slip", "state evolution law"),
    Slot(
        "normal_stress",
        normal_stress.NormalStress,
        normal_stress.PARTS,
        "variable",
        "normal stress condition",
    ),
    Slot("fluid", fluid.Fluid, fluid.PARTS, "drained", "fluid in the pores of the fault"),
    Slot(
        "dynamics",
        dynamics.Dynamics,
        dynamics.PARTS,
        "quasi_static",
        "what balances the spring besides friction",
    ),
    Slot("loading", loading.Loading, loading.PARTS, "step", "what the load point does"),
)
#: Slots of which there is a choice to be named.
NAMED = tuple(slot for slot in SLOTS if slot.is_named and len(slot.choices) > 1)
_EVERY_PART: tuple[type[Part], ...] = (
    Slider,
    *(part for slot in SLOTS for part in slot.choices.values()),
)
_OWNERS: Mapping[str, type[Part]] = {
    name: part for part in reversed(_EVERY_PART) for name in names_of(part)
}
#: Names of all fields of a scene.
FIELDS: tuple[str, ...] = tuple(
    dict.fromkeys(
        [*(slot.name for slot in NAMED), *(n for part in _EVERY_PART for n in names_of(part))]
    )
)
#: Those that name what fills a slot.
SLOT_FIELDS: frozenset[str] = frozenset(slot.name for slot in NAMED)
#: What names a part of the user's own in each slot.
SLOT_NAMES: frozenset[str] = frozenset(slot.name for slot in SLOTS)
#: Those that call for a part by their values.
CALLERS: tuple[str, ...] = tuple(name for slot in SLOTS for name in slot.callers)
#: Those that decide neither what fills a slot nor which of two fields sets the spring.
PLAIN_FIELDS: frozenset[str] = frozenset(FIELDS) - {*SLOT_FIELDS, *CALLERS, *SPRING}
#: What they mean.
QUANTITIES: tuple[Quantity, ...] = (
    *(Quantity(slot.name, "", "", slot.long_name) for slot in NAMED),
    *(q for part in _EVERY_PART for q in quantities_of(part)),
)


def _kind(name: str) -> Any:
    """What a field of a scene holds; None where the part that owns it was not chosen."""
    part = _OWNERS[name]
    kind = get_type_hints(part)[name]
    chosen = (
        part is Slider
        or name == part.called_by
        or all(
            name in names_of(choice)
            for slot in SLOTS
            for choice in slot.choices.values()
            if part in slot.choices.values()
        )
    )
    return kind if chosen else kind | None


#: What the fields hold.
KINDS: Mapping[str, Any] = {slot.name: str for slot in NAMED} | {n: _kind(n) for n in _OWNERS}


# ---- parts of a user's own -----------------------------------------------------------------------

#: Classes that were checked, and the slots they fill.
_CHECKED: dict[type[Part], Slot] = {Protocol: SLOTS[-1]}


def kind_of(part: Own) -> type[Part]:
    """The class of a part."""
    return part if isinstance(part, type) else type(part)


def resolve(slot: Slot, part: Any) -> Own:
    """A part that is given itself, not by its name; from its first use on, its name stands for it.

    Raises
    ------
    InvalidValue
        Where it cannot fill the slot.
    """
    found: Own = part
    if part in slot.choices.values() and slot.name in SLOT_FIELDS:
        return found
    if isinstance(part, Protocol) and slot.base is loading.Loading:
        own.check_name(slot, part, SLOTS)
    elif _CHECKED.get(part) is not slot:
        own.check(slot, part, SLOTS, _OWNERS)
    register([found])
    return found


def register(parts: Iterable[Own]) -> None:
    """Have the names of parts that were checked stand for them, whatever they stood for."""
    for part in parts:
        kind = kind_of(part)
        slot = next(slot for slot in SLOTS if issubclass(kind, slot.base))
        if slot.own.get(part.name) is not part:
            slot.own[part.name] = part
            _CHECKED[kind] = slot
            _without_meaning.cache_clear()


def name_of(field: str, value: Any) -> Any:
    """A value of a field; a part that is given itself by its name, which it has from now on.

    Raises
    ------
    InvalidValue
        Where the part cannot fill the slot.
    """
    for slot in SLOTS if isinstance(value, type | Protocol) else ():
        if slot.name == field:
            return resolve(slot, value).name
    return value


def own_named(names: Iterable[str], rows: Iterable[Mapping[str, Any]]) -> dict[str, Own]:
    """The parts of the user's own that rows name in some fields, by name."""
    slots = [slot for slot in SLOTS if slot.own and slot.name in names]
    places = ((slot, row.get(slot.name)) for row in rows for slot in slots)
    return {n: slot.own[n] for slot, n in places if isinstance(n, str) and n in slot.own}


def by_class(values: Mapping[str, Any], parts: Mapping[str, Own]) -> Mapping[str, Any]:
    """Values of fields, with these parts themselves instead of their names."""
    if not parts:
        return values
    texts = {n: values[n] for n in SLOT_NAMES & set(values) if isinstance(values[n], str)}
    return {**values, **{name: parts.get(text, text) for name, text in texts.items()}}


def fields_with(parts: Iterable[Own]) -> tuple[str, ...]:
    """Names of the fields of scenes that may have these parts of the user's own.

    Raises
    ------
    InvalidValue
        Where one name means several things.
    """
    stated = {name: part.__dataclass_fields__[name] for name, part in _OWNERS.items()}
    names = dict.fromkeys(FIELDS)
    for kind in map(kind_of, parts):
        names[_CHECKED[kind].name] = None
        for name in names_of(kind):
            field_, names[name] = kind.__dataclass_fields__[name], None
            if stated.setdefault(name, field_).metadata != field_.metadata:
                rule = "is the name of something else, of another part"
                raise InvalidValue(f"field of {kind.name}", name, rule)
    return tuple(names)


def quantities_with(parts: Iterable[Own]) -> Iterator[Quantity]:
    """What the fields mean that parts of the user's own add to those of every scene."""
    for kind in map(kind_of, parts):
        slot = _CHECKED[kind]
        stated = (Quantity(slot.name, "", "", slot.long_name), *quantities_of(kind))
        yield from (about for about in stated if about.name not in FIELDS)


def kinds_with(parts: Iterable[Own]) -> Mapping[str, Any]:
    """What those fields hold; none, where the part stands for another that owns them."""
    kinds: dict[str, Any] = {**dict.fromkeys(SLOT_NAMES, str), **KINDS}
    classes = tuple(map(kind_of, parts))
    for part in classes:
        others = _CHECKED[part].choices.values()
        kinds |= {n: KINDS[n] | None for other in others for n in names_of(other)}
        for name in names_of(part):
            own_kind = (bool if is_flag(part, name) else float) | None
            kinds[name] = KINDS.get(name, own_kind)
    return {name: kinds[name] for name in fields_with(classes)}


# ---- which fields have a meaning -----------------------------------------------------------------


def without_meaning(values: Mapping[str, Any], parts: Iterable[Own] = ()) -> frozenset[str]:
    """Fields that belong to other parts than those that values name.

    Parameters
    ----------
    values : mapping of str to value
    parts : iterable of type or Protocol
        Parts of the user's own that may be among those.
    """
    try:
        calling = tuple(name for name in CALLERS if values.get(name))
        return _without_meaning(
            tuple(values.get(slot.name) for slot in SLOTS), calling, tuple(map(kind_of, parts))
        )
    except (TypeError, ValueError):  # what is no name or number, and cannot be looked up as one
        return frozenset()


@cache
def _without_meaning(
    named: tuple[Any, ...], calling: tuple[str, ...], parts: tuple[type[Part], ...]
) -> frozenset[str]:
    names: set[str] = set()
    for slot, name in zip(SLOTS, named, strict=True):
        text = isinstance(name, str)
        part = (slot.choices.get(name) or slot.own.get(name)) if text else name
        meant, every = (FIELDS if part is None else names_of(kind_of(part))), part is not None
        if name is None and slot.callers:
            called = [slot.callers[caller] for caller in calling if caller in slot.callers]
            # of two that are called for, one is refused
            meant = (*names_of([*called, slot.choices[slot.default]][0]), *slot.callers)
            every = True
        others = [other for other in parts if _CHECKED[other] is slot]
        others += slot.choices.values() if every else []
        names |= {name for other in others for name in names_of(other)} - set(meant)
    return frozenset(names)


# ---- the parts of a scene ------------------------------------------------------------------------


def parts_of(given: Mapping[str, Any]) -> Parts:
    """The parts that fields of a scene ask for, made of what they hold.

    Raises
    ------
    InvalidValue
        For a name that is no field, and for a value that breaks its rule or has no meaning here.
    """
    chosen = tuple(_chosen(slot, given) for slot in SLOTS)
    layout = layout_of(tuple(map(kind_of, chosen)))
    values: tuple[dict[str, Any], ...] = tuple({} for _part in layout.kinds)
    for name, value in given.items():
        if name not in layout.fields and name not in SLOT_NAMES:
            raise _unknown_field(name, value, layout)
        if value is None or name in SLOT_NAMES:
            continue
        place = layout.places.get(name)
        if place is None:
            _refuse_unless_idle(name, value, layout.refusing[name])
        else:
            values[place][name] = checked(layout.kinds[place], name, value)
    made = [
        part(**own) if isinstance(part, type) else part
        for part, own in zip(chosen, values[1:], strict=True)
    ]
    return Parts(Slider(**with_spring(values[0])), *made)  # type: ignore[arg-type]


def with_numbers(parts: Parts, changes: Mapping[str, Any]) -> Parts:
    """The same parts, of which those that own these fields hold other numbers.

    Raises
    ------
    InvalidValue
        For a value that breaks its rule or has no meaning for these parts.
    """
    layout = layout_of(tuple(map(type, parts[1:])))
    changed: dict[int, dict[str, Any]] = {}
    for name, value in changes.items():
        place = layout.places.get(name)
        if place is None:
            raise layout.refusing[name].refuse(name, value)
        changed.setdefault(place, {})[name] = checked(layout.kinds[place], name, value)
    made: list[Any] = list(parts)
    for place, values in changed.items():
        made[place] = replace(made[place], **values)
    return Parts._make(made)


def _chosen(slot: Slot, given: Mapping[str, Any]) -> Own:
    """The part that is asked for in a slot."""
    value = given.get(slot.name)
    if isinstance(value, type | Protocol):
        return resolve(slot, value)
    if isinstance(value, str) and value in slot.own and value not in slot.choices:
        return slot.own[value]
    if slot.name in SLOT_FIELDS:
        name = given.get(slot.name, slot.default)
        if not isinstance(name, str) or name not in slot.choices:
            choices = (*slot.choices, *slot.own)
            remedy = instead_of_choice(slot.name, name, choices)
            raise InvalidValue(slot.name, name, "is unknown", choices=choices, remedy=remedy)
        return slot.choices[name]
    if value is not None:
        others = ", ".join(slot.callers) or "the other fields"
        remedy = f"Those of rsfstudy are called for by {others}."
        raise InvalidValue(slot.name, value, "is unknown", choices=slot.own, remedy=remedy)
    for caller, part in slot.callers.items():
        value = given.get(caller)
        if value is not None and checked(part, caller, value):
            return part
    return slot.choices[slot.default]


class Layout(NamedTuple):
    """Where the fields of scenes with certain parts are.

    Attributes
    ----------
    kinds : tuple of type
        The classes of the parts, the numbers of every slider first.
    places : mapping of str to int
        The place of the part that owns each field.
    refusing : mapping of str to type
        The part that refuses each of the others,
    idle : mapping of str to value
        and what those hold.
    named : tuple of str
        The slots whose parts are fields of the scene by their names.
    fields : tuple of str
        Names of all fields: those of every scene, and those of parts of the user's own.
    plain : frozenset of str
        Those that decide nothing but a number.
    """

    kinds: tuple[type[Part], ...]
    places: Mapping[str, int]
    refusing: Mapping[str, type[Part]]
    idle: Mapping[str, Any]
    named: tuple[str, ...]
    fields: tuple[str, ...]
    plain: frozenset[str]


@cache
def layout_of(chosen: tuple[type[Part], ...]) -> Layout:
    """The layout of scenes with parts of these classes in the slots."""
    kinds: tuple[type[Part], ...] = (Slider, *chosen)
    filled = list(zip(SLOTS, chosen, strict=True))
    owned = {slot.name: part for slot, part in filled if part not in slot.choices.values()}
    for slot, part in filled:
        if slot.name in owned:
            _CHECKED.setdefault(part, slot)
    places = {name: place for place, part in enumerate(kinds) for name in names_of(part)}
    if len(places) < sum(len(names_of(part)) for part in kinds):
        names = ", ".join(part.name for part in owned.values())
        raise InvalidValue("parts", names, "have a field of one name", remedy="Rename one.")
    refusing: dict[str, type[Part]] = {}
    idle: dict[str, Any] = {}
    for slot, part in filled:
        for other in slot.choices.values():
            for name in set(names_of(other)) - set(places):
                refusing[name] = part
                calls = name == other.called_by
                idle[name] = other.__dataclass_fields__[name].default if calls else None
    named = tuple(slot.name for slot in SLOTS if slot.name in (*SLOT_FIELDS, *owned))
    fields = fields_with(owned.values())
    plain = PLAIN_FIELDS | (set(fields) - {*FIELDS, *SLOT_NAMES})
    return Layout(kinds, places, refusing, idle, named, fields, plain)


def own_parts(parts: Parts) -> dict[str, Own]:
    """Those of the parts that are the user's own, by slot."""
    filled = zip(SLOTS, parts[1:], strict=True)
    return {
        slot.name: part if isinstance(part, Protocol) else type(part)
        for slot, part in filled
        if type(part) not in slot.choices.values()
    }


def _refuse_unless_idle(name: str, value: Any, part: type[Part]) -> None:
    """Refuse a value for a field of another part than the one chosen, but for one that calls for
    that part and does not call.
    """
    owner = _OWNERS[name]
    if name != owner.called_by or checked(owner, name, value):
        raise part.refuse(name, value)


def _unknown_field(name: str, value: Any, layout: Layout) -> InvalidValue:
    """The error for a name that is no field of a scene with these parts."""
    for slot, part in zip(SLOTS, layout.kinds[1:], strict=True):
        known = map(kind_of, slot.own.values())
        owner = next((other for other in known if name in names_of(other)), None)
        if owner is not None:
            rule = f"has no meaning for {slot.name}={part.name!r}"
            remedy = f"Leave it out, or set {slot.name}={owner.name!r}."
            return InvalidValue(name, value, rule, remedy=remedy)
    remedy, rule = instead_of_field(name), "is not a field of a scene"
    # what looks alike would mislead where the name is known to mean something else
    return InvalidValue("field", name, rule, choices=() if remedy else layout.fields, remedy=remedy)


def unnamed(value: Any) -> InvalidValue:
    """The error for a value that is given to a scene without a name."""
    remedy = instead_of_unnamed(value, {slot.name: slot.choices for slot in NAMED})
    return InvalidValue("Scene", value, "is given without a name", remedy=remedy)


def shown(
    values: Mapping[str, Any], parts: Iterable[Own] = ()
) -> Iterator[tuple[Quantity, object]]:
    """Fields that hold something, as quantities, with their values.

    Parameters
    ----------
    values : mapping of str to value
    parts : iterable of type or Protocol
        Parts of the user's own whose fields may be among those.
    """
    about = {one.name: one for one in (*QUANTITIES, *quantities_with(parts))}
    for name, value in values.items():
        if value is not None:
            yield about.get(name, Quantity(name, "", "", "")), value
