"""The swings after a step, forward in time: does the slip rate reach the instability norm?"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy import steady_state
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.core.motion import motion
from rsfstudy.core.stepping import Halt, Meter, Step
from rsfstudy.equations import strength_of
from rsfstudy.scene import Scene
from rsfstudy.status import Status

#: Swings this small follow linear theory.
_LINEAR = 0.05
#: Factor from one orbit to the next larger one when growth is slow; limit cycles closer than that
#: may be leapt over.
_LEAP = 1.3


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
    stable: bool
    neutral: bool


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
    steady = _steady(scene, accuracy)
    first, start = _orbit(scene, steady, None, accuracy, meter)
    last = first
    while start is not None:
        start = (
            steady.spring + _LEAP * (start[0] - steady.spring),
            steady.psi + _LEAP * (start[1] - steady.psi),
        )
        last, start = _orbit(scene, steady, start, accuracy, meter)
    if last.reached:
        return Swing(True, max(first.excess, 1e-12))
    return Swing(False, min(first.excess, -1e-12))


def _held(scene: Scene, accuracy: Accuracy, meter: Meter) -> Swing:
    """With the load point at rest: up to the only peak."""
    norm = scene.log_norm_rate
    top = -math.inf
    for step in motion(scene, accuracy, meter):
        top = max(top, _highest(step))
        if step.after.growth < 0.0 or (top >= norm and not scene.inertia):
            break
    return Swing(top >= norm, top - norm if scene.inertia else math.copysign(1.0, top - norm))


def _orbit(
    scene: Scene,
    steady: _Steady,
    start: tuple[float, float] | None,
    accuracy: Accuracy,
    meter: Meter,
) -> tuple[Swing, tuple[float, float] | None]:
    """Follow one orbit; returns how it went and, where it grows too slowly to follow, a point (f,
    Psi) on it.
    """
    norm, slack = scene.log_norm_rate, 100.0 * accuracy.solver
    peaks: list[float] = []
    farthest = 0.0
    for step in motion(scene, accuracy, meter, start=start):
        if step.before.growth > 0.0 >= step.after.growth:
            peak = _highest(step)
            peaks.append(peak)
            if peak >= norm:
                return Swing(True, peak - norm if scene.inertia else _growth(peaks, norm)), None
            if steady.neutral:
                break
            if len(peaks) > 1:
                growth = peak - peaks[-2]
                small = peak - steady.log_rate < _LINEAR
                if growth <= slack and not (small and not steady.stable and growth > -slack):
                    return Swing(False, max(peaks) - norm if scene.inertia else growth), None
                if not steady.stable and growth < 0.2 * (norm - peak):
                    return Swing(False, _growth(peaks, norm)), (step.after.spring, step.after.psi)
        elif step.after.log_rate >= norm and not scene.inertia:
            return Swing(True, _growth(peaks, norm)), None
        away = max(abs(step.after.log_rate - steady.log_rate), abs(step.after.imbalance) / scene.b)
        farthest = max(farthest, away)
        if steady.stable and away < 1e-3 * farthest:
            break
    return Swing(False, max(peaks, default=steady.log_rate) - norm), None


def _highest(step: Step) -> float:
    """Highest ln V within a step."""
    if step.before.growth > 0.0 >= step.after.growth:
        return step.point_at(step.locate(lambda point: point.growth)).log_rate
    return max(step.before.log_rate, step.after.log_rate)


def _growth(peaks: list[float], norm: float) -> float:
    """Growth from the first peak to the next, or to the norm where that comes first."""
    first, second = [*peaks, norm, norm + 1.0][:2]
    return max(second - first, 1e-12)


def _steady(scene: Scene, accuracy: Accuracy) -> _Steady:
    """Steady sliding at the load point velocity of the scene; `Halt` if there is none."""
    load, cot_phi = scene.log_load_rate, scene.cot_phi
    if load <= steady_state.lowest_log_rate(scene.mu_star, scene.a, scene.b, cot_phi):
        raise Halt(
            Status.NO_STEADY_STATE,
            f"no steady state exists at V_0/V_* = {math.exp(load):.3g}: phi < atan(mu_ss)",
        )
    mu_ss = steady_state.steady_friction(load, scene.mu_star, scene.a, scene.b)
    spring = steady_state.steady_shear_stress(mu_ss, scene.mu_star, cot_phi)
    critical = steady_state.critical_stiffness(
        load, scene.mu_star, scene.a, scene.b, cot_phi, scene.alpha or 0.0
    )
    margin = scene.stiffness / critical - 1.0
    return _Steady(
        load,
        spring,
        strength_of(scene)(spring)[0] - scene.a * load,
        stable=margin >= 0.0,
        neutral=cot_phi == 0.0 and abs(margin) < accuracy.rtol,
    )
