"""How a study, and the verdicts on its claims, show themselves in a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pandas as pd

from rsfstudy.declare.wording import listed
from rsfstudy.markup import Markup, folded, symbol, table, unit
from rsfstudy.slider.shown import HEADINGS, described, fields_table
from rsfstudy.vocabulary import quantity

if TYPE_CHECKING:
    from rsfstudy.declare.axis import Axis
    from rsfstudy.declare.study import Study

_SIGNS = {"equals": "", "below": "< ", "above": "> "}


def study_html(study: Study) -> str:
    """The axes of a study and what it measures; what all cells share is folded away."""
    varied = {name for axis in study.axes for name in axis.fields}
    fixed = {name: v for name, v in study.base.as_dict().items() if name not in varied}
    known = study.quantities
    axes = [described(quantity(a.dimension, known), _along(a)) for a in study.axes]
    measured = [quantity(name, known) for name in study.measure.variables]
    numbers = [(q.name, symbol(q.symbol), unit(q), q.long_name) for q in measured]
    cells = f"{study.name}: {study.title} ({study.size:,} cells)"
    return (
        table(HEADINGS, axes, cells)
        + folded("what all cells share", fields_table(study.base, fixed))
        + folded(
            f"what {study.measure.name} gives in each",
            table([heading for heading in HEADINGS if heading != "value"], numbers),
        )
    )


def _along(axis: Axis) -> str:
    """The points of an axis, a long list cut short."""
    points: list[Any] = list(axis.labels or (row[axis.dimension] for row in axis.rows))
    return f"{listed(points, ', ')} ({len(axis)})"


class Verdicts(pd.DataFrame):
    """A table of claims, one row each; what is taken from it is a plain table."""

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def _repr_html_(self) -> str:
        rows = [self._row(row) for row in self.to_dict("records")]
        headings = ("claim", "", "published", "ours", "tolerance", "verdict")
        return table(headings, rows)

    @staticmethod
    def _row(claim: dict[Any, Any]) -> tuple[object, ...]:
        published = f"{_SIGNS[claim['relation']]}{claim['published']:.6g}"
        tolerance = f"{claim['tolerance']:.3g}: {claim['reason']}"
        verdict = claim["verdict"]
        if claim["moved"]:
            verdict = Markup(f"<b>{verdict}</b>, and was expected to be: {claim['expected']}")
        elif claim["because"]:
            verdict += f", because {claim['because']}"
        return claim["id"], claim["claim"], published, claim["ours"], tolerance, verdict
