"""Studies, which combine axes, a measure, reductions, claims and a figure.

A ``Study`` describes a lattice of parameter combinations (cells) and the results to compute in each
cell. This package checks declarations, loads named studies, applies reductions to results, and
compares results with claims. The package never runs a study, reads or writes a results file, or
draws a figure.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.study.claim_verdict_table import format_verdict_row_for_report
    from rsfstudy.study.claims import (
        Claim,
        build_verdict_table,
    )
    from rsfstudy.study.conversion_to_rig_units import convert_study_to_rig_units
    from rsfstudy.study.figure_declarations import (
        DrawFunction,
        Figure,
        Panel,
    )
    from rsfstudy.study.lattice_cell import Cell, CellFieldChanges
    from rsfstudy.study.named_study_index import (
        NAMED_STUDIES_PACKAGE,
        list_study_names,
        read_study_titles,
    )
    from rsfstudy.study.reductions.base import (
        is_failed_or_pending,
        read_quantities_not_in_vocabulary,
    )
    from rsfstudy.study.study import Study
    from rsfstudy.study.study_loader import load_study
    from rsfstudy.study.user_defined_parts import find_user_parts_in_axis_rows
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "study.study_loader": ("load_study",),
            "study.lattice_cell": ("Cell", "CellFieldChanges"),
            "study.claims": (
                "Claim",
                "build_verdict_table",
            ),
            "study.figure_declarations": (
                "DrawFunction",
                "Figure",
                "Panel",
            ),
            "study.reductions.base": ("is_failed_or_pending", "read_quantities_not_in_vocabulary"),
            "study.conversion_to_rig_units": ("convert_study_to_rig_units",),
            "study.study": ("Study",),
            "study.named_study_index": (
                "NAMED_STUDIES_PACKAGE",
                "list_study_names",
                "read_study_titles",
            ),
            "study.user_defined_parts": ("find_user_parts_in_axis_rows",),
            "study.claim_verdict_table": ("format_verdict_row_for_report",),
        },
    )

__all__ = [
    "Cell",
    "CellFieldChanges",
    "Claim",
    "DrawFunction",
    "Figure",
    "Panel",
    "NAMED_STUDIES_PACKAGE",
    "Study",
    "build_verdict_table",
    "find_user_parts_in_axis_rows",
    "format_verdict_row_for_report",
    "is_failed_or_pending",
    "load_study",
    "read_quantities_not_in_vocabulary",
    "list_study_names",
    "read_study_titles",
    "convert_study_to_rig_units",
]
