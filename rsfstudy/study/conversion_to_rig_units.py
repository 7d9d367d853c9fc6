"""Functions that convert dimensionless studies to rig units."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rsfstudy.rig import Rig, RigAxes
from rsfstudy.study.study import Study


def convert_study_to_rig_units(study: Study, rig: Rig) -> Study:
    """Convert a dimensionless study to a study in rig units.

    The axes and the fit ranges are converted to rig units. Fields defined by the rig replace the
    corresponding fields of the base scene.

    Parameters
    ----------
    study : Study
        Study without a rig.
    rig : Rig
        Rig that defines the units.

    Returns
    -------
    Study
        Study with the rig.
    """
    base, axes, every = RigAxes.convert_scene_and_axes_to_rig_units(rig, study.base, study.axes)
    reductions = [
        _convert_reduction_range_to_rig_units(each, every.get(getattr(each, "on", "")))
        for each in study.reductions
    ]
    return replace(study, rig=rig, base=base, axes=axes, reductions=reductions)


def _convert_reduction_range_to_rig_units(reduction: Any, coordinate_scale: float | None) -> Any:
    """Convert the coordinate range of a reduction to rig units.

    A reduction without a range is returned unchanged.
    """
    span = getattr(reduction, "within", None)
    if coordinate_scale is None or span is None:
        return reduction
    return replace(reduction, within=tuple(coordinate_scale * end for end in span))
