"""One system of equations stepped by SciPy: counted, bounded, and checked after every step."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import BDF, DOP853, LSODA, RK23, RK45, OdeSolution, OdeSolver, Radau
from scipy.optimize import brentq

from rsfstudy.motion.engines import SCIPY
from rsfstudy.slider.equations import LONGEST_STEP, Equations
from rsfstudy.slider.forms import Point
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import LOG_LOAD_RATE
from rsfstudy.status import Status

Vector = np.ndarray

#: SciPy's integrators, by name.
METHODS: Mapping[str, type[OdeSolver]] = {
    method.__name__: method for method in (DOP853, RK45, RK23, Radau, BDF, LSODA)
}
DEFAULT_METHOD = "DOP853"
#: Local tolerance at which the longest steps of equations hold as they are; at others they change
#: as steps of order eight do.
TOLERANCE_OF_STRIDES = 1e-7
#: Local tolerance below which rounding decides, and SciPy warns.
TIGHTEST = 5e-14


def more_work(budget: int) -> str:
    """How to allow more than a budget, to be added to a message."""
    return f"; --budget {4 * budget} (budget=) allows more"


class Halt(Exception):
    """A motion that cannot go on, with the status that says why."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status = status


@dataclass
class Meter:
    """What one measurement spends, by regime, with which integrators; ends it when its budget is
    spent.

    Attributes
    ----------
    budget : int
        Right-hand sides it may evaluate.
    methods : mapping of str to str
        Name of the SciPy integrator of a regime; `DEFAULT_METHOD` where none is named.
    engine : str
        What integrates.
    by_regime : dict
        Right-hand sides evaluated so far.
    spent, steps, jacobians : int
        Right-hand sides in all (those of numerical Jacobians too), steps, and Jacobians.
    """

    budget: int
    methods: Mapping[str, str] = field(default_factory=dict)
    engine: str = SCIPY
    by_regime: dict[str, int] = field(default_factory=dict)
    spent: int = 0
    steps: int = 0
    jacobians: int = 0

    def method_of(self, regime: str) -> type[OdeSolver]:
        """The integrator of a regime."""
        return METHODS[self.methods.get(regime, DEFAULT_METHOD)]

    def charge(self, regime: str, evaluations: int) -> None:
        """Add evaluations; raises `Halt` once more than the budget is spent."""
        self.add(regime, evaluations)
        self.check()

    def add(self, regime: str, evaluations: int) -> None:
        """Add evaluations."""
        self.by_regime[regime] = self.by_regime.get(regime, 0) + evaluations
        self.spent += evaluations

    def check(self) -> None:
        """Raise `Halt` where more than the budget is spent."""
        if self.spent > self.budget:
            raise Halt(
                Status.WORK_BUDGET_SPENT,
                f"more than {self.budget} right-hand sides without an answer",
            )


@dataclass(frozen=True)
class Step:
    """One accepted step, from `start` to `end` of the clock of its equations."""

    equations: Equations
    start: float
    end: float
    before: Point
    after: Point
    state: Vector
    interpolant: Callable[[], Callable[[float], Vector]]
    meter: Meter

    def state_at(self, clock: float) -> Vector:
        """Unknowns at an instant within the step."""
        return self.state if clock == self.end else self.interpolant()(clock)

    def point_at(self, clock: float) -> Point:
        """What the slider does at an instant within the step."""
        self.meter.charge(self.equations.regime, 1)
        return self.equations.at(tuple(self.state_at(clock).tolist()))

    def locate(self, what: Callable[[Point], float]) -> float:
        """Clock at which ``what(point)`` changes sign; its sign must differ at the two ends."""
        # end values from the points themselves: the interpolant may miss them by a rounding error
        ends = {self.start: what(self.before), self.end: what(self.after)}

        def value(clock: float) -> float:
            return ends[clock] if clock in ends else what(self.point_at(clock))

        width = abs(self.end - self.start)
        return float(brentq(value, self.start, self.end, xtol=1e-13 * width, rtol=1e-14))

    def until(self, clock: float) -> Step:
        """The part of the step that ends at `clock`."""
        return Step(
            self.equations,
            self.start,
            clock,
            self.before,
            self.point_at(clock),
            self.state_at(clock),
            self.interpolant,
            self.meter,
        )


