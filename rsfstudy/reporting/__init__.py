"""Tables and summaries of results, for the command line and the HTML report.

The functions take a dataset and return tables of plain text, such as tables of reductions, claims,
failed cells and fits. The package never computes results and never prints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.reporting.event_tables import build_record_events_pieces, list_record_events
    from rsfstudy.reporting.fit_tables import (
        all_fits_are_valid,
        fit_table,
        is_fit,
        split_into_single_fits,
    )
    from rsfstudy.reporting.summaries import (
        SummaryTableOrSentence,
        build_motion_tables_and_sentences,
        build_summary_tables_and_sentences,
        describe_dataset_origin,
        is_motion,
    )
    from rsfstudy.reporting.tables import (
        TextTable,
        build_frame_of_cells,
        build_reduction_tables_and_sentences,
        claims_table,
        count_pending_cells,
        count_statuses,
        count_verdicts,
        describe_scene_and_rig_fields,
        failures_table,
        format_notes_on_incomplete_results,
        format_number_or_dash,
        format_status_counts,
        note_on_norms_near_load_velocity,
        summarise_study_as_text_lines,
        summarise_verdicts,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "reporting.event_tables": ("build_record_events_pieces", "list_record_events"),
            "reporting.fit_tables": (
                "all_fits_are_valid",
                "fit_table",
                "is_fit",
                "split_into_single_fits",
            ),
            "reporting.summaries": (
                "SummaryTableOrSentence",
                "describe_dataset_origin",
                "is_motion",
                "build_motion_tables_and_sentences",
                "build_summary_tables_and_sentences",
            ),
            "reporting.tables": (
                "TextTable",
                "build_frame_of_cells",
                "claims_table",
                "count_pending_cells",
                "count_statuses",
                "count_verdicts",
                "describe_scene_and_rig_fields",
                "failures_table",
                "format_number_or_dash",
                "format_status_counts",
                "format_notes_on_incomplete_results",
                "build_reduction_tables_and_sentences",
                "note_on_norms_near_load_velocity",
                "summarise_study_as_text_lines",
                "summarise_verdicts",
            ),
        },
    )

__all__ = [
    "SummaryTableOrSentence",
    "TextTable",
    "all_fits_are_valid",
    "build_record_events_pieces",
    "list_record_events",
    "build_frame_of_cells",
    "claims_table",
    "count_pending_cells",
    "count_statuses",
    "count_verdicts",
    "describe_scene_and_rig_fields",
    "describe_dataset_origin",
    "failures_table",
    "fit_table",
    "format_number_or_dash",
    "format_status_counts",
    "format_notes_on_incomplete_results",
    "is_fit",
    "is_motion",
    "build_motion_tables_and_sentences",
    "build_reduction_tables_and_sentences",
    "note_on_norms_near_load_velocity",
    "split_into_single_fits",
    "summarise_study_as_text_lines",
    "summarise_verdicts",
    "build_summary_tables_and_sentences",
]
