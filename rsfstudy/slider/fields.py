"""The fields of a scene: those every slider has, and those of the parts that may fill its slots."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any, NamedTuple, get_type_hints

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity
from rsfstudy.slider import dynamics, fluid, laws, loading, normal_stress, own
from rsfstudy.slider.numbers import SPRING, Slider
from rsfstudy.slider.parts import Part, checked, is_flag, names_of, quantities_of
from rsfstudy.slider.synonyms import instead_of_choice, instead_of_field, instead_of_unnamed


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
    own : dict of str to type
        Parts of the user's own, by name, as far as they are known in this process.
    """

    name: str
    base: type[Part]
    choices: Mapping[str, type[Part]]
    default: str
    long_name: str
    own: dict[str, type[Part]] = field(default_factory=dict)

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

#: Those that were checked, and the slots they fill.
_CHECKED: dict[type[Part], Slot] = {}


def known(slot: Slot, part: type) -> type[Part]:
    """A part that is given by its class; from its first use on, its name stands for it.

    Raises
    ------
    InvalidValue
        Where it cannot fill the slot.
    """
    if part in slot.choices.values() and slot.name in SLOT_FIELDS:
        return part
    if _CHECKED.get(part) is not slot:
        own.check(slot, part, SLOTS, _OWNERS)
        know([part])
    return part


def know(parts: Iterable[type[Part]]) -> None:
    """Have the names of parts that were checked stand for them, whatever they stood for."""
    for part in parts:
        slot = next(slot for slot in SLOTS if issubclass(part, slot.base))
        if slot.own.get(part.name) is not part:
            slot.own[part.name] = part
            _CHECKED[part] = slot
            _without_meaning.cache_clear()


def named(field: str, value: Any) -> Any:
    """A value of a field; a part that is given by its class by its name, which it has from now on.

    Raises
    ------
    InvalidValue
        Where the class cannot fill the slot.
    """
    for slot in SLOTS if isinstance(value, type) else ():
        if slot.name == field:
            return known(slot, value).name
    return value


def own_named(names: Iterable[str], rows: Iterable[Mapping[str, Any]]) -> dict[str, type[Part]]:
    """The parts of the user's own that rows name in some fields, by name."""
    slots = [slot for slot in SLOTS if slot.own and slot.name in names]
    places = ((slot, row.get(slot.name)) for row in rows for slot in slots)
    return {n: slot.own[n] for slot, n in places if isinstance(n, str) and n in slot.own}


def by_class(values: Mapping[str, Any], parts: Mapping[str, type[Part]]) -> Mapping[str, Any]:
    """Values of fields, with these parts by their classes instead of their names."""
    if not parts:
        return values
    texts = {n: values[n] for n in SLOT_NAMES & set(values) if isinstance(values[n], str)}
    return {**values, **{name: parts.get(text, text) for name, text in texts.items()}}


def fields_with(parts: Iterable[type[Part]]) -> tuple[str, ...]:
    """Names of the fields of scenes that may have these parts of the user's own.

    Raises
    ------
    InvalidValue
        Where one name means several things.
    """
    stated = {name: part.__dataclass_fields__[name] for name, part in _OWNERS.items()}
    names = dict.fromkeys(FIELDS)
    for part in parts:
        names[_CHECKED[part].name] = None
        for name in names_of(part):
            field_, names[name] = part.__dataclass_fields__[name], None
            if stated.setdefault(name, field_).metadata != field_.metadata:
                rule = "is the name of something else, of another part"
                raise InvalidValue(f"field of {part.name}", name, rule)
    return tuple(names)


def quantities_with(parts: Iterable[type[Part]]) -> Iterator[Quantity]:
    """What the fields mean that parts of the user's own add to those of every scene."""
    for part in parts:
        slot = _CHECKED[part]
        stated = (Quantity(slot.name, "", "", slot.long_name), *quantities_of(part))
        yield from (about for about in stated if about.name not in FIELDS)


def kinds_with(parts: Iterable[type[Part]]) -> Mapping[str, Any]:
    """What those fields hold; none, where the part stands for another that owns them."""
    kinds: dict[str, Any] = {**dict.fromkeys(SLOT_NAMES, str), **KINDS}
    parts = tuple(parts)
    for part in parts:
        others = _CHECKED[part].choices.values()
        kinds |= {n: KINDS[n] | None for other in others for n in names_of(other)}
        for name in names_of(part):
            own_kind = (bool if is_flag(part, name) else float) | None
            kinds[name] = KINDS.get(name, own_kind)
    return {name: kinds[name] for name in fields_with(parts)}


# ---- which fields have a meaning -----------------------------------------------------------------


