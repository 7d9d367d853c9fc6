"""Axes of a study: lists of values, labelled points, zipped fields and samples.

An ``Axis`` holds the values of one or several fields along one dimension of a study. The package
checks the values of an axis, applies overrides to the values, and draws samples from distributions.
The package never creates scenes and never computes results.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.axes.axis import (
        Axis,
        AxisPointFieldValues,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "axes.axis": (
                "Axis",
                "AxisPointFieldValues",
            ),
        },
    )

__all__ = [
    "Axis",
    "AxisPointFieldValues",
]
