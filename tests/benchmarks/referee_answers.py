"""Answers of the referee, with the digits on which two methods agree.

Run ``python tests/benchmarks/referee_answers.py [NUMBER ...]`` to write the answers. All
answers take a quarter of an hour.

The first method, in this module, solves the equations of the problem statements in SI
units. The unknowns are spring stress, theta in s, and slip. The slip rate follows from the
friction law, or from a root search if there is radiation damping. The integrator has order
20 and works with 30 digits (mpmath). The second method is in ``second_referee_way.py``.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mpmath
from referee_numbers import (
    UNITS,
    Numbers,
    columns,
    damped_cycle,
    displacement_by_quadrature,
    peak_excess,
    second_way_rows,
    velocity_excess,
)
from second_referee_way import (
    PROBLEMS,
    ExtrapolatedSteps,
    ProblemSlider,
    State,
    read_stated_problem,
    rounds_to,
    rows_by_way,
)


class StatedEquations:
    """Equations of the problem statements, in SI units.

    The unknowns are tau, the state variables theta, slip, phi and p, and the slip rate if
    the slider has a mass.
    """

    def __init__(self, problem: dict[str, Any]) -> None:
        self.s = s = ProblemSlider(problem, mpmath.mp, lambda x: mpmath.mpf(str(x)))
        self.load, self.imposed = s.star, s.sigma
        states = [abs(star) for star in s.theta_star]
        self.steps = ExtrapolatedSteps(
            20, mpmath.mpf("1e-19"), [s.sigma / 100, *states, *s.lengths[:1], 1, 1, s.star]
        )
        self.last = mpmath.mpf(0)

    def begin(self) -> State:
        """Return the initial unknowns."""
        s = self.s
        rate, thetas = s.initial()
        self.last = mpmath.log(rate / s.star)
        psi = self._state(thetas)
        tau = s.sigma * self._friction(self.last, psi) + s.eta * rate
        return [tau, *thetas, mpmath.mpf(0), mpmath.mpf(0), mpmath.mpf(0), rate]

    def _state(self, thetas: Sequence[Any]) -> Any:
        s = self.s
        if not all(theta > 0 for theta in thetas):
            raise ArithmeticError("a trial step beyond the logarithm")
        parts = zip(s.b, thetas, s.theta_star, strict=True)
        return sum(b * mpmath.log(theta / star) for b, theta, star in parts)

    def _friction(self, x: Any, psi: Any) -> Any:
        s = self.s
        if s.regularised:
            return s.a * mpmath.asinh(mpmath.exp(x + (s.mu + psi) / s.a) / 2)
        return s.mu + s.a * x + psi

    def _rate(self, tau: Any, sigma: Any, psi: Any) -> Any:
        s = self.s
        if s.regularised:
            return 2 * s.star * mpmath.sinh(tau / sigma / s.a) * mpmath.exp(-(s.mu + psi) / s.a)
        x = (tau / sigma - s.mu - psi) / s.a
        if s.eta:
            top, x = x, min(self.last, x)
            for _ in range(60):
                radiated = s.eta * s.star * mpmath.exp(x) / sigma / s.a
                change = (top - radiated - x) / (1 + radiated)
                x = x + change
                if abs(change) < mpmath.mpf("1e-26"):
                    break
            self.last = x
        if x > 1000:
            raise ArithmeticError("a trial step beyond all slip rates")
        return s.star * mpmath.exp(x)

    def stress(self, t: Any, tau: Any, p: Any) -> tuple[Any, Any]:
        """Return the effective normal stress, and its imposed rate."""
        s = self.s
        angle = 2 * mpmath.pi / s.turn
        sigma = self.imposed + s.cot * (tau - s.mu * s.sigma) - p
        if not s.amplitude:
            return sigma, mpmath.mpf(0)
        wave = s.amplitude * mpmath.sin(angle * t)
        return sigma + wave, s.amplitude * angle * mpmath.cos(angle * t)

    def now(self, t: Any, y: State) -> dict[str, Any]:
        """Return the reported quantities in SI units."""
        s, count = self.s, len(self.s.b)
        tau, thetas, slip, p = y[0], y[1 : 1 + count], y[1 + count], y[3 + count]
        sigma, imposed = self.stress(t, tau, p)
        velocity = y[-1] if s.mass else self._rate(tau, sigma, self._state(thetas))
        told = {"friction": (tau - s.eta * velocity) / sigma, "slip_rate": velocity, "slip": slip}
        told |= {"theta": thetas[0], "theta_1": thetas[0], "theta_2": thetas[-1]}
        return told | {"normal_stress": sigma, "pore_pressure": p, "imposed": imposed}

    def rates(self, t: Any, y: State) -> State:
        """Return the rates of the unknowns."""
        s, count = self.s, len(self.s.b)
        now, thetas = self.now(t, y), y[1 : 1 + count]
        v, sigma = now["slip_rate"], now["normal_stress"]
        loading = s.k * (self.load - v)
        opening = -v / s.lengths[0] * (y[2 + count] - s.dilatancy * mpmath.log(v / s.star))
        draining = -s.drainage * y[3 + count] - opening
        pressed = now["imposed"] + s.cot * loading
        healing = mpmath.exp(-v / s.cutoff) if s.cutoff else 0
        states = zip(thetas, s.lengths, s.b, s.shares, strict=True)
        evolving = [
            s.evolution(v, theta, length, healing)
            - theta / (b * sigma) * share * (s.alpha * pressed + s.c * loading)
            for theta, length, b, share in states
        ]
        faster = mpmath.mpf(0)
        if s.mass:
            mu = self._friction(mpmath.log(v / s.star), self._state(thetas))
            faster = (y[0] - sigma * mu) / s.mass
        return [loading, *evolving, v, opening, draining, faster]

    def growth(self, t: Any, y: State) -> Any:
        """Return d(ln V)/dt at constant normal stress."""
        s, count = self.s, len(self.s.b)
        if s.mass:
            return self.rates(t, y)[-1] / y[-1]
        slopes, v = self.rates(t, y), self.now(t, y)["slip_rate"]
        states = zip(s.b, slopes[1 : 1 + count], y[1 : 1 + count], strict=True)
        falls = s.sigma * sum(b * slope / theta for b, slope, theta in states)
        return (slopes[0] - falls) / (s.a * s.sigma + s.eta * v)

    def enter(self, y: State, velocity: Any, sigma: Any) -> State:
        """Return the unknowns at the beginning of a segment of loading."""
        s, count = self.s, len(self.s.b)
        ratio, self.load, self.imposed = self.imposed / sigma, velocity, sigma
        parts = zip(y[1 : 1 + count], s.b, s.shares, strict=True)
        thetas = [theta * ratio ** (s.alpha * share / b) for theta, b, share in parts]
        return [y[0], *thetas, *y[1 + count :]]


def two_state_closed_form(problem: dict[str, Any]) -> Numbers:
    """Return the critical stiffness for the slip law with two states.

    The stiffness is the root of a quadratic equation (Gu et al. 1984).
    """
    s = StatedEquations(problem).s
    (b_1, b_2), rho = (b / s.a for b in s.b), s.lengths[0] / s.lengths[1]
    half = b_1 - 1 + rho * (2 * b_1 + (b_2 - 1) * (2 + rho))
    under = half**2 + 4 * rho * (1 + rho) * (b_1 + b_2 - 1) * (1 + rho - b_1 - b_2 * rho)
    ratio = (half + mpmath.sqrt(under)) / (2 + 2 * rho)
    return {"critical_stiffness": ratio * s.a * s.sigma / s.lengths[0]}


def growth_closed_form(problem: dict[str, Any]) -> Numbers:
    """Return the growth rate as the root of a quadratic equation.

    The equation is scaled by sigma and D_c/V_*.
    """
    s = StatedEquations(problem).s
    b, scale = s.b[0], s.sigma / s.lengths[0]
    eta, k = s.eta * s.star / s.sigma, s.k / scale
    half = ((b - k) / (s.a + eta) - 1) / 2
    p = half + mpmath.sqrt(half**2 - k / (s.a + eta))
    unit = s.star / s.lengths[0]
    numbers = {"growth_rate": p.real * unit, "angular_frequency": abs(p.imag) * unit}
    return numbers | {"critical_stiffness": (b - s.a - eta) * scale}


def displacement_excess(problem: dict[str, Any]) -> Callable[[Any], Any]:
    """Return the function ``displacement -> excess`` for the equations."""

    def excess(displacement: Any) -> Any:
        way = StatedEquations(problem)
        tau, *others = way.enter(way.begin(), mpmath.mpf(0), way.s.sigma)
        return peak_excess(way, [tau + way.s.k * displacement, *others])

    return excess


def solve_by_secant(excess: Callable[[Any], Any], near: Any) -> Any:
    """Return the root of a function near a starting value."""
    first, second = near, near * (1 + mpmath.mpf("1e-9"))
    at_first, at_second = excess(first), excess(second)
    for _ in range(12):
        third = second - at_second * (second - first) / (at_second - at_first)
        if abs(third - second) <= mpmath.mpf("1e-17") * abs(third):
            break
        first, at_first, second, at_second = second, at_second, third, excess(third)
    return third


def first_way_numbers(problem: dict[str, Any]) -> Numbers:
    """Return numbers from closed forms, or from the stated equations."""
    (name, *_others) = problem["quantities"]
    if name == "critical_stiffness":
        two = problem["law"] == "two_slip_states"
        return (two_state_closed_form if two else growth_closed_form)(problem)
    if name == "critical_velocity":
        return {
            name: solve_by_secant(velocity_excess(StatedEquations, problem), mpmath.mpf("2.967e-6"))
        }
    if name == "critical_displacement":
        near = mpmath.mpf(repr(displacement_by_quadrature(problem)))
        return {name: solve_by_secant(displacement_excess(problem), near)}
    return damped_cycle(StatedEquations, problem, 1e-15)


def first_way_rows(problem: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of an answer, with 30 digits."""
    return (
        [first_way_numbers(problem)]
        if problem["report"] == "numbers"
        else rows_by_way(StatedEquations, problem)
    )


