r"""Equations of motion of a scene, built from its friction and its dynamics.

`build_scene_functions` is the main function. Read ``friction`` first.

Between ruptures, the unknowns are the spring stress :math:`f` and the states :math:`\Psi`. The
independent variable :math:`\delta` is slip plus load point displacement,
:math:`d\delta = (V + V_0) \, dt`:

.. math::

    \frac{df}{d\delta} = \frac{K (V_0 - V)}{V + V_0}, \qquad
    \frac{d\Psi}{d\delta} = \frac{V}{V + V_0} \frac{d\Psi}{d(\mathrm{slip})}, \qquad
    \frac{dt}{d\delta} = \frac{1}{V + V_0}.

The dynamics of the scene determine the slip rate from :math:`f` and :math:`\Psi`. In ruptures, the
independent variable of the equations of motion with inertia is inertial time, which is time in
units of :math:`T/(2 \pi)`.

The equations between ruptures and in ruptures are both integrated along the path length
:math:`\lambda`, which combines displacement (or inertial time) with :math:`x = \ln(V/V_*)`:

.. math::

    d\lambda^2 = d\delta^2 + (dx/6)^2, \qquad
    \frac{dx}{d\delta} \approx \frac{1}{a} \left[\frac{K (V_0 - V)}{V + V_0} -
    \frac{d\Psi}{d\delta}\right].

While contacts heal, :math:`\ln V` decreases as the logarithm of displacement. When slip ends after
a rupture, :math:`\ln V` decreases as the logarithm of the remaining time. If displacement or time
were the independent variable, each integration step would have to be a fraction of the elapsed or
remaining displacement or time. Measured in path length, the interval in which contacts heal or slip
ends is only a few units long. The factor of 6 in the path length reduces the number of integration
steps where slip is fastest, because the path bends over six units of :math:`\ln V` instead of one
unit. Factors from 4 to 12 instead of 6 give similar results.

The slip rate of a rigid slider is prescribed, and slip is the independent variable.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from rsfstudy.slider import friction
from rsfstudy.slider.friction import FrictionFunctions, build_friction_functions
from rsfstudy.slider.motion_point import MotionPoint
from rsfstudy.slider.parameter_layout import LOAD_VELOCITY, LOG_LOAD_VELOCITY, MU_STAR, STIFFNESS, A
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.state_functions import (
    build_tuple_scaling_function,
    default_steady_state,
    wrap_single_state_evolution,
)
from rsfstudy.slider.temperature_functions import build_temperature_terms

if TYPE_CHECKING:
    from rsfstudy.slider.dynamics import Dynamics

#: Lower limit of ln(V/V_*), the logarithm of 10^-290. A motion without loading ends at this slip
#: rate.
STOPPED_LOG_SLIP_RATE = -290.0 * math.log(10.0)

#: Largest difference between ln V_0 and ln V. The rate functions replace a larger difference by
#: this limit. At lower slip rates the contact is treated as stationary, because the remaining slip
#: changes the state by a relative amount below exp(-100).
MAX_LOG_LOAD_OVER_SLIP_VELOCITY = 100.0

#: Change of ln V that adds as much path length as one unit of displacement (D_c) or inertial time.
LOG_SLIP_RATE_PER_PATH_LENGTH = 6.0
#: Largest slope of the path whose square is computed. The slope is the derivative of ln V/6 with
#: respect to displacement or inertial time. Adding 1 to the square of a larger slope has no effect
#: in double precision.
MAX_FINITE_PATH_SLOPE = 1e9


# ---- velocity ratios and path length -------------------------------------------------------------

VelocityRatios = tuple[float, float, float]


def velocity_ratios(log_slip_rate: float, p: Numbers) -> VelocityRatios:
    r"""Compute the slip rate and its ratios to the load point velocity.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`, limited from below.
    load_ratio : float
        Velocity ratio :math:`V_0/V`.
    slip_fraction : float
        Ratio of slip to the sum of slip and load point displacement, :math:`V/(V + V_0)`.

    Notes
    -----
    Below the lower limit of :math:`\ln(V/V_*)`, the contact is treated as stationary. At low slip
    rates, the change of the state per unit slip may grow in proportion to :math:`1/V`. The product
    of this change and the fraction :math:`V/(V + V_0)` remains finite. Without the lower limit of
    :math:`\ln(V/V_*)`, the change of the state per unit slip would overflow and the fraction would
    underflow.
    """
    least = p[LOG_LOAD_VELOCITY] - MAX_LOG_LOAD_OVER_SLIP_VELOCITY
    x = least if log_slip_rate < least else log_slip_rate
    slower = math.exp(p[LOG_LOAD_VELOCITY] - x)
    return x, slower, 1.0 / (1.0 + slower)


def time_per_displacement(velocity_ratio_values: VelocityRatios, p: Numbers) -> float:
    """Compute the derivative of time with respect to displacement.

    Parameters
    ----------
    velocity_ratio_values : tuple of float
        Output of `velocity_ratios`.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    float
        Value of :math:`1/(V + V_0)` in units of :math:`1/V_*`.
    """
    x, slower, fraction = velocity_ratio_values
    if p[LOAD_VELOCITY] != 0.0:
        return slower * fraction / abs(p[LOAD_VELOCITY])
    return math.exp(-max(x, STOPPED_LOG_SLIP_RATE))


def displacement_per_path_length(path_slope: float) -> float:
    r"""Compute the derivative of displacement with respect to path length.

    Parameters
    ----------
    path_slope : float
        Slope of the path, the derivative of :math:`\ln V/6` with respect to displacement or
        inertial time. The square of the slope may overflow when slip stops, so the function does
        not square very large slopes.

    Returns
    -------
    float
        Displacement per unit path length.
    """
    if abs(path_slope) > MAX_FINITE_PATH_SLOPE:
        return 1.0 / abs(path_slope)
    return 1.0 / math.sqrt(1.0 + path_slope * path_slope)


# ---- rates between ruptures ----------------------------------------------------------------------


def build_displacement_rate_function(
    friction_functions: FrictionFunctions,
    force_balance_function: Function,
    *,
    allows_reversed_slip: bool,
) -> Function:
    r"""Return a function for the rates with respect to displacement.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    force_balance_function : callable
        Function ``(spring, psis, p)`` that returns :math:`\ln(V/V_*)`, the frictional stress and
        the decrease of the state due to stress.
    allows_reversed_slip : bool
        Whether slip and the load point may reverse.

    Returns
    -------
    callable
        Function ``(state, p)`` that returns the rate of the spring stress, the rates of the states
        and the output of `velocity_ratios`.

    Notes
    -----
    If slip may reverse, the displacement is the sum of the magnitudes of slip and load point
    displacement, and :math:`df/d\delta = K (V_0 - V)/(|V| + |V_0|)`. The slip rate :math:`V` has
    the sign of the shear stress.
    """
    evolutions, imposed, end = (
        friction_functions.evolutions,
        friction_functions.load_point_stress,
        1 + friction_functions.state_count,
    )

    def forward_rates(state: Numbers, p: Numbers) -> tuple[float, Numbers, VelocityRatios]:
        psis = state[1:end]
        log_slip_rate, _g, shift = force_balance_function(state[0], psis, p)
        ratios = velocity_ratios(log_slip_rate, p)
        x, slower, fraction = ratios
        loading = p[STIFFNESS] * (slower - 1.0) * fraction
        return loading, evolutions(x, psis, shift, fraction, p), ratios

    def reversible_rates(state: Numbers, p: Numbers) -> tuple[float, Numbers, VelocityRatios]:
        _loading, changes, ratios = forward_rates(state, p)
        _x, slower, fraction = ratios
        slip = math.copysign(1.0, p[MU_STAR] + state[0] + imposed(state[1:end], p))
        load = math.copysign(slower, p[LOAD_VELOCITY])
        return p[STIFFNESS] * (load - slip) * fraction, changes, ratios

    return reversible_rates if allows_reversed_slip else forward_rates


def build_rate_functions_between_ruptures(
    friction_functions: FrictionFunctions, displacement_rate_function: Function
) -> tuple[Function, Function, Function]:
    """Return the rate functions of a scene between ruptures.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    displacement_rate_function : callable
        Output of `build_displacement_rate_function`.

    Returns
    -------
    rates_by_displacement, rates_along_path, rates_along_path_with_time : callable
        Functions ``(state, p) -> tuple`` that return the derivatives of the spring stress and the
        states. The third function appends the derivative of time.
    """
    state_sum, times = (
        friction_functions.state_sum,
        build_tuple_scaling_function(friction_functions.state_count),
    )

    def rates_by_displacement(state: Numbers, p: Numbers) -> Numbers:
        loading, changes, _ratios = displacement_rate_function(state, p)
        return (loading, *changes)

    def rates_along_path(state: Numbers, p: Numbers) -> Numbers:
        loading, changes, _ratios = displacement_rate_function(state, p)
        along = displacement_per_path_length(
            (loading - state_sum(changes)) / (LOG_SLIP_RATE_PER_PATH_LENGTH * p[A])
        )
        return (along * loading, *times(changes, along))

    def rates_along_path_with_time(state: Numbers, p: Numbers) -> Numbers:
        loading, changes, ratios = displacement_rate_function(state, p)
        along = displacement_per_path_length(
            (loading - state_sum(changes)) / (LOG_SLIP_RATE_PER_PATH_LENGTH * p[A])
        )
        return (along * loading, *times(changes, along), along * time_per_displacement(ratios, p))

    return rates_by_displacement, rates_along_path, rates_along_path_with_time


# ---- rates in ruptures, and of a rigid slider ----------------------------------------------------


def build_rate_functions_in_rupture(
    friction_functions: FrictionFunctions, rupture_rate_function: Function
) -> tuple[Function, Function, Function]:
    r"""Return the rate functions of a scene in ruptures.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    rupture_rate_function : callable
        Function ``(state, p)`` that returns the derivatives with respect to inertial time.

    Returns
    -------
    rates_by_time, rates_along_path, rates_along_path_with_time : callable
        Functions ``(state, p) -> tuple`` that return the derivatives of the spring stress f, of
        :math:`x = \ln(V/V_*)`, of the frictional stress g and of all states except the first. The
        third function appends the derivative of inertial time.
    """
    end = 2 + friction_functions.state_count
    times = build_tuple_scaling_function(end)

    def rates_along_path(state: Numbers, p: Numbers) -> Numbers:
        by = rupture_rate_function(state, p)
        return times(by, displacement_per_path_length(by[1] / LOG_SLIP_RATE_PER_PATH_LENGTH))

    def rates_along_path_with_time(state: Numbers, p: Numbers) -> Numbers:
        by = rupture_rate_function(state[:end], p)
        along = displacement_per_path_length(by[1] / LOG_SLIP_RATE_PER_PATH_LENGTH)
        return (*times(by, along), along)

    return rupture_rate_function, rates_along_path, rates_along_path_with_time


def build_rate_function_of_rigid_slider(friction_functions: FrictionFunctions) -> Function:
    r"""Return the rate function of a rigid slider.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.

    Returns
    -------
    callable
        Function ``(state, p) -> tuple`` that returns the derivatives of g and all states except the
        first with respect to slip. The log rate :math:`\ln(V/V_*)` is the last element of ``p``.

    Notes
    -----
    At a constant slip rate, the friction relation gives
    :math:`\mathrm{strength}'(g) \, dg = d\Psi`.
    """
    strength, states_at = friction_functions.strength, friction_functions.states_from_strength
    evolutions, contribution = friction_functions.evolutions, friction_functions.state_contribution

    def rigid_rate(state: Numbers, p: Numbers) -> Numbers:
        others = state[1:]
        value, slope, shift, _shift_slope = strength(state[0], others, p)
        changes = evolutions(p[-1], states_at(value, p[-1], others, p), shift, 1.0, p)
        return (contribution(changes, state[0], others, p) / slope, *changes[1:])

    return rigid_rate


# ---- stress, slip rate and states at one instant -------------------------------------------------


def build_motion_point_assembling_function(friction_functions: FrictionFunctions) -> Function:
    r"""Return a function that creates a ``MotionPoint`` from stresses and states.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.

    Returns
    -------
    callable
        Function ``(x, growth, forces, states, changes, shift, p) ->
        MotionPoint``. The arguments ``x`` and ``growth`` are :math:`x = \ln(V/V_*)` and its
        derivative. The tuple ``forces`` contains f, the derivative of f, g, and the derivative of
        g. The other arguments are the states, the derivatives of the states, the decrease of the
        state variable due to stress, and the parameters.

    Notes
    -----
    The friction coefficient that a laboratory rig measures is :math:`(\mu_* + f)/s`, with the
    normal stress ratio :math:`s` outside the fault.
    """
    steady_states, state_sum, counted = (
        friction_functions.steady_states,
        friction_functions.state_sum,
        friction_functions.indices_of_states_in_distance,
    )
    effective_stress, stress = (
        friction_functions.effective_normal_stress,
        friction_functions.rig_normal_stress,
    )
    state_variable = friction_functions.state_variable
    pressure, imposed, imposed_change = (
        friction_functions.boundary_pressure,
        friction_functions.load_point_stress,
        friction_functions.load_point_stress_change,
    )

    def point_at(
        x: float,
        growth: float,
        forces: Numbers,
        psis: Numbers,
        changes: Numbers,
        shift: float,
        p: Numbers,
    ) -> MotionPoint:
        f, f_change, g, g_change = forces
        steady = steady_states(x, shift, p)
        psi, distance = state_sum(psis), 0.0
        for i in counted:
            distance = max(distance, abs(psis[i] - steady[i]))
        ratio = 1.0 + effective_stress(g, psis, p)[0]
        excess, slope = stress(g, psis, p)
        pushed, pushed_change = imposed(psis, p), imposed_change(changes)
        outside = 1.0 + excess
        outside_change = slope * (g_change + pushed_change) - pressure(changes)
        reading = (p[MU_STAR] + f + pushed) / outside
        return MotionPoint(
            x,
            growth,
            f,
            g,
            psi,
            state_variable(psi - shift, psis, p),
            psi - state_sum(steady),
            distance,
            (p[MU_STAR] + g + pushed) / ratio,
            ratio,
            reading,
            (f_change + pushed_change - reading * outside_change) / outside,
            psis,
        )

    return point_at


def build_point_function_between_ruptures(
    friction_functions: FrictionFunctions,
    force_balance_function: Function,
    log_slip_rate_growth_function: Function,
    assemble_point: Function,
) -> Function:
    r"""Return a function for stress, slip rate and states between ruptures.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    force_balance_function : callable
        Function ``(spring, psis, p)`` that returns :math:`\ln(V/V_*)`, the frictional stress and
        the decrease of the state due to stress.
    log_slip_rate_growth_function : callable
        Function ``(unknowns, rates, x, g, p)`` that returns the derivative of :math:`\ln V`.
    assemble_point : callable
        Output of `build_motion_point_assembling_function`.

    Returns
    -------
    callable
        Function ``(state, rates, p) -> MotionPoint``.

    Notes
    -----
    The derivative of g follows from the friction relation,
    ``a dx = strength'(g) dg - contribution``.
    """
    strength, contribution, end = (
        friction_functions.strength,
        friction_functions.state_contribution,
        1 + friction_functions.state_count,
    )

    def point(state: Numbers, rates: Numbers, p: Numbers) -> MotionPoint:
        unknowns, changes = state[:end], rates[1:end]
        f, psis = unknowns[0], unknowns[1:]
        x, g, _shift = force_balance_function(f, psis, p)
        x_change = log_slip_rate_growth_function(unknowns, rates[:end], x, g, p)
        _value, slope, shift, _shift_slope = strength(g, psis, p)
        g_change = (p[A] * x_change + contribution(changes, g, psis, p)) / slope
        return assemble_point(x, x_change, (f, rates[0], g, g_change), psis, changes, shift, p)

    return point


def build_point_function_in_rupture(
    friction_functions: FrictionFunctions, assemble_point: Function
) -> Function:
    """Return a function for stress, slip rate and states in ruptures.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    assemble_point : callable
        Output of `build_motion_point_assembling_function`.

    Returns
    -------
    callable
        Function ``(state, rates, p) -> MotionPoint`` for the equations of motion with inertia.
    """
    strength, states_at, end = (
        friction_functions.strength,
        friction_functions.states_from_strength,
        2 + friction_functions.state_count,
    )

    def point(state: Numbers, rates: Numbers, p: Numbers) -> MotionPoint:
        f, x, g, others = state[0], state[1], state[2], state[3:end]
        value, _slope, shift, _shift_slope = strength(g, others, p)
        psis = states_at(value, x, others, p)
        return assemble_point(x, rates[1], (f, rates[0], g, rates[2]), psis, rates[:end], shift, p)

    return point


def build_point_function_of_rigid_slider(
    friction_functions: FrictionFunctions, assemble_point: Function
) -> Function:
    """Return a function for stress, slip rate and states of a rigid slider.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    assemble_point : callable
        Output of `build_motion_point_assembling_function`.

    Returns
    -------
    callable
        Function ``(state, rates, p) -> MotionPoint``. The spring stress f of a rigid slider is
        equal to the frictional stress g.
    """
    strength, states_at = friction_functions.strength, friction_functions.states_from_strength

    def point(state: Numbers, rates: Numbers, p: Numbers) -> MotionPoint:
        g, others, x = state[0], state[1:], p[-1]
        value, _slope, shift, _shift_slope = strength(g, others, p)
        psis = states_at(value, x, others, p)
        return assemble_point(x, 0.0, (g, rates[0], g, rates[0]), psis, rates, shift, p)

    return point


# ---- complete equations of motion ----------------------------------------------------------------


class MotionRegimeFunctions(NamedTuple):
    """Functions for the rates and the physical quantities in a regime of motion.

    Parameters
    ----------
    rates_against_clock : callable
        Function ``(state, p)`` that returns the derivatives of the unknowns with respect to
        displacement or inertial time.
    rates_along_path : callable
        Function ``(state, p)`` that returns the derivatives of the unknowns with respect to path
        length.
    rates_along_path_with_time : callable
        Function ``(state, p)`` that returns the derivatives with respect to path length, including
        the derivative of time.
    point_function : callable
        Function ``(state, derivatives, p) -> MotionPoint``.
    """

    rates_against_clock: Function
    rates_along_path: Function
    rates_along_path_with_time: Function
    point_function: Function


class SceneFunctions(NamedTuple):
    r"""Functions that define the equations of motion of a scene.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    force_balance_function : callable
        Function ``(spring, psis, p)`` that returns :math:`\ln(V/V_*)`, the frictional stress and
        the decrease of the state due to stress between ruptures.
    functions_between_ruptures : MotionRegimeFunctions
        Functions for the motion between ruptures.
    functions_in_rupture : MotionRegimeFunctions or None
        Functions for the motion in ruptures, from the equations of motion with inertia. The
        attribute is None if the scene has no inertia.
    rigid_rate_function : callable
        Function that computes the rates of a rigid slider with respect to slip.
    rigid_point_function : callable
        Function that computes stress, slip rate and states of a rigid slider.
    """

    friction_functions: FrictionFunctions
    force_balance_function: Function
    functions_between_ruptures: MotionRegimeFunctions
    functions_in_rupture: MotionRegimeFunctions | None
    rigid_rate_function: Function
    rigid_point_function: Function


@cache
def assemble_scene_functions(
    friction_terms: friction.FrictionTerms,
    slip_rate_functions_builder: Callable[[FrictionFunctions], tuple[Function, Function]],
    rupture_rate_function_builder: Callable[[FrictionFunctions], Function] | None,
) -> SceneFunctions:
    """Assemble the equations of motion for a combination of parts.

    Parameters
    ----------
    friction_terms : FrictionTerms
        Contributions of the parts to friction.
    slip_rate_functions_builder : callable
        Function that receives a `FrictionFunctions` object and returns two functions, the force
        balance and the derivative of ln V.
    rupture_rate_function_builder : callable or None
        Function that receives a `FrictionFunctions` object and returns the rate function in
        ruptures. None if the dynamics have no inertia.

    Returns
    -------
    SceneFunctions
        Functions that define the equations of motion. The result is cached.
    """
    made = build_friction_functions(friction_terms)
    balance, growth = slip_rate_functions_builder(made)
    against = build_displacement_rate_function(
        made, balance, allows_reversed_slip=friction_terms.allows_reversed_slip
    )
    point_at = build_motion_point_assembling_function(made)
    point = build_point_function_between_ruptures(made, balance, growth, point_at)
    slow, full = (
        MotionRegimeFunctions(*build_rate_functions_between_ruptures(made, against), point),
        None,
    )
    if rupture_rate_function_builder is not None:
        rates = build_rate_functions_in_rupture(made, rupture_rate_function_builder(made))
        full = MotionRegimeFunctions(*rates, build_point_function_in_rupture(made, point_at))
    of_rigid = (
        build_rate_function_of_rigid_slider(made),
        build_point_function_of_rigid_slider(made, point_at),
    )
    return SceneFunctions(made, balance, slow, full, *of_rigid)


def state_indices_excluded_from_distance(scene: SceneView) -> tuple[int, ...]:
    """Return indices of states that the distance from steady sliding ignores.

    Parameters
    ----------
    scene : Scene
        Scene to examine.

    Returns
    -------
    tuple of int
        Indices of the states that are ignored when the distance from steady sliding is computed.
    """
    law, heat, source = scene.parts.law, scene.parts.temperature.unknowns, scene.pressure_source
    excluded = *(about.name for about in heat), *source.excluded_from_distance
    unknowns = enumerate((*heat, *source.unknowns), start=law.state_count)
    return tuple(n for n, about in unknowns if about.name in excluded)


def build_scene_functions(scene: SceneView, dynamics: Dynamics | None = None) -> SceneFunctions:
    """Build the functions that define the equations of motion of a scene.

    Parameters
    ----------
    scene : Scene
        Scene to build the functions for.
    dynamics : Dynamics, optional
        Dynamics that replace the dynamics of the scene.

    Returns
    -------
    SceneFunctions
        Functions that define the equations of motion.
    """
    law, stress, source = scene.parts.law, scene.parts.normal_stress, scene.pressure_source
    of_shear_stress = friction.shear_stress_effect_on_state if law.stress_dependence else None
    effects = stress.state_effect, law.state_effect, of_shear_stress
    acting = scene.dynamics if dynamics is None else dynamics
    parts = friction.FrictionTerms(
        law_state_count=law.state_count,
        evolutions=law.evolutions or wrap_single_state_evolution(law.evolution),
        steady_states=law.steady_states or default_steady_state,
        stress_effects_on_state=tuple(effect for effect in effects if effect is not None),
        allows_reversed_slip=law.regularised,
        normal_stress=stress.normal_stress,
        auxiliary_unknown_count=len(source.unknowns),
        auxiliary_rates=source.auxiliary_rates,
        auxiliary_steady_states=source.auxiliary_steady_states,
        boundary_pressure_index=-1 - len(scene.parts.fluid.unknowns)
        if scene.parts.loading.has_stress_unknowns
        else 0,
        has_load_point_unknown=scene.parts.loading.has_load_point_unknown,
        state_indices_excluded_from_distance=state_indices_excluded_from_distance(scene),
        temperature=build_temperature_terms(scene),
    )
    return assemble_scene_functions(
        parts, acting.build_slip_rate_functions, acting.build_rupture_rate_function
    )
