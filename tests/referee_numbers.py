"""Numbers that the problems of the referee ask for, each by two ways; see `referee_ways`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from referee_ways import AsStated, InLogarithms, located
from scipy.optimize import brentq

Numbers = dict[str, Any]


# ---- steady sliding ------------------------------------------------------------------------------


def two_states_in_closed_form(problem: dict[str, Any]) -> Numbers:
    """The root of a quadratic equation: Gu et al. (1984), for the slip law with two states."""
    s = AsStated(problem).s
    (b_1, b_2), rho = (b / s.a for b in s.b), s.lengths[0] / s.lengths[1]
    half = b_1 - 1 + rho * (2 * b_1 + (b_2 - 1) * (2 + rho))
    under = half**2 + 4 * rho * (1 + rho) * (b_1 + b_2 - 1) * (1 + rho - b_1 - b_2 * rho)
    ratio = (half + mpmath.sqrt(under)) / (2 + 2 * rho)
    return {"critical_stiffness": ratio * s.a * s.sigma / s.lengths[0]}


def two_states_by_oscillation(problem: dict[str, Any]) -> Numbers:
    """The stiffness at which an oscillation neither grows nor decays: p = i q in the linearised
    equations ``k/(sigma p) V + a + sum_i of b_i times -(V/L_i)/(p + V/L_i) = 0``.
    """
    s = InLogarithms(problem).s

    def stiffness(q: float) -> complex:
        sums = sum(b / (1j * q / (s.star / x) + 1.0) for b, x in zip(s.b, s.lengths, strict=True))
        return 1j * q * s.sigma / s.star * (sums - s.a)

    scale = s.star / s.lengths[0]
    q = brentq(lambda q: stiffness(q).imag, 1e-3 * scale, 3.0 * scale, xtol=1e-300, rtol=1e-15)
    return {"critical_stiffness": stiffness(q).real}


def growth_in_closed_form(problem: dict[str, Any]) -> Numbers:
    """Of a quadratic equation, with stress over sigma, time in D_c/V_*."""
    s = AsStated(problem).s
    b, scale = s.b[0], s.sigma / s.lengths[0]
    eta, k = s.eta * s.star / s.sigma, s.k / scale
    half = ((b - k) / (s.a + eta) - 1) / 2
    p = half + mpmath.sqrt(half**2 - k / (s.a + eta))
    unit = s.star / s.lengths[0]
    numbers = {"growth_rate": p.real * unit, "angular_frequency": abs(p.imag) * unit}
    return numbers | {"critical_stiffness": (b - s.a - eta) * scale}


def growth_by_eigenvalues(problem: dict[str, Any]) -> Numbers:
    """Of the equations as stated, in tau and theta, linearised by hand."""
    s = InLogarithms(problem).s
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


def excess_of_peak(way: Any, begin: list[Any]) -> Any:
    """ln of the first maximum of slip rate over the one that counts as unstable."""
    s, zero = way.s, way.s.number(0)
    unit, unstable = getattr(way, "unit", 1), s.number(s.given["V_unstable"])
    walk = way.steps.path(way.rates, zero, begin, s.number("1e9"), s.number("1e-3") / unit)
    t, before, h = next(walk)
    for after_t, after, length in walk:
        if way.now(after_t, after)["slip_rate"] > 100 * unstable:
            return s.m.log(100)
        if way.growth(t, before) > 0 >= way.growth(after_t, after):
            peak = way.now(t, located(way, t, before, h)[1])
            return s.m.log(peak["slip_rate"] / unstable)
        t, before, h = after_t, after, length
    raise AssertionError


def of_velocity(kind: type, problem: dict[str, Any]) -> Callable[[Any], Any]:
    """``V_0 -> excess`` by one of the two ways."""

    def excess(velocity: Any) -> Any:
        way = kind(problem)
        begin = way.begin()
        return excess_of_peak(way, way.enter(begin, velocity, way.s.sigma))

    return excess


def of_displacement(problem: dict[str, Any]) -> Callable[[Any], Any]:
    """``displacement -> excess``, as stated."""

    def excess(displacement: Any) -> Any:
        way = AsStated(problem)
        tau, *others = way.enter(way.begin(), mpmath.mpf(0), way.s.sigma)
        return excess_of_peak(way, [tau + way.s.k * displacement, *others])

    return excess


def displacement_by_quadrature(problem: dict[str, Any]) -> float:
    """With the load point at rest ``du/d(slip) = h(u) (1 - b/a) - K/a`` is an equation of u =
    ln(theta V/2 D_c) alone, h = -sinh(u), and ``d ln V/d(slip) = -K/a - (b/a) h``: slip rate is
    highest where h = -K/b.
    """
    way = InLogarithms(problem)
    s, k = way.s, way.k
    b, a = s.b[0], s.a
    end, limit = math.asinh(k / b), math.log(float(s.given["V_unstable"]) / s.star)
    rest = math.asinh(k / (b - a))
    nodes, weights = np.polynomial.legendre.leggauss(60)

    def excess(step: float) -> float:
        begin = k * step / a
        # evenly in the logarithm of how far u is from where it would rest
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


def by_secant(excess: Callable[[Any], Any], near: Any) -> Any:
    """Where an excess vanishes, from close by."""
    first, second = near, near * (1 + mpmath.mpf("1e-9"))
    at_first, at_second = excess(first), excess(second)
    for _ in range(12):
        third = second - at_second * (second - first) / (at_second - at_first)
        if abs(third - second) <= mpmath.mpf("1e-17") * abs(third):
            break
        first, at_first, second, at_second = second, at_second, third, excess(third)
    return third


# ---- limit cycles --------------------------------------------------------------------------------


def damped_cycle(kind: type, problem: dict[str, Any], closes: float) -> Numbers:
    """Maxima and minima of slip rate of successive events, until they repeat."""
    way = kind(problem)
    s, unit = way.s, getattr(way, "unit", 1)
    begin = way.enter(way.begin(), s.number(s.given["load_velocity"]), s.sigma)
    walk = way.steps.path(way.rates, s.number(0), begin, s.number("1e9"), s.number("0.1") / unit)
    (t, before, h), found = next(walk), {1: [], -1: []}
    for after_t, after, length in walk:
        for sign, told in found.items():
            if sign * way.growth(t, before) > 0 >= sign * way.growth(after_t, after):
                late, there = located(way, t, before, h, sign)
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


def first_way(problem: dict[str, Any]) -> Numbers:
    """Numbers by closed forms, and by the equations as stated."""
    (name, *_others) = problem["quantities"]
    if name == "critical_stiffness":
        two = problem["law"] == "two_slip_states"
        return (two_states_in_closed_form if two else growth_in_closed_form)(problem)
    if name == "critical_velocity":
        return {name: by_secant(of_velocity(AsStated, problem), mpmath.mpf("2.967e-6"))}
    if name == "critical_displacement":
        near = mpmath.mpf(repr(displacement_by_quadrature(problem)))
        return {name: by_secant(of_displacement(problem), near)}
    return damped_cycle(AsStated, problem, 1e-15)


def second_way(problem: dict[str, Any]) -> Numbers:
    """The same by other formulations, in double precision."""
    (name, *_others) = problem["quantities"]
    if name == "critical_stiffness":
        two = problem["law"] == "two_slip_states"
        return (two_states_by_oscillation if two else growth_by_eigenvalues)(problem)
    if name == "critical_velocity":
        return {
            name: brentq(
                of_velocity(InLogarithms, problem), 2.966e-6, 2.968e-6, xtol=1e-300, rtol=1e-15
            )
        }
    if name == "critical_displacement":
        return {name: displacement_by_quadrature(problem)}
    return damped_cycle(InLogarithms, problem, 1e-13)
