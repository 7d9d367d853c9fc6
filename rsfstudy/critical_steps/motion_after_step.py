"""Functions that compare the peak slip rate after a step with the instability norm.

The main functions are ``motion_reaches_instability_norm`` and
``compute_log_rate_above_instability_norm``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rsfstudy.critical_steps.critical_path import CriticalPath
from rsfstudy.critical_steps.monotone_slip_rate_rise_check import (
    build_events_testing_monotone_rise,
    is_slip_rate_rise_monotone,
)
from rsfstudy.critical_steps.motion_with_held_load_point import (
    compute_peak_log_rate_excess_over_norm,
)
from rsfstudy.critical_steps.slow_manifold_accuracy import is_slow_manifold_inaccurate
from rsfstudy.critical_steps.stability_after_step import (
    SteadySlidingWithStabilityMargin,
    find_steady_sliding_and_stability_margin,
    has_closed_orbits_at_critical_stiffness,
)
from rsfstudy.motion import (
    EventKind,
    Integrator,
    approach_to_steady_state,
    maximum,
    minimum,
    rise,
)
from rsfstudy.slider import MotionPoint, Scene

#: Largest amplitude of ln V for which linear theory predicts the growth of oscillations.
_MAX_LOG_RATE_AMPLITUDE_OF_LINEAR_THEORY = 0.05
#: Ratio of the size of the next orbit to the size of the present orbit if oscillations grow slowly,
#: and smallest permitted ratio. The orbits between the two sizes are not computed, so limit cycles
#: between the two sizes may be missed. The ratio is reduced if the next orbit would exceed the
#: instability norm.
_LEAP_FACTOR, _MIN_LEAP_FACTOR = 1.3, 1.002
#: Number of successive equal peaks after which a motion with several states is considered periodic.
#: Close to an unstable limit cycle, the peaks would not remain equal.
_REQUIRED_EQUAL_PEAKS_IN_A_ROW = 4
#: Assumed height of the ln V peak above the instability norm, if the motion is integrated only up
#: to the norm.
_ASSUMED_PEAK_HEIGHT_ABOVE_NORM = 1.0
#: A motion has settled if its distance from steady sliding is less than this fraction of the
#: largest distance from steady sliding during the motion.
_SETTLED_DISTANCE_OVER_MAX_DISTANCE = 1e-3
_SLIP_RATE_PEAK_SPECIFICATION = maximum("log_slip_rate")
_SETTLING_EVENT_SPECIFICATION = approach_to_steady_state(_SETTLED_DISTANCE_OVER_MAX_DISTANCE)


@dataclass(frozen=True)
class _OrbitOutcome:
    """Outcome of a single orbit of the motion after a step.

    Parameters
    ----------
    log_slip_rate_peaks : tuple of float
        Values of ln V at the peaks of ln V.
    has_reached_instability_norm : bool
        True if the motion has reached the instability norm.
    point_where_growth_was_too_slow : MotionPoint, optional
        Peak of ln V at which the integration ended because the orbit grows too slowly.
    initial_log_slip_rate : float, default: -inf
        Value of ln V at the start of the motion, if the slip rate initially decreases.
    """

    log_slip_rate_peaks: tuple[float, ...]
    has_reached_instability_norm: bool
    point_where_growth_was_too_slow: MotionPoint | None = None
    initial_log_slip_rate: float = -math.inf


def motion_reaches_instability_norm(scene: Scene, integrator: Integrator) -> bool:
    """Return True if the slip rate reaches the instability norm after the step.

    Parameters
    ----------
    scene : Scene
        Scene with the step.
    integrator : Integrator
        Integrator with the requested accuracy.

    Returns
    -------
    bool
        True if ``compute_log_rate_above_instability_norm`` is not negative.
    """
    return compute_log_rate_above_instability_norm(scene, integrator) >= 0.0


def compute_log_rate_above_instability_norm(scene: Scene, integrator: Integrator) -> float:
    """Compute the excess of ln V over the instability norm after the step.

    The excess is negative if the slip rate never reaches the instability norm. With inertia, the
    excess is the difference between the highest peak of ln V and the norm. Without inertia, the
    excess is the increase in ln V from one peak to the next. If possible, the excess is a
    continuous function of the step size at the boundary between stable and unstable steps.

    Parameters
    ----------
    scene : Scene
        Scene with the step.
    integrator : Integrator
        Integrator with the requested accuracy.

    Returns
    -------
    float
        Excess of ln V, which is positive or zero if the slip rate reaches the instability norm.

    Raises
    ------
    MotionStopped
        With the status ``no_steady_state`` if sliding cannot be steady at the load point velocity,
        or with another status if the motion cannot continue.

    Notes
    -----
    If the scene has no inertia, the motion is planar and autonomous, so trajectories in the phase
    plane cannot cross. If a peak is not higher than the previous peak, no later peak is higher. If
    successive peaks of the slip rate grow, they continue to grow until the motion reaches the
    instability norm or a limit cycle.

    If oscillations grow slowly, the computation skips a large number of orbits and continues with a
    somewhat larger orbit. If all larger orbits grow up to the instability norm, the inner orbit
    also grows up to the norm. The same rules apply to scenes with inertia, because inertia acts
    only during ruptures. If the scene has several states, the integration ends only if the slip
    rate reaches the instability norm, if the motion settles to steady sliding, or if a cycle
    repeats. The module ``motion_with_held_load_point`` handles held
    load points.
    """
    if scene.log_load_velocity == -math.inf:
        return compute_peak_log_rate_excess_over_norm(scene, integrator)
    steady = find_steady_sliding_and_stability_margin(scene)
    norm, heavy = scene.log_slip_rate_at_instability, is_slow_manifold_inaccurate(scene, integrator)
    if (
        has_closed_orbits_at_critical_stiffness(scene)
        and abs(steady.stability_margin) < integrator.result_tolerance()
    ):
        top = _compute_max_log_rate_of_closed_orbit(scene, integrator)
        if not heavy or top < min(norm, -math.log(scene.inertial_time) - 7.0):
            return top - norm
    first = _follow_one_orbit(scene, steady, None, integrator, with_inertia=heavy)
    reached = first.has_reached_instability_norm
    if first.point_where_growth_was_too_slow is not None:
        at = first.point_where_growth_was_too_slow
        reached = _slow_orbit_grows_to_instability_norm(
            scene, steady, at, integrator, with_inertia=heavy
        )
    excess = _compute_peak_excess_of_orbit_over_norm(first, norm, with_inertia=heavy)
    return max(excess, 1e-12) if reached else min(excess, -1e-12)


def _compute_max_log_rate_of_closed_orbit(scene: Scene, integrator: Integrator) -> float:
    """Compute the largest value of ln V on a closed orbit.

    The largest ln V on the orbit is the last maximum before the start of the motion, or the first
    maximum after the start. If the motion starts with a decreasing slip rate, the motion is
    integrated backwards in time to the previous peak. The rest of the orbit is not integrated,
    because its slip rates may be as low as 1e-40 V_*, at which an integration would lose all
    digits.
    """
    begin = Integrator.compute_initial_point(scene)
    equations, start = (
        scene.equations_without_mass(with_time=False),
        (begin.spring_stress, begin.psi),
    )
    rising, norm = (
        equations.evaluate_motion_point(start).log_slip_rate_derivative > 0.0,
        scene.log_slip_rate_at_instability,
    )
    specs = (_SLIP_RATE_PEAK_SPECIFICATION, minimum("log_slip_rate"), rise("log_slip_rate", norm))
    for event in integrator.follow_equations(equations, start, specs, backward=not rising):
        if event.kind is EventKind.RISE:
            return norm + _ASSUMED_PEAK_HEIGHT_ABOVE_NORM
        if (
            event.specification is not None
            or event.point.log_slip_rate >= norm
            or event.point.log_slip_rate_derivative == 0.0
        ):
            return event.point.log_slip_rate
    raise AssertionError("a motion without a time limit cannot end")


def _does_orbit_at_instability_norm_shrink(scene: Scene, integrator: Integrator) -> bool:
    """Return True if the orbit that touches the instability norm shrinks.

    Paths in a plane cannot cross, so no orbit inside a shrinking orbit reaches the norm.
    """
    path = CriticalPath.from_scene(scene, integrator)
    misfit = path.compute_next_peak_height_above_norm(integrator.local_tolerance)
    return misfit is not None and misfit < -100.0 * integrator.local_tolerance


def _slow_orbit_grows_to_instability_norm(
    scene: Scene,
    steady_state: SteadySlidingWithStabilityMargin,
    start_point: MotionPoint,
    integrator: Integrator,
    *,
    with_inertia: bool,
) -> bool:
    """Return True if a slowly growing orbit grows up to the instability norm.

    The function tests successively larger orbits, until an orbit shrinks or reaches the instability
    norm. If an orbit already reaches the instability norm at its first peak of ln V, the function
    tests a smaller orbit instead.
    """
    if not with_inertia and _does_orbit_at_instability_norm_shrink(scene, integrator):
        return False
    leap = _LEAP_FACTOR
    while True:
        spring_stress, *psis = (
            rest + leap * (current - rest)
            for rest, current in zip(
                (steady_state.spring_stress, *steady_state.states),
                (start_point.spring_stress, *start_point.psis),
                strict=True,
            )
        )
        beyond = scene.compute_slow_manifold_point(spring_stress, tuple(psis))
        orbit = _follow_one_orbit(
            scene, steady_state, beyond, integrator, with_inertia=with_inertia
        )
        if (
            orbit.has_reached_instability_norm
            and len(orbit.log_slip_rate_peaks) == 1
            and leap > _MIN_LEAP_FACTOR
        ):
            leap = math.sqrt(leap)
        elif orbit.point_where_growth_was_too_slow is None:
            return orbit.has_reached_instability_norm
        else:
            start_point = orbit.point_where_growth_was_too_slow


def _follow_one_orbit(
    scene: Scene,
    steady_state: SteadySlidingWithStabilityMargin,
    start_point: MotionPoint | None,
    integrator: Integrator,
    *,
    with_inertia: bool,
) -> _OrbitOutcome:
    """Integrate an orbit until the outcome of the motion is certain.

    The integration also ends if the orbit grows so slowly that the outcome remains uncertain.
    """
    norm = scene.log_slip_rate_at_instability
    levels = build_events_testing_monotone_rise(scene)
    if levels and not steady_state.is_stable:
        levels = []
    reaches_norm = [] if with_inertia else [rise("log_slip_rate", norm)]
    specs = [_SLIP_RATE_PEAK_SPECIFICATION, *reaches_norm, _SETTLING_EVENT_SPECIFICATION, *levels]
    planar, repeating = (
        scene.state_count == 1,
        _CycleRepetitionDetector(scene, steady_state, integrator),
    )
    peaks: list[float] = []
    at_start = -math.inf
    for event in integrator.follow(scene, specs, start=start_point):
        top = event.point.log_slip_rate
        if event.kind is EventKind.START:
            if start_point is None and event.point.log_slip_rate_derivative <= 0.0:
                # The start is not a peak of an orbit, so later peaks are not compared with it.
                at_start = top
                if top >= norm:
                    return _OrbitOutcome(
                        (), has_reached_instability_norm=True, initial_log_slip_rate=top
                    )
            elif top >= norm and not with_inertia:
                return _OrbitOutcome((top,), has_reached_instability_norm=True)
        elif event.specification in levels:
            if is_slip_rate_rise_monotone(scene, event.point):
                return _OrbitOutcome(
                    tuple(peaks), has_reached_instability_norm=False, initial_log_slip_rate=at_start
                )
        elif event.kind is EventKind.RISE:
            return _OrbitOutcome(
                (*peaks, norm + _ASSUMED_PEAK_HEIGHT_ABOVE_NORM), has_reached_instability_norm=True
            )
        elif event.kind is EventKind.SETTLED and steady_state.is_stable:
            return _OrbitOutcome(
                tuple(peaks), has_reached_instability_norm=False, initial_log_slip_rate=at_start
            )
        elif event.kind is EventKind.MAXIMUM:
            peaks.append(top)
            if top >= norm:
                return _OrbitOutcome(tuple(peaks), has_reached_instability_norm=True)
            if not planar:
                if repeating.is_repeating_at_peak(event.point):
                    return _OrbitOutcome(tuple(peaks), has_reached_instability_norm=False)
                continue
            if len(peaks) > 1 and _peaks_have_stopped_growing(peaks, steady_state, integrator):
                return _OrbitOutcome(tuple(peaks), has_reached_instability_norm=False)
            slow = len(peaks) > 1 and peaks[-1] - peaks[-2] < 0.2 * (norm - top)
            if slow and not steady_state.is_stable and event.regime != Scene.RUPTURE_REGIME:
                return _OrbitOutcome(tuple(peaks), False, event.point)
    raise AssertionError("a motion without a time limit cannot end")


class _CycleRepetitionDetector:
    """Detector of repeating motions in scenes with several states.

    A motion repeats if its unknowns are the same at several successive peaks, within numerical
    errors. A motion whose unknowns are constant within the tolerance is also considered periodic.
    If steady sliding is unstable and the oscillation is small, the integration continues, because
    the growth of the oscillation may be too small to measure.
    """

    def __init__(
        self, scene: Scene, steady_state: SteadySlidingWithStabilityMargin, integrator: Integrator
    ) -> None:
        self._steady, self._tolerance = steady_state, 30.0 * integrator.local_tolerance * scene.a
        self._previous, self._repeat_count = (math.inf,) * (1 + scene.state_count), 0

    def is_repeating_at_peak(self, peak_point: MotionPoint) -> bool:
        """Update the detector, and return True if the motion repeats.

        Parameters
        ----------
        peak_point : MotionPoint
            Point at the latest peak of ln V.

        Returns
        -------
        bool
            True if the required number of successive peaks of ln V are equal.
        """
        current = (peak_point.spring_stress, *peak_point.psis)
        change = max(abs(x - y) for x, y in zip(current, self._previous, strict=True))
        linear = (
            peak_point.log_slip_rate - self._steady.log_slip_rate
            < _MAX_LOG_RATE_AMPLITUDE_OF_LINEAR_THEORY
            and not self._steady.is_stable
        )
        self._repeat_count = (
            self._repeat_count + 1 if change < self._tolerance and not linear else 0
        )
        self._previous = current
        return self._repeat_count == _REQUIRED_EQUAL_PEAKS_IN_A_ROW


def _peaks_have_stopped_growing(
    peaks: Sequence[float], steady_state: SteadySlidingWithStabilityMargin, integrator: Integrator
) -> bool:
    """Return True if the last peak is not higher than the previous peak.

    If the growth is too small to measure, linear theory determines the sign of the growth.
    """
    slack = 100.0 * integrator.local_tolerance
    linear = (
        peaks[-1] - steady_state.log_slip_rate < _MAX_LOG_RATE_AMPLITUDE_OF_LINEAR_THEORY
        and not steady_state.is_stable
    )
    return peaks[-1] - peaks[-2] <= (-slack if linear else slack)


def _compute_peak_excess_of_orbit_over_norm(
    orbit: _OrbitOutcome, log_slip_rate_at_norm: float, *, with_inertia: bool
) -> float:
    """Compute an excess of ln V over the norm, which changes sign at the critical step.

    If the sign depends on later orbits, the calling function corrects the sign.
    """
    if with_inertia:
        highest = max((orbit.initial_log_slip_rate, *orbit.log_slip_rate_peaks))
        return highest - log_slip_rate_at_norm if highest > -math.inf else -log_slip_rate_at_norm
    if len(orbit.log_slip_rate_peaks) > 1:
        return orbit.log_slip_rate_peaks[1] - orbit.log_slip_rate_peaks[0]
    return (
        orbit.log_slip_rate_peaks[0] - log_slip_rate_at_norm if orbit.log_slip_rate_peaks else -1.0
    )
