"""Distribution of a recurrence interval from the covariance of a fit.

In a fit of a velocity step, the relative standard errors are 10 % for a and for b. The errors of a
and b are strongly correlated, so the relative standard error of their small difference b - a is
only 20 %. The relative standard error of the slip distance D_c is 13 %, but D_c has little
influence on the recurrence interval. On the machine of this study, the relative standard error of
the recurrence interval of stick-slip is 15 %. The recurrence interval depends on b - a through the
stress drop, and on b through healing between events. If the errors of the parameters were
independent, the relative standard error of the recurrence interval would be 90 %.
"""

import math
from dataclasses import replace

import numpy as np
import xarray as xr

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Rig, Study
from rsfstudy.measures import LimitCycle
from rsfstudy.reductions import InUnits, Logarithm, Mean, Quantile, StandardDeviation, StatusShares
from rsfstudy.study.figure_declarations import MatplotlibAxes

# ---- result of a fit ----------------------------------------------------------------------------

#: Estimates and covariance matrix of a, b and D_c (in um) from a fit of a velocity step of basalt
#: from 3 to 10 um/s at 20 MPa. The record is part of the package, and the fit is
#: ``rsfstudy.fit(record, stiffness="0.0013 1/um", laws=["slowness"])``. The covariance accounts for
#: correlated noise, including noise of the load point displacement. The correlation between the
#: errors of a and b is 0.97, so b - a is known much better than a or b.
ESTIMATES = {"a": 5.683e-3, "b": 6.221e-3, "slip_distance": 7.800}
COVARIANCE = np.array(
    [
        [3.012e-7, 2.847e-7, -2.375e-4],
        [2.847e-7, 2.823e-7, -2.117e-4],
        [-2.375e-4, -2.117e-4, 1.0657],
    ]
)

# ---- the study ----------------------------------------------------------------------------------

SAMPLES = 256
#: Derivatives of the logarithm of the recurrence interval in s with respect to the logarithm of
#: each parameter, computed at the estimates with the measure ``Elasticities``.
ELASTICITIES = {"a": -7.54, "b": 8.69, "slip_distance": -0.113}
#: Standard deviation of the logarithm of the recurrence interval to first order, computed from the
#: full covariance matrix and from the variances only.
LOG_INTERVAL_SLOPES = np.array([ELASTICITIES[name] / value for name, value in ESTIMATES.items()])
FIRST_ORDER_SPREAD = math.sqrt(LOG_INTERVAL_SLOPES @ COVARIANCE @ LOG_INTERVAL_SLOPES)
SPREAD_WITHOUT_CORRELATION = math.sqrt(LOG_INTERVAL_SLOPES**2 @ np.diag(COVARIANCE))
#: Relative standard error of b - a.
NET_WEAKENING_STDERR = math.sqrt(np.array([-1, 1]) @ COVARIANCE[:2, :2] @ np.array([-1, 1])) / (
    ESTIMATES["b"] - ESTIMATES["a"]
)

rig = Rig(
    normal_stress="20 MPa",
    slip_distance=f"{ESTIMATES['slip_distance']} um",
    reference_velocity="1 um/s",
    stiffness="0.0003 MPa/um",
    mass="1e4 kg/m^2",
)
base = rig.scene(
    law="slowness",
    a=ESTIMATES["a"],
    b_over_a=ESTIMATES["b"] / ESTIMATES["a"],
    normal_stress="constant",
)

CLAIMS = (
    Claim(
        id="U1",
        statement="the standard deviation of the logarithm of the interval follows from its "
        "elasticities and the covariance",
        source="propagation of errors to first order",
        variable="relative_spread",
        where={},
        published=FIRST_ORDER_SPREAD,
        tolerance=0.2 * FIRST_ORDER_SPREAD,
        reason=(
            "three standard errors of a standard deviation from 256 samples (5 % each), and an "
            "increase of the elasticities by 10 % if b - a is smaller by 20 %"
        ),
    ),
    Claim.below(
        id="U2",
        statement="the standard deviation for independent errors is more than four times as large",
        source="propagation of errors to first order, without covariances",
        variable="relative_spread",
        where={},
        published=0.25 * SPREAD_WITHOUT_CORRELATION,
    ),
    Claim.below(
        id="U3",
        statement="the relative uncertainty of the interval is smaller than that of b - a",
        source=(
            "contacts heal by b ln t between events, so only part of the drop is proportional to "
            "b - a"
        ),
        variable="relative_spread",
        where={},
        published=NET_WEAKENING_STDERR,
    ),
    Claim(
        id="U4",
        statement="every sample has stick-slip",
        source=(
            "b - a exceeds zero by five standard errors, and the stiffness is far below critical"
        ),
        variable="share",
        where={"ended": "ok"},
        published=1.0,
        reason="a count",
    ),
)


def net_weakening(row: xr.Dataset) -> xr.DataArray:
    """Return the net weakening b - a.

    Parameters
    ----------
    row : xarray.Dataset
        Results of the study.

    Returns
    -------
    xarray.DataArray
        Net weakening.
    """
    return row["a"] * (row["b_over_a"] - 1.0)


def plot_quantiles(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the median, and shade the range from the 5 % quantile to the 95 % quantile.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    axes.axvspan(float(dataset["q05"]), float(dataset["q95"]), color="0.5", alpha=0.2, zorder=0.5)
    axes.axvline(float(dataset["median"]), color="0.2", linewidth=0.9)


def plot_histogram(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw a histogram of the recurrence interval.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots.corner_plots import draw_histogram

    draw_histogram("recurrence_interval", [], dataset, axes)


INTERVAL_LABEL = "Recurrence interval (s)"
DOT_STYLE = {"marker": ".", "markersize": 3.0, "markeredgewidth": 0.0}
scatter_panel = Panel(
    y="recurrence_interval", markers_only=True, style=DOT_STYLE, y_label=INTERVAL_LABEL, title=""
)
figure = Figure(
    [
        Panel(
            overlays=[plot_histogram, plot_quantiles],
            x_label=INTERVAL_LABEL,
            y_label="Samples",
            title="Median, and 5 to 95 %",
        ),
        replace(scatter_panel, x=net_weakening, x_label="$b - a$"),
        replace(scatter_panel, x="slip_distance"),
        replace(
            scatter_panel,
            x="a",
            y=lambda row: row["a"] * row["b_over_a"],
            y_label="$b$",
            title="Sampled quantities",
        ),
    ]
)

study = Study(
    name="uncertain_recurrence",
    title="Recurrence interval of a rig from estimates of a, b and D_c with their covariance",
    summary=Study.caption(__doc__),
    rig=rig,
    base=base,
    axes=[
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
        )
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
    claims=CLAIMS,
    plot=figure,
    references=["Marone (1998), Annu. Rev. Earth Planet. Sci. 26, 643-696"],
)
