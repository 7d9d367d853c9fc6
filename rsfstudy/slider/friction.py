r"""Friction relation between stress, slip rate and states.

Read this module before ``state_functions`` and ``scene_functions``. With the deviation of
frictional stress :math:`g = (\tau - \tau_*)/\sigma_*`, the normal stress ratio
:math:`s = \sigma/\sigma_*` and the state :math:`\Psi = \Theta + \mathrm{shift}(g)`, the friction
law :math:`\tau = \sigma [\mu_* + a \ln(V/V_*) + \Theta]` becomes

.. math::

    a \ln(V/V_*) + \Psi = \mathrm{strength}(g), \qquad
    \mathrm{strength}(g) = \frac{\mu_* + g}{s(g)} - \mu_* + \mathrm{shift}(g).

The shift is the decrease of the state variable :math:`\Theta` due to stress, for example
:math:`\alpha \ln s`. The state :math:`\Psi` does not change when stress changes suddenly. The
evolution of :math:`\Psi` depends only on the evolution law. If a law has several states,
:math:`\Psi` is the sum of all states.

The pore pressure :math:`P`, divided by :math:`\sigma_*`, reduces the effective normal stress, so
:math:`s = \sigma/\sigma_* - P`. Friction and the effects of stress on the state depend on the
effective normal stress only. The pressure :math:`P` is the last element of the tuple of states,
after the states of the law. A loading that imposes normal stress also adds an unknown to the
states. This unknown acts like a pore pressure. If the scene also has a fluid, the pressure around
the fault is the first element after the states of the law.

If the displacement of the load point exceeds its mean motion by :math:`D`, the spring adds the
shear stress :math:`K D`. The spring stress f and the frictional stress g exclude the stress
:math:`K D`. The friction functions add :math:`K D` to g. Inertia and radiation damping depend only
on the difference f - g. This difference is the same with and without :math:`K D`.

This module combines the functions that the parts of a scene define. Each combination contains only
the effects that are active in the scene. The combined functions take floats and the parameter tuple
``p`` (see ``parameter_layout``), so all scenes with the same parts share the combined functions.
"""

from __future__ import annotations

import math
from functools import cache, reduce
from typing import NamedTuple

from rsfstudy._deprecation import add_former_member_names
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
from rsfstudy.slider.temperature_functions import (
    TemperatureTerms,
    add_temperature_to_contribution,
    add_temperature_to_strength,
    append_temperature_evolution,
    build_normal_stress_from_friction_function,
    build_state_variable_function,
    insert_temperature_steady_state,
    state_variable_at_constant_temperature,
)

#: Smallest magnitude of the friction coefficient in scenes in which slip may reverse. The limit
#: keeps the logarithm of the slip rate finite at zero stress.
_MIN_NONZERO_FRICTION_COEFFICIENT = 1e-280


