r"""Rates of the unknowns of a scene.

Between ruptures, the unknowns are the spring stress :math:`f` and the states :math:`\Psi`. The
independent variable :math:`\delta` is slip plus load point displacement,
:math:`d\delta = (V + V_0) \, dt`:

.. math::

    \frac{df}{d\delta} = \frac{K (V_0 - V)}{V + V_0}, \qquad
    \frac{d\Psi}{d\delta} = \frac{V}{V + V_0} \frac{d\Psi}{d(\mathrm{slip})}, \qquad
    \frac{dt}{d\delta} = \frac{1}{V + V_0}.

The dynamics of the scene determine the slip rate from :math:`f` and :math:`\Psi`. In ruptures, the
equations of motion include inertia. The independent variable of these equations is inertial time,
which is time in units of :math:`T/(2 \pi)`. In both regimes, the integrators use path length as the
independent variable (see the module ``integration_path_length``).

For a rigid slider, the slip rate is prescribed, and slip is the independent variable.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.integration_path_length import (
    LOG_SLIP_RATE_PER_PATH_LENGTH,
    VelocityRatios,
    compute_displacement_per_path_length,
    compute_spring_stress_rate_with_noise,
    compute_time_per_displacement,
    compute_velocity_ratios,
)
from rsfstudy.slider.parameter_layout import LOAD_VELOCITY, MU_STAR, A
from rsfstudy.slider.parts import FloatTuple, NumericFunction
from rsfstudy.slider.state_variable_functions import build_tuple_scaling_function


def build_rate_function_by_displacement(
    friction_functions: FrictionFunctions,
    force_balance_function: NumericFunction,
    *,
    allows_reversed_slip: bool,
) -> NumericFunction:
    r"""Return a function for the derivatives with respect to displacement.

    The returned function ``(state, p)`` computes the derivative of the spring stress, the
    derivatives of the states and the output of `compute_velocity_ratios`.

    Notes
    -----
    If slip may reverse, the displacement is the sum of the magnitudes of slip and load point
    displacement, and :math:`df/d\delta = K (V_0 - V)/(|V| + |V_0|)`. The slip rate :math:`V` has
    the sign of the shear stress.
    """
    evolutions, imposed, end = (
        friction_functions.state_evolutions,
        friction_functions.load_point_oscillation_stress,
        1 + friction_functions.state_count,
    )
    spring_stress_rate = friction_functions.spring_stress_rate

    def forward_rates(state: FloatTuple, p: FloatTuple) -> tuple[float, FloatTuple, VelocityRatios]:
        psis = state[1:end]
        log_slip_rate, _g, shift = force_balance_function(state[0], psis, p)
        ratios = compute_velocity_ratios(log_slip_rate, p)
        x, slower, fraction = ratios
        loading = spring_stress_rate(slower, 1.0, ratios, p)
        return loading, evolutions(x, psis, shift, fraction, p), ratios

    def reversible_rates(
        state: FloatTuple, p: FloatTuple
    ) -> tuple[float, FloatTuple, VelocityRatios]:
        _loading, changes, ratios = forward_rates(state, p)
        slower = ratios[1]
        slip = math.copysign(1.0, p[MU_STAR] + state[0] + imposed(state[1:end], p))
        load = math.copysign(slower, p[LOAD_VELOCITY])
        return spring_stress_rate(load, slip, ratios, p), changes, ratios

    return reversible_rates if allows_reversed_slip else forward_rates


@cache
def build_rate_functions_between_ruptures(
    friction_functions: FrictionFunctions,
    force_balance_function: NumericFunction,
    *,
    allows_reversed_slip: bool,
) -> tuple[NumericFunction, NumericFunction, NumericFunction]:
    """Return the functions that compute the rates of the unknowns between ruptures.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    force_balance_function : callable
        Function ``(spring, psis, p)`` of the dynamics (see ``Dynamics``).
    allows_reversed_slip : bool
        If True, the direction of slip and the direction of the load point motion may reverse.

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
    displacement_rate_function = build_rate_function_by_displacement(
        friction_functions, force_balance_function, allows_reversed_slip=allows_reversed_slip
    )

    def rates_by_displacement(state: FloatTuple, p: FloatTuple) -> FloatTuple:
        loading, changes, _ratios = displacement_rate_function(state, p)
        return (loading, *changes)

    def rates_along_path(state: FloatTuple, p: FloatTuple) -> FloatTuple:
        loading, changes, _ratios = displacement_rate_function(state, p)
        along = compute_displacement_per_path_length(
            (loading - state_sum(changes)) / (LOG_SLIP_RATE_PER_PATH_LENGTH * p[A])
        )
        return (along * loading, *times(changes, along))

    def rates_along_path_with_time(state: FloatTuple, p: FloatTuple) -> FloatTuple:
        loading, changes, ratios = displacement_rate_function(state, p)
        along = compute_displacement_per_path_length(
            (loading - state_sum(changes)) / (LOG_SLIP_RATE_PER_PATH_LENGTH * p[A])
        )
        return (
            along * loading,
            *times(changes, along),
            along * compute_time_per_displacement(ratios, p),
        )

    return rates_by_displacement, rates_along_path, rates_along_path_with_time