def steps(
    equations: Equations,
    state: Sequence[float],
    tolerance: float,
    meter: Meter,
    *,
    backward: bool = False,
) -> Iterator[Step]:
    """Integrate from clock zero, step by step, for as long as the caller asks.

    Parameters
    ----------
    equations : Equations
        What to integrate.
    state : sequence of float
        Unknowns at clock zero.
    tolerance : float
        Local error allowed per step: relative, and absolute in the scales of the unknowns.
    meter : Meter
        Charged with every right-hand side.
    backward : bool
        Integrate against the clock.

    Yields
    ------
    Step

    Raises
    ------
    Halt
        With `work_budget_spent`, or `integration_failed` when SciPy gives up, a step has no length,
        or a number is not finite.
    """
    p, tolerance = equations.p, max(tolerance, TIGHTEST)
    ends = 0.0, -math.inf if backward else math.inf
    solver = _solver(equations, state, ends, tolerance, meter)
    # what limits a step must differ between two tolerances whose results are to tell errors
    finer, jacobians = (tolerance / TOLERANCE_OF_STRIDES) ** 0.125, 0
    before = _point(solver, equations)
    while True:
        longest = equations.longest(before.log_rate, before.normal_stress, p[LOG_LOAD_RATE])
        solver.max_step = longest * finer
        _advance(solver, equations.regime, meter)
        meter.jacobians += solver.njev - jacobians
        jacobians = solver.njev
        after = _point(solver, equations)
        yield Step(
            equations,
            float(solver.t_old),
            float(solver.t),
            before,
            after,
            solver.y,
            _dense(solver),
            meter,
        )
        before = after


def retaken(step: Step, clock: float, tolerance: float) -> Step:
    """The part of a step that ends at `clock`, integrated anew.

    Where stability limits steps, and not accuracy, dense output is far less accurate than their
    ends.
    """
    if clock == step.start:
        return step.until(clock)
    equations, meter = step.equations, step.meter
    state, length = step.state_at(step.start), abs(clock - step.start)
    ends = step.start, clock
    solver = _solver(equations, state, ends, max(tolerance, TIGHTEST), meter, first_step=length)
    clocks, within = [step.start], []
    while solver.status == "running":
        _advance(solver, equations.regime, meter)
        clocks.append(solver.t)
        within.append(solver.dense_output())
    after, known = _point(solver, equations), OdeSolution(clocks, within)
    return Step(equations, step.start, clock, step.before, after, solver.y, lambda: known, meter)


def _solver(
    equations: Equations,
    state: Sequence[float] | Vector,
    ends: tuple[float, float],
    tolerance: float,
    meter: Meter,
    **first: float,
) -> OdeSolver:
    """SciPy's integrator of some equations from one clock to another, charged to a meter."""
    regime, rate_of, p = equations.regime, equations.rate, equations.p

    def rate(_clock: float, unknowns: Vector) -> Numbers:
        meter.charge(regime, 1)
        changes: Numbers = rate_of(tuple(unknowns.tolist()), p)
        return changes

    # how long a first step may be is asked of a trial step too
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return meter.method_of(regime)(
            rate,
            ends[0],
            np.asarray(state, dtype=float),
            ends[1],
            rtol=tolerance,
            atol=tolerance * np.asarray(equations.scales),
            max_step=LONGEST_STEP,
            **first,
        )


def _advance(solver: OdeSolver, regime: str, meter: Meter) -> None:
    """Take one step.

    Trial steps may leave the domain, and the solver then rejects them; what it accepts is checked.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        failure = solver.step()
    meter.steps += 1
    if solver.status == "failed":
        raise Halt(Status.INTEGRATION_FAILED, f"{regime}: {failure}")
    unknowns = tuple(solver.y.tolist())
    if solver.t == solver.t_old or not math.isfinite(math.fsum(unknowns)):
        raise Halt(Status.INTEGRATION_FAILED, f"{regime}: step without length or state {unknowns}")


def _point(solver: OdeSolver, equations: Equations) -> Point:
    """What the slider does where the solver stands; most have just computed the rates there."""
    known = getattr(solver, "f", None)
    rates = solver.fun(solver.t, solver.y) if known is None else known
    point: Point = equations.point(
        tuple(solver.y.tolist()), tuple(np.asarray(rates).tolist()), equations.p
    )
    return point


def _dense(solver: OdeSolver) -> Callable[[], Callable[[float], Vector]]:
    """The step's interpolant, built once and only if asked for; it must be asked for before the
    next step.
    """
    built: list[Callable[[float], Vector]] = []

    def interpolant() -> Callable[[float], Vector]:
        if not built:
            built.append(solver.dense_output())
        return built[0]

    return interpolant
