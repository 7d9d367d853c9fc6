"""Default stepper, which calls the ODE solvers of SciPy."""

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
from rsfstudy.slider import EquationsOfMotion, FloatTuple
from rsfstudy.status import Status

#: ODE solvers of SciPy.
SCIPY_SOLVER_BY_METHOD_NAME: Mapping[str, type[OdeSolver]] = {
    method.__name__: method for method in (DOP853, RK45, RK23, Radau, BDF, LSODA)
}
DEFAULT_SCIPY_METHOD = "DOP853"


class _EvaluationBudgetExceeded(Exception):
    """Exception raised if a step exceeds the evaluation budget."""


def _build_interpolant_of_unknowns(dense_output: Any) -> Callable[[float], Iterable[float]]:
    """Build a function that interpolates the unknowns within a step.

    For DOP853, the function performs the same operations as SciPy, but with Python floats instead
    of arrays. SciPy's array operations take four times longer for a few unknowns.
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
    """Stepper that uses the ODE solvers of SciPy.

    Parameters
    ----------
    systems : tuple of EquationsOfMotion
        Equations of each regime, indexed by ``motion.regime``.
    methods : mapping of str to str
        Names of SciPy solvers for regimes. The default is ``"DOP853"``.
    """

    name = "scipy"

    def __init__(self, systems: tuple[EquationsOfMotion, ...], methods: Mapping[str, str]) -> None:
        super().__init__(systems, methods)
        names = (methods.get(system.regime_name, DEFAULT_SCIPY_METHOD) for system in systems)
        self._methods = [SCIPY_SOLVER_BY_METHOD_NAME[name] for name in names]
        self._solver: Any = None
        self._interpolant: Any = None
        self._max_evaluations = math.inf

    def begin_regime(self, motion: Any, workspace: Any) -> None:
        """Create a solver for the regime.

        See ``Stepper.begin_regime``.
        """
        ends = 0.0, motion.direction * np.inf
        # The solver estimates the first step with a trial step, which may leave the domain.
        begin, known = np.array(workspace.y[: workspace.unknown_count]), motion.next_step_length
        first = {"first_step": known} if known else {}
        self._solver = self._create_solver(motion, workspace, ends, begin, **first)
        workspace.rates[: workspace.unknown_count] = self._get_current_solver_rates()

    def attempt_step(self, motion: Any, workspace: Any, max_length: float) -> float:
        """Take one step with the solver.

        See ``Stepper.attempt_step``.
        """
        motion.time_per_step = 0.0
        if self._solver.status == "finished":  # The previous step was repeated.
            ends = motion.clock, motion.direction * np.inf
            begin, length = (
                np.array(workspace.y[: workspace.unknown_count]),
                abs(motion.next_step_length),
            )
            self._solver = self._create_solver(motion, workspace, ends, begin, first_step=length)
        solver = self._solver
        if not all(map(math.isfinite, workspace.rates[: workspace.unknown_count])):
            return NO_STEP  # The solver would reduce the step size without end.
        solver.max_step = max_length
        if motion.next_step_length and isinstance(
            solver, DOP853
        ):  # The loop may have shortened the previous step before a kink.
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
        self._copy_step_end_to_workspace(workspace)
        return abs(float(motion.step_length))

    def step_to_segment_end(self, motion: Any, workspace: Any, approximate_length: float) -> float:
        """Take one step with the stepper of order eight.

        If the solver is not DOP853, the method returns 0. See ``Stepper.step_to_segment_end``.
        """
        if not isinstance(self._solver, DOP853):
            return 0.0
        self._interpolant = None
        taken: float = order_eight.step_to_segment_end(motion, workspace, approximate_length)  # type: ignore[no-untyped-call]
        return taken

    def interpolate_unknowns(
        self, motion: Any, workspace: Any, independent_variable: float
    ) -> None:
        """Interpolate the unknowns with the dense output of the solver.

        See ``Stepper.interpolate_unknowns``.
        """
        if motion.time_per_step > 0.0:
            order_eight.interpolate_unknowns(motion, workspace, independent_variable)  # type: ignore[no-untyped-call]
            return
        if self._interpolant is None:
            self._interpolant = _build_interpolant_of_unknowns(self._solver.dense_output())
        for i, unknown in enumerate(self._interpolant(independent_variable)):
            workspace.y_within[i] = unknown

    def retake_step(self, motion: Any, workspace: Any, independent_variable: float) -> None:
        """Repeat the step with a new solver.

        The solver may need several steps to reach the new end. See ``Stepper.retake_step``.
        """
        begin, motion.time_per_step = np.array(workspace.y[: workspace.unknown_count]), 0.0
        # A SciPy solver rejects an interval of zero length, which can result from rounding.
        end = (
            independent_variable
            if independent_variable != motion.clock
            else np.nextafter(independent_variable, motion.direction * np.inf)
        )
        length, ends = abs(end - motion.clock), (motion.clock, end)
        self._solver = solver = self._create_solver(
            motion, workspace, ends, begin, first_step=length
        )
        clocks, within = [motion.clock], []
        while solver.status == "running":
            if not self._take_solver_step(motion, solver) or solver.status == "failed":
                raise MotionStopped(
                    Status.INTEGRATION_FAILED, f"a step could not be repeated: {self.failure}"
                )
            clocks.append(solver.t)
            within.append(solver.dense_output())
        motion.end, motion.step_length = independent_variable, independent_variable - motion.clock
        self._interpolant = (
            OdeSolution(clocks, within)
            if len(within) > 1
            else _build_interpolant_of_unknowns(within[0])
        )
        self._copy_step_end_to_workspace(workspace)

    def _create_solver(
        self,
        motion: Any,
        workspace: Any,
        independent_variable_interval: tuple[float, float],
        initial_unknowns: np.ndarray,
        **first: float,
    ) -> OdeSolver:
        """Create a solver that counts evaluations of the right-hand side."""
        system = self.systems[motion.regime]
        rate_of, p, is_slow = system.rate_function, system.parameters, motion.regime == SLOW_REGIME

        def rate(_clock: float, unknowns: np.ndarray) -> FloatTuple:
            if is_slow:  # A call of `count_evaluations` would take twice as long.
                motion.evaluations_slow += 1
            else:
                motion.evaluations_fast += 1
            if motion.evaluations_slow + motion.evaluations_fast > self._max_evaluations:
                raise _EvaluationBudgetExceeded
            try:
                changes: FloatTuple = rate_of(tuple(unknowns.tolist()), p)
            except OverflowError:  # The solver rejects a trial step with NaN.
                return (math.nan,) * len(unknowns)
            return changes

        scales = np.array(workspace.scales[: workspace.unknown_count])
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            solver = self._methods[motion.regime](
                rate,
                independent_variable_interval[0],
                initial_unknowns,
                independent_variable_interval[1],
                rtol=motion.tolerance,
                atol=motion.tolerance * scales,
                max_step=MAX_STEP_LENGTH,
                **first,
            )
        motion.jacobians += int(solver.njev)
        return solver

    def _take_solver_step(self, motion: Any, solver: OdeSolver) -> bool:
        """Take one solver step, and return False if the step exceeds the evaluation budget.

        Trial steps may leave the domain of the equations, so floating-point warnings are
        suppressed. The solver rejects trial steps with invalid values, and the event loop checks
        the accepted steps.
        """
        known, self._max_evaluations, self.failure = (
            solver.njev,
            motion.budget,
            "the evaluation budget is exceeded",
        )
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                self.failure = str(solver.step())
        except _EvaluationBudgetExceeded:
            return False
        finally:
            self._max_evaluations = math.inf
            motion.jacobians += int(solver.njev - known)
        return True

    def _get_current_solver_rates(self) -> np.ndarray:
        """Return the derivatives at the current point of the solver.

        Most solvers have already computed and stored these derivatives.
        """
        known = getattr(self._solver, "f", None)
        if known is None:
            known = self._solver.fun(self._solver.t, self._solver.y)
        return np.asarray(known, dtype=float)

    def _copy_step_end_to_workspace(self, workspace: Any) -> None:
        """Copy the unknowns and their rates at the end of the step to the workspace."""
        workspace.y_end[: workspace.unknown_count] = self._solver.y
        workspace.rates_at_end[: workspace.unknown_count] = self._get_current_solver_rates()
