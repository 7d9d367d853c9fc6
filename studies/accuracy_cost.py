"""What accuracy costs: every integrator on problems whose answer is known to more digits."""

import xarray as xr

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.figure import Axes, Figure, Panel, level, reference_line
from rsfstudy.declare.study import Study
from rsfstudy.measures._problem import Problem
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.rigid_response import RigidResponse
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.measures.work_precision import INTEGRATORS, WorkPrecision
from rsfstudy.reduce import Cheapest, LinearFit
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

from . import _references as known

Fields = dict[str, str | float | bool]

QUASI_STATIC: Fields = {"law": "slowness", "normal_stress": "constant"}
CYCLE: Fields = {
    "normal_stress": "constant",
    "stiffness_ratio": 0.8,
    "load_velocity_ratio": 2.0,
    "inertia": True,
}
cycle = LimitCycle(phases=2)

#: By label: what makes the scene, and the problem. A scene poses one problem.
PROBLEMS: dict[str, tuple[Fields, Problem]] = {}


def pose(label: str, fields: Fields, **answer: object) -> None:
    """Add a problem."""
    PROBLEMS[label] = (fields, Problem(scene=Scene(**fields), **answer))  # type: ignore[arg-type]


pose(
    "rigid response",
    {**QUASI_STATIC, "load_velocity_ratio": 200.0},
    measure=RigidResponse(points=2),
    quantity="evolution_distance",
    answer=known.EVOLUTION_DISTANCE,
    uncertainty=1e-16,
    source="closed form (eq. 17a)",
)
pose(
    "oscillation",
    {**QUASI_STATIC, "load_velocity_ratio": 20.0},
    measure=StepResponse(peaks=2, phases=2),
    quantity="max_log10_slip_rate",
    answer=known.PEAK_AFTER_20,
    uncertainty=1e-16,
    source=known.CONSERVED,
)
pose(
    "critical step",
    {"law": "slip", "normal_stress": "constant", "stiffness_ratio": 1.25},
    measure=CriticalStep(),
    quantity="critical_velocity_ratio",
    answer=known.CRITICAL_VELOCITY,
    scale=known.CRITICAL_VELOCITY - 1.0,
    uncertainty=1e-17,
    source=known.EXTENDED,
)
pose(
    "cycle, slip law: static drop",
    {**CYCLE, "law": "slip"},
    measure=cycle,
    quantity="static_stress_drop",
    answer=known.SLIP_STATIC_DROP[0],
    uncertainty=known.SLIP_STATIC_DROP[1],
    source=known.EXTENDED,
)
pose(
    "cycle, slowness law: recurrence",
    {**CYCLE, "law": "slowness"},
    measure=cycle,
    quantity="recurrence_interval",
    answer=known.SLOWNESS_RECURRENCE[0],
    uncertainty=known.SLOWNESS_RECURRENCE[1],
    source=known.EXTENDED,
)

HEADLINES = (
    "critical step",
    "cycle, slip law: static drop",
    "cycle, slowness law: recurrence",
)


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
    return Claim(
        id="A2",
        statement=f"{label}: DOP853 takes up to 1.25 times the least work, {digits:g} digits",
        source="this project's choice of DOP853 in every regime",
        variable="cheapest_ratio",
        where={"problem": label, "digits": digits},
        relation="below",
        published=1.25,
        tolerance=0.0,
        reason="right-hand sides over those of the cheapest for the same error",
    )


STATIC_DROP, RECURRENCE = HEADLINES[1:]


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


study = Study(
    name="accuracy_cost",
    title="What accuracy costs: error against work for SciPy's integrators",
    summary=(
        "Problems with answers known to 12 digits or more, solved by each of SciPy's integrators "
        "at each accuracy; for cycles also with another integrator where mass acts. The error is "
        "the measured one, the work counts every right-hand side, and processor times are relative "
        "to those of DOP853 for 3 digits on the same problem at the same moment. The defaults of "
        "the core follow from it."
    ),
    base=Scene(),
    axes=[
        Axis("problem", {label: fields for label, (fields, _problem) in PROBLEMS.items()}),
        Axis("integrator", INTEGRATORS),
        Axis("requested_digits", [4, 6, 8, 9]),
    ],
    measure=WorkPrecision(problems=tuple(problem for _fields, problem in PROBLEMS.values())),
    reductions=[
        LinearFit(
            name="proportionality",
            of="achieved_digits",
            on="requested_digits",
            within=(4.0, 9.0),
        ),
        Cheapest(name="cheapest", of="achieved_digits", default="DOP853", digits=(4.0, 6.0, 9.0)),
    ],
    claims=[
        # where few digits are asked for, cycles of the slowness law have up to four more by luck,
        # because limits on the length of steps bind before the tolerance does
        *(proportional(label) for label in HEADLINES[:-1]),
        *(cheapest("critical step", digits) for digits in (6.0, 9.0)),
        cheapest(STATIC_DROP, 6.0),
        cheapest(STATIC_DROP, 9.0),
        cheapest(RECURRENCE, 6.0),
        cheapest(RECURRENCE, 9.0),
    ],
    plot=figure,
    references=["Hairer, Norsett and Wanner (1993), Solving Ordinary Differential Equations I"],
)
