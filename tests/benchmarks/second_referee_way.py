"""Second method for the answers of the referee, independent of the package.

The method shares neither equations nor arithmetic with the first method in
``referee_answers.py``. The friction law is differentiated. The unknowns are ln(V/V_*), the
logarithms of theta, the stress deviation and the slip, all dimensionless and in double
precision. The integrator uses extrapolated modified midpoint steps (Gragg, Bulirsch and
Stoer) of order 14.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import mpmath

import rsfstudy

PROBLEMS = Path(rsfstudy.__file__).parent / "referee" / "problems"
State = list[Any]
Rates = Callable[[Any, State], State]


def read_stated_problem(path: Path) -> dict[str, Any]:
    """Return the contents of a problem file."""
    return tomllib.loads(path.read_text())


def strip_units(value: Any) -> Any:
    """Return a number without its unit, which is always an SI unit."""
    return value.split()[0] if isinstance(value, str) else value


# ---- integration ---------------------------------------------------------------------------------


class ExtrapolatedSteps:
    """Extrapolated midpoint steps of adaptive size, in any arithmetic."""

    def __init__(self, order: int, tolerance: Any, scales: Sequence[Any]) -> None:
        self.sequence = tuple(range(2, order + 1, 2))
        self.tolerance, self.scales = tolerance, scales

    def step(self, rates: Rates, t: Any, y: State, h: Any, first: State) -> tuple[State, Any]:
        """Return the state after a step, and its scaled error.

        The sums use increments, because increments keep more digits.
        """
        table: list[State] = []

        def slope(i: Any, moved: State) -> State:
            return rates(t + i, [a + b for a, b in zip(y, moved, strict=True)])

        for count in self.sequence:
            part = h / count
            before, now = [0 * a for a in y], [part * b for b in first]
            for i in range(1, count):
                by = zip(before, slope(i * part, now), strict=True)
                before, now = now, [a + 2 * part * b for a, b in by]
            ends = zip(before, now, slope(h, now), strict=True)
            table = [[(a + b + part * c) / 2 for a, b, c in ends], *table]
            last = table[-1]
            for j in range(1, len(table)):
                other = self.sequence[len(table) - 1 - j]
                over = count * count - other * other
                gain = other * other
                table[j] = [
                    a + (a - b) * gain / over for a, b in zip(table[j - 1], table[j], strict=True)
                ]
        off = zip(table[-1], last, self.scales, strict=True)
        after = [a + b for a, b in zip(y, table[-1], strict=True)]
        return after, max(abs(a - b) / c for a, b, c in off)

    def path(self, rates: Rates, t: Any, y: State, until: Any, h: Any) -> Iterator[tuple[Any, ...]]:
        """Yield the time, the state and the size of each step up to a time.

        The last item contains the final time and state.
        """
        grows = 1.0 / (2 * len(self.sequence) - 1)
        while t < until:
            first = rates(t, y)
            while True:
                ends = t + h >= until
                taken = until - t if ends else h
                try:
                    after, error = self.step(rates, t, y, taken, first)
                    size = float(error / self.tolerance)
                except (ArithmeticError, ValueError, TypeError):  # The trial step overflows.
                    size = math.inf
                if size <= 1.0:
                    break
                h = taken * max(0.2, 0.8 * size**-grows)
            yield t, y, taken
            t, y = until if ends else t + taken, after
            h = taken * min(3.0, 0.8 * max(size, 1e-30) ** -grows)
        yield t, y, None

    def advance_to(self, rates: Rates, t: Any, y: State, until: Any) -> State:
        """Return the state at a later time."""
        *_others, (_t, y, _h) = self.path(rates, t, y, until, until - t)
        return y


# ---- what a problem states -----------------------------------------------------------------------


class ProblemSlider:
    """Parameters of a problem in a given arithmetic.

    The function ``number`` creates numbers, and the module ``m`` contains exp and log.
    """

    def __init__(self, problem: dict[str, Any], m: Any, number: Callable[[Any], Any]) -> None:
        self.m, self.problem, self.law = m, problem, problem["law"]
        given = {
            n: v if isinstance(v, bool) else strip_units(v)
            for n, v in problem["parameters"].items()
        }

        def of(name: str, other: Any = 0) -> Any:
            return number(given.get(name, other))

        self.a, self.mu, self.sigma = of("a"), of("mu_star"), of("normal_stress")
        self.star, self.k, self.eta = of("V_star"), of("stiffness"), of("radiation_damping")
        self.alpha, self.c = of("alpha"), of("stress_dependence")
        self.eps, self.cutoff = of("law_exponent"), of("V_c")
        self.dilatancy, self.drainage = of("dilatancy"), of("drainage")
        self.amplitude, self.turn = of("oscillation_amplitude"), of("oscillation_period", 1)
        self.mass = self.k * (of("period") / (2 * m.pi)) ** 2
        self.regularised = bool(given.get("regularised"))
        self.cot = 1 / m.tan(of("phi") * m.pi / 180) if "phi" in given else number(0)
        pairs = [("b", "D_c"), ("b_2", "D_c_2")][: 1 + ("b_2" in given)]
        self.b, self.lengths = zip(*((of(b), of(d)) for b, d in pairs), strict=True)
        factor = 2 if self.law == "perrin_rice_zheng" else 1
        if self.law == "composite":
            factor = m.exp(composite_rest_state(m.exp(-self.star / self.cutoff), m))
        self.theta_star = [factor * length / self.star for length in self.lengths]
        size = sum(abs(b) for b in self.b)
        self.shares = [abs(b) / size for b in self.b]
        self.number, self.given = number, given

    def evolution(self, velocity: Any, theta: Any, length: Any, healing: Any) -> Any:
        """Return dtheta/dt as in the problem statements."""
        omega, m = velocity * theta / length, self.m
        if self.law in ("slowness", "two_slowness_states"):
            return 1 - omega
        if self.law in ("slip", "two_slip_states"):
            return -omega * m.log(omega)
        if self.law == "perrin_rice_zheng":
            return 1 - (omega / 2) ** 2
        if self.law == "family":
            return omega * (omega ** (-self.eps) - 1) / self.eps
        return healing - omega * m.log(omega)

    def segments(self) -> list[tuple[Any, Any, Any]]:
        """Return start, velocity and normal stress of each loading segment."""
        found, begins, sigma = [], self.number(0), self.sigma
        for segment in self.problem.get("loading") or [{"velocity": self.star}]:
            sigma = self.number(strip_units(segment.get("normal_stress", sigma)))
            found.append((begins, self.number(strip_units(segment["velocity"])), sigma))
            begins = begins + self.number(strip_units(segment.get("duration", 0)))
        return found

    def initial(self) -> tuple[Any, list[Any]]:
        """Return the initial slip rate and state variables."""
        stated = self.problem.get("initial")
        if not stated:
            return self.star, list(self.theta_star)
        thetas = stated["theta"] if isinstance(stated["theta"], list) else [stated["theta"]]
        return self.number(strip_units(stated["slip_rate"])), [
            self.number(strip_units(x)) for x in thetas
        ]


def composite_rest_state(healing: Any, m: Any) -> Any:
    """Return the solution of u exp(u) = healing, by Newton's method."""
    u = healing / 2
    for _ in range(60):
        u = u - (u * m.exp(u) - healing) / (m.exp(u) * (1 + u))
    return u


