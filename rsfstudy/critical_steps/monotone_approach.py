"""Slip rate that rises to that of a fast load point and not beyond: waves carry stress away.

Where radiation takes most of the stress, V follows the spring, over a slip of eta V_0/(K D_c): many
times D_c, while the state stays as close behind as D_c lets it. An explicit integrator steps by D_c
all the way. So the motion ends where it has come between two curves in the plane of ln V and state
that only meet in steady sliding: the state at rest, and a lag behind that which the state makes up
for faster than it grows. Both are crossed inwards, and between them ln V rises.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rsfstudy.motion import EventSpecification, rise
from rsfstudy.slider import (
    Point,
    Scene,
    compute_steady_states,
    friction_relation,
    state_evolution,
    steady_friction_excess,
    stress_for_friction,
)

#: Distances in ln V below the load point at which it is asked whether the motion is between them.
_TESTED_DISTANCES = (10.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.0, 0.5, 0.2)
#: The farther curve, over the lag at which a state that rested would be after a slip of D_c; part
#: of the evolution there that is left to cross it; the nearest place to the load point at which
#: the curves are looked at, the most apart that such places are, and the step of differences. All
#: changes are in proportion to the distance where that is small.
(
    _LAG_FACTOR,
    _REQUIRED_EVOLUTION_FRACTION,
    _MIN_TESTED_DISTANCE,
    _MAX_TEST_SPACING,
    _DIFFERENCE_STEP,
) = 2.0, 0.25, 1e-4, 0.25, 1e-5
#: Change of ln V over a slip of D_c, over its distance from the load point, up to which a motion is
#: as slow as that: to follow it takes hundreds of steps.
_MAX_RELATIVE_GROWTH = 0.02


def monotone_rise_events(scene: Scene) -> list[EventSpecification]:
    """Event specifications that are needed to ask `rises_monotonically`: nothing where the motion
    is not slow there, or there are several states or mass, of which it knows nothing.
    """
    load = scene.log_load_velocity
    if scene.state_count > 1 or scene.has_mass:
        return []
    if not scene.stiffness < _MAX_RELATIVE_GROWTH * (
        scene.a + scene.dynamics.radiated_stress_slope(load)
    ):
        return []
    return [rise("log_slip_rate", load - below) for below in _TESTED_DISTANCES]


def rises_monotonically(scene: Scene, point: Point) -> bool:
    """True if ln V rises from a point to that of the load point and not beyond, as far as places on
    the way tell.
    """
    change, load = _build_change_function(scene), scene.log_load_velocity
    distance = load - point.log_slip_rate

    def farthest(x: float) -> float:
        return _LAG_FACTOR * change(x, 0.0)[1]

    lag = point.state - compute_steady_states(scene, point.log_slip_rate, 0.0)[0]
    # it lags on the side of b
    side = math.copysign(1.0, scene.b)
    if not 0.0 <= side * lag <= side * farthest(point.log_slip_rate):
        return False
    several = max(2, round(np.log(distance / _MIN_TESTED_DISTANCE) / _MAX_TEST_SPACING))
    for x in (load - np.geomspace(distance, _MIN_TESTED_DISTANCE, several)).tolist():
        rising, growing = change(x, 0.0)
        lag = farthest(x)
        step = _DIFFERENCE_STEP * (load - x)
        slope = (farthest(x + step) - farthest(x - step)) / (2.0 * step)
        faster, behind = change(x, lag)
        inwards = side * (slope * faster - behind) > _REQUIRED_EVOLUTION_FRACTION * side * lag
        if not (rising > 0.0 and side * growing > 0.0 and faster > 0.0 and inwards):
            return False
    return True


def _build_change_function(scene: Scene) -> Callable[[float, float], tuple[float, float]]:
    """Per slip of D_c, at ln(V/V_*) and a lag of the state behind its rest: the changes of both."""
    relation, evolution = friction_relation(scene), single_state_evolution(scene)

    def at(x: float, lag: float) -> tuple[float, float]:
        friction = stress_for_friction(scene, steady_friction_excess(scene, x) + lag)
        if friction is None:
            return np.nan, np.nan
        _value, slope, _shift, shift_slope = relation(friction)
        rest, damping = (
            compute_steady_states(scene, x, 0.0)[0],
            scene.dynamics.radiated_stress_slope(x),
        )
        pulled = scene.stiffness * float(np.expm1(scene.log_load_velocity - x))
        evolves = evolution(x, rest + lag)
        faster = (slope * pulled - evolves) / (scene.a + slope * damping)
        follows = (
            compute_steady_states(scene, x + _DIFFERENCE_STEP, 0.0)[0] - rest
        ) / _DIFFERENCE_STEP
        return faster, evolves - shift_slope * (pulled - damping * faster) - follows * faster

    return at


def single_state_evolution(scene: Scene) -> Callable[[float, float], float]:
    """The law of a scene with one state: (ln(V/V_*), Theta) -> dTheta per unit slip."""
    evolve = state_evolution(scene)
    return lambda log_slip_rate, state: evolve(log_slip_rate, (state,), 0.0)[0]
