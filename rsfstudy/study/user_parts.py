"""Parts of the user that a study names, and the quantities of their fields."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rsfstudy.quantities import Quantity
from rsfstudy.slider import FIELD_NAMES, SLOTS, UserPart, scene_fields


def find_named_user_parts(
    names: Iterable[str], rows: Iterable[Mapping[str, Any]]
) -> dict[str, UserPart]:
    """The parts of the user's own that rows name in some fields, by name."""
    slots = [slot for slot in SLOTS if slot.user_parts and slot.name in names]
    places = ((slot, row.get(slot.name)) for row in rows for slot in slots)
    return {
        n: slot.user_parts[n] for slot, n in places if isinstance(n, str) and n in slot.user_parts
    }


def user_field_quantities(parts: Iterable[UserPart]) -> Iterator[Quantity]:
    """Quantities of the fields that parts of the user's own add to those of every scene."""
    return (about for name, about in scene_fields(parts).items() if name not in FIELD_NAMES)
