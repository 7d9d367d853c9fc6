"""Numbers and rows of the answers of the referee.

The module ``second_referee_way`` contains the equations of the second method.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import brentq
from second_referee_way import LogarithmicEquations, locate_extremum, rows_by_way

Numbers = dict[str, Any]
UNITS = {
    "time": "s", "event": "1", "friction": "1", "slip_rate": "m/s", "slip": "m", "theta": "s",
    "theta_1": "s", "theta_2": "s", "normal_stress": "Pa", "pore_pressure": "Pa",
    "critical_stiffness": "Pa/m", "growth_rate": "1/s", "angular_frequency": "1/s",
    "critical_velocity": "m/s", "critical_displacement": "m", "recurrence_interval": "s",
    "peak_slip_rate": "m/s", "slowest_slip_rate": "m/s",
}  # fmt: skip


# ---- steady sliding ------------------------------------------------------------------------------


def two_states_by_oscillation(problem: dict[str, Any]) -> Numbers:
    """Return the stiffness at which an oscillation neither grows nor decays.

    The frequency is the root for p = i q of the linearised equation ``k/(sigma p) V + a +
    sum_i of b_i times -(V/L_i)/(p + V/L_i) = 0``.
    """
    s = LogarithmicEquations(problem).s

    def stiffness(q: float) -> complex:
        sums = sum(b / (1j * q / (s.star / x) + 1.0) for b, x in zip(s.b, s.lengths, strict=True))
        return 1j * q * s.sigma / s.star * (sums - s.a)

    scale = s.star / s.lengths[0]
    q = brentq(lambda q: stiffness(q).imag, 1e-3 * scale, 3.0 * scale, xtol=1e-300, rtol=1e-15)
    return {"critical_stiffness": stiffness(q).real}


def growth_by_eigenvalues(problem: dict[str, Any]) -> Numbers:
    """Return the growth rate from eigenvalues of the stated equations.

    The equations in tau and theta are linearised by hand.
    """
    s = LogarithmicEquations(problem).s
    theta, length, b = s.theta_star[0], s.lengths[0], s.b[0]

    def eigenvalues(k: float) -> np.ndarray:
        by_tau = 1.0 / (s.a * s.sigma / s.star + s.eta)
        by_theta = -by_tau * b * s.sigma / theta
        jacobian = [
            [-k * by_tau, -k * by_theta],
            [-theta * by_tau / length, -(theta * by_theta + s.star) / length],
        ]
        return np.linalg.eigvals(np.array(jacobian))

    p = eigenvalues(s.k)[0]
    critical = brentq(lambda k: eigenvalues(k)[0].real, 0.5 * s.k, 4.0 * s.k, xtol=1e-4, rtol=1e-15)
    return {
        "growth_rate": p.real,
        "angular_frequency": abs(p.imag),
        "critical_stiffness": critical,
    }


# ---- critical steps ------------------------------------------------------------------------------


def peak_excess(way: Any, begin: list[Any]) -> Any:
    """Return the logarithm of the first peak over the unstable slip rate."""
    s, zero = way.s, way.s.number(0)
    unit, unstable = getattr(way, "unit", 1), s.number(s.given["V_unstable"])
    walk = way.steps.path(way.rates, zero, begin, s.number("1e9"), s.number("1e-3") / unit)
    t, before, h = next(walk)
    for after_t, after, length in walk:
        if way.now(after_t, after)["slip_rate"] > 100 * unstable:
            return s.m.log(100)
        if way.growth(t, before) > 0 >= way.growth(after_t, after):
            peak = way.now(t, locate_extremum(way, t, before, h)[1])
            return s.m.log(peak["slip_rate"] / unstable)
        t, before, h = after_t, after, length
    raise AssertionError


def velocity_excess(kind: type, problem: dict[str, Any]) -> Callable[[Any], Any]:
    """Return the function ``V_0 -> excess`` for one of the two methods."""

    def excess(velocity: Any) -> Any:
        way = kind(problem)
        begin = way.begin()
        return peak_excess(way, way.enter(begin, velocity, way.s.sigma))

    return excess


def displacement_by_quadrature(problem: dict[str, Any]) -> float:
    """Return the critical displacement, from a quadrature.

    If the load point is at rest, ``du/d(slip) = h(u) (1 - b/a) - K/a`` is an equation of u
    = ln(theta V/2 D_c) only, with h = -sinh(u). The slip rate follows ``d ln V/d(slip) =
    -K/a - (b/a) h`` and has its maximum at h = -K/b.
    """
    way = LogarithmicEquations(problem)
    s, k = way.s, way.k
    b, a = s.b[0], s.a
    end, limit = math.asinh(k / b), math.log(float(s.given["V_unstable"]) / s.star)
    rest = math.asinh(k / (b - a))
    nodes, weights = np.polynomial.legendre.leggauss(60)

    def excess(step: float) -> float:
        begin = k * step / a
        # The pieces are equal in the logarithm of the distance between u and its resting value.
        far, near = math.log(rest - end), math.log(rest - begin)
        pieces = np.linspace(near, far, 21)
        total = begin
        for low, high in itertools.pairwise(pieces):
            u = rest - np.exp(low + 0.5 * (high - low) * (nodes + 1.0))
            along = (b / a - 1.0) * np.sinh(u) - k / a
            rates = (b / a * np.sinh(u) - k / a) / along
            total += 0.5 * (high - low) * float(weights @ (rates * (u - rest)))
        return total - limit

    longest = rest * a / k
    return s.lengths[0] * brentq(
        excess, 0.5 * longest, longest * (1 - 1e-12), xtol=1e-300, rtol=1e-15
    )


# ---- limit cycles --------------------------------------------------------------------------------


def damped_cycle(kind: type, problem: dict[str, Any], closes: float) -> Numbers:
    """Return the interval and extrema of slip rate of a limit cycle.

    The motion is integrated until successive events repeat.
    """
    way = kind(problem)
    s, unit = way.s, getattr(way, "unit", 1)
    begin = way.enter(way.begin(), s.number(s.given["load_velocity"]), s.sigma)
    walk = way.steps.path(way.rates, s.number(0), begin, s.number("1e9"), s.number("0.1") / unit)
    (t, before, h), found = next(walk), {1: [], -1: []}
    for after_t, after, length in walk:
        for sign, told in found.items():
            if sign * way.growth(t, before) > 0 >= sign * way.growth(after_t, after):
                late, there = locate_extremum(way, t, before, h, sign)
                told.append(((t + late) * unit, way.now(t + late, there)["slip_rate"]))
        peaks = found[1]
        if len(peaks) > 3 and abs(peaks[-1][1] / peaks[-2][1] - 1) < closes and found[-1]:
            return {
                "recurrence_interval": peaks[-1][0] - peaks[-2][0],
                "peak_slip_rate": peaks[-1][1],
                "slowest_slip_rate": found[-1][-1][1],
            }
        t, before, h = after_t, after, length
    raise AssertionError


# ---- all of them ---------------------------------------------------------------------------------


def second_way_numbers(problem: dict[str, Any]) -> Numbers:
    """Return the numbers from other formulations, in double precision."""
    (name, *_others) = problem["quantities"]
    if name == "critical_stiffness":
        two = problem["law"] == "two_slip_states"
        return (two_states_by_oscillation if two else growth_by_eigenvalues)(problem)
    if name == "critical_velocity":
        return {
            name: brentq(
                velocity_excess(LogarithmicEquations, problem),
                2.966e-6,
                2.968e-6,
                xtol=1e-300,
                rtol=1e-15,
            )
        }
    if name == "critical_displacement":
        return {name: displacement_by_quadrature(problem)}
    return damped_cycle(LogarithmicEquations, problem, 1e-13)


def second_way_rows(problem: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of an answer, in double precision."""
    return (
        [second_way_numbers(problem)]
        if problem["report"] == "numbers"
        else rows_by_way(LogarithmicEquations, problem)
    )


def columns(problem: dict[str, Any]) -> list[str]:
    """Return the column names of an answer."""
    key = {"series": ["time"], "peaks": ["event"], "numbers": []}[problem["report"]]
    return [*key, *problem["quantities"]]
