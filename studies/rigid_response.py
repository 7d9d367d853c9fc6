"""Response of a rigid slider to steps of slip rate (Figs. 3 and 4).

The figures show stress against slip after the slip rate of a rigid slider changes from V_* to V.
Variable normal stress slows down the evolution to the new steady state and makes the responses to
steps up and steps down unequal. Under the slowness law, variable normal stress also separates the
responses to large steps down.
"""

import math
from typing import Any

import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import RigidResponse
from rsfstudy.reductions import Range, RelativeDifference
from rsfstudy.study.figure_declarations import build_horizontal_line_overlay

from ._paper import PAPER, REFERENCE

#: Slip rates V/V_* after the step: steps of 1 to 4 decades, a small step, and the step of section
#: 3.4.
STEPS = [1e-4, 1e-3, 1e-2, 1e-1, 1.05, 1e1, 1e2, 200.0, 1e3, 1e4]


def slower_evolution_claim(law: str, rate: float, figure: str, claim: str) -> Claim:
    """Return the claim that variable normal stress slows the stress evolution (C3, C4).

    Parameters
    ----------
    law : str
        State evolution law.
    rate : float
        Slip rate V/V_* after the step.
    figure : str
        Figure of the paper.
    claim : str
        Identifier of the claim.

    Returns
    -------
    Claim
        Claim about the relative difference of the evolution distances.
    """
    return Claim.below(
        id=claim,
        statement=f"{law} law, V = {rate:g} V_*: slower evolution with variable sigma",
        source=f"{PAPER}, {figure}",
        variable="slowing",
        where={"law": law, "normal_stress": "variable", "load_velocity_ratio": rate},
        published=0.0,
        reason="an inequality; the result is 1 minus the ratio of the slip to 1/e at variable "
        "normal stress to the slip to 1/e at constant normal stress",
    )


def remaining_stress(row: xr.Dataset) -> xr.DataArray:
    """Return the difference between the shear stress and the final steady shear stress.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    xarray.DataArray
        Difference in a sigma_*. The difference is NaN if the step is not a whole number of decades.
    """
    future = row["mu_star"] + row["steady_stress_change"]
    return ((row["shear_stress"] - future) / row["a"]).where(step_in_decades(row) is not None)


def step_in_decades(row: xr.Dataset) -> int | None:
    """Return the size of the step in decades.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    int or None
        Number of decades. The value is None if the step is not a whole number of decades.
    """
    decades = math.log10(row["load_velocity_ratio"]) if row["load_velocity_ratio"] > 0.0 else 0.0
    whole = round(decades)
    return whole if whole and abs(decades - whole) < 1e-9 else None


def curve_style(row: xr.Dataset) -> dict[str, Any]:
    """Return the line style of a step.

    Steps up are drawn as solid lines, and steps down are drawn as dashed lines.

    Parameters
    ----------
    row : xarray.Dataset
        Results along one curve.

    Returns
    -------
    dict
        Keyword arguments for ``matplotlib.axes.Axes.plot``.
    """
    from rsfstudy.plots import cycle_style

    decades = step_in_decades(row) or 1
    colour = cycle_style(abs(decades) - 1)["color"]
    return {"color": colour, "linestyle": "-" if decades > 0 else "--", "linewidth": 1.0}


figure = Figure(
    [
        Panel(
            x="slip",
            y=remaining_stress,
            hue=["load_velocity_ratio"],
            facet=["law", "normal_stress"],
            style=curve_style,
            curve_label=lambda row: f"$10^{{{step_in_decades(row)}}}$",
            overlays=[build_horizontal_line_overlay(0.0)],
            y_label=r"Remaining stress, $(\tau - \tau_{ss})/(a\,\sigma_*)$",
            legend_columns=4,
            legend_title="Slip rate after the step, $V(0^+)/V_*$",
        )
    ]
)


