"""Published closed forms, by name: what reductions and figures hold results against."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scipy.optimize import brentq

#: Points at which normal stress is looked at for a critical fall, and the smallest and the largest
#: of them as sigma_*/sigma - 1.
_FALLS, _SMALLEST_FALL, _LARGEST_FALL = 400, 1e-9, 1e3


@dataclass(frozen=True)
class ClosedForm:
    """A formula of fields of a scene.

    Attributes
    ----------
    text : str
        The formula.
    fields : tuple of str
        Names of the fields it takes, in order.
    value : callable
        The formula as a function of those fields.
    source : str
        Where it is published.
    """

    text: str
    fields: tuple[str, ...]
    value: Callable[..., float]
    source: str


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


def displacement_step(b_over_a: float, exponent: float = 0.0, ratio: float = 0.0) -> float:
    """Critical displacement step of the family of laws, over D_c; NaN where there is none.

    ``a/(b-a) [-ln(1 - eps r)]/(eps r)`` with r = k/k_cr, at constant normal stress, under a load
    point that is held and with an infinite norm; ``a/(b-a)`` by the slip law, eps = 0.

    Parameters
    ----------
    b_over_a : float
        b/a, above 1.
    exponent : float
        eps of the family, from 0 (slip law) to 1 (slowness law).
    ratio : float
        k/k_cr.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196, for the slip law.
    """
    product = exponent * ratio
    if math.isnan(product) or product >= 1.0:
        return math.nan
    longer = -math.log1p(-product) / product if product else 1.0
    return longer / (b_over_a - 1.0)


def velocity_step(b_over_a: float, exponent: float = 0.0) -> float:
    """Critical V_0/V_* of the family of laws at critical stiffness; NaN where there is none.

    ``V_0/V_* = 1 + a/[(1 - eps)(b - a)]``, at constant normal stress and with an infinite norm.
    With q = exp(-eps u) and y = V_0/V the motion follows a system of Lotka-Volterra equations,
    which the line from V_* through its saddle (1 - eps, 0) does not leave.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196, for the slip law, eps = 0.
    """
    if math.isnan(exponent) or exponent >= 1.0:
        return math.nan
    return 1.0 + 1.0 / ((1.0 - exponent) * (b_over_a - 1.0))


def effective_friction(mu_star: float, b_over_a: float, alpha: float) -> float:
    """Effective friction, which makes of a small change of normal stress one of Coulomb stress:
    ``mu' = mu_* - alpha (1 - a/b)``, because a fall of normal stress also strengthens the state.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940, for alpha.
    """
    return mu_star - alpha * (1.0 - 1.0 / b_over_a) if alpha else mu_star


def threshold(exponent: float, pull: float) -> float:
    """``u = Theta/b + ln V`` at which the family of laws falls no faster than a spring pulls,
    ``h(u) = -pull``; infinite where it never does.
    """
    product = exponent * pull
    if product >= 1.0:
        return math.inf
    return -math.log1p(-product) / exponent if exponent else pull


def after_fall(mu_star: float, a: float, b_over_a: float, alpha: float, quotient: float) -> float:
    """``u = Theta/b + ln V`` just after steady sliding at V_* has its normal stress changed to
    sigma_*/quotient: ``mu_* (q - 1)/a - alpha (1/a - 1/b) ln q``.
    """
    taken = alpha * (1.0 - 1.0 / b_over_a) * math.log(quotient)
    return (mu_star * (quotient - 1.0) - taken) / a


def normal_stress_step(
    mu_star: float, a: float, b_over_a: float, alpha: float, exponent: float, ratio: float
) -> float:
    """Critical fall of imposed normal stress, over sigma_* and negative, by the family of laws:
    where `after_fall` first is at the `threshold` of ``q k/k_cr``; NaN where it never is.

    With the load point at rest u obeys ``du/d(slip) = (1 - b/a)[h(u) + q k/k_cr]`` over D_c: where
    it begins above the threshold, slip rate grows without bound.
    """

    def excess(growth: float) -> float:
        quotient = 1.0 + growth
        needed = threshold(exponent, quotient * ratio)
        return after_fall(mu_star, a, b_over_a, alpha, quotient) - needed

    factor = (_LARGEST_FALL / _SMALLEST_FALL) ** (1.0 / _FALLS)
    smaller = _SMALLEST_FALL
    while smaller < _LARGEST_FALL:
        larger = factor * smaller
        if excess(larger) >= 0.0:
            growth = float(brentq(excess, smaller, larger, xtol=1e-18, rtol=1e-14))
            return -growth / (1.0 + growth)
        smaller = larger
    return math.nan


FORMS: Mapping[str, ClosedForm] = {
    "velocity_step_at_critical_stiffness": ClosedForm(
        "V_0/V_* = 1 + a/(b-a)",
        ("b_over_a",),
        velocity_step,
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
        displacement_step,
        "Gu et al. (1984), slip law, constant normal stress, load point held",
    ),
    "displacement_step_of_the_family": ClosedForm(
        "D_c a/(b-a) [-ln(1 - eps k/k_cr)]/(eps k/k_cr)",
        ("b_over_a", "law_exponent", "stiffness_ratio"),
        displacement_step,
        "h(u*) = -k/k_cr, constant normal stress, load point held, infinite norm",
    ),
    "velocity_step_of_the_family": ClosedForm(
        "V_0/V_* = 1 + a/[(1 - eps)(b-a)]",
        ("b_over_a", "law_exponent"),
        velocity_step,
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
