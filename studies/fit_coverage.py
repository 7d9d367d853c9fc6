"""Coverage of the confidence intervals of fits for many kinds of noise.

Synthetic records of a velocity step from 1 to 10 um/s are fitted with the law that was used to
compute them. The noise is white, autoregressive with a correlation of 0.9, or a moving average.
Full markers show intervals whose standard errors account for the correlation of the noise. These
intervals contain the exact parameters with the nominal probability. Open markers show intervals
from the usual formula, which assumes white noise. If the noise is correlated, these intervals
contain the exact parameters far less often. Other kinds of noise imitate imperfections of
laboratory records, such as a changing noise level, outliers, rounded friction, an uneven clock,
jitter or rounding of the displacement, and averaged friction. The fit reports that its standard
errors are not valid if friction is rounded too coarsely, or if friction was averaged and the
averaging time is not passed to the fit.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Study
from rsfstudy.fitting import PARAMETERS as MODEL
from rsfstudy.reductions import Reduction
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._noise_kinds import NOISE_KINDS
from ._synthetic_fit import (
    BASE_SCENE,
    FIT_ACCURACY,
    SHARE_WITHIN_ONE_STDERR,
    SHARE_WITHIN_TWO_STDERRS,
    SyntheticFit,
)

RECORDS = 24
CLASSIC_PROCESSES, LAWS = ("white", "ar1", "ma3"), ("slip", "slowness")
#: Kinds of noise that the fit cannot model. Each value is the minimum fraction of records for which
#: the fit must report invalid standard errors.
FLAGGED_KINDS = {"coarsely_rounded": 0.95, "unstated_average": 0.8}
#: Kinds of noise with a 1/f spectrum. The study makes no claim on the coverage for these kinds,
#: because the fit does not model 1/f noise.
KINDS_WITHOUT_CLAIM = ("pink",)
MODELLED_KINDS = [
    kind for kind in NOISE_KINDS if kind not in (*FLAGGED_KINDS, *KINDS_WITHOUT_CLAIM)
]
PROCESSES = (*CLASSIC_PROCESSES, *NOISE_KINDS)
#: Nominal coverage of the tested intervals. The keys are the names of the variables.
NOMINAL_COVERAGE = {"inside_one": SHARE_WITHIN_ONE_STDERR, "inside_two": SHARE_WITHIN_TWO_STDERRS}
#: Largest deviation of a measured coverage from its nominal value, in binomial standard deviations.
MAX_BINOMIAL_DEVIATION = 3.5


@dataclass(frozen=True)
class ShareInside(Reduction):
    """Fraction of records for which an interval contains the exact value.

    Parameters
    ----------
    name : str
        Name of the fraction. ``<name>_least`` is the difference between the smallest fraction of
        all parameters and the nominal coverage, in binomial standard deviations.
    of : str
        Variable that is 1 if the exact value lies inside the interval, and 0 otherwise.
    covers : float, optional
        Nominal coverage of the interval.
    """

    covers: float = SHARE_WITHIN_ONE_STDERR
    kind: ClassVar[str] = "share_inside"
    long_names: ClassVar[Mapping[str, str]] = {
        "": "fraction of records whose confidence interval contains the true value",
        "_least": "smallest difference of coverage and confidence level, in standard deviations",
    }

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the mean over records.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Fraction for each parameter, and the smallest fraction.
        """
        share = dataset[self.of].mean("seed")
        spread = np.sqrt(self.covers * (1.0 - self.covers) / dataset.sizes["seed"])
        least = (share.min("parameter") - self.covers) / spread
        return xr.Dataset({self.name: share, f"{self.name}_least": least})


