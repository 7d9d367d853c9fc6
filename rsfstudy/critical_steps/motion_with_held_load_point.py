"""Function that computes the peak slip rate of a motion while the load point is held.

The main function is ``compute_peak_log_rate_excess_over_norm``. Spring stress can only decrease
while the load point is held. With one state variable, ln V has only one peak, because the weakening
of friction with slip becomes slower and slower after the first peak.

If the law has several state variables, friction may weaken repeatedly. State variables with b < 0
weaken friction when the slip rate decreases. If dilatancy has lowered the pore pressure, the
recovery of the pore pressure also weakens friction when the slip rate decreases. If the dilatancy
is negative, pore pressure weakens friction when the slip rate increases again. The integration
therefore continues until no state can weaken friction enough to cause another peak above the
instability norm.
"""

from __future__ import annotations

import math

from rsfstudy.critical_steps.slow_manifold_accuracy import is_slow_manifold_inaccurate
from rsfstudy.motion import (
    Event,
    EventKind,
    EventSpecification,
    Integrator,
    MotionStopped,
    fall,
    maximum,
    rise,
)
from rsfstudy.slider import MotionPoint, Scene
from rsfstudy.status import Status

#: Spacing of the levels of ln V at which the motion is tested for further peaks. The first number
#: is the minimum spacing. The second number is the ratio of the spacing to the difference between
#: ln V and the instability norm.
_MIN_LEVEL_SPACING, _RELATIVE_LEVEL_SPACING = 1.0, 0.12
#: Decreases in ln V at which the weakening of friction by the states is tested.
_LOG_RATE_DECREASES_FOR_WEAKENING_TEST = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
#: Increases in ln V that are tested as upper bounds of the effect of pore pressure.
_TRIAL_LOG_RATE_INCREASES_BY_PRESSURE = (1e-4, 1e-3, 1e-2, 0.1, 1.0)
#: Maximum ratio of the weakening of friction by the states to the decrease in spring stress. No
#: further peak of ln V is possible below this ratio.
_MAX_WEAKENING_OVER_SPRING_UNLOADING = 0.5


def compute_peak_log_rate_excess_over_norm(scene: Scene, integrator: Integrator) -> float:
    """Compute by how much the highest peak of ln V exceeds the instability norm.

    The peak is the highest value of ln V in the motion. If the effect of inertia is small, the
    motion is integrated only up to the instability norm. In this case, the function returns the
    square of d(ln V)/dt at the instability norm instead of the peak height. At the boundary between
    stable and unstable steps, this rate of change is zero.

    Parameters
    ----------
    scene : Scene
        Scene with a held load point.
    integrator : Integrator
        Integrator with the requested accuracy.

    Returns
    -------
    float
        Highest value of ln V minus the value at the instability norm. The result is negative if the
        slip rate does not reach the instability norm.

    Raises
    ------
    MotionStopped
        If the motion cannot continue. ``MotionStopped`` is not raised if slip stops.
    """
    norm, heavy, highest = (
        scene.log_slip_rate_at_instability,
        is_slow_manifold_inaccurate(scene, integrator),
        -math.inf,
    )
    try:
        for event in integrator.follow(
            scene,
            _build_event_specs_for_held_load_point(scene, norm, with_inertia=heavy),
        ):
            if event.kind is EventKind.RISE:
                return event.point.log_slip_rate_derivative**2
            if event.kind in (EventKind.START, EventKind.MAXIMUM):
                highest = max(highest, event.point.log_slip_rate)
            over = highest >= norm and (event.kind is EventKind.MAXIMUM or not heavy)
            if over or _no_later_peak_reaches_instability_norm(scene, event):
                break
    except MotionStopped as halt:
        if halt.status is not Status.SLIP_STOPPED:
            raise
    return highest - norm


def _build_event_specs_for_held_load_point(
    scene: Scene, log_slip_rate_at_norm: float, *, with_inertia: bool
) -> list[EventSpecification]:
    """Return the events at which the motion is tested.

    The events are peaks of ln V, the rise of ln V to the instability norm, the loss of shear
    stress, and the times at which ln V falls through each of a series of levels below the norm.
    """
    specs = [maximum("log_slip_rate")]
    if not with_inertia:
        specs.append(rise("log_slip_rate", log_slip_rate_at_norm))
    if scene.state_count > 1:
        specs.append(fall("spring_stress", -scene.mu_star))
        below = _MIN_LEVEL_SPACING
        while log_slip_rate_at_norm - below > Scene.LOG_SLIP_RATE_OF_STOPPED_SLIP:
            specs.append(fall("log_slip_rate", log_slip_rate_at_norm - below))
            below += max(_MIN_LEVEL_SPACING, _RELATIVE_LEVEL_SPACING * below)
    return specs


