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

from rsfstudy.motion.array_layout import SLOW_REGIME
from rsfstudy.motion.max_step_length import MAX_STEP_LENGTH
from rsfstudy.motion.steppers import BUDGET_SPENT, NO_STEP, Stepper, order_eight
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.slider import Equations, Numbers
from rsfstudy.status import Status

#: SciPy's integrators, by name.
SCIPY_SOLVER_BY_METHOD_NAME: Mapping[str, type[OdeSolver]] = {
    method.__name__: method for method in (DOP853, RK45, RK23, Radau, BDF, LSODA)
}
DEFAULT_METHOD = "DOP853"


class _BudgetExceeded(Exception):
    """The budget is, within a step."""


def _build_float_interpolant(dense_output: Any) -> Callable[[float], Iterable[float]]:
    """The unknowns at a clock by dense output; that of order eight as it says, operation by
    operation, but on floats: arrays of so few numbers take four times as long.
    """
    if type(dense_output).__name__ != "Dop853DenseOutput":
        values: Callable[[float], Iterable[float]] = dense_output
        return values
    began, length, ends = dense_output.t_old, dense_output.h, dense_output.y_old.tolist()
    columns = list(zip(*reversed(dense_output.F.tolist()), ends, strict=True))

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
        self._methods = [SCIPY_SOLVER_BY_METHOD_NAME[name] for name in names]
        self._solver: Any = None
        self._interpolant: Any = None
        self._max_evaluations = math.inf

    def begin_regime(self, motion: Any, workspace: Any) -> None:
        ends = 0.0, motion.direction * np.inf
        # the longest first step is asked of a trial step, which may leave the domain
        begin, known = np.array(workspace.y[: workspace.unknown_count]), motion.next_step_length
        first = {"first_step": known} if known else {}
        self._solver = self._create_solver(motion, workspace, ends, begin, **first)
        workspace.rates[: workspace.unknown_count] = self._current_solver_rates()

    def attempt_step(self, motion: Any, workspace: Any, max_length: float) -> float:
        motion.time_per_step = 0.0
        if self._solver.status == "finished":  # a step that was taken anew
            ends = motion.clock, motion.direction * np.inf
            begin, length = (
                np.array(workspace.y[: workspace.unknown_count]),
                abs(motion.next_step_length),
            )
            self._solver = self._create_solver(motion, workspace, ends, begin, first_step=length)
        solver = self._solver
        solver.max_step = max_length
        if motion.next_step_length and isinstance(
            solver, DOP853
        ):  # it may have been too long for a kink
            solver.h_abs = motion.next_step_length
        if not self._take_solver_step(motion, solver):
            return BUDGET_SPENT
        if solver.status == "failed":
            return NO_STEP
        if motion.evaluations_slow + motion.evaluations_fast > motion.budget:
            return BUDGET_SPENT
        motion.end, self._interpolant = float(solver.t), None
        motion.step_length = motion.end - motion.clock
        motion.next_step_length = float(getattr(solver, "h_abs", abs(motion.step_length)))
        self._store_step_end(workspace)
        return abs(float(motion.step_length))

    def step_to_segment_end(self, motion: Any, workspace: Any, approximate_length: float) -> float:
        if not isinstance(self._solver, DOP853):
            return 0.0
        self._interpolant = None
        taken: float = order_eight.step_to_segment_end(motion, workspace, approximate_length)  # type: ignore[no-untyped-call]
        return taken

    def interpolate_unknowns(self, motion: Any, workspace: Any, clock: float) -> None:
        if motion.time_per_step > 0.0:
            order_eight.interpolate_unknowns(motion, workspace, clock)  # type: ignore[no-untyped-call]
            return
        if self._interpolant is None:
            self._interpolant = _build_float_interpolant(self._solver.dense_output())
        for i, unknown in enumerate(self._interpolant(clock)):
            workspace.y_within[i] = unknown

    def retake_step(self, motion: Any, workspace: Any, clock: float) -> None:
        begin, motion.time_per_step = np.array(workspace.y[: workspace.unknown_count]), 0.0
        # the clock may round to where the step begins; an integrator wants a way to go
        end = clock if clock != motion.clock else np.nextafter(clock, motion.direction * np.inf)
        length, ends = abs(end - motion.clock), (motion.clock, end)
        self._solver = solver = self._create_solver(
            motion, workspace, ends, begin, first_step=length
        )
        clocks, within = [motion.clock], []
        while solver.status == "running":
            if not self._take_solver_step(motion, solver) or solver.status == "failed":
                raise MotionStopped(
                    Status.INTEGRATION_FAILED, f"a step cannot be ended: {self.failure}"
                )
            clocks.append(solver.t)
            within.append(solver.dense_output())
        motion.end, motion.step_length = clock, clock - motion.clock
        self._interpolant = (
            OdeSolution(clocks, within) if len(within) > 1 else _build_float_interpolant(within[0])
        )
        self._store_step_end(workspace)

    def _create_solver(
        self,
        motion: Any,
        workspace: Any,
        clock_interval: tuple[float, float],
        initial_unknowns: np.ndarray,
        **first: float,
    ) -> OdeSolver:
        """An integrator of the regime from one clock to another, whose work is charged."""
        system = self.systems[motion.regime]
        rate_of, p, is_slow = system.rate_function, system.parameters, motion.regime == SLOW_REGIME

        def rate(_clock: float, unknowns: np.ndarray) -> Numbers:
            if is_slow:  # as `count_evaluations` does, in half the time
                motion.evaluations_slow += 1
            else:
                motion.evaluations_fast += 1
            if motion.evaluations_slow + motion.evaluations_fast > self._max_evaluations:
                raise _BudgetExceeded
            changes: Numbers = rate_of(tuple(unknowns.tolist()), p)
            return changes

        scales = np.array(workspace.scales[: workspace.unknown_count])
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            solver = self._methods[motion.regime](
                rate,
                clock_interval[0],
                initial_unknowns,
                clock_interval[1],
                rtol=motion.tolerance,
                atol=motion.tolerance * scales,
                max_step=MAX_STEP_LENGTH,
                **first,
            )
        motion.jacobians += int(solver.njev)
        return solver

    def _take_solver_step(self, motion: Any, solver: OdeSolver) -> bool:
        """Take one step; whether the budget is enough for it.

        Trial steps may leave the domain, and the solver then rejects them; what it accepts is
        checked.
        """
        known, self._max_evaluations, self.failure = (
            solver.njev,
            motion.budget,
            "the budget is spent",
        )
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                self.failure = str(solver.step())
        except _BudgetExceeded:
            return False
        finally:
            self._max_evaluations = math.inf
            motion.jacobians += int(solver.njev - known)
        return True

    def _current_solver_rates(self) -> np.ndarray:
        """Rates where the solver stands; most have just computed them."""
        known = getattr(self._solver, "f", None)
        if known is None:
            known = self._solver.fun(self._solver.t, self._solver.y)
        return np.asarray(known, dtype=float)

    def _store_step_end(self, workspace: Any) -> None:
        """Fill in the end of a step."""
        workspace.y_end[: workspace.unknown_count] = self._solver.y
        workspace.rates_at_end[: workspace.unknown_count] = self._current_solver_rates()
