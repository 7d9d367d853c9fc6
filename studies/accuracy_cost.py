"""Measured error as a function of the work for several integrators.

Several problems with answers that are known to 12 or more digits are solved with each integrator of
SciPy and at several requested accuracies. Limit cycles are also solved with pairs of integrators.
One integrator of each pair is used between ruptures, and the other is used during ruptures. The
error is the difference from the known answer, and the work is the total number of right-hand-side
evaluations. Processor times are relative to the time of DOP853 with 3 requested digits on the same
problem. Runs of the two integrators alternate, so that other processes on the machine affect both
equally. The default settings of the package are based on this study.
"""

import math
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import (
    CriticalStep,
    LimitCycle,
    Outcome,
    Output,
    Quantity,
    RigidResponse,
    Status,
    StepResponse,
)
from rsfstudy.motion import Engine, Integrator, WorkMeter
from rsfstudy.motion.steppers.scipy import SCIPY_SOLVER_BY_METHOD_NAME
from rsfstudy.reductions import LinearFit
from rsfstudy.study.figure_declarations import (
    MatplotlibAxes,
    build_horizontal_line_overlay,
    build_reference_line_overlay,
)

from . import _reference_values as known
from ._cheapest_integrator import CheapestIntegrator
from ._known_problems import ERROR_OUTPUTS, Fields, Problem, ProblemMeasure, register_problem

QUASI_STATIC_FIELDS: Fields = {"law": "slowness", "normal_stress": "constant"}
CYCLE_FIELDS: Fields = {
    "normal_stress": "constant",
    "stiffness_ratio": 0.8,
    "load_velocity_ratio": 2.0,
    "inertia": True,
}
cycle_measure = LimitCycle(phases=2)

#: Scene fields and problem of each label. Each scene has one problem.
PROBLEMS = {
    "rigid response": register_problem(
        {**QUASI_STATIC_FIELDS, "load_velocity_ratio": 200.0},
        RigidResponse(points=2),
        **known.EVOLUTION_DISTANCE._asdict(),
    ),
    "oscillation": register_problem(
        {**QUASI_STATIC_FIELDS, "load_velocity_ratio": 20.0},
        StepResponse(peaks=2, phases=2),
        **known.PEAK_AFTER_20._replace(uncertainty=1e-16, scale=0.0)._asdict(),
    ),
    "critical step": register_problem(
        {"law": "slip", "normal_stress": "constant", "stiffness_ratio": 1.25},
        CriticalStep(),
        **known.CRITICAL_VELOCITY._asdict(),
    ),
    "cycle, slip law: static drop": register_problem(
        {**CYCLE_FIELDS, "law": "slip"},
        cycle_measure,
        quantity="static_stress_drop",
        **known.SLIP_STATIC_DROP._asdict(),
    ),
    "cycle, slowness law: recurrence": register_problem(
        {**CYCLE_FIELDS, "law": "slowness"}, cycle_measure, **known.SLOWNESS_RECURRENCE._asdict()
    ),
}

#: Total time in s after which the timing of a run is not repeated.
_MAX_REPEATED_TIME = 0.05

#: Accuracy of the reference run. Run times are relative to the time of the default integrator for
#: the same problem at this accuracy.
_YARDSTICK_ACCURACY = Accuracy(1e-3)

#: Regimes of a motion between ruptures. A motion is in one of these regimes most of the time.
_SLOW_REGIMES = ("quasi_static", "quasi_dynamic", "slow_manifold", "rigid")


RegimeMethods = tuple[tuple[str, str], ...]

