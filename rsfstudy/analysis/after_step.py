"""The motion after a step and its outcome: does the slip rate reach the instability norm?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rsfstudy.analysis.critical_path import CriticalPath
from rsfstudy.analysis.held import excess_of_peak
from rsfstudy.analysis.overdamped import levels_of_rise, rises_to_load_point
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import along, follow
from rsfstudy.motion.events import Kind, maximum, minimum, rise, settling
from rsfstudy.motion.handover import mass_acts
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.starting import on_slow_manifold, starting
from rsfstudy.slider import stability, steady
from rsfstudy.slider.equations import IN_RUPTURE, without_mass
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Part of the critical stiffness below it, and decay per slip in D_c, that no motion can tell from
#: none.
_NEUTRAL = 1e-9
#: Swings this small follow linear theory.
_LINEAR = 0.05
#: Factor from one orbit to the next larger one when growth is slow; limit cycles closer together
#: than that may be leapt over. Leaps are shortened where they would land beyond the norm.
_LEAP, _SHORTEST_LEAP = 1.3, 1.002

#: Peaks in a row that must be the same for a cycle of several states to repeat: next to a cycle
#: that motions leave, they would not stay.
_IN_A_ROW = 4
#: How much higher in ln V a motion is taken to rise that is followed up to the norm only.
_HIGHER = 1.0
#: Part of the farthest distance from steady sliding at which a motion has come to it.
_CLOSE = 1e-3

_TOP = maximum("log_slip_rate")


@dataclass(frozen=True)
class _Steady(steady.Steady):
    """Steady sliding at the load point velocity, and the margin of its stability.

    It is neutral at constant normal stress and critical stiffness: every orbit then closes (Gu et
    al. 1984 for the slip law, Ranjith and Rice 1999 for the slowness law), and only numerical
    errors would make peaks grow.
    """

    margin: float

    @property
    def stable(self) -> bool:
        return self.margin >= -_NEUTRAL


@dataclass(frozen=True)
class _Orbit:
    """One orbit: its peaks of ln V, whether it reached the norm, where it grows too slowly to
    follow, and ln V at its beginning where it slows down from there.
    """

    peaks: tuple[float, ...]
    reached: bool
    slow_growth_at: Point | None = None
    top_at_start: float = -math.inf


def reaches_norm(scene: Scene, accuracy: Accuracy, meter: Meter) -> bool:
    """True if the slip rate reaches the norm after the step (see `excess_over_norm`)."""
    return excess_over_norm(scene, accuracy, meter) >= 0.0


def excess_over_norm(scene: Scene, accuracy: Accuracy, meter: Meter) -> float:
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
    Halt
        With `no_steady_state` where the load point velocity has none, or as `motion` does.
    """
    if scene.log_load_rate == -math.inf:
        return excess_of_peak(scene, accuracy, meter)
    steady = _steady(scene)
    norm, heavy = scene.log_norm_rate, mass_acts(scene, accuracy)
    if orbits_may_close(scene) and abs(steady.margin) < accuracy.rtol:
        top = _top_of_closed_orbit(scene, accuracy, meter)
        if not heavy or top < min(norm, -math.log(scene.inertial_time) - 7.0):
            return top - norm
    first = _orbit(scene, steady, None, accuracy, meter, heavy=heavy)
    reached = first.reached
    if first.slow_growth_at is not None:
        at = first.slow_growth_at
        reached = _grows_to_the_norm(scene, steady, at, accuracy, meter, heavy=heavy)
    excess = _excess(first, norm, heavy=heavy)
    return max(excess, 1e-12) if reached else min(excess, -1e-12)


def friction_acts_alone(scene: Scene) -> bool:
    """True if effective normal stress is constant once the loading has changed it, and only
    friction damps.
    """
    varies = scene.parts.normal_stress.follows_friction or scene.parts.fluid.effects
    return not varies and not scene.dynamics.damping(0.0)


def orbits_may_close(scene: Scene) -> bool:
    """True if every orbit closes at critical stiffness."""
    law = scene.parts.law
    return law.orbits_close and not law.feels_stress and friction_acts_alone(scene)


def ratio_after(scene: Scene) -> float:
    """``k/[k_cr(V_*) sigma/sigma_*]``: stiffness over the critical one at V_* and at the normal
    stress sigma after the step, where friction acts alone: critical stiffness is in proportion to
    normal stress.
    """
    return scene.stiffness_ratio / (1.0 + scene.imposed_normal_stress)


