r"""Friction functions of a scene, built from the parts of the scene.

`build_friction_functions` combines the law, the normal stress condition, the fluid and the loading
of a scene. The module ``friction_relation`` defines the friction relation between the frictional
stress g, the slip rate and the states. The module ``state_variable_functions`` defines the
functions of the states. The friction functions include only the effects that are active in the
scene.

The pore pressure :math:`P`, divided by :math:`\sigma_*`, reduces the effective normal stress, so
:math:`s = \sigma/\sigma_* - P`. Friction, and the effects of stress on the state, depend on
:math:`\sigma` and :math:`P` only through the effective normal stress. In the tuple of states, the
states of the law come first, and the pressure :math:`P` is the last element. A loading that imposes
normal stress adds an unknown that acts like a pore pressure. If a scene has both such a loading and
a fluid, the pressure around the fault is the first element after the states of the law.

An oscillation of the load point adds a displacement :math:`D` to its mean motion. The spring
converts this displacement to the additional shear stress :math:`K D`. The unknowns f (spring
stress) and g (frictional stress) do not include the stress :math:`K D`. The friction functions
therefore add :math:`K D` to g. The equations for inertia and radiation damping do not need this
stress, because they depend only on the difference between f and g.

The functions take floats and the parameter tuple ``p`` (see ``parameter_layout``). Scenes with the
same combination of parts share the friction functions, so that each function is compiled only once.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, reduce
from typing import NamedTuple

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.slider import (
    friction_relation,
    integration_path_length,
    state_variable_functions,
    temperature_functions,
)
from rsfstudy.slider.parts import FloatTuple, NumericFunction
from rsfstudy.slider.scene_view import SceneView


@add_former_member_names
class FrictionFunctions(NamedTuple):
    r"""Functions that define the friction of a scene.

    Parameters
    ----------
    strength : callable
        Function ``(g, psis, p) -> (strength, slope, shift, shift_slope)``. The slopes are
        derivatives with respect to the frictional stress g. The first state can be omitted from the
        tuple ``psis``.
    effective_normal_stress : callable
        Function ``(g, psis, p) -> (s - 1, slope)`` that returns the effective normal stress minus 1
        and its derivative with respect to g.
    measured_effective_normal_stress : callable
        Function ``(g, psis, p) -> (s - 1, slope)`` with the pore pressure outside the fault instead
        of the pore pressure in the fault. A laboratory rig measures this effective normal stress.
    boundary_pressure : callable
        Function ``(psis) -> P`` that returns the pore pressure outside the fault.
    state_evolutions : callable
        Function ``(log_slip_rate, psis, shift, fraction, p)`` that returns the derivatives of all
        states with respect to slip in :math:`D_c`, multiplied by ``fraction``.
    steady_states : callable
        Function ``(log_slip_rate, shift, p)`` that returns all states in steady sliding.
    state_sum : callable
        Function ``(psis) -> float`` that returns the sum of the states of the law.
    state_variable : callable
        Function ``(difference, psis, p)`` that returns the state variable :math:`\Theta` from the
        difference between the sum of the states of the law and the shift.
    state_contribution_to_friction : callable
        Function ``(changes, g, psis, p)`` that returns the contribution of state changes to the
        friction relation, so that ``a d ln V = strength'(g) dg - state_contribution_to_friction``.
    strength_derivatives_by_pressure : callable
        Function ``(g, psis, p)`` that returns the derivatives of strength and of the shift with
        respect to the pore pressure.
    states_from_strength : callable
        Function ``(strength, log_slip_rate, others, p)`` that returns all states. The first state
        is computed from the strength, the slip rate and the other states.
    load_point_oscillation_stress : callable
        Function ``(psis, p)`` that returns the shear stress :math:`K D`. The frictional stress g
        does not include this stress.
    load_point_oscillation_stress_change : callable
        Function ``(changes)`` that returns the change in the shear stress :math:`K D`.
    state_count : int
        Number of states.
    state_indices_in_steady_state_distance : tuple of int
        Indices of the states from which the distance from steady sliding is computed.
    spring_stress_rate : callable
        Function ``(load, slip, compute_velocity_ratios, p)`` that returns the derivative of the
        spring stress with respect to displacement, including noise.
    """

    strength: NumericFunction
    effective_normal_stress: NumericFunction
    measured_effective_normal_stress: NumericFunction
    boundary_pressure: NumericFunction
    state_evolutions: NumericFunction
    steady_states: NumericFunction
    state_sum: NumericFunction
    state_variable: NumericFunction
    state_contribution_to_friction: NumericFunction
    strength_derivatives_by_pressure: NumericFunction
    states_from_strength: NumericFunction
    load_point_oscillation_stress: NumericFunction
    load_point_oscillation_stress_change: NumericFunction
    state_count: int
    state_indices_in_steady_state_distance: tuple[int, ...]
    spring_stress_rate: NumericFunction = integration_path_length.compute_spring_stress_rate


def build_friction_functions(scene: SceneView) -> FrictionFunctions:
    """Build the friction functions of a scene from its parts.

    Parameters
    ----------
    scene : Scene
        Scene with the parts.

    Returns
    -------
    FrictionFunctions
        Friction functions of the scene. All scenes with the same combination of parts have the same
        functions.
    """
    law, source, loading = (
        scene.parts.law,
        scene.part_changing_effective_stress,
        scene.stress_imposing_part,
    )
    oscillates, law_states = loading.adds_load_point_displacement_unknown, law.state_count
    boundary = -1 - len(scene.parts.fluid.unknowns) if loading.adds_normal_stress_unknowns else 0
    strength, effective, outer, derivatives = _build_functions_of_frictional_stress(
        scene.parts.normal_stress.normal_stress
        or friction_relation.return_zero_normal_stress_change,
        _list_stress_effect_functions(scene),
        "load point" if oscillates else "pressure" if source.unknowns else "",
        boundary,
        law.regularised,
    )
    evolutions, steady_states = state_variable_functions.get_evolution_and_steady_state_functions(
        law
    )
    if source.unknowns:
        evolutions, steady_states = (
            state_variable_functions.combine_law_and_auxiliary_rates(
                evolutions, source.auxiliary_rates, law_states
            ),
            state_variable_functions.combine_law_and_auxiliary_steady_states(
                steady_states, source.auxiliary_steady_states
            ),
        )
    excluded = source.excluded_from_distance
    compared = [n for n, x in enumerate(source.unknowns, law_states) if x.name not in excluded]
    functions = FrictionFunctions(
        strength=strength,
        effective_normal_stress=effective,
        measured_effective_normal_stress=outer,
        boundary_pressure=friction_relation.build_pore_pressure_function(boundary),
        state_evolutions=evolutions,
        steady_states=steady_states,
        state_sum=state_variable_functions.build_tuple_sum_function(law_states),
        state_variable=state_variable_functions.return_isothermal_state_variable,
        state_contribution_to_friction=state_variable_functions.build_state_contribution_function(
            law_states, derivatives if source.unknowns else None
        ),
        strength_derivatives_by_pressure=derivatives,
        states_from_strength=state_variable_functions.build_states_from_strength_function(
            law_states
        ),
        load_point_oscillation_stress=friction_relation.compute_load_point_oscillation_stress
        if oscillates
        else friction_relation.return_zero_load_point_oscillation,
        load_point_oscillation_stress_change=friction_relation.build_pore_pressure_function(
            -1 if oscillates else 0
        ),
        state_count=scene.state_count,
        state_indices_in_steady_state_distance=(*range(law_states), *compared),
        spring_stress_rate=integration_path_length.compute_spring_stress_rate_with_noise
        if scene.parts.loading_noise.is_active
        else integration_path_length.compute_spring_stress_rate,
    )
    if not scene.parts.temperature.unknowns:
        return functions
    return functions._replace(
        **temperature_functions.build_temperature_dependent_functions(scene, functions._asdict())
    )


def _list_stress_effect_functions(scene: SceneView) -> tuple[NumericFunction, ...]:
    """Return the functions that define how stress changes the state variable."""
    law = scene.parts.law
    of_shear_stress = (
        friction_relation.compute_shear_stress_effect_on_state if law.stress_dependence else None
    )
    effects = scene.parts.normal_stress.state_effect, law.state_effect, of_shear_stress
    return tuple(effect for effect in effects if effect is not None)


@cache
def _build_functions_of_frictional_stress(
    normal_stress_function: NumericFunction,
    state_effect_functions: tuple[NumericFunction, ...],
    kind_of_last_unknown: str,
    boundary_pressure_index: int,
    allows_reversed_slip: bool,
) -> tuple[NumericFunction, NumericFunction, NumericFunction, NumericFunction]:
    """Build the friction functions whose argument is the frictional stress.

    The argument ``kind_of_last_unknown`` is ``"pressure"``, ``"load point"`` or an empty string.
    This argument specifies the last element of the tuple of states. The function returns the first
    three functions of ``FrictionFunctions``, and a function that computes the derivatives with
    respect to the last unknown.
    """
    effect = (
        reduce(friction_relation.build_sum_of_two_state_effects, state_effect_functions)
        if state_effect_functions
        else friction_relation.return_zero_stress_effect_on_state
    )
    effective, outer = (
        friction_relation.build_effective_normal_stress_function(normal_stress_function, index)
        for index in (-1 if kind_of_last_unknown == "pressure" else 0, boundary_pressure_index)
    )
    is_variable = normal_stress_function is not friction_relation.return_zero_normal_stress_change
    strength = (
        friction_relation.build_strength_function(effective, effect)
        if is_variable or state_effect_functions or kind_of_last_unknown == "pressure"
        else friction_relation.compute_strength_at_constant_normal_stress
    )
    if allows_reversed_slip:
        strength = friction_relation.extend_relation_to_reversed_slip(strength)
    if kind_of_last_unknown == "load point":
        strength, effective, outer = map(
            friction_relation.add_load_point_oscillation_to_argument, (strength, effective, outer)
        )
        derivatives = friction_relation.build_strength_derivatives_by_load_point(strength)
    else:
        derivatives = friction_relation.build_strength_derivatives_by_pressure(effective, effect)
    return strength, effective, outer, derivatives


def build_friction_relation(
    scene: SceneView, states: FloatTuple = ()
) -> Callable[[float], tuple[float, float, float, float]]:
    r"""Return the friction relation of a scene as a function of stress.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    states : tuple of float, optional
        States of the scene, from which the pore pressure and the temperature are read. By default,
        the function uses the states of steady sliding at :math:`V_*`.

    Returns
    -------
    callable
        Function ``g -> (strength, slope, shift, shift_slope)``.
    """
    strength, p = scene.friction_law_functions.strength, scene.friction_parameter_values
    known = states or (0.0,) * scene.state_count
    return lambda friction: strength(friction, known, p)


def compute_effective_normal_stress(
    scene: SceneView, frictional_stress: float, states: FloatTuple = ()
) -> float:
    r"""Compute the effective normal stress from the frictional stress.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    frictional_stress : float
        Deviation of the frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    states : tuple of float, optional
        States of the scene. The pore pressure is one of the states. By default, the function uses
        the pore pressure in steady sliding.

    Returns
    -------
    float
        Effective normal stress in :math:`\sigma_*`.
    """
    at = states or (0.0,) * scene.state_count
    stress = scene.friction_law_functions.effective_normal_stress(
        frictional_stress, at, scene.friction_parameter_values
    )
    return 1.0 + float(stress[0])


def build_state_evolution_function(
    scene: SceneView,
) -> Callable[[float, FloatTuple, float], FloatTuple]:
    """Return a function that computes the state evolution of a scene.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.

    Returns
    -------
    callable
        Function ``(log_slip_rate, psis, shift)`` that returns the derivative of each state with
        respect to slip in :math:`D_c`.
    """
    evolutions, p = scene.friction_law_functions.state_evolutions, scene.friction_parameter_values
    return lambda log_slip_rate, psis, shift: evolutions(log_slip_rate, psis, shift, 1.0, p)


def compute_steady_states(
    scene: SceneView, log_slip_rate: float, stress_induced_state_shift: float
) -> FloatTuple:
    r"""Compute the states in steady sliding at a given slip rate.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    stress_induced_state_shift : float
        Stress-induced decrease in the state variable.

    Returns
    -------
    tuple of float
        States :math:`\Psi_i` of steady sliding.
    """
    p = scene.friction_parameter_values
    states: FloatTuple = scene.friction_law_functions.steady_states(
        log_slip_rate, stress_induced_state_shift, p
    )
    if not scene.parts.temperature.unknowns:
        return states
    place = scene.parts.law.state_count
    rise = temperature_functions.compute_steady_temperature_rise(scene, log_slip_rate)
    return (*states[:place], rise, *states[place + 1 :])
