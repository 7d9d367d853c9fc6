"""Function that tests whether steady sliding at the end of a motion is stable."""

from __future__ import annotations

from rsfstudy.motion import MotionStopped
from rsfstudy.slider import Scene
from rsfstudy.status import Status


def is_steady_sliding_linearly_stable(scene: Scene) -> bool:
    """Return True if steady sliding at the load point velocity is stable.

    Parameters
    ----------
    scene : Scene
        Scene with a moving load point.

    Returns
    -------
    bool
        True if the largest growth rate of small perturbations is negative.

    Raises
    ------
    MotionStopped
        With the status ``no_steady_state`` if steady sliding does not exist, and with the status
        ``unverified`` if the largest growth rate is zero within its error.
    """
    growth = scene.segment_scene(-1).compute_largest_linear_growth_rate(scene.log_load_velocity)
    if growth is None:
        text = f"no steady state exists at V_0/V_* = {scene.load_velocity:.3g}"
        raise MotionStopped(Status.NO_STEADY_STATE, text)
    if growth.is_zero_within_error:
        raise MotionStopped(
            Status.UNVERIFIED,
            "the motion approaches steady sliding, but it is undecided whether it settles, "
            f"because the growth rate of small perturbations is {growth.real_part:.1e} per D_c of "
            f"slip with an error of {growth.error_estimate:.1e}. Use a slightly "
            "different stiffness=.",
        )
    return growth.real_part < 0.0