@add_former_member_names
class FrictionFunctions(NamedTuple):
    r"""Functions that define the friction of a scene.

    Parameters
    ----------
    strength : callable
        Function ``(g, psis, p) -> (strength, slope, shift, shift_slope)``. The slopes are
        derivatives with respect to the frictional stress g. The tuple ``psis`` may omit the first
        state.
    effective_normal_stress : callable
        Function ``(g, psis, p) -> (s - 1, slope)`` of the effective normal stress.
    rig_normal_stress : callable
        Function ``(g, psis, p) -> (s - 1, slope)`` of the normal stress minus the pore pressure
        outside the fault. A laboratory rig measures this stress.
    boundary_pressure : callable
        Function ``(psis) -> P`` of the pore pressure outside the fault.
    evolutions : callable
        Function ``(log_slip_rate, psis, shift, fraction, p)`` that returns the change of all states
        per slip distance of :math:`D_c`, multiplied by ``fraction``.
    steady_states : callable
        Function ``(log_slip_rate, shift, p)`` that returns all states in steady sliding.
    state_sum : callable
        Function ``(psis) -> float`` that returns the sum of the states of the law.
    state_variable : callable
        Function ``(difference, psis, p)`` that returns the state variable :math:`\Theta` from the
        sum of the states of the law minus the shift.
    state_contribution : callable
        Function ``(changes, g, psis, p)`` that returns the contribution of state changes to the
        friction relation, so that ``a d ln V = strength'(g) dg - state_contribution``.
    pressure_derivatives : callable
        Function ``(g, psis, p)`` that returns the derivatives of strength and of the shift with
        respect to the pore pressure.
    states_from_strength : callable
        Function ``(strength, log_slip_rate, others, p)`` that returns all states. The first state
        follows from the strength and the other states.
    load_point_stress : callable
        Function ``(psis, p)`` that returns the shear stress :math:`K D`. The frictional stress g
        excludes this stress.
    load_point_stress_change : callable
        Function ``(changes)`` that returns the change of the shear stress :math:`K D`.
    state_count : int
        Number of states.
    indices_of_states_in_distance : tuple of int
        Indices of the states that are compared with their steady values to compute the distance
        from steady sliding.
    """

    strength: Function
    effective_normal_stress: Function
    rig_normal_stress: Function
    boundary_pressure: Function
    evolutions: Function
    steady_states: Function
    state_sum: Function
    state_variable: Function
    state_contribution: Function
    pressure_derivatives: Function
    states_from_strength: Function
    load_point_stress: Function
    load_point_stress_change: Function
    state_count: int
    indices_of_states_in_distance: tuple[int, ...]


# ---- the friction relation -----------------------------------------------------------------------


def zero_normal_stress_excess(frictional_stress: float, p: Numbers) -> tuple[float, float]:
    r"""Return a zero change of normal stress and a zero derivative.

    Parameters
    ----------
    frictional_stress : float
        Deviation of the frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`. This
        argument is ignored.
    p : tuple of float
        Parameters of the scene. This argument is ignored.

    Returns
    -------
    excess, slope : float
        Normal stress ratio minus one, and its derivative.
    """
    return 0.0, 0.0


