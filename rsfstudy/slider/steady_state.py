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


def critical_stiffness_explicit(
    log_rate: float, mu_star: float, a: float, b: float, cot_phi: float, alpha: float
) -> float:
    """The same as an explicit function of V: ``k_cr = (b - a) sigma_* (1 - mu_* cot(phi)) / {D_c
    (1 - mu_ss cot(phi)) [1 - (mu_ss - alpha) cot(phi)]}`` (He et al. 1998).
    """
    mu_ss = steady_friction(log_rate, mu_star, a, b)
    above = (b - a) * (1.0 - mu_star * cot_phi)
    return above / ((1.0 - mu_ss * cot_phi) * (1.0 - (mu_ss - alpha) * cot_phi))


def rise_by_mass(
    critical: float, norm: float, mu_ss: float, sigma_ss: float, a: float, cot_phi: float
) -> float:
    """How much mass raises the critical stiffness, as a fraction; ``math.inf`` where sliding is
    unstable at every stiffness.

    Small perturbations of steady sliding obey, per time D_c/V with M = K w**2,

        E M p**3 + (D M + a sigma_ss) p**2 + [E K - (b-a) sigma_ss] p + D K = 0,
        D = 1 - mu_ss cot(phi),  E = D + alpha cot(phi),

    which has purely imaginary roots at K = K_cr/(1 - q) with q = K_cr D w**2/(a sigma_ss): q/(1-q)
    is the rise.

    Parameters
    ----------
    critical : float
        Critical stiffness without mass, K_cr, times D_c/sigma_*.
    norm : float
        w = V T/(2 pi D_c) of steady sliding.
    mu_ss, sigma_ss : float
        Steady-state friction coefficient, and normal stress over sigma_*.
    a, cot_phi : float
        Direct effect parameter; cotangent of the driving angle.
    """
    share = critical * (1.0 - mu_ss * cot_phi) * norm**2 / (a * sigma_ss)
    return share / (1.0 - share) if share < 1.0 else math.inf


def lowest_log_rate(mu_star: float, a: float, b: float, cot_phi: float) -> float:
    """Smallest ln(V/V_*) with a steady state: where phi = atan(mu_ss); ``-inf`` at constant normal
    stress.
    """
    if cot_phi == 0.0:
        return -math.inf
    return -(1.0 / cot_phi - mu_star) / (b - a)
