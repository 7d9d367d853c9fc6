"""Tables and summaries of results, for the command line and the HTML report.

The functions take a dataset and return tables of plain text, such as tables of reductions, claims,
failed cells and fits. The package never computes results and never prints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.reporting.fit_tables import all_fits_are_valid, fit_table, is_fit, split_fits
    from rsfstudy.reporting.summaries import (
        TableMappingOrSentence,
        build_summary_pieces,
        describe_dataset_origin,
        is_motion,
        motion_pieces,
    )
    from rsfstudy.reporting.tables import (
        TextTable,
        build_frame_of_cells,
        claims_table,
        count_pending,
        count_statuses,
        count_verdicts,
        describe_scene_and_rig_fields,
        failures_table,
        format_number_or_dash,
        format_status_counts,
        incomplete_notes,
        note_on_norms_near_load_velocity,
        reduction_pieces,
        summarise_study_in_lines,
        summarise_verdicts,
    )
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "reporting.fit_tables": ("all_fits_are_valid", "fit_table", "is_fit", "split_fits"),
            "reporting.summaries": (
                "TableMappingOrSentence",
                "describe_dataset_origin",
                "is_motion",
                "motion_pieces",
                "build_summary_pieces",
            ),
            "reporting.tables": (
                "TextTable",
                "build_frame_of_cells",
                "claims_table",
                "count_pending",
                "count_statuses",
                "count_verdicts",
                "describe_scene_and_rig_fields",
                "failures_table",
                "format_number_or_dash",
                "format_status_counts",
                "incomplete_notes",
                "reduction_pieces",
                "note_on_norms_near_load_velocity",
                "summarise_study_in_lines",
                "summarise_verdicts",
            ),
        },
    )

__all__ = [
    "TableMappingOrSentence",
    "TextTable",
    "all_fits_are_valid",
    "build_frame_of_cells",
    "claims_table",
    "count_pending",
    "count_statuses",
    "count_verdicts",
    "describe_scene_and_rig_fields",
    "describe_dataset_origin",
    "failures_table",
    "fit_table",
    "format_number_or_dash",
    "format_status_counts",
    "incomplete_notes",
    "is_fit",
    "is_motion",
    "motion_pieces",
    "reduction_pieces",
    "note_on_norms_near_load_velocity",
    "split_fits",
    "summarise_study_in_lines",
    "summarise_verdicts",
    "build_summary_pieces",
]
