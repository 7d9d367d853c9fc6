"""Critical step of load point displacement against a/(b-a) (Fig. 7).

A slider in steady state at V_* is subjected to an instantaneous displacement of the load point. The
load point is then held or continues to move at V_*. The critical step is the smallest step after
which the slip rate reaches the instability norm. If the load point is held, the critical step under
the slip law is D_c a/(b-a) at every stiffness. This closed form applies at constant normal stress
and for a large instability norm. Variable normal stress changes the critical step very little. If
the load point continues to move, the critical step is smaller, in particular for soft springs.
Under the slowness law, the critical step is 1.7 to 8 times larger than under the slip law. On stiff
springs, an instability under the slowness law occurs only if the slip rate reaches the instability
norm during the step.
"""

from typing import Any

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.reductions import ClosedFormRatio, ProportionalFit, RelativeDifference
from rsfstudy.study.figure_declarations import (
    build_horizontal_line_overlay,
    build_reference_line_overlay,
)

from ._paper import (
    CONSTANT_NORMAL_STRESS,
    GU_ET_AL,
    NORMAL_STRESS_CASES,
    PAPER,
    REFERENCE,
    STRONG_NORMAL_STRESS_EFFECT,
    WEAK_NORMAL_STRESS_EFFECT,
)

PAPER_WORDS_ON_CLOSENESS = "'very close'; 'maximum difference of a few percents'"

a_over_b_minus_a = np.concatenate([np.arange(5, 20) / 20, np.arange(4, 9) / 4])


LOADS = {"held": {"load_velocity_ratio": 0.0}, "moving at V_*": {"load_velocity_ratio": 1.0}}
SLIP_HELD = {"law": "slip", "load": "held"}


def closeness_claim(case: str, stiffness_ratio: float, tolerance: float, reason: str) -> Claim:
    """Return the claim that the critical step is close to D_c a/(b-a) (C10).

    Parameters
    ----------
    case : str
        Name of the case.
    stiffness_ratio : float
        Stiffness relative to the critical stiffness.
    tolerance : float
        Tolerance of the claim.
    reason : str
        Reason for the tolerance.

    Returns
    -------
    Claim
        Claim about the slope of the critical step against a/(b-a).
    """
    return Claim(
        id="C10",
        statement=f"{case}, k = {stiffness_ratio:g} k_cr: step = D_c a/(b-a)",
        source=f"{PAPER}, eq. 14, Fig. 7",
        variable="displacement_slope",
        where={**SLIP_HELD, "case": case, "stiffness_ratio": stiffness_ratio},
        published=1.0,
        tolerance=tolerance,
        reason=reason,
    )


ABSCISSA = "a_over_b_minus_a"


def marker_style(row: xr.Dataset) -> dict[str, Any]:
    """Return markers that remain visible if points coincide.

    Markers are larger and open for small values of alpha.

    Parameters
    ----------
    row : xarray.Dataset
        Results of one case.

    Returns
    -------
    dict
        Keyword arguments for ``matplotlib.axes.Axes.plot``.
    """
    alpha = float(np.nan_to_num(row.get("alpha", 0.0)))
    return {
        "markersize": max(2.0, 7.0 - 9.0 * alpha),
        "fillstyle": "none" if alpha < 0.5 else "full",
    }


figure = Figure(
    [
        Panel(
            x=ABSCISSA,
            y="critical_displacement",
            hue=["case"],
            isel={"law": 0, "load": 0, "stiffness_ratio": min},
            markers_only=True,
            style=marker_style,
            overlays=[
                build_reference_line_overlay(
                    ABSCISSA, lambda x: x, r"$D_c\,a/(b-a)$ (Gu et al. 1984)", 0.0
                )
            ],
            x_limits=(0.0, None),
            y_limits=(0.0, None),
        ),
        Panel(
            x=ABSCISSA,
            y=lambda row: row["critical_displacement"] / row[ABSCISSA],
            hue=["case", "stiffness_ratio"],
            facet=["law", "load"],
            style={"markersize": 2.5, "linewidth": 0.9},
            overlays=[build_horizontal_line_overlay(1.0)],
            y_label=r"Critical $\Delta\delta_0/D_c$ over $a/(b-a)$",
        ),
    ]
)


study = Study(
    name="displacement_boundary",
    title="Critical load point displacement step against a/(b-a)",
    summary=Study.caption(__doc__),
    base=Scene(),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("load", LOADS),
        Axis("case", NORMAL_STRESS_CASES),
        Axis("stiffness_ratio", [1.0, 1.5, 2.0]),
        Axis("b_over_a", 1.0 + 1.0 / a_over_b_minus_a),
    ],
    measure=CriticalStep(of="displacement_step", direction="up"),
    reductions=[
        ProportionalFit(
            name="displacement_slope",
            of="critical_displacement",
            on="a_over_b_minus_a",
            within=(0.25, 1.0),
        ),
        RelativeDifference(
            name="lowering",
            of="critical_displacement",
            along="case",
            reference=CONSTANT_NORMAL_STRESS,
        ),
        ClosedFormRatio(name="over_eq_14", of="critical_displacement", form="displacement_step"),
    ],
    claims=[
        closeness_claim(
            CONSTANT_NORMAL_STRESS,
            1.0,
            2e-5,
            (
                "eq. 14 holds for an infinite norm; the default norm changes it by exp(-10.9 "
                "(b/a - 1))"
            ),
        ),
        closeness_claim(
            CONSTANT_NORMAL_STRESS,
            2.0,
            2e-3,
            "on stiff springs, the limit of an infinite norm is approached more slowly",
        ),
        closeness_claim(WEAK_NORMAL_STRESS_EFFECT, 1.0, 0.03, PAPER_WORDS_ON_CLOSENESS),
        closeness_claim(STRONG_NORMAL_STRESS_EFFECT, 1.0, 0.03, PAPER_WORDS_ON_CLOSENESS),
        Claim(
            id="C10",
            statement="alpha = 0.56, k = k_cr, a/(b-a) = 2: step divided by D_c a/(b-a)",
            source=f"{PAPER}, eq. 14, Fig. 7",
            variable="over_eq_14",
            where={
                **SLIP_HELD,
                "case": STRONG_NORMAL_STRESS_EFFECT,
                "stiffness_ratio": 1.0,
                "b_over_a": 1.5,
            },
            published=1.0,
            tolerance=0.03,
            reason=PAPER_WORDS_ON_CLOSENESS,
        ),
        Claim(
            id="C9",
            statement="alpha = 0.56, b/a = 2: V just after a step of D_c is 2.697 V_*",
            source=f"{PAPER}, eq. 13",
            variable="slip_rate_after_closed_form_step",
            where={
                **SLIP_HELD,
                "case": STRONG_NORMAL_STRESS_EFFECT,
                "stiffness_ratio": 1.0,
                "b_over_a": 2.0,
            },
            published=2.697,
            tolerance=6e-4,
            reason="the paper has three decimals; our result is 2.6975, so the published value is "
            "truncated instead of rounded",
        ),
    ],
    plot=figure,
    references=[REFERENCE, GU_ET_AL],
)
