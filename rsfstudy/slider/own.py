"""A part of a user's own: a class that fills a slot as the files of that slot do.

It is known by its name from its first use on, in this process. A notebook cell that is run again
defines it anew; a name that stands for something else is refused.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from dataclasses import fields
from types import FunctionType
from typing import TYPE_CHECKING, Any

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import is_name
from rsfstudy.slider.parts import Part

if TYPE_CHECKING:
    from rsfstudy.slider.registry import Slot

#: Names that every scene has beside its fields; `scene` states them.
RESERVED: set[str] = set()


def check(slot: Slot, part: Any, slots: Iterable[Slot], owners: Mapping[str, type[Part]]) -> None:
    """Raise InvalidValue for what cannot fill a slot.

    Parameters
    ----------
    slot : Slot
        The one it is to fill.
    part : object
        What was given for it.
    slots : iterable of Slot
        All, whose parts have names already.
    owners : mapping of str to type
        The parts of rsfstudy, by the fields of a scene that they own.
    """
    if not isinstance(part, type) or not issubclass(part, slot.base):
        is_part = issubclass(part if isinstance(part, type) else type(part), Part)
        rule = "fills another slot" if is_part else "is no part of a slider"
        remedy = f"Derive a class from {slot.base.__module__}.{slot.base.__name__}."
        raise InvalidValue(slot.name, part, rule, remedy=remedy)
    params = vars(part).get("__dataclass_params__")
    if params is None or not params.frozen:
        remedy = "Write @dataclass(frozen=True, kw_only=True) above its class."
        raise InvalidValue(slot.name, part, "must be a frozen dataclass", remedy=remedy)
    check_name(slot, part, slots)
    _check_fields(slot, part, RESERVED | {slot.name for slot in slots}, owners)
    for name in part.functions():
        function = inspect.getattr_static(part, name, None)
        if not isinstance(getattr(function, "__func__", None), FunctionType):
            rule, remedy = f"states no {name}", f"Write {name} = staticmethod(a plain function)."
            raise InvalidValue(slot.name, part, rule, remedy=remedy)


def check_name(slot: Slot, part: type[Part] | Part, slots: Iterable[Slot]) -> None:
    """Raise InvalidValue for a name that no part may have, or that something else has."""
    name: object = getattr(part, "name", None)
    rule = "" if is_name(name) else f"must be named by a Python identifier, not {name!r}"
    for other in slots:
        if name in other.choices:
            rule = f"takes the name of a part of rsfstudy, {name!r}"
        elif name in other.own and origin(other.own[name]) != origin(part):
            rule = f"takes the name {name!r} of {'.'.join(origin(other.own[name]))}"
    if rule:
        remedy = f'Write name = "..." in {origin(part)[1]}.'
        raise InvalidValue(slot.name, part, rule, remedy=remedy)


def origin(part: type[Part] | Part) -> tuple[str, str]:
    """Module and name of a definition, which an earlier definition of the part shares."""
    kind = part if isinstance(part, type) else type(part)
    return kind.__module__, kind.__qualname__


def _check_fields(
    slot: Slot, part: type[Part], taken: set[str], owners: Mapping[str, type[Part]]
) -> None:
    """Refuse fields that say nothing of themselves, or have the name of something else."""
    what, remedy = f"field of {part.__qualname__}", "Give it another name."
    for stated in fields(part):
        name, about, owner = stated.name, stated.metadata.get("about"), owners.get(stated.name)
        if about is None:
            rule, state = "says neither what it is nor its rule", "State it by number() or flag()."
            raise InvalidValue(what, name, rule, remedy=state)
        if not is_name(name):
            rule = "must be a Python identifier, its accents composed (NFC)"
            raise InvalidValue(what, name, rule)
        whose = "every scene" if owner is None and name in taken else ""
        if owner is not None:
            # a part of one's own may rule out more
            same = about == owner.__dataclass_fields__[name].metadata["about"]
            if not same or owner not in slot.choices.values():
                common = name in slot.base.__dataclass_fields__
                whose = f"every {slot.long_name}" if common else owner.name
        if whose:
            rule = f"is the name of something else, of {whose}"
            raise InvalidValue(what, name, rule, remedy=remedy)
