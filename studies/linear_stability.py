"""Linear stability: the critical stiffness as a function of slip rate and driving angle (Fig.
2).
"""

import numpy as np

from rsfstudy.claims import Claim
from rsfstudy.measures.linear_stability import LinearStability
from rsfstudy.reduce import LinearFit
from rsfstudy.scene import Scene
from rsfstudy.study import Axis, Study

from ._paper import PAPER, REFERENCE


def steepness(phi: float, gentler: float) -> Claim:
    """C1: steeper curves for smaller angles."""
    return Claim(
        id="C1",
        statement=f"k_cr falls with V more steeply at {phi:g} than at {gentler:g} degrees",
        source=f"{PAPER}, section 2.2, Fig. 2",
        variable="stiffness_slope",
        where={"phi": phi},
        minus={"phi": gentler},
        relation="below",
        published=0.0,
        tolerance=0.0,
        reason="an inequality",
    )


study = Study(
    name="linear_stability",
    title="Critical stiffness of steady sliding against slip rate, b/a = 2, alpha = 0.56",
    summary=(
        "Above its curve steady sliding is stable under small perturbations, below it unstable. "
        "The curves fall with slip rate, the more steeply the smaller the angle between the "
        "driving stress and the fault normal; where phi < atan(mu_ss) there is no steady state."
    ),
    base=Scene(b_over_a=2.0, alpha=0.56),
    axes=[
        Axis("phi", [40.0, 45.0, 50.0, 60.0, 75.0]),
        Axis("load_velocity_ratio", 10.0 ** np.linspace(-6.0, 6.0, 49)),
    ],
    measure=LinearStability(),
    reductions=[
        LinearFit(
            name="stiffness_slope",
            of="critical_stiffness",
            on="log_load_velocity_ratio",
            within=(-1.2, 1.2),
        ),
    ],
    claims=[
        Claim(
            id="C1",
            statement="phi = 60 degrees: k_cr falls with V",
            source=f"{PAPER}, section 2.2, Fig. 2",
            variable="stiffness_slope",
            where={"phi": 60.0},
            relation="below",
            published=0.0,
            tolerance=0.0,
            reason="an inequality",
        ),
        steepness(50.0, 60.0),
        steepness(40.0, 50.0),
        Claim(
            id="C1",
            statement="phi = 60 degrees, V = V_*: k_cr by eq. 8 is that of growing perturbations",
            source=f"{PAPER}, eqs. 7 and 8",
            variable="critical_stiffness_error",
            where={"phi": 60.0, "load_velocity_ratio": 1.0},
            published=0.0,
            tolerance=1e-9,
            reason="central differences of the assembled equations",
        ),
        Claim(
            id="C2",
            statement="phi = 40 degrees, V = 1e-4 V_*: mu_ss exceeds tan(phi) = 0.8391",
            source=f"{PAPER}, eq. 9",
            variable="steady_friction",
            where={"phi": 40.0, "load_velocity_ratio": 1e-4},
            relation="above",
            published=0.8391,
            tolerance=0.0,
            reason="an inequality: no steady state there, while faster sliding has one",
        ),
    ],
    plot="linear_stability",
    references=[
        REFERENCE,
        "Dieterich and Linker (1992), Geophys. Res. Lett. 19, 1691-1694",
    ],
)
