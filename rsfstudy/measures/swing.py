"""The swings after a step, forward in time: does the slip rate reach the instability norm?"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from rsfstudy import steady_state
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.core.motion import check_start, motion
from rsfstudy.core.stepping import Halt, Meter, Step, steps
from rsfstudy.effects import radiation_damping
from rsfstudy.equations import radiated, strength_of, without_mass
from rsfstudy.scene import Scene
from rsfstudy.status import Status

#: Swings this small follow linear theory.
_LINEAR = 0.05
#: Factor from one orbit to the next larger one when growth is slow; limit cycles closer together
#: than that may be leapt over. Leaps are shortened where they would land beyond the norm.
_LEAP, _SHORTEST_LEAP = 1.3, 1.002

State = tuple[float, float]


@dataclass(frozen=True)
class Swing:
    """How the motion after a step went.

    Attributes
    ----------
    reached : bool
        Whether the slip rate reaches the instability norm.
    excess : float
        Positive where it does, negative where not; continuous across the boundary as far as the
        motion allows: the peak's distance in ln V from the norm with mass, the growth from one peak
        to the next without.
    """

    reached: bool
    excess: float


@dataclass(frozen=True)
class _Steady:
    """Steady sliding at the load point velocity.

    It is neutral at constant normal stress and critical stiffness: every orbit then closes (Gu et
    al. 1984 for the slip law, Ranjith and Rice 1999 for the slowness law), and only numerical
    errors would make peaks grow.
    """

    log_rate: float
    spring: float
    psi: float
    margin: float

    @property
    def stable(self) -> bool:
        return self.margin >= 0.0


@dataclass(frozen=True)
class _Orbit:
    """One orbit: its peaks of ln V, whether it reached the norm, and where it grows too slowly to
    follow.
    """

    peaks: tuple[float, ...]
    reached: bool
    slow_growth_at: State | None = None


def swing(scene: Scene, accuracy: Accuracy, meter: Meter) -> Swing:
    """Follow the motion after the step until it is certain whether it reaches the instability norm.

    Without mass the motion is planar and autonomous: paths cannot cross, so a peak no higher than
    the one before means that none will ever be higher, and peaks that grow go on growing until they
    reach the norm or a limit cycle. To see which without following a thousand swings, the motion
    leaps to a somewhat larger orbit: if that grows too, and so on up to the norm, so does the orbit
    inside it. With mass, which acts during ruptures only, the same rules serve. Once the load point
    is held, spring stress can only fall, and the first peak is the last.

    Raises
    ------
    Halt
        With `no_steady_state` where the load point velocity has none, or as `motion` does.
    """
    if scene.log_load_rate == -math.inf:
        return _held(scene, accuracy, meter)
    steady = _steady(scene)
    norm = scene.log_norm_rate
    damped = scene.radiation_damping > 0.0
    if scene.normal_stress == "constant" and abs(steady.margin) < accuracy.rtol and not damped:
        top = _top_of_closed_orbit(scene, accuracy, meter)
        if not scene.inertia or top < min(norm, -math.log(scene.inertial_time) - 7.0):
            return Swing(top >= norm, top - norm)
    first = _orbit(scene, steady, None, accuracy, meter)
    reached = first.reached
    if first.slow_growth_at is not None:
        reached = _grows_to_the_norm(scene, steady, first.slow_growth_at, accuracy, meter)
    excess = _excess(first.peaks, norm, with_mass=scene.inertia)
    return Swing(reached, max(excess, 1e-12) if reached else min(excess, -1e-12))


def settles(scene: Scene) -> bool:
    """Whether steady sliding at the scene's load point velocity is linearly stable; a held load
    point is.
    """
    return scene.log_load_rate == -math.inf or _steady(scene).stable


def _held(scene: Scene, accuracy: Accuracy, meter: Meter) -> Swing:
    """With the load point at rest: up to the only peak."""
    norm = scene.log_norm_rate
    top = -math.inf
    for step in motion(scene, accuracy, meter):
        top = max(top, _highest(step))
        if step.after.growth < 0.0 or (top >= norm and not scene.inertia):
            break
    return Swing(top >= norm, top - norm if scene.inertia else math.copysign(1.0, top - norm))


def _top_of_closed_orbit(scene: Scene, accuracy: Accuracy, meter: Meter) -> float:
    """Highest ln V of an orbit that closes: at the nearer of its peaks, before the start or after
    it.

    A motion that starts slowing down comes from its peak; there it is followed against time,
    instead of around an orbit that may lead down to 1e-40 V_* and lose all digits on the way.
    """
    check_start(scene)
    equations, start = without_mass(scene, clock=False), (scene.spring_stress_step, 0.0)
    rising = equations.point(start, equations.rate(0.0, start)).growth > 0.0
    path = steps(equations, start, accuracy.solver, meter, backward=not rising)
    return _first_peak(path, scene.log_norm_rate)


def _first_peak(path: Iterable[Step], enough: float) -> float:
    for step in path:
        if step.before.growth * step.after.growth <= 0.0:
            return step.point_at(step.locate(lambda point: point.growth)).log_rate
        if step.after.log_rate >= enough:
            return step.after.log_rate
    raise AssertionError("steps() never ends by itself")


def _grows_to_the_norm(
    scene: Scene, steady: _Steady, at: State, accuracy: Accuracy, meter: Meter
) -> bool:
    """Leap from a slowly growing orbit to larger ones, until one shrinks or grows up to the norm.

    An orbit counts as grown to the norm only if its first peak was below it.
    """
    leap = _LEAP
    while True:
        beyond = (
            steady.spring + leap * (at[0] - steady.spring),
            steady.psi + leap * (at[1] - steady.psi),
        )
        orbit = _orbit(scene, steady, beyond, accuracy, meter)
        if orbit.reached and len(orbit.peaks) == 1 and leap > _SHORTEST_LEAP:
            leap = math.sqrt(leap)
        elif orbit.slow_growth_at is None:
            return orbit.reached
        else:
            at = orbit.slow_growth_at


def _orbit(
    scene: Scene, steady: _Steady, start: State | None, accuracy: Accuracy, meter: Meter
) -> _Orbit:
    """Follow one orbit until it is certain how it goes on, or found to grow too slowly to
    follow.
    """
    norm, slack = scene.log_norm_rate, 100.0 * accuracy.solver
    peaks: list[float] = []
    farthest = 0.0
    for step in motion(scene, accuracy, meter, start=start):
        if step.before.growth > 0.0 >= step.after.growth:
            peaks.append(_highest(step))
            if peaks[-1] >= norm:
                return _Orbit(tuple(peaks), reached=True)
            if len(peaks) > 1:
                growth = peaks[-1] - peaks[-2]
                # too small to be measured, growth has the sign that linear theory gives it
                linear = peaks[-1] - steady.log_rate < _LINEAR and not steady.stable
                if growth <= (-slack if linear else slack):
                    return _Orbit(tuple(peaks), reached=False)
                slow = growth < 0.2 * (norm - peaks[-1])
                if slow and not steady.stable and step.equations.regime != "inertial":
                    return _Orbit(tuple(peaks), False, (step.after.spring, step.after.psi))
        elif step.after.log_rate >= norm and not scene.inertia:
            return _Orbit((*peaks, step.after.log_rate), reached=True)
        away = max(abs(step.after.log_rate - steady.log_rate), abs(step.after.imbalance) / scene.b)
        farthest = max(farthest, away)
        if steady.stable and away < 1e-3 * farthest:
            return _Orbit(tuple(peaks), reached=False)
    raise AssertionError("a motion never ends by itself")


def _highest(step: Step) -> float:
    """Highest ln V within a step."""
    if step.before.growth > 0.0 >= step.after.growth:
        return step.point_at(step.locate(lambda point: point.growth)).log_rate
    return max(step.before.log_rate, step.after.log_rate)


def _excess(peaks: tuple[float, ...], norm: float, *, with_mass: bool) -> float:
    """What changes sign at the boundary, as far as these peaks show it."""
    if with_mass:
        return max(peaks, default=-math.inf) - norm if peaks else -norm
    if len(peaks) > 1:
        return peaks[1] - peaks[0]
    return peaks[0] - norm if peaks else -1.0


def _steady(scene: Scene) -> _Steady:
    """Steady sliding at the load point velocity of the scene; `Halt` if there is none."""
    load, cot_phi = scene.log_load_rate, scene.cot_phi
    if load <= steady_state.lowest_log_rate(scene.mu_star, scene.a, scene.b, cot_phi):
        raise Halt(
            Status.NO_STEADY_STATE,
            f"no steady state exists at V_0/V_* = {math.exp(load):.3g}: phi < atan(mu_ss)",
        )
    mu_ss = steady_state.steady_friction(load, scene.mu_star, scene.a, scene.b)
    friction = steady_state.steady_shear_stress(mu_ss, scene.mu_star, cot_phi)
    critical = steady_state.critical_stiffness(
        load, scene.mu_star, scene.a, scene.b, cot_phi, scene.alpha or 0.0
    )
    critical = radiation_damping.critical_stiffness(
        critical, scene.radiation_damping * math.exp(load), mu_ss, scene.alpha or 0.0, cot_phi
    )
    return _Steady(
        load,
        friction + radiated(scene, load),
        strength_of(scene)(friction)[0] - scene.a * load,
        scene.stiffness / critical - 1.0 if critical > 0.0 else math.inf,
    )