# ---- logarithms, in double precision -------------------------------------------------------------


class LogarithmicEquations:
    """Equations in logarithmic variables.

    The unknowns are ln(V/V_*), Theta of each state, the deviation of spring stress over
    sigma_*, slip in D_c, and phi and p over sigma_*. Time is in D_c/V_*.
    """

    def __init__(self, problem: dict[str, Any]) -> None:
        self.s = s = ProblemSlider(problem, math, float)
        self.load, self.imposed = 1.0, 1.0
        self.k, self.eta = s.k * s.lengths[0] / s.sigma, s.eta * s.star / s.sigma
        self.unit = s.lengths[0] / s.star
        self.mass = s.mass * s.star / (s.sigma * self.unit)
        scales = [1.0, *[s.a] * len(s.b), s.a, 1.0, s.a, s.a]
        self.steps = ExtrapolatedSteps(14, 1e-14, scales)
        self.rest = math.log(s.theta_star[0] * s.star / s.lengths[0])

    def begin(self) -> State:
        """Return the initial unknowns."""
        s = self.s
        rate, thetas = s.initial()
        parts = zip(s.b, thetas, s.theta_star, strict=True)
        states = [b * math.log(theta / star) for b, theta, star in parts]
        x = math.log(rate / s.star)
        f = self._friction(x, sum(states)) - s.mu + self.eta * math.expm1(x)
        return [x, *states, f, 0.0, 0.0, 0.0]

    def _friction(self, x: float, state: float) -> float:
        s = self.s
        if s.regularised:
            return s.a * math.asinh(0.5 * math.exp(x + (s.mu + state) / s.a))
        return s.mu + s.a * x + state

    def _evolution(self, u: float, v: float) -> float:
        """Return dTheta/d(slip) over b.

        The argument u is ln(theta V/D_c), or ln(theta V/(2 D_c)) for the law of Perrin,
        Rice and Zheng.
        """
        s = self.s
        if s.law in ("slip", "two_slip_states"):
            return -u
        if s.law == "perrin_rice_zheng":
            return -math.sinh(u)
        if s.law == "family":
            return math.expm1(-s.eps * u) / s.eps
        if s.law == "composite":
            u += self.rest
            return math.exp(-v * s.star / s.cutoff - u) - u
        return math.expm1(-u)

    def _stress(self, t: float, f: float, p: float) -> tuple[float, float]:
        s = self.s
        sigma = self.imposed + s.cot * f - p
        if not s.amplitude:
            return sigma, 0.0
        angle, size = 2.0 * math.pi * self.unit / s.turn, s.amplitude / s.sigma
        return sigma + size * math.sin(angle * t), size * angle * math.cos(angle * t)

    def rates(self, t: float, y: State) -> State:
        """Return the rates of the unknowns."""
        s, count = self.s, len(self.s.b)
        x, states, f, phi, p = y[0], y[1 : 1 + count], y[1 + count], y[3 + count], y[4 + count]
        v = math.exp(x)
        sigma, imposed = self._stress(t, f, p)
        loading = self.k * (self.load - v)
        opening = -v * (phi - s.dilatancy / s.sigma * x)
        draining = -s.drainage * self.unit * p - opening
        pressed = imposed + s.cot * loading
        taken = (s.alpha * pressed + s.c * loading) / sigma
        parts = zip(states, s.b, s.lengths, s.shares, strict=True)
        evolving = [
            v * s.lengths[0] / length * b * self._evolution(state / b + x, v) - share * taken
            for state, b, length, share in parts
        ]
        mu = self._friction(x, sum(states))
        steep = math.tanh(mu / s.a) if s.regularised else 1.0
        left = loading - mu * (pressed - draining) - sigma * steep * sum(evolving)
        growth = left / (sigma * steep * s.a + self.eta * v)
        if s.mass:
            # This equation assumes constant normal stress.
            growth = (f - s.a * x - sum(states)) / (self.mass * v)
        return [growth, *evolving, loading, v, opening, draining]

    def growth(self, t: float, y: State) -> float:
        """Return d(ln V)/dt."""
        return self.rates(t, y)[0]

    def now(self, t: float, y: State) -> dict[str, float]:
        """Return the reported quantities in SI units."""
        s, count = self.s, len(self.s.b)
        parts = zip(s.theta_star, y[1 : 1 + count], s.b, strict=True)
        thetas = [star * math.exp(state / b) for star, state, b in parts]
        told = {"friction": self._friction(y[0], sum(y[1 : 1 + count]))}
        told |= {"slip_rate": s.star * math.exp(y[0]), "slip": s.lengths[0] * y[2 + count]}
        told |= {"theta": thetas[0], "theta_1": thetas[0], "theta_2": thetas[-1]}
        sigma = s.sigma * self._stress(t, y[1 + count], y[4 + count])[0]
        return told | {"normal_stress": sigma, "pore_pressure": s.sigma * y[4 + count]}

    def enter(self, y: State, velocity: float, sigma: float) -> State:
        """Return the unknowns at the beginning of a segment of loading."""
        s, count = self.s, len(self.s.b)
        ratio = sigma / s.sigma / self.imposed
        self.load, self.imposed = velocity / s.star, sigma / s.sigma
        parts = zip(y[1 : 1 + count], s.shares, strict=True)
        states = [state - share * s.alpha * math.log(ratio) for state, share in parts]
        # The slip rate at which friction balances the same stress.
        before = self._friction(y[0], sum(y[1 : 1 + count]))
        x = y[0] if ratio == 1.0 else (before / ratio - s.mu - sum(states)) / s.a
        return [x, *states, *y[1 + count :]]


