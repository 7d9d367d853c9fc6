"""Friction: what ties stress, slip rate and states together. Read this first, then
`states` and `scene_functions`.

With g = (tau - tau_*)/sigma_*, the deviation of frictional stress, s = sigma/sigma_*, and the state
freed of stress, Psi = Theta + shift(g),

    a ln(V/V_*) + Psi = strength(g),    strength(g) = (mu_* + g)/s(g) - mu_* + shift(g),

which is tau = sigma (mu_* + a ln(V/V_*) + Theta), and nothing else. The shift is what stress takes
from the state variable, such as alpha ln s. Psi is continuous across any sudden change of stress,
and dPsi/dt is the evolution law alone. Of a law with several states, Psi is the sum of all.

Pore pressure P, over sigma_*, takes from normal stress: s = sigma/sigma_* - P is what friction and
the effects of stress on the state know of it. P stands last among the states, behind those of the
law, which alone are part of Theta. What a loading goes on imposing is the same with a P of its own;
the pressure that it imposes around a fluid stands first behind the law.

A load point that runs ahead of its mean motion by D imposes shear stress K D. Of such a scene f and
g are those without it, which friction, and it alone, adds: mass and waves know of f - g.

Functions here take the functions of the parts of a scene, and return one that is made of them: the
plainest that holds all effects there are. What they return takes floats, and the numbers of a scene
as ``p`` (see `parameter_layout`); it holds none of them, and serves every scene of the same parts.
"""

from __future__ import annotations

import math
from functools import cache, reduce
from typing import NamedTuple

from rsfstudy._deprecation import renamed_members
from rsfstudy.slider.parameter_layout import (
    LARGEST_NORMAL_STRESS_EXCESS,
    LOADING,
    MU_STAR,
    SMALLEST_NORMAL_STRESS_EXCESS,
    STRESS_DEPENDENCE,
    A,
)
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.state_functions import (
    append_auxiliary_evolutions,
    append_auxiliary_steady_states,
    build_state_contribution_function,
    build_states_from_strength_function,
    build_sum_function,
)

#: Friction coefficient below which none is told from zero, where slip reverses.
_MIN_NONZERO_FRICTION_COEFFICIENT = 1e-280


@renamed_members
class FrictionFunctions(NamedTuple):
    """The functions of friction.

    Attributes
    ----------
    strength : callable
        ``(g, psis, p) -> (strength, its slope, shift, its slope)``, slopes being derivatives with
        respect to g. The first of the states may be missing.
    effective_normal_stress, rig_normal_stress : callable
        ``(g, psis, p) -> (s - 1, its slope)`` of effective normal stress, and of normal stress less
        the pore pressure outside the fault, which is what a rig knows of.
    boundary_pressure : callable
        ``(psis) -> P`` outside the fault.
    evolutions : callable
        ``(log_slip_rate, psis, shift, fraction, p)``: changes of all states per unit slip in D_c,
        times a fraction.
    steady_states : callable
        ``(log_slip_rate, shift, p)``: all states in steady sliding.
    state_sum : callable
        ``(psis) -> Psi``, the sum of the states of the law.
    state_contribution : callable
        ``(changes, g, psis, p)``: what changes of the states take from a ln(V/V_*), so that
        ``a d ln V = strength'(g) dg - state_contribution``.
    pressure_derivatives : callable
        ``(g, psis, p)``: derivatives of strength and of shift with respect to P.
    states_from_strength : callable
        ``(strength, log_slip_rate, others, p)``: all states; the first is what the others leave.
    load_point_stress : callable
        ``(psis, p) -> K D`` that is no part of g, and
    load_point_stress_change : callable
        its change, ``(changes)``.
    state_count : int
        How many states there are.
    indices_of_states_in_distance : tuple of int
        Places of the states that count for the distance from steady sliding.
    """

    strength: Function
    effective_normal_stress: Function
    rig_normal_stress: Function
    boundary_pressure: Function
    evolutions: Function
    steady_states: Function
    state_sum: Function
    state_contribution: Function
    pressure_derivatives: Function
    states_from_strength: Function
    load_point_stress: Function
    load_point_stress_change: Function
    state_count: int
    indices_of_states_in_distance: tuple[int, ...]


