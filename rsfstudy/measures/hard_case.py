"""A case that breaks ordinary slider codes, and whether the right answer comes out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures._problem import ERRORS, Problem, posed_by
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Meter
from rsfstudy.quantity import Output
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: What its numbers are.
_OUTPUTS = (
    *ERRORS,
    Output("answer", "", "1", "the known answer"),
    Output("ended_as"),
)


@dataclass(frozen=True)
class HardCase(Measure):
    """Solves the problem a scene poses and holds the outcome against the known answer.

    ``ok`` where it ends as it must and, if the answer is a number, the error is within the
    outcome's own estimate; ``unverified`` otherwise.

    Parameters
    ----------
    problems : tuple of Problem
        One for each scene of the lattice.
    """

    problems: tuple[Problem, ...] = ()
    name: ClassVar[str] = "hard_case"
    headline = "measured_error"
    typical_work = 15_000
    outputs = _OUTPUTS
    clocks: ClassVar[tuple[bool, ...]] = (False, True)

    def describe(self) -> dict[str, Any]:
        """The measure as plain data."""
        return {"name": self.name, "problems": [problem.describe() for problem in self.problems]}

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Measure, and compare."""
        problem = posed_by(scene, self.problems)
        outcome, spent = problem.measure.metered(scene, accuracy)
        meter.by_regime, meter.spent = spent.by_regime, spent.spent
        numbers = {"ended_as": float(outcome.status)}
        if outcome.status is not problem.status:
            why = f"ended as {outcome.status.label}, not {problem.status.label}: {outcome.message}"
            return Outcome(Status.UNVERIFIED, numbers, why)
        if problem.answer is None:
            exact = {"measured_error": 0.0, "measured_error_error": 0.0}
            return Outcome(Status.OK, numbers | exact, outcome.message)
        error, estimate = problem.error_of(outcome), problem.estimate_of(outcome)
        numbers |= {
            "measured_error": error,
            "measured_error_error": problem.uncertainty,
            "error_estimate": estimate,
            "answer": problem.answer,
        }
        if not error <= estimate + problem.uncertainty or math.isnan(error):
            why = f"error {error:.2g} beyond its estimate {estimate:.2g}"
            return Outcome(Status.UNVERIFIED, numbers, why)
        return Outcome(Status.OK, numbers)
