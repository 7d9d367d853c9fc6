"""Influence of the evolution law on the critical displacement step.

The load point is displaced instantaneously and then held. If the evolution of a law depends only on
Theta/b + ln V, the critical step at constant normal stress has a closed form, h(u*) = -k/k_cr. In
the family of laws with the exponent eps, eps = 0 is the slip law and eps = 1 is the slowness law.
For eps > 0, the critical step increases with stiffness and does not exist if eps k >= k_cr. On such
stiff springs, an instability occurs only if the slip rate reaches the instability norm during the
step. Some laws evolve faster than the slip law far from steady sliding. These laws have smaller
critical steps than the slip law, in particular on stiff springs. Variable normal stress has little
influence on the critical step under the slip law (Fig. 7 of the paper) and under similar laws.
Variable normal stress has a larger influence under the slowness law and under a law with a cut-off
velocity. The composite law has V_c = 100 V_*, and the cut-off velocity is 10^4 V_*. The closed
forms assume an infinite instability norm, and the norm of 1e6 in this study is high enough for them
to apply.
"""

import math

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.reductions import ClosedFormRatio, RelativeDifference
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._laws import (
    COMPOSITE,
    COMPOSITE_CUTOFF_VELOCITY,
    COMPOSITE_STEADY_STATE,
    CUT_OFF,
    CUT_OFF_VELOCITY,
    FAMILY_MIDDLE,
    LAWS,
    NAGATA,
    PERRIN_RICE_ZHENG,
    REFERENCES,
    SLIP_END,
    SLOWNESS_END,
    panel_by_normal_stress,
)
from ._paper import REFERENCE

base = Scene(b_over_a=2.0, instability_norm=1e6)
CRITICAL_STIFFNESS_FIELDS = {"normal_stress": "constant", "stiffness_ratio": 1.0}


def critical_stiffness_claim(law: str, published: float, source: str) -> Claim:
    """Return a claim about the critical stiffness of a law (L1).

    Parameters
    ----------
    law : str
        State evolution law.
    published : float
        Critical stiffness relative to (b - a) sigma/D_c.
    source : str
        Source of the claim.

    Returns
    -------
    Claim
        Claim about the critical stiffness.
    """
    return Claim(
        id="L1",
        statement=f"{law}, constant: k_cr is {published:.6g} (b-a) sigma/D_c",
        source=source,
        variable="critical_stiffness",
        where={"evolution": law, **CRITICAL_STIFFNESS_FIELDS},
        published=published * (base.b - base.a),
        tolerance=1e-12 * base.b,
        reason="exact, except for the derivatives of the law, which are finite differences of "
        "order eight",
    )


def critical_displacement_claim(
    id_: str, law: str, ratio: float, published: float, tolerance: float
) -> Claim:
    """Return the claim that the critical step equals the closed form (L2).

    Parameters
    ----------
    id_ : str
        Identifier of the claim.
    law : str
        State evolution law.
    ratio : float
        Stiffness relative to the critical stiffness.
    published : float
        Critical step relative to D_c a/(b-a).
    tolerance : float
        Tolerance of the claim.

    Returns
    -------
    Claim
        Claim about the critical displacement.
    """
    return Claim(
        id=id_,
        statement=f"{law}, constant, k = {ratio:g} k_cr: step divided by D_c a/(b-a)",
        source="h(u*) = -k/k_cr, step u* k_cr/k, for dTheta = b h(Theta/b + ln V) d(slip)/D_c",
        variable="critical_displacement",
        where={"evolution": law, "normal_stress": "constant", "stiffness_ratio": ratio},
        published=published,
        tolerance=tolerance,
        reason="exact for an infinite norm; a norm of 1e6 causes a relative error of exp(-32), or "
        "exp(-16) = 1e-7 at 2 k_cr and for eps = 0.5; the error estimate is 5e-10",
    )


def variable_normal_stress_claim(law: str, published: float) -> Claim:
    """Return a claim about the effect of variable normal stress on the critical step (L4).

    Parameters
    ----------
    law : str
        State evolution law.
    published : float
        Expected relative change of the critical step.

    Returns
    -------
    Claim
        Claim about the relative change.
    """
    return Claim(
        id="L4",
        statement=f"{law}, k = k_cr: variable normal stress changes the step by a few percent",
        source="Fig. 7 of the paper, for the slip law: 'maximum difference of a few percents'",
        variable="lowering",
        where={"evolution": law, "normal_stress": "variable", "stiffness_ratio": 1.0},
        published=published,
        tolerance=0.05,
        reason="'a few percents'",
    )


