"""Highest slip rate of a motion under a load point at rest, as after a step of displacement.

Spring stress can only fall there. With one state the first peak of ln V is the last: where ln V is
stationary slip weakens, and goes on to weaken less, so that ln V has no minimum. Several states may
weaken one after the other: those with b < 0, and pore pressure that dilatant slip has lowered, do
so because slip rate falls. Such a motion is followed until nothing can weaken enough any more.
"""

from __future__ import annotations

import math

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import Event, EventSpecification, Kind, fall, maximum, rise
from rsfstudy.motion.handover import mass_acts
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.slider.equations import IN_RUPTURE, evolutions_of, relation_of, steady_states_of
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.system import SLOWEST
from rsfstudy.status import Status

#: Distance in ln V between levels at which it is asked whether a peak was the last, and the part of
#: their distance from the norm that it is where that is more.
_APART, _PART = 1.0, 0.12
#: Distances in ln V below the present one at which no state must weaken.
_FALLS = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
#: Changes of ln V that pore pressure is tried to be too low for.
_BOUNDS = (1e-4, 1e-3, 1e-2, 0.1, 1.0)
#: Part of what falling spring stress takes from ln V that weakening may give back.
_OUTWEIGHED = 0.5


def excess_of_peak(scene: Scene, accuracy: Accuracy, meter: Meter) -> float:
    """Highest ln V of the motion above the instability norm.

    Where mass does not act the motion is followed up to the norm only: the square of the growth of
    ln V there, which vanishes with the excess, takes its place.
    """
    norm, heavy, highest = scene.log_norm_rate, mass_acts(scene, accuracy), -math.inf
    try:
        for event in follow(scene, accuracy, meter, _specs(scene, norm, heavy=heavy)):
            if event.kind is Kind.RISE:
                return event.point.growth**2
            if event.kind in (Kind.START, Kind.MAXIMUM):
                highest = max(highest, event.point.log_slip_rate)
            over = highest >= norm and (event.kind is Kind.MAXIMUM or not heavy)
            if over or _was_last(scene, event):
                break
    except Halt as halt:
        if halt.status is not Status.SLIP_STOPPED:
            raise
    return highest - norm


def _specs(scene: Scene, norm: float, *, heavy: bool) -> list[EventSpecification]:
    """Peaks, the norm, the end of shear stress, and levels of ln V ever farther below the norm."""
    specs = [maximum("log_slip_rate")]
    if not heavy:
        specs.append(rise("log_slip_rate", norm))
    if scene.states > 1:
        specs.append(fall("spring_stress", -scene.mu_star))
        below = _APART
        while norm - below > SLOWEST:
            specs.append(fall("log_slip_rate", norm - below))
            below += max(_APART, _PART * below)
    return specs


def _was_last(scene: Scene, event: Event) -> bool:
    """True if no peak comes after an event, or none that reaches the norm."""
    slows = event.kind is Kind.START and event.point.growth <= 0.0
    if scene.states == 1:
        return slows or event.kind is Kind.MAXIMUM
    if event.regime == IN_RUPTURE or not (slows or event.kind is Kind.FALL):
        return False
    return scene.mu_star + event.point.spring_stress <= 0.0 or _stays_below_norm(scene, event.point)


def _stays_below_norm(scene: Scene, point: Point) -> bool:
    """True if it can be proved that ln V, which falls, will not reach the norm.

    A state that strengthens tends to where it would rest at the present slip rate, and goes on to
    strengthen while that rises, which it does with falling ln V where b > 0. Pore pressure may
    raise ln V by what it takes from strength, over a, and no farther, if as much above its rest a
    state weakens less than falling spring stress takes.
    """
    _value, slope, shift, shift_slope = relation_of(scene, point.psis)(point.friction)
    states, evolve = range(scene.parts.law.states), evolutions_of(scene)
    strengthening = evolve(point.log_slip_rate, point.psis, shift)
    if min(strengthening[i] for i in states) < 0.0:
        return False
    raised, least_shift = _raised_by_pressure(scene, point)
    if point.log_slip_rate + raised >= scene.log_norm_rate:
        return False
    fallen = scene.stiffness * slope * (1.0 - _OUTWEIGHED)
    for distance in _FALLS:
        x = point.log_slip_rate - distance
        rest = steady_states_of(scene, x, shift)
        later = steady_states_of(scene, x - fallen / scene.a, shift - scene.stiffness * shift_slope)
        weakening = evolve(x + raised, rest, least_shift)
        if -sum(weakening[i] for i in states) > fallen or any(later[i] < rest[i] for i in states):
            return False
    return True


def _raised_by_pressure(scene: Scene, point: Point) -> tuple[float, float]:
    """Bound of what pore pressure raises ln V by from now on, and of the state lost to stress; the
    first is infinite where there is no bound.

    No higher than such a bound, ln V allows of no pressure that would take it as high.
    """
    fluid, psis = scene.parts.fluid, point.psis
    value, _slope, shift, _ = relation_of(scene, psis)(point.friction)
    if not fluid.unknowns:
        return 0.0, shift
    own = psis[-len(fluid.unknowns) :]
    for bound in _BOUNDS:
        pressure = fluid.highest_pressure(point.log_slip_rate + bound, own)
        if math.isinf(pressure):
            break
        weaker, _slope, shift, _ = relation_of(scene, (*psis[:-1], pressure))(point.friction)
        if weaker - value < bound * scene.a:
            return bound, shift
    return math.inf, shift
