"""When to change between the slow manifold and the full equations, and where motions end.

Most are plain functions of floats, which every engine calls.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.slider import (
    LARGEST_LOG_SLIP_RATE,
    STOPPED_LOG_SLIP_RATE,
    MotionPoint,
    Scene,
    cached_per_scene,
)
from rsfstudy.status import Status

#: Normal stress over sigma_* at which the fault counts as open, and as locked.
MIN_NORMAL_STRESS, MAX_NORMAL_STRESS = 1e-9, 1e6
#: Normal stress that stands for none, in logarithms.
MIN_POSITIVE_NORMAL_STRESS = 1e-300
#: ln(V/V_*) beyond which slip without mass counts as unbounded: 10^120 V_*.
MAX_LOG_SLIP_RATE_WITHOUT_INERTIA = 120.0 * math.log(10.0)
#: How a motion goes on, or why it cannot.
CONTINUES, NORMAL_STRESS_VANISHED, NORMAL_STRESS_UNBOUNDED, SLIP_STOPPED, SLIP_RATE_UNBOUNDED = (
    range(5)
)


class SwitchThresholds(NamedTuple):
    """The numbers that decide when to change.

    Attributes
    ----------
    max_slip_rate_norm : float
        Slip rate norm w at which to leave the slow manifold, which is a series in (K/a) w**2.
    max_inertia_correction : float
        Change of ln V by inertia up to which the slow manifold may be used.
    max_remaining_slip : float
        Slip in D_c that may remain when the full equations hand back.
    stiffness_over_a : float
        K/a.
    a : float
        Direct effect.
    inertial_time : float
        T V_*/(2 pi D_c).
    """

    max_slip_rate_norm: float
    max_inertia_correction: float
    max_remaining_slip: float
    stiffness_over_a: float
    a: float
    inertial_time: float


#: The limits of a motion without mass, which reads none.
NO_SWITCH_THRESHOLDS = SwitchThresholds(*[math.nan] * len(SwitchThresholds._fields))


@cached_per_scene
def compute_switch_thresholds(scene: Scene, accuracy: Accuracy) -> SwitchThresholds:
    """The limits of a scene at an accuracy."""
    if not scene.has_mass:
        return NO_SWITCH_THRESHOLDS
    softness = scene.stiffness / scene.a
    return SwitchThresholds(
        math.sqrt(accuracy.max_inertia_weight / softness),
        accuracy.max_inertia_correction,
        accuracy.max_remaining_slip,
        softness,
        scene.a,
        scene.inertial_time,
    )


def compute_slip_rate_norm(log_slip_rate: float, switch_thresholds: SwitchThresholds) -> float:
    """w = V T/(2 pi D_c)."""
    return switch_thresholds.inertial_time * math.exp(min(log_slip_rate, LARGEST_LOG_SLIP_RATE))


def compute_inertia_weight_at_mismatch(
    log_slip_rate: float, inertial_stress: float, switch_thresholds: SwitchThresholds
) -> float:
    """Weight of mass where friction differs from spring stress by `inertial_stress`: 1 where
    the slow manifold has to be left.
    """
    correction = (
        abs(inertial_stress) / switch_thresholds.a / switch_thresholds.max_inertia_correction
    )
    return max(
        compute_slip_rate_norm(log_slip_rate, switch_thresholds)
        / switch_thresholds.max_slip_rate_norm,
        correction,
    )


def inertia_matters_at(scene: Scene, accuracy: Accuracy, point: MotionPoint) -> bool:
    """Return True if the effect of inertia at a point exceeds that on the slow manifold."""
    if not scene.has_mass:
        return False
    inertial_stress = point.spring_stress - point.frictional_stress
    given = compute_switch_thresholds(scene, accuracy)
    return compute_inertia_weight_at_mismatch(point.log_slip_rate, inertial_stress, given) >= 1.0


def slip_during_transition(
    initial_log_slip_rate: float, final_log_slip_rate: float, switch_thresholds: SwitchThresholds
) -> float:
    """Slip in D_c, times the change of ln V, while slip rate goes to its value
    `log_slip_rate_after` a step; left out, the state would miss the evolution of that slip.
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


def starts_on_slow_manifold(
    log_slip_rate: float,
    manifold_log_slip_rate: float,
    inertial_stress: float,
    switch_thresholds: SwitchThresholds,
) -> bool:
    """True if a motion begins on the slow manifold, from ln(V/V_*), where that has ln(V/V_*)
    `manifold_log_slip_rate`, and friction differs from spring stress by `inertial_stress` there.
    """
    rate = (
        compute_slip_rate_norm(log_slip_rate, switch_thresholds)
        / switch_thresholds.max_slip_rate_norm
    )
    slow = (
        max(
            compute_inertia_weight_at_mismatch(
                manifold_log_slip_rate, inertial_stress, switch_thresholds
            ),
            rate,
        )
        < 1.0
    )
    return (
        slow
        and slip_during_transition(log_slip_rate, manifold_log_slip_rate, switch_thresholds)
        <= switch_thresholds.max_remaining_slip
    )


