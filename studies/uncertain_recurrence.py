"""What the uncertainty of a fit does to a recurrence interval: a, b and D_c with their covariance."""

import math
from dataclasses import replace

import numpy as np
import xarray as xr

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.figure import Axes, Figure, Panel
from rsfstudy.declare.study import Study
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.reduce import Logarithm, Mean, Quantile, StandardDeviation, StatusShares
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.reductions import InUnits

# ---- what a fit says ----------------------------------------------------------------------------

#: Estimates of a fit, as of a velocity step of basalt at 20 MPa: D_c in um; standard errors that
#: count the correlation of noise; and the correlations of estimates. A single step tells b - a
#: better than either of the two, and trades D_c for b.
ESTIMATES = {"a": 0.0093, "b": 0.0122, "slip_distance": 10.0}
ERRORS = np.array([0.0004, 0.0005, 1.5])
CORRELATIONS = np.array([[1.0, 0.9, -0.3], [0.9, 1.0, -0.4], [-0.3, -0.4, 1.0]])
COVARIANCE = CORRELATIONS * np.outer(ERRORS, ERRORS)

# ---- the study ----------------------------------------------------------------------------------

SAMPLES = 256
LAWS = ("slip", "slowness")
#: Variance of b - a over its square, with the covariance, and without.
NET = ESTIMATES["b"] - ESTIMATES["a"]
OF_NET = math.sqrt(np.array([-1.0, 1.0]) @ COVARIANCE[:2, :2] @ np.array([-1.0, 1.0])) / NET
AS_IF_INDEPENDENT = float(np.hypot(*ERRORS[:2])) / NET

rig = Laboratory(
    normal_stress="20 MPa",
    slip_distance="10 um",
    reference_velocity="1 um/s",
    stiffness="0.001 MPa/um",
    mass="1e4 kg/m^2",
)
base = rig.scene(
    a=ESTIMATES["a"], b_over_a=ESTIMATES["b"] / ESTIMATES["a"], normal_stress="constant"
)


def spread(law: str) -> tuple[Claim, ...]:
    """U1, U2: the spread of the interval is that of b - a."""
    place = {"law": law}
    return (
        Claim(
            id="U1",
            statement=f"{law} law: intervals spread as b - a does, {100 * OF_NET:.1f} %",
            source="drops are (b - a) sigma times a logarithm, and intervals drops over k V_0",
            variable="relative_spread",
            where=place,
            published=OF_NET,
            tolerance=0.15 * OF_NET,
            reason="the logarithm holds D_c and b - a once more; 256 samples tell 4 % of a spread",
        ),
        Claim(
            id="U2",
            statement=f"{law} law: errors of a and b taken for independent would say far more",
            source="the variance of a difference",
            variable="relative_spread",
            where=place,
            relation="below",
            published=0.5 * AS_IF_INDEPENDENT,
            tolerance=0.0,
            reason="an inequality",
        ),
        Claim(
            id="U4",
            statement=f"{law} law: every sample slips by stick-slip",
            source="the machine is six times softer than critical",
            variable="share",
            where=place | {"ended": "ok"},
            published=1.0,
            tolerance=0.0,
            reason="a count",
        ),
    )


def net(row: xr.Dataset) -> xr.DataArray:
    """b - a."""
    return row["a"] * (row["b_over_a"] - 1.0)


def mark_quantiles(dataset: xr.Dataset, axes: Axes) -> None:
    """Medians, and from where to where nine of ten are."""
    from rsfstudy.plots import look

    for number, law in enumerate(dataset["law"].values):
        row, style = dataset.sel(law=law), {"color": look(number)["color"], "zorder": 3.0}
        axes.axvspan(float(row["q05"]), float(row["q95"]), color=style["color"], alpha=0.12)
        axes.axvline(float(row["median"]), **style, linewidth=0.9)


def mark_histogram(dataset: xr.Dataset, axes: Axes) -> None:
    """How often an interval is met."""
    from rsfstudy.plots.samples import histogram

    histogram("recurrence_interval", ["law"], dataset, axes)


scatter = Panel(by=["law"], y="recurrence_interval", points=True, y_label="Recurrence interval (s)")
figure = Figure(
    [
        Panel(
            marks=[mark_histogram, mark_quantiles],
            x_label="Recurrence interval (s)",
            y_label="Samples",
            title="Medians, and 5 to 95 %",
        ),
        replace(scatter, x=net, x_label="$b - a$", title=""),
        replace(scatter, x="slip_distance", title=""),
        Panel(
            x="a", y=lambda row: row["a"] * row["b_over_a"], points=True, y_label="$b$",
            title="What is drawn",
        ),
    ],
)  # fmt: skip

study = Study(
    name="uncertain_recurrence",
    title="Recurrence interval of a rig by estimates of a, b and D_c with their covariance",
    summary=(
        "A fit of a velocity step knows a and b to 4 %, and D_c to 15 %. Their covariance makes "
        "of that 8 % in b - a, and as much in the interval of stick-slip: drops are (b - a) sigma "
        "times a logarithm, in which D_c hardly shows. Errors taken for independent would say 22 "
        "%. Which law holds matters more than either."
    ),
    laboratory=rig,
    base=base,
    axes=[
        Axis("law", LAWS),
        Axis.samples(
            ESTIMATES,
            SAMPLES,
            seed=37,
            covariance=COVARIANCE,
            fields={
                "a": "a",
                "b_over_a": lambda drawn: drawn["b"] / drawn["a"],
                "slip_distance": "slip_distance",
            },
            units={"slip_distance": "um"},
        ),
    ],
    measure=LimitCycle(phases=2),
    accuracy=Accuracy(rtol=1e-5),
    reductions=[
        InUnits(name="interval", of="recurrence_interval", units="s"),
        Mean(name="mean_interval", of="interval"),
        StandardDeviation(name="spread", of="interval"),
        *(
            Quantile(name=name, of="interval", level=level)
            for name, level in (("q05", 0.05), ("median", 0.5), ("q95", 0.95))
        ),
        Logarithm(name="ln_interval", of="interval"),
        StandardDeviation(name="relative_spread", of="ln_interval"),
        StatusShares(name="share", of="recurrence_interval"),
    ],
    claims=[
        *(claim for law in LAWS for claim in spread(law)),
        Claim(
            id="U3",
            statement="the law matters more than the uncertainty of its numbers",
            source="contact heals at rest by the slowness law alone",
            variable="q05",
            where={"law": "slowness"},
            minus_variable="q95",
            minus={"law": "slip"},
            relation="above",
            published=0.0,
            tolerance=0.0,
            reason="an inequality",
        ),
    ],
    plot=figure,
    references=["Marone (1998), Annu. Rev. Earth Planet. Sci. 26, 643-696"],
)
