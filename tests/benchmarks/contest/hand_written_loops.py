"""Hand-written loops for this problem, in SciPy and in Numba."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.integrate import DOP853

from contest.problem import Problem, cycle_function, equations, problem_arrays, unknown_scales

CycleNumbers = list[tuple[float, float]]


def _clamped(value: float, low: float, high: float) -> float:
    return max(low, min(value, high))


#: Functions of floats that do not overflow in trial steps.
FLOATS = SimpleNamespace(
    exp=lambda z: math.exp(min(z, 700.0)),
    expm1=lambda z: math.expm1(min(z, 700.0)),
    log=math.log,
    sqrt=math.sqrt,
    clamped=_clamped,
    branches=True,
)
#: Functions with the same results that Numba can compile.
COMPILED = SimpleNamespace(
    exp=lambda z: math.exp(min(z, 700.0)),
    expm1=lambda z: math.expm1(min(z, 700.0)),
    log=lambda z: math.log(z),
    sqrt=lambda z: math.sqrt(z),
    clamped=lambda value, low, high: max(low, min(value, high)),
    branches=True,
)


class HandScipy:
    """Loop around SciPy's DOP853 that works on floats."""

    name = "SciPy loop by hand"

    def prepare(self, law: str, variable: bool) -> None:
        """Assemble the equations."""
        made = equations(FLOATS, law, variable)

        def integrated(rate: Any, y: tuple[float, ...], span: float, tolerance: float, of: Any):
            atol = tolerance * np.array(of)
            solver = DOP853(rate, 0.0, np.array(y), span, rtol=tolerance, atol=atol)
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                while solver.status == "running":
                    solver.step()
            return tuple(solver.y.tolist())

        def slow(f: float, psi: float, t: float, span: float, p: Any, tolerance: float) -> Any:
            def rate(_clock: float, y: np.ndarray) -> Any:
                now = y.tolist()
                return made.slow(now[0], now[1], p)

            return integrated(rate, (f, psi, t), span, tolerance, unknown_scales(p[0])[0])

        def fast(f: float, x: float, g: float, span: float, p: Any, tolerance: float) -> Any:
            def rate(_clock: float, y: np.ndarray) -> Any:
                now = y.tolist()
                return made.fast(now[0], now[1], now[2], p)

            return integrated(rate, (f, x, g), span, tolerance, unknown_scales(p[0])[1])

        self._cycle = cycle_function(made.balance, made.strength, slow, fast)

    def run(self, problems: list[Problem], tolerance: float) -> CycleNumbers:
        """Integrate one cycle of each problem."""
        return [
            self._cycle(it.begin.spring_stress, it.begin.psis[0], it.p, it.marks, tolerance)
            for it in problems
        ]


def _linear_combination_source(row: Any, names: str) -> str:
    """Return the source code of a linear combination of stages."""
    return " + ".join(f"{float(c)!r}*{names}{j}" for j, c in enumerate(row) if c) or "0.0"


def unrolled_source(rate: str) -> str:
    """Return the source code of an unrolled DOP853 for three unknowns.

    The only loop in the generated code is the loop over steps.
    """
    lines = [
        "def integrate(u, v, w, span, p, tolerance, su, sv, sw):",
        f"    du0, dv0, dw0 = {rate}",
        "    clock, length, rejected = 0.0, first(u, v, w, du0, dv0, dw0, span, tolerance), False",
        "    steps = 0",
        "    while clock < span:",
        "        steps += 1",
        "        if steps > 20_000:",
        "            return math.nan, v, w",
        "        length = min(length, span - clock)",
    ]
    for s in range(1, 13):
        row = DOP853.A[s, :s] if s < 12 else DOP853.B
        lines += [
            f"        {n}s = {n} + length*({_linear_combination_source(row, 'd' + n)})"
            for n in "uvw"
        ]
        made = rate.replace("u,", "us,").replace("v,", "vs,").replace("w,", "ws,")
        lines.append(f"        du{s}, dv{s}, dw{s} = {made}")
    for n in "uvw":
        lines += [
            f"        scale = tolerance*(s{n} + max(abs({n}), abs({n}s)))",
            f"        e5{n} = ({_linear_combination_source(DOP853.E5, 'd' + n)})/scale",
            f"        e3{n} = ({_linear_combination_source(DOP853.E3, 'd' + n)})/scale",
        ]
    lines += [
        "        fifth, third = e5u*e5u + e5v*e5v + e5w*e5w, e3u*e3u + e3v*e3v + e3w*e3w",
        "        error = length*fifth/math.sqrt(3.0*(fifth + 0.01*third) + 1e-300)",
        "        if error < 1.0:",
        "            clock = span if length >= span - clock else clock + length",
        "            u, v, w, du0, dv0, dw0 = us, vs, ws, du12, dv12, dw12",
        "            factor = min(10.0, 0.9*max(error, 1e-12)**-0.125)",
        "            length *= min(1.0, factor) if rejected else factor",
        "            rejected = False",
        "        else:",
        "            factor = 0.9*error**-0.125",
        "            length *= factor if factor > 0.2 else 0.2",
        "            rejected = True",
        "            if length < 1e-15*span:",
        "                return math.nan, v, w",
        "    return u, v, w",
    ]
    return "\n".join(lines)


class HandNumba:
    """DOP853 unrolled by hand, with inlined equations.

    The speed is close to the maximum for this method.
    """

    name = "Numba loop by hand"

    def prepare(self, law: str, variable: bool) -> None:
        """Generate the loops and compile them."""
        import numba

        ready = numba.njit(error_model="numpy")
        made = equations(COMPILED, law, variable, ready)

        @ready
        def first(u, v, w, du, dv, dw, span, tolerance):
            pace = max(abs(du), abs(dv), abs(dw)) + 1e-300
            return min(span, 0.1 * tolerance**0.125 * max(abs(u), abs(v), 0.01) / pace)

        def loop(rate: str) -> Any:
            names: dict[str, Any] = {"math": math, "first": first, "made": None}
            names["slow_rate"], names["fast_rate"] = made.slow, made.fast
            exec(unrolled_source(rate), names)
            return ready(names["integrate"])

        on_manifold, in_rupture = loop("slow_rate(u, v, p)"), loop("fast_rate(u, v, w, p)")

        @ready
        def slow(f, psi, t, span, p, tolerance):
            return on_manifold(f, psi, t, span, p, tolerance, p[0], p[0], 1.0)

        @ready
        def fast(f, x, g, span, p, tolerance):
            return in_rupture(f, x, g, span, p, tolerance, p[0], 1.0, p[0])

        cycle = cycle_function(made.balance, made.strength, slow, fast, ready)
        self._all = loop_over_problems(cycle, ready)

    def run(self, problems: list[Problem], tolerance: float) -> CycleNumbers:
        """Integrate one cycle of each problem."""
        return call_compiled(self._all, problems, tolerance)


def loop_over_problems(cycle: Any, ready: Any) -> Any:
    """Return a compiled function that integrates one cycle per problem."""

    @ready
    def every(starts, psis, p, marks, tolerance, result):
        for i in range(len(starts)):
            found = cycle(starts[i], psis[i], p[:, i].copy(), marks[:, i].copy(), tolerance)
            result[i, 0], result[i, 1] = found

    return every


def call_compiled(every: Any, problems: list[Problem], tolerance: float) -> CycleNumbers:
    """Call a compiled function and return its results as a list."""
    result = np.empty((len(problems), 2))
    every(*problem_arrays(problems), tolerance, result)
    return [tuple(row) for row in result.tolist()]
