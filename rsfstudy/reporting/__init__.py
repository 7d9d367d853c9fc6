"""Functions that present results as tables and summaries in commands and reports.

Most functions take a dataset and return tables whose cells are strings. There are tables of
reductions, claims, failed cells and fits. The package never computes results and never prints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.reporting.cell_tables import (
        build_data_frame_of_cells,
        build_failed_cells_table,
        count_cells_by_status,
        count_pending_cells,
        find_failed_cells,
        format_notes_on_incomplete_results,
        format_status_counts,
    )
    from rsfstudy.reporting.claim_verdict_tables import (
        build_claims_table,
        format_verdict_counts,
        summarise_verdicts_and_failures,
    )
    from rsfstudy.reporting.dataset_origin_descriptions import (
        describe_scene_and_rig_fields,
        format_note_on_low_instability_norms,
    )
    from rsfstudy.reporting.dataset_summaries import (
        SummaryTableOrSentence,
        build_motion_tables_and_sentences,
        build_summary_tables_and_sentences,
        describe_dataset_origin,
        is_motion_dataset,
    )
    from rsfstudy.reporting.event_catalogue_tables import (
        build_record_events_tables_and_sentences,
        summarise_events_as_json_fields,
    )
    from rsfstudy.reporting.fit_summaries import format_value_with_stderr
    from rsfstudy.reporting.fit_tables import (
        are_all_fits_valid,
        build_fit_table,
        contains_fits,
        split_into_single_fits,
        summarise_fits_as_json_fields,
    )
    from rsfstudy.reporting.hold_summaries import is_hold_table, summarise_holds
    from rsfstudy.reporting.json_summaries import (
        build_result_variables_table,
        classify_file_contents,
        summarise_file_as_json_fields,
        summarise_study_as_json_fields,
    )
    from rsfstudy.reporting.lattice_tables import (
        summarise_study_as_text_lines,
    )
    from rsfstudy.reporting.reduction_tables import (
        build_reduction_tables_and_sentences,
    )
    from rsfstudy.reporting.text_tables import (
        TextTable,
        format_number_or_dash,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "reporting.cell_tables": (
                "build_data_frame_of_cells",
                "build_failed_cells_table",
                "count_cells_by_status",
                "count_pending_cells",
                "find_failed_cells",
                "format_notes_on_incomplete_results",
                "format_status_counts",
            ),
            "reporting.event_catalogue_tables": (
                "build_record_events_tables_and_sentences",
                "summarise_events_as_json_fields",
            ),
            "reporting.fit_tables": (
                "are_all_fits_valid",
                "build_fit_table",
                "contains_fits",
                "split_into_single_fits",
                "summarise_fits_as_json_fields",
            ),
            "reporting.fit_summaries": ("format_value_with_stderr",),
            "reporting.hold_summaries": ("is_hold_table", "summarise_holds"),
            "reporting.lattice_tables": ("summarise_study_as_text_lines",),
            "reporting.json_summaries": (
                "build_result_variables_table",
                "classify_file_contents",
                "summarise_file_as_json_fields",
                "summarise_study_as_json_fields",
            ),
            "reporting.dataset_origin_descriptions": (
                "describe_scene_and_rig_fields",
                "format_note_on_low_instability_norms",
            ),
            "reporting.reduction_tables": ("build_reduction_tables_and_sentences",),
            "reporting.dataset_summaries": (
                "SummaryTableOrSentence",
                "build_motion_tables_and_sentences",
                "build_summary_tables_and_sentences",
                "describe_dataset_origin",
                "is_motion_dataset",
            ),
            "reporting.text_tables": (
                "TextTable",
                "format_number_or_dash",
            ),
            "reporting.claim_verdict_tables": (
                "build_claims_table",
                "format_verdict_counts",
                "summarise_verdicts_and_failures",
            ),
        },
    )

__all__ = [
    "SummaryTableOrSentence",
    "TextTable",
    "are_all_fits_valid",
    "build_result_variables_table",
    "build_record_events_tables_and_sentences",
    "summarise_events_as_json_fields",
    "build_data_frame_of_cells",
    "build_motion_tables_and_sentences",
    "build_reduction_tables_and_sentences",
    "build_summary_tables_and_sentences",
    "build_claims_table",
    "classify_file_contents",
    "count_pending_cells",
    "count_cells_by_status",
    "format_verdict_counts",
    "describe_dataset_origin",
    "describe_scene_and_rig_fields",
    "build_failed_cells_table",
    "build_fit_table",
    "find_failed_cells",
    "format_notes_on_incomplete_results",
    "format_number_or_dash",
    "format_status_counts",
    "format_value_with_stderr",
    "contains_fits",
    "is_hold_table",
    "is_motion_dataset",
    "summarise_fits_as_json_fields",
    "format_note_on_low_instability_norms",
    "split_into_single_fits",
    "summarise_file_as_json_fields",
    "summarise_holds",
    "summarise_study_as_json_fields",
    "summarise_study_as_text_lines",
    "summarise_verdicts_and_failures",
]
