"""Triggering by steps of normal stress, displacement and velocity.

A slider is in steady state at V_*. Then normal stress decreases instantaneously or the load point
is displaced, and the load point is held afterwards. Alternatively, the load point velocity
increases. The change of Coulomb stress is defined with the friction coefficient mu' = mu_* - alpha
(1 - a/b). To first order in k/k_cr and for all laws, the critical decrease of normal stress and the
critical displacement step cause the same change of Coulomb stress. Under the slip law, this rule of
equal Coulomb stress also applies at larger stiffness. The rule is exact for alpha = 0. For other
values of alpha and for stiffnesses up to 2 k_cr, the rule is accurate to within 3 %, even for
inclined driving. Under the slowness law, the rule of equal Coulomb stress fails close to the
critical stiffness. In this range, the critical decrease of normal stress causes a change of Coulomb
stress that is up to 2.4 times as large as the change due to the critical displacement step. The
reason is that a decrease of normal stress also lowers the critical stiffness. On very stiff
springs, an instability occurs only if the slip rate reaches the instability norm during the step.
The rule of equal Coulomb stress also fails on very stiff springs. If the state depends on normal
stress, a larger decrease of normal stress is necessary to trigger an instability. The direct effect
of the critical velocity step, a ln(V_0/V_*), is 0.6 to 1.03 times the stress change of the critical
displacement step. In most cases, the direct effect is smaller than this stress change, because the
load point continues to move after a velocity step. Below the critical stiffness, every velocity
step triggers an instability. For inclined driving, the angle is 60 degrees, and the decrease of
normal stress is a decrease of sigma_3.

The change of Coulomb stress is ``dtau - mu' dsigma``. A displacement d of the load point changes
shear stress by K d, and normal stress by K d cot(phi). A step of imposed normal stress, or of
sigma_3, does not change shear stress. The rule of equal Coulomb stress holds to first order in
k/k_cr for all laws whose evolution depends on Theta/b + ln V. A step of load point velocity does
not change stress instantaneously. The study represents a velocity step by its direct effect a
ln(V_0/V_*), which is the increase of friction before the state changes.
"""

from dataclasses import replace
from typing import Any

import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.reductions import LinearFit
from rsfstudy.slider import compute_coulomb_effective_friction
from rsfstudy.slider.closed_forms import compute_critical_normal_stress_step
from rsfstudy.study import DrawFunction
from rsfstudy.study.figure_declarations import (
    MatplotlibAxes,
    build_horizontal_line_overlay,
    build_reference_line_overlay,
)

from ._critical_triggers import Triggers
from ._paper import GU_ET_AL, REFERENCE

base = Scene(b_over_a=2.0)

IMPOSED_WITHOUT_ALPHA, IMPOSED_WITH_ALPHA = "imposed, alpha = 0", "imposed, alpha = 0.56"
INCLINED_WEAK, INCLINED_STRONG = "inclined, alpha = 0.25", "inclined, alpha = 0.56"
CASES: dict[str, dict[str, str | float]] = {
    IMPOSED_WITHOUT_ALPHA: {"normal_stress": "imposed", "alpha": 0.0},
    IMPOSED_WITH_ALPHA: {"normal_stress": "imposed", "alpha": 0.56},
    INCLINED_WEAK: {"normal_stress": "variable", "alpha": 0.25, "phi": 60.0},
    INCLINED_STRONG: {"normal_stress": "variable", "alpha": 0.56, "phi": 60.0},
}
EXPONENTS = {"slip": 0.0, "slowness": 1.0}
HELD_LOAD_POINT_SOURCE = (
    "load point held: initially u = mu_* (q-1)/a - alpha (1/a - 1/b) ln q, threshold h(u*) = -q k^"
)

#: Effective friction mu' for alpha = 0.56 and b/a = 2.
EFFECTIVE_FRICTION = compute_coulomb_effective_friction(base.mu_star, base.b_over_a, 0.56)
FRICTION_REDUCTION = base.mu_star - EFFECTIVE_FRICTION


