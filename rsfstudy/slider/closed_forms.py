"""Published closed forms, by name: what reductions and figures hold results against."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scipy.optimize import brentq

#: Points at which normal stress is looked at for a critical fall, and the smallest and the largest
#: of them as sigma_*/sigma - 1.
_STRESS_FALL_COUNT, _MIN_STRESS_FALL, _MAX_STRESS_FALL = 400, 1e-9, 1e3


@dataclass(frozen=True)
class ClosedForm:
    """A formula of fields of a scene.

    Attributes
    ----------
    formula : str
        The formula.
    scene_field_names : tuple of str
        Names of the fields it takes, in order.
    function : callable
        The formula as a function of those fields.
    literature_citation : str
        Where it is published.
    """

    formula: str
    scene_field_names: tuple[str, ...]
    function: Callable[..., float]
    literature_citation: str


def critical_stiffness(
    log_slip_rate: float, mu_star: float, a: float, b: float, cot_phi: float, alpha: float
) -> float:
    """Critical stiffness ``k_cr D_c/sigma_*`` as an explicit function of V, without mass: ``(b - a)
    sigma_* (1 - mu_* cot(phi)) / {D_c (1 - mu_ss cot(phi)) [1 - (mu_ss - alpha) cot(phi)]}`` with
    ``mu_ss = mu_* - (b - a) ln(V/V_*)`` (He et al. 1998).

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    mu_star, a, b : float
        Friction coefficient at V_*, direct effect and evolution effect.
    cot_phi, alpha : float
        d sigma/d tau, 0 where normal stress is constant, and its effect on the state variable.

    References
    ----------
    Eq. 8 of doi:10.1007/s11589-014-0098-4; Dieterich and Linker (1992), Geophys. Res. Lett. 19,
    1691-1694.
    """
    mu_ss = mu_star - (b - a) * log_slip_rate
    above = (b - a) * (1.0 - mu_star * cot_phi)
    return above / ((1.0 - mu_ss * cot_phi) * (1.0 - (mu_ss - alpha) * cot_phi))


def critical_displacement_step(
    b_over_a: float, law_exponent: float = 0.0, stiffness_ratio: float = 0.0
) -> float:
    """Critical displacement step of the family of laws, over D_c; NaN where there is none.

    ``a/(b-a) [-ln(1 - eps r)]/(eps r)`` with r = k/k_cr, at constant normal stress, under a load
    point that is held and with an infinite norm; ``a/(b-a)`` by the slip law, eps = 0.

    Parameters
    ----------
    b_over_a : float
        b/a, above 1.
    law_exponent : float
        eps of the family, from 0 (slip law) to 1 (slowness law).
    stiffness_ratio : float
        k/k_cr.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196, for the slip law.
    """
    product = law_exponent * stiffness_ratio
    if math.isnan(product) or product >= 1.0:
        return math.nan
    longer = -math.log1p(-product) / product if product else 1.0
    return longer / (b_over_a - 1.0)


def critical_velocity_step(b_over_a: float, law_exponent: float = 0.0) -> float:
    """Critical V_0/V_* of the family of laws at critical stiffness; NaN where there is none.

    ``V_0/V_* = 1 + a/[(1 - eps)(b - a)]``, at constant normal stress and with an infinite norm.
    With q = exp(-eps u) and y = V_0/V the motion follows a system of Lotka-Volterra equations,
    which the line from V_* through its saddle (1 - eps, 0) does not leave.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196, for the slip law, eps = 0.
    """
    if math.isnan(law_exponent) or law_exponent >= 1.0:
        return math.nan
    return 1.0 + 1.0 / ((1.0 - law_exponent) * (b_over_a - 1.0))


def effective_friction(mu_star: float, b_over_a: float, alpha: float) -> float:
    """Effective friction, which makes of a small change of normal stress one of Coulomb stress:
    ``mu' = mu_* - alpha (1 - a/b)``, because a fall of normal stress also strengthens the state.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940, for alpha.
    """
    return mu_star - alpha * (1.0 - 1.0 / b_over_a) if alpha else mu_star


def steady_state_offset_at_instability(law_exponent: float, stiffness_ratio: float) -> float:
    """``u = Theta/b + ln V`` at which the family of laws falls no faster than a spring pulls,
    ``h(u) = -stiffness_ratio``; infinite where it never does.
    """
    product = law_exponent * stiffness_ratio
    if product >= 1.0:
        return math.inf
    return -math.log1p(-product) / law_exponent if law_exponent else stiffness_ratio


def steady_state_offset_after_normal_stress_fall(
    mu_star: float, a: float, b_over_a: float, alpha: float, normal_stress_ratio: float
) -> float:
    """``u = Theta/b + ln V`` just after steady sliding at V_* has its normal stress changed to
    sigma_*/quotient: ``mu_* (q - 1)/a - alpha (1/a - 1/b) ln q``.
    """
    taken = alpha * (1.0 - 1.0 / b_over_a) * math.log(normal_stress_ratio)
    return (mu_star * (normal_stress_ratio - 1.0) - taken) / a


def critical_normal_stress_step(
    mu_star: float,
    a: float,
    b_over_a: float,
    alpha: float,
    law_exponent: float,
    stiffness_ratio: float,
) -> float:
    """Critical fall of imposed normal stress, over sigma_* and negative, by the family of laws:
    where `offset_after_stress_fall` first is at the `instability_threshold` of ``q k/k_cr``; NaN
    where it never is.

    With the load point at rest u obeys ``du/d(slip) = (1 - b/a)[h(u) + q k/k_cr]`` over D_c: where
    it begins above the threshold, slip rate grows without bound.
    """

    def excess_over_threshold(growth: float) -> float:
        quotient = 1.0 + growth
        needed = steady_state_offset_at_instability(law_exponent, quotient * stiffness_ratio)
        return (
            steady_state_offset_after_normal_stress_fall(mu_star, a, b_over_a, alpha, quotient)
            - needed
        )

    factor = (_MAX_STRESS_FALL / _MIN_STRESS_FALL) ** (1.0 / _STRESS_FALL_COUNT)
    smaller = _MIN_STRESS_FALL
    while smaller < _MAX_STRESS_FALL:
        larger = factor * smaller
        if excess_over_threshold(larger) >= 0.0:
            growth = float(brentq(excess_over_threshold, smaller, larger, xtol=1e-18, rtol=1e-14))
            return -growth / (1.0 + growth)
        smaller = larger
    return math.nan


CLOSED_FORMS: Mapping[str, ClosedForm] = {
    "velocity_step_at_critical_stiffness": ClosedForm(
        "V_0/V_* = 1 + a/(b-a)",
        ("b_over_a",),
        critical_velocity_step,
        "Gu et al. (1984), slip law, constant normal stress, k = k_cr",
    ),
    "velocity_step_for_b_over_a_of_e": ClosedForm(
        "V_0/V_* = exp(k/k_cr) a/(b-a)",
        ("b_over_a", "stiffness_ratio"),
        lambda b_over_a, ratio: math.exp(min(ratio, 700.0)) / (b_over_a - 1.0),
        "Gu et al. (1984), slip law, constant normal stress, b/a = e; exact at k = k_cr only",
    ),
    "displacement_step": ClosedForm(
        "D_c a/(b-a)",
        ("b_over_a",),
        critical_displacement_step,
        "Gu et al. (1984), slip law, constant normal stress, load point held",
    ),
    "displacement_step_of_the_family": ClosedForm(
        "D_c a/(b-a) [-ln(1 - eps k/k_cr)]/(eps k/k_cr)",
        ("b_over_a", "law_exponent", "stiffness_ratio"),
        critical_displacement_step,
        "h(u*) = -k/k_cr, constant normal stress, load point held, infinite norm",
    ),
    "velocity_step_of_the_family": ClosedForm(
        "V_0/V_* = 1 + a/[(1 - eps)(b-a)]",
        ("b_over_a", "law_exponent"),
        critical_velocity_step,
        "invariant line of the orbits at k = k_cr, constant normal stress, infinite norm; eps = 0 "
        "is that of Gu et al. (1984)",
    ),
    "net_weakening": ClosedForm(
        "(a-b) sigma_*",
        ("a", "b_over_a"),
        lambda a, b_over_a: a * (1.0 - b_over_a),
        "scale of stress drops against ln V_0: Cao and Aki (1986), Gu and Wong (1991)",
    ),
}
