"""Influence of the evolution law on the critical velocity step.

The critical step of load point velocity is smaller for laws whose state evolves faster when the
slip rate exceeds the rate of steady sliding. At 1.25 k_cr and constant normal stress, the critical
step ranges from 2.1 V_* (Perrin-Rice-Zheng) and 2.6 V_* (slip) to 53 V_* (slowness) and 146 V_*
(slowness with a cut-off velocity of 10^4 V_*). At 2 k_cr, the critical step ranges from 3.4 V_* to
4700 V_*. Close to the critical stiffness, variable normal stress lowers the critical step for all
laws, as the paper reports for the slip law. For the slowness law, this effect disappears at a
stiffness between 1.5 k_cr and 1.9 k_cr, whether the law depends on stress rate (c = 1) or not. The
composite law has V_c = 100 V_*.
"""

import numpy as np

from rsfstudy import Axis, Claim, Figure, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.reductions import RelativeDifference

from ._laws import (
    CUT_OFF,
    FAMILY_MIDDLE,
    LABELLED_LAWS,
    LAWS,
    PERRIN_RICE_ZHENG,
    REFERENCES,
    SLIP_END,
    SLOWNESS_END,
    panel_by_normal_stress,
)
from ._paper import PAPER, REFERENCE

STIFF_FIELDS = {"normal_stress": "constant", "stiffness_ratio": 1.25}


def law_order_claim(smaller: str, larger: str) -> Claim:
    """Return a claim about the order of the critical steps of two laws (L5).

    The law whose state evolves faster above steady sliding has the smaller critical step.

    Parameters
    ----------
    smaller : str
        Law with the smaller critical step.
    larger : str
        Law with the larger critical step.

    Returns
    -------
    Claim
        Claim about the difference of the critical steps.
    """
    return Claim.above(
        id="L5",
        statement=f"constant, k = 1.25 k_cr: the critical step of {larger} exceeds {smaller}",
        source="the critical step is smaller if the state evolves faster above steady sliding",
        variable="critical_velocity_ratio",
        where={"evolution": larger, **STIFF_FIELDS},
        baseline={"evolution": smaller, **STIFF_FIELDS},
        published=0.0,
    )


def variable_normal_stress_claim(law: str) -> Claim:
    """Return the claim that variable normal stress reduces the critical step (L6).

    The paper reports this result for the slip law.

    Parameters
    ----------
    law : str
        State evolution law.

    Returns
    -------
    Claim
        Claim about the relative change of the critical step.
    """
    return Claim.above(
        id="L6",
        statement=f"{law}, k = 1.25 k_cr: variable normal stress lowers the critical step",
        source=f"{PAPER}, section 3.1, for the slip law",
        variable="lowering",
        where={"evolution": law, **STIFF_FIELDS, "normal_stress": "variable"},
        published=0.1,
        reason="an inequality; our results are 0.12 to 0.48",
    )


figure = Figure(
    [panel_by_normal_stress("stiffness_ratio", "critical_velocity_ratio", "y")], height=70.0
)


study = Study(
    name="laws_velocity_steps",
    title="Critical load point velocity step and the state evolution law",
    summary=Study.caption(__doc__),
    base=Scene(b_over_a=2.0),
    axes=[
        Axis("evolution", LAWS),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("stiffness_ratio", [1.05, *(np.arange(9, 17) / 8)]),
    ],
    measure=CriticalStep(of="load_velocity_ratio"),
    reductions=[
        RelativeDifference(
            name="lowering",
            of="critical_velocity_ratio",
            along="normal_stress",
            reference="constant",
        )
    ],
    claims=[
        law_order_claim(PERRIN_RICE_ZHENG, SLIP_END),
        law_order_claim(SLIP_END, FAMILY_MIDDLE),
        law_order_claim(FAMILY_MIDDLE, SLOWNESS_END),
        law_order_claim(SLOWNESS_END, CUT_OFF),
        *map(variable_normal_stress_claim, LABELLED_LAWS),
        Claim.below(
            id="L6",
            statement=(
                "slowness law, k = 1.75 k_cr: variable normal stress does not lower the critical "
                "step"
            ),
            source="limit of the result that the paper reports for the slip law",
            variable="lowering",
            where={"evolution": SLOWNESS_END, "normal_stress": "variable", "stiffness_ratio": 1.75},
            published=0.0,
            reason="an inequality; our result is -0.03",
        ),
    ],
    plot=figure,
    references=[REFERENCE, *REFERENCES],
)