def critical_fall_claim(law: str, alpha: float, ratio: float, within: float, reason: str) -> Claim:
    """Return a claim about the critical decrease of normal stress (N1).

    Parameters
    ----------
    law : str
        State evolution law.
    alpha : float
        Effect of normal stress on the state.
    ratio : float
        Stiffness relative to the critical stiffness.
    within : float
        Relative tolerance.
    reason : str
        Reason for the tolerance.

    Returns
    -------
    Claim
        Claim about the critical step.
    """
    published = compute_critical_normal_stress_step(
        base.mu_star, base.a, base.b_over_a, alpha, EXPONENTS[law], ratio
    )
    return Claim(
        id="N1",
        statement=(
            f"{law} law, imposed, alpha = {alpha:g}, k = {ratio:g} k_cr: critical decrease of "
            "stress"
        ),
        source=f"{HELD_LOAD_POINT_SOURCE}, q = sigma_*/sigma, k^ = k/k_cr",
        variable="critical_normal_stress_step",
        where={
            "law": law,
            "case": IMPOSED_WITH_ALPHA if alpha else IMPOSED_WITHOUT_ALPHA,
            "stiffness_ratio": ratio,
        },
        published=published,
        tolerance=within * abs(published),
        reason=reason,
    )


def coulomb_limit_claim(law: str, case: str) -> Claim:
    """Return the claim that both triggers need equal Coulomb stress on soft springs (N2).

    Parameters
    ----------
    law : str
        State evolution law.
    case : str
        Name of the case.

    Returns
    -------
    Claim
        Claim about the ratio of the Coulomb stress changes at 0.05 k_cr.
    """
    return Claim(
        id="N2",
        statement=(
            f"{law} law, {case}, k = 0.05 k_cr: normal stress decreases and displacements trigger "
            "at the same change of Coulomb stress"
        ),
        source="mu' = mu_* - alpha (1 - a/b), to first order in k/k_cr",
        variable="coulomb_ratio",
        where={"law": law, "case": case, "stiffness_ratio": 0.05},
        published=1.0,
        tolerance=1e-3,
        reason="the second order is less than 0.02 k/k_cr in all cases",
    )


def normal_stress_effect_claim(law: str) -> Claim:
    """Return the claim that alpha increases the critical decrease of normal stress (N3).

    Linker and Dieterich (1992) showed that a decrease of normal stress increases the state
    variable, and therefore the friction coefficient.

    Parameters
    ----------
    law : str
        State evolution law.

    Returns
    -------
    Claim
        Claim about the critical decrease of normal stress.
    """
    where = {"law": law, "stiffness_ratio": 0.5}
    return Claim.below(
        id="N3",
        statement=(
            f"{law} law, imposed, k = 0.5 k_cr: a larger decrease is needed for alpha = 0.56"
        ),
        source="Linker and Dieterich (1992): a decrease of normal stress increases the state",
        variable="critical_normal_stress_step",
        where={**where, "case": IMPOSED_WITH_ALPHA},
        baseline={**where, "case": IMPOSED_WITHOUT_ALPHA},
        published=-0.5 * base.a * (0.5 / EFFECTIVE_FRICTION - 0.5 / base.mu_star),
        reason="an inequality: the bound is half of the first-order result",
    )


TOLERANCE_REASON = (
    "the error estimate, which is up to 1.2e-9 of the step, and the effect of a finite norm, which "
    "is not larger"
)


ABSCISSA = "stiffness_ratio"
NORMAL_STRESS_FALL, DISPLACEMENT_STEP, VELOCITY_STEP = (
    "coulomb_stress_of_normal_stress",
    "coulomb_stress_of_displacement",
    "direct_stress_of_velocity",
)
DISPLACEMENT_STEP_STYLE: dict[str, Any] = {
    "linestyle": "-",
    "marker": "x",
    "markersize": 3.5,
    "linewidth": 0.5,
}
CONTINUOUS_LINE_STYLE: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 6.0,
    "markeredgewidth": 0.6,
    "fillstyle": "none",
}


