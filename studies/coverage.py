"""Coverage: do error estimates cover the errors, over random scenes?

Scenes drawn from wide ranges of every parameter, for both laws, constant and variable normal
stress, and each kind of dynamics. Each is measured at the accuracy asked for and a hundred times
tighter: the error that shows, beyond what the tighter run is itself uncertain by, over the estimate
that the first run gave. More scenes by --set sample=0:49:50, other accuracies by --set
requested_digits=4,7,9, and the readings of a laboratory by --set question: rigid response, velocity
step, healing; and, with --set normal_stress=imposed, normal stress transient and normal stress
response.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome, Output, Quantity, Status
from rsfstudy.motion import MIN_RTOL, WorkMeter
from rsfstudy.reductions import Reduction
from rsfstudy.study.figure_declarations import Axes

from ._random_scenes import ALL_QUESTIONS, MOTION_QUESTIONS, random_scene

_ESTIMATED_OUTPUTS = tuple(
    dict.fromkeys(
        name for question in ALL_QUESTIONS.values() for name in question.measure.outputs_with_error
    )
)
_TIGHTER_RTOL_FACTOR = 0.01
#: Work the tighter run may cost, over that of the run it judges.
_MAX_TIGHTER_WORK = 6


#: What its numbers are.
_OUTPUTS = (
    Output("status_kept", long_name="whether a tighter run ends with the same status", error=True),
    Output("ended_as"),
    Output("error_over_estimate", "", "1", "error over its own estimate", dims=("number",)),
    Output(
        "error_over_request",
        "",
        "1",
        "relative error over the accuracy asked for",
        dims=("number",),
    ),
)


@dataclass(frozen=True)
class Coverage(Measure):
    """Errors of a measure in a random scene, over its own estimates of them.

    The scene shares law, normal stress condition and dynamics with the scene of the cell; its
    numbers are drawn from wide ranges, the same whenever it is asked for. The true numbers are
    those of a run a hundred times tighter, within its error estimate.

    Parameters
    ----------
    question : str
        What is measured; one of `MOTION_QUESTIONS` or `LABORATORY_QUESTIONS`.
    sample : int
        Number of the draw.
    requested_digits : int
        Accuracy asked for: rtol = 10**-digits.
    """

    question: str = "limit cycle"
    sample: int = 0
    requested_digits: int = 7
    name: ClassVar[str] = "coverage"
    primary_output = "status_kept"
    typical_work = 60_000
    outputs = _OUTPUTS
    dimensions = (
        Quantity("question", "", "", "what is measured in a random scene"),
        Quantity("sample", "", "1", "number of the random scene"),
        Quantity("number", "", "", "name of the number"),
    )
    needs_time: ClassVar[tuple[bool, ...]] = (False, True)

    def __post_init__(self) -> None:
        if self.question not in ALL_QUESTIONS:
            raise InvalidValue("question", self.question, "is unknown", choices=ALL_QUESTIONS)
        if self.sample < 0:
            raise InvalidValue("sample", self.sample, "must be 0 or greater")
        if not 2 <= self.requested_digits <= 9:
            rule = "must lie between 2 and 9: the tighter run needs two more"
            raise InvalidValue("requested_digits", self.requested_digits, rule)

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"number": np.array(_ESTIMATED_OUTPUTS, dtype=object)}

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """Measure twice, and compare each number that both give."""
        measure = ALL_QUESTIONS[self.question].measure
        try:
            drawn = random_scene(scene, self.question, self.sample)
        except InvalidValue as error:  # a step of normal stress that is constant
            return Outcome(Status.NOT_APPLICABLE, message=str(error))
        asked = replace(accuracy, rtol=10.0**-self.requested_digits)
        rtol = max(_TIGHTER_RTOL_FACTOR * asked.rtol, MIN_RTOL)
        tighter = replace(asked, rtol=rtol, budget=_MAX_TIGHTER_WORK * asked.budget)
        (outcome, spent), (truth, more) = (measure.run_metered(drawn, a) for a in (asked, tighter))
        meter.evaluations_by_regime["asked"], meter.evaluations_by_regime["tighter"] = (
            spent.evaluations,
            more.evaluations,
        )
        meter.evaluations = spent.evaluations + more.evaluations
        values: dict[str, Any] = {
            "ended_as": float(outcome.status),
            "status_kept_error": 0.0,
            # a failure claims nothing, and nothing is known where the tighter run fails
            "status_kept": float(
                outcome.status is truth.status
                or not (outcome.status.is_answer and truth.status.is_answer)
            ),
        }
        if outcome.status is truth.status is Status.OK:
            values |= _compare_errors(outcome.values, truth.values, asked.rtol)
        return Outcome(Status.OK, values)


def _compare_errors(
    measured: Mapping[str, Any], truth: Mapping[str, Any], rtol: float
) -> dict[str, np.ndarray]:
    """Errors beyond what the truth itself is uncertain by, over their estimates, and over the
    accuracy asked for.
    """
    over_estimate, over_request = (np.full(len(_ESTIMATED_OUTPUTS), math.nan) for _ in range(2))
    for i, name in enumerate(_ESTIMATED_OUTPUTS):
        if f"{name}_error" in measured:
            uncertain = truth[f"{name}_error"]
            error = max(abs(measured[name] - truth[name]) - uncertain, 0.0)
            over_estimate[i] = _error_ratio(error, measured[f"{name}_error"])
            over_request[i] = _error_ratio(error, rtol * abs(truth[name]))
    return {"error_over_estimate": over_estimate, "error_over_request": over_request}


def _error_ratio(error: float, allowed: float) -> float:
    if not error:
        return 0.0
    return error / allowed if allowed else math.inf


# Numba looks for a package of this name, and finds this file where Python runs in this directory
if __name__ == "coverage":
    raise ImportError("this is a study, and not the package coverage")

DYNAMICS: dict[str, dict[str, bool | float]] = {
    "quasi-static": {"inertia": False},
    # how much is drawn with the scene
    "radiation damping": {"radiation_damping": 1e-9},
    "inertia": {"inertia": True},
}
REQUESTED_DIGITS = (4, 7)


@dataclass(frozen=True)
class CoverageStatistics(Reduction):
    """Statistics of errors over their estimates, by the points of some dimensions.

    Parameters
    ----------
    name : str
        Gives ``<name>_share`` (of numbers whose error is within its estimate), ``<name>_worst``
        (the largest error over its estimate), ``<name>_typical`` (the median of estimates over
        errors) and ``<name>_numbers`` (how many there are).
    of : str
        Variable that holds errors over estimates; NaN where there is no number.
    by : tuple of str
        Dimensions that stay.
    """

    by: tuple[str, ...] = ()
    kind: ClassVar[str] = "covered"

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Statistics, and what is counted apart."""
        among = ", by question" if "question" in self.by else ""
        texts = {
            "share": "share of errors within their estimates",
            "worst": "largest error over its estimate",
            "typical": "median of estimates over errors",
            "numbers": "how many numbers have an error and an estimate",
        }
        return [Quantity(f"{self.name}_{k}", "", "1", f"{t}{among}") for k, t in texts.items()]

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Count over all other dimensions."""
        ratios = dataset[self.of]
        over = [d for d in ratios.dims if d not in self.by]
        known = ratios.notnull()
        numbers = known.sum(over)
        with np.errstate(divide="ignore"):
            tightness = (1.0 / ratios).median(over)
        statistics = {
            "_share": (ratios <= 1.0).sum(over) / numbers.where(numbers > 0),
            "_worst": ratios.max(over),
            "_typical": tightness,
            "_numbers": numbers,
        }
        return self.results(f"{self.of} over {', '.join(map(str, over))}", statistics)


#: Errors this far below and above their estimates are drawn there.
PLOTTED_ERROR_RATIOS = (1e-3, 10.0)


def plot_error_histogram(dataset: xr.Dataset, axes: Axes) -> None:
    """One outline an accuracy."""
    from rsfstudy.plots import cycle_style

    for number, digits in enumerate(dataset["requested_digits"].values):
        values = dataset["error_over_estimate"].isel(requested_digits=number).values.ravel()
        values = np.clip(values[np.isfinite(values)], *PLOTTED_ERROR_RATIOS)
        covered = f"{(values <= 1.0).sum()} of {values.size} covered"
        label = f"rtol $10^{{-{digits:g}}}$: {covered}"
        axes.hist(
            values,
            np.geomspace(*PLOTTED_ERROR_RATIOS, 33).tolist(),
            histtype="step",
            label=label,
            **cycle_style(number),
        )
    axes.axvline(1.0, color="0.3", linestyle="-", linewidth=0.8)
    axes.set_xscale("log")
    axes.locator_params(axis="y", integer=True)


figure = Figure(
    [
        Panel(
            facet=["question"],
            overlays=[plot_error_histogram],
            x_label="Error over its estimate",
            y_label="Numbers",
        )
    ]
)


#: What is promised of error estimates at each accuracy: in words, of which number, and how far.
COVERAGE_CLAIMS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    (
        "at least 99.5 % of errors lie within their estimates",
        "covered_share",
        {
            "relation": "above",
            "published": 0.995,
            "tolerance": 0.005,
            "reason": "over 250 numbers the share scatters by a half of that, and a last bit moves "
            "it",
        },
    ),
    (
        "no error is three times its estimate",
        "covered_worst",
        {"relation": "below", "published": 3.0},
    ),
    (
        "the usual estimate is within ten times the error",
        "covered_typical",
        {
            "relation": "below",
            "published": 10.0,
            "tolerance": 4.0,
            "reason": "two standard errors of a median over 290 numbers, by resampling them",
        },
    ),
)
CLAIMS = [
    Claim(
        id=f"T{number}",
        statement=f"rtol 1e-{digits}: {statement}",
        source="this project's promise for its error estimates",
        variable=variable,
        where={"requested_digits": float(digits)},
        **held,
    )
    for digits in REQUESTED_DIGITS
    for number, (statement, variable, held) in enumerate(COVERAGE_CLAIMS, start=1)
]


study = Study(
    name="coverage",
    title="How error estimates cover the errors, over random scenes",
    summary=Study.caption(__doc__),
    base=Scene(),
    axes=[
        Axis("question", list(MOTION_QUESTIONS)),
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("dynamics", DYNAMICS),
        Axis("sample", range(4)),
        Axis("requested_digits", REQUESTED_DIGITS),
    ],
    measure=Coverage(),
    reductions=[
        CoverageStatistics(name="covered", of="error_over_estimate", by=("requested_digits",)),
        CoverageStatistics(
            name="covered_by_question",
            of="error_over_estimate",
            by=("question", "requested_digits"),
        ),
    ],
    claims=CLAIMS,
    plot=figure,
    references=["Shampine (1985), Numerical Methods: on global error estimates"],
)