def may_switch_back_to_slow_manifold(
    log_slip_rate: float, switch_thresholds: SwitchThresholds
) -> bool:
    """True if ln(V/V_*) alone lets the full equations hand back: the slow manifold must not hand
    straight back in its turn.
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
    switch_thresholds: SwitchThresholds,
) -> bool:
    """True if the full equations have done their work at ln(V/V_*) and its growth, where the slow
    manifold has ln(V/V_*) `manifold_log_slip_rate`, and friction differs from spring stress by
    `inertial_stress`.

    The slip rate still has to go from ln V = x to the slow manifold's x_s, over a slip of about
    (K/2a) w**2 min(1, |x - x_s|) D_c at the faster of the two; the state may change that much
    unnoticed; and see `may_switch_back`.

    A rise to a slow manifold that falls, where friction exceeds spring stress, has its peak below
    that: they meet after a slip of several (K/a) w**2 D_c. It is followed up to there. So is a
    fall to one that rises: its trough is above where that is now, by several times the change of
    ln V by which that trails, which is what is missing over a.
    """
    norm = max(
        compute_slip_rate_norm(log_slip_rate, switch_thresholds),
        compute_slip_rate_norm(manifold_log_slip_rate, switch_thresholds),
    )
    has_peak = (
        inertial_stress < 0.0
        and switch_thresholds.stiffness_over_a * norm**2 > switch_thresholds.max_remaining_slip
    )
    has_trough = inertial_stress > 0.1 * switch_thresholds.max_remaining_slip * switch_thresholds.a
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
            compute_inertia_weight_at_mismatch(
                manifold_log_slip_rate, inertial_stress, switch_thresholds
            ),
        )
        < 0.5
    )
    return settled and remaining < switch_thresholds.max_remaining_slip


def find_termination_status(
    log_slip_rate: float, normal_stress: float, load_velocity: float
) -> int:
    """Termination status of a motion: `CONTINUES`, unless normal stress vanishes, normal stress or
    slip rate grow without bound, or slip stops.

    Shear stress may reverse in the overshoot of a rupture; the equations go through that unharmed.
    """
    if normal_stress <= MIN_NORMAL_STRESS:
        return NORMAL_STRESS_VANISHED
    if normal_stress >= MAX_NORMAL_STRESS:
        return NORMAL_STRESS_UNBOUNDED
    if log_slip_rate <= STOPPED_LOG_SLIP_RATE and load_velocity == 0.0:
        return SLIP_STOPPED
    if log_slip_rate >= MAX_LOG_SLIP_RATE_WITHOUT_INERTIA:
        return SLIP_RATE_UNBOUNDED
    return CONTINUES


def margin_to_termination(
    log_slip_rate: float, normal_stress: float, load_velocity: float
) -> float:
    """Margin of ln V and of the logarithm of normal stress to where a motion ends: positive where
    it goes on.
    """
    stress = math.log(max(normal_stress, MIN_POSITIVE_NORMAL_STRESS))
    left = min(
        stress - math.log(MIN_NORMAL_STRESS),
        math.log(MAX_NORMAL_STRESS) - stress,
        MAX_LOG_SLIP_RATE_WITHOUT_INERTIA - log_slip_rate,
    )
    return min(left, log_slip_rate - STOPPED_LOG_SLIP_RATE) if load_velocity == 0.0 else left


def termination_error(termination_status: int, normal_stress: float) -> MotionStopped:
    """The end of a motion, by its termination status (see `find_termination`)."""
    if termination_status == NORMAL_STRESS_VANISHED:
        return MotionStopped(Status.NORMAL_STRESS_LOST, "normal stress vanished during the motion")
    if termination_status == NORMAL_STRESS_UNBOUNDED:
        text = f"normal stress grew to {normal_stress:.3g} sigma_* and goes on"
        return MotionStopped(Status.LOCKED, text)
    if termination_status == SLIP_STOPPED:
        return MotionStopped(Status.SLIP_STOPPED, "the slip rate fell below 10^-290 V_*")
    bound = "inertia=True (a rig's period=, mass=) or radiation_damping= (shear_modulus=) bounds it"
    text = f"slip rate grew beyond 10^120 V_* without mass: {bound}"
    return MotionStopped(Status.SLIP_RATE_UNBOUNDED, text)
