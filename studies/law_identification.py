"""Standard error of the exponent of the evolution law for three designs.

The records contain tenfold velocity steps with white noise, which has a standard deviation of 5e-4.
Each window has separate values of initial friction and trend. The exponent is 0 for the slip law
and 1 for the slowness law. A single step up determines the exponent poorly, because a change of the
slip distance has a similar effect on friction. A second step up reduces the standard error no more
than a repetition of the first step would. A step up followed by a step back determines the exponent
ten times more accurately.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.reductions import Reduction
from rsfstudy.study.figure_declarations import MatplotlibAxes
from rsfstudy.study.reductions.base import DerivativesAndCellCoordinates

from ._synthetic_fit import (
    BASE_SCENE,
    FIT_ACCURACY,
    STEP_BACK_PROTOCOL,
    STEP_UP_PROTOCOL,
    SyntheticFit,
    protocol_axis,
)

RECORDS = 12
DESIGNS = {
    "one step up": STEP_UP_PROTOCOL,
    "a pair, up and back": f"{STEP_UP_PROTOCOL}; {STEP_BACK_PROTOCOL}",
    "two steps up": f"{STEP_UP_PROTOCOL}; {STEP_UP_PROTOCOL}",
}
#: Standard errors of the exponent from the Fisher information.
EXPECTED_STDERRS = {"one step up": 0.087, "a pair, up and back": 0.009, "two steps up": 0.062}
#: Largest deviation that is attributed to chance, in standard deviations.
MAX_CHANCE_DEVIATION = 3.5
#: Exact value of the fitted exponent, halfway between the slip law and the slowness law.
TRUE_EXPONENT = 0.5
FAMILY_SCENE = BASE_SCENE.with_(law="family", law_exponent=TRUE_EXPONENT)
EXPONENT_FIT = SyntheticFit(
    free=("a", "b", "slip_distance", "law_exponent", "mu_star", "trend1"), noise="white"
)


@dataclass(frozen=True)
class ScatterRatio(Reduction):
    """Ratio of the scatter of an estimate to its expected standard error.

    Parameters
    ----------
    name : str
        Name of the ratio. The scatter is the root mean square of the deviations. ``<name>_off`` is
        the difference of the ratio from 1, in standard deviations of the ratio.
    of : str
        Variable that contains the deviations of the estimate.
    over : tuple of str, default: ("seed",)
        Dimensions along which the records differ.
    """

    over: tuple[str, ...] = ("seed",)
    kind: ClassVar[str] = "scatter_over_promise"
    long_names: ClassVar[Mapping[str, str]] = {
        "": "scatter of the estimates divided by the predicted standard error",
        "_off": "scatter divided by the predicted standard error, minus 1, in standard deviations",
    }

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the ratio over all records.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Ratio, and its difference from 1.
        """
        square = (dataset[self.of] / dataset["promised_spread"]) ** 2
        found = np.sqrt(square.mean(self.over))
        off = (found - 1.0) * math.sqrt(2.0 * self._record_dimensions(dataset))
        return xr.Dataset({self.name: found, f"{self.name}_off": off})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Return the derivatives of the ratio with respect to the deviations.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        Derivatives
            Derivatives, keyed by result and variable.
        """
        over = dataset[self.of] / dataset["promised_spread"] ** 2
        return [(over / (self._record_dimensions(dataset) * self(dataset)[self.name]), {})]

    def _record_dimensions(self, dataset: xr.Dataset) -> int:
        """Return the number of records."""
        return math.prod(dataset.sizes[name] for name in self.over)


def plot_estimates(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the estimates of the exponent and the expected standard errors.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_marker, cycle_style

    seen = dataset.sel(parameter="law_exponent")
    for number in range(seen.sizes["design"]):
        one = seen.isel(design=number)
        spread = np.linspace(-0.2, 0.2, one.sizes["seed"])
        style = {"color": cycle_style(number)["color"], "linestyle": ""}
        axes.plot(
            number + spread, one["estimate"], marker=cycle_marker(number), markersize=4, **style
        )
        promise = float(one["promised_spread"].isel(seed=0))
        axes.errorbar(number + 0.35, TRUE_EXPONENT, promise, color="0.2", capsize=4, marker="_")
        text = f"{promise:.3f}"
        above = {"textcoords": "offset points", "ha": "center"}
        axes.annotate(text, (number + 0.35, TRUE_EXPONENT + promise), (0, 4), **above)
    axes.set_xticks(range(seen.sizes["design"]), [str(name) for name in seen["design"].values])
    axes.set_xlim(-0.4, seen.sizes["design"] - 0.3)
    axes.axhline(TRUE_EXPONENT, color="0.6", linewidth=0.8)


figure = Figure(
    [
        Panel(
            overlays=[plot_estimates],
            x_label="Fitted steps",
            y_label="Exponent of the law",
            y_limits=(0.0, 1.0),
        )
    ],
    columns=1,
)


def design_claims(design: str) -> list[Claim]:
    """Return the claims about the standard error for an experimental design (I1 and I2).

    Parameters
    ----------
    design : str
        Name of the design.

    Returns
    -------
    list of Claim
        Claims about the expected standard error and about the scatter of the estimates.
    """
    where = {"design": design, "parameter": "law_exponent"}
    return [
        Claim(
            id="I1",
            statement=f"{design}: standard error of the exponent from the Fisher information",
            source=(
                "augmented equations of the sensitivities, 500 rows per step, white noise of 5e-4"
            ),
            variable="promised_spread",
            where={**where, "seed": 0},
            published=EXPECTED_STDERRS[design],
            tolerance=0.02 * EXPECTED_STDERRS[design],
            reason="the expected value has two digits",
        ),
        Claim(
            id="I2",
            statement=f"{design}: the scatter of the estimates equals the standard error",
            source="Fisher's information",
            variable="scatter_off",
            where=where,
            published=0.0,
            tolerance=MAX_CHANCE_DEVIATION,
            reason="in standard deviations of the estimated standard deviation",
        ),
    ]


study = Study(
    name="law_identification",
    title="Estimates of the exponent of the evolution law by three designs of velocity steps",
    summary=Study.caption(__doc__),
    base=FAMILY_SCENE,
    axes=[
        protocol_axis(DESIGNS),
        Axis("seed", list(range(RECORDS))),
    ],
    measure=EXPONENT_FIT,
    reductions=[ScatterRatio("scatter", "deviation")],
    claims=[claim for design in DESIGNS for claim in design_claims(design)],
    plot=figure,
    accuracy=FIT_ACCURACY,
    references=["Marone (1998), Annu. Rev. Earth Planet. Sci. 26, 643-696"],
)
