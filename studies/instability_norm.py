"""Influence of the instability norm on critical steps.

A motion is considered unstable when V T/(2 pi D_c) reaches the instability norm. The paper does not
specify the value of this norm. The paper reports two critical velocities for the slowness law, and
both imply a norm of 5e-4. Under the slip law, the norm is important if b - a is small compared to
a: at a/(b-a) = 4, the critical load point velocity is 4.66 V_* for a norm of 5e-4, and 5 V_* for an
infinite norm.
"""

import math
from dataclasses import replace

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.reductions import Inverse
from rsfstudy.study.figure_declarations import MatplotlibAxes, build_horizontal_line_overlay

from ._paper import PAPER, REFERENCE

#: Cases of the study. Two cases are taken from section 4 of the paper (slowness law, b/a = e, alpha
#: = 0.56). The other cases have the slip law, constant normal stress and a small b - a, for which
#: the instability norm is most important.
SOFT_BOUNDARY, STIFF_BOUNDARY = "slowness at k_cr", "slowness at 1.5 k_cr"
SLOWNESS_FIELDS: dict[str, str | float] = {
    "law": "slowness",
    "normal_stress": "variable",
    "alpha": 0.56,
    "b_over_a": math.e,
}
BOUNDARIES: dict[str, dict[str, str | float]] = {
    SOFT_BOUNDARY: {**SLOWNESS_FIELDS, "stiffness_ratio": 1.0},
    STIFF_BOUNDARY: {**SLOWNESS_FIELDS, "stiffness_ratio": 1.5},
    **{
        f"slip at a/(b-a) = {inverse:g}": {
            "law": "slip",
            "normal_stress": "constant",
            "b_over_a": 1.0 + 1.0 / inverse,
            "stiffness_ratio": 1.0,
        }
        for inverse in (1.0, 2.0, 4.0, 10.0)
    },
}


def plot_norm(_dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw a line at the instability norm that the other studies use.

    Parameters
    ----------
    _dataset : xarray.Dataset
        Results of the study. Not used.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    grey = {"color": "0.7", "linewidth": 0.8, "linestyle": ":"}
    axes.axvline(5e-4, label="norm of our studies", **grey)


def plot_published_norms(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the instability norms that the published critical steps imply.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_marker, cycle_style, format_number

    for place in range(dataset.sizes["boundary"]):
        row = dataset.isel(boundary=place)
        norm = float(row.get("implied_norm", math.nan))
        if math.isfinite(norm):
            axes.errorbar(
                norm,
                float(row["critical_velocity_ratio"].interp(instability_norm=norm)),
                xerr=float(row["implied_norm_error"]),
                fmt=cycle_marker(place),
                color=cycle_style(place)["color"],
                label=f"published value: norm {format_number(norm, 4)}",
            )


def select_law(law: str, values: xr.DataArray) -> xr.DataArray:
    """Select the values of one law.

    Parameters
    ----------
    law : str
        State evolution law.
    values : xarray.DataArray
        Values with a coordinate ``law``.

    Returns
    -------
    xarray.DataArray
        Values of this law. The values of the other law are NaN.
    """
    return values.where(values["law"] == law)


panel = Panel(
    x="instability_norm", hue=["boundary"], style={"marker": ""}, overlays=[plot_norm], log="x"
)
figure = Figure(
    [
        replace(
            panel,
            y=lambda row: select_law("slowness", row["critical_velocity_ratio"]),
            overlays=[plot_norm, plot_published_norms],
            title="Slowness law",
            y_label="Critical load point velocity, $V_0/V_*$",
            log="xy",
        ),
        replace(
            panel,
            y=lambda row: select_law(
                "slip", (row["critical_velocity_ratio"] - 1.0) * (row["b_over_a"] - 1.0)
            ),
            overlays=[plot_norm, build_horizontal_line_overlay(1.0)],
            title="Slip law, $k = k_{cr}$",
            y_label=r"$(V_0/V_* - 1)\,(b-a)/a$",
        ),
    ]
)


study = Study(
    name="instability_norm",
    title="Critical load point velocity step against the instability norm",
    summary=Study.caption(__doc__),
    base=Scene(),
    axes=[
        Axis("boundary", BOUNDARIES),
        Axis("instability_norm", np.geomspace(5e-6, 5e-2, 33)),
    ],
    measure=CriticalStep(of="load_velocity_ratio", direction="up"),
    reductions=[
        Inverse(
            name="implied_norm",
            of="critical_velocity_ratio",
            on="instability_norm",
            along="boundary",
            levels={SOFT_BOUNDARY: 11.8, STIFF_BOUNDARY: 2361.0},
            uncertainty={SOFT_BOUNDARY: 0.05 / 11.8, STIFF_BOUNDARY: 0.5 / 2361.0},
        )
    ],
    claims=[
        Claim(
            id="C17",
            statement="'~2361 V_*' at k = 1.5 k_cr implies the default norm of the package",
            source=f"{PAPER}, section 4, which does not specify the norm",
            variable="implied_norm",
            where={"boundary": STIFF_BOUNDARY},
            published=5e-4,
            tolerance=1.3e-7,
            reason="half a unit of the last digit of 2361 corresponds to 1.3e-7 in the norm",
        ),
        Claim(
            id="C17",
            statement="'~11.8 V_*' at k = k_cr implies the same norm as '~2361 V_*'",
            source=f"{PAPER}, section 4",
            variable="implied_norm",
            where={"boundary": SOFT_BOUNDARY},
            baseline={"boundary": STIFF_BOUNDARY},
            published=0.0,
            tolerance=7.9e-6,
            reason="half a unit of the last digit of each value corresponds to 7.7e-6 and 1.3e-7 "
            "in the norm",
        ),
    ],
    plot=figure,
    references=[REFERENCE],
)
