"""Coverage of error estimates for random scenes.

The study solves scenes whose parameters are drawn at random from wide ranges. The scenes include
both laws, constant and variable normal stress, and all kinds of dynamics. Each scene is solved
twice: at the requested accuracy, and with a tolerance that is smaller by a factor of 100. The
measured error is the difference between the two results, reduced by the error estimate of the more
accurate run. The figure shows the ratio of the measured error to the error estimate of the first
run. For more scenes, use the option --set sample=0:49:50. For other accuracies, use the option
--set requested_digits=4,7,9. To test quantities that are measured in laboratory tests, use the
option --set question with the name of the test: rigid response, velocity step or healing. In
combination with the option --set normal_stress=imposed, the tests normal stress transient and
normal stress response are also available.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome, Output, Quantity, Status
from rsfstudy.motion import Accuracy, Integrator
from rsfstudy.reductions import Reduction
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._random_scenes import ALL_QUESTIONS, MOTION_QUESTIONS, random_scene

_ESTIMATED_OUTPUTS = tuple(
    dict.fromkeys(
        name
        for question in ALL_QUESTIONS.values()
        for name in question.measure.names_of_outputs_with_error
    )
)
_TIGHTER_RTOL_FACTOR = 0.01
#: Ratio of the work budget of the more accurate run to the work budget of the first run.
_MAX_TIGHTER_WORK = 6


#: Outputs of the measure.
_OUTPUTS = (
    Output(
        "status_kept",
        long_name="1 if a more accurate run has the same status, otherwise 0",
        error=True,
    ),
    Output("ended_as"),
    Output("error_over_estimate", "", "1", "error divided by the error estimate", dims=("number",)),
    Output(
        "error_over_request",
        "",
        "1",
        "relative error divided by the requested accuracy",
        dims=("number",),
    ),
)


@dataclass(frozen=True)
class Coverage(Measure):
    """Ratios of errors to error estimates in a random scene.

    The law, normal stress condition and dynamics of the random scene are taken from the scene of
    the cell. All other parameters are drawn from wide ranges, with a fixed seed for each sample.
    The reference results are computed with a tolerance that is smaller by a factor of 100, and the
    uncertainty of the reference results is the error estimate of the reference run.

    Parameters
    ----------
    question : str, default: "limit cycle"
        Name of the question, a key of ``MOTION_QUESTIONS`` or ``LABORATORY_QUESTIONS``.
    sample : int, default: 0
        Number of the random sample.
    requested_digits : int, default: 7
        Requested accuracy as a number of digits: ``rtol = 10**-requested_digits``.
    """

    question: str = "limit cycle"
    sample: int = 0
    requested_digits: int = 7
    name: ClassVar[str] = "coverage"
    primary_output = "status_kept"
    typical_rhs_evaluations = 60_000
    outputs = _OUTPUTS
    dimensions = (
        Quantity("question", "", "", "measure in a random scene"),
        Quantity("sample", "", "1", "number of the random scene"),
        Quantity("number", "", "", "name of the result"),
    )
    needs_time: ClassVar[tuple[bool, ...]] = (False, True)

    def __post_init__(self) -> None:
        """Check the parameters."""
        if self.question not in ALL_QUESTIONS:
            raise InvalidValue("question", self.question, "is unknown", choices=ALL_QUESTIONS)
        if self.sample < 0:
            raise InvalidValue("sample", self.sample, "must be 0 or greater")
        if not 2 <= self.requested_digits <= 9:
            rule = (
                "must lie between 2 and 9, because the more accurate run requires two more digits"
            )
            raise InvalidValue("requested_digits", self.requested_digits, rule)

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Names of the results, which label the ``number`` dimension."""
        return {"number": np.array(_ESTIMATED_OUTPUTS, dtype=object)}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the measure at two accuracies, and compare the results.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome with the status ``not_applicable`` if the question does not apply to the scene.
        """
        measure = ALL_QUESTIONS[self.question].measure
        try:
            drawn = random_scene(scene, self.question, self.sample)
        except InvalidValue as error:  # e.g. normal stress is constant
            return Outcome(Status.NOT_APPLICABLE, message=str(error))
        asked = replace(integrator.accuracy, rtol=10.0**-self.requested_digits)
        rtol = max(_TIGHTER_RTOL_FACTOR * asked.rtol, Accuracy.MIN_RTOL)
        tighter = replace(asked, rtol=rtol, budget=_MAX_TIGHTER_WORK * asked.budget)
        (outcome, spent), (truth, more) = (measure.run_metered(drawn, a) for a in (asked, tighter))
        integrator.work_meter.add_evaluations("asked", spent.evaluations)
        integrator.work_meter.add_evaluations("tighter", more.evaluations)
        values: dict[str, Any] = {
            "ended_as": float(outcome.status),
            "status_kept_error": 0.0,
            # The status is not compared if one of the runs fails.
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
    """Divide the measured errors by the error estimates and by the tolerance.

    The uncertainty of the reference results is subtracted from the errors.

    Parameters
    ----------
    measured : mapping
        Results of the first run.
    truth : mapping
        Results of the more accurate run.
    rtol : float
        Requested relative accuracy.

    Returns
    -------
    dict
        Two ratios for each result. The ratios of missing results are NaN.
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
    """Return the ratio of an error to the allowed error."""
    if not error:
        return 0.0
    return error / allowed if allowed else math.inf


