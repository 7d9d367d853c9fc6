"""Verdicts on claims, as a terminal and a notebook show them."""

from __future__ import annotations

import textwrap
from typing import Any

import pandas as pd

from rsfstudy.errors import escape_control
from rsfstudy.quantities import html_table

_RELATION_SIGNS = {"equals": "", "below": "< ", "above": "> "}
#: Of a line of a terminal, and of an identifier on it, in characters.
_LINE_WIDTH, _ID_WIDTH = 100, 12
#: What a printed line tells of a claim.
_PRINTED_COLUMNS = ("id", "claim", "relation", "published", "ours", "tolerance", "verdict", "moved")


def format_published_value(claim: dict[Any, Any]) -> str:
    """The published value of a claim, with the sign of a bound."""
    return f"{_RELATION_SIGNS[claim['relation']]}{claim['published']:.6g}"


def _terminal_row(claim: dict[Any, Any]) -> dict[str, str]:
    """A claim as a terminal has room for it, by the headings."""
    return {
        "id": textwrap.shorten(str(claim["id"]), _ID_WIDTH, placeholder="..."),
        "claim": " ".join(str(claim["claim"]).split()),
        "published": format_published_value(claim),
        "ours": f"{claim['ours']:.6g}",
        "tolerance": f"{claim['tolerance']:.3g}",
        "verdict": f"{claim['verdict']}{', moved' * bool(claim['moved'])}",
    }


def _align_columns(rows: list[dict[str, str]]) -> str:
    """Columns side by side under their headings; claims take the room that the others leave."""
    table = [{name: name for name in rows[0]}, *rows]
    wide = {name: max(len(row[name]) for row in table) for name in rows[0]}
    others = sum(width + 2 for name, width in wide.items() if name != "claim")
    wide["claim"] = min(wide["claim"], _LINE_WIDTH - others)
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
        if self.empty or not set(_PRINTED_COLUMNS) <= set(self):
            return super().__repr__()
        return escape_control(
            _align_columns([_terminal_row(row) for row in self.to_dict("records")])
        )

    def _repr_html_(self) -> str:
        rows = [format_claim_row(row) for row in self.to_dict("records")]
        return (
            html_table(list(rows[0]), [list(row.values()) for row in rows])
            if rows
            else "<p>no claims</p>"
        )


def format_claim_row(claim: dict[Any, Any]) -> dict[str, str]:
    """A claim in words, by headings; where there are several studies, with the name of its own."""
    reason = f"{claim['tolerance']:.3g}: {claim['reason']}"
    if claim["because"]:
        reason += f". It differs because {claim['because']}"
    of = f"{claim['study']}: " if "study" in claim else ""
    return {
        "id": str(claim["id"]),
        "claim": f"{of}{claim['claim']}",
        "published": format_published_value(claim),
        "ours": "-" if pd.isna(claim["ours"]) else f"{claim['ours']:.6g}",
        "tolerance, and why": reason,
        "verdict": claim["verdict"] + f", expected {claim['expected']}" * bool(claim["moved"]),
    }
