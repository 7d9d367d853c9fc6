"""The fields of a scene: those every slider has, and those of the parts that may fill its slots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple, get_type_hints

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity
from rsfstudy.slider import dynamics, laws, loading, normal_stress
from rsfstudy.slider.parts import Part, checked, names_of, number, quantities_of

_POSITIVE = "must be greater than 0"


@dataclass(frozen=True, kw_only=True)
class Slider(Part):
    """The numbers that every slider has."""

    a: float = number(0.0145, "$a$", "1", "direct effect parameter", rule=_POSITIVE)
    mu_star: float = number(
        0.76,
        r"$\mu_*$",
        "1",
        "steady-state friction coefficient at the reference rate",
        rule=_POSITIVE,
    )
    stiffness_ratio: float | None = number(
        None, r"$k/k_{cr}(V_*)$", "1", "stiffness over critical stiffness at V_star", rule=_POSITIVE
    )
    stiffness: float | None = number(
        None, r"$k D_c/\sigma_*$", "1", "stiffness", rule=_POSITIVE, scale="sigma_*/D_c"
    )
    period: float = number(5.0, "$T$", "s", "period of free oscillation", rule=_POSITIVE)
    reference_rate: float = number(
        1.17e-8, "$V_*/D_c$", "s-1", "reference slip rate over slip distance", rule=_POSITIVE
    )
    instability_norm: float = number(
        5e-4, r"$VT/(2\pi D_c)$", "1", "slip rate norm that counts as unstable", rule=_POSITIVE
    )

    name = "slider"


@dataclass(frozen=True)
class Slot:
    """What a scene has one of: the choices by name, and the one that is meant where none is
    named.
    """

    name: str
    choices: Mapping[str, type[Part]]
    default: str
    long_name: str

    @cached_property
    def callers(self) -> Mapping[str, type[Part]]:
        """The fields that call for a part by their values."""
        return {part.called_by: part for part in self.choices.values() if part.called_by}

    @cached_property
    def is_named(self) -> bool:
        """Whether a field of a scene names the choice; else the value of another calls for it."""
        return not self.callers


SLOTS: tuple[Slot, ...] = (
    Slot("law", laws.PARTS, "slip", "state evolution law"),
    Slot("normal_stress", normal_stress.PARTS, "variable", "normal stress condition"),
    Slot("dynamics", dynamics.PARTS, "quasi_static", "what balances the spring besides friction"),
    Slot("loading", loading.PARTS, "step", "what the load point does"),
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
#: Those that decide neither what fills a slot nor which of two fields sets the spring.
PLAIN_FIELDS: frozenset[str] = frozenset(FIELDS) - {
    *SLOT_FIELDS,
    *(name for slot in SLOTS for name in slot.callers),
    *("stiffness_ratio", "stiffness"),
}
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
        or part.called_by
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


def without_meaning(values: Mapping[str, Any]) -> frozenset[str]:
    """Fields that belong to other parts than those that values name."""
    named = tuple(values[slot.name] for slot in NAMED)
    return _without_meaning(named) if all(isinstance(n, str) for n in named) else frozenset()


@cache
def _without_meaning(named: tuple[str, ...]) -> frozenset[str]:
    names: set[str] = set()
    for slot, name in zip(NAMED, named, strict=True):
        if name in slot.choices:
            others = {n for other in slot.choices.values() for n in names_of(other)}
            names |= others - set(names_of(slot.choices[name]))
    return frozenset(names)


def chosen(slot: Slot, given: Mapping[str, Any]) -> type[Part]:
    """The part that is asked for in a slot."""
    if slot.is_named:
        name = given.get(slot.name, slot.default)
        if not isinstance(name, str) or name not in slot.choices:
            raise InvalidValue(slot.name, name, "is unknown", choices=slot.choices)
        return slot.choices[name]
    for field, part in slot.callers.items():
        value = given.get(field)
        if value is not None and checked(part, field, value):
            return part
    return slot.choices[slot.default]


class Layout(NamedTuple):
    """Where the fields of a scene with certain parts are: the place of the part that owns each; the
    part that refuses each of the others; and what those hold.
    """

    parts: tuple[type[Part], ...]
    places: Mapping[str, int]
    refusing: Mapping[str, type[Part]]
    elsewhere: Mapping[str, Any]


_LAYOUTS: dict[tuple[type[Part], ...], Layout] = {}


def layout_of(chosen: tuple[type[Part], ...]) -> Layout:
    """The layout of scenes with these parts in the slots, made once."""
    if chosen not in _LAYOUTS:
        _LAYOUTS[chosen] = _laid_out(chosen)
    return _LAYOUTS[chosen]


def _laid_out(chosen: tuple[type[Part], ...]) -> Layout:
    parts: tuple[type[Part], ...] = (Slider, *chosen)
    places = {name: place for place, part in enumerate(parts) for name in names_of(part)}
    refusing: dict[str, type[Part]] = {}
    elsewhere: dict[str, Any] = {}
    for slot, part in zip(SLOTS, chosen, strict=True):
        if slot.name in SLOT_FIELDS:
            elsewhere[slot.name] = part.name
        for other in slot.choices.values():
            for name in set(names_of(other)) - set(places):
                refusing[name] = part
                calls = name == other.called_by
                elsewhere[name] = other.__dataclass_fields__[name].default if calls else None
    return Layout(parts, places, refusing, elsewhere)


def refuse_unless_idle(name: str, value: Any, part: type[Part]) -> None:
    """Refuse a value for a field of another part than the one chosen, but for one that calls for
    that part and does not call.
    """
    owner = _OWNERS[name]
    if name != owner.called_by or checked(owner, name, value):
        raise part.refuse(name, value)


def unknown_field(name: str) -> InvalidValue:
    """The error for a name that is no field of a scene."""
    return InvalidValue("field", name, "is not a field of a scene", choices=FIELDS)
