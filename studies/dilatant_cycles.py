"""Dilatancy: stick-slip cycles that become slow."""

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.study import Study
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy

from ._fluids import FAULT, REFERENCE, SEGALL_RICE


def peak(law: str, dilatancy: float, relation: str, log10: float, what: str) -> Claim:
    """D7: how fast a cycle slips where c* D_c/V_* = 1."""
    return Claim(
        id="D7",
        statement=f"{law} law, dilatancy {dilatancy:g}: {what}",
        source=f"{SEGALL_RICE}: dilatancy may prevent instability, with slow slip in its place",
        variable="max_log10_slip_rate",
        where={"law": law, "drainage": 1.0, "dilatancy": dilatancy},
        relation=relation,
        published=log10,
        tolerance=0.0,
        reason="an inequality; dynamic ruptures reach 10^9 V_*",
    )


study = Study(
    name="dilatant_cycles",
    title="Stick-slip of a dilatant fault, k = 0.5 (b-a) sigma_*/D_c, with mass",
    summary=(
        "A spring half as stiff as the drained critical one: steady sliding is unstable in every "
        "cell, and without dilatancy cycles end in dynamic rupture at 10^9 V_*. Ruptures have no "
        "time to drain. Some way beyond the dilatancy at which the spring is stiffer than the "
        "undrained critical one, b - a - E, slip still accelerates, but never comes to rupture: "
        "within a narrow range of dilatancy cycles of 10^9 V_* become slow slip of 10 to 1000 V_*, "
        "with a tenth of the stress drop. Faster drainage moves that to stronger dilatancy."
    ),
    base=FAULT.with_(stiffness=0.0025, load_velocity_ratio=1.0, inertia=True),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("drainage", [1.0, 10.0]),
        Axis("dilatancy", [0.0, 0.002, 0.004, 0.006, 0.007, 0.008, 0.009, 0.010, 0.012]),
    ],
    measure=LimitCycle(),
    accuracy=Accuracy(rtol=1e-5),
    claims=[
        claim
        for law in ("slip", "slowness")
        for claim in (
            peak(law, 0.0, "above", 9.0, "dynamic rupture"),
            peak(law, 0.008, "below", 2.5, "slow slip"),
            Claim(
                id="D8",
                statement=f"{law} law: slow cycles drop less than a fifth of the stress",
                source=SEGALL_RICE,
                variable="static_stress_drop",
                where={"law": law, "drainage": 1.0, "dilatancy": 0.008},
                relation="below",
                published=0.05,
                tolerance=0.0,
                reason="an inequality; 0.24 to 0.27 without dilatancy",
            ),
        )
    ],
    plot="dilatant_cycles",
    references=[REFERENCE],
)
