"""Stick-slip cycles as benchmark problems, with exact results.

The module implements the equations of the package again, for any library that has ``exp``,
``log`` and ``expm1``. All participants integrate the same non-stiff form, which suits explicit
methods: along the slow manifold to a first mark, through the rupture to a second mark, and
along the slow manifold again. The marks are known in advance, so that the other
participants need no event detection. The engines of rsfstudy detect the events themselves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from rsfstudy import Scene
from rsfstudy.limit_cycles.limit_cycle_search import LimitCycleSearch
from rsfstudy.limit_cycles.stick_slip_cycles import (
    _build_cycle_event_specifications,
    iterate_stick_slip_cycles,
)
from rsfstudy.motion.accuracy import MIN_RTOL, Accuracy
from rsfstudy.motion.integration_events import EventKind, approach_to_steady_state, rise
from rsfstudy.motion.integrator import Integrator
from rsfstudy.slider.dynamics.inertia import DIFFERENCE_STEP, NEGLIGIBLE_SECOND_ORDER_WEIGHT
from rsfstudy.slider.equations import RUPTURE_REGIME, build_equations_between_ruptures
from rsfstudy.slider.integration_path_length import LOG_SLIP_RATE_PER_PATH_LENGTH
from rsfstudy.slider.motion_point import MotionPoint

BUDGET = 10**9
#: Indices of the parameters of a scene.
A, B, MU, STIFFNESS, LOAD, LOG_LOAD, MASS, LOG_MASS, COT, ALPHA = range(10)


@dataclass(frozen=True)
class Problem:
    """One limit cycle between two maxima of spring stress.

    Attributes
    ----------
    scene : Scene
        Scene that has the limit cycle.
    begin : Point
        Point at the maximum of spring stress.
    p : tuple of float
        Parameters of the scene.
    initial_spring_stress_rate : float
        Derivative of ln V at this point, by the sum of slip and load point displacement.
    interval, drop : float
        Exact recurrence interval and static stress drop.
    leave, rupture, rest : float
        Marks: path length until the rupture begins, path length of the rupture, and path length
        of the rest of the cycle.
    duration : float
        Duration of the rupture.
    fall, creep : float
        Time of the minimum of spring stress, and the spring stress that slip releases between this
        minimum and the end of the rupture.
    """

    scene: Scene
    begin: MotionPoint
    p: tuple[float, ...]
    initial_spring_stress_rate: float
    interval: float
    drop: float
    leave: float = math.nan
    rupture: float = math.nan
    rest: float = math.nan
    duration: float = math.nan
    fall: float = math.nan
    creep: float = math.nan

    @property
    def marks(self) -> tuple[float, ...]:
        """Arguments of ``cycle_function`` that describe the marks."""
        paths = self.leave, self.rupture, self.rest
        return self.initial_spring_stress_rate, *paths, self.duration, self.fall, self.creep

    def error(self, found: tuple[float, float]) -> float:
        """Return the largest relative error of a result.

        The result consists of the recurrence interval and the static stress drop.
        """
        truth = self.interval, self.drop
        errors = [abs(x / y - 1.0) for x, y in zip(found, truth, strict=True)]
        return math.inf if any(map(math.isnan, errors)) else max(errors)


def cycle_problem(scene: Scene) -> Problem:
    """Return the problem of a scene, without marks."""
    tight = Accuracy(MIN_RTOL, budget=BUDGET, engine="compiled")
    approach = LimitCycleSearch(scene, Integrator(tight))
    if not approach.follow_cycles_until_converged(300):
        raise ValueError(f"no limit cycle: {scene}")
    begin = approach.cycles[-1].motion_point_at_end
    truth = next(iterate_stick_slip_cycles(scene, Integrator(tight), begin))
    coupling = scene.parts.normal_stress.coupling
    assert truth is not None
    assert coupling is not None
    mass, load, log_load = scene.inertial_time, scene.load_velocity, scene.log_load_velocity
    common = scene.a, scene.b, scene.mu_star, scene.stiffness, load, log_load
    slow = build_equations_between_ruptures(scene, with_time=True)
    passing = slow.evaluate_rates((begin.spring_stress, *begin.psis, 0.0))[-1]
    return Problem(
        scene=scene,
        begin=begin,
        p=(*common, mass, math.log(mass), *coupling),
        initial_spring_stress_rate=begin.log_slip_rate_derivative
        / passing
        / (2.0 * scene.load_velocity),
        interval=truth.recurrence_interval,
        drop=truth.max_spring_stress_minus_steady - truth.min_spring_stress_minus_steady,
    )


def with_marks(it: Problem, rtol: float) -> Problem:
    """Return a problem with the marks of the package for an accuracy."""
    scene, passed = it.scene, dict[str, float]()
    allowed = Accuracy(rtol, budget=BUDGET, engine="compiled")
    moving = Integrator(allowed).follow(
        scene,
        _build_cycle_event_specifications(scene.log_load_velocity),
        start=it.begin,
        with_time=True,
    )
    for event in moving:
        if event.kind is EventKind.REGIME_CHANGE:
            entering = event.regime == RUPTURE_REGIME
            passed["leave" if entering else "land"] = event.time
            passed["landed"] = event.point.spring_stress
        elif event.kind is EventKind.FALL and event.time > 0.0:
            passed["fall"], passed["lowest"] = event.time, event.point.spring_stress
        elif event.kind is EventKind.RISE and "fall" in passed:
            break
    loaded = scene.stiffness * scene.load_velocity * (passed["land"] - passed["fall"])
    leave, rupture, rest = stretch_lengths(scene, Accuracy(rtol), it.begin)
    return replace(
        it,
        leave=leave,
        rupture=rupture,
        rest=rest,
        duration=passed["land"] - passed["leave"],
        fall=passed["fall"],
        creep=passed["landed"] - passed["lowest"] - loaded,
    )


def stretch_lengths(scene: Scene, accuracy: Accuracy, begin: MotionPoint) -> list[float]:
    """Return the path lengths of the three stretches of a cycle."""
    lengths, regime, load = list[float](), "", scene.log_load_velocity
    watches = rise("log_slip_rate", load), approach_to_steady_state(2.0)
    for event in Integrator(accuracy).follow(scene, watches, start=begin, with_time=True):
        if event.regime != regime:
            regime = event.regime
            lengths.append(0.0)
        lengths[-1] = event.independent_variable
        if len(lengths) == 3 and event.kind is EventKind.RISE:
            break
    return lengths


def _identity(function: Any) -> Any:
    return function


def equations(m: Any, law: str, variable: bool, ready: Callable[[Any], Any] = _identity) -> Any:
    """Return the equations of a law and a normal stress.

    The equations use the functions of the namespace ``m``, and ``ready`` compiles each
    function. If ``m.branches`` is True, the slow manifold skips the second-order correction
    if inertia is negligible.

    ``slow(f, psi, p)`` returns the rates of f, psi and time along a path in slip, load
    point displacement and ln V. ``fast(f, x, g, p)`` returns the rates of f, x and g along
    a path in inertial time and ln V.
    """
    exp, log, expm1, clamped = (ready(of) for of in (m.exp, m.log, m.expm1, m.clamped))
    sqrt = ready(m.sqrt)
    is_slip, branches = law == "slip", getattr(m, "branches", False)

    @ready
    def strength(g: Any, p: Any) -> Any:
        if variable:
            ratio = 1.0 + clamped(p[COT] * g, 1e-12 - 1.0, 1e12)
            support = 1.0 - p[MU] * p[COT]
            shift = p[ALPHA] * log(ratio)
            slope = (support / ratio + p[ALPHA] * p[COT]) / ratio
            return g * support / ratio + shift, slope, shift
        return g, 1.0, 0.0

    @ready
    def evolution(x: Any, theta: Any, p: Any) -> Any:
        if is_slip:
            return -(theta + p[B] * x)
        return p[B] * expm1(-(theta / p[B] + x))

    @ready
    def changes(x: Any, psi: Any, shift: Any, slope: Any, p: Any) -> Any:
        slower = exp(p[LOG_LOAD] - x)
        share = 1.0 / (1.0 + slower)
        loading = p[STIFFNESS] * (slower - 1.0) * share
        evolving = evolution(x, psi - shift, p) * share
        return loading, evolving, (slope * loading - evolving) / p[A]

    @ready
    def weight(x: Any, p: Any) -> Any:
        norm = exp(x + p[LOG_MASS])
        return p[STIFFNESS] * norm * (norm + p[LOAD] * p[MASS])

    @ready
    def trailing(f: Any, psi: Any, p: Any) -> Any:
        value, slope, shift = strength(f, p)
        x = (value - psi) / p[A]
        _loading, _evolving, growing = changes(x, psi, shift, slope, p)
        resistance = clamped(weight(x, p) * growing, -p[A], p[A])
        return x, slope, resistance, slope * resistance / p[A]

    @ready
    def balance(f: Any, psi: Any, p: Any) -> Any:
        x, slope, resistance, trails = trailing(f, psi, p)
        if not branches or weight(x, p) > NEGLIGIBLE_SECOND_ORDER_WEIGHT * p[A]:
            _value, _slope, shift = strength(f - resistance, p)
            loading, evolving, growing = changes(x - trails, psi, shift, slope, p)
            ahead = trailing(f + DIFFERENCE_STEP * loading, psi + DIFFERENCE_STEP * evolving, p)[3]
            growing = growing - (ahead - trails) / DIFFERENCE_STEP
            resistance = clamped(weight(x - trails, p) * growing, -p[A], p[A])
        g = f - resistance
        value, _slope, shift = strength(g, p)
        return (value - psi) / p[A], g, shift

    @ready
    def slow(f: Any, psi: Any, p: Any) -> Any:
        x, _g, shift = balance(f, psi, p)
        slower = exp(p[LOG_LOAD] - x)
        share = 1.0 / (1.0 + slower)
        loading = p[STIFFNESS] * (slower - 1.0) * share
        evolving = evolution(x, psi - shift, p) * share
        slant = (loading - evolving) / (LOG_SLIP_RATE_PER_PATH_LENGTH * p[A])
        part = 1.0 / sqrt(1.0 + slant * slant)
        return part * loading, part * evolving, part * slower * share / p[LOAD]

    @ready
    def fast(f: Any, x: Any, g: Any, p: Any) -> Any:
        norm = exp(x + p[LOG_MASS])
        value, slope, shift = strength(g, p)
        faster = clamped((f - g) / (p[STIFFNESS] * norm), -1e30, 1e30)
        changes = evolution(x, value - p[A] * x - shift, p) * norm
        loading = p[STIFFNESS] * (p[LOAD] * p[MASS] - norm)
        slant = faster / LOG_SLIP_RATE_PER_PATH_LENGTH
        part = 1.0 / sqrt(1.0 + slant * slant)
        return part * loading, part * faster, part * (p[A] * faster + changes) / slope

    return SimpleNamespace(strength=strength, balance=balance, slow=slow, fast=fast)


def cycle_function(
    balance: Any, strength: Any, slow: Any, fast: Any, ready: Callable[[Any], Any] = _identity
) -> Any:
    """Return a function that integrates one cycle, for floats or arrays.

    The arguments ``slow(f, psi, t, span, p, tolerance)`` and ``fast(f, x, g, span, p,
    tolerance)`` are the integrators of the two regimes.
    """

    @ready
    def cycle(f0: Any, psi: Any, p: Any, marks: Any, tolerance: Any) -> Any:
        rises, leave, rupture, rest = marks[0], marks[1], marks[2], marks[3]
        lasts, fall, creep = marks[4], marks[5], marks[6]
        f, psi, t = slow(f0, psi, 0.0 * f0, leave, p, tolerance)
        x, g, _shift = balance(f, psi, p)
        f, x, g = fast(f, x, g, rupture, p, tolerance)
        t = t + lasts
        psi = strength(g, p)[0] - p[A] * x
        # Between the minimum and the end of the rupture, load point motion and creep change the
        # spring stress.
        drop = f0 - f + p[STIFFNESS] * p[LOAD] * (t - fall) + creep
        f, psi, t = slow(f, psi, t, rest, p, tolerance)
        x, g, _shift = balance(f, psi, p)
        return t + (p[LOG_LOAD] - x) / rises / (2.0 * p[LOAD]), drop

    return cycle


def problem_arrays(
    problems: list[Problem],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return initial stresses and states, parameters and marks.

    The last axis of each array is the problem.
    """
    starts = np.array([(it.begin.spring_stress, it.begin.psis[0]) for it in problems]).T
    marks = [it.marks for it in problems]
    p = np.ascontiguousarray(np.array([it.p for it in problems]).T)
    return starts[0].copy(), starts[1].copy(), p, np.ascontiguousarray(np.array(marks).T)


def unknown_scales(a: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the changes of the unknowns that correspond to 1 in ln V.

    The two tuples belong to the equations between ruptures and to the equations of a
    rupture.
    """
    return (a, a, 1.0), (a, 1.0, a)
