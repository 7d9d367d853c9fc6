"""The one relation between frictional stress, slip rate and state, on which everything rests.

With g = (tau - tau_*)/sigma_*, the deviation of frictional stress, s = sigma/sigma_*, and the state
freed of stress, Psi = Theta + shift(g),

    a ln(V/V_*) + Psi = strength(g),    strength(g) = (mu_* + g)/s(g) - mu_* + shift(g),

which is tau = sigma (mu_* + a ln(V/V_*) + Theta), and nothing else. The shift is what stress takes
from the state variable, such as alpha ln s. Psi is continuous across any sudden change of stress,
and dPsi/dt is the evolution law alone.

Each form gives (strength, its slope, shift, its slope) at g; a scene is given the plainest form
that holds all its effects.
"""

from __future__ import annotations

from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import MU_STAR, normal_stress, other_state_effect, state_effect

Relation = tuple[float, float, float, float]


def plain(friction: float, p: Numbers) -> Relation:
    """Constant normal stress, and a state that stress does not change: strength is g itself."""
    return friction, 1.0, 0.0, 0.0


def coupled(friction: float, p: Numbers) -> Relation:
    """Normal stress that varies with shear stress."""
    excess, change = normal_stress(friction, p)
    value, slope = coefficient(friction, excess, change, p)
    return value, slope, 0.0, 0.0


def coupled_with_state_effect(friction: float, p: Numbers) -> Relation:
    """The same, and a state that stress changes."""
    excess, change = normal_stress(friction, p)
    value, slope = coefficient(friction, excess, change, p)
    shift, shift_slope = state_effect(friction, 1.0 + excess, change, p)
    return value + shift, slope + shift_slope, shift, shift_slope


def plain_with_state_effect(friction: float, p: Numbers) -> Relation:
    """Constant normal stress, and a state that shear stress changes."""
    shift, shift_slope = state_effect(friction, 1.0, 0.0, p)
    return friction + shift, 1.0 + shift_slope, shift, shift_slope


def both_state_effects(
    friction: float, ratio: float, change: float, p: Numbers
) -> tuple[float, float]:
    """Two effects of stress on the state at once."""
    shift, slope = state_effect(friction, ratio, change, p)
    other, other_slope = other_state_effect(friction, ratio, change, p)
    return shift + other, slope + other_slope


def coefficient(friction: float, excess: float, change: float, p: Numbers) -> tuple[float, float]:
    """``tau/sigma - mu_*`` and its derivative with respect to g, at s = 1 + `excess`.

    Written so that digits are kept where s is proportional to g, however large it is: with the bend
    s - 1 - s' g, ``[g (1 - mu_* s') - mu_* bend]/s`` and ``(1 - mu_* s' + bend)/s**2``.
    """
    ratio, mu_star = 1.0 + excess, p[MU_STAR]
    bend = excess - change * friction
    support = 1.0 - mu_star * change
    return (friction * support - mu_star * bend) / ratio, (support + bend) / ratio**2
