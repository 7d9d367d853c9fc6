r"""Functions that compute the stress, the slip rate and the states at a point of a motion.

The module builds functions that compute a ``MotionPoint`` from the arguments ``(state, rates, p)``.
The argument ``state`` contains the unknowns of the equations of motion, ``rates`` contains the
derivatives of the unknowns, and ``p`` contains the parameters of the scene. Three sets of equations
with different unknowns are used: between ruptures, during ruptures, and for a rigid slider.
"""

from __future__ import annotations

from functools import cache

from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.motion_point import MotionPoint
from rsfstudy.slider.parameter_layout import MU_STAR, A
from rsfstudy.slider.parts import FloatTuple, NumericFunction


@cache
def build_motion_point_assembling_function(
    friction_functions: FrictionFunctions,
) -> NumericFunction:
    r"""Return a function that creates a ``MotionPoint`` from stresses and states.

    Parameters
    ----------
    friction_functions : FrictionFunctions
        Friction functions of the scene.

    Returns
    -------
    callable
        Function ``(x, growth, forces, states, changes, shift, p) -> MotionPoint``. The arguments
        ``x`` and ``growth`` are :math:`x = \ln(V/V_*)` and its derivative. The tuple ``forces``
        contains f, the derivative of f, g, and the derivative of g. The other arguments are the
        states, the derivatives of the states, the stress-induced decrease in the state variable,
        and the parameters.

    Notes
    -----
    The friction coefficient that a laboratory rig measures is :math:`(\mu_* + f)/s`. The normal
    stress ratio :math:`s` is computed with the pore pressure outside the fault.
    """
    steady_states, state_sum, counted = (
        friction_functions.steady_states,
        friction_functions.state_sum,
        friction_functions.state_indices_in_steady_state_distance,
    )
    effective_stress, stress = (
        friction_functions.effective_normal_stress,
        friction_functions.measured_effective_normal_stress,
    )
    state_variable = friction_functions.state_variable
    pressure, imposed, imposed_change = (
        friction_functions.boundary_pressure,
        friction_functions.load_point_oscillation_stress,
        friction_functions.load_point_oscillation_stress_change,
    )

    def point_at(
        x: float,
        growth: float,
        forces: FloatTuple,
        psis: FloatTuple,
        changes: FloatTuple,
        shift: float,
        p: FloatTuple,
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


@cache
def build_point_function_between_ruptures(
    friction_functions: FrictionFunctions,
    force_balance_function: NumericFunction,
    log_slip_rate_growth_function: NumericFunction,
) -> NumericFunction:
    """Return a function that computes the stress, slip rate and states between ruptures.

    The last two arguments are functions of the dynamics. They are documented in the class
    ``Dynamics``, with the arguments ``(spring, psis, p)`` and ``(unknowns, rates, x, g, p)``.

    Notes
    -----
    The derivative of g follows from the friction relation,
    ``a dx = strength'(g) dg - contribution``.
    """
    assemble_point = build_motion_point_assembling_function(friction_functions)
    strength, contribution, end = (
        friction_functions.strength,
        friction_functions.state_contribution_to_friction,
        1 + friction_functions.state_count,
    )

    def point(state: FloatTuple, rates: FloatTuple, p: FloatTuple) -> MotionPoint:
        unknowns, changes = state[:end], rates[1:end]
        f, psis = unknowns[0], unknowns[1:]
        x, g, _shift = force_balance_function(f, psis, p)
        x_change = log_slip_rate_growth_function(unknowns, rates[:end], x, g, p)
        _value, slope, shift, _shift_slope = strength(g, psis, p)
        g_change = (p[A] * x_change + contribution(changes, g, psis, p)) / slope
        return assemble_point(x, x_change, (f, rates[0], g, g_change), psis, changes, shift, p)

    return point


@cache
def build_point_function_in_rupture(friction_functions: FrictionFunctions) -> NumericFunction:
    """Return a function that computes the stress, slip rate and states in ruptures."""
    assemble_point = build_motion_point_assembling_function(friction_functions)
    strength, states_at, end = (
        friction_functions.strength,
        friction_functions.states_from_strength,
        2 + friction_functions.state_count,
    )

    def point(state: FloatTuple, rates: FloatTuple, p: FloatTuple) -> MotionPoint:
        f, x, g, others = state[0], state[1], state[2], state[3:end]
        value, _slope, shift, _shift_slope = strength(g, others, p)
        psis = states_at(value, x, others, p)
        return assemble_point(x, rates[1], (f, rates[0], g, rates[2]), psis, rates[:end], shift, p)

    return point


@cache
def build_point_function_of_rigid_slider(friction_functions: FrictionFunctions) -> NumericFunction:
    """Return a function that computes the stress, slip rate and states of a rigid slider.

    The spring stress f of a rigid slider is equal to the frictional stress g.
    """
    assemble_point = build_motion_point_assembling_function(friction_functions)
    strength, states_at = friction_functions.strength, friction_functions.states_from_strength

    def point(state: FloatTuple, rates: FloatTuple, p: FloatTuple) -> MotionPoint:
        g, others, x = state[0], state[1:], p[-1]
        value, _slope, shift, _shift_slope = strength(g, others, p)
        psis = states_at(value, x, others, p)
        return assemble_point(x, 0.0, (g, rates[0], g, rates[0]), psis, rates, shift, p)

    return point
