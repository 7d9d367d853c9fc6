"""SciPy's integrators, one by regime: what takes the steps where nothing else is asked for."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from scipy.integrate import (
    BDF,
    DOP853,
    LSODA,
    RK23,
    RK45,
    OdeSolution,
    OdeSolver,
    Radau,
)

from rsfstudy.motion.layout import SLOW
from rsfstudy.motion.meter import Halt
from rsfstudy.motion.steppers import BUDGET_SPENT, NO_STEP, Stepper, order_eight
from rsfstudy.slider.equations import LONGEST_STEP, Equations
from rsfstudy.slider.parts import Numbers
from rsfstudy.status import Status

#: SciPy's integrators, by name.
METHODS: Mapping[str, type[OdeSolver]] = {
    method.__name__: method for method in (DOP853, RK45, RK23, Radau, BDF, LSODA)
}
DEFAULT_METHOD = "DOP853"


class _Spent(Exception):
    """The budget is, within a step."""


def _by_floats(dense: Any) -> Callable[[float], Iterable[float]]:
    """The unknowns at a clock by dense output; that of order eight as it says, operation by
    operation, but on floats: arrays of so few numbers take four times as long.
    """
    if type(dense).__name__ != "Dop853DenseOutput":
        values: Callable[[float], Iterable[float]] = dense
        return values
    began, length, ends = dense.t_old, dense.h, dense.y_old.tolist()
    columns = list(zip(*reversed(dense.F.tolist()), ends, strict=True))

    def unknowns(clock: float) -> list[float]:
        x = (clock - began) / length
        rest = 1.0 - x
        return [
            ((((((a * x + b) * rest + c) * x + d) * rest + e) * x + f) * rest + g) * x + begin
            for a, b, c, d, e, f, g, begin in columns
        ]

    return unknowns


class SciPyStepper(Stepper):
    """Steps by the integrators of SciPy."""

    name = "scipy"

    def __init__(self, systems: tuple[Equations, ...], methods: Mapping[str, str]) -> None:
        super().__init__(systems, methods)
        names = (methods.get(system.regime, DEFAULT_METHOD) for system in systems)
        self._methods = [METHODS[name] for name in names]
        self._solver: Any = None
        self._dense: Any = None
        self._most = math.inf

    def begin(self, motion: Any, space: Any) -> None:
        ends = 0.0, motion.direction * np.inf
        # the longest first step is asked of a trial step, which may leave the domain
        begin, known = np.array(space.y[: space.unknowns]), motion.length
        first = {"first_step": known} if known else {}
        self._solver = self._solves(motion, space, ends, begin, **first)
        space.rates[: space.unknowns] = self._rates()

    def attempt(self, motion: Any, space: Any, longest: float) -> float:
        motion.pace = 0.0
        if self._solver.status == "finished":  # a step that was taken anew
            ends = motion.clock, motion.direction * np.inf
            begin, length = np.array(space.y[: space.unknowns]), abs(motion.length)
            self._solver = self._solves(motion, space, ends, begin, first_step=length)
        solver = self._solver
        solver.max_step = longest
        if motion.length and isinstance(solver, DOP853):  # it may have been too long for a kink
            solver.h_abs = motion.length
        if not self._step(motion, solver):
            return BUDGET_SPENT
        if solver.status == "failed":
            return NO_STEP
        if motion.spent_slow + motion.spent_fast > motion.budget:
            return BUDGET_SPENT
        motion.end, self._dense = float(solver.t), None
        motion.taken = motion.end - motion.clock
        motion.length = float(getattr(solver, "h_abs", abs(motion.taken)))
        self._fill(space)
        return abs(float(motion.taken))

    def reach(self, motion: Any, space: Any, length: float) -> float:
        if not isinstance(self._solver, DOP853):
            return 0.0
        self._dense = None
        taken: float = order_eight.reach(motion, space, length)  # type: ignore[no-untyped-call]
        return taken

    def unknowns_at(self, motion: Any, space: Any, clock: float) -> None:
        if motion.pace > 0.0:
            order_eight.unknowns_at(motion, space, clock)  # type: ignore[no-untyped-call]
            return
        if self._dense is None:
            self._dense = _by_floats(self._solver.dense_output())
        for i, unknown in enumerate(self._dense(clock)):
            space.within[i] = unknown

    def retake(self, motion: Any, space: Any, clock: float) -> None:
        begin, motion.pace = np.array(space.y[: space.unknowns]), 0.0
        # the clock may round to where the step begins; an integrator wants a way to go
        end = clock if clock != motion.clock else np.nextafter(clock, motion.direction * np.inf)
        length, ends = abs(end - motion.clock), (motion.clock, end)
        self._solver = solver = self._solves(motion, space, ends, begin, first_step=length)
        clocks, within = [motion.clock], []
        while solver.status == "running":
            if not self._step(motion, solver) or solver.status == "failed":
                raise Halt(Status.INTEGRATION_FAILED, f"a step cannot be ended: {self.failure}")
            clocks.append(solver.t)
            within.append(solver.dense_output())
        motion.end, motion.taken = clock, clock - motion.clock
        self._dense = OdeSolution(clocks, within) if len(within) > 1 else _by_floats(within[0])
        self._fill(space)

    def _solves(
        self, motion: Any, space: Any, ends: tuple[float, float], begin: np.ndarray, **first: float
    ) -> OdeSolver:
        """An integrator of the regime from one clock to another, whose work is charged."""
        system = self.systems[motion.regime]
        rate_of, p, is_slow = system.rate, system.p, motion.regime == SLOW

        def rate(_clock: float, unknowns: np.ndarray) -> Numbers:
            if is_slow:  # as `spend` does, in half the time
                motion.spent_slow += 1
            else:
                motion.spent_fast += 1
            if motion.spent_slow + motion.spent_fast > self._most:
                raise _Spent
            changes: Numbers = rate_of(tuple(unknowns.tolist()), p)
            return changes

        scales = np.array(space.scales[: space.unknowns])
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            solver = self._methods[motion.regime](
                rate,
                ends[0],
                begin,
                ends[1],
                rtol=motion.tolerance,
                atol=motion.tolerance * scales,
                max_step=LONGEST_STEP,
                **first,
            )
        motion.jacobians += int(solver.njev)
        return solver

    def _step(self, motion: Any, solver: OdeSolver) -> bool:
        """Take one step; whether the budget is enough for it.

        Trial steps may leave the domain, and the solver then rejects them; what it accepts is
        checked.
        """
        known, self._most, self.failure = solver.njev, motion.budget, "the budget is spent"
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                self.failure = str(solver.step())
        except _Spent:
            return False
        finally:
            self._most = math.inf
            motion.jacobians += int(solver.njev - known)
        return True

    def _rates(self) -> np.ndarray:
        """Rates where the solver stands; most have just computed them."""
        known = getattr(self._solver, "f", None)
        if known is None:
            known = self._solver.fun(self._solver.t, self._solver.y)
        return np.asarray(known, dtype=float)

    def _fill(self, space: Any) -> None:
        """Fill in the end of a step."""
        space.new[: space.unknowns] = self._solver.y
        space.rates_at_end[: space.unknowns] = self._rates()
