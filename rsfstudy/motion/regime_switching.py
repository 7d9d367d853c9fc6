"""Criteria that determine when a motion changes its regime and when it ends.

If the scene has inertia, a motion alternates between two regimes: the slow manifold, and the
inertial equations of motion. The slow manifold approximates the effect of inertia by a series in
the inertia weight :math:`(K/a) w^2`, where :math:`w` is the dimensionless slip rate norm. The event
loop integrates the inertial equations of motion in ruptures. The function
``can_start_on_slow_manifold`` chooses the regime at the beginning of a motion or loading segment. A
rupture begins if ``compute_inertia_effect_over_limit`` reaches 1, and ends if
``should_switch_back_to_slow_manifold`` returns True. Most criteria are functions of floats, so all
engines can call them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.slider import (
    MotionPoint,
    Scene,
    cached_per_scene,
)
from rsfstudy.status import Status

#: Limits of the normal stress, in sigma_*. The fault is open below the first limit and locked above
#: the second limit.
MIN_NORMAL_STRESS, MAX_NORMAL_STRESS = 1e-9, 1e6
#: Lower bound that is applied to the normal stress, in sigma_*, before its logarithm is computed.
NORMAL_STRESS_FLOOR_FOR_LOGARITHM = 1e-300
#: Upper limit of ln(V/V_*) without inertia. The slip rate is unbounded above 10^120 V_*.
MAX_LOG_SLIP_RATE_WITHOUT_INERTIA = 120.0 * math.log(10.0)
#: Limits of ln(V/V_*). They are constants of this module because compiled functions read them.
LOG_SLIP_RATE_UPPER_LIMIT = Scene.LOG_SLIP_RATE_UPPER_LIMIT
LOG_SLIP_RATE_OF_STOPPED_SLIP = Scene.LOG_SLIP_RATE_OF_STOPPED_SLIP
#: Codes for the termination status of a motion.
CONTINUES, NORMAL_STRESS_VANISHED, NORMAL_STRESS_UNBOUNDED, SLIP_STOPPED, SLIP_RATE_UNBOUNDED = (
    range(5)
)


class RegimeSwitchThresholds(NamedTuple):
    r"""Thresholds at which a motion switches between the slow manifold and inertial equations.

    Parameters
    ----------
    max_slip_rate_norm : float
        Maximum slip rate norm :math:`w` on the slow manifold.
    max_log_slip_rate_change_by_inertia : float
        Maximum change in ln V due to inertia on the slow manifold.
    max_slip_in_return_to_slow_manifold : float
        Maximum slip during a transition to the slow manifold, in D_c.
    stiffness_over_a : float
        Ratio :math:`K/a`.
    a : float
        Coefficient :math:`a` of the direct effect.
    inertial_time : float
        Inertial time :math:`T/(2 \pi)`, in D_c/V_*.
    """

    max_slip_rate_norm: float
    max_log_slip_rate_change_by_inertia: float
    max_slip_in_return_to_slow_manifold: float
    stiffness_over_a: float
    a: float
    inertial_time: float


#: Thresholds of a motion without inertia. The event loop does not use the values of these
#: thresholds.
SWITCH_THRESHOLDS_WITHOUT_INERTIA = RegimeSwitchThresholds(
    *[math.nan] * len(RegimeSwitchThresholds._fields)
)


@cached_per_scene
def compute_regime_switch_thresholds(scene: Scene, accuracy: Accuracy) -> RegimeSwitchThresholds:
    """Compute the thresholds of a scene for a requested accuracy.

    Parameters
    ----------
    scene : Scene
        Scene with or without inertia.
    accuracy : Accuracy
        Requested accuracy.

    Returns
    -------
    RegimeSwitchThresholds
        Thresholds. All values are NaN if the scene has no inertia.
    """
    if not scene.has_mass:
        return SWITCH_THRESHOLDS_WITHOUT_INERTIA
    softness = scene.stiffness / scene.a
    return RegimeSwitchThresholds(
        math.sqrt(accuracy.max_inertia_weight_on_slow_manifold / softness),
        accuracy.max_log_slip_rate_change_by_inertia,
        accuracy.max_slip_in_return_to_slow_manifold,
        softness,
        scene.a,
        scene.inertial_time,
    )


def compute_slip_rate_norm(
    log_slip_rate: float, switch_thresholds: RegimeSwitchThresholds
) -> float:
    r"""Compute the dimensionless slip rate norm.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    switch_thresholds : RegimeSwitchThresholds
        Thresholds, which include the inertial time.

    Returns
    -------
    float
        Slip rate norm :math:`w = V T/(2 \pi D_c)`.
    """
    return switch_thresholds.inertial_time * math.exp(min(log_slip_rate, LOG_SLIP_RATE_UPPER_LIMIT))


def compute_inertia_effect_over_limit(
    log_slip_rate: float, inertial_stress: float, switch_thresholds: RegimeSwitchThresholds
) -> float:
    r"""Compute the ratio of the inertia effect to its limit on the slow manifold.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    inertial_stress : float
        Difference between spring stress and friction, in sigma_*.
    switch_thresholds : RegimeSwitchThresholds
        Thresholds of the scene.

    Returns
    -------
    float
        Larger of two ratios: the slip rate norm divided by its threshold, and the change in ln V
        due to inertia divided by its threshold. The motion must leave the slow manifold if the
        result is 1 or larger.
    """
    correction = (
        abs(inertial_stress)
        / switch_thresholds.a
        / switch_thresholds.max_log_slip_rate_change_by_inertia
    )
    return max(
        compute_slip_rate_norm(log_slip_rate, switch_thresholds)
        / switch_thresholds.max_slip_rate_norm,
        correction,
    )


def is_inertia_significant_at(scene: Scene, accuracy: Accuracy, point: MotionPoint) -> bool:
    """Return True if the slow manifold is not accurate enough at a point.

    Parameters
    ----------
    scene : Scene
        Scene with or without inertia.
    accuracy : Accuracy
        Requested accuracy.
    point : MotionPoint
        Point of a motion.

    Returns
    -------
    bool
        True if the effect of inertia exceeds its limit on the slow manifold. The result is False if
        the scene has no inertia.
    """
    if not scene.has_mass:
        return False
    inertial_stress = point.spring_stress - point.frictional_stress
    given = compute_regime_switch_thresholds(scene, accuracy)
    return compute_inertia_effect_over_limit(point.log_slip_rate, inertial_stress, given) >= 1.0


def compute_slip_during_rate_change(
    initial_log_slip_rate: float,
    final_log_slip_rate: float,
    switch_thresholds: RegimeSwitchThresholds,
) -> float:
    r"""Compute the slip during a transition between two slip rates.

    If the transition is approximated by a jump in slip rate, the evolution of the states during
    this slip is neglected.

    Parameters
    ----------
    initial_log_slip_rate, final_log_slip_rate : float
        Natural logarithms :math:`\ln(V/V_*)` of both slip rates.
    switch_thresholds : RegimeSwitchThresholds
        Thresholds of the scene.

    Returns
    -------
    float
        Upper bound on the slip in D_c, multiplied by the change in ln V. The result is an upper
        bound because the formula uses the larger of the two slip rate norms.

    Notes
    -----
    The upper bound on the slip is :math:`(K/a) w^2` in D_c, where :math:`w` is the larger of the
    two slip rate norms.
    """
    norm = max(
        compute_slip_rate_norm(initial_log_slip_rate, switch_thresholds),
        compute_slip_rate_norm(final_log_slip_rate, switch_thresholds),
    )
    return (
        switch_thresholds.stiffness_over_a
        * norm**2
        * abs(final_log_slip_rate - initial_log_slip_rate)
    )


def can_start_on_slow_manifold(
    log_slip_rate: float,
    manifold_log_slip_rate: float,
    inertial_stress: float,
    switch_thresholds: RegimeSwitchThresholds,
) -> bool:
    r"""Return True if a motion can start on the slow manifold.

    Parameters
    ----------
    log_slip_rate : float
        Initial :math:`\ln(V/V_*)`.
    manifold_log_slip_rate : float
        Value of :math:`\ln(V/V_*)` on the slow manifold.
    inertial_stress : float
        Difference between spring stress and friction on the slow manifold, in sigma_*.
    switch_thresholds : RegimeSwitchThresholds
        Thresholds of the scene.

    Returns
    -------
    bool
        True if the effect of inertia at both slip rates is below its limit, and if the slip during
        the transition is below its threshold.
    """
    rate = (
        compute_slip_rate_norm(log_slip_rate, switch_thresholds)
        / switch_thresholds.max_slip_rate_norm
    )
    slow = (
        max(
            compute_inertia_effect_over_limit(
                manifold_log_slip_rate, inertial_stress, switch_thresholds
            ),
            rate,
        )
        < 1.0
    )
    return (
        slow
        and compute_slip_during_rate_change(
            log_slip_rate, manifold_log_slip_rate, switch_thresholds
        )
        <= switch_thresholds.max_slip_in_return_to_slow_manifold
    )


def is_slip_slow_enough_for_slow_manifold(
    log_slip_rate: float, switch_thresholds: RegimeSwitchThresholds
) -> bool:
    r"""Return True if the slip rate is small enough for the slow manifold.

    The limit of the slip rate is half of the slip rate at which the motion leaves the slow
    manifold. The factor of two prevents repeated changes between the regimes.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    switch_thresholds : RegimeSwitchThresholds
        Thresholds of the scene.

    Returns
    -------
    bool
        True if the slip rate norm is below half of its threshold.
    """
    return (
        compute_slip_rate_norm(log_slip_rate, switch_thresholds)
        < 0.5 * switch_thresholds.max_slip_rate_norm
    )


def should_switch_back_to_slow_manifold(
    log_slip_rate: float,
    log_slip_rate_growth: float,
    manifold_log_slip_rate: float,
    inertial_stress: float,
    switch_thresholds: RegimeSwitchThresholds,
) -> bool:
    r"""Return True if a motion in a rupture can return to the slow manifold.

    Parameters
    ----------
    log_slip_rate : float
        Value :math:`x = \ln(V/V_*)` from the inertial equations of motion.
    log_slip_rate_growth : float
        Derivative of ``log_slip_rate`` along the motion.
    manifold_log_slip_rate : float
        Value :math:`x_s = \ln(V/V_*)` on the slow manifold.
    inertial_stress : float
        Difference between spring stress and friction on the slow manifold, in sigma_*.
    switch_thresholds : RegimeSwitchThresholds
        Thresholds of the scene.

    Returns
    -------
    bool
        True if the remaining slip is below its threshold, the slip rate norm and the inertia effect
        are below half of their limits, and no extremum of the slip rate follows.

    Notes
    -----
    If the motion returns to the slow manifold, ln V changes from :math:`x` to :math:`x_s`. During
    this change the slider slips by about

    .. math:: \frac{K}{2a} w^2 \min(1, |x - x_s|)

    in D_c, where :math:`w` is the larger slip rate norm. If the motion returns to the slow manifold
    immediately, the states do not evolve over this slip during the change in ln V.

    The function also returns False shortly before an extremum of the slip rate. If the slip rate
    rises and friction exceeds spring stress, the slip rate on the slow manifold falls. The slip
    rate then reaches a maximum before it meets the slow manifold. The maximum occurs after a slip
    of several times :math:`(K/a) w^2` in D_c. If the slip rate falls and spring stress exceeds
    friction, the slip rate on the slow manifold rises. The slip rate then reaches a minimum, at
    which ln V exceeds the present :math:`x_s` by several times the inertial stress divided by
    :math:`a`.
    """
    norm = max(
        compute_slip_rate_norm(log_slip_rate, switch_thresholds),
        compute_slip_rate_norm(manifold_log_slip_rate, switch_thresholds),
    )
    has_peak = (
        inertial_stress < 0.0
        and switch_thresholds.stiffness_over_a * norm**2
        > switch_thresholds.max_slip_in_return_to_slow_manifold
    )
    has_trough = (
        inertial_stress
        > 0.1 * switch_thresholds.max_slip_in_return_to_slow_manifold * switch_thresholds.a
    )
    if (
        log_slip_rate_growth > 0.0 and (log_slip_rate > manifold_log_slip_rate + 1.0 or has_peak)
    ) or (log_slip_rate_growth < 0.0 and has_trough):
        return False
    remaining = (
        0.5
        * switch_thresholds.stiffness_over_a
        * norm**2
        * min(1.0, abs(log_slip_rate - manifold_log_slip_rate))
    )
    settled = (
        max(
            norm / switch_thresholds.max_slip_rate_norm,
            compute_inertia_effect_over_limit(
                manifold_log_slip_rate, inertial_stress, switch_thresholds
            ),
        )
        < 0.5
    )
    return settled and remaining < switch_thresholds.max_slip_in_return_to_slow_manifold


def find_termination_status(
    log_slip_rate: float, normal_stress: float, load_velocity: float
) -> int:
    r"""Find the termination status of a motion.

    The shear stress may change sign when a rupture overshoots. This change of sign does not
    terminate the motion, because the equations remain valid.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    normal_stress : float
        Normal stress in sigma_*.
    load_velocity : float
        Load point velocity in V_*. If the load point velocity is 0, the motion terminates when slip
        stops.

    Returns
    -------
    int
        ``CONTINUES``, ``NORMAL_STRESS_VANISHED``, ``NORMAL_STRESS_UNBOUNDED``, ``SLIP_STOPPED`` or
        ``SLIP_RATE_UNBOUNDED``.
    """
    if normal_stress <= MIN_NORMAL_STRESS:
        return NORMAL_STRESS_VANISHED
    if normal_stress >= MAX_NORMAL_STRESS:
        return NORMAL_STRESS_UNBOUNDED
    if log_slip_rate <= LOG_SLIP_RATE_OF_STOPPED_SLIP and load_velocity == 0.0:
        return SLIP_STOPPED
    if log_slip_rate >= MAX_LOG_SLIP_RATE_WITHOUT_INERTIA:
        return SLIP_RATE_UNBOUNDED
    return CONTINUES


def compute_margin_to_motion_termination(
    log_slip_rate: float, normal_stress: float, load_velocity: float
) -> float:
    r"""Compute how far a motion is from the nearest limit that terminates it.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    normal_stress : float
        Normal stress in sigma_*.
    load_velocity : float
        Load point velocity in V_*.

    Returns
    -------
    float
        Smallest of the differences between ln V and its limits, and between the logarithm of normal
        stress and its limits. The margin is positive if the motion continues.
    """
    stress = math.log(max(normal_stress, NORMAL_STRESS_FLOOR_FOR_LOGARITHM))
    left = min(
        stress - math.log(MIN_NORMAL_STRESS),
        math.log(MAX_NORMAL_STRESS) - stress,
        MAX_LOG_SLIP_RATE_WITHOUT_INERTIA - log_slip_rate,
    )
    return (
        min(left, log_slip_rate - LOG_SLIP_RATE_OF_STOPPED_SLIP) if load_velocity == 0.0 else left
    )


def build_termination_error(termination_status: int, normal_stress: float) -> MotionStopped:
    """Create the exception that reports the termination of a motion.

    Parameters
    ----------
    termination_status : int
        Termination status from ``find_termination_status``.
    normal_stress : float
        Normal stress at the termination, in sigma_*.

    Returns
    -------
    MotionStopped
        Exception with the status and the message.
    """
    if termination_status == NORMAL_STRESS_VANISHED:
        return MotionStopped(
            Status.NORMAL_STRESS_LOST, "the normal stress vanished during the motion"
        )
    if termination_status == NORMAL_STRESS_UNBOUNDED:
        text = f"the normal stress grew to {normal_stress:.3g} sigma_* and is still growing"
        return MotionStopped(Status.LOCKED, text)
    if termination_status == SLIP_STOPPED:
        return MotionStopped(Status.SLIP_STOPPED, "the slip rate fell below 10^-290 V_*")
    bound = (
        "To limit the slip rate, pass inertia=True (period= or mass= of a rig) or "
        "radiation_damping= (shear_modulus= of a rig)"
    )
    text = f"the slip rate exceeded 10^120 V_* without inertia. {bound}"
    return MotionStopped(Status.SLIP_RATE_UNBOUNDED, text)
