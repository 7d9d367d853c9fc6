"""Checks of scenes: of one step, after which a motion decides, and of what settles or repeats."""

from __future__ import annotations

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.scene import Scene


def check_single_step(scene: Scene) -> None:
    """Refuse a loading of several segments, and one that changes normal stress all along."""
    check_leaves_alone(scene)
    loading = scene.parts.loading
    if len(loading.segments) > 1:
        rule = "is no single step, after which a motion decides"
        remedy = "Read its peaks by step_response, or by simulate."
        raise InvalidValue("loading", loading.name, rule, remedy=remedy)


def check_leaves_alone(scene: Scene) -> None:
    """Refuse a loading that changes stress other than at once: nothing settles or repeats by
    itself under it.
    """
    loading = scene.parts.loading
    if loading.unknowns:
        what = "load point velocity" if loading.displaces else "normal stress"
        rule = f"changes {what} all along, so that no motion settles or repeats by itself"
        remedy = "Read its motion by simulate; that of an oscillation as the study resonance does."
        raise InvalidValue("loading", loading.name, rule, remedy=remedy)
