"""Slip law or slowness law? How often a record tells, and how often it misleads.

Velocity steps made by one law and fitted by both; Akaike's criterion, in which the noise counts,
decides where it differs by 4. At the noise of a good rig one step tells the law. At ten times that
noise a step leaves it open, and a pair, up and back, tells it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.reductions import Reduction
from rsfstudy.study.figure_declarations import Axes

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
#: Difference of the criterion that decides: the other law is then e^2 times less likely.
DECISIVE_AIC_DIFFERENCE = 4.0


@dataclass(frozen=True)
class LawChoiceShares(Reduction):
    """Shares of records that tell the law that made them, tell the other one, or tell neither.

    Parameters
    ----------
    name : str
        Gives ``<name>_right``, ``<name>_wrong`` and ``<name>_open``.
    of : str
        The criterion, by law and by fitted law.
    """

    kind: ClassVar[str] = "choice"
    long_names: ClassVar[Mapping[str, str]] = {
        "_right": "share of records that tell the law that made them",
        "_wrong": "share of records that tell the other law",
        "_open": "share of records that tell neither law",
    }

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Over records."""
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


def plot_shares(dataset: xr.Dataset, axes: Axes) -> None:
    """Bars of right, open and wrong choices."""
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
            y_label="Steps that are fitted",
        )
    ],
    columns=1,
)


def all_records_decide_claim(law: str, design: str, size: float) -> Claim:
    """L1: where the exponent is known to a tenth, all records tell the law."""
    return Claim(
        id="L1",
        statement=f"{law} law, {design}, noise {size:g}: every record tells it",
        source="the standard error of the exponent is below .1",
        variable="chosen_right",
        where={"law": law, "design": design, "noise_size": size},
        published=1.0,
        reason="ten standard errors lie between the laws",
    )


def seldom_wrong_claim(law: str) -> Claim:
    """L2: where noise hides it, a record is seldom taken for one of the other law."""
    return Claim.below(
        id="L2",
        statement=f"{law} law, one step up, noise 0.005: fewer than half mislead",
        source="likelihood: the other law leads by e^2 in one record of nine at most",
        variable="chosen_wrong",
        where={"law": law, "design": "one step up", "noise_size": 5e-3},
        published=0.5,
        reason="four of six mislead by chance once in 500",
    )


study = Study(
    name="law_choice",
    title="Records that tell the evolution law, mislead, or leave it open",
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
    reductions=[LawChoiceShares("chosen", "criterion")],
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
