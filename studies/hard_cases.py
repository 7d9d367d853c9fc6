"""Hard cases for slider codes, with known results.

The cases include slip rates from 10^-1745 to 10^87 V_*, a stiffness that differs from the critical
stiffness only in the eighth digit, and parameters at the ends of their ranges. They also include
masses from zero to very large values, and loading that friction cannot balance. If the result is a
number, it must agree with an independent computation or a closed form to within its error estimate.
If a case has no result, the computation must end with a status that describes the reason.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import (
    CriticalStep,
    LimitCycle,
    LinearStability,
    Measure,
    Outcome,
    Output,
    RigidResponse,
    Status,
    StepResponse,
    Triggered,
)
from rsfstudy.motion import Integrator
from rsfstudy.study.figure_declarations import MatplotlibAxes

from . import _reference_values as known
from ._known_problems import ERROR_OUTPUTS, Fields, Problem, ProblemMeasure, register_problem
from ._reference_values import KnownValue


@dataclass(frozen=True)
class HardCase(ProblemMeasure):
    """Comparison of the result of a scene with the known answer.

    The status is ``ok`` if the outcome has the expected status and the error does not exceed the
    error estimate. Otherwise the status is ``unverified``.

    Parameters
    ----------
    problems : tuple of Problem
        Problems, one for each scene of the lattice.
    """

    name: ClassVar[str] = "hard_case"
    primary_output = "measured_error"
    typical_rhs_evaluations = 15_000
    outputs = (*ERROR_OUTPUTS, Output("answer", "", "1", "the known answer"), Output("ended_as"))
    needs_time: ClassVar[tuple[bool, ...]] = (False, True)

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the result, and compare it with the known answer.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome of the comparison.
        """
        problem = self.problem_of_scene(scene)
        outcome, spent = problem.measure.run_metered(scene, integrator.accuracy)
        for regime, evaluations in spent.evaluations_by_regime.items():
            integrator.work_meter.add_evaluations(regime, evaluations)
        numbers = {"ended_as": float(outcome.status)}
        if outcome.status is not problem.status:
            why = (
                f"status {outcome.status.label} instead of {problem.status.label}: "
                f"{outcome.message}"
            )
            return Outcome(Status.UNVERIFIED, numbers, why)
        if problem.answer is None:
            exact = {"measured_error": 0.0, "measured_error_error": 0.0}
            return Outcome(Status.OK, numbers | exact, outcome.message)
        error, estimate = problem.relative_error(outcome), problem.relative_error_estimate(outcome)
        numbers |= {
            "measured_error": error,
            "measured_error_error": problem.uncertainty,
            "error_estimate": estimate,
            "answer": problem.answer,
        }
        if not error <= estimate + problem.uncertainty or math.isnan(error):
            why = f"error {error:.2g} exceeds its estimate {estimate:.2g}"
            return Outcome(Status.UNVERIFIED, numbers, why)
        return Outcome(Status.OK, numbers)


CASES: dict[str, tuple[Fields, Problem]] = {}

CONSTANT_FIELDS: Fields = {"normal_stress": "constant"}
SLIP_FIELDS: Fields = {**CONSTANT_FIELDS, "law": "slip"}
SLOWNESS_FIELDS: Fields = {**CONSTANT_FIELDS, "law": "slowness"}
CYCLE_FIELDS: Fields = {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True}
CLOSED_FORM_SOURCE, LINEAR_THEORY_SOURCE = (
    "closed form",
    "linear theory: every orbit grows below k_cr, and decays above",
)

step_measure, triggered_measure, rigid_measure = CriticalStep(), Triggered(), RigidResponse()
growth_measure = LinearStability()
cycle_measure, peaks_measure = LimitCycle(phases=2), StepResponse(peaks=2, phases=2)


def with_load_velocity(velocity_ratio: float, **fields: Any) -> Fields:
    """Return fields of a scene with a given load point velocity.

    Parameters
    ----------
    velocity_ratio : float
        Load point velocity V_0/V_*.
    **fields : object
        Other fields of the scene.

    Returns
    -------
    dict
        Fields of the scene.
    """
    return {**fields, "load_velocity_ratio": velocity_ratio}


def near_critical_stiffness(off: float, **fields: Any) -> Fields:
    """Return fields of a scene with a stiffness close to critical.

    Normal stress is constant.

    Parameters
    ----------
    off : float
        Relative difference from the critical stiffness.
    **fields : object
        Other fields of the scene.

    Returns
    -------
    dict
        Fields of the scene.
    """
    return {**CONSTANT_FIELDS, "stiffness_ratio": 1.0 + off, **fields}


