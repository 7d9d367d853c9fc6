"""Axes of a lattice: listed values, labelled points, zipped fields and samples.

An ``Axis`` holds the values of one or several fields along one dimension of a study. The package
checks these values, changes them by overrides, and draws samples from distributions. It never
creates scenes and never computes results.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.axes.axis import (
        Axis,
        Row,
        check_storable_text,
        fields_of_point,
        row_kinds,
        to_plain_value,
    )
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "axes.axis": (
                "Axis",
                "Row",
                "check_storable_text",
                "fields_of_point",
                "row_kinds",
                "to_plain_value",
            ),
        },
    )

__all__ = [
    "Axis",
    "Row",
    "check_storable_text",
    "fields_of_point",
    "row_kinds",
    "to_plain_value",
]
