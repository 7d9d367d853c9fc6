"""Verdicts on claims, as a terminal and a notebook show them."""

from __future__ import annotations

import textwrap
from typing import Any

import pandas as pd

from rsfstudy.errors import escape_control_characters
from rsfstudy.quantities import html_table

_SIGNS_OF_CLAIM_RELATIONS = {"equals": "", "below": "< ", "above": "> "}
#: Of a line of a terminal, and of an identifier on it, in characters.
_TERMINAL_LINE_WIDTH, _CLAIM_ID_WIDTH = 100, 12
#: What a printed line tells of a claim.
_COLUMNS_PRINTED_ON_TERMINAL = (
    "id",
    "claim",
    "relation",
    "published",
    "ours",
    "tolerance",
    "verdict",
    "moved",
)


def format_published_value(verdict_row: dict[Any, Any]) -> str:
    """The published value of a claim, with the sign of a bound."""
    return f"{_SIGNS_OF_CLAIM_RELATIONS[verdict_row['relation']]}{verdict_row['published']:.6g}"


def _format_row_for_terminal(verdict_row: dict[Any, Any]) -> dict[str, str]:
    """A claim as a terminal has room for it, by the headings."""
    return {
        "id": textwrap.shorten(str(verdict_row["id"]), _CLAIM_ID_WIDTH, placeholder="..."),
        "claim": " ".join(str(verdict_row["claim"]).split()),
        "published": format_published_value(verdict_row),
        "ours": f"{verdict_row['ours']:.6g}",
        "tolerance": f"{verdict_row['tolerance']:.3g}",
        "verdict": f"{verdict_row['verdict']}{', moved' * bool(verdict_row['moved'])}",
    }


def _align_columns(rows: list[dict[str, str]]) -> str:
    """Columns side by side under their headings; claims take the room that the others leave."""
    table = [{name: name for name in rows[0]}, *rows]
    wide = {name: max(len(row[name]) for row in table) for name in rows[0]}
    others = sum(width + 2 for name, width in wide.items() if name != "claim")
    wide["claim"] = min(wide["claim"], _TERMINAL_LINE_WIDTH - others)
    for row in table:
        row["claim"] = textwrap.shorten(row["claim"], wide["claim"], placeholder=" ...")
    lines = ("  ".join(f"{row[name]:{width}}" for name, width in wide.items()) for row in table)
    return "\n".join(line.rstrip() for line in lines)


class VerdictTable(pd.DataFrame):
    """A table of claims, one row each; what is taken from it is a plain table."""

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def __repr__(self) -> str:
        if self.empty or not set(_COLUMNS_PRINTED_ON_TERMINAL) <= set(self):
            return super().__repr__()
        return escape_control_characters(
            _align_columns([_format_row_for_terminal(row) for row in self.to_dict("records")])
        )

    def _repr_html_(self) -> str:
        rows = [format_verdict_row(row) for row in self.to_dict("records")]
        return (
            html_table(list(rows[0]), [list(row.values()) for row in rows])
            if rows
            else "<p>no claims</p>"
        )


def format_verdict_row(verdict_row: dict[Any, Any]) -> dict[str, str]:
    """A claim in words, by headings; where there are several studies, with the name of its own."""
    reason = f"{verdict_row['tolerance']:.3g}: {verdict_row['reason']}"
    if verdict_row["because"]:
        reason += f". It differs because {verdict_row['because']}"
    of = f"{verdict_row['study']}: " if "study" in verdict_row else ""
    return {
        "id": str(verdict_row["id"]),
        "claim": f"{of}{verdict_row['claim']}",
        "published": format_published_value(verdict_row),
        "ours": "-" if pd.isna(verdict_row["ours"]) else f"{verdict_row['ours']:.6g}",
        "tolerance, and why": reason,
        "verdict": verdict_row["verdict"]
        + f", expected {verdict_row['expected']}" * bool(verdict_row["moved"]),
    }
