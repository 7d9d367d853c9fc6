"""Functions that find the user-defined slider parts of a study and their quantities."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rsfstudy.quantities import Quantity
from rsfstudy.slider import SceneFields, UserPart


def find_user_parts_in_axis_rows(
    field_names: Iterable[str], axis_rows: Iterable[Mapping[str, Any]]
) -> dict[str, UserPart]:
    """Find the user-defined parts that are named in field values.

    Parameters
    ----------
    field_names : iterable of str
        Names of the fields to examine.
    axis_rows : iterable of mapping of str to object
        Field values.

    Returns
    -------
    dict of str to type or UserLoading
        User-defined parts by name.
    """
    slots = [
        slot for slot in SceneFields.PART_SLOTS if slot.user_parts and slot.name in field_names
    ]
    places = ((slot, row.get(slot.name)) for row in axis_rows for slot in slots)
    return {
        n: slot.user_parts[n] for slot, n in places if isinstance(n, str) and n in slot.user_parts
    }


def list_user_field_quantities(user_parts: Iterable[UserPart]) -> Iterator[Quantity]:
    """Return the quantities that describe the scene fields of user-defined parts.

    Parameters
    ----------
    user_parts : iterable of type or UserLoading
        User-defined parts.

    Returns
    -------
    iterator of Quantity
        Quantities of the fields that exist only in scenes with user-defined parts.
    """
    return (
        about
        for name, about in SceneFields.map_field_names_to_quantities(user_parts).items()
        if name not in SceneFields.NAMES
    )