def _no_later_peak_reaches_instability_norm(scene: Scene, event: Event) -> bool:
    """Return True if no later peak of ln V can reach the instability norm."""
    slows = event.kind is EventKind.START and event.point.log_slip_rate_derivative <= 0.0
    if scene.state_count == 1:
        return slows or event.kind is EventKind.MAXIMUM
    if event.regime == Scene.RUPTURE_REGIME or not (slows or event.kind is EventKind.FALL):
        return False
    return (
        scene.mu_star + event.point.spring_stress <= 0.0
        or _slip_rate_stays_below_instability_norm(scene, event.point)
    )


def _slip_rate_stays_below_instability_norm(scene: Scene, motion_point: MotionPoint) -> bool:
    """Return True if ln V provably stays below the instability norm.

    The slip rate must be decreasing at the tested point of the motion. A state that strengthens
    friction approaches its steady state at the present slip rate. If b > 0, the steady state rises
    as ln V decreases, so the state continues to strengthen friction.

    The loss of strength due to pore pressure and heat, divided by a, is an upper bound on the
    increase in ln V due to these two effects. The function increases ln V by this upper bound, and
    returns True if the states still weaken friction more slowly than the spring stress decreases.
    """
    _value, slope, shift, shift_slope = scene.build_friction_relation(motion_point.psis)(
        motion_point.frictional_stress
    )
    states, evolve = range(scene.parts.law.state_count), scene.build_state_evolution_function()
    strengthening = evolve(motion_point.log_slip_rate, motion_point.psis, shift)
    if min(strengthening[i] for i in states) < 0.0:
        return False
    raised, least_shift = _compute_max_rate_rise_by_pore_pressure(scene, motion_point)
    if motion_point.log_slip_rate + raised >= scene.log_slip_rate_at_instability:
        return False
    fallen = scene.stiffness * slope * (1.0 - _MAX_WEAKENING_OVER_SPRING_UNLOADING)
    for distance in _LOG_RATE_DECREASES_FOR_WEAKENING_TEST:
        x = motion_point.log_slip_rate - distance
        rest = scene.compute_steady_states(x, shift)
        later = scene.compute_steady_states(
            x - fallen / scene.a, shift - scene.stiffness * shift_slope
        )
        weakening = evolve(x + raised, rest, least_shift)
        if -sum(weakening[i] for i in states) > fallen or any(later[i] < rest[i] for i in states):
            return False
    return True


def _compute_max_rate_rise_by_pore_pressure(
    scene: Scene, motion_point: MotionPoint
) -> tuple[float, float]:
    """Compute an upper bound on the increase in ln V due to pore pressure and heat.

    The function returns the upper bound, and the smallest decrease in the state due to stress and
    temperature. The upper bound is infinite if no bound is found. To find the bound, the function
    tests trial increases in ln V. For each trial increase, the function computes the loss of
    strength at the highest pore pressure and temperature that are possible at the increased ln V.
    The trial increase is an upper bound if the loss of strength is less than a times the trial
    increase.
    """
    value, _slope, shift, _ = scene.build_friction_relation(motion_point.psis)(
        motion_point.frictional_stress
    )
    if not scene.parts.fluid.unknowns and not scene.parts.temperature.unknowns:
        return 0.0, shift
    for bound in _TRIAL_LOG_RATE_INCREASES_BY_PRESSURE:
        hottest, coldest = _find_pressure_and_temperature_bounds(
            scene, motion_point, motion_point.log_slip_rate + bound
        )
        if math.isinf(max(map(abs, (*hottest, *coldest)))):
            break
        weaker = scene.build_friction_relation(hottest)(motion_point.frictional_stress)[0]
        if weaker - value < bound * scene.a:
            shift = scene.build_friction_relation(coldest)(motion_point.frictional_stress)[2]
            return bound, shift
    return math.inf, shift


def _find_pressure_and_temperature_bounds(
    scene: Scene, motion_point: MotionPoint, log_slip_rate: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the states at the highest and at the lowest possible temperature.

    Both results contain the highest possible pore pressure. The bounds are valid as long as
    ln(V/V_*) does not exceed ``log_slip_rate``.
    """
    fluid, temperature = scene.parts.fluid, scene.parts.temperature
    hottest, coldest, range_of_rise = list(motion_point.psis), list(motion_point.psis), 0.0
    if temperature.unknowns:
        place = scene.parts.law.state_count
        stress = scene.mu_star + max(motion_point.spring_stress, motion_point.frictional_stress)
        coldest[place], hottest[place] = temperature.compute_temperature_rise_bounds(
            scene, motion_point.psis[place], stress * math.exp(log_slip_rate)
        )
        range_of_rise = hottest[place] - coldest[place]
    if fluid.unknowns:
        pressure = fluid.compute_pore_pressure_upper_bound(
            log_slip_rate, motion_point.psis[-len(fluid.unknowns) :]
        )
        # The pressure is the sum of the response to drainage and of the response to heating.
        heated = fluid.pressurisation_factor
        hottest[-1] = coldest[-1] = pressure + (heated * range_of_rise if heated else 0.0)
    return tuple(hottest), tuple(coldest)