def format_number(name: str, value: Any, problem: dict[str, Any]) -> str:
    """Return a number with the digits of the problem.

    The first column identifies the row and has 12 digits.
    """
    if name == columns(problem)[0] and problem["report"] != "numbers":
        return f"{float(value):.12g}"
    if value == 0:
        return "0"
    digits = problem["digits"]
    return mpmath.nstr(mpmath.mpf(value), digits, strip_zeros=False, min_fixed=0, max_fixed=0)


def write_answers(path: Path) -> None:
    """Write the answers to a problem, and print digits that differ."""
    problem = read_stated_problem(path)
    names = columns(problem)
    first, second = first_way_rows(problem), second_way_rows(problem)
    rows = [[format_number(name, row[name], problem) for name in names] for row in first]
    for row, other in zip(rows, second, strict=True):
        for name, told in zip(names, row, strict=True):
            if not rounds_to(told, other[name]) and name not in ("event",):
                print("  differ:", path.stem, name, told, other[name])
    with path.with_suffix(".csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([f"{name} ({UNITS[name]})" for name in names])
        table.writerows(rows)
    print(path.stem, flush=True)


if __name__ == "__main__":
    mpmath.mp.dps = 30
    for each in sorted(PROBLEMS.glob("*.toml")):
        if len(sys.argv) == 1 or each.name[:2] in sys.argv[1:]:
            write_answers(each)
