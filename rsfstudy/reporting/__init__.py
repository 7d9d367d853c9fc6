"""Tables and summaries of results, for the command line and the HTML report.

Functions take a results dataset and return tables of plain text: reductions, claims, failed cells,
fits, and the origin of a file. The package never computes results and never prints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.reporting.fit_tables import all_answered, fit_table, is_fit, split_fits
    from rsfstudy.reporting.summaries import (
        SummaryPiece,
        describe_origin,
        is_motion,
        motion_pieces,
        summary_pieces,
    )
    from rsfstudy.reporting.tables import (
        Table,
        cells_frame,
        claims_table,
        count_pending,
        count_statuses,
        count_verdicts,
        describe_fields,
        failures_table,
        format_number,
        format_status_counts,
        incomplete_notes,
        reduction_pieces,
        slow_norm_note,
        summarise_in_lines,
        summarise_verdicts,
    )
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "reporting.fit_tables": ("all_answered", "fit_table", "is_fit", "split_fits"),
            "reporting.summaries": (
                "SummaryPiece",
                "describe_origin",
                "is_motion",
                "motion_pieces",
                "summary_pieces",
            ),
            "reporting.tables": (
                "Table",
                "cells_frame",
                "claims_table",
                "count_pending",
                "count_statuses",
                "count_verdicts",
                "describe_fields",
                "failures_table",
                "format_number",
                "format_status_counts",
                "incomplete_notes",
                "reduction_pieces",
                "slow_norm_note",
                "summarise_in_lines",
                "summarise_verdicts",
            ),
        },
    )

__all__ = [
    "SummaryPiece",
    "Table",
    "all_answered",
    "cells_frame",
    "claims_table",
    "count_pending",
    "count_statuses",
    "count_verdicts",
    "describe_fields",
    "describe_origin",
    "failures_table",
    "fit_table",
    "format_number",
    "format_status_counts",
    "incomplete_notes",
    "is_fit",
    "is_motion",
    "motion_pieces",
    "reduction_pieces",
    "slow_norm_note",
    "split_fits",
    "summarise_in_lines",
    "summarise_verdicts",
    "summary_pieces",
]
