"""The one relation between frictional stress, slip rate and state, on which everything rests.

With g = (tau - tau_*)/sigma_*, the deviation of frictional stress, s = sigma/sigma_*, and the state
freed of stress, Psi = Theta + shift(g),

    a ln(V/V_*) + Psi = strength(g),    strength(g) = (mu_* + g)/s(g) - mu_* + shift(g),

which is tau = sigma (mu_* + a ln(V/V_*) + Theta), and nothing else. The shift is what stress takes
from the state variable, such as alpha ln s. Psi is continuous across any sudden change of stress,
and dPsi/dt is the evolution law alone.

Each form gives (strength, its slope, shift, its slope) at g; a scene is given the plainest form
that holds all its effects. Those here do not depend on the states they are told: `saturated` has
those that do, by pore pressure.
"""

from __future__ import annotations

import math

from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import (
    MU_STAR,
    STRESS_DEPENDENCE,
    A,
    normal_stress,
    one_way,
    other_state_effect,
    state_effect,
)

Relation = tuple[float, float, float, float]

#: Friction coefficient below which none is told from zero, where slip reverses.
_LEAST = 1e-280


def plain(friction: float, psis: Numbers, p: Numbers) -> Relation:
    """Constant normal stress, and a state that stress does not change: strength is g itself."""
    return friction, 1.0, 0.0, 0.0


def coupled(friction: float, psis: Numbers, p: Numbers) -> Relation:
    """Normal stress that varies with shear stress."""
    excess, change = normal_stress(friction, p)
    value, slope = coefficient(friction, excess, change, p)
    return value, slope, 0.0, 0.0


def coupled_with_state_effect(friction: float, psis: Numbers, p: Numbers) -> Relation:
    """The same, and a state that stress changes."""
    excess, change = normal_stress(friction, p)
    value, slope = coefficient(friction, excess, change, p)
    shift, shift_slope = state_effect(friction, 1.0 + excess, change, p)
    return value + shift, slope + shift_slope, shift, shift_slope


def plain_with_state_effect(friction: float, psis: Numbers, p: Numbers) -> Relation:
    """Constant normal stress, and a state that shear stress changes."""
    shift, shift_slope = state_effect(friction, 1.0, 0.0, p)
    return friction + shift, 1.0 + shift_slope, shift, shift_slope


def reversible(friction: float, psis: Numbers, p: Numbers) -> Relation:
    """The relation of slip that may reverse: ln(V/V_*) is that of the magnitude of V.

    ``V = 2 V_* exp[-(mu_* + Theta)/a] sinh[tau/(a sigma)]`` has the sign of tau and reads

        a ln(|V|/V_*) = |tau|/sigma + a ln[1 - exp(-2 |tau|/(a sigma))] - mu_* - Theta,

    which differs from slip forward by exp(-2 mu/a), 10^-46 of it.

    References
    ----------
    Rice and Ben-Zion (1996), Proc. Natl. Acad. Sci. 93, 3811-3818.
    """
    forward, slope, shift, shift_slope = one_way(friction, psis, p)
    a, mu_star = p[A], p[MU_STAR]
    coefficient_now = mu_star + forward - shift
    size = max(abs(coefficient_now), _LEAST)
    value = size + a * math.log(-math.expm1(-2.0 * size / a)) - mu_star + shift
    steeper = math.copysign(1.0 / math.tanh(size / a), coefficient_now)
    return value, (slope - shift_slope) * steeper + shift_slope, shift, shift_slope


def both_state_effects(
    friction: float, ratio: float, change: float, p: Numbers
) -> tuple[float, float]:
    """Two effects of stress on the state at once."""
    shift, slope = state_effect(friction, ratio, change, p)
    other, other_slope = other_state_effect(friction, ratio, change, p)
    return shift + other, slope + other_slope


def stress_dependence(
    friction: float, ratio: float, change: float, p: Numbers
) -> tuple[float, float]:
    """State variable lost to the present shear stress, and its derivative.

    ``dTheta = -c dtau/sigma`` integrates to a shift of ``c g ln(s)/(s - 1)`` where the normal
    stress ratio s changes in proportion to g, and of c g where it does not change.

    References
    ----------
    Nagata, Nakatani and Yoshida (2012), J. Geophys. Res. 117, B02314.
    """
    excess, c = ratio - 1.0, p[STRESS_DEPENDENCE]
    mean = math.log1p(excess) / excess if excess != 0.0 else 1.0
    return c * friction * mean, c / ratio


def coefficient(friction: float, excess: float, change: float, p: Numbers) -> tuple[float, float]:
    """``tau/sigma - mu_*`` and its derivative with respect to g, at s = 1 + `excess`.

    Written so that digits are kept where s is proportional to g, however large it is: with the bend
    s - 1 - s' g, ``[g (1 - mu_* s') - mu_* bend]/s`` and ``(1 - mu_* s' + bend)/s**2``.
    """
    ratio, mu_star = 1.0 + excess, p[MU_STAR]
    bend = excess - change * friction
    support = 1.0 - mu_star * change
    return (friction * support - mu_star * bend) / ratio, (support + bend) / ratio**2
