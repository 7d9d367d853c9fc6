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
from collections.abc import Callable

from scipy.optimize import brentq

from rsfstudy.motion.stepping import Halt, Meter, Step, steps
from rsfstudy.slider.equations import between_ruptures, evolution_of, log_rate_at, relation_of
from rsfstudy.slider.forms import Point
from rsfstudy.slider.scene import Scene

#: Right-hand sides, at a tolerance of 1e-5, after which a path that has not come back to a start is
#: given up.
_PATH_BUDGET = 1_500
_SLOWEST = -230.0  # ln(V/V_*): 10^-100


def touching_point(scene: Scene) -> tuple[float, float] | None:
    """Spring stress and state (f, Psi) at which ln V rests at the instability norm; None where it
    never can.

    There, strength'(f) K (V_0/V - 1) equals the evolution of the state per unit slip.
    """
    relation, evolution = relation_of(scene), evolution_of(scene)
    a, x = scene.a, scene.log_norm_rate
    pull = scene.stiffness * math.expm1(scene.log_load_rate - x)

    def acceleration(friction: float) -> float:
        value, slope, shift, _shift_slope = relation(friction)
        return slope * pull - evolution(x, value - shift - a * x)

    reach = 2.0 * scene.b * abs(x) + scene.stiffness
    lowest = max(-reach, (1.0 - 1e-6) * scene.parts.normal_stress.weakest(scene))
    if acceleration(lowest) >= 0.0 or acceleration(reach) <= 0.0:
        return None
    friction = float(brentq(acceleration, lowest, reach, xtol=1e-18, rtol=1e-14))
    return friction + scene.dynamics.radiated(x), relation(friction)[0] - a * x


def start_of_path(
    scene: Scene,
    tolerance: float,
    meter: Meter,
    crosses: Callable[[Point], float],
    accepts: Callable[[Point], bool],
) -> Point | None:
    """Follow the critical path back to where ``crosses`` vanishes.

    Parameters
    ----------
    scene : Scene
    tolerance : float
        Local error per step.
    meter : Meter
        Charged with the work.
    crosses : callable
        Function of the point that vanishes at the start.
    accepts : callable
        Whether a point where it vanishes is a start of the kind sought.

    Returns
    -------
    Point or None
        None where the path touches the norm from above or never comes by.
    """
    start = touching_point(scene)
    if start is None:
        return None
    path = _path_meter(tolerance, meter)
    try:
        backward = steps(
            between_ruptures(scene, clock=False), start, tolerance, path, backward=True
        )
        for number, step in enumerate(backward):
            if number == 0 and step.after.log_rate > step.before.log_rate:
                return None
            if step.after.log_rate < _SLOWEST:
                return None
            found = _crossing(step, crosses)
            if found is not None and accepts(found):
                return found
    except Halt:
        return None
    finally:
        for regime, spent in path.by_regime.items():
            meter.charge(regime, spent)
    raise AssertionError("steps() never ends by itself")


def _path_meter(tolerance: float, meter: Meter) -> Meter:
    """A meter for one path by a method of order eight, which gets no more than what is left."""
    enough = round(_PATH_BUDGET * math.pow(1e-5 / tolerance, 0.125))
    return Meter(min(enough, meter.budget - meter.spent), meter.methods)


def _crossing(step: Step, crosses: Callable[[Point], float]) -> Point | None:
    if crosses(step.before) * crosses(step.after) > 0.0:
        return None
    return step.point_at(step.locate(crosses))


def rate_step_misfit(scene: Scene, tolerance: float, meter: Meter) -> float | None:
    """State on the critical path where it passes the slip rate of the start, over a; zero for the
    critical V_0.

    None where the path never passes that slip rate as the motion of this scene would.
    """
    spring = scene.spring_stress_step
    begin = log_rate_at(scene, spring, 0.0)
    rates = between_ruptures(scene, clock=False)
    growth = rates.at((spring, 0.0)).growth
    if growth == 0.0:
        return None
    found = start_of_path(
        scene,
        tolerance,
        meter,
        lambda point: log_rate_at(scene, point.spring, point.psi) - begin,
        lambda point: point.growth * growth > 0.0,
    )
    return None if found is None else found.psi / scene.a


def cycle_misfit(scene: Scene, tolerance: float, meter: Meter) -> float | None:
    """How much higher in ln V than the norm the motion peaks one orbit after it has touched the
    norm; zero where a limit cycle touches it.

    None where the motion does not come back.
    """
    start = touching_point(scene)
    if start is None:
        return None
    path = _path_meter(tolerance, meter)
    fallen = False
    try:
        for step in steps(between_ruptures(scene, clock=False), start, tolerance, path):
            if fallen and step.before.growth > 0.0 >= step.after.growth:
                top = step.point_at(step.locate(lambda point: point.growth))
                return top.log_rate - scene.log_norm_rate
            fallen = fallen or step.after.log_rate < scene.log_load_rate
    except Halt:
        return None
    finally:
        for regime, spent in path.by_regime.items():
            meter.charge(regime, spent)
    raise AssertionError("steps() never ends by itself")


def displacement_on_path(scene: Scene, tolerance: float, meter: Meter, sign: int) -> float | None:
    """Displacement step of this sign, in D_c, that puts the slider on the critical path.

    A displacement step leaves Psi = 0 and moves the spring stress alone, so the path's point with
    Psi = 0 is its start.
    """
    found = start_of_path(
        scene,
        tolerance,
        meter,
        lambda point: point.psi,
        lambda point: sign * point.spring > 0.0,
    )
    return None if found is None else found.spring / scene.stiffness