#: Methods that use the same integrator in all regimes.
_SINGLE_INTEGRATORS: Mapping[str, RegimeMethods] = {
    name: tuple((regime, name) for regime in (*_SLOW_REGIMES, "inertial"))
    for name in SCIPY_SOLVER_BY_METHOD_NAME
}
#: Methods that use a different integrator during ruptures, for scenes with inertia.
_INTEGRATOR_PAIRS: Mapping[str, RegimeMethods] = {
    "DOP853 + Radau": (("inertial", "Radau"),),
    "DOP853 + LSODA": (("inertial", "LSODA"),),
}
#: Name of the compiled implementation of DOP853.
_COMPILED_NAME = "DOP853 (compiled)"
_METHODS_BY_INTEGRATOR: Mapping[str, RegimeMethods] = {
    **_SINGLE_INTEGRATORS,
    **_INTEGRATOR_PAIRS,
    _COMPILED_NAME: (),
}

#: Names of the installed integrators and of their combinations.
INTEGRATORS = tuple(
    name
    for name in _METHODS_BY_INTEGRATOR
    if name != _COMPILED_NAME or Engine.is_installed(Engine.COMPILED)
)


#: Outputs of the measure.
_OUTPUTS = (
    *ERROR_OUTPUTS,
    Output(
        "achieved_digits", "", "1", "number of correct decimal digits: -log10 of the measured error"
    ),
    Output(
        "run_evaluations",
        "",
        "1",
        "right-hand side evaluations, including those for numerical Jacobians",
    ),
    Output("run_steps", "", "1", "number of steps"),
    Output("run_jacobians", "", "1", "number of Jacobian evaluations"),
    Output("run_time", "", "s", "processor time of the run (median of the repetitions)"),
    Output("relative_time", "", "1", "time of the run divided by the time of DOP853 for 3 digits"),
)


