"""Named studies on a rig of the user."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rsfstudy.rig import Rig, axes_on_rig, derive_scene_fields
from rsfstudy.study.study import Study


def with_rig(study: Study, rig: Rig) -> Study:
    """A study of no rig on a rig: what its axes and the ranges of its fits hold without dimension
    is turned into units of the rig, as it is shown, and what it states takes the place of theirs.
    """
    axes, every = axes_on_rig(rig, study.axes)
    reductions = [
        _scale_range(each, every.get(getattr(each, "on", ""))) for each in study.reductions
    ]
    changes = derive_scene_fields(rig.as_dict())
    if {"inertia", "radiation_damping"} & set(changes):  # in place of what the study has
        changes = {"inertia": False, "radiation_damping": 0.0, **changes}
    base = study.base.with_(**changes)
    return replace(study, rig=rig, base=base, axes=axes, reductions=reductions)


def _scale_range(reduction: Any, scale: float | None) -> Any:
    """A reduction whose range, if it has any, is in units."""
    span = getattr(reduction, "within", None)
    if scale is None or span is None:
        return reduction
    return replace(reduction, within=tuple(scale * end for end in span))
