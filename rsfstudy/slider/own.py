"""A part of a user's own: a class that fills a slot as the files of that slot do.

It is known by its name from its first use on, in this process. A notebook cell that is run again
defines it anew; a name that stands for something else is refused.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from types import CellType, CodeType, FunctionType
from typing import TYPE_CHECKING, Any

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import is_name
from rsfstudy.slider import places
from rsfstudy.slider.parts import Part, has_meaning

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
    _check_kind(slot, part)
    check_name(slot, part, slots)
    taken = RESERVED | {slot.name for slot in slots}
    for stated in fields(part):
        _check_field(slot, part, stated.name, owners)
        if stated.name in taken - set(owners):
            raise _taken(part, stated.name, "every scene")
    _check_places(slot, part)
    for name in part.functions():
        function = inspect.getattr_static(part, name, None)
        if not isinstance(getattr(function, "__func__", None), FunctionType):
            rule, remedy = f"states no {name}", f"Write {name} = staticmethod(a plain function)."
            raise InvalidValue(slot.name, part, rule, remedy=remedy)


def _check_places(slot: Slot, part: type[Part]) -> None:
    """Refuse functions that read numbers at another OWN than the place of their slot: what they
    took for their own would be those of something else.
    """
    place = slot.name.upper()
    for function in _reached(part):
        read = function.__globals__.get("OWN")
        names_it = any("OWN" in code.co_names for code in _codes(function.__code__))
        if names_it and read != getattr(places, place):
            rule = f"reads its numbers at OWN = {read!r} in {function.__name__}, where others are"
            remedy = f"Import {place} from rsfstudy.slider.places, and read p[{place}]."
            raise InvalidValue(slot.name, part, rule, remedy=remedy)


def _reached(part: type[Part]) -> Iterator[FunctionType]:
    """The functions of a part and of its bases, and those that they name or close over."""
    members = (member for kind in part.__mro__ for member in vars(kind).values())
    found, seen = [getattr(m, "__func__", getattr(m, "fget", m)) for m in members], set[int]()
    while found:
        function = found.pop()
        if not isinstance(function, FunctionType) or id(function) in seen:
            continue
        seen.add(id(function))
        yield function
        names = {name for code in _codes(function.__code__) for name in code.co_names}
        found += [function.__globals__.get(name) for name in names]
        found += [cell.cell_contents for cell in function.__closure__ or () if _is_filled(cell)]


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A code, and those inside it."""
    yield code
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from _codes(inner)


def _is_filled(cell: CellType) -> bool:
    try:
        return cell.cell_contents is not None
    except ValueError:  # a name that is yet to be given a value
        return False


def _check_kind(slot: Slot, part: Any) -> None:
    base = f"{slot.base.__module__}.{slot.base.__name__}"
    if not isinstance(part, type) or not issubclass(part, slot.base):
        is_part = isinstance(part, Part) or (isinstance(part, type) and issubclass(part, Part))
        rule = "fills another slot" if is_part else "is no part of a slider"
        raise InvalidValue(slot.name, part, rule, remedy=f"Derive a class from {base}.")
    params = vars(part).get("__dataclass_params__")
    if params is None or not params.frozen:
        remedy = "Write @dataclass(frozen=True, kw_only=True) above its class."
        raise InvalidValue(slot.name, part, "must be a frozen dataclass", remedy=remedy)


def check_name(slot: Slot, part: type[Part] | Part, slots: Iterable[Slot]) -> None:
    """Raise InvalidValue for a name that no part may have, or that something else has."""
    name: object = getattr(part, "name", None)
    remedy = f'Write name = "..." in {origin(part)[1]}.'
    if not isinstance(name, str) or not is_name(name):
        rule = f"must be named by a Python identifier, not {name!r}"
        raise InvalidValue(slot.name, part, rule, remedy=remedy)
    for other in slots:
        if name in other.choices:
            rule = f"takes the name of a part of rsfstudy, {name!r}"
            raise InvalidValue(slot.name, part, rule, remedy=remedy)
        if name in other.own and origin(other.own[name]) != origin(part):
            rule = f"takes the name {name!r} of {'.'.join(origin(other.own[name]))}"
            raise InvalidValue(slot.name, part, rule, remedy=remedy)


def origin(part: type[Part] | Part) -> tuple[str, str]:
    """Module and name of a definition, which an earlier definition of the part shares."""
    kind = part if isinstance(part, type) else type(part)
    return kind.__module__, kind.__qualname__


def _check_field(slot: Slot, part: type[Part], name: str, owners: Mapping[str, type[Part]]) -> None:
    stated = part.__dataclass_fields__[name]
    if not has_meaning(stated):
        rule, remedy = "says neither what it is nor its rule", "State it by number() or flag()."
        raise InvalidValue(_field_of(part), name, rule, remedy=remedy)
    if not is_name(name):
        rule = "must be a Python identifier, its accents composed (NFC)"
        raise InvalidValue(_field_of(part), name, rule)
    owner = owners.get(name)
    if owner is not None:
        # a part of one's own may rule out more
        same = stated.metadata["about"] == owner.__dataclass_fields__[name].metadata["about"]
        if not same or owner not in slot.choices.values():
            common = name in slot.base.__dataclass_fields__
            raise _taken(part, name, f"every {slot.long_name}" if common else owner.name)


def _field_of(part: type[Part]) -> str:
    return f"field of {part.__qualname__}"


def _taken(part: type[Part], name: str, whose: str) -> InvalidValue:
    rule = f"is the name of something else, of {whose}"
    return InvalidValue(_field_of(part), name, rule, remedy="Give it another name.")
