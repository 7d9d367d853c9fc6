"""Checks of scenes: of what settles or repeats."""

from __future__ import annotations

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import Scene


def check_steady_loading(scene: Scene) -> None:
    """Refuse a loading that changes stress other than at once: nothing settles or repeats by
    itself under it.
    """
    loading = scene.parts.loading
    if loading.unknowns:
        what = "load point velocity" if loading.has_load_point_unknown else "normal stress"
        rule = f"changes {what} all along, so that no motion settles or repeats by itself"
        remedy = "Read its motion by simulate; that of an oscillation as the study resonance does."
        raise InvalidValue("loading", loading.name, rule, remedy=remedy)
