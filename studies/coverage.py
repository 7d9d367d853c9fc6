"""Coverage: do error estimates cover the errors, over random scenes?"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.figure import Axes, Figure, Panel
from rsfstudy.declare.study import Study
from rsfstudy.measures.coverage import QUESTIONS, Coverage
from rsfstudy.reduce.base import Reduction
from rsfstudy.slider.scene import Scene

DYNAMICS: dict[str, dict[str, bool | float]] = {
    "quasi-static": {"inertia": False},
    # how much is drawn with the scene
    "radiation damping": {"radiation_damping": 1e-9},
    "inertia": {"inertia": True},
}
DIGITS = (4, 7)


@dataclass(frozen=True)
class Covered(Reduction):
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

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Count over all other dimensions."""
        ratios = dataset[self.of]
        over = [d for d in ratios.dims if d not in self.by]
        known = ratios.notnull()
        numbers = known.sum(over)
        with np.errstate(divide="ignore"):
            tightness = (1.0 / ratios).median(over)
        statistics = {
            "share": (ratios <= 1.0).sum(over) / numbers.where(numbers > 0),
            "worst": ratios.max(over),
            "typical": tightness,
            "numbers": numbers,
        }
        note = f"{self.of} over {', '.join(map(str, over))}"
        return xr.Dataset(
            {f"{self.name}_{k}": v.assign_attrs(comment=note) for k, v in statistics.items()}
        )


#: Errors this far below and above their estimates are drawn there.
SHOWN = (1e-3, 10.0)


def mark_histogram(dataset: xr.Dataset, axes: Axes) -> None:
    """One outline an accuracy."""
    from rsfstudy.plots import look

    for number, digits in enumerate(dataset["requested_digits"].values):
        values = dataset["error_over_estimate"].isel(requested_digits=number).values.ravel()
        values = np.clip(values[np.isfinite(values)], *SHOWN)
        covered = f"{(values <= 1.0).sum()} of {values.size} covered"
        label = f"rtol $10^{{-{digits:g}}}$: {covered}"
        axes.hist(
            values, np.geomspace(*SHOWN, 33).tolist(), histtype="step", label=label, **look(number)
        )
    axes.axvline(1.0, color="0.3", linestyle="-", linewidth=0.8)
    axes.set_xscale("log")
    axes.locator_params(axis="y", integer=True)


figure = Figure(
    [
        Panel(
            each=["question"],
            marks=[mark_histogram],
            x_label="Error over its estimate",
            y_label="Numbers",
        )
    ]
)


def claim(number: int, statement: str, variable: str, digits: int, **held: object) -> Claim:
    """One of the three figures of error estimates, at one accuracy."""
    return Claim(
        id=f"T{number}",
        statement=f"rtol 1e-{digits}: {statement}",
        source="this project's promise for its error estimates",
        variable=variable,
        where={"requested_digits": float(digits)},
        **held,  # type: ignore[arg-type]
    )


def claims(digits: int) -> list[Claim]:
    """The three figures at one accuracy."""
    return [
        claim(
            1,
            "at least 99.5 % of errors lie within their estimates",
            "covered_share",
            digits,
            relation="above",
            published=0.995,
            tolerance=0.005,
            reason="over 250 numbers the share scatters by a half of that, and a last bit moves it",
        ),
        claim(
            2,
            "no error is three times its estimate",
            "covered_worst",
            digits,
            relation="below",
            published=3.0,
            tolerance=0.0,
            reason="an inequality",
        ),
        claim(
            3,
            "the usual estimate is within ten times the error",
            "covered_typical",
            digits,
            relation="below",
            published=10.0,
            tolerance=4.0,
            reason="two standard errors of a median over 290 numbers, by resampling them",
        ),
    ]


study = Study(
    name="coverage",
    title="How error estimates cover the errors, over random scenes",
    summary=(
        "Scenes drawn from wide ranges of every parameter, for both laws, constant and variable "
        "normal stress, and each kind of dynamics. Each is measured at the accuracy asked for and "
        "a hundred times tighter: the error that shows, beyond what the tighter run is itself "
        "uncertain by, over the estimate that the first run gave. More scenes by --set "
        "sample=0:49:50, other accuracies by --set requested_digits=4,7,9, and the readings of a "
        "laboratory by --set question: rigid response, velocity step, healing; and, with --set "
        "normal_stress=imposed, normal stress transient and normal stress response."
    ),
    base=Scene(),
    axes=[
        Axis("question", list(QUESTIONS)),
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("dynamics", DYNAMICS),
        Axis("sample", range(4)),
        Axis("requested_digits", DIGITS),
    ],
    measure=Coverage(),
    reductions=[
        Covered(name="covered", of="error_over_estimate", by=("requested_digits",)),
        Covered(
            name="covered_by_question",
            of="error_over_estimate",
            by=("question", "requested_digits"),
        ),
    ],
    claims=[c for digits in DIGITS for c in claims(digits)],
    plot=figure,
    references=["Shampine (1985), Numerical Methods: on global error estimates"],
)
