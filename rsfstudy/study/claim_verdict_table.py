"""Tables that list claims and their verdicts, for terminals and notebooks."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any, ClassVar

import pandas as pd

from rsfstudy.errors import escape_control_characters
from rsfstudy.former_data_names import (
    NEW_VERDICT_COLUMN_BY_FORMER_COLUMN,
    TableAcceptingFormerColumnNames,
)
from rsfstudy.quantities import HtmlText

_INEQUALITY_SIGN_BY_RELATION = {"equals": "", "below": "< ", "above": "> "}
#: Width of a line on a terminal, and width of the column with the identifiers of the claims, in
#: characters.
_TERMINAL_LINE_WIDTH, _CLAIM_ID_WIDTH = 100, 12
#: Columns that must be present in a table that is printed on a terminal.
_COLUMNS_PRINTED_ON_TERMINAL = (
    "id",
    "claim",
    "relation",
    "published",
    "computed",
    "tolerance",
    "verdict",
    "verdict_changed",
)


def format_published_value(verdict_row: dict[Any, Any]) -> str:
    """Format the published value of a claim.

    Parameters
    ----------
    verdict_row : dict
        Row of the table of verdicts.

    Returns
    -------
    str
        Published value. The value of an inequality is preceded by ``<`` or ``>``.
    """
    return f"{_INEQUALITY_SIGN_BY_RELATION[verdict_row['relation']]}{verdict_row['published']:.6g}"


def _format_row_for_terminal(verdict_row: dict[Any, Any]) -> dict[str, str]:
    """Format the cells of a verdict row for a terminal."""
    return {
        "id": textwrap.shorten(str(verdict_row["id"]), _CLAIM_ID_WIDTH, placeholder="..."),
        "claim": " ".join(str(verdict_row["claim"]).split()),
        "published": format_published_value(verdict_row),
        "computed": f"{verdict_row['computed']:.6g}",
        "tolerance": f"{verdict_row['tolerance']:.3g}",
        "verdict": verdict_row["verdict"] + ", unexpected" * bool(verdict_row["verdict_changed"]),
    }


def _format_aligned_table(rows: list[dict[str, str]]) -> str:
    """Align the columns of a table under their headings.

    The column with the statements is shortened to fit the width of the terminal.
    """
    table = [{name: name for name in rows[0]}, *rows]
    wide = {name: max(len(row[name]) for row in table) for name in rows[0]}
    others = sum(width + 2 for name, width in wide.items() if name != "claim")
    wide["claim"] = min(wide["claim"], _TERMINAL_LINE_WIDTH - others)
    for row in table:
        row["claim"] = textwrap.shorten(row["claim"], wide["claim"], placeholder=" ...")
    lines = ("  ".join(f"{row[name]:{width}}" for name, width in wide.items()) for row in table)
    return "\n".join(line.rstrip() for line in lines)


class ClaimVerdictTable(TableAcceptingFormerColumnNames):
    """Table of the verdicts on claims, with one row per claim.

    Selections from the table are ordinary data frames.
    """

    NEW_COLUMN_BY_FORMER_COLUMN: ClassVar[Mapping[str, str]] = NEW_VERDICT_COLUMN_BY_FORMER_COLUMN

    def __repr__(self) -> str:
        """Format the table for a terminal."""
        if self.empty or not set(_COLUMNS_PRINTED_ON_TERMINAL) <= set(self):
            return super().__repr__()
        return escape_control_characters(
            _format_aligned_table(
                [_format_row_for_terminal(row) for row in self.to_dict("records")]
            )
        )

    def _repr_html_(self) -> str:
        rows = [format_verdict_row_for_report(row) for row in self.to_dict("records")]
        return (
            HtmlText.format_table(list(rows[0]), [list(row.values()) for row in rows])
            if rows
            else "<p>no claims</p>"
        )


def format_verdict_row_for_report(verdict_row: dict[Any, Any]) -> dict[str, str]:
    """Format the cells of a verdict row for a notebook or a report.

    Parameters
    ----------
    verdict_row : dict
        Row of the table of verdicts.

    Returns
    -------
    dict of str to str
        Cells of the row by heading. If the row has a column ``study``, the text of the claim begins
        with the name of the study.
    """
    reason = f"{verdict_row['tolerance']:.3g}: {verdict_row['reason']}"
    if verdict_row["difference_reason"]:
        reason += f". The result differs because {verdict_row['difference_reason']}"
    if note := verdict_row.get("note", ""):
        reason += f". Note: {note}"
    of = f"{verdict_row['study']}: " if "study" in verdict_row else ""
    return {
        "id": str(verdict_row["id"]),
        "claim": f"{of}{verdict_row['claim']}",
        "published": format_published_value(verdict_row),
        "computed": "-" if pd.isna(verdict_row["computed"]) else f"{verdict_row['computed']:.6g}",
        "tolerance and reason": reason,
        "verdict": verdict_row["verdict"]
        + f", expected {verdict_row['expected']}" * bool(verdict_row["verdict_changed"]),
    }
