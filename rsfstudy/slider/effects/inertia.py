"""Inertia: the mass of the slider, through its period of free oscillation T."""

from __future__ import annotations

import math


def inertial_time(period: float, reference_rate: float) -> float:
    """Time scale of inertia in units of D_c/V_*: ``T V_*/(2 pi D_c)``.

    Slip rate in V_* times this number is the quantity the instability norm is compared with.
    """
    return period * reference_rate / (2.0 * math.pi)


def acceleration(spring: float, friction: float, stiffness: float, norm: float) -> float:
    """Growth of ln V per inertial time: ``(f - g)/(K w)``.

    The equation of motion m d2(delta)/dt2 = k (delta_0 - delta) - tau, with m/k = (T/2 pi)**2.

    Parameters
    ----------
    spring, friction : float
        Deviations f and g of spring stress and of frictional resistance from tau_*, over sigma_*.
    stiffness : float
        K = k D_c/sigma_*.
    norm : float
        w = V T/(2 pi D_c).
    """
    return (spring - friction) / (stiffness * norm)


def inertial_resistance(
    growth: float, stiffness: float, norm: float, load_norm: float, most: float
) -> float:
    """Part of the spring stress that accelerates the mass, to first order in inertia:
    ``K w (w + w_0) dx``.

    With the quasi-static growth dx of ln V it moves the quasi-static form onto the slow manifold of
    the full equations, with an error of order w**4.

    Parameters
    ----------
    growth : float
        Quasi-static growth of ln V per unit of combined displacement (slip and load point).
    stiffness : float
        K = k D_c/sigma_*.
    norm, load_norm : float
        w and w_0: T/(2 pi D_c) times the slip rate, and times the load point velocity.
    most : float
        Bound of the result: far more than the motion meets before it leaves the slow manifold, so
        that trial steps beyond keep their sense of direction.
    """
    return max(-most, min(stiffness * norm * (norm + load_norm) * growth, most))
