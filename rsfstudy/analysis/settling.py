"""Decision whether a motion that comes close to steady sliding settles there."""

from __future__ import annotations

import math

from rsfstudy.motion.meter import Halt
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.stability import largest_growth_rate
from rsfstudy.status import Status


def is_attracted(scene: Scene) -> bool:
    """Return True if steady sliding at the load point velocity attracts motions close to it.

    Parameters
    ----------
    scene : Scene
        A scene whose load point moves.

    Raises
    ------
    Halt
        With `unverified` if the largest growth rate of small changes is zero within its error, and
        with `no_steady_state` if there is no steady sliding.
    """
    growth = largest_growth_rate(scene.acting(-1), scene.log_load_rate)
    if growth is None:
        text = f"no steady state exists at V_0/V_* = {scene.load_velocity:.3g}"
        raise Halt(Status.NO_STEADY_STATE, text)
    if growth.is_undecided:
        raise Halt(
            Status.UNVERIFIED,
            "the motion comes close to steady sliding, but it is undecided if it settles: the "
            f"growth rate of small changes is {growth.value:.1e} per D_c of slip, with an error of "
            f"{growth.error:.1e}. Change stiffness= by more than that.",
        )
    return growth.value < 0.0


def settled_flag(scene: Scene, *, is_flat: bool) -> float:
    """Return the flag of a record that has settled if it ends flat.

    Parameters
    ----------
    scene : Scene
        A scene under the segment of loading at the end of the record.
    is_flat : bool
        Whether friction hardly changes at the end of the record.

    Returns
    -------
    float
        1 if the record ends flat, and 0 if not or if small changes of steady sliding grow; NaN if
        their growth rate is zero within its error.
    """
    if not is_flat:
        return 0.0
    growth = largest_growth_rate(scene, scene.log_load_rate)
    if growth is not None and growth.is_undecided:
        return math.nan
    return 0.0 if growth is not None and growth.is_positive else 1.0
