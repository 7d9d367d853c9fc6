"""Forms of the friction relation and of the states for a fault whose pores hold a fluid, or whose
normal stress a loading goes on changing.

Pore pressure P, over sigma_*, takes from normal stress: s = sigma/sigma_* - P is what friction and
the effects of stress on the state know of it. P stands last among the states, behind those of the
law, which alone are part of Theta. What a loading imposes is the same with a P of its own.
"""

from __future__ import annotations

from rsfstudy.slider.friction import Relation, coefficient
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import (
    LARGEST_RATIO,
    MU_STAR,
    SMALLEST_RATIO,
    effective_stress,
    evolutions_of_law,
    normal_stress,
    resting_of_law,
    seepage,
    seeped,
    state_effect,
    strength_of_pressure,
)

#: How many of the states are those of the law.
OF_LAW = 1


def less_pressure(friction: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
    """Effective normal stress less 1, and its derivative with respect to frictional stress."""
    excess, change = normal_stress(friction, p)
    return min(max(excess - psis[-1], SMALLEST_RATIO - 1.0), LARGEST_RATIO), change


def less_pressure_change(
    friction: float, friction_change: float, changes: Numbers, p: Numbers
) -> float:
    """Its change where frictional stress and the states change so."""
    return normal_stress(friction, p)[1] * friction_change - changes[-1]


def strength(friction: float, psis: Numbers, p: Numbers) -> Relation:
    """The friction relation."""
    excess, change = effective_stress(friction, psis, p)
    value, slope = coefficient(friction, excess, change, p)
    return value, slope, 0.0, 0.0


def strength_with_state_effect(friction: float, psis: Numbers, p: Numbers) -> Relation:
    """The same, and a state that effective stress changes."""
    excess, change = effective_stress(friction, psis, p)
    value, slope = coefficient(friction, excess, change, p)
    shift, shift_slope = state_effect(friction, 1.0 + excess, change, p)
    return value + shift, slope + shift_slope, shift, shift_slope


def by_pressure(friction: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
    """Derivatives of strength and of the shift with respect to P, at constant frictional stress."""
    ratio = 1.0 + effective_stress(friction, psis, p)[0]
    return (p[MU_STAR] + friction) / ratio**2, 0.0


def by_pressure_with_state_effect(
    friction: float, psis: Numbers, p: Numbers
) -> tuple[float, float]:
    """The same, and a state that effective stress changes: by the chain rule, its slope along a
    change of normal stress of -1 less that along none.
    """
    ratio = 1.0 + effective_stress(friction, psis, p)[0]
    along = state_effect(friction, ratio, -1.0, p)[1]
    shift = along - state_effect(friction, ratio, 0.0, p)[1]
    return (p[MU_STAR] + friction) / ratio**2 + shift, shift


def total(numbers: Numbers) -> float:
    """Sum of what the states of the law contribute."""
    together = 0.0
    for i in range(OF_LAW):
        together += numbers[i]
    return together


def felt(changes: Numbers, friction: float, psis: Numbers, p: Numbers) -> float:
    """What changes of the states take from a ln(V/V_*), less what the change of P gives:
    ``a d ln V = strength'(g) dg - felt``.
    """
    return total(changes) - strength_of_pressure(friction, psis, p)[0] * changes[-1]


def evolutions(log_rate: float, psis: Numbers, shift: float, share: float, p: Numbers) -> Numbers:
    """Evolution of the states of the law and of the fluid, per unit slip times a share."""
    return (
        *evolutions_of_law(log_rate, psis[:OF_LAW], shift, share, p),
        *seepage(log_rate, psis[OF_LAW:], share, p),
    )


def resting(log_rate: float, shift: float, p: Numbers) -> Numbers:
    """The states of steady sliding."""
    return (*resting_of_law(log_rate, shift, p), *seeped(log_rate, p))