@cache
def build_effective_normal_stress_function(
    total_normal_stress_function: Function, pressure_index: int
) -> Function:
    """Return a function that computes the effective normal stress.

    Parameters
    ----------
    total_normal_stress_function : callable
        Function ``(g, p) -> (sigma/sigma_* - 1, slope)``.
    pressure_index : int
        Negative index of the pore pressure in the tuple of states, or 0 if the scene has no pore
        pressure.

    Returns
    -------
    callable
        Function ``(g, psis, p) -> (s - 1, slope)``.
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
    """Return a function that reads the pore pressure from the states.

    Parameters
    ----------
    pressure_index : int
        Negative index of the pressure in the tuple of states, or 0 if there is no pressure.

    Returns
    -------
    callable
        Function ``(psis) -> P``.
    """

    def pressure(psis: Numbers) -> float:
        return psis[pressure_index]

    return pressure if pressure_index else zero_pressure


def zero_pressure(states: Numbers) -> float:
    """Return zero pore pressure.

    Parameters
    ----------
    states : tuple of float
        States of the scene. This argument is ignored.

    Returns
    -------
    float
        Zero.
    """
    return 0.0


FrictionRelationValues = tuple[float, float, float, float]


def friction_relation_at_constant_normal_stress(
    frictional_stress: float, states: Numbers, p: Numbers
) -> FrictionRelationValues:
    r"""Evaluate the friction relation at constant normal stress.

    The function applies to scenes in which stress does not change the state variable.

    Parameters
    ----------
    frictional_stress : float
        Deviation of the frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    states : tuple of float
        States of the scene. This argument is ignored.
    p : tuple of float
        Parameters of the scene. This argument is ignored.

    Returns
    -------
    strength, slope, shift, shift_slope : float
        Strength and shift, each with its derivative.
    """
    return frictional_stress, 1.0, 0.0, 0.0


def zero_state_effect(
    frictional_stress: float,
    normal_stress_ratio: float,
    normal_stress_derivative: float,
    p: Numbers,
) -> tuple[float, float]:
    r"""Return a shift of zero for states that do not depend on stress.

    Parameters
    ----------
    frictional_stress : float
        Deviation of the frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    normal_stress_ratio : float
        Normal stress ratio :math:`s`.
    normal_stress_derivative : float
        Derivative of the normal stress ratio with respect to frictional stress.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    shift, slope : float
        Two zeros.
    """
    return 0.0, 0.0


def build_strength_function(
    normal_stress_function: Function, state_effect_function: Function
) -> Function:
    r"""Return the friction relation for variable normal stress.

    Parameters
    ----------
    normal_stress_function : callable
        Function ``(g, psis, p) -> (s - 1, slope)`` of the effective normal stress.
    state_effect_function : callable
        Function ``(g, ratio, change, p) -> (shift, slope)`` of the effect of stress on the state.

    Returns
    -------
    callable
        Function ``(g, psis, p) -> (strength, slope, shift, shift_slope)``.

    Notes
    -----
    With :math:`q = s - 1 - s' g`, the function evaluates

    .. math::

        \frac{\tau}{\sigma} - \mu_* = \frac{g (1 - \mu_* s') - \mu_* q}{s}, \qquad
        \frac{\partial}{\partial g} \frac{\tau}{\sigma} = \frac{1 - \mu_* s' + q}{s^2}.

    If :math:`s - 1` is proportional to :math:`g`, :math:`q` is zero. The formula then keeps its
    relative accuracy for arbitrarily large :math:`g`.
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
    r"""Compute the effect of shear stress on the state variable.

    Parameters
    ----------
    frictional_stress : float
        Deviation of the frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    normal_stress_ratio : float
        Normal stress ratio :math:`s`.
    normal_stress_derivative : float
        Derivative of the normal stress ratio with respect to frictional stress. This argument is
        ignored.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    shift, slope : float
        Decrease of the state variable due to the present shear stress, and the derivative of this
        decrease with respect to frictional stress.

    Notes
    -----
    The integral of :math:`d\Theta = -c \, d\tau/\sigma` is the shift :math:`c g \ln(s)/(s - 1)` if
    the normal stress ratio :math:`s` changes in proportion to :math:`g`. If the normal stress is
    constant, the shift is :math:`c g`.

    References
    ----------
    Nagata, Nakatani and Yoshida (2012), J. Geophys. Res. 117, B02314.
    """
    excess, c = normal_stress_ratio - 1.0, p[STRESS_DEPENDENCE]
    mean = math.log1p(excess) / excess if excess != 0.0 else 1.0
    return c * frictional_stress * mean, c / normal_stress_ratio


def sum_state_effects(first_effect: Function, second_effect: Function) -> Function:
    """Return a function that adds two effects of stress on the state.

    Parameters
    ----------
    first_effect, second_effect : callable
        Functions ``(g, ratio, change, p) -> (shift, slope)``.

    Returns
    -------
    callable
        Function ``(g, ratio, change, p) -> (shift, slope)``.
    """

    def combined_effect(g: float, ratio: float, change: float, p: Numbers) -> tuple[float, float]:
        shift, slope = first_effect(g, ratio, change, p)
        other_shift, other_slope = second_effect(g, ratio, change, p)
        return shift + other_shift, slope + other_slope

    return combined_effect


def extend_relation_to_reversed_slip(forward_relation: Function) -> Function:
    r"""Return the friction relation of a fault that may slip backwards.

    Parameters
    ----------
    forward_relation : callable
        Friction relation for forward slip,
        ``(g, psis, p) -> (strength, slope, shift, shift_slope)``.

    Returns
    -------
    callable
        Friction relation in which the log rate is the logarithm of :math:`|V|/V_*`.

    Notes
    -----
    In the regularised law :math:`V = 2 V_* \exp[-(\mu_* + \Theta)/a] \sinh[\tau/(a \sigma)]`, the
    slip rate has the same sign as the shear stress. The friction relation becomes

    .. math::

        a \ln\frac{|V|}{V_*} = \frac{|\tau|}{\sigma} + a \ln\left[1 - e^{-2 |\tau|/(a
        \sigma)}\right] - \mu_* - \Theta.

    For forward slip, the relative difference from the usual law is about :math:`e^{-2 \mu/a}`, or
    1e-46 for typical parameters.

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
    r"""Return a function that differentiates strength with respect to pressure.

    Parameters
    ----------
    normal_stress_function : callable
        Function ``(g, psis, p) -> (s - 1, slope)`` of the effective normal stress.
    state_effect_function : callable
        Function ``(g, ratio, change, p) -> (shift, slope)`` of the effect of stress on the state.

    Returns
    -------
    callable
        Function ``(g, psis, p)`` that returns the derivatives of strength and of the shift with
        respect to pore pressure, at constant frictional stress.

    Notes
    -----
    The derivative of strength is :math:`(\mu_* + g)/s^2` plus the derivative of the shift. By the
    chain rule, the derivative of the shift is the difference between two slopes of the shift. The
    first slope assumes a normal stress derivative of -1, and the second slope assumes a normal
    stress derivative of 0.
    """

    def pressure_derivatives(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        ratio = 1.0 + normal_stress_function(g, psis, p)[0]
        along = state_effect_function(g, ratio, -1.0, p)[1]
        shift = along - state_effect_function(g, ratio, 0.0, p)[1]
        return (p[MU_STAR] + g) / ratio**2 + shift, shift

    return pressure_derivatives


def zero_load_point_stress(states: Numbers, p: Numbers) -> float:
    """Return zero stress for a load point that moves steadily.

    Parameters
    ----------
    states : tuple of float
        States of the scene. This argument is ignored.
    p : tuple of float
        Parameters of the scene. This argument is ignored.

    Returns
    -------
    float
        Zero.
    """
    return 0.0


def load_point_stress(states: Numbers, p: Numbers) -> float:
    r"""Compute the shear stress due to an oscillation of the load point.

    Parameters
    ----------
    states : tuple of float
        States of the scene. The last element is the unknown of the loading.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    float
        Shear stress :math:`K D` in :math:`\sigma_*`. The stress is zero at the start of the
        oscillation.
    """
    return states[-1] - p[LOADING + 2]


def wrap_with_load_point_stress(friction_function: Function) -> Function:
    """Return a friction function that adds the stress of the load point.

    Parameters
    ----------
    friction_function : callable
        Function ``(g, psis, p)`` whose argument g is the total frictional stress.

    Returns
    -------
    callable
        Function ``(g, psis, p)`` whose argument g excludes the stress that `load_point_stress`
        returns.
    """

    def function_with_load_point_stress(g: float, psis: Numbers, p: Numbers) -> Numbers:
        return friction_function(g + load_point_stress(psis, p), psis, p)

    return function_with_load_point_stress


def build_load_point_derivatives_function(strength_function: Function) -> Function:
    """Return a function for the derivatives with respect to load point stress.

    Parameters
    ----------
    strength_function : callable
        Friction relation ``(g, psis, p) -> (strength, slope, shift, shift_slope)``.

    Returns
    -------
    callable
        Function ``(g, psis, p)`` that returns the derivatives of strength and of the shift with
        respect to :math:`K D`. The derivatives are equal to the derivatives with respect to g.
    """

    def load_point_derivatives(g: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
        _value, slope, _shift, shift_slope = strength_function(g, psis, p)
        return slope, shift_slope

    return load_point_derivatives


# ---- friction functions of a scene ---------------------------------------------------------------


class FrictionTerms(NamedTuple):
    """Contributions of the parts of a scene to friction.

    Parameters
    ----------
    law_state_count : int
        Number of states of the law.
    evolutions, steady_states : callable
        Functions that compute the evolution and the steady states of the law.
    stress_effects_on_state : tuple of callable
        Functions that compute the decrease of the state variable due to stress. The normal stress
        condition, the law and the shear stress can each contribute a function.
    allows_reversed_slip : bool
        True if slip may reverse.
    normal_stress : callable or None
        Function that the normal stress condition defines. The attribute is None if shear stress
        does not change normal stress.
    auxiliary_unknown_count : int
        Number of unknowns of the fluid or the loading. The last of these unknowns is the pore
        pressure, or the shear stress due to an oscillation of the load point.
    auxiliary_rates, auxiliary_steady_states : callable or None
        Functions that compute the rates and the steady values of the auxiliary unknowns.
    boundary_pressure_index : int
        Negative index of the pressure outside the fault in the tuple of states. The index is -1 if
        the pore pressure is the pressure outside the fault, and 0 if the loading imposes no
        pressure.
    has_load_point_unknown : bool, default: False
        True if the last unknown is the shear stress :math:`K D` instead of a pressure.
    state_indices_excluded_from_distance : tuple of int, optional
        Indices of the states that are ignored when the distance from steady sliding is computed.
    temperature : TemperatureTerms, optional
        Contributions of the temperature, if the temperature is an unknown.
    """

    law_state_count: int
    evolutions: Function
    steady_states: Function
    stress_effects_on_state: tuple[Function, ...]
    allows_reversed_slip: bool
    normal_stress: Function | None
    auxiliary_unknown_count: int
    auxiliary_rates: Function | None
    auxiliary_steady_states: Function | None
    boundary_pressure_index: int
    has_load_point_unknown: bool = False
    state_indices_excluded_from_distance: tuple[int, ...] = ()
    temperature: TemperatureTerms | None = None


@cache
def build_friction_functions(friction_terms: FrictionTerms) -> FrictionFunctions:
    """Build the friction functions from the contributions of all parts.

    Parameters
    ----------
    friction_terms : FrictionTerms
        Contributions of the parts of a scene.

    Returns
    -------
    FrictionFunctions
        Friction functions of the scene. The result is cached.
    """
    effect = (
        reduce(sum_state_effects, friction_terms.stress_effects_on_state)
        if friction_terms.stress_effects_on_state
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
        pressure
        or total is not zero_normal_stress_excess
        or len(friction_terms.stress_effects_on_state) > 0
    )
    strength = (
        build_strength_function(effective, effect)
        if changes
        else friction_relation_at_constant_normal_stress
    )
    if friction_terms.allows_reversed_slip:
        strength = extend_relation_to_reversed_slip(strength)
    evolutions, steady_states = friction_terms.evolutions, friction_terms.steady_states
    heat = friction_terms.temperature
    if heat is not None:
        if heat.affects_friction:
            strength = add_temperature_to_strength(strength, heat)
        by_friction = build_normal_stress_from_friction_function(
            total, has_pressure=pressure, is_linear=heat.normal_stress_is_linear
        )
        evolutions = append_temperature_evolution(
            evolutions,
            friction_terms.auxiliary_rates,
            by_friction,
            friction_terms.law_state_count,
            heat,
        )
        steady_states = insert_temperature_steady_state(
            steady_states, friction_terms.auxiliary_steady_states
        )
    elif (
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
    states += heat is not None
    if friction_terms.has_load_point_unknown:
        strength, effective, outer = map(wrap_with_load_point_stress, (strength, effective, outer))
        by_last = build_load_point_derivatives_function(strength)
    contribution = build_state_contribution_function(friction_terms.law_state_count, by_last)
    state_variable = state_variable_at_constant_temperature
    if heat is not None and heat.affects_friction:
        contribution = add_temperature_to_contribution(contribution, heat)
        state_variable = build_state_variable_function(heat)
    return FrictionFunctions(
        strength=strength,
        effective_normal_stress=effective,
        rig_normal_stress=outer,
        boundary_pressure=build_pressure_function(outside),
        evolutions=evolutions,
        steady_states=steady_states,
        state_sum=build_sum_function(friction_terms.law_state_count),
        state_variable=state_variable,
        state_contribution=contribution,
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
