"""Function that converts fault parameters to scene fields."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.rig.units import convert_to_si


def replace_b_by_b_over_a(scene_fields: Mapping[str, Any]) -> dict[str, Any]:
    """Replace the parameter b by the scene field ``b_over_a``.

    Parameters
    ----------
    scene_fields : mapping of str to object
        Scene fields with ``a`` and ``b``.

    Returns
    -------
    dict of str to object
        Scene fields with ``a`` and ``b_over_a``.

    Raises
    ------
    InvalidValue
        If ``b_over_a`` is also given, or if ``a`` is missing.
    """
    b, others = (
        scene_fields["b"],
        {name: value for name, value in scene_fields.items() if name != "b"},
    )
    if "b_over_a" in others:
        raise InvalidValue("b", b, "cannot be combined with b_over_a")
    if others.get("a") is None:
        remedy = "Pass a as well, or replace b by b_over_a."
        raise InvalidValue("b", b, "requires a, because scenes contain b/a", remedy=remedy)
    ratio = convert_to_si("b", b, "1") / convert_to_si("a", others["a"], "1")
    return {**others, "b_over_a": ratio}
