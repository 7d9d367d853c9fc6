"""Correct and wrong choices between the slip law and the slowness law.

Velocity steps are computed with one law and fitted with both laws. The law with the lower AIC is
chosen if the difference exceeds 4. The AIC accounts for the noise model. With the noise of a good
testing machine, a single step is sufficient to identify the law. With ten times this noise, a
single step does not identify the law, but a step up followed by a step back identifies the law.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.reductions import Reduction
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._synthetic_fit import (
    BASE_SCENE,
    FIT_ACCURACY,
    STEP_BACK_PROTOCOL,
    STEP_UP_PROTOCOL,
    SyntheticFit,
    protocol_axis,
)

RECORDS = 6
LAWS = ("slip", "slowness")
DESIGNS = {
    "one step up": STEP_UP_PROTOCOL,
    "a pair, up and back": f"{STEP_UP_PROTOCOL}; {STEP_BACK_PROTOCOL}",
}
NOISE_SIZES = (5e-4, 5e-3)
#: Difference of the AIC that is considered decisive. At this difference, the likelihood of the law
#: with the higher AIC is lower by a factor of e^2.
DECISIVE_AIC_DIFFERENCE = 4.0


@dataclass(frozen=True)
class LawChoiceShares(Reduction):
    """Fractions of records with a correct, a wrong or an undecided choice of law.

    Parameters
    ----------
    name : str
        Prefix of the results ``<name>_right``, ``<name>_wrong`` and ``<name>_open``.
    of : str
        Variable that contains the AIC along ``law`` and ``fitted_law``.
    """

    kind: ClassVar[str] = "choice"
    long_names: ClassVar[Mapping[str, str]] = {
        "_right": "fraction of records that identify the true law",
        "_wrong": "fraction of records that identify the other law",
        "_open": "fraction of records that identify neither law",
    }

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the fractions over all records.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Fractions of records.
        """
        of = dataset[self.of]
        other = of.sel(fitted_law=list(reversed(LAWS))).assign_coords(fitted_law=list(LAWS))
        laws = of["law"].values
        ahead = xr.concat(
            [(other - of).sel(law=law, fitted_law=law, drop=True) for law in laws],
            xr.Variable("law", laws.astype(object)),
        )
        return xr.Dataset(
            {
                f"{self.name}_right": (ahead > DECISIVE_AIC_DIFFERENCE).mean("seed"),
                f"{self.name}_wrong": (ahead < -DECISIVE_AIC_DIFFERENCE).mean("seed"),
                f"{self.name}_open": (abs(ahead) <= DECISIVE_AIC_DIFFERENCE).mean("seed"),
            }
        )


def plot_shares(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw bars with the fractions of correct, undecided and wrong choices.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import label_rows

    rows = dataset.stack(row=("design", "noise_size"))
    names = [f"{design}, noise = {size:g}" for design, size in rows["row"].values]
    begin = np.zeros(len(names))
    colours = {"right": "#0072b2", "open": "0.8", "wrong": "#d55e00"}
    for key, colour in colours.items():
        shares = 100.0 * rows[f"chosen_{key}"].values
        axes.barh(range(len(names)), shares, left=begin, color=colour, label=key, height=0.6)
        begin = begin + shares
    label_rows(axes, names, 20)
    axes.set_xlim(0.0, 100.0)


figure = Figure(
    [
        Panel(
            facet=["law"],
            overlays=[plot_shares],
            x_label="Records (%)",
            y_label="Fitted steps",
        )
    ],
    columns=1,
)


def all_records_decide_claim(law: str, design: str, size: float) -> Claim:
    """Return the claim that all records identify the law (L1).

    The standard error of the exponent is less than 0.1 in these cases.

    Parameters
    ----------
    law : str
        State evolution law.
    design : str
        Name of the design.
    size : float
        Standard deviation of the noise.

    Returns
    -------
    Claim
        Claim about the fraction of correct choices.
    """
    return Claim(
        id="L1",
        statement=f"{law} law, {design}, noise {size:g}: every record identifies the law",
        source="the standard error of the exponent is less than 0.1",
        variable="chosen_right",
        where={"law": law, "design": design, "noise_size": size},
        published=1.0,
        reason="the exponents of the laws differ by ten standard errors",
    )


def seldom_wrong_claim(law: str) -> Claim:
    """Return the claim that strong noise rarely leads to a wrong choice (L2).

    Parameters
    ----------
    law : str
        State evolution law.

    Returns
    -------
    Claim
        Claim about the fraction of wrong choices.
    """
    return Claim.below(
        id="L2",
        statement=f"{law} law, one step up, noise 0.005: fewer than half of the choices are wrong",
        source="likelihood ratio: the wrong law leads by e^2 in at most one of nine records",
        variable="chosen_wrong",
        where={"law": law, "design": "one step up", "noise_size": 5e-3},
        published=0.5,
        reason="the probability that four of six choices are wrong by chance is 1/500",
    )


study = Study(
    name="law_choice",
    title="Records that identify the evolution law, the wrong law, or no law",
    summary=Study.caption(__doc__),
    base=BASE_SCENE,
    axes=[
        Axis("law", list(LAWS)),
        Axis("fitted_law", list(LAWS)),
        protocol_axis(DESIGNS),
        Axis("noise_size", list(NOISE_SIZES)),
        Axis("seed", list(range(RECORDS))),
    ],
    measure=SyntheticFit(noise="white"),
    reductions=[LawChoiceShares("chosen", "aic")],
    claims=[
        *(
            all_records_decide_claim(law, design, NOISE_SIZES[0])
            for law in LAWS
            for design in DESIGNS
        ),
        *(all_records_decide_claim(law, "a pair, up and back", NOISE_SIZES[1]) for law in LAWS),
        *(seldom_wrong_claim(law) for law in LAWS),
    ],
    plot=figure,
    accuracy=FIT_ACCURACY,
    references=["Bhattacharya et al. (2015), J. Geophys. Res. 120, 6365-6385"],
)
