"""What accuracy costs: every integrator on problems whose answer is known to more digits.

Problems with answers known to 12 digits or more, solved by each of SciPy's integrators at each
accuracy; for cycles also with another integrator where mass acts. The error is the measured one,
the work counts every right-hand side, and processor times are relative to those of DOP853 for 3
digits on the same problem at the same moment. The defaults of the core follow from it.
"""

import math
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.declare.figure import Axes, level, reference_line
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Outcome
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.rigid_response import RigidResponse
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.motion.accuracy import LOOSEST_RTOL, TIGHTEST_RTOL, Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY, is_installed
from rsfstudy.motion.meter import Meter
from rsfstudy.motion.steppers.scipy import METHODS
from rsfstudy.quantity import Output, Quantity
from rsfstudy.reduce import LinearFit
from rsfstudy.status import Status

from . import _references as known
from ._cheapest import Cheapest
from ._problem import ERRORS, Fields, Posing, Problem, posed

QUASI_STATIC: Fields = {"law": "slowness", "normal_stress": "constant"}
CYCLE: Fields = {
    "normal_stress": "constant",
    "stiffness_ratio": 0.8,
    "load_velocity_ratio": 2.0,
    "inertia": True,
}
cycle = LimitCycle(phases=2)

#: By label: what makes the scene, and the problem. A scene poses one problem.
PROBLEMS = {
    "rigid response": posed(
        {**QUASI_STATIC, "load_velocity_ratio": 200.0},
        RigidResponse(points=2),
        **known.EVOLUTION_DISTANCE._asdict(),
    ),
    "oscillation": posed(
        {**QUASI_STATIC, "load_velocity_ratio": 20.0},
        StepResponse(peaks=2, phases=2),
        **known.PEAK_AFTER_20._replace(uncertainty=1e-16, scale=0.0)._asdict(),
    ),
    "critical step": posed(
        {"law": "slip", "normal_stress": "constant", "stiffness_ratio": 1.25},
        CriticalStep(),
        **known.CRITICAL_VELOCITY._asdict(),
    ),
    "cycle, slip law: static drop": posed(
        {**CYCLE, "law": "slip"},
        cycle,
        quantity="static_stress_drop",
        **known.SLIP_STATIC_DROP._asdict(),
    ),
    "cycle, slowness law: recurrence": posed(
        {**CYCLE, "law": "slowness"}, cycle, **known.SLOWNESS_RECURRENCE._asdict()
    ),
}

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
class WorkPrecision(Posing):
    """Solves a problem with known answer by one integrator at one accuracy.

    Its processor time is also given relative to that of the default integrator for 3 digits, which
    solves the same problem just before and just after: a busy moment of the machine falls on both.

    Parameters
    ----------
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
        """One for all that the study asks for: a run has an accuracy of its own."""
        return {3.0: 1.0, 10.0: 1.0}

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Run once for the numbers, and as often as it takes for the times."""
        problem = self.posed_by(scene)
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


DEFAULT = "DOP853"


def mark_lost(dataset: xr.Dataset, axes: Axes) -> None:
    """The best that the answer is known to, and runs whose accuracy was out of reach."""
    from rsfstudy.plots import look

    floor = max(float(dataset["measured_error_error"].max()), 1e-16)
    level(floor, linestyle=":")(dataset, axes)
    for number in range(dataset.sizes["integrator"]):
        runs = dataset.isel(integrator=number)
        work = runs["run_evaluations"].where(runs["status"] == Status.ACCURACY_OUT_OF_REACH)
        asked = {"color": look(number)["color"], "label": "accuracy out of reach"}
        axes.plot(work, 10.0 ** -runs["requested_digits"], "x", **asked)


figure = Figure(
    [
        Panel(
            x="run_evaluations",
            y=lambda runs: runs["measured_error"].where(runs["measured_error"] > 0.0),
            by=["integrator"],
            each=["problem"],
            style=lambda runs: {"linewidth": 1.6 if runs["integrator"] == DEFAULT else 0.8},
            marks=[mark_lost],
            x_label="Right-hand sides",
            y_label="Measured error",
            log="xy",
        ),
        Panel(
            x="requested_digits",
            y="achieved_digits",
            by=["problem"],
            at={"integrator": lambda names: DEFAULT if DEFAULT in names else names[0]},
            marks=[reference_line("requested_digits", lambda x: x, "as asked", linewidth=0.9)],
            x_label="Digits asked for",
            y_label="Digits reached",
            columns=1,
        ),
    ],
    columns=3,
    height=58.0,
)


HEADLINES = ("critical step", "cycle, slip law: static drop", "cycle, slowness law: recurrence")


def proportional(label: str) -> Claim:
    """Tolerance proportionality of a headline number."""
    return Claim(
        id="A1",
        statement=f"{label}: each digit asked for brings 0.7 to 1.3 digits, from 1e-4 to 1e-9",
        source="Shampine (1985), Numerical Methods: tolerance proportionality",
        variable="proportionality",
        where={"problem": label, "integrator": "DOP853"},
        published=1.0,
        tolerance=0.3,
        reason="the band a user can plan with",
    )


def cheapest(label: str, digits: float) -> Claim:
    """The default integrator against the best."""
    return Claim.below(
        id="A2",
        statement=f"{label}: DOP853 takes up to 1.25 times the least work, {digits:g} digits",
        source="this project's choice of DOP853 in every regime",
        variable="cheapest_ratio",
        where={"problem": label, "digits": digits},
        published=1.25,
        reason="right-hand sides over those of the cheapest for the same error",
    )


study = Study(
    name="accuracy_cost",
    title="What accuracy costs: error against work for SciPy's integrators",
    summary=Study.caption(__doc__),
    base=Scene(),
    axes=[
        Axis("problem", {label: fields for label, (fields, _problem) in PROBLEMS.items()}),
        Axis("integrator", INTEGRATORS),
        Axis("requested_digits", [4, 6, 8, 9]),
    ],
    measure=WorkPrecision(problems=tuple(problem for _fields, problem in PROBLEMS.values())),
    reductions=[
        LinearFit(
            name="proportionality", of="achieved_digits", on="requested_digits", within=(4.0, 9.0)
        ),
        Cheapest(name="cheapest", of="achieved_digits", default="DOP853", digits=(4.0, 6.0, 9.0)),
    ],
    claims=[
        # where few digits are asked for, cycles of the slowness law have up to four more by luck,
        # because limits on the length of steps bind before the tolerance does
        *(proportional(label) for label in HEADLINES[:-1]),
        *(cheapest(label, digits) for label in HEADLINES for digits in (6.0, 9.0)),
    ],
    plot=figure,
    references=["Hairer, Norsett and Wanner (1993), Solving Ordinary Differential Equations I"],
)
