"""Verdicts on claims, as a terminal and a notebook show them."""

from __future__ import annotations

import textwrap
from typing import Any

import pandas as pd

from rsfstudy.errors import spelt
from rsfstudy.quantity import table

_SIGNS = {"equals": "", "below": "< ", "above": "> "}
#: Of a line of a terminal, and of an identifier on it, in characters.
_WIDTH, _ID = 100, 12
#: What a printed line tells of a claim.
_PRINTED = ("id", "claim", "relation", "published", "ours", "tolerance", "verdict", "moved")


def published(claim: dict[Any, Any]) -> str:
    """The published value of a claim, with the sign of a bound."""
    return f"{_SIGNS[claim['relation']]}{claim['published']:.6g}"


def _headed(claim: dict[Any, Any]) -> dict[str, str]:
    """A claim as a terminal has room for it, by the headings."""
    return {
        "id": textwrap.shorten(str(claim["id"]), _ID, placeholder="..."),
        "claim": " ".join(str(claim["claim"]).split()),
        "published": published(claim),
        "ours": f"{claim['ours']:.6g}",
        "tolerance": f"{claim['tolerance']:.3g}",
        "verdict": f"{claim['verdict']}{', moved' * bool(claim['moved'])}",
    }


def _aligned(rows: list[dict[str, str]]) -> str:
    """Columns side by side under their headings; claims take the room that the others leave."""
    table = [{name: name for name in rows[0]}, *rows]
    wide = {name: max(len(row[name]) for row in table) for name in rows[0]}
    others = sum(width + 2 for name, width in wide.items() if name != "claim")
    wide["claim"] = min(wide["claim"], _WIDTH - others)
    for row in table:
        row["claim"] = textwrap.shorten(row["claim"], wide["claim"], placeholder=" ...")
    lines = ("  ".join(f"{row[name]:{width}}" for name, width in wide.items()) for row in table)
    return "\n".join(line.rstrip() for line in lines)


class Verdicts(pd.DataFrame):
    """A table of claims, one row each; what is taken from it is a plain table."""

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def __repr__(self) -> str:
        if self.empty or not set(_PRINTED) <= set(self):
            return super().__repr__()
        return spelt(_aligned([_headed(row) for row in self.to_dict("records")]))

    def _repr_html_(self) -> str:
        rows = [told(row) for row in self.to_dict("records")]
        return (
            table(list(rows[0]), [list(row.values()) for row in rows])
            if rows
            else "<p>no claims</p>"
        )


def told(claim: dict[Any, Any]) -> dict[str, str]:
    """A claim in words, by headings; where there are several studies, with the name of its own."""
    reason = f"{claim['tolerance']:.3g}: {claim['reason']}"
    if claim["because"]:
        reason += f". It differs because {claim['because']}"
    of = f"{claim['study']}: " if "study" in claim else ""
    return {
        "id": str(claim["id"]),
        "claim": f"{of}{claim['claim']}",
        "published": published(claim),
        "ours": "-" if pd.isna(claim["ours"]) else f"{claim['ours']:.6g}",
        "tolerance, and why": reason,
        "verdict": claim["verdict"] + f", expected {claim['expected']}" * bool(claim["moved"]),
    }
