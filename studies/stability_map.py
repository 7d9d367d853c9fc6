"""Maps of limit cycles over stiffness and load point velocity: where steady sliding, slow
oscillation and stick-slip lie.
"""

from typing import Any

import numpy as np

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.study import Study
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.reduce import CyclingEdge
from rsfstudy.slider.scene import Scene

from ._paper import PAPER, REFERENCE

#: What is claimed of each case: its edge, and that no stick-slip lies above it, nor steady sliding
#: below.
LINEAR: dict[str, Any] = {
    "says": "limit cycles end where the eigenvalues say",
    "variable": "cycling_edge_farthest",
    "tolerance": 0.5,
    "reason": "half a spacing of the cells in stiffness: the boundary is within the bracket",
}
NONE_MISPLACED: dict[str, Any] = {
    "says": "no cell cycles above it or settles below it",
    "variable": "cycling_edge_misplaced",
    "tolerance": 0.0,
    "reason": "a count",
}
CASES = [(law, stress) for law in ("slip", "slowness") for stress in ("constant", "variable")]


def edge(law: str, normal_stress: str, says: str, **held: Any) -> Claim:
    """C1: the edge of the computed region is where the eigenvalues say."""
    return Claim(
        id="C1",
        statement=f"{law} law, {normal_stress}: {says}",
        source=f"{PAPER}, section 2.2, eqs. 7 and 8; eigenvalues with mass",
        where={"law": law, "normal_stress": normal_stress},
        published=0.0,
        **held,
    )


study = Study(
    name="stability_map",
    title="Limit cycles over stiffness and load point velocity, b/a = 2, alpha = 0.56",
    summary=(
        "What a slider does in the end whose load point steps from V_* to V_0: it slides steadily "
        "where linear theory calls that stable, and cycles everywhere else. Cycles whose peak "
        "slip rate stays below the instability norm are slow oscillation, those that reach it "
        "stick-slip. The critical stiffness at V_0, from the eigenvalues of steady sliding, "
        "bounds the cycling region in every column of the map; at variable normal stress it "
        "falls with V_0, and slow oscillation lies in a narrow band below, while at constant "
        "normal stress stick-slip reaches up to the boundary. Beside it cycles are approached "
        "slowly, over thousands of events, and small errors of a step move them far: motions "
        "are integrated 300 times more tightly than their numbers are asked for."
    ),
    base=Scene(b_over_a=2.0, alpha=0.56, inertia=True),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("stiffness_ratio", np.linspace(0.05, 1.05, 100)),
        Axis("load_velocity_ratio", np.geomspace(1.01, 1000.0, 100)),
    ],
    measure=LimitCycle(phases=2, events=20_000),
    accuracy=Accuracy(rtol=1e-3, budget=20_000_000, engine="compiled", refinement=0.003),
    reductions=[CyclingEdge(name="cycling_edge", of="recurrence_interval")],
    claims=[
        *(edge(*case, **LINEAR) for case in CASES),
        *(edge(*case, **NONE_MISPLACED) for case in CASES),
    ],
    plot="stability_map",
    references=[
        REFERENCE,
        "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196",
    ],
)
