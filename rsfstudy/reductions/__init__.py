"""Reductions, which compute boundaries, slopes and statistics from a lattice.

A reduction computes new variables from the variables of a results dataset. This package only
exports classes and functions that are defined in ``rsfstudy.study.reductions``. They are used in
studies and in user-defined reductions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.study.reductions.base import Reduction
    from rsfstudy.study.reductions.boundaries import Boundary, Inverse
    from rsfstudy.study.reductions.comparisons import (
        ClosedFormRatio,
        Difference,
        Range,
        RelativeDifference,
    )
    from rsfstudy.study.reductions.fits import LinearFit, PowerLaw, ProportionalFit, SemilogFit
    from rsfstudy.study.reductions.reduction_application import apply_reductions
    from rsfstudy.study.reductions.sobol_indices import SobolIndices
    from rsfstudy.study.reductions.statistics import (
        Logarithm,
        Mean,
        Quantile,
        StandardDeviation,
        StatusShares,
    )
    from rsfstudy.study.reductions.unit_conversion import InUnits
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "study.reductions.reduction_application": ("apply_reductions",),
            "study.reductions.base": ("Reduction",),
            "study.reductions.boundaries": ("Boundary", "Inverse"),
            "study.reductions.comparisons": (
                "ClosedFormRatio",
                "Difference",
                "Range",
                "RelativeDifference",
            ),
            "study.reductions.fits": ("LinearFit", "PowerLaw", "ProportionalFit", "SemilogFit"),
            "study.reductions.sobol_indices": ("SobolIndices",),
            "study.reductions.statistics": (
                "Logarithm",
                "Mean",
                "Quantile",
                "StandardDeviation",
                "StatusShares",
            ),
            "study.reductions.unit_conversion": ("InUnits",),
        },
    )

__all__ = [
    "Boundary",
    "ClosedFormRatio",
    "Difference",
    "InUnits",
    "Inverse",
    "LinearFit",
    "Logarithm",
    "Mean",
    "PowerLaw",
    "ProportionalFit",
    "Quantile",
    "Range",
    "Reduction",
    "RelativeDifference",
    "SemilogFit",
    "SobolIndices",
    "StandardDeviation",
    "StatusShares",
    "apply_reductions",
]
