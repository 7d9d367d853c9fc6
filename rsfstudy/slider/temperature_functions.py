r"""Functions that compute the temperature rise and the effect of temperature on friction.

In the tuple of states, the temperature rise :math:`\vartheta` directly follows the states of the
law. With :math:`\Lambda = -\vartheta/(1 + \vartheta)`, the state :math:`\Psi = \Theta +
\mathrm{shift}_\sigma(g)`, in which :math:`\mathrm{shift}_\sigma` is the decrease in the state
variable due to stress, obeys

.. math::

    a \ln\frac{V}{V_*} + \Psi = \mathrm{strength}_\sigma(g) - a q_a \Lambda, \quad
    \mathrm{shift} = \mathrm{shift}_\sigma(g) - b q_b \Lambda,

so the two activation terms only change the strength and the shift that the law receives. The
parameters of the temperature follow the parameters of the law in the parameter tuple ``p``:
:math:`a q_a`, :math:`b q_b`, the pressurisation factor of the fluid, and the parameters that the
temperature part declares.

The function `build_temperature_dependent_functions` is the main function. The class
``friction.FrictionFunctions`` describes the arguments of the returned functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any, NamedTuple

from rsfstudy.slider.friction_relation import return_zero_normal_stress_change
from rsfstudy.slider.parameter_layout import LAW, MU_STAR, A, pack_temperature_parameter_values
from rsfstudy.slider.parts import FloatTuple, NumericFunction, collect_parameter_values
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.state_variable_functions import (
    build_tuple_sum_function,
    get_evolution_and_steady_state_functions,
)

#: Number of parameters that precede the parameters that the temperature part declares.
_PARAMETER_COUNT_BEFORE_PART_FIELDS = 3
#: Smallest temperature, relative to T_*. Lower temperatures occur only in trial steps of the
#: integrator.
_MIN_TEMPERATURE_TO_REFERENCE_RATIO = 1e-3
#: Limits of the effective normal stress, in sigma_*, that is computed from the friction
#: coefficient. The limits are exceeded only in trial steps of the integrator.
_MIN_NORMAL_STRESS, _MAX_NORMAL_STRESS = 1e-12, 1e12
#: Number of Newton iterations for the normal stress, if it depends nonlinearly on shear stress.
_NORMAL_STRESS_NEWTON_ITERATION_COUNT = 30
#: Largest change in ln V between two points along the branch of steady sliding.
_MAX_LOG_SLIP_RATE_CONTINUATION_STEP = 0.25
#: Value of ln(V/V_*) below which slip does not heat the fault, to double precision.
_MIN_LOG_SLIP_RATE_OF_HEATING = -60.0
#: Maximum number of secant iterations in the search for a steady temperature, relative tolerance of
#: the search, and largest last step that is accepted if rounding errors prevent convergence to this
#: tolerance.
_MAX_SECANT_COUNT, _ROOT_TOLERANCE, _STAGNATION_TOLERANCE = 30, 1e-14, 1e-10


class _TemperatureIndices(NamedTuple):
    """Indices of the temperature and its parameters in the tuples of states and parameters.

    The index of the state is negative. The index ``parameter_end_index`` is one greater than the
    index of the last parameter.
    """

    state_index: int
    first_parameter_index: int
    parameter_end_index: int


def build_temperature_dependent_functions(
    scene: SceneView, isothermal_functions: Mapping[str, Any]
) -> dict[str, Any]:
    """Build the friction functions that depend on the temperature of a scene.

    Parameters
    ----------
    scene : Scene
        Scene whose temperature is an unknown.
    isothermal_functions : mapping of str to object
        Attributes of the ``FrictionFunctions`` that the scene would have at constant temperature.

    Returns
    -------
    dict of str to object
        Attributes of ``FrictionFunctions`` that replace the isothermal functions.
    """
    parts, source, law_states = (
        scene.parts,
        scene.part_changing_effective_stress,
        scene.parts.law.state_count,
    )
    first = LAW + len(collect_parameter_values(parts.law, scene))
    end = first + len(pack_temperature_parameter_values(scene))
    places = _TemperatureIndices(-1 - len(source.unknowns), first, end)
    stress, oscillates = parts.normal_stress, parts.loading.adds_load_point_displacement_unknown
    normal_stress = _build_normal_stress_function(
        stress.normal_stress or return_zero_normal_stress_change,
        has_pressure=bool(source.unknowns) and not oscillates,
        is_linear=stress.normal_stress is None or stress.coupling is not None,
    )
    evolutions, steady_states = get_evolution_and_steady_state_functions(parts.law)
    replacements: dict[str, Any] = {
        "state_evolutions": _combine_law_temperature_and_other_rates(
            evolutions,
            source.auxiliary_rates,
            _build_temperature_rate_function(
                parts.temperature.temperature_rate, normal_stress, law_states, places
            ),
            law_states,
            first + 2 if parts.fluid.pressurisation_factor else 0,
        ),
        "steady_states": _insert_nan_for_steady_temperature(
            steady_states, source.auxiliary_steady_states
        ),
        "state_indices_in_steady_state_distance": tuple(
            i + (i >= law_states)
            for i in isothermal_functions["state_indices_in_steady_state_distance"]
        ),
    }
    if any(parts.temperature.dimensionless_activation_energies):
        contribution = isothermal_functions["state_contribution_to_friction"]
        replacements |= {
            "strength": _add_temperature_effect_to_strength(
                isothermal_functions["strength"], places
            ),
            "state_contribution_to_friction": _add_temperature_to_state_contribution(
                contribution, places
            ),
            "state_variable": _build_state_variable_function(places),
        }
    return replacements


# ---- effects on friction -------------------------------------------------------------------------


def compute_inverse_temperature_change(temperature_rise: float) -> float:
    r"""Compute the change in the inverse temperature due to a temperature rise.

    Parameters
    ----------
    temperature_rise : float
        Temperature rise :math:`\vartheta`.

    Returns
    -------
    float
        Value of :math:`\Lambda = T_*/T - 1`.
    """
    return -temperature_rise / max(1.0 + temperature_rise, _MIN_TEMPERATURE_TO_REFERENCE_RATIO)


def compute_thermal_friction_derivatives(
    temperature_rise: float, temperature_parameters: FloatTuple
) -> tuple[float, float]:
    r"""Compute the derivatives of the strength and of the shift with respect to temperature.

    Parameters
    ----------
    temperature_rise : float
        Temperature rise :math:`\vartheta`.
    temperature_parameters : tuple of float
        Parameters of the temperature, which start with :math:`a q_a` and :math:`b q_b`.

    Returns
    -------
    strength_derivative, shift_derivative : float
        Derivatives with respect to :math:`\vartheta`, :math:`a q_a/(1 + \vartheta)^2` and
        :math:`b q_b/(1 + \vartheta)^2`.
    """
    falling = max(1.0 + temperature_rise, _MIN_TEMPERATURE_TO_REFERENCE_RATIO) ** -2
    return temperature_parameters[0] * falling, temperature_parameters[1] * falling


@cache
def _add_temperature_effect_to_strength(
    strength_function: NumericFunction, temperature_indices: _TemperatureIndices
) -> NumericFunction:
    """Return a strength function that includes both temperature-dependent activation terms."""
    place, first, second = (
        temperature_indices.state_index,
        temperature_indices.first_parameter_index,
        temperature_indices.first_parameter_index + 1,
    )

    def thermal_strength(
        g: float, psis: FloatTuple, p: FloatTuple
    ) -> tuple[float, float, float, float]:
        value, slope, shift, shift_slope = strength_function(g, psis, p)
        change = compute_inverse_temperature_change(psis[place])
        return value - p[first] * change, slope, shift - p[second] * change, shift_slope

    return thermal_strength


@cache
def _add_temperature_to_state_contribution(
    contribution_function: NumericFunction, temperature_indices: _TemperatureIndices
) -> NumericFunction:
    """Return a function that computes how the states and the temperature change the friction."""
    place, first, end = (
        temperature_indices.state_index,
        temperature_indices.first_parameter_index,
        temperature_indices.parameter_end_index,
    )

    def thermal_contribution(
        changes: FloatTuple, g: float, psis: FloatTuple, p: FloatTuple
    ) -> float:
        gained = compute_thermal_friction_derivatives(psis[place], p[first:end])[0]
        return contribution_function(changes, g, psis, p) - gained * changes[place]

    return thermal_contribution


@cache
def _build_state_variable_function(temperature_indices: _TemperatureIndices) -> NumericFunction:
    r"""Return a function that computes the state variable.

    The returned function subtracts :math:`b q_b \Lambda` from the sum of the states minus the
    shift.
    """
    place, second = temperature_indices.state_index, temperature_indices.first_parameter_index + 1

    def state_variable(difference: float, psis: FloatTuple, p: FloatTuple) -> float:
        return difference - p[second] * compute_inverse_temperature_change(psis[place])

    return state_variable


# ---- evolution of the temperature ----------------------------------------------------------------


@cache
def _build_normal_stress_function(
    total_normal_stress_function: NumericFunction, *, has_pressure: bool, is_linear: bool
) -> NumericFunction:
    r"""Return a function that computes the effective normal stress.

    The arguments of the returned function are ``(friction, psis, p)``. The frictional stress
    :math:`g` solves :math:`\mu_* + g = \mu s(g)`. Newton's method needs a single iteration if the
    normal stress :math:`s` is a linear function of :math:`g`. If ``has_pressure`` is True, the last
    state reduces the normal stress.
    """
    iterations = 1 if is_linear else _NORMAL_STRESS_NEWTON_ITERATION_COUNT

    def normal_stress(friction: float, psis: FloatTuple, p: FloatTuple) -> float:
        g, pressure = friction - p[MU_STAR], psis[-1] if has_pressure else 0.0
        ratio = 1.0
        for _ in range(iterations):
            excess, change = total_normal_stress_function(g, p)
            ratio = 1.0 + excess - pressure
            resisting = max(1.0 - friction * change, _MIN_NORMAL_STRESS)
            step = (friction * ratio - p[MU_STAR] - g) / resisting
            g += step
            ratio += change * step
        return min(max(ratio, _MIN_NORMAL_STRESS), _MAX_NORMAL_STRESS)

    return normal_stress


@cache
def _build_temperature_rate_function(
    heating_function: NumericFunction,
    normal_stress_function: NumericFunction,
    law_state_count: int,
    temperature_indices: _TemperatureIndices,
) -> NumericFunction:
    r"""Return a function that computes the rate of change of the temperature rise.

    The arguments of the returned function are ``(x, psis, shift, fraction, p)``. The friction
    coefficient is :math:`\mu = \mu_* + a \ln V + \Psi - \mathrm{shift} - (b q_b - a q_a) \Lambda`.
    """
    place, first, end = (
        law_state_count,
        temperature_indices.first_parameter_index,
        temperature_indices.parameter_end_index,
    )
    own, state_sum = (
        first + _PARAMETER_COUNT_BEFORE_PART_FIELDS,
        build_tuple_sum_function(law_state_count),
    )

    def warming(x: float, psis: FloatTuple, shift: float, fraction: float, p: FloatTuple) -> float:
        rise, activated = psis[place], p[first + 1] - p[first]
        friction = p[MU_STAR] + p[A] * x + state_sum(psis) - shift
        friction -= activated * compute_inverse_temperature_change(rise)
        stress = normal_stress_function(friction, psis, p)
        return heating_function(x, rise, friction, stress, fraction, p[own:end])

    return warming


@cache
def _combine_law_temperature_and_other_rates(
    law_state_rates: NumericFunction,
    auxiliary_rates: NumericFunction | None,
    temperature_rate_function: NumericFunction,
    law_state_count: int,
    pressurisation_parameter_index: int,
) -> NumericFunction:
    """Combine the evolution functions of the law, the temperature and the other unknowns.

    The pressurisation index is 0 if heat does not change the pore pressure.
    """
    place, after = law_state_count, law_state_count + 1

    def evolutions(
        x: float, psis: FloatTuple, shift: float, fraction: float, p: FloatTuple
    ) -> FloatTuple:
        changes = law_state_rates(x, psis[:place], shift, fraction, p)
        return (*changes, temperature_rate_function(x, psis, shift, fraction, p))

    if auxiliary_rates is None:
        return evolutions

    def evolutions_with_others(
        x: float, psis: FloatTuple, shift: float, fraction: float, p: FloatTuple
    ) -> FloatTuple:
        changes = law_state_rates(x, psis[:place], shift, fraction, p)
        heated = temperature_rate_function(x, psis, shift, fraction, p)
        others = auxiliary_rates(x, psis[after:], fraction, p)
        pressed = (
            p[pressurisation_parameter_index] * heated if pressurisation_parameter_index else 0.0
        )
        return (*changes, heated, *others[:-1], others[-1] + pressed)

    return evolutions_with_others


# ---- steady sliding ------------------------------------------------------------------------------


@cache
def _insert_nan_for_steady_temperature(
    law_steady_states: NumericFunction, auxiliary_steady_states: NumericFunction | None
) -> NumericFunction:
    """Return a steady-state function that sets the temperature rise to NaN.

    The temperature rise is not computed here, because ``compute_steady_temperature_rise`` would
    have to solve an equation. The temperature rise is also not needed, because the distance from
    steady sliding does not depend on the temperature rise.
    """

    def steady_states(log_slip_rate: float, shift: float, p: FloatTuple) -> FloatTuple:
        return (*law_steady_states(log_slip_rate, shift, p), math.nan)

    if auxiliary_steady_states is None:
        return steady_states

    def all_steady_states(log_slip_rate: float, shift: float, p: FloatTuple) -> FloatTuple:
        of_law = law_steady_states(log_slip_rate, shift, p)
        return (*of_law, math.nan, *auxiliary_steady_states(log_slip_rate, p))

    return all_steady_states


@cached_per_scene
def compute_steady_temperature_rise(scene: SceneView, log_slip_rate: float) -> float:
    r"""Compute the temperature rise in steady sliding at a given slip rate.

    At a given slip rate, steady sliding may be possible at several temperatures. The function
    selects the temperature rise that changes continuously from zero as the slip rate changes from
    :math:`V_*` to the given slip rate.

    Parameters
    ----------
    scene : Scene
        Scene whose temperature is an unknown.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    float
        Temperature rise :math:`\vartheta`. The result is NaN if the temperature cannot be followed
        continuously to the given slip rate.
    """
    functions, p = scene.friction_law_functions, scene.friction_parameter_values
    place, activated = scene.parts.law.state_count, pack_temperature_parameter_values(scene)[1]

    def warming(x: float, rise: float) -> float:
        shift = -activated * compute_inverse_temperature_change(rise)
        steady = functions.steady_states(x, shift, p)
        psis = (*steady[:place], rise, *steady[place + 1 :])
        return float(functions.state_evolutions(x, psis, shift, math.exp(min(x, 0.0)), p)[place])

    log_slip_rate = max(log_slip_rate, _MIN_LOG_SLIP_RATE_OF_HEATING)
    count = max(1, math.ceil(abs(log_slip_rate) / _MAX_LOG_SLIP_RATE_CONTINUATION_STEP))
    # Without activation terms, only differences of temperature matter.
    coldest = -1.0 if any(scene.parts.temperature.dimensionless_activation_energies) else -math.inf
    rise, before = 0.0, 0.0
    for step in range(count + 1):
        x = log_slip_rate * step / count
        guess = 2.0 * rise - before if step > 1 else rise
        before = rise
        rise = _find_root_by_secants(partial(warming, x), guess)
        if not coldest < rise < math.inf:
            return math.nan
    return rise


def _find_root_by_secants(function: Callable[[float], float], guess: float) -> float:
    """Find a root close to a guess, or return NaN."""
    before, at = guess, guess + 1e-4 * (1.0 + abs(guess))
    value_before, value = function(before), function(at)
    if value_before == 0.0:
        return before
    step = math.inf
    for _ in range(_MAX_SECANT_COUNT):
        if value == value_before:
            break
        step = -value * (at - before) / (value - value_before)
        before, value_before, at = at, value, at + step
        if abs(step) <= _ROOT_TOLERANCE * abs(at):
            return at
        value = function(at)
    # Rounding errors of the function may prevent further convergence.
    return at if abs(step) <= _STAGNATION_TOLERANCE * (1.0 + abs(at)) else math.nan


def compute_thermal_friction_change(scene: SceneView, states: FloatTuple) -> float:
    r"""Compute the change in steady friction due to the temperature rise.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    states : tuple of float
        States of steady sliding.

    Returns
    -------
    float
        Change in the friction coefficient, :math:`(a q_a - b q_b) \Lambda`. The change is zero if
        the friction does not depend on temperature.
    """
    if not any(scene.parts.temperature.dimensionless_activation_energies):
        return 0.0
    direct, evolution = pack_temperature_parameter_values(scene)[:2]
    rise = states[scene.parts.law.state_count]
    return (direct - evolution) * compute_inverse_temperature_change(rise)
