"""Work and precision: what each of SciPy's integrators pays for the accuracy asked for."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rsfstudy.core.accuracy import Accuracy
from rsfstudy.core.stepping import METHODS, Meter
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures.problem import Problem, posed_by
from rsfstudy.scene import Scene
from rsfstudy.status import Status

#: Seconds after which one timing of a run is enough.
_LONG = 0.15

#: Regimes that take most of a motion's time, and the one in which mass acts.
_SLOW = ("quasi_static", "quasi_dynamic", "slow_manifold", "rigid")


class _MassAlways(Accuracy):
    """The full equations all the way, for comparison."""

    @property
    def switch_norm(self) -> float:
        """Below every slip rate."""
        return 1e-300


Methods = tuple[tuple[str, str], ...]

#: One integrator throughout.
_ALONE: Mapping[str, tuple[type[Accuracy], Methods]] = {
    name: (Accuracy, tuple((regime, name) for regime in (*_SLOW, "inertial"))) for name in METHODS
}
#: For motions with mass: another integrator where mass acts, and mass throughout.
_WITH_MASS: Mapping[str, tuple[type[Accuracy], Methods]] = {
    "DOP853, Radau": (Accuracy, (("inertial", "Radau"),)),
    "DOP853, LSODA": (Accuracy, (("inertial", "LSODA"),)),
    "Radau, mass always": (_MassAlways, (("inertial", "Radau"),)),
}
_CHOICES = {**_ALONE, **_WITH_MASS}

_NUMBERS = (
    "measured_error",
    "error_estimate",
    "achieved_digits",
    "run_evaluations",
    "run_steps",
    "run_jacobians",
    "run_time",
    "run_failed",
)


@dataclass(frozen=True)
class WorkPrecision(Measure):
    """Solves a problem with known answer by each integrator at each accuracy.

    Wall times are medians over repeats that are interleaved: every integrator runs once before any
    runs again, so that a busy moment of the machine falls on all of them.

    Parameters
    ----------
    problems : tuple of Problem
        One for each scene of the lattice.
    integrators : tuple of str
        SciPy's names; a pair of them, between ruptures and where mass acts; or "Radau, mass
        always", which leaves the slow manifold out. Those are for scenes with mass.
    digits : tuple of int
        Accuracies asked for, rtol = 10**-digits.
    repeats : int
        Timings of each run.
    budget : int
        Right-hand sides a run may evaluate.
    """

    problems: tuple[Problem, ...] = ()
    integrators: tuple[str, ...] = tuple(_CHOICES)
    digits: tuple[int, ...] = (3, 4, 5, 6, 7, 8, 9, 10)
    repeats: int = 3
    budget: int = 85_000
    name: ClassVar[str] = "work_precision"

    def __post_init__(self) -> None:
        for name in self.integrators:
            if name not in _CHOICES:
                raise InvalidValue("integrator", name, "is unknown", choices=_CHOICES)

    @property
    def headline(self) -> str:
        return "measured_error"

    @property
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        inner = ("integrator", "requested_digits")
        return dict.fromkeys(_NUMBERS, inner) | {"measured_error_error": ()}

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {
            "integrator": np.array(self.integrators, dtype=object),
            "requested_digits": np.array(self.digits, dtype=float),
        }

    @property
    def typical_work(self) -> int:
        return 6_000_000

    def describe(self) -> dict[str, Any]:
        """The measure as plain data."""
        return {
            "name": self.name,
            "problems": [problem.describe() for problem in self.problems],
            "integrators": list(self.integrators),
            "digits": list(self.digits),
            "repeats": self.repeats,
            "budget": self.budget,
        }

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Every run once, for its numbers; short ones that succeed again, for their times."""
        problem = posed_by(scene, self.problems)
        runs = {
            (i, j): _CHOICES[name][0](10.0**-digits, self.budget, _CHOICES[name][1])
            for i, name in enumerate(self.integrators)
            for j, digits in enumerate(self.digits)
            if scene.inertia or name in _ALONE
        }
        shape = (len(self.integrators), len(self.digits))
        numbers = {name: np.full(shape, np.nan) for name in _NUMBERS}
        times: dict[tuple[int, int], list[float]] = {}
        for repeat in range(self.repeats):
            for place, asked in runs.items():
                if repeat > 0 and times.get(place, [math.inf])[0] > _LONG:
                    continue
                began = time.perf_counter()
                outcome, spent = problem.measure.metered(scene, asked)
                took = time.perf_counter() - began
                if repeat == 0:
                    meter.by_regime["runs"] = meter.by_regime.get("runs", 0) + spent.spent
                    meter.spent += spent.spent
                    for name, value in _numbers(problem, outcome, spent).items():
                        numbers[name][place] = value
                if outcome.status is problem.status:
                    times.setdefault(place, []).append(took)
        for place, taken in times.items():
            numbers["run_time"][place] = statistics.median(taken)
        return Outcome(Status.OK, {**numbers, "measured_error_error": problem.uncertainty})


def _numbers(problem: Problem, outcome: Outcome, spent: Meter) -> dict[str, float]:
    failed = outcome.status is not problem.status
    work = {
        "run_evaluations": float(spent.spent),
        "run_steps": float(spent.steps),
        "run_jacobians": float(spent.jacobians),
        "run_failed": float(failed),
    }
    if failed:
        return work
    # what the reference cannot tell from zero is no error
    error = max(problem.error_of(outcome), problem.uncertainty, 1e-16)
    return {
        **work,
        "measured_error": error,
        "achieved_digits": -math.log10(error),
        "error_estimate": problem.estimate_of(outcome),
    }
