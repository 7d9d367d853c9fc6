"""Friction: what ties stress, slip rate and states together. Read this first, then
`states` and `system`.

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
as ``p`` (see `places`); it holds none of them, and serves every scene of the same parts.
"""

from __future__ import annotations

import math
from functools import cache, reduce
from typing import NamedTuple

from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.places import (
    LARGEST_EXCESS,
    LOADING,
    MU_STAR,
    SMALLEST_EXCESS,
    STRESS_DEPENDENCE,
    A,
)
from rsfstudy.slider.states import (
    contribution_of,
    states_at_of,
    sum_of,
    with_auxiliary,
    with_auxiliary_at_rest,
)

#: Friction coefficient below which none is told from zero, where slip reverses.
_LEAST = 1e-280


class Friction(NamedTuple):
    """The functions of friction.

    Attributes
    ----------
    strength : callable
        ``(g, psis, p) -> (strength, its slope, shift, its slope)``, slopes being derivatives with
        respect to g. The first of the states may be missing.
    effective_stress, outer_stress : callable
        ``(g, psis, p) -> (s - 1, its slope)`` of effective normal stress, and of normal stress less
        the pore pressure outside the fault, which is what a rig knows of.
    outer_pressure : callable
        ``(psis) -> P`` outside the fault.
    evolutions : callable
        ``(log_slip_rate, psis, shift, fraction, p)``: changes of all states per unit slip in D_c,
        times a fraction.
    steady_states : callable
        ``(log_slip_rate, shift, p)``: all states in steady sliding.
    state_sum : callable
        ``(psis) -> Psi``, the sum of the states of the law.
    contribution : callable
        ``(changes, g, psis, p)``: what changes of the states take from a ln(V/V_*), so that
        ``a d ln V = strength'(g) dg - contribution``.
    by_pressure : callable
        ``(g, psis, p)``: derivatives of strength and of shift with respect to P.
    states_at : callable
        ``(strength, log_slip_rate, others, p)``: all states; the first is what the others leave.
    imposed : callable
        ``(psis, p) -> K D`` that is no part of g, and
    imposed_change : callable
        its change, ``(changes)``.
    states : int
        How many states there are.
    counted : tuple of int
        Places of the states that count for the distance from steady sliding.
    """

    strength: Function
    effective_stress: Function
    outer_stress: Function
    outer_pressure: Function
    evolutions: Function
    steady_states: Function
    state_sum: Function
    contribution: Function
    by_pressure: Function
    states_at: Function
    imposed: Function
    imposed_change: Function
    states: int
    counted: tuple[int, ...]


# ---- the friction relation -----------------------------------------------------------------------


def constant(g: float, p: Numbers) -> tuple[float, float]:
    """No excess of normal stress over its reference value, and no slope."""
    return 0.0, 0.0