study = Study(
    name="rigid_response",
    title="Responses of a rigid slider to steps of slip rate, b/a = 2",
    summary=Study.caption(__doc__),
    base=Scene(b_over_a=2.0, alpha=0.56),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("load_velocity_ratio", STEPS),
    ],
    measure=RigidResponse(),
    reductions=[
        RelativeDifference(
            name="slowing", of="evolution_distance", along="normal_stress", reference="constant"
        ),
        Range(
            name="separation",
            of="stress_left_at_unit_slip",
            over="load_velocity_ratio",
            within=(1e-4, 1e-2),
        ),
    ],
    claims=[
        *(slower_evolution_claim("slip", rate, "Fig. 3", "C3") for rate in (1e-4, 1e-2)),
        *(slower_evolution_claim("slowness", rate, "Fig. 4", "C4") for rate in (1e-4, 1e-2)),
        Claim.above(
            id="C3",
            statement=(
                "slip law, 4 decades: more stress evolves after a step down than after a step up"
            ),
            source=f"{PAPER}, section 2.3, Fig. 3",
            variable="evolution_asymmetry",
            where={"law": "slip", "normal_stress": "variable", "load_velocity_ratio": 1e-4},
            published=0.0,
            reason="an inequality; the figure of the paper shows stress relative to its final "
            "steady value",
        ),
        Claim.above(
            id="C3",
            statement="slip law, 4 decades: the direct stress change is larger for a step down",
            source=f"{PAPER}, section 2.3",
            variable="direct_asymmetry",
            where={"law": "slip", "normal_stress": "variable", "load_velocity_ratio": 1e-4},
            published=0.0,
            expected="differs",
            difference_reason=(
                "the jump itself is smaller for the step down, because strength increases "
                "more slowly at higher stress. In the paper, the jump is measured in curves "
                "of stress minus its future steady-state value"
            ),
        ),
        Claim(
            id="C4",
            statement="slowness law, constant: steps down of 2 to 4 decades are indistinguishable",
            source=f"{PAPER}, section 2.3, Fig. 4",
            variable="separation",
            where={"law": "slowness", "normal_stress": "constant"},
            published=0.0,
            tolerance=2.9e-4,
            reason="less than the width of a line in the figure, which is 0.02 of a range of 37 a "
            "sigma_*",
        ),
        Claim.above(
            id="C4",
            statement="slowness law, variable: the steps differ by more than 0.5 a sigma_*",
            source=f"{PAPER}, section 2.3, Fig. 4",
            variable="separation",
            where={"law": "slowness", "normal_stress": "variable"},
            published=0.5 * 0.0145,
            reason="25 times the width of a line in the figure",
        ),
        Claim(
            id="C5",
            statement="slowness law, constant, V = 200 V_*: stress against slip is eq. 17a",
            source=f"{PAPER}, eqs. 16 and 17a",
            variable="closed_form_misfit",
            where={"law": "slowness", "normal_stress": "constant", "load_velocity_ratio": 200.0},
            published=0.0,
            tolerance=1e-8,
            reason="the requested accuracy, 1e-7 of the evolution of stress (0.15 sigma_*)",
        ),
        Claim(
            id="C5",
            statement="slowness law, constant, V = 1.05 V_*: stress decays exponentially (eq. 17b)",
            source=f"{PAPER}, eq. 17b",
            variable="exponential_misfit",
            where={"law": "slowness", "normal_stress": "constant", "load_velocity_ratio": 1.05},
            published=0.0,
            tolerance=0.01,
            reason="ln(1 + x) differs from x by a relative error of x/2; the largest difference is "
            "a quarter of this error, relative to ln 1.05",
        ),
        Claim.above(
            id="C5",
            statement="slowness law, constant, V = 200 V_*: stress decays far more slowly than "
            "eq. 17b",
            source=f"{PAPER}, section 3.4",
            variable="exponential_misfit",
            where={"law": "slowness", "normal_stress": "constant", "load_velocity_ratio": 200.0},
            published=0.3,
            reason="an inequality: at some slip, the remaining stress exceeds eq. 17b by more than "
            "0.3 of the stress change",
        ),
        Claim(
            id="C5",
            statement="slowness law, constant, V = 200 V_*: 1/e of the stress change remains "
            "after 3.5 D_c",
            source=f"{PAPER}, section 3.4",
            variable="evolution_distance",
            where={"law": "slowness", "normal_stress": "constant", "load_velocity_ratio": 200.0},
            published=3.5,
            tolerance=0.05,
            reason="'~3.5', printed to one decimal",
        ),
    ],
    plot=figure,
    references=[REFERENCE],
)
