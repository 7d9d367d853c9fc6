"""Closed-form solutions from the literature.

Figures and reductions compare computed results with the formulas in ``CLOSED_FORMS``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scipy.optimize import brentq

#: Grid of values of sigma_*/sigma - 1 for the search for the critical normal stress step: the
#: number of values, the smallest value and the largest value.
_STRESS_FALL_COUNT, _MIN_STRESS_FALL, _MAX_STRESS_FALL = 400, 1e-9, 1e3


@dataclass(frozen=True)
class ClosedForm:
    """Published formula that depends on fields of a scene.

    Parameters
    ----------
    formula_text : str
        Formula for display.
    scene_field_names : tuple of str
        Names of the scene fields that the formula depends on, in the order of the arguments.
    formula_function : callable
        Function that evaluates the formula.
    literature_citation : str
        Reference for the formula.
    """

    formula_text: str
    scene_field_names: tuple[str, ...]
    formula_function: Callable[..., float]
    literature_citation: str


def compute_critical_stiffness(
    log_slip_rate: float, mu_star: float, a: float, b: float, cot_phi: float, alpha: float
) -> float:
    r"""Compute the critical stiffness of a slider without inertia from a closed-form equation.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    mu_star : float
        Friction coefficient :math:`\mu_*` at the reference velocity.
    a, b : float
        Parameters of the direct effect and the evolution effect.
    cot_phi : float
        Derivative of normal stress with respect to shear stress, :math:`\cot\phi`. It is 0 if the
        normal stress is constant.
    alpha : float
        Coefficient of the effect of normal stress on the state variable.

    Returns
    -------
    float
        Critical stiffness :math:`k_{cr} D_c/\sigma_*`.

    Notes
    -----
    With the steady friction coefficient :math:`\mu_{ss} = \mu_* - (b - a) \ln(V/V_*)`, the critical
    stiffness (He et al. 1998) is

    .. math::

        k_{cr} = \frac{(b - a) \sigma_* (1 - \mu_* \cot\phi)}{D_c (1 - \mu_{ss} \cot\phi) [1 -
        (\mu_{ss} - \alpha) \cot\phi]}.

    References
    ----------
    Eq. 8 of doi:10.1007/s11589-014-0098-4; Dieterich and Linker (1992), Geophys. Res. Lett. 19,
    1691-1694.
    """
    mu_ss = mu_star - (b - a) * log_slip_rate
    above = (b - a) * (1.0 - mu_star * cot_phi)
    return above / ((1.0 - mu_ss * cot_phi) * (1.0 - (mu_ss - alpha) * cot_phi))


def compute_critical_displacement_step(
    b_over_a: float, law_exponent: float = 0.0, stiffness_ratio: float = 0.0
) -> float:
    r"""Compute the critical displacement step for the slip-to-slowness laws.

    Parameters
    ----------
    b_over_a : float
        Ratio :math:`b/a`, which is greater than 1.
    law_exponent : float, default: 0.0
        Exponent :math:`\epsilon` of the family of laws, from 0 (slip law) to 1 (slowness law).
    stiffness_ratio : float, default: 0.0
        Stiffness ratio :math:`r = k/k_{cr}`.

    Returns
    -------
    float
        Critical displacement step in units of :math:`D_c`. The result is NaN if no displacement
        step is critical.

    Notes
    -----
    The formula assumes that normal stress is constant, that the load point does not move after the
    displacement step, and that the limit of the slip rate (instability norm) is infinite. The
    critical displacement step is

    .. math::

        \frac{a}{b - a} \, \frac{-\ln(1 - \epsilon r)}{\epsilon r}.

    For the slip law, :math:`\epsilon = 0`, the critical displacement step is :math:`a/(b - a)`.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196, for the slip law.
    """
    product = law_exponent * stiffness_ratio
    if math.isnan(product) or product >= 1.0:
        return math.nan
    longer = -math.log1p(-product) / product if product else 1.0
    return longer / (b_over_a - 1.0)


def compute_critical_velocity_step(b_over_a: float, law_exponent: float = 0.0) -> float:
    r"""Compute the critical velocity step at the critical stiffness.

    Parameters
    ----------
    b_over_a : float
        Ratio :math:`b/a`, which is greater than 1.
    law_exponent : float, default: 0.0
        Exponent :math:`\epsilon` of the family of laws, from 0 (slip law) to 1 (slowness law).

    Returns
    -------
    float
        Critical velocity ratio :math:`V_0/V_*`. The result is NaN if no velocity step is critical.

    Notes
    -----
    The formula assumes that normal stress is constant and that the limit of the slip rate
    (instability norm) is infinite. The critical velocity ratio is

    .. math:: \frac{V_0}{V_*} = 1 + \frac{a}{(1 - \epsilon)(b - a)}.

    Let :math:`u = \Theta/b + \ln V` be the offset from steady state. The variables
    :math:`q = \exp(-\epsilon u)` and :math:`y = V_0/V` obey Lotka-Volterra equations. The straight
    line from :math:`V_*` through the saddle point :math:`(1 - \epsilon, 0)` is an invariant line of
    these Lotka-Volterra equations.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196, for the slip law.
    """
    if math.isnan(law_exponent) or law_exponent >= 1.0:
        return math.nan
    return 1.0 + 1.0 / ((1.0 - law_exponent) * (b_over_a - 1.0))


def compute_coulomb_effective_friction(mu_star: float, b_over_a: float, alpha: float) -> float:
    r"""Compute the effective friction coefficient for Coulomb stress changes.

    Parameters
    ----------
    mu_star : float
        Friction coefficient :math:`\mu_*` at the reference velocity.
    b_over_a : float
        Ratio :math:`b/a`.
    alpha : float
        Coefficient of the effect of normal stress on the state variable.

    Returns
    -------
    float
        Effective friction coefficient :math:`\mu' = \mu_* - \alpha (1 - a/b)`.

    Notes
    -----
    The effective friction coefficient converts a small change in normal stress to an equivalent
    change in shear stress. The coefficient is smaller than :math:`\mu_*` because a decrease in
    normal stress also increases the state variable.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940, for alpha.
    """
    return mu_star - alpha * (1.0 - 1.0 / b_over_a) if alpha else mu_star


def compute_state_offset_at_instability(law_exponent: float, stiffness_ratio: float) -> float:
    r"""Compute the offset of the state from steady state at the onset of instability.

    Parameters
    ----------
    law_exponent : float
        Exponent of the family of laws, from 0 (slip law) to 1 (slowness law).
    stiffness_ratio : float
        Stiffness ratio :math:`k/k_{cr}`.

    Returns
    -------
    float
        Offset :math:`u = \Theta/b + \ln V` that solves :math:`h(u) = -k/k_{cr}` with
        :math:`h(u) = [\exp(-\epsilon u) - 1]/\epsilon`. At this offset from steady state, friction
        decreases with slip as fast as the spring stress. The offset is infinite if the equation for
        :math:`u` has no solution.
    """
    product = law_exponent * stiffness_ratio
    if product >= 1.0:
        return math.inf
    return -math.log1p(-product) / law_exponent if law_exponent else stiffness_ratio


def compute_state_offset_after_stress_fall(
    mu_star: float, a: float, b_over_a: float, alpha: float, normal_stress_ratio: float
) -> float:
    r"""Compute the offset of the state from steady state after a drop of normal stress.

    Parameters
    ----------
    mu_star : float
        Friction coefficient :math:`\mu_*` at the reference velocity.
    a : float
        Parameter of the direct effect.
    b_over_a : float
        Ratio :math:`b/a`.
    alpha : float
        Coefficient of the effect of normal stress on the state variable.
    normal_stress_ratio : float
        Ratio :math:`q = \sigma_*/\sigma` of the normal stress before the drop to the normal stress
        after the drop.

    Returns
    -------
    float
        Offset :math:`u = \Theta/b + \ln V`.

    Notes
    -----
    For steady sliding at :math:`V_*` before the drop,

    .. math:: u = \frac{\mu_* (q - 1)}{a} - \alpha \left(\frac{1}{a} - \frac{1}{b}\right) \ln q.
    """
    taken = alpha * (1.0 - 1.0 / b_over_a) * math.log(normal_stress_ratio)
    return (mu_star * (normal_stress_ratio - 1.0) - taken) / a


def compute_critical_normal_stress_step(
    mu_star: float,
    a: float,
    b_over_a: float,
    alpha: float,
    law_exponent: float,
    stiffness_ratio: float,
) -> float:
    r"""Compute the critical drop of normal stress for the slip-to-slowness laws.

    Parameters
    ----------
    mu_star : float
        Friction coefficient :math:`\mu_*` at the reference velocity.
    a : float
        Parameter of the direct effect.
    b_over_a : float
        Ratio :math:`b/a`.
    alpha : float
        Coefficient of the effect of normal stress on the state variable.
    law_exponent : float
        Exponent of the family of laws, from 0 (slip law) to 1 (slowness law).
    stiffness_ratio : float
        Stiffness ratio :math:`k/k_{cr}`.

    Returns
    -------
    float
        Critical change in the imposed normal stress in units of :math:`\sigma_*`, a negative
        number. The result is NaN if no drop of normal stress causes an instability.

    Notes
    -----
    While the load point does not move, the offset :math:`u` from steady state obeys
    :math:`du/d\delta = (1 - b/a) [h(u) + q k/k_{cr}]/D_c` with
    :math:`h(u) = [\exp(-\epsilon u) - 1]/\epsilon`. If the offset after the drop exceeds the root
    of :math:`h(u) = -q k/k_{cr}`, the slip rate grows without bound. The function searches for the
    smallest drop of normal stress after which the offset reaches this root.
    """

    def excess_over_threshold(growth: float) -> float:
        quotient = 1.0 + growth
        needed = compute_state_offset_at_instability(law_exponent, quotient * stiffness_ratio)
        return (
            compute_state_offset_after_stress_fall(mu_star, a, b_over_a, alpha, quotient) - needed
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
        compute_critical_velocity_step,
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
        compute_critical_displacement_step,
        "Gu et al. (1984), slip law, constant normal stress, load point held",
    ),
    "displacement_step_of_the_family": ClosedForm(
        "D_c a/(b-a) [-ln(1 - eps k/k_cr)]/(eps k/k_cr)",
        ("b_over_a", "law_exponent", "stiffness_ratio"),
        compute_critical_displacement_step,
        "h(u*) = -k/k_cr, constant normal stress, load point held, infinite norm",
    ),
    "velocity_step_of_the_family": ClosedForm(
        "V_0/V_* = 1 + a/[(1 - eps)(b-a)]",
        ("b_over_a", "law_exponent"),
        compute_critical_velocity_step,
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
