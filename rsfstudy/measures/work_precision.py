"""Work and precision: what an integrator pays for the accuracy asked for, on a problem whose answer
is known.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures._problem import ERRORS, Problem, posed_by
from rsfstudy.motion.accuracy import LOOSEST_RTOL, TIGHTEST_RTOL, Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY, is_installed
from rsfstudy.motion.meter import Meter
from rsfstudy.motion.steppers.scipy import METHODS
from rsfstudy.quantity import Output, Quantity
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Seconds after which timings are not repeated.
_ENOUGH = 0.05

#: What run times are relative to: the same problem, solved by default as loosely as in the study.
_YARDSTICK = Accuracy(1e-3)

#: Regimes that take most of a motion's time, and the one in which mass acts.
_SLOW = ("quasi_static", "quasi_dynamic", "slow_manifold", "rigid")


Methods = tuple[tuple[str, str], ...]

#: One integrator throughout.
_ALONE: Mapping[str, Methods] = {
    name: tuple((regime, name) for regime in (*_SLOW, "inertial")) for name in METHODS
}
#: For motions with mass: another integrator where mass acts.
_WITH_MASS: Mapping[str, Methods] = {
    "DOP853 + Radau": (("inertial", "Radau"),),
    "DOP853 + LSODA": (("inertial", "LSODA"),),
}
#: The same method, compiled.
_COMPILED = "DOP853 (compiled)"
_CHOICES: Mapping[str, Methods] = {**_ALONE, **_WITH_MASS, _COMPILED: ()}

#: Names of the integrators, and of the ways to combine them, that are installed here.
INTEGRATORS = tuple(name for name in _CHOICES if name != _COMPILED or is_installed(COMPILED))


#: What its numbers are.
_OUTPUTS = (
    *ERRORS,
    Output("achieved_digits", "", "1", "decimal digits reached: -log10 of the measured error"),
    Output("run_evaluations", "", "1", "right-hand sides, those of numerical Jacobians included"),
    Output("run_steps", "", "1", "steps taken"),
    Output("run_jacobians", "", "1", "Jacobians evaluated"),
    Output("run_time", "", "s", "processor time of the run, median of its repeats"),
    Output("relative_time", "", "1", "time of the run over that of DOP853 for 3 digits"),
)


@dataclass(frozen=True)
class WorkPrecision(Measure):
    """Solves a problem with known answer by one integrator at one accuracy.

    Its processor time is also given relative to that of the default integrator for 3 digits, which
    solves the same problem just before and just after: a busy moment of the machine falls on both.

    Parameters
    ----------
    problems : tuple of Problem
        One for each scene of the lattice.
    integrator : str
        One of SciPy's names; two of them, between ruptures and where mass acts (for scenes with
        mass); or "DOP853 (compiled)", the compiled engine.
    requested_digits : float
        The accuracy asked for, rtol = 10**-requested_digits.
    repeats : int
        Most timings of a run; long ones need fewer.
    run_budget : int
        Right-hand sides a run may evaluate.
    """

    problems: tuple[Problem, ...] = ()
    integrator: str = "DOP853"
    requested_digits: float = 6.0
    repeats: int = 5
    run_budget: int = 30_000
    name: ClassVar[str] = "work_precision"
    headline = "measured_error"
    typical_work = 25_000
    outputs = _OUTPUTS
    dimensions = (
        Quantity("integrator", "", "", "integrator: throughout, or between ruptures and in them"),
    )
    clocks: ClassVar[tuple[bool, ...]] = (False, True)

    def __post_init__(self) -> None:
        if self.integrator not in _CHOICES:
            raise InvalidValue("integrator", self.integrator, "is unknown", choices=_CHOICES)
        if self.repeats < 1:
            raise InvalidValue("repeats", self.repeats, "must be at least 1")
        if self.run_budget < 1:
            raise InvalidValue("run_budget", self.run_budget, "must be at least 1")
        try:
            Accuracy(10.0**-self.requested_digits)
        except (InvalidValue, OverflowError) as error:
            least, most = -math.log10(LOOSEST_RTOL), -math.log10(TIGHTEST_RTOL)
            rule = f"must lie between {least:g} and {most:g}"
            raise InvalidValue("requested_digits", self.requested_digits, rule) from error

    @property
    def _asked(self) -> Accuracy:
        """The accuracy and the integrators that the run is made with."""
        engine = COMPILED if self.integrator == _COMPILED else SCIPY
        methods = _CHOICES[self.integrator]
        return Accuracy(10.0**-self.requested_digits, self.run_budget, methods, engine)

    @property
    def work_by_digits(self) -> Mapping[float, float]:
        """The same whatever the study asks for: a run has an accuracy of its own."""
        return {3.0: 1.0, 10.0: 1.0}

    def describe(self) -> dict[str, Any]:
        """The measure as plain data."""
        problems = [problem.describe() for problem in self.problems]
        return {"name": self.name, "problems": problems, **self.plain_fields}

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Run once for the numbers, and as often as it takes for the times."""
        problem = posed_by(scene, self.problems)
        if self.integrator in _WITH_MASS and not scene.inertia:
            return Outcome(Status.NOT_APPLICABLE, message=f"{self.integrator} needs mass")
        if self._asked.engine == COMPILED:
            problem.measure(scene, self._asked)  # compiles what it needs
        before = _timed(problem, scene, _YARDSTICK)[0]
        seconds, outcome, spent = _timed(problem, scene, self._asked)
        meter.by_regime, meter.spent = spent.by_regime, spent.spent
        work = {
            "run_evaluations": float(spent.spent),
            "run_steps": float(spent.steps),
            "run_jacobians": float(spent.jacobians),
        }
        if outcome.status is not problem.status:
            why = f"{outcome.status.label}: {outcome.message}"
            return Outcome(Status.ACCURACY_OUT_OF_REACH, work, why)
        # an error below the uncertainty of the reference cannot be measured
        error = max(problem.error_of(outcome), problem.uncertainty, 1e-16)
        return Outcome(
            Status.OK,
            {
                "measured_error": error,
                "measured_error_error": problem.uncertainty,
                "achieved_digits": -math.log10(error),
                "error_estimate": problem.estimate_of(outcome),
                **work,
                **self._times(problem, scene, before, seconds),
            },
        )

    def _times(
        self, problem: Problem, scene: Scene, before: float, first: float
    ) -> dict[str, float]:
        """Median times, from a first timing of the run and of the yardstick `before` it, and
        more of both in turns.
        """
        times, ratios = [first], []
        while True:
            after = _timed(problem, scene, _YARDSTICK)[0]
            ratios.append(2.0 * times[-1] / (before + after))
            if len(times) == self.repeats or sum(times) > _ENOUGH:
                break
            before = after
            times.append(_timed(problem, scene, self._asked)[0])
        return {"run_time": statistics.median(times), "relative_time": statistics.median(ratios)}


def _timed(problem: Problem, scene: Scene, asked: Accuracy) -> tuple[float, Outcome, Meter]:
    """One run: the processor time it took in s, how it ended and what it spent."""
    began = time.thread_time()
    outcome, spent = problem.measure.metered(scene, asked)
    return time.thread_time() - began, outcome, spent