def plot_closed_forms(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw open circles at the critical steps from the closed form.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    if "over_closed_form_closed_form" in dataset:
        known = dataset["over_closed_form_closed_form"].where(
            dataset["normal_stress"] == "constant"
        )
        x = dataset["stiffness_ratio"].broadcast_like(known)
        circles = {"markersize": 5.0, "markeredgewidth": 0.6, "fillstyle": "none", "color": "0.2"}
        label = "closed form" if known.notnull().any() else None
        axes.plot(x.values.ravel(), known.values.ravel(), "o", label=label, **circles)


figure = Figure(
    [
        panel_by_normal_stress(
            "stiffness_ratio", "critical_displacement", "y", overlays=[plot_closed_forms]
        )
    ],
    height=70.0,
)


study = Study(
    name="laws",
    title="Critical displacement step and the state evolution law",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("evolution", LAWS),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("stiffness_ratio", np.arange(4, 17) / 8),
    ],
    measure=CriticalStep(of="displacement_step"),
    reductions=[
        RelativeDifference(
            name="lowering", of="critical_displacement", along="normal_stress", reference="constant"
        ),
        ClosedFormRatio(
            name="over_closed_form",
            of="critical_displacement",
            form="displacement_step_of_the_family",
        ),
    ],
    claims=[
        critical_stiffness_claim(SLIP_END, 1.0, "Ruina (1983)"),
        critical_stiffness_claim(FAMILY_MIDDLE, 1.0, "h(0) = 0 and h'(0) = -1 suffice"),
        critical_stiffness_claim(PERRIN_RICE_ZHENG, 1.0, "h(0) = 0 and h'(0) = -1 suffice"),
        critical_stiffness_claim(
            COMPOSITE,
            1.0 + COMPOSITE_STEADY_STATE + 2.0 * COMPOSITE_STEADY_STATE / COMPOSITE_CUTOFF_VELOCITY,
            "[(1 + w)(b-a) + b w V/V_c] sigma/D_c, w exp(w) = exp(-V/V_c)",
        ),
        critical_stiffness_claim(
            CUT_OFF, 2.0 / (1.0 + 1.0 / CUT_OFF_VELOCITY) - 1.0, "[b/(1 + V/V_c) - a] sigma/D_c"
        ),
        critical_stiffness_claim(NAGATA, 0.5, "(b-a) sigma/[(1 + c) D_c]"),
        critical_displacement_claim("L2", SLIP_END, 1.0, 1.0, 5e-9),
        critical_displacement_claim("L2", SLIP_END, 2.0, 1.0, 2e-7),
        critical_displacement_claim("L2", FAMILY_MIDDLE, 1.0, 2.0 * math.log(2.0), 2e-7),
        critical_displacement_claim("L2", SLOWNESS_END, 0.5, 2.0 * math.log(2.0), 5e-9),
        critical_displacement_claim("L2", PERRIN_RICE_ZHENG, 1.0, math.asinh(1.0), 5e-9),
        critical_displacement_claim("L2", PERRIN_RICE_ZHENG, 2.0, 0.5 * math.asinh(2.0), 5e-9),
        Claim(
            id="L3",
            statement=(
                "slowness law, k = 2 k_cr: the critical step raises the slip rate directly to "
                "the norm"
            ),
            source="K >= b/eps: the spring unloads faster than the state weakens",
            variable="critical_displacement",
            where={"evolution": SLOWNESS_END, "normal_stress": "constant", "stiffness_ratio": 2.0},
            published=0.5 * base.log_slip_rate_at_instability,
            tolerance=1e-7,
            reason="exact: a ln(V/V_*)/K at the norm; the tolerance is a tenth of the requested "
            "accuracy",
        ),
        variable_normal_stress_claim(SLIP_END, 0.0),
        variable_normal_stress_claim(PERRIN_RICE_ZHENG, 0.0),
        variable_normal_stress_claim(COMPOSITE, 0.0),
    ],
    plot=figure,
    references=[REFERENCE, *REFERENCES],
)
