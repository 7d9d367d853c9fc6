"""Stick-slip limit cycles: both laws, constant and variable normal stress (Figs. 9, 10 and 11)."""

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.study import Study
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.slider.scene import Scene

from ._paper import PAPER, REFERENCE


def speaks_of(law: str, normal_stress: str) -> dict[str, str]:
    """Place of one cycle on the lattice."""
    return {"law": law, "normal_stress": normal_stress}


study = Study(
    name="limit_cycles",
    title="Stick-slip limit cycles, k = 0.8 k_cr(V_*), b/a = 2, V_0 = 2 V_*",
    summary=(
        "Complete stick-slip motions with inertia, once cycles repeat. With the slip law, "
        "variable normal stress lowers the slowest slip rate by ten orders of magnitude; with "
        "the slowness law it changes the range of slip rate little, and a segment of nearly "
        "constant stress follows each rupture."
    ),
    base=Scene(
        b_over_a=2.0, alpha=0.56, stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True
    ),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
    ],
    measure=LimitCycle(),
    claims=[
        Claim(
            id="C12",
            statement="slip law: variable normal stress lowers the slowest V by 10 decades",
            source=f"{PAPER}, Fig. 9",
            variable="min_log10_slip_rate",
            where=speaks_of("slip", "variable"),
            minus=speaks_of("slip", "constant"),
            published=-10.0,
            tolerance=0.5,
            reason="'by 10 orders of magnitude'",
        ),
        Claim(
            id="C12",
            statement="slip law: larger stress drop with variable normal stress",
            source=f"{PAPER}, Fig. 9",
            variable="static_stress_drop",
            where=speaks_of("slip", "variable"),
            minus=speaks_of("slip", "constant"),
            relation="above",
            published=0.0,
            tolerance=0.0,
            reason="an inequality",
        ),
        Claim(
            id="C13",
            statement="slowness law: similar range of slip rate, constant and variable",
            source=f"{PAPER}, Fig. 10",
            variable="min_log10_slip_rate",
            where=speaks_of("slowness", "variable"),
            minus=speaks_of("slowness", "constant"),
            published=0.0,
            tolerance=0.5,
            reason="'similar', beside ten decades for the slip law",
        ),
        *(
            Claim(
                id="C13",
                statement=f"slowness law, {stress}: theta ~ V^(-a/b) = V^(-1/2) after the rupture",
                source=f"{PAPER}, section 3.4",
                variable="healing_exponent",
                where=speaks_of("slowness", stress),
                published=-0.5,
                tolerance=0.05,
                reason="'approximately': stress is not quite constant, the spring is loaded",
            )
            for stress in ("constant", "variable")
        ),
        *(
            Claim(
                id="C14",
                statement=f"slowness law, {stress}: drops in acceleration and deceleration unequal",
                source=f"{PAPER}, section 3.4, Fig. 11",
                variable="drop_asymmetry",
                where=speaks_of("slowness", stress),
                relation="above",
                published=1.5,
                tolerance=0.0,
                reason="'strongly asymmetrical'; 1 is symmetrical",
            )
            for stress in ("constant", "variable")
        ),
        Claim(
            id="C14",
            statement="constant normal stress: far more so than with the slip law",
            source=f"{PAPER}, section 3.4, Rice and Tse (1986)",
            variable="drop_asymmetry",
            where=speaks_of("slowness", "constant"),
            minus=speaks_of("slip", "constant"),
            relation="above",
            published=1.0,
            tolerance=0.0,
            reason="'different to the slip law', whose two drops are within a quarter of equal",
        ),
    ],
    plot="limit_cycles",
    references=[
        REFERENCE,
        "Rice and Tse (1986), J. Geophys. Res. 91, 521-530",
    ],
)
