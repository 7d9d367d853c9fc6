"""Stress drop against ln V_0: how loading rate scales static and dynamic stress drops (section
3.5).
"""

import numpy as np

from rsfstudy.claims import Claim
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.reduce import LinearFit
from rsfstudy.scene import Scene
from rsfstudy.study import Axis, Study

from ._paper import PAPER, REFERENCE

base = Scene(b_over_a=2.0, alpha=0.56, inertia=True)
weakening = base.b - base.a
enhancement = 1.0 / (1.0 - base.mu_star * base.cot_phi)


def slope(drop: str, normal_stress: str, published: float, law: str) -> Claim:
    """C15: slip law slopes at 0.8 k_cr."""
    return Claim(
        id="C15",
        statement=f"slip law, {normal_stress} normal stress: {drop} drop against ln V_0, {law}",
        source=f"{PAPER}, section 3.5",
        variable=f"{drop}_slope",
        where={"law": "slip", "normal_stress": normal_stress, "stiffness_ratio": 0.8},
        published=published,
        tolerance=0.08 * abs(published),
        reason="'scales with', no error stated; slopes drift with ln V_0 and stiffness as much",
    )


study = Study(
    name="stress_drop",
    title="Static and dynamic stress drops of stick-slip against ln V_0",
    summary=(
        "Stress drops of limit cycles fall with the logarithm of load point velocity. For the "
        "slip law the slopes are close to 2 (a-b) sigma_* (static) and (a-b) sigma_* (dynamic) "
        "at constant normal stress, and those over 1 - mu_* cot(phi) where normal stress "
        "varies; for the slowness law they depend on stiffness."
    ),
    base=base,
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("stiffness_ratio", [0.4, 0.6, 0.8]),
        Axis("load_velocity_ratio", 10.0 ** np.linspace(-1.0, 2.0, 7)),
    ],
    measure=LimitCycle(phases=2),
    reductions=[
        LinearFit(name="static_slope", of="static_stress_drop", on="log_load_velocity_ratio"),
        LinearFit(name="dynamic_slope", of="dynamic_stress_drop", on="log_load_velocity_ratio"),
    ],
    claims=[
        slope("static", "constant", -2.0 * weakening, "2(a-b)"),
        slope("dynamic", "constant", -weakening, "a-b"),
        slope("static", "variable", -2.0 * weakening * enhancement, "2(a-b)/(1 - mu_* cot phi)"),
        slope("dynamic", "variable", -weakening * enhancement, "(a-b)/(1 - mu_* cot phi)"),
        *(
            Claim(
                id="C16",
                statement=f"slowness law, {stress} normal stress: static drop falls with ln V_0",
                source=f"{PAPER}, section 3.5",
                variable="static_slope",
                where={"law": "slowness", "normal_stress": stress, "stiffness_ratio": 0.8},
                relation="below",
                published=0.0,
                tolerance=0.0,
                reason="an inequality",
            )
            for stress in ("constant", "variable")
        ),
        Claim(
            id="C16",
            statement="slowness law: steeper with variable normal stress",
            source=f"{PAPER}, section 3.5",
            variable="static_slope",
            where={"law": "slowness", "normal_stress": "variable", "stiffness_ratio": 0.8},
            minus={"law": "slowness", "normal_stress": "constant", "stiffness_ratio": 0.8},
            relation="below",
            published=0.0,
            tolerance=0.0,
            reason="an inequality",
        ),
    ],
    plot="stress_drop",
    references=[
        REFERENCE,
        "Gu and Wong (1991), J. Geophys. Res. 96, 21677-21691",
    ],
)
