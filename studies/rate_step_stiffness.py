"""Rate-step boundary against stiffness, b/a = e, both laws (Fig. 6 and section 4)."""

import math

import numpy as np

from rsfstudy.claims import Claim
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.reduce import RelativeDifference
from rsfstudy.scene import Scene
from rsfstudy.study import Axis, Study

from ._paper import CASES, CONSTANT, PAPER, REFERENCE, STRONG, WEAK


def slowness(stiffness_ratio: float, published: float, tolerance: float, digits: str) -> Claim:
    """C17: the numbers of section 4."""
    return Claim(
        id="C17",
        statement=f"slowness, alpha = 0.56, k = {stiffness_ratio:g} k_cr: {published:g} V_*",
        source=f"{PAPER}, section 4",
        variable="critical_velocity_ratio",
        where={"law": "slowness", "case": STRONG, "stiffness_ratio": stiffness_ratio},
        published=published,
        tolerance=tolerance,
        reason=f"printed to {digits}",
    )


study = Study(
    name="rate_step_stiffness",
    title="Critical load point velocity step against stiffness, b/a = e",
    summary=(
        "The critical step of load point velocity grows with stiffness, about exponentially for "
        "the slip law; the slowness law is much more stable. Eq. 11 of the paper, V_0/V_* = "
        "exp(k/k_cr)/lambda, is exact at k = k_cr only."
    ),
    base=Scene(b_over_a=math.e),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("case", CASES),
        Axis("stiffness_ratio", np.linspace(1.0, 2.0, 21)),
    ],
    measure=CriticalStep(of="load_velocity_ratio", direction="up"),
    reductions=[
        RelativeDifference(
            name="lowering", of="critical_velocity_ratio", along="case", reference=CONSTANT
        ),
    ],
    claims=[
        Claim(
            id="C8",
            statement="slip law, alpha = 0.56, k = k_cr: lower by 12 %",
            source=f"{PAPER}, section 3.1, Fig. 6",
            variable="lowering",
            where={"law": "slip", "case": STRONG, "stiffness_ratio": 1.0},
            published=0.12,
            tolerance=0.01,
            reason="'~12 %'",
        ),
        Claim(
            id="C8",
            statement="slip law, alpha = 0.25, k = k_cr: very close to constant normal stress",
            source=f"{PAPER}, section 3.1, Fig. 6",
            variable="lowering",
            where={"law": "slip", "case": WEAK, "stiffness_ratio": 1.0},
            relation="below",
            published=0.06,
            tolerance=0.0,
            reason="half of the difference at alpha = 0.56",
        ),
        slowness(1.0, 11.8, 0.05, "one decimal"),
        slowness(1.5, 2361.0, 0.5, "the unit"),
    ],
    plot="rate_step_stiffness",
    references=[
        REFERENCE,
        "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196",
    ],
)
