"""Monotonic rise of the slip rate to a fast load point velocity.

If seismic waves radiate most of the stress, the slip rate V rises gradually. The slip during this
rise is eta V_0/k, which is many times D_c. During the rise of the slip rate, the state stays close
to its steady state. An explicit integrator would need steps of about D_c during the whole rise of
the slip rate. The functions of this module test whether the slip rate rises monotonically to the
load point velocity. If the rise is monotonic, the integration ends early.

The test uses two curves in the plane of ln V and state. The two curves meet only at the point of
steady sliding. The first curve is the steady state as a function of ln V. On the second curve, the
state lags behind its steady state. Motions can cross the second curve only in one direction,
towards smaller lags. A motion between the two curves remains between the curves, and its slip rate
rises.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rsfstudy.motion import EventSpecification, rise
from rsfstudy.slider import MotionPoint, Scene

#: Differences ln V_0 - ln V at which the motion is tested for a monotonic rise.
_TESTED_LOG_RATE_GAPS_TO_LOAD_RATE = (
    10.0,
    8.0,
    7.0,
    6.0,
    5.0,
    4.0,
    3.0,
    2.5,
    2.0,
    1.5,
    1.0,
    0.5,
    0.2,
)
#: Constants of the test for a monotonic rise. The first number is the lag of the second curve,
#: relative to the lag that a state at rest would have after a slip of D_c. The second number is the
#: fraction of the evolution that must remain to cross the curve. The third number is the smallest
#: distance in ln V from the load point velocity at which the curves are tested, because all changes
#: are proportional to the distance if the distance is small. The last two numbers are the largest
#: spacing of the logarithms of the distances, and the step of the finite differences.
(
    _LAG_FACTOR,
    _REQUIRED_EVOLUTION_FRACTION,
    _MIN_TESTED_DISTANCE,
    _MAX_TEST_SPACING,
    _DIFFERENCE_STEP,
) = 2.0, 0.25, 1e-4, 0.25, 1e-5
#: Largest ratio of the change in ln V over a slip of D_c to the difference ln V_0 - ln V. The test
#: for a monotonic rise is worthwhile only below this ratio, because the integration of such a slow
#: motion would take hundreds of steps.
_MAX_RELATIVE_LOG_RATE_RISE_PER_DC = 0.02


def build_events_testing_monotone_rise(scene: Scene) -> list[EventSpecification]:
    """Return the events at which to test for a monotonic rise.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.

    Returns
    -------
    list of EventSpecification
        Events at which ln V rises through levels below ln V_0. The function
        ``is_slip_rate_rise_monotone`` tests the motion at these events. The list of events is
        empty if the slip rate rises quickly. The list is also empty if the scene has several states
        or inertia, because the test is not valid for such scenes.
    """
    load = scene.log_load_velocity
    if scene.state_count > 1 or scene.has_mass:
        return []
    if not scene.stiffness < _MAX_RELATIVE_LOG_RATE_RISE_PER_DC * (
        scene.a + scene.dynamics.radiated_stress_slope(load)
    ):
        return []
    return [rise("log_slip_rate", load - below) for below in _TESTED_LOG_RATE_GAPS_TO_LOAD_RATE]


def is_slip_rate_rise_monotone(scene: Scene, motion_point: MotionPoint) -> bool:
    """Return True if ln V rises monotonically to ln V_0 without overshoot.

    The test is based on a finite number of points between the present slip rate and the load point
    velocity.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    motion_point : MotionPoint
        Present point of the motion.

    Returns
    -------
    bool
        True if the motion is between the two curves that the module docstring describes, and if
        motions at all tested points cross the curves inwards.
    """
    change, load = _build_log_rate_and_state_lag_derivatives(scene), scene.log_load_velocity
    distance = load - motion_point.log_slip_rate

    def farthest(x: float) -> float:
        return _LAG_FACTOR * change(x, 0.0)[1]

    lag = motion_point.state - scene.compute_steady_states(motion_point.log_slip_rate, 0.0)[0]
    # The sign of the lag is the sign of b.
    side = math.copysign(1.0, scene.b)
    if not 0.0 <= side * lag <= side * farthest(motion_point.log_slip_rate):
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


def _build_log_rate_and_state_lag_derivatives(
    scene: Scene,
) -> Callable[[float, float], tuple[float, float]]:
    """Build a function that computes the changes in ln V and in the state lag.

    The arguments of the function are ln(V/V_*) and the lag of the state behind the steady state.
    The function returns the changes in ln V and in the lag per D_c of slip. The results are NaN if
    no stress corresponds to the friction at this slip rate and lag.
    """
    relation, evolution = (
        scene.build_friction_relation(),
        build_single_state_evolution_function(scene),
    )

    def at(x: float, lag: float) -> tuple[float, float]:
        friction = scene.frictional_stress_from_friction(
            scene.steady_friction_minus_reference(x) + lag
        )
        if friction is None:
            return np.nan, np.nan
        _value, slope, _shift, shift_slope = relation(friction)
        rest, damping = (
            scene.compute_steady_states(x, 0.0)[0],
            scene.dynamics.radiated_stress_slope(x),
        )
        pulled = scene.stiffness * float(np.expm1(scene.log_load_velocity - x))
        evolves = evolution(x, rest + lag)
        faster = (slope * pulled - evolves) / (scene.a + slope * damping)
        follows = (
            scene.compute_steady_states(x + _DIFFERENCE_STEP, 0.0)[0] - rest
        ) / _DIFFERENCE_STEP
        return faster, evolves - shift_slope * (pulled - damping * faster) - follows * faster

    return at


def build_single_state_evolution_function(scene: Scene) -> Callable[[float, float], float]:
    """Return the state evolution law of a scene with one state.

    Parameters
    ----------
    scene : Scene
        Scene with one state.

    Returns
    -------
    callable
        Function ``(ln(V/V_*), state) -> change in the state per unit slip``.
    """
    evolve = scene.build_state_evolution_function()
    return lambda log_slip_rate, state: evolve(log_slip_rate, (state,), 0.0)[0]