def neutral(scene: Scene, within: float) -> bool:
    """True if stiffness is so close to the critical one, both at V_* and at the load point
    velocity, that growth and decay cannot be told apart: by most laws it is critical at every rate
    or at none, where friction acts alone. Where all orbits close at critical stiffness, that is
    known; with the load point held there are none.
    """
    off = abs(ratio_after(scene) - 1.0)
    known = scene.log_load_rate == -math.inf or (off == 0.0 and orbits_may_close(scene))
    close = friction_acts_alone(scene) and off < within and not known
    return close and abs(stability_margin(scene)) < within


def settles(scene: Scene) -> bool:
    """True if steady sliding at the scene's load point velocity is linearly stable; a held load
    point is.
    """
    return stability_margin(scene) >= -_NEUTRAL


def stability_margin(scene: Scene) -> float:
    """``k/k_cr(V_0) - 1``: by how much stiffness exceeds the critical one at the scene's load point
    velocity, over that; infinite where every stiffness is stable. Positive too where several states
    are stable below it, by how far they are below.

    References
    ----------
    Rice and Ruina (1983), J. Appl. Mech. 50, 343-349.
    """
    return math.inf if scene.log_load_rate == -math.inf else _steady(scene).margin


def _top_of_closed_orbit(scene: Scene, accuracy: Accuracy, meter: Meter) -> float:
    """Highest ln V of an orbit that closes: at the nearer of its peaks, before the start or after
    it.

    A motion that starts slowing down comes from its peak; there it is followed against time,
    instead of around an orbit that may lead down to 1e-40 V_* and lose all digits on the way.
    """
    begin = starting(scene)
    equations, start = without_mass(scene, clock=False), (begin.spring_stress, begin.psi)
    rising, norm = equations.at(start).growth > 0.0, scene.log_norm_rate
    specs = (_TOP, minimum("log_slip_rate"), rise("log_slip_rate", norm))
    for event in along(equations, start, accuracy.solver, meter, specs, backward=not rising):
        if event.kind is Kind.RISE:
            return norm + _HIGHER
        if (
            event.watch is not None
            or event.point.log_slip_rate >= norm
            or event.point.growth == 0.0
        ):
            return event.point.log_slip_rate
    raise AssertionError("a motion never ends by itself")


def _shrinks_at_the_norm(scene: Scene, accuracy: Accuracy, meter: Meter) -> bool:
    """True if the orbit that touches the norm peaks lower the next time: paths cannot cross, so
    that none inside of it ever reaches the norm.
    """
    path = CriticalPath.of(scene, meter.engine)
    misfit = path.misfit_of_cycle(accuracy.solver, meter)
    return misfit is not None and misfit < -100.0 * accuracy.solver


def _grows_to_the_norm(
    scene: Scene, steady: _Steady, at: Point, accuracy: Accuracy, meter: Meter, *, heavy: bool
) -> bool:
    """Leap from a slowly growing orbit to larger ones, until one shrinks or grows up to the norm.

    An orbit counts as grown to the norm only if its first peak was below it.
    """
    if not heavy and _shrinks_at_the_norm(scene, accuracy, meter):
        return False
    leap = _LEAP
    while True:
        spring_stress, *psis = (
            rest + leap * (current - rest)
            for rest, current in zip(
                (steady.spring_stress, *steady.psis), (at.spring_stress, *at.psis), strict=True
            )
        )
        beyond = on_slow_manifold(scene, spring_stress, tuple(psis))
        orbit = _orbit(scene, steady, beyond, accuracy, meter, heavy=heavy)
        if orbit.reached and len(orbit.peaks) == 1 and leap > _SHORTEST_LEAP:
            leap = math.sqrt(leap)
        elif orbit.slow_growth_at is None:
            return orbit.reached
        else:
            at = orbit.slow_growth_at


