"""Influence of the evolution law on stick-slip cycles.

Limit cycles with inertia are computed for all laws at four load point velocities. At constant
normal stress, the dynamic stress drop decreases for all laws by about (b-a) sigma_* if ln V_0
increases by 1. The static stress drop decreases by 2.1 (b-a) sigma_* under the slip law, and by 1.5
(b-a) sigma_* under the slowness law. Of all results, the minimum slip rate depends most strongly on
the law. It ranges from 10^-1.4 V_* (slip law) to 10^-19 V_* (Perrin-Rice-Zheng law). Variable
normal stress lowers the minimum slip rate by ten decades under the slip law, but not under the
slowness law. The composite law has V_c = 100 V_*. The cut-off velocity of 10^4 V_* limits the slip
rate to 10^5.4 V_* and makes the stress drops small.
"""

from rsfstudy import Axis, Claim, Figure, Scene, Study
from rsfstudy.measures import LimitCycle
from rsfstudy.reductions import ClosedFormRatio, Difference, LinearFit

from ._laws import (
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

base = Scene(b_over_a=2.0, stiffness_ratio=0.8, inertia=True)
EXTENDED_PRECISION_SOURCE = "extended precision: other unknowns, another method, 64-bit mantissas"


def known_cycle_claim(law: str, variable: str, published: float) -> Claim:
    """Return the claim that a limit cycle agrees with its known value (L9).

    Parameters
    ----------
    law : str
        State evolution law.
    variable : str
        Name of the variable.
    published : float
        Expected value.

    Returns
    -------
    Claim
        Claim about the variable.
    """
    return Claim(
        id="L9",
        statement=f"{law}, constant, V_0 = 2 V_*: {variable.replace('_', ' ')}",
        source=EXTENDED_PRECISION_SOURCE,
        variable=variable,
        where={"evolution": law, "normal_stress": "constant", "load_velocity_ratio": 2.0},
        published=published,
        tolerance=1e-7 * published,
        reason="the accuracy of the study",
    )


def dynamic_drop_claim(law: str) -> Claim:
    """Return the claim that the dynamic stress drop scales with ln V_0 (L10).

    The paper reports this result for the slip law.

    Parameters
    ----------
    law : str
        State evolution law.

    Returns
    -------
    Claim
        Claim about the scaled slope.
    """
    return Claim(
        id="L10",
        statement=f"{law}, constant: dynamic drop against ln V_0 is about (a-b) sigma_*",
        source=f"{PAPER}, section 3.5, for the slip law",
        variable="dynamic_slope_scaled",
        where={"evolution": law, "normal_stress": "constant"},
        published=1.0,
        tolerance=0.5,
        reason="the paper reports an integer multiple ('scales with') without an error; the "
        "tolerance is half of (a-b) sigma_*",
    )


def slip_rate_claim(law: str, relation: str, decades: float) -> Claim:
    """Return a claim about how much variable normal stress lowers the minimum slip rate (L11).

    The paper reports a decrease of ten decades for the slip law.

    Parameters
    ----------
    law : str
        State evolution law.
    relation : str
        Relation of the result to the expected value: "equals", "below" or "above".
    decades : float
        Bound of the change in decades.

    Returns
    -------
    Claim
        Claim about the change of the minimum slip rate.
    """
    return Claim(
        id="L11",
        statement=f"{law}, V_0 = 2 V_*: variable normal stress lowers the minimum slip rate by "
        "decades",
        source=f"{PAPER}, Fig. 9, for the slip law: lower by about 10 decades",
        variable="slowest_moved",
        where={"evolution": law, "normal_stress": "variable", "load_velocity_ratio": 2.0},
        relation=relation,
        published=decades,
    )


figure = Figure(
    [
        panel_by_normal_stress("load_velocity_ratio", variable, "x")
        for variable in ("static_stress_drop", "min_log10_slip_rate")
    ]
)


study = Study(
    name="laws_cycles",
    title="Stick-slip cycles and the state evolution law, k = 0.8 k_cr",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("evolution", LAWS),
        Axis("normal_stress", ["constant", "variable"]),
        Axis("load_velocity_ratio", [2.0, 10.0, 50.0, 250.0]),
    ],
    measure=LimitCycle(phases=2),
    reductions=[
        LinearFit(name="static_slope", of="static_stress_drop", on="log_load_velocity_ratio"),
        LinearFit(name="dynamic_slope", of="dynamic_stress_drop", on="log_load_velocity_ratio"),
        ClosedFormRatio(name="static_slope_scaled", of="static_slope", form="net_weakening"),
        ClosedFormRatio(name="dynamic_slope_scaled", of="dynamic_slope", form="net_weakening"),
        Difference(
            name="slowest_moved",
            of="min_log10_slip_rate",
            along="normal_stress",
            reference="constant",
        ),
    ],
    claims=[
        known_cycle_claim(SLIP_END, "recurrence_interval", 27.3903182296427),
        known_cycle_claim(SLIP_END, "static_stress_drop", 40.16070456254199 * base.a),
        known_cycle_claim(SLOWNESS_END, "recurrence_interval", 23.9399987067),
        known_cycle_claim(SLOWNESS_END, "static_stress_drop", 37.127939244 * base.a),
        *map(dynamic_drop_claim, LABELLED_LAWS),
        slip_rate_claim(SLIP_END, "below", -9.0),
        slip_rate_claim(PERRIN_RICE_ZHENG, "below", -5.0),
        slip_rate_claim(FAMILY_MIDDLE, "above", -1.5),
        slip_rate_claim(SLOWNESS_END, "above", 0.0),
    ],
    plot=figure,
    references=[REFERENCE, *REFERENCES],
)
