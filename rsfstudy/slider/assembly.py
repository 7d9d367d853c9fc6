"""Assembly of the parts of a scene from its fields, the place of each field among them, and what
is made of parts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple, Self

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity, ShownAsTable
from rsfstudy.slider import dynamics, fluid, laws, loading, normal_stress
from rsfstudy.slider.derived import derived
from rsfstudy.slider.numbers import SPRING, Slider, with_spring
from rsfstudy.slider.parts import Part, checked, names_of
from rsfstudy.slider.protocol import Stated
from rsfstudy.slider.registry import (
    CALLERS,
    IF_STATED,
    NAMED,
    OWNERS,
    SLOT_NAMES,
    SLOTS,
    Own,
    Slot,
    completed,
    fields_with,
    kind_of,
    name_of,
    resolve,
    shown,
)
from rsfstudy.slider.synonyms import instead_of_choice, instead_of_field, instead_of_unnamed


class Parts(NamedTuple):
    """Parts of a scene: the numbers that every slider has, and what fills each slot."""

    slider: Slider
    law: laws.LawOfStates
    normal_stress: normal_stress.NormalStress
    fluid: fluid.Fluid
    dynamics: dynamics.Dynamics
    loading: loading.Loading


def parts_of(given: Mapping[str, Any]) -> Parts:
    """The parts that fields of a scene ask for, made of what they hold.

    Raises
    ------
    InvalidValue
        For a name that is no field, and for a value that breaks its rule or has no meaning here.
    """
    chosen = tuple(_chosen(slot, given) for slot in SLOTS)
    layout = layout_of(tuple(map(kind_of, chosen)))
    values = _by_place(given, layout)
    made: list[Any] = [
        part(**values.get(place, {})) if isinstance(part, type) else part
        for place, part in enumerate(chosen, start=1)
    ]
    return Parts(Slider(**with_spring(values.get(0, {}))), *made)


def with_numbers(parts: Parts, changes: Mapping[str, Any]) -> Parts:
    """Parts of which those that own these fields hold other numbers.

    Raises
    ------
    InvalidValue
        For a value that breaks its rule or has no meaning for these parts.
    """
    made: list[Any] = list(parts)
    for place, values in _by_place(changes, layout_of(tuple(map(type, parts[1:])))).items():
        if any(name in values for name in SPRING):
            values = {**dict.fromkeys(SPRING), **with_spring(values)}
        made[place] = replace(made[place], **values)
    return Parts._make(made)


def _by_place(given: Mapping[str, Any], layout: Layout) -> dict[int, dict[str, Any]]:
    """What fields hold that are not None, by the place of the part that owns them."""
    values: dict[int, dict[str, Any]] = {}
    kinds, places, idle = layout.kinds, layout.places, layout.idle
    for name, value in given.items():
        place = places.get(name)
        if place is not None:
            if value is not None:
                values.setdefault(place, {})[name] = checked(kinds[place], name, value)
        elif name in idle:
            # one that calls for another part may be stated, if it does not call
            if value is None or value is idle[name]:
                continue
            owner = OWNERS[name]
            if name != owner.called_by or checked(owner, name, value):
                raise layout.refusing[name].refuse(name, value)
        elif name not in SLOT_NAMES:
            raise _unknown_field(name, value, layout)
    return values


def _chosen(slot: Slot, given: Mapping[str, Any]) -> Own:
    """The part that is asked for in a slot."""
    value = given.get(slot.name)
    if isinstance(value, type | Stated):
        return resolve(slot, value)
    if isinstance(value, str) and value in slot.own and value not in slot.choices:
        return slot.own[value]
    if not slot.callers:
        name = name_of(slot.name, given.get(slot.name, slot.default))
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
    """Places of the fields of scenes with certain parts.

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
    foreign : frozenset of str
        Those of them without meaning, whatever they hold: all but the idle ones that call for a
        part by their values.
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
    foreign: frozenset[str]
    named: tuple[str, ...]
    fields: tuple[str, ...]
    plain: frozenset[str]


@cache
def layout_of(chosen: tuple[type[Part], ...]) -> Layout:
    """The layout of scenes with parts of these classes in the slots."""
    kinds: tuple[type[Part], ...] = (Slider, *chosen)
    filled = list(zip(SLOTS, chosen, strict=True))
    owned = {slot.name: part for slot, part in filled if part not in slot.choices.values()}
    places = {name: place for place, part in enumerate(kinds) for name in names_of(part)}
    if len(places) < sum(len(names_of(part)) for part in kinds):
        names = ", ".join(part.name for part in owned.values())
        raise InvalidValue("parts", names, "have a field of one name", remedy="Rename one.")
    refusing: dict[str, type[Part]] = {}
    idle: dict[str, Any] = {}
    foreign: set[str] = set()
    for slot, part in filled:
        for other in slot.choices.values():
            for name in set(names_of(other)) - set(places):
                refusing[name] = part
                calls = name == other.called_by
                idle[name] = other.__dataclass_fields__[name].default if calls else None
                if not calls or slot.name in owned:
                    foreign.add(name)
    named = tuple(slot.name for slot in SLOTS if slot in NAMED or slot.name in owned)
    fields = tuple(fields_with(owned.values()))
    plain = frozenset(fields) - {*SLOT_NAMES, *CALLERS}
    return Layout(kinds, places, refusing, idle, frozenset(foreign), named, fields, plain)


