"""The equations of motion of a scene, made of its friction (read that first) and its dynamics.

Between ruptures spring stress f and the state Psi (or the states of a law that has several) are all
that changes, against slip plus load point displacement, ds = (V + V_0) dt:

    df/ds = K (V_0 - V)/(V + V_0),   dPsi/ds = V/(V + V_0) dPsi/d(delta),   dt/ds = 1/(V + V_0),

with x = ln(V/V_*) and x_0 = ln(V_0/V_*). How x follows from f and Psi is for the dynamics to say
(see `dynamics`). In ruptures, the full equations tell all changes against inertial time.

Both are integrated along the path in displacement, or inertial time, and ln V together,
d(sigma)**2 = ds**2 + (dx/6)**2, with K (V_0 - V)/(V + V_0) - dPsi/ds over a for dx/ds. While
contact heals, or slip comes to its end after a rupture, ln V falls as the logarithm of s or of what
is left of the time: a step in either would have to be a part of all that has passed, or is to come;
along the path it is a few units of ln V. Where slip is fastest, a path that bends within one unit
of ln V would cost more steps than one that bends within six (four to twelve do as well).

A rigid slider has its slip rate prescribed, and slip for a clock.

Functions here take functions and return one of floats, as in `friction`; `build_scene_functions`
puts all of them together.
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

if TYPE_CHECKING:
    from rsfstudy.slider.dynamics import Dynamics

#: ln(V/V_*) below which slip counts as stopped, 10^-290: a motion ends there if nothing loads it.
STOPPED_LOG_SLIP_RATE = -290.0 * math.log(10.0)

#: Where slip is slower than V_0 by this in ln V, contact is stationary: the state then changes by
#: less than exp(-100) of itself over all the slip there is.
STATIONARY_CONTACT_LOG_VELOCITY_RATIO = 100.0

#: Units of ln V that are as long a way as slip of D_c, or inertial time.
LOG_RATE_PER_PATH_LENGTH = 6.0
#: From where on the square of a slant, and 1 more than that, are the same number.
MAX_FINITE_PATH_SLOPE = 1e9


# ---- clocks --------------------------------------------------------------------------------------

VelocityRatios = tuple[float, float, float]


def velocity_ratios(log_slip_rate: float, p: Numbers) -> VelocityRatios:
    """ln(V/V_*), V_0/V, and the fraction V/(V + V_0) that slip has in slip and load point
    displacement together.

    Where slip is much slower than the load point, ln V is that of stationary contact: evolution per
    unit slip may grow like 1/V there, so that its product with the fraction has a limit, whose
    factors would underflow and overflow.
    """
    least = p[LOG_LOAD_VELOCITY] - STATIONARY_CONTACT_LOG_VELOCITY_RATIO
    x = least if log_slip_rate < least else log_slip_rate
    slower = math.exp(p[LOG_LOAD_VELOCITY] - x)
    return x, slower, 1.0 / (1.0 + slower)


def time_per_displacement(velocity_ratio_values: VelocityRatios, p: Numbers) -> float:
    """Time over slip and load point displacement together, ``1/(V + V_0)``."""
    x, slower, fraction = velocity_ratio_values
    if p[LOAD_VELOCITY] != 0.0:
        return slower * fraction / abs(p[LOAD_VELOCITY])
    return math.exp(-max(x, STOPPED_LOG_SLIP_RATE))


def displacement_per_path_length(path_slope: float) -> float:
    """Displacement along a path that is so steep: its square may overflow where slip stops."""
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
    """``(state, p) -> (df/ds, dPsi/ds, velocity ratios)``.

    Where slip may reverse, so may the load point, and displacement is the magnitudes of both
    together: ``df/ds = K (V_0 - V)/(|V| + |V_0|)``, V having the sign of shear stress.
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
    """``(state, p) -> tuple``: derivatives of f and the states against displacement, along the
    path, and along the path with time as a passenger.
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
            (loading - state_sum(changes)) / (LOG_RATE_PER_PATH_LENGTH * p[A])
        )
        return (along * loading, *times(changes, along))

    def rates_along_path_with_time(state: Numbers, p: Numbers) -> Numbers:
        loading, changes, ratios = displacement_rate_function(state, p)
        along = displacement_per_path_length(
            (loading - state_sum(changes)) / (LOG_RATE_PER_PATH_LENGTH * p[A])
        )
        return (along * loading, *times(changes, along), along * time_per_displacement(ratios, p))

    return rates_by_displacement, rates_along_path, rates_along_path_with_time


# ---- rates in ruptures, and of a rigid slider ----------------------------------------------------


def build_rate_functions_in_rupture(
    friction_functions: FrictionFunctions, rupture_rate_function: Function
) -> tuple[Function, Function, Function]:
    """``(state, p) -> tuple``: derivatives of the unknowns f, x, g and the states but the first
    against inertial time, along the path in that and ln V, and so with that time as a passenger.
    """
    end = 2 + friction_functions.state_count
    times = build_tuple_scaling_function(end)

    def rates_along_path(state: Numbers, p: Numbers) -> Numbers:
        by = rupture_rate_function(state, p)
        return times(by, displacement_per_path_length(by[1] / LOG_RATE_PER_PATH_LENGTH))

    def rates_along_path_with_time(state: Numbers, p: Numbers) -> Numbers:
        by = rupture_rate_function(state[:end], p)
        along = displacement_per_path_length(by[1] / LOG_RATE_PER_PATH_LENGTH)
        return (*times(by, along), along)

    return rupture_rate_function, rates_along_path, rates_along_path_with_time


def build_rigid_rate_function(friction_functions: FrictionFunctions) -> Function:
    """``(state, p) -> tuple``: derivatives of g and the states but the first, against slip at the
    ln(V/V_*) that stands last in `p`: ``strength'(g) dg = dPsi``.
    """
    strength, states_at = friction_functions.strength, friction_functions.states_from_strength
    evolutions, contribution = friction_functions.evolutions, friction_functions.state_contribution

    def rigid_rate(state: Numbers, p: Numbers) -> Numbers:
        others = state[1:]
        value, slope, shift, _shift_slope = strength(state[0], others, p)
        changes = evolutions(p[-1], states_at(value, p[-1], others, p), shift, 1.0, p)
        return (contribution(changes, state[0], others, p) / slope, *changes[1:])

    return rigid_rate


# ---- points --------------------------------------------------------------------------------------


def build_point_assembling_function(friction_functions: FrictionFunctions) -> Function:
    """``(x, growth, forces, states, changes, shift, p) -> MotionPoint`` at x = ln(V/V_*), which
    grows so: of forces, f and its change, g and its change; the states, their changes, and what
    stress has taken from them.

    A rig reads the friction coefficient ``(mu_* + f)/s``, s outside the fault.
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
            psi - shift,
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
    """``(state, rates, p) -> MotionPoint`` between ruptures, where ``a dx = strength'(g) dg -
    contribution`` says how g changes.
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
    """``(state, rates, p) -> MotionPoint`` of the full equations."""
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


def build_rigid_point_function(
    friction_functions: FrictionFunctions, assemble_point: Function
) -> Function:
    """``(state, rates, p) -> MotionPoint`` of a rigid slider, whose f is g."""
    strength, states_at = friction_functions.strength, friction_functions.states_from_strength

    def point(state: Numbers, rates: Numbers, p: Numbers) -> MotionPoint:
        g, others, x = state[0], state[1:], p[-1]
        value, _slope, shift, _shift_slope = strength(g, others, p)
        psis = states_at(value, x, others, p)
        return assemble_point(x, 0.0, (g, rates[0], g, rates[0]), psis, rates, shift, p)

    return point


# ---- all of it -----------------------------------------------------------------------------------


class RegimeFunctions(NamedTuple):
    """Equations of a scene between ruptures, or the full ones in them.

    Attributes
    ----------
    rates_against_clock, rates_along_path, rates_along_path_with_time : callable
        ``(state, p)``: derivatives of the unknowns against slip and load point displacement
        together, or inertial time; along the path; and so with time as a passenger.
    build_point_assembling_function : callable
        ``(state, derivatives, p) -> MotionPoint``.
    """

    rates_against_clock: Function
    rates_along_path: Function
    rates_along_path_with_time: Function
    point_function: Function


class SceneFunctions(NamedTuple):
    """The functions of a scene.

    Attributes
    ----------
    friction_functions : FrictionFunctions
        What they are made of.
    force_balance_function : callable
        ``(spring, psis, p)``: ln(V/V_*), frictional stress and the state lost to stress, between
        ruptures.
    functions_between_ruptures : RegimeFunctions
    functions_in_rupture : RegimeFunctions or None
        Where mass acts.
    build_rigid_rate_function, build_rigid_point_function : callable
        Those of a rigid slider, against slip.
    """

    friction_functions: FrictionFunctions
    force_balance_function: Function
    functions_between_ruptures: RegimeFunctions
    functions_in_rupture: RegimeFunctions | None
    rigid_rate_function: Function
    rigid_point_function: Function


@cache
def assemble_scene_functions(
    friction_terms: friction.FrictionTerms,
    slip_rate_functions_builder: Callable[[FrictionFunctions], tuple[Function, Function]],
    rupture_rate_function_builder: Callable[[FrictionFunctions], Function] | None,
) -> SceneFunctions:
    """The functions of a combination of parts; the same ones whenever it is asked for."""
    made = build_friction_functions(friction_terms)
    balance, growth = slip_rate_functions_builder(made)
    against = build_displacement_rate_function(
        made, balance, allows_reversed_slip=friction_terms.allows_reversed_slip
    )
    point_at = build_point_assembling_function(made)
    point = build_point_function_between_ruptures(made, balance, growth, point_at)
    slow, full = RegimeFunctions(*build_rate_functions_between_ruptures(made, against), point), None
    if rupture_rate_function_builder is not None:
        rates = build_rate_functions_in_rupture(made, rupture_rate_function_builder(made))
        full = RegimeFunctions(*rates, build_point_function_in_rupture(made, point_at))
    of_rigid = build_rigid_rate_function(made), build_rigid_point_function(made, point_at)
    return SceneFunctions(made, balance, slow, full, *of_rigid)


def state_indices_excluded_from_distance(scene: SceneView) -> tuple[int, ...]:
    """Return the indices of states excluded from the distance from steady sliding."""
    law, source = scene.parts.law, scene.pressure_source
    unknowns = enumerate(source.unknowns, start=law.state_count)
    return tuple(n for n, about in unknowns if about.name in source.excluded_from_distance)


def build_scene_functions(scene: SceneView, dynamics: Dynamics | None = None) -> SceneFunctions:
    """The functions of a scene, with other dynamics than its own where some are given."""
    law, stress, source = scene.parts.law, scene.parts.normal_stress, scene.pressure_source
    of_shear_stress = friction.shear_stress_effect_on_state if law.stress_dependence else None
    effects = stress.state_effect, law.state_effect, of_shear_stress
    acting = scene.dynamics if dynamics is None else dynamics
    parts = friction.FrictionTerms(
        law_state_count=law.state_count,
        evolutions=law.evolutions or wrap_single_state_evolution(law.evolution),
        steady_states=law.steady_states or default_steady_state,
        state_effects=tuple(effect for effect in effects if effect is not None),
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
    )
    return assemble_scene_functions(
        parts, acting.build_slip_rate_functions, acting.build_rupture_rate_function
    )