# ---- answers -------------------------------------------------------------------------------------


def time_series(way: Any, unit: Any) -> list[dict[str, Any]]:
    """Return the rows of a method at the times of a problem.

    The argument ``unit`` is the unit of time of the method in s.
    """
    s, t, y, rows = way.s, way.s.number(0), way.begin(), []
    segments = s.segments()
    ends = [begins for begins, *_others in segments[1:]]
    asked = [s.number(str(time)) for time in s.problem["times"]]
    for begins, velocity, sigma in segments:
        y = way.enter(y, velocity, sigma)
        end = ends.pop(0) if ends else max(asked) + 1
        for time in [x for x in asked if begins <= x <= end and (x < end or x == max(asked))]:
            y = way.steps.advance_to(way.rates, t / unit, y, time / unit) if time > t else y
            t = time
            rows.append({"time": time, **way.now(t / unit, y)})
        if end <= max(asked):
            y = way.steps.advance_to(way.rates, t / unit, y, end / unit) if end > t else y
            t = end
    return rows


def peaks(way: Any, unit: Any) -> list[dict[str, Any]]:
    """Return the maxima of slip rate.

    The secant method locates each maximum within a step.
    """
    s, y, rows = way.s, way.begin(), []
    ((_begins, velocity, sigma),) = s.segments()
    y = way.enter(y, velocity, sigma)
    walk = way.steps.path(way.rates, s.number(0), y, s.number("1e300"), s.number(1) / unit)
    t, before, h = next(walk)
    for after_t, after, length in walk:
        if way.growth(t, before) > 0 >= way.growth(after_t, after):
            late, there = locate_extremum(way, t, before, h)
            told = way.now(t + late, there)
            rows.append({"event": len(rows) + 1, "time": (t + late) * unit} | told)
            if len(rows) == s.problem["count"]:
                return rows
        t, before, h = after_t, after, length
    raise AssertionError