@cache
def build_rate_functions_in_rupture(
    friction_functions: FrictionFunctions,
    build_rate_function_for_ruptures: Callable[[FrictionFunctions], NumericFunction],
) -> tuple[NumericFunction, NumericFunction, NumericFunction]:
    r"""Return the functions that compute the rates of the unknowns in ruptures.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.
    build_rate_function_for_ruptures : callable
        Function of the dynamics that builds the function for the derivatives with respect to
        inertial time (see ``Dynamics``).

    Returns
    -------
    rates_by_time, rates_along_path, rates_along_path_with_time : callable
        Functions ``(state, p) -> tuple`` that return the derivatives of the spring stress f, of
        :math:`x = \ln(V/V_*)`, of the frictional stress g and of all states except the first. The
        third function appends the derivative of inertial time.
    """
    rupture_rate_function = build_rate_function_for_ruptures(friction_functions)
    if friction_functions.spring_stress_rate is compute_spring_stress_rate_with_noise:
        rupture_rate_function = _add_noise_to_rupture_rates(rupture_rate_function)
    end = 2 + friction_functions.state_count
    times = build_tuple_scaling_function(end)

    def rates_along_path(state: FloatTuple, p: FloatTuple) -> FloatTuple:
        by = rupture_rate_function(state, p)
        return times(
            by, compute_displacement_per_path_length(by[1] / LOG_SLIP_RATE_PER_PATH_LENGTH)
        )

    def rates_along_path_with_time(state: FloatTuple, p: FloatTuple) -> FloatTuple:
        by = rupture_rate_function(state[:end], p)
        along = compute_displacement_per_path_length(by[1] / LOG_SLIP_RATE_PER_PATH_LENGTH)
        return (*times(by, along), along)

    return rupture_rate_function, rates_along_path, rates_along_path_with_time


def _add_noise_to_rupture_rates(rupture_rate_function: NumericFunction) -> NumericFunction:
    """Extend a rate function for ruptures so that the spring stress contains noise.

    If a scene has noise, its last two parameters are the inertial time and the noise rate.
    """

    def rates_with_noise(state: FloatTuple, p: FloatTuple) -> FloatTuple:
        by = rupture_rate_function(state, p)
        return (by[0] + p[-2] * p[-1], *by[1:])

    return rates_with_noise


@cache
def build_rate_function_of_rigid_slider(friction_functions: FrictionFunctions) -> NumericFunction:
    r"""Return the function that computes the rates of the unknowns of a rigid slider.

    The returned function ``(state, p) -> tuple`` computes derivatives with respect to slip. The
    tuple contains the derivative of g, followed by the derivatives of all states except the first.
    The last element of ``p`` is :math:`\ln(V/V_*)`.

    Notes
    -----
    At a constant slip rate, the friction relation gives
    :math:`\mathrm{strength}'(g) \, dg = d\Psi`.
    """
    strength, states_at = friction_functions.strength, friction_functions.states_from_strength
    evolutions, contribution = (
        friction_functions.state_evolutions,
        friction_functions.state_contribution_to_friction,
    )

    def rigid_rate(state: FloatTuple, p: FloatTuple) -> FloatTuple:
        others = state[1:]
        value, slope, shift, _shift_slope = strength(state[0], others, p)
        changes = evolutions(p[-1], states_at(value, p[-1], others, p), shift, 1.0, p)
        return (contribution(changes, state[0], others, p) / slope, *changes[1:])

    return rigid_rate
