"""When to change between the slow manifold and the full equations, and where motions end.

Most are plain functions of floats, which every engine calls.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Halt
from rsfstudy.slider.derived import once
from rsfstudy.slider.places import LARGEST_LOG_SLIP_RATE
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.system import SLOWEST
from rsfstudy.status import Status

#: Normal stress over sigma_* at which the fault counts as open, and as locked.
LOST, LOCKED = 1e-9, 1e6
#: Normal stress that stands for none, in logarithms.
LEAST_STRESS = 1e-300
#: ln(V/V_*) beyond which slip without mass counts as unbounded: 10^120 V_*.
UNBOUNDED = 120.0 * math.log(10.0)
#: How a motion goes on, or why it cannot.
GOES_ON, IS_LOST, IS_LOCKED, HAS_STOPPED, IS_UNBOUNDED = range(5)


class Limits(NamedTuple):
    """The numbers that decide when to change.

    Attributes
    ----------
    norm : float
        Slip rate norm w at which to leave the slow manifold, which is a series in (K/a) w**2.
    correction : float
        Change of ln V by inertia up to which the slow manifold may be used.
    remaining_slip : float
        Slip in D_c that may remain when the full equations hand back.
    softness : float
        K/a.
    a : float
        Direct effect.
    inertial_time : float
        T V_*/(2 pi D_c).
    """

    norm: float
    correction: float
    remaining_slip: float
    softness: float
    a: float
    inertial_time: float


#: The limits of a motion without mass, which reads none.
NO_MASS = Limits(*[math.nan] * len(Limits._fields))


@once
def limits(scene: Scene, accuracy: Accuracy) -> Limits:
    """The limits of a scene at an accuracy."""
    if not scene.has_mass:
        return NO_MASS
    softness = scene.stiffness / scene.a
    return Limits(
        math.sqrt(accuracy.switch_weight / softness),
        accuracy.switch_correction,
        accuracy.remaining_slip,
        softness,
        scene.a,
        scene.inertial_time,
    )


def mass_acts(scene: Scene, accuracy: Accuracy) -> bool:
    """True if mass matters up to the instability norm, beyond what the slow manifold holds of
    it.
    """
    return scene.has_mass and error_of_slow_manifold(scene) > 0.1 * accuracy.rtol


def error_of_slow_manifold(scene: Scene) -> float:
    """Relative error of a boundary computed on the slow manifold up to the norm w of a scene:
    ``3 [(K/a) w**2]**2``.

    Mass moves a boundary in proportion to (K/a) w**2, by up to 0.8 of it where the norm is a slip
    rate of a few V_*; the slow manifold leaves up to 0.9 of its square (the tests measure it).
    """
    return 3.0 * (scene.stiffness / scene.a * scene.instability_norm**2) ** 2


def norm_at(log_slip_rate: float, given: Limits) -> float:
    """w = V T/(2 pi D_c)."""
    return given.inertial_time * math.exp(min(log_slip_rate, LARGEST_LOG_SLIP_RATE))


def weight_of_mass(log_slip_rate: float, missing: float, given: Limits) -> float:
    """Weight of mass where friction differs from spring stress by what is `missing`: 1 where
    the slow manifold has to be left.
    """
    correction = abs(missing) / given.a / given.correction
    return max(norm_at(log_slip_rate, given) / given.norm, correction)


def slip_of_rise(log_slip_rate: float, after: float, given: Limits) -> float:
    """Slip in D_c, times the change of ln V, while slip rate goes to its value `after` a step; left
    out, the state would miss the evolution of that slip.
    """
    norm = max(norm_at(log_slip_rate, given), norm_at(after, given))
    return given.softness * norm**2 * abs(after - log_slip_rate)


def begins_slow(log_slip_rate: float, below: float, missing: float, given: Limits) -> bool:
    """True if a motion begins on the slow manifold, from ln(V/V_*), where that has ln(V/V_*)
    `below`, and friction differs from spring stress by what is `missing` there.
    """
    rate = norm_at(log_slip_rate, given) / given.norm
    slow = max(weight_of_mass(below, missing, given), rate) < 1.0
    return slow and slip_of_rise(log_slip_rate, below, given) <= given.remaining_slip


def may_return(log_slip_rate: float, given: Limits) -> bool:
    """True if ln(V/V_*) alone lets the full equations hand back: the slow manifold must not hand
    straight back in its turn.
    """
    return norm_at(log_slip_rate, given) < 0.5 * given.norm


def has_returned(
    log_slip_rate: float, growth: float, below: float, missing: float, given: Limits
) -> bool:
    """True if the full equations have done their work at ln(V/V_*) and its growth, where the slow
    manifold has ln(V/V_*) `below`, and friction differs from spring stress by what is `missing`.

    The slip rate still has to go from ln V = x to the slow manifold's x_s, over a slip of about
    (K/2a) w**2 min(1, |x - x_s|) D_c at the faster of the two; the state may change that much
    unnoticed; and see `may_return`.

    A rise to a slow manifold that falls, where friction exceeds spring stress, has its peak below
    that: they meet after a slip of several (K/a) w**2 D_c. It is followed up to there. So is a
    fall to one that rises: its trough is above where that is now, by several times the change of
    ln V by which that trails, which is what is missing over a.
    """
    norm = max(norm_at(log_slip_rate, given), norm_at(below, given))
    has_peak = missing < 0.0 and given.softness * norm**2 > given.remaining_slip
    has_trough = missing > 0.1 * given.remaining_slip * given.a
    if (growth > 0.0 and (log_slip_rate > below + 1.0 or has_peak)) or (
        growth < 0.0 and has_trough
    ):
        return False
    remaining = 0.5 * given.softness * norm**2 * min(1.0, abs(log_slip_rate - below))
    settled = max(norm / given.norm, weight_of_mass(below, missing, given)) < 0.5
    return settled and remaining < given.remaining_slip


def termination_of(log_slip_rate: float, normal_stress: float, load_velocity: float) -> int:
    """Termination status of a motion: `GOES_ON`, unless normal stress vanishes, normal stress or
    slip rate grow without bound, or slip stops.

    Shear stress may reverse in the overshoot of a rupture; the equations go through that unharmed.
    """
    if normal_stress <= LOST:
        return IS_LOST
    if normal_stress >= LOCKED:
        return IS_LOCKED
    if log_slip_rate <= SLOWEST and load_velocity == 0.0:
        return HAS_STOPPED
    if log_slip_rate >= UNBOUNDED:
        return IS_UNBOUNDED
    return GOES_ON


def margin(log_slip_rate: float, normal_stress: float, load_velocity: float) -> float:
    """Margin of ln V and of the logarithm of normal stress to where a motion ends: positive where
    it goes on.
    """
    stress = math.log(max(normal_stress, LEAST_STRESS))
    left = min(stress - math.log(LOST), math.log(LOCKED) - stress, UNBOUNDED - log_slip_rate)
    return min(left, log_slip_rate - SLOWEST) if load_velocity == 0.0 else left


def halted(end: int, normal_stress: float) -> Halt:
    """The end of a motion, by its termination status (see `termination_of`)."""
    if end == IS_LOST:
        return Halt(Status.NORMAL_STRESS_LOST, "normal stress vanished during the motion")
    if end == IS_LOCKED:
        text = f"normal stress grew to {normal_stress:.3g} sigma_* and goes on"
        return Halt(Status.LOCKED, text)
    if end == HAS_STOPPED:
        return Halt(Status.SLIP_STOPPED, "the slip rate fell below 10^-290 V_*")
    bound = "inertia=True (a rig's period=, mass=) or radiation_damping= (shear_modulus=) bounds it"
    text = f"slip rate grew beyond 10^120 V_* without mass: {bound}"
    return Halt(Status.SLIP_RATE_UNBOUNDED, text)