# Numba imports a package called coverage, and finds this file if Python runs in this directory.
if __name__ == "coverage":
    raise ImportError("this module is a study and not the package coverage")

DYNAMICS: dict[str, dict[str, bool | float]] = {
    "quasi-static": {"inertia": False},
    # The value is replaced by a random value.
    "radiation damping": {"radiation_damping": 1e-9},
    "inertia": {"inertia": True},
}
REQUESTED_DIGITS = (4, 7)


@dataclass(frozen=True)
class CoverageStatistics(Reduction):
    """Statistics of the ratios of errors to error estimates.

    Parameters
    ----------
    name : str
        Prefix of the results: ``<name>_share`` (fraction of errors that do not exceed their
        estimates), ``<name>_worst`` (largest ratio of an error to its estimate),
        ``<name>_find_typical_value`` (median ratio of estimates to errors) and ``<name>_numbers``
        (number of errors).
    of : str
        Variable that contains the ratios of errors to error estimates, with NaN for missing
        results.
    by : tuple of str, optional
        Dimensions that the statistics keep. The statistics combine all other dimensions.
    """

    by: tuple[str, ...] = ()
    kind: ClassVar[str] = "covered"

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantities of the results."""
        among = ", by question" if "question" in self.by else ""
        texts = {
            "share": "fraction of errors within their estimates",
            "worst": "largest ratio of error and estimate",
            "typical": "median ratio of estimate and error",
            "numbers": "number of results with an error and an estimate",
        }
        return [Quantity(f"{self.name}_{k}", "", "1", f"{t}{among}") for k, t in texts.items()]

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the statistics over all dimensions except the grouping dimensions.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Statistics of the ratios.
        """
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


#: Range of error ratios in the figure. Ratios outside this range are drawn at its ends.
PLOTTED_ERROR_RATIOS = (1e-3, 10.0)


def plot_error_histogram(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw one histogram of error ratios per requested accuracy.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
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
            x_label="Error divided by its estimate",
            y_label="Numbers",
        )
    ]
)


#: Claims about error estimates at each accuracy: statement, variable, and arguments of ``Claim``.
COVERAGE_CLAIMS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    (
        "at least 99.5 % of errors lie within their estimates",
        "covered_share",
        {
            "relation": "above",
            "published": 0.995,
            "tolerance": 0.005,
            "reason": "the standard deviation of the fraction over 250 numbers is half of the "
            "tolerance, and rounding changes the fraction",
        },
    ),
    (
        "no error is three times its estimate",
        "covered_worst",
        {"relation": "below", "published": 3.0},
    ),
    (
        "the median estimate is less than ten times the error",
        "covered_typical",
        {
            "relation": "below",
            "published": 10.0,
            "tolerance": 4.0,
            "reason": "two standard errors of the median of 290 numbers, from resampling",
        },
    ),
)
CLAIMS = [
    Claim(
        id=f"T{number}",
        statement=f"rtol 1e-{digits}: {statement}",
        source="design goal of the error estimates",
        variable=variable,
        where={"requested_digits": float(digits)},
        **held,
    )
    for digits in REQUESTED_DIGITS
    for number, (statement, variable, held) in enumerate(COVERAGE_CLAIMS, start=1)
]


study = Study(
    name="coverage",
    title="Coverage of errors by error estimates for random scenes",
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
