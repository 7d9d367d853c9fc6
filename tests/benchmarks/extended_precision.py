"""Reference values with extended precision, independent of the package.

The unknowns are those of the paper: the stress deviation f, x = ln(V/V_*) and Theta. The
integrator uses extrapolated modified midpoint steps (Gragg, Bulirsch and Stoer) of order 14
in ``numpy.longdouble``, whose mantissa has 64 bits. Below a slip rate norm w, the motion
follows the slow manifold. At constant normal stress, the error of this approximation is
proportional to w**4, and Richardson extrapolation with two values of w removes it.

``python tests/benchmarks/extended_precision.py`` prints the reference values of
``studies/_reference_values.py``. The computation takes minutes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rsfstudy.named_studies.hard_cases import CASES

LongDouble = np.longdouble
State = np.ndarray
Rates = Callable[[State], State]

_A, _MU = LongDouble("0.0145"), LongDouble("0.76")
_INERTIAL_TIME = LongDouble(5) * LongDouble("1.17e-8") / (2 * np.arccos(LongDouble(-1)))
_ZERO = LongDouble(0)
_SEQUENCE = (2, 4, 6, 8, 10, 12, 14)


@dataclass(frozen=True)
class Slider:
    """Slider of the paper with extended precision.

    The driving angle is represented by its cotangent.
    """

    law: str
    cot_phi: np.longdouble
    alpha: np.longdouble
    stiffness: np.longdouble
    load: np.longdouble
    b: np.longdouble
    a: np.longdouble = _A
    mu: np.longdouble = _MU
    inertial_time: np.longdouble = _INERTIAL_TIME

    def evolution(self, x: np.longdouble, theta: np.longdouble) -> np.longdouble:
        """Return the rate of the state per slip at constant normal stress."""
        if self.law == "slip":
            return -(theta + self.b * x)
        return self.b * np.expm1(-(theta / self.b + x))

    def friction(self, x: np.longdouble, theta: np.longdouble) -> np.longdouble:
        """Return the frictional stress deviation, (a x + Theta)/(1 - F c)."""
        excess = self.a * x + theta
        return excess / (1 - (self.mu + excess) * self.cot_phi)

    def slow(self, state: State) -> State:
        """Return the rates of (f, Theta, t) on the slow manifold.

        The independent variable is the sum of slip and load point displacement.
        """
        f, theta = state[0], state[1]
        g = self.slow_friction(f, self.rate_at(f, theta), theta)
        x = self.rate_at(g, theta)
        _growth, loading, evolving = self._slow_growth(g, x, theta)
        return np.array([loading, evolving, 1 / (np.exp(x) + self.load)])

    def slow_friction(
        self, f: np.longdouble, x: np.longdouble, theta: np.longdouble
    ) -> np.longdouble:
        """Return the frictional stress on the slow manifold.

        The stress is f - K w (w + w_0) dx/ds.
        """
        growth = self._slow_growth(f, x, theta)[0]
        v, scale = np.exp(x), self.stiffness * self.inertial_time**2
        return f - scale * v * (v + self.load) * growth

    def rate_at(self, g: np.longdouble, theta: np.longdouble) -> np.longdouble:
        """Return ln(V/V_*) at a frictional stress and a state."""
        return (g * (1 - self.mu * self.cot_phi) / (1 + self.cot_phi * g) - theta) / self.a

    def _slow_growth(
        self, g: np.longdouble, x: np.longdouble, theta: np.longdouble
    ) -> tuple[np.longdouble, np.longdouble, np.longdouble]:
        """Return the quasi-static rates dx, df and dTheta.

        The independent variable is the sum of slip and load point displacement.
        """
        c, v = self.cot_phi, np.exp(x)
        share, s = v / (v + self.load), 1 + c * g
        loading = self.stiffness * (self.load - v) / (v + self.load)
        evolving = share * self.evolution(x, theta) - self.alpha * c * loading / s
        return ((1 - self.mu * c) / s**2 * loading - evolving) / self.a, loading, evolving

    def fast(self, state: State) -> State:
        """Return the rates of (f, x, Theta) per inertial time."""
        f, x, theta = state
        w = np.exp(x) * self.inertial_time
        excess = self.a * x + theta
        support = 1 - (self.mu + excess) * self.cot_phi
        growth = (f - excess / support) / (self.stiffness * w)
        coupling = self.alpha * self.cot_phi / support
        evolving = (w * self.evolution(x, theta) - coupling * self.a * growth) / (1 + coupling)
        return np.array([self.stiffness * (self.load * self.inertial_time - w), growth, evolving])


def extrapolated_step(
    rates: Rates, state: State, first: State, size: np.longdouble
) -> tuple[State, float]:
    """Return the result of an extrapolated step, and its scaled error."""
    rows: list[State] = []
    table: list[State] = []
    for count in _SEQUENCE:
        h = size / count
        before, now = state, state + h * first
        for _ in range(count - 1):
            before, now = now, before + 2 * h * rates(now)
        table = [(before + now + h * rates(now)) / 2, *table]
        for j in range(1, len(table)):
            ratio = (LongDouble(count) / _SEQUENCE[len(table) - 1 - j]) ** 2
            table[j] = table[j - 1] + (table[j - 1] - table[j]) / (ratio - 1)
        rows.append(table[-1])
    return rows[-1], float((np.abs(rows[-1] - rows[-2]) / (1 + np.abs(rows[-1]))).max())


def integrate_steps(
    rates: Rates, state: State, tolerance: float
) -> Iterator[tuple[State, State, np.longdouble]]:
    """Yield the states before and after each step, and the step size."""
    size = LongDouble("1e-3")
    while True:
        first = rates(state)
        while True:
            ahead, error = extrapolated_step(rates, state, first, size)
            if error <= tolerance:
                break
            shrink = 0.8 * (tolerance / error) ** (1 / 13) if np.isfinite(error) else 0.2
            size = size * LongDouble(max(0.2, shrink))
        yield state, ahead, size
        state = ahead
        size = size * LongDouble(min(3.0, 0.8 * (tolerance / max(error, 1e-40)) ** (1 / 13)))


def locate_zero(
    rates: Rates, state: State, size: np.longdouble, what: Callable[[State], np.longdouble]
) -> tuple[np.longdouble, State]:
    """Return the fraction of a step after which ``what(state)`` is zero.

    The function applies the secant method to the step size, and also returns the state
    there.
    """
    first = rates(state)
    low, high = LongDouble(0), size
    at_low, at_high = what(state), what(extrapolated_step(rates, state, first, size)[0])
    side = 0
    for _ in range(200):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        found = extrapolated_step(rates, state, first, middle)[0]
        value = what(found)
        if (
            value == 0
            or abs(high - low) <= LongDouble("1e-18") * abs(size)
            or abs(value) < LongDouble("1e-18")
        ):
            return middle, found
        if value * at_low > 0:
            low, at_low = middle, value
            at_high = at_high / 2 if side == 1 else at_high
            side = 1
        else:
            high, at_high = middle, value
            at_low = at_low / 2 if side == -1 else at_low
            side = -1
    return middle, found


class Motion:
    """Cycles of a slider with a switch between two forms of the equations.

    Below a slip rate norm, the motion follows the slow manifold. Above the norm, the full
    equations are integrated.
    """

    def __init__(self, slider: Slider, norm: float, tolerance: float) -> None:
        self.slider, self.tolerance = slider, tolerance
        self.switch = np.log(LongDouble(norm) / slider.inertial_time)
        self.load = np.log(slider.load)
        self.began = self.top = self.lowest = self.at_peak = LongDouble(0)
        self.events = 0

    def numbers(self, count: int) -> np.ndarray:
        """Return the recurrence interval and the stress drops of a cycle.

        The stress drops are the static and the dynamic stress drop.
        """
        nudge = self.slider.stiffness / 10 if self.slider.load == 1 else LongDouble(0)
        state = np.array([nudge, LongDouble(0), LongDouble(0)])
        while True:
            state, done = self._slow(state, count)
            if done:
                interval = state[2] - self.began
                return np.array([interval, self.top - self.lowest, self.top - self.at_peak])
            state = self._fast(state)

    def _slow_rate(self, y: State) -> np.longdouble:
        return self.slider.rate_at(y[0], y[1])

    def _slow(self, state: State, count: int) -> tuple[State, bool]:
        rates, load = self.slider.slow, self.load
        for before, after, size in integrate_steps(rates, state, self.tolerance):
            x0, x1 = self._slow_rate(before), self._slow_rate(after)
            if (x0 - load) * (x1 - load) <= 0:
                turning = locate_zero(rates, before, size, lambda y: self._slow_rate(y) - load)[1]
                self.lowest = min(self.lowest, turning[0])
                if x0 < load:
                    if self.events == count:
                        return turning, True
                    self.events, self.began = self.events + 1, turning[2]
                    self.top = self.lowest = turning[0]
            if x1 >= self.switch:
                return locate_zero(rates, before, size, lambda y: self._slow_rate(y) - self.switch)[
                    1
                ], False
        raise AssertionError

    def _fast(self, start: State) -> State:
        slider, load = self.slider, self.load
        x = slider.rate_at(start[0], start[1])
        friction = slider.slow_friction(start[0], x, start[1])
        state = np.array([start[0], slider.rate_at(friction, start[1]), start[1]])
        elapsed, falls = LongDouble(0), False
        for before, after, size in integrate_steps(slider.fast, state, self.tolerance):
            elapsed = elapsed + size
            growth = slider.fast(before)[1], slider.fast(after)[1]
            if growth[0] > 0 >= growth[1]:
                self.at_peak = locate_zero(slider.fast, before, size, lambda y: slider.fast(y)[1])[
                    1
                ][0]
                falls = True
            if before[1] > load >= after[1]:
                turning = locate_zero(slider.fast, before, size, lambda y: y[1] - load)[1]
                self.lowest = min(self.lowest, turning[0])
            # The slider is at rest when the remaining slip to the slow manifold and the
            # remaining change of Theta with normal stress are below the rounding error.
            below = slider.rate_at(after[0], after[2])
            below = slider.rate_at(slider.slow_friction(after[0], below, after[2]), after[2])
            slip = slider.stiffness * (np.exp(after[1]) * slider.inertial_time) ** 2
            settled = abs(after[1] - below) < LongDouble("1e-12") or slider.cot_phi == 0
            left = slip * abs(after[1] - below) < LongDouble("1e-20")
            if falls and settled and left and after[1] < self.switch - 3:
                return np.array([after[0], after[2], start[2] + elapsed * slider.inertial_time])
        raise AssertionError


def cycle_numbers(slider: Slider, norm: float, count: int) -> dict[str, tuple[str, str]]:
    """Return the extrapolated values of a cycle, and their uncertainties.

    The uncertainty is the change by the extrapolation.
    """
    coarse, fine = (Motion(slider, w, 1e-16).numbers(count) for w in (norm, norm / 2))
    best = fine + (fine - coarse) / 15
    names = ("recurrence_interval", "static_stress_drop", "dynamic_stress_drop")
    return {
        name: (np.format_float_positional(value, 17), f"{float(moved):.1e}")
        for name, value, moved in zip(names, best, np.abs(best - fine), strict=True)
    }


def critical_velocity(slider: Slider, norm: float) -> np.longdouble:
    """Return the critical V_0/V_* without inertia.

    The motions are integrated forward in time. The function bisects between motions whose
    first peak exceeds the norm and motions whose first peak stays below it.
    """
    log_norm = np.log(LongDouble(norm) / slider.inertial_time)

    def reaches(load: np.longdouble) -> bool:
        loaded = replace(slider, load=load, inertial_time=LongDouble(0))

        def growth(y: State) -> np.longdouble:
            x = loaded.rate_at(y[0], y[1])
            return loaded._slow_growth(y[0], x, y[1])[0]

        for before, after, size in integrate_steps(
            loaded.slow, np.array([LongDouble(0), LongDouble(0), LongDouble(0)]), 1e-16
        ):
            if loaded.rate_at(after[0], after[1]) >= log_norm:
                return True
            if growth(before) > 0 >= growth(after):
                peak = locate_zero(loaded.slow, before, size, growth)[1]
                return bool(loaded.rate_at(peak[0], peak[1]) >= log_norm)
        raise AssertionError

    low, high = LongDouble(1) + LongDouble("1e-3"), LongDouble(200)
    for _ in range(66):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if reaches(middle) else (middle, high)
    return middle


def paper_slider(law: str, *, constant: bool, ratio: str = "0.8", load: str = "2") -> Slider:
    """Return the slider of Figs. 9 and 10 of the paper.

    Its parameters are b/a = 2, k = 0.8 k_cr and V_0 = 2 V_*.
    """
    if constant:
        return make_slider(law, ratio=ratio, load=load)
    return make_slider(
        law, ratio=ratio, load=load, cot_phi=1 / np.sqrt(LongDouble(3)), alpha="0.56"
    )


def make_slider(
    law: str = "slip",
    *,
    ratio: str = "1",
    load: str = "2",
    cot_phi: np.longdouble = _ZERO,
    alpha: str = "0",
    a: str = "0.0145",
    b_over_a: str = "2",
    period: str = "5",
) -> Slider:
    """Return a slider with the given scene parameters."""
    direct, state = LongDouble(a), LongDouble(alpha)
    critical = direct * (LongDouble(b_over_a) - 1) / (1 - cot_phi * (_MU - state))
    return Slider(
        law,
        cot_phi,
        state,
        LongDouble(ratio) * critical,
        LongDouble(load),
        direct * LongDouble(b_over_a),
        direct,
        inertial_time=_INERTIAL_TIME * LongDouble(period) / 5,
    )


#: Critical velocities of ``hard_cases``: parameters that differ from the slip law with k = k_cr
#: and b/a = 2.
_ANGLE_60 = {"cot_phi": 1 / np.sqrt(LongDouble(3)), "alpha": "0.56"}
_STEEP_COT_PHI = 1 / np.tan(np.arctan(_MU) + LongDouble("0.01") * np.arccos(LongDouble(-1)) / 180)
HARD_STEPS = {
    "lambda = 0.01": {"b_over_a": "1.01"},
    "lambda = 20": {"b_over_a": "21"},
    "a = 1e-4": {**_ANGLE_60, "a": "1e-4"},
    "a = 0.1": {**_ANGLE_60, "a": "0.1"},
    "alpha = 0": {**_ANGLE_60, "alpha": "0"},
    "alpha = mu_*": {**_ANGLE_60, "alpha": "0.76"},
    "alpha = 1": {**_ANGLE_60, "alpha": "1"},
    "phi = atan(mu_*) + 0.01": {"cot_phi": _STEEP_COT_PHI, "alpha": "0.56"},
    "T = 1e-6 s": {**_ANGLE_60, "period": "1e-6"},
    "T = 1e4 s": {**_ANGLE_60, "period": "1e4"},
}
#: Limit cycles of ``hard_cases`` for the slip law at constant normal stress.
HARD_CYCLES = {
    "k = 0.99 k_cr": {"ratio": "0.99"},
    "V_0 = V_*": {"ratio": "0.8", "load": "1"},
    "T = 1e-6 s": {"ratio": "0.8", "period": "1e-6"},
    "T = 1e4 s": {"ratio": "0.8", "period": "1e4"},
}
#: Limit cycles of ``hard_cases`` with arbitrary parameters. Each entry contains the number of the
#: cycle and two switch norms. At variable normal stress, the error of the switch is proportional
#: to the square of the norm.
DEEP_CYCLES = {
    "slip law, down to 10^-137 V_*": (4, ("2.5e-4", "1.25e-4")),
    "slowness law, down to 10^-1745 V_*": (9, ("1e-3", "5e-4")),
}


def slider_from_fields(fields: Mapping[str, Any]) -> Slider:
    """Return the slider of a scene with variable normal stress."""
    a, mu, alpha = (LongDouble(fields[name]) for name in ("a", "mu_star", "alpha"))
    cot_phi = 1 / np.tan(LongDouble(fields["phi"]) * np.arccos(LongDouble(-1)) / 180)
    b = a * LongDouble(fields["b_over_a"])
    stiffness = LongDouble(fields["stiffness_ratio"]) * (b - a) / (1 - cot_phi * (mu - alpha))
    inertial_time = (
        LongDouble(fields["period"])
        * LongDouble(fields["reference_rate"])
        / (2 * np.arccos(LongDouble(-1)))
    )
    load = LongDouble(fields["load_velocity_ratio"])
    return Slider(fields["law"], cot_phi, alpha, stiffness, load, b, a, mu, inertial_time)


def deep_cycle(fields: Mapping[str, Any], count: int, norms: tuple[str, str]) -> np.longdouble:
    """Return the recurrence interval, extrapolated to a switch norm of 0."""
    coarse, fine = (
        Motion(slider_from_fields(fields), float(w), 1e-16).numbers(count)[0] for w in norms
    )
    return fine + (fine - coarse) / 3


if __name__ == "__main__":
    for ratio in ("1.25", "1"):
        for constant in (True, False):
            still = paper_slider("slip", constant=constant, ratio=ratio)
            print(ratio, constant, "critical velocity", critical_velocity(still, 5e-4), flush=True)
    for law, count in (("slip", 4), ("slowness", 14)):
        for norm in (0.02, 0.01):
            print(
                law,
                "switch at",
                norm,
                cycle_numbers(paper_slider(law, constant=True), norm, count),
                flush=True,
            )
    for label, fields in HARD_STEPS.items():
        print(
            label, "critical velocity", critical_velocity(make_slider(**fields), 5e-4), flush=True
        )
    for label, fields in HARD_CYCLES.items():
        print(label, cycle_numbers(make_slider(**fields), 0.02, 8), flush=True)
    for label, (count, norms) in DEEP_CYCLES.items():
        print(label, deep_cycle(CASES[label][0], count, norms), flush=True)