# ---- the friction relation -----------------------------------------------------------------------


def zero_normal_stress_excess(frictional_stress: float, p: Numbers) -> tuple[float, float]:
    """No excess of normal stress over its reference value, and no slope."""
    return 0.0, 0.0


@cache
def build_effective_normal_stress_function(
    total_normal_stress_function: Function, pressure_index: int
) -> Function:
    """``(g, psis, p) -> (s - 1, its slope)``, made of ``(g, p) -> (sigma/sigma_* - 1, its slope)``
    and the pore pressure at a place among the states, from their end; 0 where there is none.
    """

    def total_normal_stress(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        return total_normal_stress_function(g, p)

    def effective_normal_stress(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        excess, change = total_normal_stress_function(g, p)
        return min(
            max(excess - psis[pressure_index], SMALLEST_NORMAL_STRESS_EXCESS),
            LARGEST_NORMAL_STRESS_EXCESS,
        ), change

    return effective_normal_stress if pressure_index else total_normal_stress


@cache
def build_pressure_function(pressure_index: int) -> Function:
    """``(psis) -> P`` at a place; 0 where there is none."""

    def pressure(psis: Numbers) -> float:
        return psis[pressure_index]

    return pressure if pressure_index else zero_pressure


def zero_pressure(states: Numbers) -> float:
    """P where there is none."""
    return 0.0


FrictionRelationValues = tuple[float, float, float, float]


def friction_relation_at_constant_normal_stress(
    frictional_stress: float, states: Numbers, p: Numbers
) -> FrictionRelationValues:
    """The friction relation at constant normal stress, of a state that stress does not change."""
    return frictional_stress, 1.0, 0.0, 0.0


def zero_state_effect(
    frictional_stress: float,
    normal_stress_ratio: float,
    normal_stress_derivative: float,
    p: Numbers,
) -> tuple[float, float]:
    """The shift and its slope where stress does not change the state."""
    return 0.0, 0.0


def build_strength_function(
    normal_stress_function: Function, state_effect_function: Function
) -> Function:
    """The friction relation ``(g, psis, p) -> (strength, its slope, shift, its slope)``, of normal
    stress that changes, and of the effect of stress on the state.

    ``tau/sigma - mu_*`` keeps its digits where s is proportional to g, however large it is: with
    the bend s - 1 - s' g it is ``[g (1 - mu_* s') - mu_* bend]/s``, its derivative with respect to
    g ``(1 - mu_* s' + bend)/s**2``.
    """

    def strength(g: float, psis: Numbers, p: Numbers) -> FrictionRelationValues:
        excess, change = normal_stress_function(g, psis, p)
        ratio, mu_star = 1.0 + excess, p[MU_STAR]
        bend, support = excess - change * g, 1.0 - mu_star * change
        value, slope = (g * support - mu_star * bend) / ratio, (support + bend) / (ratio * ratio)
        shift, shift_slope = state_effect_function(g, ratio, change, p)
        return value + shift, slope + shift_slope, shift, shift_slope

    return strength


def shear_stress_effect_on_state(
    frictional_stress: float,
    normal_stress_ratio: float,
    normal_stress_derivative: float,
    p: Numbers,
) -> tuple[float, float]:
    """State variable lost to the present shear stress, and its derivative.

    ``dTheta = -c dtau/sigma`` integrates to a shift of ``c g ln(s)/(s - 1)`` where the normal
    stress ratio s changes in proportion to g, and of c g where it does not change.

    References
    ----------
    Nagata, Nakatani and Yoshida (2012), J. Geophys. Res. 117, B02314.
    """
    excess, c = normal_stress_ratio - 1.0, p[STRESS_DEPENDENCE]
    mean = math.log1p(excess) / excess if excess != 0.0 else 1.0
    return c * frictional_stress * mean, c / normal_stress_ratio


def sum_state_effects(first_effect: Function, second_effect: Function) -> Function:
    """Two effects of stress on the state at once: ``(g, ratio, change, p) -> (shift, slope)``."""

    def combined_effect(g: float, ratio: float, change: float, p: Numbers) -> tuple[float, float]:
        shift, slope = first_effect(g, ratio, change, p)
        other_shift, other_slope = second_effect(g, ratio, change, p)
        return shift + other_shift, slope + other_slope

    return combined_effect


def make_slip_reversible(forward_relation: Function) -> Function:
    """The relation of slip that may reverse, of that of slip forward: ln(V/V_*) is that of the
    magnitude of V.

    ``V = 2 V_* exp[-(mu_* + Theta)/a] sinh[tau/(a sigma)]`` has the sign of tau and reads

        a ln(|V|/V_*) = |tau|/sigma + a ln[1 - exp(-2 |tau|/(a sigma))] - mu_* - Theta,

    which differs from slip forward by exp(-2 mu/a), 10^-46 of it.

    References
    ----------
    Rice and Ben-Zion (1996), Proc. Natl. Acad. Sci. 93, 3811-3818.
    """

    def reversible_relation(g: float, psis: Numbers, p: Numbers) -> FrictionRelationValues:
        forward, slope, shift, shift_slope = forward_relation(g, psis, p)
        a, mu_star = p[A], p[MU_STAR]
        coefficient_now = mu_star + forward - shift
        size = max(abs(coefficient_now), _MIN_NONZERO_FRICTION_COEFFICIENT)
        value = size + a * math.log(-math.expm1(-2.0 * size / a)) - mu_star + shift
        steeper = math.copysign(1.0 / math.tanh(size / a), coefficient_now)
        return value, (slope - shift_slope) * steeper + shift_slope, shift, shift_slope

    return reversible_relation


def build_pressure_derivatives_function(
    normal_stress_function: Function, state_effect_function: Function
) -> Function:
    """Derivatives of strength, ``(mu_* + g)/s**2`` and that of the shift, and of the shift with
    respect to P, at constant frictional stress.

    By the chain rule, the shift has its slope along a change of normal stress of -1 less that along
    none.
    """

    def pressure_derivatives(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        ratio = 1.0 + normal_stress_function(g, psis, p)[0]
        along = state_effect_function(g, ratio, -1.0, p)[1]
        shift = along - state_effect_function(g, ratio, 0.0, p)[1]
        return (p[MU_STAR] + g) / ratio**2 + shift, shift

    return pressure_derivatives


def zero_load_point_stress(states: Numbers, p: Numbers) -> float:
    """K D where the load point moves steadily."""
    return 0.0


def load_point_stress(states: Numbers, p: Numbers) -> float:
    """K D of an oscillation, which begins where D is 0."""
    return states[-1] - p[LOADING + 2]


def wrap_with_load_point_stress(friction_function: Function) -> Function:
    """A function ``(g, psis, p)`` of frictional stress, of g without `load_point_stress`."""

    def function_with_load_point_stress(g: float, psis: Numbers, p: Numbers) -> Numbers:
        return friction_function(g + load_point_stress(psis, p), psis, p)

    return function_with_load_point_stress


def build_load_point_derivatives_function(strength_function: Function) -> Function:
    """Derivatives of strength and of the shift with respect to K D, which are those by g."""

    def load_point_derivatives(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        _value, slope, _shift, shift_slope = strength_function(g, psis, p)
        return slope, shift_slope

    return load_point_derivatives


# ---- all of it -----------------------------------------------------------------------------------


class FrictionTerms(NamedTuple):
    """Friction as the parts of a scene state it (see their bases): functions, and how many states a
    law has and what may change normal stress beside shear stress.

    Attributes
    ----------
    law_state_count : int
        How many states the law has.
    evolutions, steady_states : callable
        Of the law.
    state_effects : tuple of callable
        By how much stress lowers the state: of normal stress, of the law, of shear stress.
    allows_reversed_slip : bool
        Whether slip may reverse.
    normal_stress : callable or None
        Of the case of normal stress.
    auxiliary_unknown_count : int
        How many states end in P.
    auxiliary_rates, auxiliary_steady_states : callable or None
        Theirs: auxiliary rates, and what they are in steady sliding.
    boundary_pressure_index : int
        Place of the pressure outside the fault, which a rig knows of, among all states and from
        their end: -1 where P is that; 0 where there is none.
    has_load_point_unknown : bool
        Whether the unknown that stands last is shear stress K D, and no pressure.
    state_indices_excluded_from_distance : tuple of int
        Places, among all states, of those that do not count for the distance from steady sliding.
    """

    law_state_count: int
    evolutions: Function
    steady_states: Function
    state_effects: tuple[Function, ...]
    allows_reversed_slip: bool
    normal_stress: Function | None
    auxiliary_unknown_count: int
    auxiliary_rates: Function | None
    auxiliary_steady_states: Function | None
    boundary_pressure_index: int
    has_load_point_unknown: bool = False
    state_indices_excluded_from_distance: tuple[int, ...] = ()


@cache
def build_friction_functions(friction_terms: FrictionTerms) -> FrictionFunctions:
    """Friction, made of what the parts of a scene say of it."""
    effect = (
        reduce(sum_state_effects, friction_terms.state_effects)
        if friction_terms.state_effects
        else zero_state_effect
    )
    pressure, outside = (
        friction_terms.auxiliary_unknown_count > 0 and not friction_terms.has_load_point_unknown,
        friction_terms.boundary_pressure_index,
    )
    total = friction_terms.normal_stress or zero_normal_stress_excess
    effective, outer = (
        build_effective_normal_stress_function(total, -1 if pressure else 0),
        build_effective_normal_stress_function(total, outside),
    )
    changes = (
        pressure or total is not zero_normal_stress_excess or len(friction_terms.state_effects) > 0
    )
    strength = (
        build_strength_function(effective, effect)
        if changes
        else friction_relation_at_constant_normal_stress
    )
    if friction_terms.allows_reversed_slip:
        strength = make_slip_reversible(strength)
    evolutions, steady_states = friction_terms.evolutions, friction_terms.steady_states
    if (
        friction_terms.auxiliary_rates is not None
        and friction_terms.auxiliary_steady_states is not None
    ):
        evolutions = append_auxiliary_evolutions(
            evolutions, friction_terms.auxiliary_rates, friction_terms.law_state_count
        )
        steady_states = append_auxiliary_steady_states(
            steady_states, friction_terms.auxiliary_steady_states
        )
    by_last = build_pressure_derivatives_function(effective, effect) if pressure else None
    states = friction_terms.law_state_count + friction_terms.auxiliary_unknown_count
    if friction_terms.has_load_point_unknown:
        strength, effective, outer = map(wrap_with_load_point_stress, (strength, effective, outer))
        by_last = build_load_point_derivatives_function(strength)
    return FrictionFunctions(
        strength=strength,
        effective_normal_stress=effective,
        rig_normal_stress=outer,
        boundary_pressure=build_pressure_function(outside),
        evolutions=evolutions,
        steady_states=steady_states,
        state_sum=build_sum_function(friction_terms.law_state_count),
        state_contribution=build_state_contribution_function(
            friction_terms.law_state_count, by_last
        ),
        pressure_derivatives=by_last or build_pressure_derivatives_function(effective, effect),
        states_from_strength=build_states_from_strength_function(friction_terms.law_state_count),
        load_point_stress=load_point_stress
        if friction_terms.has_load_point_unknown
        else zero_load_point_stress,
        load_point_stress_change=build_pressure_function(
            -1 if friction_terms.has_load_point_unknown else 0
        ),
        state_count=states,
        indices_of_states_in_distance=tuple(
            place
            for place in range(states)
            if place not in friction_terms.state_indices_excluded_from_distance
        ),
    )
