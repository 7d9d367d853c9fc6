"""Laws: how much of the displacement boundary hangs on the state evolution law.

The load point is displaced at once and then held. For every law that falls with Theta/b + ln V
alone the critical step has a closed form at constant normal stress, h(u*) = -k/k_cr. Between the
slip and the slowness law (eps from 0 to 1) the step grows with stiffness, and none exists for eps k
>= k_cr: what is left is the jump of slip rate at the step itself. Laws that fall faster than the
slip law far from steady sliding need smaller steps, the smaller the stiffer the spring. That
variable normal stress hardly moves the boundary (Fig. 7) holds for the slip law and those near to
it, and not for the slowness law; nor where slip faster than a cut-off strengthens. The composite
law has V_c = 100 V_*, the cut-off is at 10^4 V_*. The norm is 1e6, so high that closed forms for an
infinite one apply.
"""

import math

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.reductions import ClosedFormRatio, RelativeDifference
from rsfstudy.study.figure_declarations import Axes

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
    """L1: critical stiffness over (b - a) sigma/D_c."""
    return Claim(
        id="L1",
        statement=f"{law}, constant: k_cr is {published:.6g} (b-a) sigma/D_c",
        source=source,
        variable="critical_stiffness",
        where={"evolution": law, **CRITICAL_STIFFNESS_FIELDS},
        published=published * (base.b - base.a),
        tolerance=1e-12 * base.b,
        reason="exact; slopes of the law are taken by differences of order eight",
    )


def critical_displacement_claim(
    id_: str, law: str, ratio: float, published: float, tolerance: float
) -> Claim:
    """The critical displacement step in closed form."""
    return Claim(
        id=id_,
        statement=f"{law}, constant, k = {ratio:g} k_cr: step over D_c a/(b-a)",
        source="h(u*) = -k/k_cr, step u* k_cr/k, for dTheta = b h(Theta/b + ln V) d(slip)/D_c",
        variable="critical_displacement",
        where={"evolution": law, "normal_stress": "constant", "stiffness_ratio": ratio},
        published=published,
        tolerance=tolerance,
        reason="exact for an infinite norm: 1e6 leaves exp(-32) of it; exp(-16) = 1e-7 at 2 k_cr "
        "or halfway to the slowness law; its error estimate is 5e-10",
    )


def variable_normal_stress_claim(law: str, published: float) -> Claim:
    """L4: variable normal stress."""
    return Claim(
        id="L4",
        statement=f"{law}, k = k_cr: variable normal stress moves the step by a few per cent",
        source="Fig. 7 of the paper, for the slip law: 'maximum difference of a few percents'",
        variable="lowering",
        where={"evolution": law, "normal_stress": "variable", "stiffness_ratio": 1.0},
        published=published,
        tolerance=0.05,
        reason="'a few percents'",
    )


def plot_closed_forms(dataset: xr.Dataset, axes: Axes) -> None:
    """Open circles at the closed forms that there are."""
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
            statement="slowness law, k = 2 k_cr: only a jump to the norm itself is critical",
            source="K >= b/eps: the spring unloads faster than the state falls",
            variable="critical_displacement",
            where={"evolution": SLOWNESS_END, "normal_stress": "constant", "stiffness_ratio": 2.0},
            published=0.5 * base.log_instability_rate,
            tolerance=1e-7,
            reason="exact: a ln(V/V_*)/K at the norm; to a tenth of the accuracy asked for",
        ),
        variable_normal_stress_claim(SLIP_END, 0.0),
        variable_normal_stress_claim(PERRIN_RICE_ZHENG, 0.0),
        variable_normal_stress_claim(COMPOSITE, 0.0),
    ],
    plot=figure,
    references=[REFERENCE, *REFERENCES],
)
