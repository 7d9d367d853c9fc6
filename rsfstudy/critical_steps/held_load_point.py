"""Highest slip rate of a motion under a load point at rest, as after a step of displacement.

Spring stress can only fall there. With one state the first peak of ln V is the last: where ln V is
stationary slip weakens, and goes on to weaken less, so that ln V has no minimum. Several states may
weaken one after the other: those with b < 0, and pore pressure that dilatant slip has lowered, do
so because slip rate falls. Such a motion is followed until nothing can weaken enough any more.
"""

from __future__ import annotations

import math

from rsfstudy.critical_steps.slow_manifold import inertia_matters
from rsfstudy.motion import (
    Accuracy,
    Event,
    EventKind,
    EventSpecification,
    MotionStopped,
    WorkMeter,
    fall,
    integrate_events,
    maximum,
    rise,
)
from rsfstudy.slider import (
    RUPTURE_REGIME,
    STOPPED_LOG_SLIP_RATE,
    Point,
    Scene,
    compute_steady_states,
    friction_relation,
    state_evolution,
)
from rsfstudy.status import Status

#: Distance in ln V between levels at which it is asked whether a peak was the last, and the part of
#: their distance from the norm that it is where that is more.
_MIN_LEVEL_SPACING, _RELATIVE_LEVEL_SPACING = 1.0, 0.12
#: Distances in ln V below the present one at which no state must weaken.
_TESTED_LOG_RATE_DECREASES = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
#: Changes of ln V that pore pressure is tried to be too low for.
_TESTED_LOG_RATE_INCREASES = (1e-4, 1e-3, 1e-2, 0.1, 1.0)
#: Part of what falling spring stress takes from ln V that weakening may give back.
_MAX_WEAKENING_FRACTION = 0.5


def peak_excess(scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> float:
    """Highest ln V of the motion above the instability norm.

    Where mass does not act the motion is followed up to the norm only: the square of the growth of
    ln V there, which vanishes with the excess, takes its place.
    """
    norm, heavy, highest = scene.log_instability_rate, inertia_matters(scene, accuracy), -math.inf
    try:
        for event in integrate_events(
            scene, accuracy, meter, _event_specifications(scene, norm, with_inertia=heavy)
        ):
            if event.kind is EventKind.RISE:
                return event.point.log_slip_rate_derivative**2
            if event.kind in (EventKind.START, EventKind.MAXIMUM):
                highest = max(highest, event.point.log_slip_rate)
            over = highest >= norm and (event.kind is EventKind.MAXIMUM or not heavy)
            if over or _is_last_peak(scene, event):
                break
    except MotionStopped as halt:
        if halt.status is not Status.SLIP_STOPPED:
            raise
    return highest - norm


def _event_specifications(
    scene: Scene, norm: float, *, with_inertia: bool
) -> list[EventSpecification]:
    """Peaks, the norm, the end of shear stress, and levels of ln V ever farther below the norm."""
    specs = [maximum("log_slip_rate")]
    if not with_inertia:
        specs.append(rise("log_slip_rate", norm))
    if scene.state_count > 1:
        specs.append(fall("spring_stress", -scene.mu_star))
        below = _MIN_LEVEL_SPACING
        while norm - below > STOPPED_LOG_SLIP_RATE:
            specs.append(fall("log_slip_rate", norm - below))
            below += max(_MIN_LEVEL_SPACING, _RELATIVE_LEVEL_SPACING * below)
    return specs


def _is_last_peak(scene: Scene, event: Event) -> bool:
    """True if no peak comes after an event, or none that reaches the norm."""
    slows = event.kind is EventKind.START and event.point.log_slip_rate_derivative <= 0.0
    if scene.state_count == 1:
        return slows or event.kind is EventKind.MAXIMUM
    if event.regime == RUPTURE_REGIME or not (slows or event.kind is EventKind.FALL):
        return False
    return scene.mu_star + event.point.spring_stress <= 0.0 or _stays_below_norm(scene, event.point)


def _stays_below_norm(scene: Scene, point: Point) -> bool:
    """True if it can be proved that ln V, which falls, will not reach the norm.

    A state that strengthens tends to where it would rest at the present slip rate, and goes on to
    strengthen while that rises, which it does with falling ln V where b > 0. Pore pressure may
    raise ln V by what it takes from strength, over a, and no farther, if as much above its rest a
    state weakens less than falling spring stress takes.
    """
    _value, slope, shift, shift_slope = friction_relation(scene, point.psis)(
        point.frictional_stress
    )
    states, evolve = range(scene.parts.law.state_count), state_evolution(scene)
    strengthening = evolve(point.log_slip_rate, point.psis, shift)
    if min(strengthening[i] for i in states) < 0.0:
        return False
    raised, least_shift = _bound_pressure_effect(scene, point)
    if point.log_slip_rate + raised >= scene.log_instability_rate:
        return False
    fallen = scene.stiffness * slope * (1.0 - _MAX_WEAKENING_FRACTION)
    for distance in _TESTED_LOG_RATE_DECREASES:
        x = point.log_slip_rate - distance
        rest = compute_steady_states(scene, x, shift)
        later = compute_steady_states(
            scene, x - fallen / scene.a, shift - scene.stiffness * shift_slope
        )
        weakening = evolve(x + raised, rest, least_shift)
        if -sum(weakening[i] for i in states) > fallen or any(later[i] < rest[i] for i in states):
            return False
    return True


def _bound_pressure_effect(scene: Scene, point: Point) -> tuple[float, float]:
    """Bound of what pore pressure raises ln V by from now on, and of the state lost to stress; the
    first is infinite where there is no bound.

    No higher than such a bound, ln V allows of no pressure that would take it as high.
    """
    fluid, psis = scene.parts.fluid, point.psis
    value, _slope, shift, _ = friction_relation(scene, psis)(point.frictional_stress)
    if not fluid.unknowns:
        return 0.0, shift
    own = psis[-len(fluid.unknowns) :]
    for bound in _TESTED_LOG_RATE_INCREASES:
        pressure = fluid.highest_pressure(point.log_slip_rate + bound, own)
        if math.isinf(pressure):
            break
        weaker, _slope, shift, _ = friction_relation(scene, (*psis[:-1], pressure))(
            point.frictional_stress
        )
        if weaker - value < bound * scene.a:
            return bound, shift
    return math.inf, shift
