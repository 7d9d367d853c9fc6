"""User-defined slider parts in study declarations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rsfstudy.quantities import Quantity
from rsfstudy.slider import SceneFields, UserPart


def find_named_user_parts(
    names: Iterable[str], rows: Iterable[Mapping[str, Any]]
) -> dict[str, UserPart]:
    """Find the user-defined parts that are named in field values.

    Parameters
    ----------
    names : iterable of str
        Names of the fields to examine.
    rows : iterable of mapping of str to object
        Field values.

    Returns
    -------
    dict of str to type or UserLoading
        User-defined parts by name.
    """
    slots = [slot for slot in SceneFields.SLOTS if slot.user_parts and slot.name in names]
    places = ((slot, row.get(slot.name)) for row in rows for slot in slots)
    return {
        n: slot.user_parts[n] for slot, n in places if isinstance(n, str) and n in slot.user_parts
    }


def user_field_quantities(parts: Iterable[UserPart]) -> Iterator[Quantity]:
    """Return the quantities of the fields that user-defined parts add.

    Parameters
    ----------
    parts : iterable of type or UserLoading
        User-defined parts.

    Returns
    -------
    iterator of Quantity
        Quantities of the fields that exist only in scenes with user-defined parts.
    """
    return (
        about
        for name, about in SceneFields.quantities_with_user_parts(parts).items()
        if name not in SceneFields.NAMES
    )
