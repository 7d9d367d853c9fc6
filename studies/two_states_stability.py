"""Critical stiffness of a law with two states.

The critical stiffness of steady sliding depends on the second evolution effect b_2 and on its slip
distance. A negative b_2 with a long slip distance makes steady friction rate-strengthening (b_1 +
b_2 < a, i.e. b_2 below -0.4 a). Steady sliding is still unstable on sufficiently soft springs,
because the first state weakens friction before the second state evolves. If the second slip
distance is shorter than the first, the second state only reduces or increases the direct effect.
"""

import math
from typing import Any

from rsfstudy import Axis, Claim, Scene, Study
from rsfstudy.measures import LinearStability

GU_ET_AL = "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196"
RUINA = "Ruina (1983), J. Geophys. Res. 88, 10359-10370"
DIRECT_EFFECT, FIRST_EFFECT_OVER_A = 0.01, 1.4


def cubic_critical_stiffness(second: float, longer: float) -> float:
    """Compute the critical stiffness from the cubic characteristic equation.

    Parameters
    ----------
    second : float
        Ratio b_2/a.
    longer : float
        Ratio of the slip distances, L_2/L_1.

    Returns
    -------
    float
        Critical stiffness in sigma_*/L_1.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196.
    """
    rho = 1.0 / longer
    linear = (
        FIRST_EFFECT_OVER_A - 1.0 + rho * (2.0 * FIRST_EFFECT_OVER_A + (second - 1.0) * (2.0 + rho))
    )
    net, apart = FIRST_EFFECT_OVER_A + second - 1.0, 1.0 + rho - FIRST_EFFECT_OVER_A - second * rho
    root = math.sqrt(linear**2 + 4.0 * rho * (1.0 + rho) * net * apart)
    return DIRECT_EFFECT * (linear + root) / (2.0 + 2.0 * rho)


def critical_stiffness_claim(
    second: float, longer: float, says: str, published: float, **held: Any
) -> Claim:
    """Return a claim about the critical stiffness of a law with two states (S7).

    Parameters
    ----------
    second : float
        Ratio b_2/a.
    longer : float
        Ratio of the slip distances, L_2/L_1.
    says : str
        Statement of the claim.
    published : float
        Expected value.
    **held : object
        Other arguments of ``Claim``.

    Returns
    -------
    Claim
        Claim about the critical stiffness.
    """
    return Claim(
        id="S7",
        statement=f"b_2 = {second:g} a, L_2 = {longer:g} D_c: {says}",
        source=f"{GU_ET_AL}, {RUINA}: closed form from the cubic of small perturbations",
        variable="critical_stiffness",
        where={"b2_over_a": second, "length_ratio": longer},
        published=published,
        **held,
    )


PUBLISHED_DIGITS_TOLERANCE: dict[str, Any] = {
    "tolerance": 5e-8,
    "reason": "rounding of the published value",
}
ROUNDING_TOLERANCE: dict[str, Any] = {
    "tolerance": 3e-15,
    "reason": "rounding of the derivatives of the law, which are finite differences",
}

study = Study(
    name="two_states_stability",
    title="Critical stiffness of two states, b_1 = 1.4 a",
    summary=Study.caption(__doc__),
    base=Scene(
        law="two_slip_states",
        normal_stress="constant",
        a=DIRECT_EFFECT,
        b1_over_a=FIRST_EFFECT_OVER_A,
        stiffness=DIRECT_EFFECT,
    ),
    axes=[
        Axis("b2_over_a", [-1.1, -0.9, -0.7, -0.6, -0.5, -0.3, -0.1, 0.1, 0.3, 0.5, 0.7]),
        Axis("length_ratio", [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0]),
    ],
    measure=LinearStability(),
    claims=[
        critical_stiffness_claim(
            -0.6,
            50.0,
            "unstable below, though it strengthens",
            0.0038741,
            **PUBLISHED_DIGITS_TOLERANCE,
        ),
        *(
            critical_stiffness_claim(
                *at, "as the closed form", cubic_critical_stiffness(*at), **ROUNDING_TOLERANCE
            )
            for at in ((-0.9, 200.0), (0.3, 10.0), (0.7, 0.2))
        ),
        critical_stiffness_claim(
            0.5,
            1.0,
            "as one state, b_1 + b_2 - a",
            DIRECT_EFFECT * (FIRST_EFFECT_OVER_A + 0.5 - 1.0),
            **ROUNDING_TOLERANCE,
        ),
    ],
    references=[GU_ET_AL, RUINA],
)