def locate_extremum(way: Any, t: Any, y: State, h: Any, sign: int = 1) -> tuple[Any, State]:
    """Return the position of a maximum or minimum of slip rate in a step.

    The second return value is the state there.
    """
    first = way.rates(t, y)
    low, high, side = h * 0, h, 0
    at_low = sign * way.growth(t, y)
    at_high = sign * way.growth(t + h, way.steps.step(way.rates, t, y, h, first)[0])
    for _ in range(100):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        there = way.steps.step(way.rates, t, y, middle, first)[0]
        value = sign * way.growth(t + middle, there)
        if value == 0 or high - low <= 1e-17 * h or not low < middle < high:
            break
        if value > 0:
            low, at_low, at_high = middle, value, at_high / (2 if side == 1 else 1)
            side = 1
        else:
            high, at_high, at_low = middle, value, at_low / (2 if side == -1 else 1)
            side = -1
    return middle, there


def rows_by_way(way: type, problem: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of an answer for one of the two methods."""
    made = way(problem)
    unit = getattr(made, "unit", 1)
    return (time_series if problem["report"] == "series" else peaks)(made, unit)


def rounds_to(text: str, value: Any) -> bool:
    """Return True if a number rounds to a text.

    The number may be off by a tenth of the last digit.
    """
    mantissa, _, exponent = text.partition("e")
    place = mpmath.mpf(10) ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    return bool(abs(mpmath.mpf(value) - mpmath.mpf(text)) <= mpmath.mpf("0.6") * place)
