"""A study as a notebook shows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from rsfstudy.axes.axis import Axis
from rsfstudy.quantity import (
    HEADINGS,
    Quantity,
    described,
    folded,
    quantities_table,
    symbol,
    table,
    unit,
)
from rsfstudy.slider import registry
from rsfstudy.vocabulary import quantity
from rsfstudy.wording import listed

if TYPE_CHECKING:
    from rsfstudy.declare.study import Study


def study_html(study: Study) -> str:
    """The axes of a study and what it measures; what all cells share is folded away."""
    base, measure, known = study.base, study.measure, study.quantities
    varied = {name for axis in study.axes for name in axis.fields}
    fixed = {name: v for name, v in base.as_dict().items() if name not in varied}
    shared = registry.shown(fixed, base.own_parts)
    along = [described(_about(a, known), _along(a)) for a in study.axes]
    measured = [quantity(name, known) for name in measure.variables]
    numbers = [(q.name, symbol(q.symbol), unit(q), q.long_name) for q in measured]
    return (
        table(HEADINGS, along, f"{study.name}: {study.title} ({study.size:,} cells)")
        + folded("what all cells share", quantities_table(shared))
        + folded(
            f"what {measure.name} gives in each",
            table([heading for heading in HEADINGS if heading != "value"], numbers),
        )
    )


def _about(axis: Axis, known: Mapping[str, Quantity]) -> Quantity:
    """The quantity along an axis, without symbol and scale where the axis is in units."""
    about, units = quantity(axis.dimension, known), axis.units.get(axis.dimension)
    return about if units is None else replace(about, symbol="", units=units, scale="")


def _along(axis: Axis) -> str:
    """The points of an axis, a long list cut short."""
    return f"{listed(axis.points, ', ')} ({len(axis)})"