def add_value_case(label: str, measure: Measure, known: KnownValue, fields: Fields) -> None:
    """Add a case with a known value.

    Parameters
    ----------
    label : str
        Name of the case.
    measure : Measure
        Measure that is computed.
    known : KnownValue
        Known value.
    fields : dict
        Fields of the scene.
    """
    CASES[label] = register_problem(fields, measure, **known._asdict())


def add_status_case(label: str, measure: Measure, status: Status, fields: Fields) -> None:
    """Add a case with a known status.

    Parameters
    ----------
    label : str
        Name of the case.
    measure : Measure
        Measure that is computed.
    status : Status
        Expected status.
    fields : dict
        Fields of the scene.
    """
    CASES[label] = register_problem(fields, measure, status=status, source="the physics")


def add_critical_step_case(label: str, **fields: Any) -> None:
    """Add a case whose critical step is known from an independent computation.

    Parameters
    ----------
    label : str
        Name of the case, a key of ``HARD_STEPS``.
    **fields : object
        Fields of the scene.
    """
    add_value_case(label, step_measure, known.HARD_STEPS[label], fields)


def add_cycle_case(label: str, name: str, **fields: Any) -> None:
    """Add a case whose limit cycle is known from an independent computation.

    Parameters
    ----------
    label : str
        Name of the known value, a key of ``HARD_CYCLES``.
    name : str
        Name of the case.
    **fields : object
        Fields of the scene.
    """
    add_value_case(
        name, cycle_measure, known.HARD_CYCLES[label], {**CONSTANT_FIELDS, **CYCLE_FIELDS, **fields}
    )


# Slip rates and steps that exceed the range of floating-point numbers.
add_value_case(
    "200-fold step, peak at 10^87 V_*",
    peaks_measure,
    known.PEAK_AFTER_200,
    with_load_velocity(200.0, **SLOWNESS_FIELDS),
)
add_value_case(
    "20-fold step, neutral orbit",
    peaks_measure,
    known.PEAK_AFTER_20,
    with_load_velocity(20.0, **SLOWNESS_FIELDS),
)
UNBOUNDED = Status.SLIP_RATE_UNBOUNDED
add_status_case(
    "1000-fold step, peak beyond 10^120 V_*",
    peaks_measure,
    UNBOUNDED,
    with_load_velocity(1000.0, **SLOWNESS_FIELDS),
)
FAST_STEP_DISTANCE = KnownValue(
    math.log((1e12 - 1.0) / (1e12 ** math.exp(-1.0) - 1.0)), CLOSED_FORM_SOURCE
)
add_value_case(
    "rigid, V = 1e12 V_*",
    RigidResponse(slip=60.0),
    FAST_STEP_DISTANCE,
    with_load_velocity(1e12, **SLOWNESS_FIELDS),
)
add_value_case(
    "rigid, V = 1e-40 V_*",
    rigid_measure,
    KnownValue(1.0, CLOSED_FORM_SOURCE),
    with_load_velocity(1e-40, **SLIP_FIELDS),
)
add_value_case(
    "rigid, mu_ss = -0.03",
    rigid_measure,
    KnownValue(1.0, CLOSED_FORM_SOURCE),
    with_load_velocity(1e24, **SLIP_FIELDS),
)
# Stiffness close to the critical stiffness.
add_value_case(
    "critical step, k = (1 +1e-08) k_cr",
    step_measure,
    known.JUST_ABOVE_CRITICAL_STIFFNESS,
    near_critical_stiffness(1e-8),
)
for off in (-1e-3, 1e-3):
    grows = KnownValue(float(off < 0.0), LINEAR_THEORY_SOURCE, scale=1.0)
    tiny = near_critical_stiffness(off, load_velocity_ratio=1.0 + 1e-3)
    add_value_case(f"tiny step, k = (1 {off:+g}) k_cr", triggered_measure, grows, tiny)
# A growth or decay of 1e-8 per orbit cannot be resolved at rtol = 1e-7, so the expected status is
# "unverified".
for off in (-1e-8, 1e-8):
    tiny = near_critical_stiffness(off, load_velocity_ratio=1.0 + 1e-3)
    add_status_case(f"tiny step, k = (1 {off:+g}) k_cr", triggered_measure, Status.UNVERIFIED, tiny)
