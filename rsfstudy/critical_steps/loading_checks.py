"""Functions that check the loading and the instability norm for critical step measures."""

from __future__ import annotations

import math

from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import Outcome, check_loading_changes_stress_only_in_steps
from rsfstudy.slider import Scene, SliderParameters
from rsfstudy.status import Status

#: Minimum ratio of the slip rate at the instability norm to the load point velocity. If the ratio
#: is lower, the slip rate may reach the instability norm without an instability.
_MIN_INSTABILITY_NORM_OVER_LOAD_VELOCITY = 1e3
#: Beginning of the warning that the instability norm is a slow slip rate.
SLOW_INSTABILITY_NORM_WARNING_PREFIX = "the instability norm "


def check_loading_is_single_step(scene: Scene) -> None:
    """Check that the loading is a single step.

    Parameters
    ----------
    scene : Scene
        Scene to check.

    Raises
    ------
    InvalidValue
        If the loading has several segments, or changes stress continuously.
    """
    check_loading_changes_stress_only_in_steps(scene)
    loading = scene.parts.loading
    if len(loading.segments) > 1:
        rule = "is not a single step, so the stability after the step is not defined"
        remedy = (
            "To find the peaks of the motion, use the step_response measure or rsfstudy.simulate."
        )
        raise InvalidValue("loading", loading.name, rule, remedy=remedy)


def build_norm_below_load_velocity_outcome(scene: Scene, load_velocity: float = 0.0) -> Outcome:
    """Return the outcome if the load point velocity exceeds the instability norm.

    Steady sliding before the step, or the load point after the step, may already be faster than the
    instability norm.

    Parameters
    ----------
    scene : Scene
        Scene with the instability norm.
    load_velocity : float, default: 0.0
        Load point velocity after the step, in units of V_*.

    Returns
    -------
    Outcome
        Outcome with the status ``norm_below_loading_rate`` and a remedy.
    """
    norm, least = scene.instability_norm, scene.inertial_time * max(1.0, abs(load_velocity))
    velocity = "V_0" if abs(load_velocity) > 1.0 else "V_*"
    return Outcome(
        Status.NORM_BELOW_LOADING_RATE,
        message=f"the load point velocity already exceeds the instability norm {norm:g}, because "
        f"{velocity} T/(2 pi D_c) is {least:.3g}. Pass a value of instability_norm= well above "
        f"{least:.3g}, or a value of period= (now {scene.period:g} s) well below "
        f"{scene.period * norm / least:.3g} s",
    )


def build_slow_instability_norm_warning(scene: Scene, load_velocity: float) -> str:
    """Return a warning if the instability norm is a slow slip rate.

    The instability norm is considered slow if the corresponding slip rate is less than a thousand
    times the load point velocity. A motion may reach such a slip rate without an instability. If
    the scene has the default reference rate, the function returns no warning. Such a scene is
    assumed to represent a published study rather than a laboratory apparatus.

    Parameters
    ----------
    scene : Scene
        Scene with the instability norm.
    load_velocity : float
        Load point velocity after the step, in units of V_*.

    Returns
    -------
    str
        The warning, or an empty string.
    """
    rate, load = math.exp(scene.log_slip_rate_at_instability), max(1.0, abs(load_velocity))
    if (
        rate >= _MIN_INSTABILITY_NORM_OVER_LOAD_VELOCITY * load
        or scene.reference_rate == SliderParameters.reference_rate
    ):
        return ""
    return (
        f"{SLOW_INSTABILITY_NORM_WARNING_PREFIX}{scene.instability_norm:g} corresponds to a slip "
        f"rate of {rate:.3g} V_*, which is only {rate / load:.3g} times the load point velocity. "
        "A motion that reaches this slip rate may be stable. Use a slip rate above "
        f"{_MIN_INSTABILITY_NORM_OVER_LOAD_VELOCITY * load:.3g} V_*. For a rig, pass "
        "the slip rate with "
        "units, for example rig.scene(instability_norm='10 mm/s')"
    )
