"""The critical path, followed back from where it touches the instability norm.

At the touching point ln V is at the norm and stationary, which leaves one scalar equation for the
stress. From there the path is integrated against time. Its neighbours converge on it in that
direction, so a few short integrations of moderate tolerance give many digits, where following
motions forward would amplify every error.

Two unknowns suffice as long as the norm is a slip rate at which mass hardly acts; it does not act
at all where ln V is stationary.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache

from rsfstudy.motion.course import along
from rsfstudy.motion.engines import SCIPY, of_floats
from rsfstudy.motion.events import Event, EventSpecification, Kind, fall, maximum, rise
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.regimes import on_slow_manifold
from rsfstudy.motion.roots import root_of
from rsfstudy.slider.equations import between_ruptures
from rsfstudy.slider.friction import Friction
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.places import LOG_LOAD_RATE, STIFFNESS, A, B
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene

#: Right-hand sides, at a tolerance of 1e-5, after which a path that has not come back to a start is
#: given up.
_PATH_BUDGET = 1_500
_SLOWEST = -230.0  # ln(V/V_*): 10^-100
#: How far above the norm in ln V a path is that touches it from there.
_ABOVE = 1e-6


def touching_point(scene: Scene, engine: str = SCIPY) -> tuple[float, float] | None:
    """Spring stress and state (f, Psi) at which ln V rests at the instability norm; None where it
    never can, or where there are several states and the path is none in a plane.
    """
    if scene.states > 1:
        return None
    x, weakest = scene.log_norm_rate, scene.parts.normal_stress.weakest(scene)
    given = x, (1.0 - 1e-6) * weakest, scene.numbers
    g, psi = of_floats(_tangency(scene.functions.friction), engine, *given)(*given)
    return None if math.isnan(g) else (g + scene.dynamics.radiated(x), psi)


@cache
def _tangency(friction: Friction) -> Function:
    """``(x, weakest, p) -> (g, Psi)``: frictional stress above the weakest, and the state, where
    ln(V/V_*) = x is stationary; NaN where it never is.

    There, strength'(g) K (V_0/V - 1) equals the evolution of the state per unit slip.
    """
    strength, evolutions = friction.strength, friction.evolutions

    def acceleration(g: float, at: tuple[float, Numbers]) -> float:
        x, p = at
        value, slope, shift, _shift_slope = strength(g, (0.0,), p)
        pull = p[STIFFNESS] * math.expm1(p[LOG_LOAD_RATE] - x)
        (change,) = evolutions(x, (value - shift - p[A] * x,), 0.0, 1.0, p)
        return float(slope * pull - change)

    root = root_of(acceleration)

    def tangency(x: float, weakest: float, p: Numbers) -> tuple[float, float]:
        at = x, p
        highest = 2.0 * p[B] * abs(x) + p[STIFFNESS] * max(1.0, strength(0.0, (0.0,), p)[1])
        lowest = max(-highest, weakest)
        if acceleration(lowest, at) >= 0.0 and math.isfinite(weakest):
            # where normal stress all but follows shear stress, the law asks for more than its own
            # fall
            lowest = weakest
        at_lowest, at_highest = acceleration(lowest, at), acceleration(highest, at)
        if not at_lowest < 0.0 < at_highest:
            return math.nan, math.nan
        g = root(lowest, highest, at_lowest, at_highest, 1e-18, 1e-14, at)
        return g, strength(g, (0.0,), p)[0] - p[A] * x

    return tangency


def start_of_path(
    scene: Scene,
    tolerance: float,
    meter: Meter,
    crossing: tuple[str, float],
    accepts: Callable[[Point], bool],
) -> Point | None:
    """Follow the critical path back to a start.

    Parameters
    ----------
    scene : Scene
    tolerance : float
        Local error per step.
    meter : Meter
        Charged with the work.
    crossing : tuple of str and float
        Quantity and level that a start is at.
    accepts : callable
        Whether a point there is a start of the kind sought.

    Returns
    -------
    Point or None
        None where the path touches the norm from above or never comes by.
    """
    above = rise("log_slip_rate", scene.log_norm_rate + _ABOVE, ends=True, waits=True)
    lost = fall("log_slip_rate", _SLOWEST, ends=True, waits=True)
    watches = (above, lost, rise(*crossing), fall(*crossing))
    for event in _path(scene, tolerance, meter, watches, backward=True):
        if event.watch in watches[2:] and accepts(event.point):
            return event.point
    return None


def _path(
    scene: Scene,
    tolerance: float,
    meter: Meter,
    watches: Sequence[EventSpecification],
    *,
    backward: bool,
) -> Iterator[Event]:
    """The path from where it touches the norm, as far as there is one; by a method of order eight,
    which gets no more than what is left.
    """
    start = touching_point(scene, meter.engine)
    if start is None:
        return
    enough = round(_PATH_BUDGET * math.pow(1e-5 / tolerance, 0.125))
    path = Meter(min(enough, meter.budget - meter.spent), meter.methods, meter.engine)
    equations = between_ruptures(scene, clock=False)
    try:
        yield from along(equations, start, tolerance, path, watches, backward=backward)
    except Halt:
        return
    finally:
        for regime, spent in path.by_regime.items():
            meter.charge(regime, spent)


def rate_step_misfit(scene: Scene, tolerance: float, meter: Meter) -> float | None:
    """State on the critical path where it passes the slip rate of the start, over a; zero for the
    critical V_0.

    None where the path never passes that slip rate as the motion of this scene would.
    """
    psis = (0.0,) * scene.states
    begin = on_slow_manifold(scene, scene.spring_stress_step, psis, meter.engine)
    if begin.growth == 0.0:
        return None
    start = start_of_path(
        scene,
        tolerance,
        meter,
        ("log_slip_rate", begin.log_slip_rate),
        lambda point: point.growth * begin.growth > 0.0,
    )
    return None if start is None else start.psi / scene.a


def cycle_misfit(scene: Scene, tolerance: float, meter: Meter) -> float | None:
    """Height in ln V above the norm of the peak of the motion one orbit after it has touched the
    norm; zero where a limit cycle touches it.

    None where the motion does not come back.
    """
    for event in _coming_back(scene, tolerance, meter):
        if event.kind is Kind.MAXIMUM:
            return event.point.log_slip_rate - scene.log_norm_rate
    return None


def _coming_back(
    scene: Scene, tolerance: float, meter: Meter, *watches: EventSpecification
) -> Iterator[Event]:
    """Events, peaks among them, of the motion that has touched the norm and fallen below V_0."""
    fallen = False
    asked = (
        *watches,
        maximum("log_slip_rate"),
        fall("log_slip_rate", scene.log_load_rate, waits=True),
    )
    for event in _path(scene, tolerance, meter, asked, backward=False):
        if fallen:
            yield event
        fallen = fallen or event.kind is Kind.FALL


def goes_beyond(scene: Scene, tolerance: float, meter: Meter) -> bool:
    """True if the motion that touches the norm goes beyond it when it comes back, so that others
    may reach it by their second peak; by laws whose orbits close at critical stiffness none does.
    """
    if scene.parts.law.orbits_close or scene.log_load_rate == -math.inf:
        return False
    beyond = rise("log_slip_rate", scene.log_norm_rate + _ABOVE)
    for event in _coming_back(scene, tolerance, meter, beyond):
        if event.kind in (Kind.RISE, Kind.MAXIMUM):
            # a step may pass the norm and come back
            return event.kind is Kind.RISE or event.point.log_slip_rate > scene.log_norm_rate
    return False


def displacement_on_path(scene: Scene, tolerance: float, meter: Meter, sign: int) -> float | None:
    """Displacement step of this sign, in D_c, that puts the slider on the critical path.

    A displacement step leaves Psi = 0 and moves the spring stress alone, so the path's point with
    Psi = 0 is its start.
    """
    start = start_of_path(
        scene, tolerance, meter, ("psi", 0.0), lambda point: sign * point.spring_stress > 0.0
    )
    return None if start is None else start.spring_stress / scene.stiffness