# Every step is unstable here, but a growth of 1e-8 per orbit is too slow to appear in a motion.
add_status_case(
    "critical step, k = (1 -1e-08) k_cr",
    step_measure,
    Status.UNVERIFIED,
    near_critical_stiffness(-1e-8),
)
add_status_case(
    "any step, k = (1 -0.001) k_cr",
    step_measure,
    Status.UNSTABLE_AT_ANY_STEP,
    near_critical_stiffness(-1e-3),
)
add_cycle_case("k = 0.99 k_cr", "cycle at 0.99 k_cr", stiffness_ratio=0.99)
add_cycle_case("V_0 = V_*", "cycle from a nudge, V_0 = V_*", load_velocity_ratio=1.0)
# Parameters at the ends of their ranges.
add_critical_step_case("lambda = 0.01", **CONSTANT_FIELDS, b_over_a=1.01)
add_critical_step_case("lambda = 20", **CONSTANT_FIELDS, b_over_a=21.0)
add_critical_step_case("a = 1e-4", a=1e-4)
add_critical_step_case("a = 0.1", a=0.1)
add_critical_step_case("alpha = 0", alpha=0.0)
add_critical_step_case("alpha = mu_*", alpha=0.76)
add_critical_step_case("alpha = 1", alpha=1.0)
STEEP_FIELDS = {"phi": math.degrees(math.atan(0.76)) + 0.01}
add_critical_step_case("phi = atan(mu_*) + 0.01", **STEEP_FIELDS)
add_critical_step_case("T = 1e-6 s", period=1e-6)
add_critical_step_case("T = 1e4 s", period=1e4)
add_cycle_case("T = 1e-6 s", "cycle, T = 1e-6 s", period=1e-6)
add_cycle_case("T = 1e4 s", "cycle, T = 1e4 s", period=1e4)
# Cases with a status instead of a value.
add_status_case(
    "no steady state below some V",
    rigid_measure,
    Status.NO_STEADY_STATE,
    with_load_velocity(0.9, **STEEP_FIELDS),
)
add_status_case(
    "a slider that locks", peaks_measure, Status.LOCKED, with_load_velocity(0.5, **STEEP_FIELDS)
)
FALLEN_FIELDS = with_load_velocity(1000.0, **CYCLE_FIELDS | {"phi": 50.0})
add_status_case("cycle where k_cr has fallen", cycle_measure, Status.NO_LIMIT_CYCLE, FALLEN_FIELDS)
BEYOND_NORM_FIELDS: Fields = {"inertia": True, "instability_norm": 1e3}
add_status_case(
    "norm beyond the inertial peak", step_measure, Status.NORM_UNREACHABLE, BEYOND_NORM_FIELDS
)
add_status_case(
    "norm below the loading rate",
    triggered_measure,
    Status.NORM_BELOW_LOADING_RATE,
    with_load_velocity(1e5),
)
add_status_case("slip law without mass", peaks_measure, UNBOUNDED, with_load_velocity(20.0))
PULLED_BACK: Fields = {"displacement_step": -47.0}
add_status_case(
    "step past zero shear stress", triggered_measure, Status.SHEAR_STRESS_REVERSED, PULLED_BACK
)
PULLED_FARTHER_BACK: Fields = {"displacement_step": -106.0}
add_status_case(
    "step past zero normal stress",
    triggered_measure,
    Status.NORMAL_STRESS_LOST,
    PULLED_FARTHER_BACK,
)
DECAY = KnownValue(0.0, "linear theory: it decays", scale=1.0)
add_value_case(
    "step of 1e-14", triggered_measure, DECAY, with_load_velocity(1.0 + 1e-14, stiffness_ratio=1.1)
)
SECTION_4_FIELDS: Fields = {"law": "slowness", "b_over_a": math.e, "stiffness_ratio": 1.5}
add_value_case(
    "2361-fold step", step_measure, known.CRITICAL_VELOCITY_OF_SECTION_4, SECTION_4_FIELDS
)
add_value_case(
    "slip law, down to 10^-137 V_*",
    cycle_measure,
    known.DOWN_TO_137,
    {
        "law": "slip",
        "a": 0.008794017206350683,
        "b_over_a": 4.941051988536554,
        "mu_star": 0.6383162760615213,
        "period": 407.6129114047208,
        "reference_rate": 3.2171954288536213e-10,
        "phi": 54.42406958714466,
        "alpha": 0.5377004681414724,
        "stiffness_ratio": 0.3804142175724484,
        "load_velocity_ratio": 86.431987832162,
        "inertia": True,
    },
)
add_value_case(
    "slowness law, down to 10^-1745 V_*",
    cycle_measure,
    known.DOWN_TO_1745,
    {
        "law": "slowness",
        "a": 0.004822260947305701,
        "b_over_a": 5.36849678524829,
        "mu_star": 0.6052299536973429,
        "period": 2.621331736312295,
        "reference_rate": 8.347835049891749e-07,
        "phi": 38.97235270206339,
        "alpha": 0.44646546358794825,
        "stiffness_ratio": 0.573530636703891,
        "load_velocity_ratio": 1.2036896528515733,
        "inertia": True,
    },
)
HEAVY_FIELDS: Fields = with_load_velocity(100.0, inertia=True, period=1e8)
add_status_case(
    "mass against every stiffness", growth_measure, Status.UNSTABLE_AT_ANY_STIFFNESS, HEAVY_FIELDS
)