@dataclass(frozen=True)
class ShareFlagged(Reduction):
    """Fraction of records for which the fit reports invalid standard errors.

    Parameters
    ----------
    name : str
        Name of the fraction.
    of : str
        Variable that is 1 for a record with invalid standard errors, and 0 otherwise.
    """

    kind: ClassVar[str] = "share_flagged"
    long_names: ClassVar[Mapping[str, str]] = {
        "": "fraction of records with standard errors that are not valid"
    }

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the mean over records.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of the study.

        Returns
        -------
        xarray.Dataset
            Fraction of records.
        """
        return xr.Dataset({self.name: dataset[self.of].mean("seed")})


def plot_shares(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Plot the fraction of intervals that contain the exact value for each kind of noise.

    Each parameter has a different marker. Full markers show the intervals of the fit, and open
    markers show the intervals of the usual formula.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_marker, cycle_style

    places = np.arange(dataset.sizes["process"])[::-1]  # from top to bottom
    for number, parameter in enumerate(dataset["parameter"].values):
        style = {"color": cycle_style(number)["color"], "marker": cycle_marker(number)}
        name = MODEL[str(parameter)].symbol or str(parameter)
        for prefix, fill, shift in (("", "full", 0.12), ("naive_", "none", -0.2)):
            share = 100.0 * dataset[f"{prefix}share_one"].isel(parameter=number)
            label = f"{name}, usual formula" if prefix else name
            axes.plot(share, places + shift, ls="", fillstyle=fill, label=label, **style)
    axes.axvline(100.0 * SHARE_WITHIN_ONE_STDERR, color="0.4", linestyle="--", linewidth=0.8)
    axes.set_yticks(places, [str(name).replace("_", " ") for name in dataset["process"].values])
    axes.set_ylim(-0.6, len(places) - 0.4)


shares_panel = Panel(
    facet=["law"],
    overlays=[plot_shares],
    x_label="Coverage of 68.3 % interval (%)",
    y_label="Noise",
    x_limits=(0.0, 103.0),
    y_scale_group="noise",
)


def figure_height(dataset: xr.Dataset) -> float:
    """Return a panel height that is sufficient for all kinds of noise.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.

    Returns
    -------
    float
        Height in mm.
    """
    return 30.0 + 5.0 * dataset.sizes["process"]


def coverage_claims(series: str, words: str, **where: str) -> list[Claim]:
    """Return the claims that 68.3 % and 95.4 % intervals have at least this coverage.

    Parameters
    ----------
    series : str
        Prefix of the identifiers of the claims.
    words : str
        Description of the records.
    **where : str
        Coordinates of the records.

    Returns
    -------
    list of Claim
        Claims about the coverage of the 68.3 % and 95.4 % intervals.
    """
    return [
        Claim.above(
            id=f"{series}{number}",
            statement=f"{words}: {100 * share:.1f} % confidence intervals have this coverage",
            source="design goal of the standard errors of fits",
            variable=f"share_{name.removeprefix('inside_')}_least",
            where=where,
            published=0.0,
            tolerance=MAX_BINOMIAL_DEVIATION,
            reason="in binomial standard deviations, for the parameter with the lowest coverage",
        )
        for number, (name, share) in enumerate(NOMINAL_COVERAGE.items(), start=1)
    ]


def flagged_claim(process: str, law: str, least: float) -> Claim:
    """Return the claim that the fit detects noise that it cannot model (F6).

    Parameters
    ----------
    process : str
        Kind of noise.
    law : str
        State evolution law.
    least : float
        Minimum fraction of records for which the fit reports invalid standard errors.

    Returns
    -------
    Claim
        Claim about the fraction of records for which the fit reports invalid standard errors.
    """
    return Claim.above(
        id="F6",
        statement=f"{process} record, {law} law: the fit reports that errors are not valid",
        source="design goal of the standard errors of fits",
        variable="flagged_share",
        where={"process": process, "law": law},
        published=least,
        reason="smallest acceptable fraction of records",
    )


def seldom_flagged_claim(process: str, law: str) -> Claim:
    """Return the claim that the fit accepts noise that it can model (F7).

    Parameters
    ----------
    process : str
        Kind of noise.
    law : str
        State evolution law.

    Returns
    -------
    Claim
        Claim about the fraction of records for which the fit reports invalid standard errors.
    """
    return Claim.below(
        id="F7",
        statement=f"{process} record, {law} law: the fit rarely reports that errors are not valid",
        source="design goal of the standard errors of fits",
        variable="flagged_share",
        where={"process": process, "law": law},
        published=0.05,
        tolerance=0.08,
        reason="two of 24 records may be flagged by chance",
    )


def naive_errors_claim(process: str, law: str) -> Claim:
    """Return the claim that the usual formula underestimates errors (F3).

    Parameters
    ----------
    process : str
        Kind of noise.
    law : str
        State evolution law.

    Returns
    -------
    Claim
        Claim about the coverage of the intervals of the usual formula.
    """
    return Claim.below(
        id="F3",
        statement=(
            f"{process} noise, {law} law: 68.3 % intervals of the usual formula are too short"
        ),
        source="correlated noise reduces the effective sample size",
        variable="naive_share_one_least",
        where={"process": process, "law": law},
        published=-MAX_BINOMIAL_DEVIATION,
        reason="the difference is too large to be due to chance",
    )


REDUCTIONS = [
    ShareInside(f"{prefix}share_{name.removeprefix('inside_')}", f"{prefix}{name}", share)
    for prefix in ("", "naive_")
    for name, share in NOMINAL_COVERAGE.items()
]
FLAGGED_SHARE_REDUCTION = ShareFlagged("flagged_share", "flagged")

study = Study(
    name="fit_coverage",
    title="Coverage of confidence intervals for synthetic records",
    summary=Study.caption(__doc__),
    base=BASE_SCENE,
    axes=[
        Axis("process", list(PROCESSES)),
        Axis("law", list(LAWS)),
        Axis("seed", list(range(RECORDS))),
    ],
    measure=SyntheticFit(),
    reductions=[*REDUCTIONS, FLAGGED_SHARE_REDUCTION],
    claims=[
        *(
            claim
            for process in (*CLASSIC_PROCESSES, *MODELLED_KINDS)
            for law in LAWS
            for claim in coverage_claims(
                "F", f"{process} noise, {law} law", process=process, law=law
            )
        ),
        *(naive_errors_claim(p, law) for p in CLASSIC_PROCESSES[1:] for law in LAWS),
        *(flagged_claim(p, law, least) for p, least in FLAGGED_KINDS.items() for law in LAWS),
        *(
            seldom_flagged_claim(p, law)
            for p in (*CLASSIC_PROCESSES, *MODELLED_KINDS)
            for law in LAWS
        ),
    ],
    plot=Figure([shares_panel], height=figure_height),
    accuracy=FIT_ACCURACY,
    references=[
        "Patterson and Thompson (1971), Biometrika 58, 545-554",
        "Marone (1998), Annu. Rev. Earth Planet. Sci. 26, 643-696",
    ],
)