@cache
def stress_of(normal_stress: Function, place: int) -> Function:
    """``(g, psis, p) -> (s - 1, its slope)``, made of ``(g, p) -> (sigma/sigma_* - 1, its slope)``
    and the pore pressure at a place among the states, from their end; 0 where there is none.
    """

    def total_stress(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        return normal_stress(g, p)

    def effective_stress(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        excess, change = normal_stress(g, p)
        return min(max(excess - psis[place], SMALLEST_EXCESS), LARGEST_EXCESS), change

    return effective_stress if place else total_stress


@cache
def pressure_at(place: int) -> Function:
    """``(psis) -> P`` at a place; 0 where there is none."""

    def pressure(psis: Numbers) -> float:
        return psis[place]

    return pressure if place else no_pressure


def no_pressure(psis: Numbers) -> float:
    """P where there is none."""
    return 0.0


Relation = tuple[float, float, float, float]


def at_constant_stress(g: float, psis: Numbers, p: Numbers) -> Relation:
    """The friction relation at constant normal stress, of a state that stress does not change."""
    return g, 1.0, 0.0, 0.0


def no_state_effect(g: float, ratio: float, change: float, p: Numbers) -> tuple[float, float]:
    """The shift and its slope where stress does not change the state."""
    return 0.0, 0.0


def strength_of(stress: Function, state_effect: Function) -> Function:
    """The friction relation ``(g, psis, p) -> (strength, its slope, shift, its slope)``, of normal
    stress that changes, and of the effect of stress on the state.

    ``tau/sigma - mu_*`` keeps its digits where s is proportional to g, however large it is: with
    the bend s - 1 - s' g it is ``[g (1 - mu_* s') - mu_* bend]/s``, its derivative with respect to
    g ``(1 - mu_* s' + bend)/s**2``.
    """

    def coupled(g: float, psis: Numbers, p: Numbers) -> Relation:
        excess, change = stress(g, psis, p)
        ratio, mu_star = 1.0 + excess, p[MU_STAR]
        bend, support = excess - change * g, 1.0 - mu_star * change
        value, slope = (g * support - mu_star * bend) / ratio, (support + bend) / (ratio * ratio)
        shift, shift_slope = state_effect(g, ratio, change, p)
        return value + shift, slope + shift_slope, shift, shift_slope

    return coupled


def stress_dependence(g: float, ratio: float, change: float, p: Numbers) -> tuple[float, float]:
    """State variable lost to the present shear stress, and its derivative.

    ``dTheta = -c dtau/sigma`` integrates to a shift of ``c g ln(s)/(s - 1)`` where the normal
    stress ratio s changes in proportion to g, and of c g where it does not change.

    References
    ----------
    Nagata, Nakatani and Yoshida (2012), J. Geophys. Res. 117, B02314.
    """
    excess, c = ratio - 1.0, p[STRESS_DEPENDENCE]
    mean = math.log1p(excess) / excess if excess != 0.0 else 1.0
    return c * g * mean, c / ratio


def added(effect: Function, other: Function) -> Function:
    """Two effects of stress on the state at once: ``(g, ratio, change, p) -> (shift, slope)``."""

    def effects(g: float, ratio: float, change: float, p: Numbers) -> tuple[float, float]:
        shift, slope = effect(g, ratio, change, p)
        other_shift, other_slope = other(g, ratio, change, p)
        return shift + other_shift, slope + other_slope

    return effects


def reversible(one_way: Function) -> Function:
    """The relation of slip that may reverse, of that of slip forward: ln(V/V_*) is that of the
    magnitude of V.

    ``V = 2 V_* exp[-(mu_* + Theta)/a] sinh[tau/(a sigma)]`` has the sign of tau and reads

        a ln(|V|/V_*) = |tau|/sigma + a ln[1 - exp(-2 |tau|/(a sigma))] - mu_* - Theta,

    which differs from slip forward by exp(-2 mu/a), 10^-46 of it.

    References
    ----------
    Rice and Ben-Zion (1996), Proc. Natl. Acad. Sci. 93, 3811-3818.
    """

    def either_way(g: float, psis: Numbers, p: Numbers) -> Relation:
        forward, slope, shift, shift_slope = one_way(g, psis, p)
        a, mu_star = p[A], p[MU_STAR]
        coefficient_now = mu_star + forward - shift
        size = max(abs(coefficient_now), _LEAST)
        value = size + a * math.log(-math.expm1(-2.0 * size / a)) - mu_star + shift
        steeper = math.copysign(1.0 / math.tanh(size / a), coefficient_now)
        return value, (slope - shift_slope) * steeper + shift_slope, shift, shift_slope

    return either_way


def by_pressure_of(stress: Function, state_effect: Function) -> Function:
    """Derivatives of strength, ``(mu_* + g)/s**2`` and that of the shift, and of the shift with
    respect to P, at constant frictional stress.

    By the chain rule, the shift has its slope along a change of normal stress of -1 less that along
    none.
    """

    def slopes(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        ratio = 1.0 + stress(g, psis, p)[0]
        along = state_effect(g, ratio, -1.0, p)[1]
        shift = along - state_effect(g, ratio, 0.0, p)[1]
        return (p[MU_STAR] + g) / ratio**2 + shift, shift

    return slopes


def no_load_point_stress(psis: Numbers, p: Numbers) -> float:
    """K D where the load point moves steadily."""
    return 0.0


def load_point_stress(psis: Numbers, p: Numbers) -> float:
    """K D of an oscillation, which begins where D is 0."""
    return psis[-1] - p[LOADING + 2]


def with_load_point_stress(function: Function) -> Function:
    """A function ``(g, psis, p)`` of frictional stress, of g without `load_point_stress`."""

    def loaded(g: float, psis: Numbers, p: Numbers) -> Numbers:
        return function(g + load_point_stress(psis, p), psis, p)

    return loaded


def slopes_of(strength: Function) -> Function:
    """Derivatives of strength and of the shift with respect to K D, which are those by g."""

    def slopes(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        _value, slope, _shift, shift_slope = strength(g, psis, p)
        return slope, shift_slope

    return slopes


# ---- all of it -----------------------------------------------------------------------------------


class Parts(NamedTuple):
    """Friction as the parts of a scene state it (see their bases): functions, and how many states a
    law has and what may change normal stress beside shear stress.

    Attributes
    ----------
    states : int
        How many states the law has.
    evolutions, steady_states : callable
        Of the law.
    state_effects : tuple of callable
        By how much stress lowers the state: of normal stress, of the law, of shear stress.
    regularised : bool
        Whether slip may reverse.
    normal_stress : callable or None
        Of the case of normal stress.
    unknowns : int
        How many states end in P.
    auxiliary_rates, auxiliary_steady_states : callable or None
        Theirs: auxiliary rates, and what they are in steady sliding.
    outside : int
        Place of the pressure outside the fault, which a rig knows of, among all states and from
        their end: -1 where P is that; 0 where there is none.
    displaces : bool
        Whether the unknown that stands last is shear stress K D, and no pressure.
    excluded : tuple of int
        Places, among all states, of those that do not count for the distance from steady sliding.
    """

    states: int
    evolutions: Function
    steady_states: Function
    state_effects: tuple[Function, ...]
    regularised: bool
    normal_stress: Function | None
    unknowns: int
    auxiliary_rates: Function | None
    auxiliary_steady_states: Function | None
    outside: int
    displaces: bool = False
    excluded: tuple[int, ...] = ()


@cache
def friction_of(parts: Parts) -> Friction:
    """Friction, made of what the parts of a scene say of it."""
    effect = reduce(added, parts.state_effects) if parts.state_effects else no_state_effect
    pressure, outside = parts.unknowns > 0 and not parts.displaces, parts.outside
    total = parts.normal_stress or constant
    effective, outer = stress_of(total, -1 if pressure else 0), stress_of(total, outside)
    changes = pressure or total is not constant or len(parts.state_effects) > 0
    strength = strength_of(effective, effect) if changes else at_constant_stress
    if parts.regularised:
        strength = reversible(strength)
    evolutions, steady_states = parts.evolutions, parts.steady_states
    if parts.auxiliary_rates is not None and parts.auxiliary_steady_states is not None:
        evolutions = with_auxiliary(evolutions, parts.auxiliary_rates, parts.states)
        steady_states = with_auxiliary_at_rest(steady_states, parts.auxiliary_steady_states)
    by_last = by_pressure_of(effective, effect) if pressure else None
    states = parts.states + parts.unknowns
    if parts.displaces:
        strength, effective, outer = map(with_load_point_stress, (strength, effective, outer))
        by_last = slopes_of(strength)
    return Friction(
        strength=strength,
        effective_stress=effective,
        outer_stress=outer,
        outer_pressure=pressure_at(outside),
        evolutions=evolutions,
        steady_states=steady_states,
        state_sum=sum_of(parts.states),
        contribution=contribution_of(parts.states, by_last),
        by_pressure=by_last or by_pressure_of(effective, effect),
        states_at=states_at_of(parts.states),
        imposed=load_point_stress if parts.displaces else no_load_point_stress,
        imposed_change=pressure_at(-1 if parts.displaces else 0),
        states=states,
        counted=tuple(place for place in range(states) if place not in parts.excluded),
    )
