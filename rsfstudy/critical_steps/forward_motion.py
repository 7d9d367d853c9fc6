"""The motion after a step and its outcome: does the slip rate reach the instability norm?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rsfstudy.critical_steps.critical_path import CriticalPath
from rsfstudy.critical_steps.held_load_point import peak_excess
from rsfstudy.critical_steps.monotone_approach import monotone_rise_events, rises_monotonically
from rsfstudy.critical_steps.slow_manifold import inertia_matters
from rsfstudy.motion import (
    Accuracy,
    EventKind,
    MotionStopped,
    WorkMeter,
    approach_to_steady_state,
    events_along,
    initial_point,
    integrate_events,
    manifold_point,
    maximum,
    minimum,
    rise,
)
from rsfstudy.slider import (
    RUPTURE_REGIME,
    Point,
    Scene,
    SteadySliding,
    critical_stiffness,
    equations_without_mass,
    growth_rates,
    steady_sliding,
)
from rsfstudy.status import Status

#: Part of the critical stiffness below it, and decay per slip in D_c, that no motion can tell from
#: none.
_NEUTRAL_TOLERANCE = 1e-9
#: Swings this small follow linear theory.
_MAX_LINEAR_AMPLITUDE = 0.05
#: Factor from one orbit to the next larger one when growth is slow; limit cycles closer together
#: than that may be leapt over. Leaps are shortened where they would land beyond the norm.
_LEAP_FACTOR, _MIN_LEAP_FACTOR = 1.3, 1.002

#: Peaks in a row that must be the same for a cycle of several states to repeat: next to a cycle
#: that motions leave, they would not stay.
_REQUIRED_REPEATS = 4
#: How much higher in ln V a motion is taken to rise that is followed up to the norm only.
_OVERSHOOT_BEYOND_NORM = 1.0
#: Part of the farthest distance from steady sliding at which a motion has come to it.
_STEADY_FRACTION = 1e-3

_PEAK_EVENT = maximum("log_slip_rate")


@dataclass(frozen=True)
class _SteadySliding(SteadySliding):
    """Steady sliding at the load point velocity, and the margin of its stability.

    It is neutral at constant normal stress and critical stiffness: every orbit then closes (Gu et
    al. 1984 for the slip law, Ranjith and Rice 1999 for the slowness law), and only numerical
    errors would make peaks grow.
    """

    stability_margin: float

    @property
    def is_stable(self) -> bool:
        return self.stability_margin >= -_NEUTRAL_TOLERANCE


@dataclass(frozen=True)
class _Orbit:
    """One orbit: its peaks of ln V, whether it reached the norm, where it grows too slowly to
    follow, and ln V at its beginning where it slows down from there.
    """

    peaks: tuple[float, ...]
    reached_norm: bool
    slow_growth_point: Point | None = None
    initial_log_slip_rate: float = -math.inf


def reaches_norm(scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> bool:
    """True if the slip rate reaches the norm after the step (see `excess_over_norm`)."""
    return excess_over_norm(scene, accuracy, meter) >= 0.0


def excess_over_norm(scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> float:
    """Excess of the motion after the step, which is followed until it is certain whether its slip
    rate reaches the instability norm: negative where it does not.

    It is continuous across the boundary as far as the motion allows: the distance of the peak of ln
    V from the norm where mass acts, the growth from one peak to the next where it does not.

    Without mass the motion is planar and autonomous: paths cannot cross, so a peak no higher than
    the one before means that none will ever be higher, and peaks that grow go on growing until they
    reach the norm or a limit cycle. To see which without following a thousand orbits, the motion
    leaps to a somewhat larger one: if that grows too, and so on up to the norm, so does the orbit
    inside it. With mass, which acts during ruptures only, the same rules serve; with several states
    only the norm, steady sliding itself or a cycle that repeats ends a motion. For load points that
    are held see `held`.

    Raises
    ------
    MotionStopped
        With `no_steady_state` where the load point velocity has none, or as `motion` does.
    """
    if scene.log_load_velocity == -math.inf:
        return peak_excess(scene, accuracy, meter)
    steady = _steady_sliding(scene)
    norm, heavy = scene.log_instability_rate, inertia_matters(scene, accuracy)
    if may_have_closed_orbits(scene) and abs(steady.stability_margin) < accuracy.rtol:
        top = _max_of_closed_orbit(scene, accuracy, meter)
        if not heavy or top < min(norm, -math.log(scene.inertial_time) - 7.0):
            return top - norm
    first = _follow_orbit(scene, steady, None, accuracy, meter, with_inertia=heavy)
    reached = first.reached_norm
    if first.slow_growth_point is not None:
        at = first.slow_growth_point
        reached = _grows_to_norm(scene, steady, at, accuracy, meter, with_inertia=heavy)
    excess = _compute_excess(first, norm, with_inertia=heavy)
    return max(excess, 1e-12) if reached else min(excess, -1e-12)


def has_frictional_damping_only(scene: Scene) -> bool:
    """True if effective normal stress is constant once the loading has changed it, and only
    friction damps.
    """
    varies = scene.parts.normal_stress.depends_on_shear_stress or scene.parts.fluid.effects
    return not varies and not scene.dynamics.radiated_stress_slope(0.0)


def may_have_closed_orbits(scene: Scene) -> bool:
    """True if every orbit closes at critical stiffness."""
    law = scene.parts.law
    return (
        law.has_closed_orbits and not law.depends_on_stress and has_frictional_damping_only(scene)
    )


def stiffness_ratio_after_step(scene: Scene) -> float:
    """``k/[k_cr(V_*) sigma/sigma_*]``: stiffness over the critical one at V_* and at the normal
    stress sigma after the step, where friction acts alone: critical stiffness is in proportion to
    normal stress.
    """
    return scene.stiffness_ratio / (1.0 + scene.imposed_normal_stress)


def is_neutral(scene: Scene, tolerance: float) -> bool:
    """True if stiffness is so close to the critical one, both at V_* and at the load point
    velocity, that growth and decay cannot be told apart: by most laws it is critical at every rate
    or at none, where friction acts alone. Where all orbits close at critical stiffness, that is
    known; with the load point held there are none.
    """
    off = abs(stiffness_ratio_after_step(scene) - 1.0)
    known = scene.log_load_velocity == -math.inf or (off == 0.0 and may_have_closed_orbits(scene))
    close = has_frictional_damping_only(scene) and off < tolerance and not known
    return close and abs(stability_margin(scene)) < tolerance


def is_linearly_stable(scene: Scene) -> bool:
    """True if steady sliding at the scene's load point velocity is linearly stable; a held load
    point is.
    """
    return stability_margin(scene) >= -_NEUTRAL_TOLERANCE


def stability_margin(scene: Scene) -> float:
    """``k/k_cr(V_0) - 1``: by how much stiffness exceeds the critical one at the scene's load point
    velocity, over that; infinite where every stiffness is stable. Positive too where several states
    are stable below it, by how far they are below.

    References
    ----------
    Rice and Ruina (1983), J. Appl. Mech. 50, 343-349.
    """
    return (
        math.inf
        if scene.log_load_velocity == -math.inf
        else _steady_sliding(scene).stability_margin
    )


def _max_of_closed_orbit(scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> float:
    """Highest ln V of an orbit that closes: at the nearer of its peaks, before the start or after
    it.

    A motion that starts slowing down comes from its peak; there it is followed against time,
    instead of around an orbit that may lead down to 1e-40 V_* and lose all digits on the way.
    """
    begin = initial_point(scene)
    equations, start = equations_without_mass(scene, clock=False), (begin.spring_stress, begin.psi)
    rising, norm = (
        equations.evaluate_point(start).log_slip_rate_derivative > 0.0,
        scene.log_instability_rate,
    )
    specs = (_PEAK_EVENT, minimum("log_slip_rate"), rise("log_slip_rate", norm))
    for event in events_along(
        equations, start, accuracy.local_tolerance, meter, specs, backward=not rising
    ):
        if event.kind is EventKind.RISE:
            return norm + _OVERSHOOT_BEYOND_NORM
        if (
            event.specification is not None
            or event.point.log_slip_rate >= norm
            or event.point.log_slip_rate_derivative == 0.0
        ):
            return event.point.log_slip_rate
    raise AssertionError("a motion never ends by itself")


def _shrinks_at_norm(scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> bool:
    """True if the orbit that touches the norm peaks lower the next time: paths cannot cross, so
    that none inside of it ever reaches the norm.
    """
    path = CriticalPath.of_scene(scene, meter.engine)
    misfit = path.cycle_misfit(accuracy.local_tolerance, meter)
    return misfit is not None and misfit < -100.0 * accuracy.local_tolerance


def _grows_to_norm(
    scene: Scene,
    steady: _SteadySliding,
    start: Point,
    accuracy: Accuracy,
    meter: WorkMeter,
    *,
    with_inertia: bool,
) -> bool:
    """Leap from a slowly growing orbit to larger ones, until one shrinks or grows up to the norm.

    An orbit counts as grown to the norm only if its first peak was below it.
    """
    if not with_inertia and _shrinks_at_norm(scene, accuracy, meter):
        return False
    leap = _LEAP_FACTOR
    while True:
        spring_stress, *psis = (
            rest + leap * (current - rest)
            for rest, current in zip(
                (steady.spring_stress, *steady.psis),
                (start.spring_stress, *start.psis),
                strict=True,
            )
        )
        beyond = manifold_point(scene, spring_stress, tuple(psis))
        orbit = _follow_orbit(scene, steady, beyond, accuracy, meter, with_inertia=with_inertia)
        if orbit.reached_norm and len(orbit.peaks) == 1 and leap > _MIN_LEAP_FACTOR:
            leap = math.sqrt(leap)
        elif orbit.slow_growth_point is None:
            return orbit.reached_norm
        else:
            start = orbit.slow_growth_point


def _follow_orbit(
    scene: Scene,
    steady: _SteadySliding,
    start: Point | None,
    accuracy: Accuracy,
    meter: WorkMeter,
    *,
    with_inertia: bool,
) -> _Orbit:
    """Follow one orbit until it is certain how it goes on, or found to grow too slowly to
    follow.
    """
    norm = scene.log_instability_rate
    specs = [_PEAK_EVENT] if with_inertia else [_PEAK_EVENT, rise("log_slip_rate", norm)]
    levels = monotone_rise_events(scene) if steady.is_stable else []
    specs += [approach_to_steady_state(_STEADY_FRACTION), *levels] if steady.is_stable else []
    planar, repeating = scene.state_count == 1, _RepetitionDetector(scene, steady, accuracy)
    peaks: list[float] = []
    at_start = -math.inf
    for event in integrate_events(scene, accuracy, meter, specs, start=start):
        top = event.point.log_slip_rate
        if event.kind is EventKind.START:
            if start is None and event.point.log_slip_rate_derivative <= 0.0:
                # no peak of an orbit to compare others with
                at_start = top
                if top >= norm:
                    return _Orbit((), reached_norm=True, initial_log_slip_rate=top)
            elif top >= norm and not with_inertia:
                return _Orbit((top,), reached_norm=True)
        elif event.specification in levels:
            if rises_monotonically(scene, event.point):
                return _Orbit(tuple(peaks), reached_norm=False, initial_log_slip_rate=at_start)
        elif event.kind is EventKind.RISE:
            return _Orbit((*peaks, norm + _OVERSHOOT_BEYOND_NORM), reached_norm=True)
        elif event.kind is EventKind.SETTLED:
            return _Orbit(tuple(peaks), reached_norm=False, initial_log_slip_rate=at_start)
        elif event.kind is EventKind.MAXIMUM:
            peaks.append(top)
            if top >= norm:
                return _Orbit(tuple(peaks), reached_norm=True)
            if not planar:
                if repeating.update(event.point):
                    return _Orbit(tuple(peaks), reached_norm=False)
                continue
            if len(peaks) > 1 and _has_stopped_growing(peaks, steady, accuracy):
                return _Orbit(tuple(peaks), reached_norm=False)
            slow = len(peaks) > 1 and peaks[-1] - peaks[-2] < 0.2 * (norm - top)
            if slow and not steady.is_stable and event.regime != RUPTURE_REGIME:
                return _Orbit(tuple(peaks), False, event.point)
    raise AssertionError("a motion never ends by itself")


class _RepetitionDetector:
    """True if a motion of several states has come to a cycle that repeats, or as close to rest as
    the tolerance lets it: at some peaks in a row its unknowns are the same, as far as numbers tell.
    Where steady sliding is unstable, and growth too small to be measured, the motion goes on.
    """

    def __init__(self, scene: Scene, steady: _SteadySliding, accuracy: Accuracy) -> None:
        self._steady, self._tolerance = steady, 30.0 * accuracy.local_tolerance * scene.a
        self._previous, self._repeat_count = (math.inf,) * (1 + scene.state_count), 0

    def update(self, peak: Point) -> bool:
        """True if it has at this peak."""
        current = (peak.spring_stress, *peak.psis)
        change = max(abs(x - y) for x, y in zip(current, self._previous, strict=True))
        linear = (
            peak.log_slip_rate - self._steady.log_slip_rate < _MAX_LINEAR_AMPLITUDE
            and not self._steady.is_stable
        )
        self._repeat_count = (
            self._repeat_count + 1 if change < self._tolerance and not linear else 0
        )
        self._previous = current
        return self._repeat_count == _REQUIRED_REPEATS


def _has_stopped_growing(
    peaks: Sequence[float], steady: _SteadySliding, accuracy: Accuracy
) -> bool:
    """True if the last peak is no higher than the one before, as far as numbers tell. Too small to
    be measured, growth has the sign that linear theory gives it.
    """
    slack = 100.0 * accuracy.local_tolerance
    linear = peaks[-1] - steady.log_slip_rate < _MAX_LINEAR_AMPLITUDE and not steady.is_stable
    return peaks[-1] - peaks[-2] <= (-slack if linear else slack)


def _compute_excess(orbit: _Orbit, norm: float, *, with_inertia: bool) -> float:
    """Excess that changes sign at the boundary, as far as this orbit shows it."""
    if with_inertia:
        highest = max((orbit.initial_log_slip_rate, *orbit.peaks))
        return highest - norm if highest > -math.inf else -norm
    if len(orbit.peaks) > 1:
        return orbit.peaks[1] - orbit.peaks[0]
    return orbit.peaks[0] - norm if orbit.peaks else -1.0


def _steady_sliding(scene: Scene) -> _SteadySliding:
    """Compute steady sliding at the load point velocity of the scene.

    Raises
    ------
    MotionStopped
        If there is no steady state.
    """
    load = scene.log_load_velocity
    sliding = steady_sliding(scene, load)
    if sliding is None:
        raise MotionStopped(
            Status.NO_STEADY_STATE,
            f"no steady state exists at V_0/V_* = {math.exp(load):.3g}: phi < atan(mu_ss)",
        )
    law = scene.parts.law
    at_every_rate = may_have_closed_orbits(scene) and law.scale_free and not law.regularised
    if at_every_rate and not scene.has_mass and not scene.parts.loading.unknowns:
        margin = stiffness_ratio_after_step(scene) - 1.0
    else:
        critical = critical_stiffness(scene, load)
        margin = scene.stiffness / critical - 1.0 if critical > 0.0 else math.inf
    if (
        margin < -_NEUTRAL_TOLERANCE
        and scene.state_count > 1
        and _is_stable_to_small_perturbations(scene)
    ):
        margin = -margin
    return _SteadySliding(**vars(sliding), stability_margin=margin)


def _is_stable_to_small_perturbations(scene: Scene) -> bool:
    """True if small changes of steady sliding decay, which those of several states may do below the
    critical stiffness.
    """
    return bool(growth_rates(scene, scene.log_load_velocity)[0].real < -_NEUTRAL_TOLERANCE)