def without_meaning(values: Mapping[str, Any], parts: Iterable[type[Part]] = ()) -> frozenset[str]:
    """Fields that belong to other parts than those that values name.

    Parameters
    ----------
    values : mapping of str to value
    parts : iterable of type
        Parts of the user's own that may be among those.
    """
    try:
        calling = tuple(name for name in CALLERS if values.get(name))
        return _without_meaning(
            tuple(values.get(slot.name) for slot in SLOTS), calling, tuple(parts)
        )
    except (TypeError, ValueError):  # what is no name or number, and cannot be looked up as one
        return frozenset()


@cache
def _without_meaning(
    named: tuple[Any, ...], calling: tuple[str, ...], parts: tuple[type[Part], ...]
) -> frozenset[str]:
    names: set[str] = set()
    for slot, name in zip(SLOTS, named, strict=True):
        part = name if isinstance(name, type) else slot.choices.get(name) or slot.own.get(name)
        meant, every = (FIELDS if part is None else names_of(part)), part is not None
        if name is None and slot.callers:
            called = [slot.callers[caller] for caller in calling if caller in slot.callers]
            # of two that are called for, one is refused
            meant = (*names_of([*called, slot.choices[slot.default]][0]), *slot.callers)
            every = True
        others = [other for other in parts if _CHECKED[other] is slot]
        others += slot.choices.values() if every else []
        names |= {name for other in others for name in names_of(other)} - set(meant)
    return frozenset(names)


def chosen(slot: Slot, given: Mapping[str, Any]) -> type[Part]:
    """The part that is asked for in a slot."""
    value = given.get(slot.name)
    if isinstance(value, type):
        return known(slot, value)
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
    """Where the fields of a scene with certain parts are.

    Attributes
    ----------
    parts : tuple of type
        The parts, the numbers of every slider first.
    places : mapping of str to int
        The place of the part that owns each field.
    refusing : mapping of str to type
        The part that refuses each of the others,
    elsewhere : mapping of str to value
        and what those hold.
    own : mapping of str to type
        Parts of the user's own, by slot.
    fields : tuple of str
        Names of all fields: those of every scene, and those of parts of the user's own.
    plain : frozenset of str
        Those that decide nothing but a number.
    """

    parts: tuple[type[Part], ...]
    places: Mapping[str, int]
    refusing: Mapping[str, type[Part]]
    elsewhere: Mapping[str, Any]
    own: Mapping[str, type[Part]]
    fields: tuple[str, ...]
    plain: frozenset[str]


_LAYOUTS: dict[tuple[type[Part], ...], Layout] = {}


def layout_of(chosen: tuple[type[Part], ...]) -> Layout:
    """The layout of scenes with these parts in the slots, made once."""
    if chosen not in _LAYOUTS:
        _LAYOUTS[chosen] = _laid_out(chosen)
    return _LAYOUTS[chosen]


def _laid_out(chosen: tuple[type[Part], ...]) -> Layout:
    parts: tuple[type[Part], ...] = (Slider, *chosen)
    filled = list(zip(SLOTS, chosen, strict=True))
    owned = {slot.name: part for slot, part in filled if part not in slot.choices.values()}
    places = {name: place for place, part in enumerate(parts) for name in names_of(part)}
    if len(places) < sum(len(names_of(part)) for part in parts):
        names = ", ".join(part.name for part in owned.values())
        raise InvalidValue("parts", names, "have a field of one name", remedy="Rename one.")
    refusing: dict[str, type[Part]] = {}
    elsewhere: dict[str, Any] = {}
    for slot, part in filled:
        if slot.name in (*SLOT_FIELDS, *owned):
            elsewhere[slot.name] = part.name
        for other in slot.choices.values():
            for name in set(names_of(other)) - set(places):
                refusing[name] = part
                calls = name == other.called_by
                elsewhere[name] = other.__dataclass_fields__[name].default if calls else None
    fields = fields_with(owned.values())
    plain = PLAIN_FIELDS | (set(fields) - {*FIELDS, *SLOT_NAMES})
    return Layout(parts, places, refusing, elsewhere, owned, fields, plain)


def refuse_unless_idle(name: str, value: Any, part: type[Part]) -> None:
    """Refuse a value for a field of another part than the one chosen, but for one that calls for
    that part and does not call.
    """
    owner = _OWNERS[name]
    if name != owner.called_by or checked(owner, name, value):
        raise part.refuse(name, value)


def unknown_field(name: str, value: Any, layout: Layout) -> InvalidValue:
    """The error for a name that is no field of a scene with these parts."""
    for slot, part in zip(SLOTS, layout.parts[1:], strict=True):
        owner = next((other for other in slot.own.values() if name in names_of(other)), None)
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