@dataclass(frozen=True)
class WorkPrecision(ProblemMeasure):
    """Error, work and processor time of an integrator that solves a known problem.

    The processor time is also reported relative to the processor time of the default integrator
    with 3 requested digits. The default integrator solves the same problem immediately before and
    after each run, so that other processes on the machine affect both times equally.

    Parameters
    ----------
    problems : tuple of Problem
        Problems, one for each scene of the lattice.
    integrator : str, default: "DOP853"
        Name of an integrator of SciPy, or "DOP853 (compiled)" for the compiled engine. In scenes
        with inertia, two names joined by a plus sign denote the integrators between ruptures and
        during ruptures.
    requested_digits : float, default: 6.0
        Requested accuracy as a number of digits: ``rtol = 10**-requested_digits``.
    repeats : int, default: 5
        Maximum number of timings of a run. Long runs are timed less often.
    run_budget : int, default: 30000
        Maximum number of right-hand-side evaluations of a run.
    """

    integrator: str = "DOP853"
    requested_digits: float = 6.0
    repeats: int = 5
    run_budget: int = 30_000
    name: ClassVar[str] = "work_precision"
    primary_output = "measured_error"
    typical_rhs_evaluations = 25_000
    outputs = _OUTPUTS
    dimensions = (
        Quantity(
            "integrator",
            "",
            "",
            "integrator of the whole motion, or integrators between and during ruptures",
        ),
    )
    needs_time: ClassVar[tuple[bool, ...]] = (False, True)

    def __post_init__(self) -> None:
        """Check the parameters."""
        if self.integrator not in _METHODS_BY_INTEGRATOR:
            raise InvalidValue(
                "integrator", self.integrator, "is unknown", choices=_METHODS_BY_INTEGRATOR
            )
        if self.repeats < 1:
            raise InvalidValue("repeats", self.repeats, "must be at least 1")
        if self.run_budget < 1:
            raise InvalidValue("run_budget", self.run_budget, "must be at least 1")
        try:
            Accuracy(10.0**-self.requested_digits)
        except (InvalidValue, OverflowError) as error:
            least, most = -math.log10(Accuracy.MAX_RTOL), -math.log10(Accuracy.MIN_RTOL)
            rule = f"must lie between {least:g} and {most:g}"
            raise InvalidValue("requested_digits", self.requested_digits, rule) from error

    @property
    def _requested_accuracy(self) -> Accuracy:
        """Accuracy and integrators of the run."""
        engine = Engine.COMPILED if self.integrator == _COMPILED_NAME else Engine.SCIPY
        methods = _METHODS_BY_INTEGRATOR[self.integrator]
        return Accuracy(10.0**-self.requested_digits, self.run_budget, methods, engine)

    @property
    def relative_cost_by_digits(self) -> Mapping[float, float]:
        """Relative cost of the computation for each requested number of digits.

        The work does not depend on the accuracy of the study, because each run has its own
        accuracy.
        """
        return {3.0: 1.0, 10.0: 1.0}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Solve the problem, and repeat the run to measure the processor time.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome with the status ``accuracy_out_of_reach`` if the run fails.
        """
        problem = self.problem_of_scene(scene)
        if self.integrator in _INTEGRATOR_PAIRS and not scene.inertia:
            return Outcome(Status.NOT_APPLICABLE, message=f"{self.integrator} requires inertia")
        if self._requested_accuracy.engine == Engine.COMPILED:
            problem.measure(scene, self._requested_accuracy)  # compiles the equations
        before = _time_run(problem, scene, _YARDSTICK_ACCURACY)[0]
        seconds, outcome, spent = _time_run(problem, scene, self._requested_accuracy)
        for regime, evaluations in spent.evaluations_by_regime.items():
            integrator.work_meter.add_evaluations(regime, evaluations)
        work = {
            "run_evaluations": float(spent.evaluations),
            "run_steps": float(spent.step_count),
            "run_jacobians": float(spent.jacobian_evaluations),
        }
        if outcome.status is not problem.status:
            why = f"{outcome.status.label}: {outcome.message}"
            return Outcome(Status.ACCURACY_OUT_OF_REACH, work, why)
        # Errors below the uncertainty of the reference value cannot be measured.
        error = max(problem.relative_error(outcome), problem.uncertainty, 1e-16)
        return Outcome(
            Status.OK,
            {
                "measured_error": error,
                "measured_error_error": problem.uncertainty,
                "achieved_digits": -math.log10(error),
                "error_estimate": problem.relative_error_estimate(outcome),
                **work,
                **self._median_times(problem, scene, before, seconds),
            },
        )

    def _median_times(
        self, problem: Problem, scene: Scene, before: float, first: float
    ) -> dict[str, float]:
        """Return the median processor time and the median relative time.

        The run and the reference run alternate.

        Parameters
        ----------
        problem : Problem
            Problem of the scene.
        scene : Scene
            Parameters of the slider.
        before : float
            Processor time of the reference run before the first run, in s.
        first : float
            Processor time of the first run, in s.

        Returns
        -------
        dict
            Median time in s, and median of the relative times.
        """
        times, ratios = [first], []
        while True:
            after = _time_run(problem, scene, _YARDSTICK_ACCURACY)[0]
            ratios.append(2.0 * times[-1] / (before + after))
            if len(times) == self.repeats or sum(times) > _MAX_REPEATED_TIME:
                break
            before = after
            times.append(_time_run(problem, scene, self._requested_accuracy)[0])
        return {"run_time": statistics.median(times), "relative_time": statistics.median(ratios)}


def _time_run(problem: Problem, scene: Scene, asked: Accuracy) -> tuple[float, Outcome, WorkMeter]:
    """Run the measure of a problem once.

    Parameters
    ----------
    problem : Problem
        Problem of the scene.
    scene : Scene
        Parameters of the slider.
    asked : Accuracy
        Requested accuracy.

    Returns
    -------
    seconds : float
        Processor time in s.
    outcome : Outcome
        Outcome of the measure.
    spent : WorkMeter
        Counter of right-hand-side evaluations.
    """
    began = time.thread_time()
    outcome, spent = problem.measure.run_metered(scene, asked)
    return time.thread_time() - began, outcome, spent


DEFAULT_INTEGRATOR = "DOP853"


def plot_unreachable_accuracy(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw a line at the uncertainty of the known answer, and mark the failed runs.

    Failed runs are marked with crosses at the requested accuracy.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    floor = max(float(dataset["measured_error_error"].max()), 1e-16)
    build_horizontal_line_overlay(floor, linestyle=":")(dataset, axes)
    for number in range(dataset.sizes["integrator"]):
        runs = dataset.isel(integrator=number)
        work = runs["run_evaluations"].where(runs["status"] == Status.ACCURACY_OUT_OF_REACH)
        asked = {"color": cycle_style(number)["color"], "label": "accuracy out of reach"}
        axes.plot(work, 10.0 ** -runs["requested_digits"], "x", **asked)


figure = Figure(
    [
        Panel(
            x="run_evaluations",
            y=lambda runs: runs["measured_error"].where(runs["measured_error"] > 0.0),
            hue=["integrator"],
            facet=["problem"],
            style=lambda runs: {
                "linewidth": 1.6 if runs["integrator"] == DEFAULT_INTEGRATOR else 0.8
            },
            overlays=[plot_unreachable_accuracy],
            x_label="Right-hand sides",
            y_label="Measured error",
            log="xy",
        ),
        Panel(
            x="requested_digits",
            y="achieved_digits",
            hue=["problem"],
            isel={
                "integrator": lambda names: (
                    DEFAULT_INTEGRATOR if DEFAULT_INTEGRATOR in names else names[0]
                )
            },
            overlays=[
                build_reference_line_overlay(
                    "requested_digits", lambda x: x, "as asked", linewidth=0.9
                )
            ],
            x_label="Requested digits",
            y_label="Correct digits",
            legend_columns=1,
        ),
    ],
    columns=3,
    height=58.0,
)


HEADLINE_PROBLEMS = (
    "critical step",
    "cycle, slip law: static drop",
    "cycle, slowness law: recurrence",
)


def proportionality_claim(label: str) -> Claim:
    """Return the claim that the error is proportional to the tolerance (A1).

    Parameters
    ----------
    label : str
        Label of the problem.

    Returns
    -------
    Claim
        Claim about the slope of the achieved digits against the requested digits.
    """
    return Claim(
        id="A1",
        statement=f"{label}: each requested digit gives 0.7 to 1.3 digits, from 1e-4 to 1e-9",
        source="Shampine (1985), Numerical Methods: tolerance proportionality",
        variable="proportionality",
        where={"problem": label, "integrator": "DOP853"},
        published=1.0,
        tolerance=0.3,
        reason="a range that is narrow enough to predict the error from the tolerance",
    )


def cheapest_claim(label: str, digits: float) -> Claim:
    """Return the claim that the default integrator is efficient (A2).

    The default integrator needs at most 1.25 times the work of the most efficient integrator.

    Parameters
    ----------
    label : str
        Label of the problem.
    digits : float
        Number of correct digits.

    Returns
    -------
    Claim
        Claim about the ratio of the work of the default integrator to the least work.
    """
    return Claim.below(
        id="A2",
        statement=f"{label}: DOP853 needs at most 1.25 times the least work, {digits:g} digits",
        source="the default settings of the package use DOP853 in every regime",
        variable="cheapest_ratio",
        where={"problem": label, "digits": digits},
        published=1.25,
        reason="ratio of right-hand-side evaluations to the most efficient integrator at the same "
        "error",
    )


study = Study(
    name="accuracy_cost",
    title="Cost of accuracy: error against work for the integrators of SciPy",
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
        CheapestIntegrator(
            name="cheapest", of="achieved_digits", default="DOP853", digits=(4.0, 6.0, 9.0)
        ),
    ],
    claims=[
        # Limit cycles under the slowness law are not included. If few digits are requested, they
        # have up to four additional digits, because the limits of the step size are stricter than
        # the tolerance.
        *(proportionality_claim(label) for label in HEADLINE_PROBLEMS[:-1]),
        *(cheapest_claim(label, digits) for label in HEADLINE_PROBLEMS for digits in (6.0, 9.0)),
    ],
    plot=figure,
    references=["Hairer, Norsett and Wanner (1993), Solving Ordinary Differential Equations I"],
)
