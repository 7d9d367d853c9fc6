"""Critical velocity step against a/(b-a) (Fig. 5).

The load point velocity of a slider in steady state at V_* changes to V_0. The critical step is the
smallest V_0 for which the slip rate reaches the instability norm. The figure shows the critical
step for constant normal stress, and for normal stress that varies with shear stress. The parameter
zeta of the function V_0/V_* = 1 + zeta a/(b-a) is fitted to the critical steps at a/(b-a) from 0.25
to 1. At larger values of a/(b-a), the finite instability norm lowers the critical step below the
line V_0/V_* = 1 + a/(b-a), even at constant normal stress.
"""

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.reductions import ProportionalFit, RelativeDifference
from rsfstudy.study.figure_declarations import MatplotlibAxes, build_reference_line_overlay

from ._paper import (
    CONSTANT_NORMAL_STRESS,
    GU_ET_AL,
    NORMAL_STRESS_CASES,
    PAPER,
    REFERENCE,
    STRONG_NORMAL_STRESS_EFFECT,
    WEAK_NORMAL_STRESS_EFFECT,
)

#: Values of a/(b-a). The values are closely spaced over the fitted range, which is the range of the
#: paper, and extend to values at which the finite instability norm bends the curves.
a_over_b_minus_a = np.concatenate([np.arange(5, 20) / 20, np.arange(4, 17) / 4])


FITTED_RANGE = (0.25, 1.0)


def fit_line(row: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return the fitted line.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    tuple of ndarray
        Values of a/(b-a) and of V_0/V_* at the ends of the line.
    """
    reach = np.array([0.0, 1.03 * float(row["a_over_b_minus_a"].max())])
    return reach, 1.0 + float(row.get("zeta", np.nan)) * reach


def plot_fitted_range(_dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Shade the range of a/(b-a) over which the line is fitted.

    Parameters
    ----------
    _dataset : xarray.Dataset
        Results of the study. Not used.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    axes.axvspan(*FITTED_RANGE, color="0.94", zorder=0)
    axes.text(0.27, 0.97, "fitted", transform=axes.get_xaxis_transform(), va="top", color="0.45")


figure = Figure(
    [
        Panel(
            x="a_over_b_minus_a",
            y="critical_velocity_ratio",
            hue=["case"],
            fit_line=fit_line,
            annotation="zeta",
            overlays=[
                build_reference_line_overlay(
                    "a_over_b_minus_a", lambda x: 1.0 + x, "$1 + a/(b-a)$ (Gu et al. 1984)", 0.0
                ),
                plot_fitted_range,
            ],
            isel={"law": 0, "stiffness_ratio": 0},
            x_limits=(0.0, None),
            y_limits=(1.0, None),
            legend_columns=1,
        )
    ]
)


def variable_normal_stress_claim(inverse: float, published: float) -> Claim:
    """Return a claim about how much variable normal stress reduces the critical step (C7).

    Parameters
    ----------
    inverse : float
        Value of a/(b-a).
    published : float
        Expected relative reduction of the critical step.

    Returns
    -------
    Claim
        Claim about the relative reduction.
    """
    return Claim(
        id="C7",
        statement=f"alpha = 0.56, a/(b-a) = {inverse:g}: boundary lower by {100.0 * published:g} %",
        source=f"{PAPER}, section 3.1",
        variable="lowering",
        where={"case": STRONG_NORMAL_STRESS_EFFECT, "b_over_a": 1.0 + 1.0 / inverse},
        published=published,
        tolerance=0.013,
        reason="rounding of the published value (0.5 %), and the error of the paper (0.4 %) in "
        "each of two velocities",
    )


study = Study(
    name="rate_step_boundary",
    title="Critical load point velocity step against a/(b-a), slip law, k = k_cr(V_*)",
    summary=Study.caption(__doc__),
    base=Scene(law="slip", stiffness_ratio=1.0),
    axes=[
        Axis("case", NORMAL_STRESS_CASES),
        Axis("b_over_a", 1.0 + 1.0 / a_over_b_minus_a),
    ],
    measure=CriticalStep(of="load_velocity_ratio", direction="up"),
    reductions=[
        ProportionalFit(
            name="zeta",
            of="critical_velocity_ratio",
            intercept=1.0,
            on="a_over_b_minus_a",
            within=(0.25, 1.0),
        ),
        RelativeDifference(
            name="lowering",
            of="critical_velocity_ratio",
            along="case",
            reference=CONSTANT_NORMAL_STRESS,
        ),
    ],
    claims=[
        Claim(
            id="C6",
            statement="constant normal stress: zeta = 1",
            source=f"{PAPER}, eq. 10, Fig. 5",
            variable="zeta",
            where={"case": CONSTANT_NORMAL_STRESS},
            published=1.0,
            tolerance=1e-4,
            reason=(
                "eq. 10 holds for an infinite norm; a norm of 5e-4 lowers it by 5e-5 at a/(b-a) = 1"
            ),
        ),
        Claim(
            id="C6",
            statement="constant normal stress, b/a = 2: V_0/V_* = 2",
            source=f"{PAPER}, eq. 10",
            variable="critical_velocity_ratio",
            where={"case": CONSTANT_NORMAL_STRESS, "b_over_a": 2.0},
            published=2.0,
            tolerance=1e-4,
            reason="the finite norm lowers it by 5e-5",
        ),
        Claim.below(
            id="C7",
            statement="alpha = 0.56: zeta < 1",
            source=f"{PAPER}, Fig. 5",
            variable="zeta",
            where={"case": STRONG_NORMAL_STRESS_EFFECT},
            published=1.0,
        ),
        Claim.below(
            id="C7",
            statement="zeta decreases with alpha (0.56 minus 0.25)",
            source=f"{PAPER}, Fig. 5",
            variable="zeta",
            where={"case": STRONG_NORMAL_STRESS_EFFECT},
            baseline={"case": WEAK_NORMAL_STRESS_EFFECT},
            published=0.0,
        ),
        variable_normal_stress_claim(0.25, 0.07),
        variable_normal_stress_claim(1.0, 0.16),
    ],
    plot=figure,
    references=[REFERENCE, GU_ET_AL],
)
