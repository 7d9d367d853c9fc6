"""Solver libraries, used as their documentation recommends.

See ``problem.cycle_function``.

All libraries use explicit methods of high order on non-stiff equations, and no library has
to detect events. If a library is not installed, ``prepare`` raises ImportError, and the
table shows this.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from contest.hand_written_loops import COMPILED, CycleNumbers, call_compiled, loop_over_problems
from contest.problem import Problem, cycle_function, equations, problem_arrays, unknown_scales


class Cyrk:
    """CyRK: its C++ solver, called from compiled code."""

    name = "CyRK"
    method = "DOP853"

    def prepare(self, law: str, variable: bool) -> None:
        """Compile the equations and the function that calls the solver."""
        import numba
        from CyRK import nb_diffeq_addr, nbsolve2_ivp

        ready = numba.njit(error_model="numpy")
        made = equations(COMPILED, law, variable, ready)
        of_slow, of_fast, method = made.slow, made.fast, self.method

        def slow_rate(dy, _clock, y, p):
            dy[0], dy[1], dy[2] = of_slow(y[0], y[1], p)

        def fast_rate(dy, _clock, y, p):
            dy[0], dy[1], dy[2] = of_fast(y[0], y[1], y[2], p)

        @ready
        def solved(address, y, span, p, tolerance, su, sv, sw):
            found = nbsolve2_ivp(
                address,
                (0.0, span),
                y,
                method=method,
                args=p,
                rtol=tolerance,
                atols=tolerance * np.array([su, sv, sw]),
                t_eval=np.array([span]),
            )
            if found.success:
                u, v, w = found.y[0, -1], found.y[1, -1], found.y[2, -1]
            else:
                u = v = w = np.nan
            found.free()
            return u, v, w

        address_slow, address_fast = nb_diffeq_addr(slow_rate), nb_diffeq_addr(fast_rate)

        @ready
        def slow(f, psi, t, span, p, tolerance):
            y = np.array([f, psi, t])
            return solved(address_slow, y, span, p, tolerance, p[0], p[0], 1.0)

        @ready
        def fast(f, x, g, span, p, tolerance):
            y = np.array([f, x, g])
            return solved(address_fast, y, span, p, tolerance, p[0], 1.0, p[0])

        cycle = cycle_function(made.balance, made.strength, slow, fast, ready)
        self._all = loop_over_problems(cycle, ready)

    def run(self, problems: list[Problem], tolerance: float) -> CycleNumbers:
        """Integrate one cycle of each problem."""
        return call_compiled(self._all, problems, tolerance)


class Numbalsoda:
    """numbalsoda: its DOP853, called from compiled code."""

    name = "numbalsoda"

    def prepare(self, law: str, variable: bool) -> None:
        """Compile the equations and the function that calls the solver."""
        import numba
        from numbalsoda import dop853, lsoda_sig

        ready = numba.njit(error_model="numpy")
        made = equations(COMPILED, law, variable, ready)
        of_slow, of_fast = made.slow, made.fast

        @numba.cfunc(lsoda_sig)
        def slow_rate(_clock, y, dy, p):
            dy[0], dy[1], dy[2] = of_slow(y[0], y[1], p)

        @numba.cfunc(lsoda_sig)
        def fast_rate(_clock, y, dy, p):
            dy[0], dy[1], dy[2] = of_fast(y[0], y[1], y[2], p)

        address_slow, address_fast = slow_rate.address, fast_rate.address

        @ready
        def solved(address, y, span, p, tolerance):
            at = np.array([0.0, span])
            found, _success = dop853(address, y, at, p, rtol=tolerance, atol=0.01 * tolerance)
            return found[-1, 0], found[-1, 1], found[-1, 2]

        @ready
        def slow(f, psi, t, span, p, tolerance):
            return solved(address_slow, np.array([f, psi, t]), span, p, tolerance)

        @ready
        def fast(f, x, g, span, p, tolerance):
            return solved(address_fast, np.array([f, x, g]), span, p, tolerance)

        cycle = cycle_function(made.balance, made.strength, slow, fast, ready)
        self._all = loop_over_problems(cycle, ready)

    def run(self, problems: list[Problem], tolerance: float) -> CycleNumbers:
        """Integrate one cycle of each problem."""
        return call_compiled(self._all, problems, tolerance)


class Sundae:
    """scikit-sundae: CVODE with Adams formulas for non-stiff problems.

    The equations are compiled.
    """

    name = "scikit-sundae"

    def prepare(self, law: str, variable: bool) -> None:
        """Compile the equations."""
        import numba
        from sksundae.cvode import CVODE

        from contest.hand_written_loops import FLOATS

        ready = numba.njit(error_model="numpy")
        made, plain = equations(COMPILED, law, variable, ready), equations(FLOATS, law, variable)
        of_slow, of_fast = made.slow, made.fast

        @ready
        def slow_rate(_clock, y, dy, p):
            dy[0], dy[1], dy[2] = of_slow(y[0], y[1], p)

        @ready
        def fast_rate(_clock, y, dy, p):
            dy[0], dy[1], dy[2] = of_fast(y[0], y[1], y[2], p)

        def solved(rate: Any, y: Any, span: float, p: Any, tolerance: float, of: Any) -> Any:
            solver = CVODE(
                rate,
                method="Adams",
                rtol=tolerance,
                atol=tolerance * np.array(of),
                userdata=tuple(p),
                max_num_steps=20_000,
            )
            solver.init_step(0.0, np.array(y))
            found = solver.step(span, tstop=span)
            if not found.success:
                raise RuntimeError(found.message)
            return tuple(found.y.ravel().tolist())

        def slow(f: float, psi: float, t: float, span: float, p: Any, tolerance: float) -> Any:
            return solved(slow_rate, (f, psi, t), span, p, tolerance, unknown_scales(p[0])[0])

        def fast(f: float, x: float, g: float, span: float, p: Any, tolerance: float) -> Any:
            return solved(fast_rate, (f, x, g), span, p, tolerance, unknown_scales(p[0])[1])

        self._cycle = cycle_function(plain.balance, plain.strength, slow, fast)

    def run(self, problems: list[Problem], tolerance: float) -> CycleNumbers:
        """Integrate one cycle of each problem."""
        return [
            self._cycle(it.begin.spring_stress, it.begin.psis[0], it.p, it.marks, tolerance)
            for it in problems
        ]


class Heyoka:
    """heyoka: Taylor series compiled for the equations.

    Each call integrates as many scenes as fit in a vector register of the processor.
    """

    name = "heyoka"

    def prepare(self, law: str, variable: bool) -> None:
        """Define the equations as symbolic expressions.

        The integrators are compiled later, once per tolerance.
        """
        import heyoka as hy

        symbols = SimpleNamespace(
            exp=hy.exp,
            log=hy.log,
            sqrt=hy.sqrt,
            expm1=lambda z: hy.exp(z) - 1.0,
            clamped=lambda value, _low, _high: value,
        )
        made = equations(symbols, law, variable)
        p = [hy.par[i] for i in range(10)]
        u, v, w = hy.make_vars("u", "v", "w")
        zero = 0.0 * u
        slow, fast = made.slow(u, v, p), made.fast(u, v, w, p)
        self._systems = [
            [(name, zero + rate) for name, rate in zip((u, v, w), rates, strict=True)]
            for rates in (slow, fast)
        ]
        self._wide = hy.recommended_simd_size()
        self._known: dict[Any, Any] = {}
        floats = SimpleNamespace(
            exp=np.exp, log=np.log, sqrt=np.sqrt, expm1=np.expm1, clamped=np.clip
        )
        plain = equations(floats, law, variable)

        def integrating(system: int) -> Any:
            def integrate(u: Any, v: Any, w: Any, span: Any, p: Any, tolerance: float) -> Any:
                moving = self._integrator(system, tolerance, len(u))
                single = len(u) == 1
                moving.state[:] = (u[0], v[0], w[0]) if single else (u, v, w)
                used = p[: len(moving.pars)]
                moving.pars[:] = used[:, 0] if single else used
                if single:
                    moving.time = 0.0
                    moving.propagate_until(float(span[0]))
                else:
                    moving.set_time(0.0)
                    moving.propagate_until(span)
                return moving.state.reshape(3, -1).copy()

            return integrate

        self._cycle = cycle_function(plain.balance, plain.strength, integrating(0), integrating(1))

    def _integrator(self, system: int, tolerance: float, wide: int) -> Any:
        import heyoka as hy

        key = system, tolerance, wide
        if key not in self._known:
            kind = hy.taylor_adaptive_batch if wide > 1 else hy.taylor_adaptive
            start = np.zeros((3, wide) if wide > 1 else 3)
            self._known[key] = kind(self._systems[system], start, tol=tolerance, fast_math=True)
        return self._known[key]

    def run(self, problems: list[Problem], tolerance: float) -> CycleNumbers:
        """Integrate one cycle of each problem."""
        every, found = problem_arrays(problems), []
        for first in range(0, len(problems), self._wide):
            starts, psis, p, marks = (of[..., first : first + self._wide] for of in every)
            found += list(zip(*self._cycle(starts, psis, p, marks, tolerance), strict=True))
        return [(float(x), float(y)) for x, y in found]


class Diffrax:
    """diffrax: Dopri8 in 64-bit floats.

    The whole cycle is compiled and mapped over scenes.
    """

    name = "diffrax"

    def prepare(self, law: str, variable: bool) -> None:
        """Trace and compile the cycle."""
        import diffrax
        import jax
        import jax.numpy as jnp

        jax.config.update("jax_enable_x64", True)
        numbers = SimpleNamespace(
            exp=jnp.exp, log=jnp.log, sqrt=jnp.sqrt, expm1=jnp.expm1, clamped=jnp.clip
        )
        made = equations(numbers, law, variable)

        def integrating(rate: Any, of: int) -> Any:
            def integrate(u: Any, v: Any, w: Any, span: Any, p: Any, tolerance: Any) -> Any:
                scale = jnp.stack([jnp.asarray(it) for it in unknown_scales(p[0])[of]])

                def scaled(_clock: Any, y: Any, p: Any) -> Any:
                    u, v, w = y * scale
                    return jnp.stack(rate(u, v, w, p)) / scale

                found = diffrax.diffeqsolve(
                    diffrax.ODETerm(scaled),
                    diffrax.Dopri8(),
                    0.0,
                    span,
                    None,
                    jnp.stack([u, v, w]) / scale,
                    p,
                    stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
                    max_steps=20_000,
                    adjoint=diffrax.ForwardMode(),
                    throw=False,
                )
                return tuple(found.ys[-1] * scale)

            return integrate

        slow = integrating(lambda u, v, _w, p: made.slow(u, v, p), 0)
        fast = integrating(made.fast, 1)
        cycle = cycle_function(made.balance, made.strength, slow, fast)
        self._all = jax.jit(jax.vmap(cycle, in_axes=(0, 0, 1, 1, None)))
        self._one = jax.jit(cycle)

    def run(self, problems: list[Problem], tolerance: float) -> CycleNumbers:
        """Integrate one cycle of each problem."""
        starts, psis, p, marks = problem_arrays(problems)
        if len(problems) == 1:
            interval, drop = self._one(starts[0], psis[0], p[:, 0], marks[:, 0], tolerance)
            return [(float(interval), float(drop))]
        intervals, drops = map(np.asarray, self._all(starts, psis, p, marks, tolerance))
        return list(zip(intervals.tolist(), drops.tolist(), strict=True))
