"""Steady sliding: friction and normal stress at a slip rate, and the critical stiffness around
it.
"""

from __future__ import annotations

import math


def steady_friction(log_rate: float, mu_star: float, a: float, b: float) -> float:
    """Steady-state friction coefficient ``mu_ss = mu_* - (b - a) ln(V/V_*)``."""
    return mu_star - (b - a) * log_rate


def steady_normal_stress(mu_ss: float, mu_star: float, cot_phi: float) -> float:
    """Steady-state normal stress over sigma_*: ``(1 - mu_* cot(phi))/(1 - mu_ss cot(phi))``.

    Follows from sigma = sigma_3 + tau cot(phi) with tau = mu_ss sigma and sigma_3 constant. It is
    positive and finite only while phi > atan(mu_ss); beyond that no steady state exists and
    ``math.inf`` is returned.
    """
    denominator = 1.0 - mu_ss * cot_phi
    return (1.0 - mu_star * cot_phi) / denominator if denominator > 0.0 else math.inf


def steady_shear_stress(mu_ss: float, mu_star: float, cot_phi: float) -> float:
    """Steady-state deviation of shear stress, ``(tau_ss - tau_*)/sigma_* = mu_ss sigma_ss/sigma_* -
    mu_*``.

    Written so that it is exact where mu_ss is close to mu_*: ``(mu_ss - mu_*)/(1 - mu_ss
    cot(phi))``.
    """
    return (mu_ss - mu_star) / (1.0 - mu_ss * cot_phi)


def critical_stiffness(
    log_rate: float, mu_star: float, a: float, b: float, cot_phi: float, alpha: float
) -> float:
    """Critical stiffness ``k_cr D_c/sigma_*`` of steady sliding at ln(V/V_*).

    ``k_cr = (b - a) sigma_ss / (D_c [1 - cot(phi) (mu_ss - alpha)])``; constant normal stress is
    cot(phi) = 0.

    References
    ----------
    Dieterich and Linker (1992), Geophys. Res. Lett. 19, 1691-1694; as a function of V, He et al.
    (1998).
    """
    mu_ss = steady_friction(log_rate, mu_star, a, b)
    sigma_ss = steady_normal_stress(mu_ss, mu_star, cot_phi)
    return (b - a) * sigma_ss / (1.0 - cot_phi * (mu_ss - alpha))


def lowest_log_rate(mu_star: float, a: float, b: float, cot_phi: float) -> float:
    """Smallest ln(V/V_*) with a steady state: where phi = atan(mu_ss); ``-inf`` at constant normal
    stress.
    """
    if cot_phi == 0.0:
        return -math.inf
    return -(1.0 / cot_phi - mu_star) / (b - a)