def _orbit(
    scene: Scene,
    steady: _Steady,
    start: Point | None,
    accuracy: Accuracy,
    meter: Meter,
    *,
    heavy: bool,
) -> _Orbit:
    """Follow one orbit until it is certain how it goes on, or found to grow too slowly to
    follow.
    """
    norm = scene.log_norm_rate
    specs = [_TOP] if heavy else [_TOP, rise("log_slip_rate", norm)]
    levels = levels_of_rise(scene) if steady.stable else []
    specs += [settling(_CLOSE), *levels] if steady.stable else []
    planar, repeating = scene.states == 1, _Repeating(scene, steady, accuracy)
    peaks: list[float] = []
    at_start = -math.inf
    for event in follow(scene, accuracy, meter, specs, start=start):
        top = event.point.log_slip_rate
        if event.kind is Kind.START:
            if start is None and event.point.growth <= 0.0:
                # no peak of an orbit to compare others with
                at_start = top
                if top >= norm:
                    return _Orbit((), reached=True, top_at_start=top)
            elif top >= norm and not heavy:
                return _Orbit((top,), reached=True)
        elif event.watch in levels:
            if rises_to_load_point(scene, event.point):
                return _Orbit(tuple(peaks), reached=False, top_at_start=at_start)
        elif event.kind is Kind.RISE:
            return _Orbit((*peaks, norm + _HIGHER), reached=True)
        elif event.kind is Kind.SETTLED:
            return _Orbit(tuple(peaks), reached=False, top_at_start=at_start)
        elif event.kind is Kind.MAXIMUM:
            peaks.append(top)
            if top >= norm:
                return _Orbit(tuple(peaks), reached=True)
            if not planar:
                if repeating.has(event.point):
                    return _Orbit(tuple(peaks), reached=False)
                continue
            if len(peaks) > 1 and _stops_growing(peaks, steady, accuracy):
                return _Orbit(tuple(peaks), reached=False)
            slow = len(peaks) > 1 and peaks[-1] - peaks[-2] < 0.2 * (norm - top)
            if slow and not steady.stable and event.regime != IN_RUPTURE:
                return _Orbit(tuple(peaks), False, event.point)
    raise AssertionError("a motion never ends by itself")


class _Repeating:
    """True if a motion of several states has come to a cycle that repeats, or as close to rest as
    the tolerance lets it: at some peaks in a row its unknowns are the same, as far as numbers tell.
    Where steady sliding is unstable, and growth too small to be measured, the motion goes on.
    """

    def __init__(self, scene: Scene, steady: _Steady, accuracy: Accuracy) -> None:
        self._steady, self._slack = steady, 30.0 * accuracy.solver * scene.a
        self._before, self._same = (math.inf,) * (1 + scene.states), 0

    def has(self, peak: Point) -> bool:
        """True if it has at this peak."""
        current = (peak.spring_stress, *peak.psis)
        change = max(abs(x - y) for x, y in zip(current, self._before, strict=True))
        linear = (
            peak.log_slip_rate - self._steady.log_slip_rate < _LINEAR and not self._steady.stable
        )
        self._same = self._same + 1 if change < self._slack and not linear else 0
        self._before = current
        return self._same == _IN_A_ROW


def _stops_growing(peaks: Sequence[float], steady: _Steady, accuracy: Accuracy) -> bool:
    """True if the last peak is no higher than the one before, as far as numbers tell. Too small to
    be measured, growth has the sign that linear theory gives it.
    """
    slack = 100.0 * accuracy.solver
    linear = peaks[-1] - steady.log_slip_rate < _LINEAR and not steady.stable
    return peaks[-1] - peaks[-2] <= (-slack if linear else slack)


def _excess(orbit: _Orbit, norm: float, *, heavy: bool) -> float:
    """Excess that changes sign at the boundary, as far as this orbit shows it."""
    if heavy:
        highest = max((orbit.top_at_start, *orbit.peaks))
        return highest - norm if highest > -math.inf else -norm
    if len(orbit.peaks) > 1:
        return orbit.peaks[1] - orbit.peaks[0]
    return orbit.peaks[0] - norm if orbit.peaks else -1.0


def _steady(scene: Scene) -> _Steady:
    """Steady sliding at the load point velocity of the scene; `Halt` if there is none."""
    load = scene.log_load_rate
    sliding = steady.steady_sliding(scene, load)
    if sliding is None:
        raise Halt(
            Status.NO_STEADY_STATE,
            f"no steady state exists at V_0/V_* = {math.exp(load):.3g}: phi < atan(mu_ss)",
        )
    law = scene.parts.law
    at_every_rate = orbits_may_close(scene) and law.scale_free and not law.regularised
    if at_every_rate and not scene.has_mass and not scene.parts.loading.unknowns:
        margin = ratio_after(scene) - 1.0
    else:
        critical = stability.critical_stiffness(scene, load)
        margin = scene.stiffness / critical - 1.0 if critical > 0.0 else math.inf
    if margin < -_NEUTRAL and scene.states > 1 and _decays(scene):
        margin = -margin
    return _Steady(**vars(sliding), margin=margin)


def _decays(scene: Scene) -> bool:
    """True if small changes of steady sliding decay, which those of several states may do below the
    critical stiffness.
    """
    return bool(stability.growth_rates(scene, scene.log_load_rate)[0].real < -_NEUTRAL)
