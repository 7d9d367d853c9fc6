"""Radiation damping: waves carry stress away in proportion to slip rate (quasi-dynamic motion)."""

from __future__ import annotations

import math
from collections.abc import Callable

_MOST_ITERATIONS = 200
_SETTLED = 1e-15
#: ln V beyond which only trial steps look for a balance: radiation would be 10^300 eta.
_FASTEST = 690.0

#: g -> (strength, d strength/dg, Psi - Theta)
Strength = Callable[[float], tuple[float, float, float]]


def radiated(log_rate: float, damping: float) -> float:
    """Stress that waves carry away, over sigma_*: ``eta (V - V_*)``, so that it vanishes at V_*.

    Parameters
    ----------
    log_rate : float
        ln(V/V_*).
    damping : float
        eta V_*/sigma_*; for an elastic half-space eta = G/(2 c_s).

    References
    ----------
    Rice (1993), J. Geophys. Res. 98, 9885-9907.
    """
    return damping * math.expm1(log_rate)


def balanced_rate(
    spring: float, psi: float, strength: Strength, a: float, damping: float
) -> tuple[float, float]:
    """ln(V/V_*) at which friction and radiation together balance the spring, and the frictional
    stress there.

    Solves ``strength(f - eta (V - 1)) = a ln V + Psi`` by Newton's method. The left side falls with
    V and the right side grows, so there is one root, which bisection keeps in its bracket where
    Newton's steps would leave it or shrink too slowly.

    Parameters
    ----------
    spring : float
        Deviation f of spring stress from tau_*, over sigma_*.
    psi : float
        State freed of normal stress.
    strength : callable
        ``g -> (strength, slope, shift)`` of the scene.
    a : float
        Direct effect parameter.
    damping : float
        eta V_*/sigma_*.
    """
    # slip backwards is no part of it: radiation is at least -eta, which bounds ln V from above
    low, high = -math.inf, min((strength(spring + damping)[0] - psi) / a, _FASTEST)
    # a good guess where radiation takes most of the stress
    x = min(high, math.log(max(a * high / damping, 1.0))) if high > 0.0 else high
    before = math.inf
    for _ in range(_MOST_ITERATIONS):
        friction = spring - radiated(x, damping)
        value, slope, _shift = strength(friction)
        missing = value - psi - a * x
        low, high = (x, high) if missing > 0.0 else (low, x)
        change = missing / (a + slope * damping * math.exp(x))
        if abs(change) <= _SETTLED * (1.0 + abs(x)):
            break
        # where normal stress is nearly lost, slopes are so steep that Newton's steps lead nowhere
        slow = abs(change) > 0.5 * abs(before)
        before = change
        if slow or not low < x + change <= high:
            before = math.inf
            x = 0.5 * (max(low, high - 1e3) + high)
        else:
            x += change
    return x, spring - radiated(x, damping)


def critical_stiffness(
    undamped: float,
    load_damping: float,
    mu_ss: float,
    alpha: float,
    cot_phi: float,
) -> float:
    """Critical stiffness with radiation damping, times D_c/sigma_*: ``K_cr - eta V D/E``.

    D = 1 - mu_ss cot(phi) and E = D + alpha cot(phi).

    Perturbations of steady sliding obey ``(a sigma + eta V E) p**2 + [E K + eta V D - (b-a) sigma]
    p + D K = 0`` per time D_c/V. Zero or less means that sliding is stable at every stiffness.

    Parameters
    ----------
    undamped : float
        The same without damping.
    load_damping : float
        eta V/sigma_* at the load point velocity.
    mu_ss, alpha, cot_phi : float
        Steady-state friction; normal stress effect; cotangent of the driving angle.
    """
    steadiness = 1.0 - mu_ss * cot_phi
    return undamped - load_damping * steadiness / (steadiness + alpha * cot_phi)