def name_cases(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Label the rows of the figure with the names of the cases.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import label_rows

    label_rows(axes, [str(name) for name in dataset["hard_case"].values])
    axes.tick_params(axis="y", labelsize=6)
    if math.isfinite(axes.dataLim.minposx):
        axes.set_xscale("log")


def write_text(axes: MatplotlibAxes, row: int, text: str, color: str = "0.35") -> None:
    """Write text in a row.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes to draw on.
    row : int
        Number of the row.
    text : str
        Text to write.
    color : str, default: "0.35"
        Colour of the text.
    """
    across = {"transform": axes.get_yaxis_transform(), "va": "center", "fontsize": 5.5}
    axes.text(0.02, row, text, color=color, **across)


def plot_errors(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw measured errors as filled markers, and error estimates as open markers.

    If a case has no error to plot, a label shows the name of its status or the word "exact".

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    rows, numbers = np.arange(dataset.sizes["hard_case"]), dataset["answer"].notnull().values
    labels = {int(status): status.label.replace("_", " ") for status in Status}
    blue, red = cycle_style(0)["color"], cycle_style(1)["color"]
    wrong = dataset["status"].values != int(Status.OK)
    for name, style in (
        ("error_estimate", {"fillstyle": "none", "label": "estimate"}),
        ("measured_error", {"markersize": 2, "label": "measured error"}),
    ):
        values = dataset[name].where(numbers & (dataset[name] > 0.0))
        axes.plot(values, rows, "o", color=blue, **style)
    for row in rows[~numbers | (dataset["measured_error"].values == 0.0)]:
        ended = labels[int(dataset["ended_as"].values[row])]
        write_text(axes, row, "exact" if numbers[row] else ended, red if wrong[row] else "0.35")
    if wrong.any():
        axes.plot(np.ones(int(wrong.sum())), rows[wrong], "x", color=red, label="wrong")
    name_cases(dataset, axes)


def plot_work(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the number of right-hand-side evaluations of each case.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    rows, work = np.arange(dataset.sizes["hard_case"]), dataset["rhs_evaluations"].values
    axes.barh(rows[work > 0], work[work > 0], color="0.6", left=0.0)
    for row in rows[work == 0]:
        write_text(axes, row, "none")
    name_cases(dataset, axes)


figure = Figure(
    [
        Panel(
            overlays=[plot_errors],
            x_label="Error, or status of the result",
            y_label="Case",
            legend_columns=3,
        ),
        Panel(overlays=[plot_work], x_label="Right-hand sides", y_label="Case"),
    ],
    height=lambda dataset: max(40.0, 20.0 + 3.25 * dataset.sizes["hard_case"]),
)


study = Study(
    name="hard_cases",
    title="Difficult cases for spring-slider codes, and their results",
    summary=Study.caption(__doc__),
    base=Scene(),
    axes=[
        Axis("hard_case", {label: fields for label, (fields, _problem) in CASES.items()}),
    ],
    measure=HardCase(problems=tuple(problem for _fields, problem in CASES.values())),
    claims=[
        Claim.below(
            id="H1",
            statement=(
                f"{label}: the error is less than the requested 1e-7, including the switch "
                "between regimes"
            ),
            source=known.EXTENDED_PRECISION_SOURCE,
            variable="measured_error",
            where={"hard_case": label},
            published=1e-7,
            reason="an inequality; the reference is an independent computation",
        )
        for label in CASES
        if label.startswith(("cycle at", "cycle from", "cycle, T"))
    ],
    plot=figure,
    references=["Ranjith and Rice (1999), J. Mech. Phys. Solids 47, 1207-1218"],
)
