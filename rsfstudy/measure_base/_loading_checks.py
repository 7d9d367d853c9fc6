"""Checks of the loading of a scene."""

from __future__ import annotations

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import Scene


def check_loading_has_no_noise(scene: Scene) -> None:
    """Check that the loading of a scene has no noise.

    Parameters
    ----------
    scene : Scene
        Scene to check.

    Raises
    ------
    InvalidValue
        If the scene has noise.
    """
    noise = scene.parts.loading_noise
    if noise.is_active:
        rule = "changes stress at random, so that no motion settles or repeats"
        remedy = "Set loading_noise='none', or use EventStatistics or simulate."
        raise InvalidValue("loading_noise", noise.name, rule, remedy=remedy)


def check_loading_changes_stress_only_in_steps(scene: Scene) -> None:
    """Check that the loading changes stress only in sudden steps.

    A motion cannot settle or repeat if the loading changes stress continuously.

    Parameters
    ----------
    scene : Scene
        Scene to check.

    Raises
    ------
    InvalidValue
        If the load point velocity or the normal stress changes continuously, or if the scene has
        noise.
    """
    check_loading_has_no_noise(scene)
    loading = scene.parts.loading
    if loading.unknowns:
        what = (
            "load point velocity"
            if loading.adds_load_point_displacement_unknown
            else "normal stress"
        )
        rule = (
            f"cannot be used here, because it changes the {what} continuously, so the motion does "
            "not reach a steady state or a limit cycle"
        )
        remedy = "To compute the motion, use rsfstudy.simulate."
        if "oscillation" in loading.name:
            remedy += " For an example, run `rsfstudy show resonance`."
        raise InvalidValue("loading", loading.name, rule, remedy=remedy)