def without_meaning(values: Mapping[str, Any], parts: Iterable[Own] = ()) -> frozenset[str]:
    """Fields that belong to other parts than those that values name; none where these name no part.

    Parameters
    ----------
    values : mapping of str to value
    parts : iterable of type or Stated
        Parts of the user's own that may be among those.
    """
    try:
        layout = layout_of(tuple(kind_of(_chosen(slot, values)) for slot in SLOTS))
    except InvalidValue:
        return frozenset()
    of_others = {name for part in parts for name in names_of(kind_of(part))}
    return layout.foreign | (of_others - set(layout.places))


def own_parts(parts: Parts) -> dict[str, Own]:
    """Those of the parts that are the user's own, by slot."""
    filled = zip(SLOTS, parts[1:], strict=True)
    return {
        slot.name: part if isinstance(part, Stated) else type(part)
        for slot, part in filled
        if type(part) not in slot.choices.values()
    }


#: Attributes of a scene that only its equations and its lattice ask for.
_INNER = frozenset(
    {"layout", "made", "functions", "numbers", "numbers_of_friction", "under", "shown"}
)


@guard_methods
class Assembled(ShownAsTable):
    """Base of a scene: what is made of parts, whose fields it has as its own.

    Attributes
    ----------
    parts : Parts
    """

    parts: Parts

    def __init__(self, parts: Parts | None = None, /, **given: Any) -> None:
        if parts is None:
            parts = parts_of(given)
        elif not isinstance(parts, Parts):
            raise unnamed(parts)
        object.__setattr__(self, "parts", parts)
        self._check()

    def _check(self) -> None:
        """Refuse parts that mean nothing together."""

    def __getattr__(self, name: str) -> Any:
        """A field, which is that of a part, or of none here."""
        if name.startswith("_"):
            raise AttributeError(name)
        layout = self.layout
        if name in layout.places:
            return getattr(self.parts[layout.places[name]], name)
        if name in layout.named:
            return getattr(self.parts, name).name
        if name in layout.idle:
            return layout.idle[name]
        raise AttributeError(f"a Scene has no field or attribute {name!r}")

    def __repr__(self) -> str:
        return f"Scene({', '.join(f'{k}={v!r}' for k, v in self.as_dict().items())})"

    def __dir__(self) -> list[str]:
        """Names that users ask for; a field without meaning in this scene is left out."""
        # what is not stated may follow from other fields
        stated = {name for name, value in self.as_dict().items() if value is not None}
        names = {*super().__dir__(), *stated} - _INNER
        return [name for name in names if not name.startswith("_")]

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.parts,)

    @derived
    def layout(self) -> Layout:
        """Places of the fields."""
        return layout_of(tuple(map(type, self.parts[1:])))

    def as_dict(self) -> dict[str, Any]:
        """The fields as plain Python values."""
        values = dict(self.layout.idle)
        for name in self.layout.named:
            values[name] = getattr(self.parts, name).name
        for part in self.parts:
            values |= vars(part)
        kept = (n for n in self.layout.fields if n not in IF_STATED or values[n] is not None)
        return {name: values[name] for name in kept}

    def describe(self) -> dict[str, Any]:
        """The fields, and the segments of a loading of the user's own, as `protocol` takes them; or
        the digest of its samples.
        """
        history = self.parts.loading.describe() if "loading" in self.layout.named else {}
        return self.as_dict() | history

    @property
    def own_parts(self) -> tuple[Own, ...]:
        """Those of its parts that are the user's own."""
        return tuple(own_parts(self.parts).values())

    def shown(self) -> Iterator[tuple[Quantity, object]]:
        """The fields that mean something in it, with their values."""
        return shown(self.as_dict(), self.own_parts)

    @completed()
    def with_(self, **changes: Any) -> Self:
        """A copy with some fields changed, checked anew.

        Changing what fills a slot drops the fields that have no meaning any more; stiffness takes
        the place of its ratio, and the other way round.
        """
        if all(n in self.layout.plain and value is not None for n, value in changes.items()):
            return type(self)(with_numbers(self.parts, changes))
        theirs = own_parts(self.parts)
        kept = {**self.as_dict(), **theirs}
        dropped = without_meaning({**kept, **changes}, theirs.values())
        if any(changes.get(name) is not None for name in SPRING):
            dropped |= {*SPRING}
        return type(self)(**{name: kept[name] for name in kept if name not in dropped} | changes)


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