def draw_comparison(
    variable: str, name: str, style: dict[str, Any], over: str | None = None
) -> DrawFunction:
    """Return a function that draws curves for comparison.

    The curves have the colours of the critical decreases of normal stress.

    Parameters
    ----------
    variable : str
        Name of the variable.
    name : str
        Name in the legend.
    style : dict
        Line style.
    over : str, optional
        Variable by which the values are divided.

    Returns
    -------
    DrawFunction
        Function that draws on axes.
    """

    def mark(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
        """Draw the curves."""
        from rsfstudy.plots import add_grey_legend_entry, cycle_style

        values = dataset[variable] / (dataset[over] if over else 1.0)
        for number in range(values.sizes["case"]):
            row = values.isel(case=number)
            axes.plot(row[ABSCISSA], row, **style | {"color": cycle_style(number)["color"]})
        if values.notnull().any():
            add_grey_legend_entry(axes, name, style)

    return mark


panel = Panel(
    x=ABSCISSA,
    hue=["case"],
    facet=["law"],
    style={"markersize": 2.6},
    x_limits=(0.0, None),
    legend_title="Filled markers: decrease of normal stress, by case",
)
VELOCITY_STEP_LABEL = r"velocity step, $a\,\ln(V_0/V_*)$"
figure = Figure(
    [
        replace(
            panel,
            y=lambda row: row[NORMAL_STRESS_FALL] / row["a"],
            overlays=[
                build_reference_line_overlay(
                    ABSCISSA, lambda x: x, "Coulomb, first order, imposed"
                ),
                draw_comparison(
                    DISPLACEMENT_STEP, "displacement step", CONTINUOUS_LINE_STYLE, over="a"
                ),
                draw_comparison(
                    VELOCITY_STEP, VELOCITY_STEP_LABEL, DISPLACEMENT_STEP_STYLE, over="a"
                ),
            ],
            y_label=r"Critical stress change divided by $a\sigma_*$",
            log="y",
            y_scale_group="stress",
        ),
        replace(
            panel,
            y="coulomb_ratio",
            overlays=[
                build_horizontal_line_overlay(1.0, color="0.82", linewidth=2.5),
                draw_comparison("direct_ratio", VELOCITY_STEP_LABEL, DISPLACEMENT_STEP_STYLE),
            ],
            y_label="Stress change divided by that of a displacement step",
        ),
    ],
    height=58.0,
)


study = Study(
    name="triggering",
    title="Does a change of Coulomb stress predict triggering?",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("case", CASES),
        Axis("stiffness_ratio", [0.05, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0]),
    ],
    measure=Triggers(),
    reductions=[
        LinearFit(name="coulomb_slope", of="coulomb_ratio", on="stiffness_ratio", within=(0.0, 0.5))
    ],
    claims=[
        critical_fall_claim("slip", 0.0, 0.5, 2e-9, TOLERANCE_REASON),
        critical_fall_claim("slip", 0.56, 0.25, 2e-9, TOLERANCE_REASON),
        critical_fall_claim("slip", 0.56, 0.5, 2e-9, TOLERANCE_REASON),
        critical_fall_claim(
            "slip",
            0.56,
            1.0,
            3e-5,
            "a finite norm changes the result by exp(-10.9 (b/a - 1)/(q k^)) = 3e-5",
        ),
        critical_fall_claim("slowness", 0.56, 0.25, 2e-9, TOLERANCE_REASON),
        *(
            coulomb_limit_claim(law, case)
            for law in EXPONENTS
            for case in (IMPOSED_WITH_ALPHA, INCLINED_STRONG)
        ),
        Claim(
            id="N2",
            statement="slip law, imposed, alpha = 0.56: difference from this limit, divided by "
            "k/k_cr",
            source="second order of the closed form: -alpha (1 - a/b) a/(2 mu'^2)",
            variable="coulomb_slope",
            where={"law": "slip", "case": IMPOSED_WITH_ALPHA},
            published=-FRICTION_REDUCTION * base.a / (2.0 * EFFECTIVE_FRICTION**2),
            tolerance=0.02 * FRICTION_REDUCTION * base.a / (2.0 * EFFECTIVE_FRICTION**2),
            reason="effect of the third order for stiffness up to 0.5 k_cr",
        ),
        *map(normal_stress_effect_claim, EXPONENTS),
        Claim(
            id="N4",
            statement="slip law, imposed, alpha = 0, k = k_cr: Coulomb stress is exact, mu' = mu_*",
            source="mu_* (1 - 1/q) = a k^: the stress change equals that of a displacement step",
            variable="coulomb_ratio",
            where={"law": "slip", "case": IMPOSED_WITHOUT_ALPHA, "stiffness_ratio": 1.0},
            published=1.0,
            tolerance=1e-5,
            reason="a finite norm changes both steps by approximately the same relative amount, "
            "2e-5",
        ),
        Claim.above(
            id="N5",
            statement="slip law, inclined, alpha = 0.56, k = 2 k_cr: Coulomb stress predicts the "
            "step to 3 %",
            source="largest difference from the first-order result",
            variable="coulomb_ratio",
            where={"law": "slip", "case": INCLINED_STRONG, "stiffness_ratio": 2.0},
            published=0.97,
            reason="an inequality; our result is 0.974",
        ),
        Claim.above(
            id="N6",
            statement=(
                "slowness law, inclined, alpha = 0.56, k = 1.25 k_cr: Coulomb stress is a poor "
                "predictor"
            ),
            source="a decrease of normal stress also lowers the critical stiffness: h(u*) = -q k^",
            variable="coulomb_ratio",
            where={"law": "slowness", "case": INCLINED_STRONG, "stiffness_ratio": 1.25},
            published=2.0,
            reason="an inequality; our result is 2.40",
        ),
    ],
    plot=figure,
    references=[REFERENCE, "Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940", GU_ET_AL],
)
