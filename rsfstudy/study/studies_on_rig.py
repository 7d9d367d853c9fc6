"""Named studies on a rig of the user."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rsfstudy.rig import Rig, put_on_rig
from rsfstudy.study.study import Study


def convert_study_to_rig_units(study: Study, rig: Rig) -> Study:
    """A study of no rig on a rig: what its axes and the ranges of its fits hold without dimension
    is turned into units of the rig, as it is shown, and what it states takes the place of theirs.
    """
    base, axes, every = put_on_rig(rig, study.base, study.axes)
    reductions = [
        _convert_reduction_range(each, every.get(getattr(each, "on", "")))
        for each in study.reductions
    ]
    return replace(study, rig=rig, base=base, axes=axes, reductions=reductions)


def _convert_reduction_range(reduction: Any, scale: float | None) -> Any:
    """A reduction whose range, if it has any, is in units."""
    span = getattr(reduction, "within", None)
    if scale is None or span is None:
        return reduction
    return replace(reduction, within=tuple(scale * end for end in span))
