r"""Effects of the temperature rise on friction, and its evolution.

The temperature rise :math:`\vartheta` is the first element of the tuple of states after the states
of the law. With :math:`\Lambda = -\vartheta/(1 + \vartheta)`, the state
:math:`\Psi = \Theta + \mathrm{shift}_\sigma(g)`, in which :math:`\mathrm{shift}_\sigma` is the
decrease of the state variable due to stress, obeys

.. math::

    a \ln\frac{V}{V_*} + \Psi = \mathrm{strength}_\sigma(g) - a q_a \Lambda, \quad
    \mathrm{shift} = \mathrm{shift}_\sigma(g) - b q_b \Lambda,

so the two activation terms only change the strength and the shift that the law receives. The
parameters of the temperature follow the parameters of the law in the parameter tuple ``p``:
:math:`a q_a`, :math:`b q_b`, the pressurisation factor of the fluid, and the parameters that the
temperature part declares.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from scipy.optimize import newton

from rsfstudy.slider.parameter_layout import (
    LAW,
    MU_STAR,
    A,
    temperature_parameter_values,
)
from rsfstudy.slider.parts import Function, Numbers, collect_parameter_values
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.state_functions import build_sum_function

#: Number of parameters that precede the parameters that the temperature part declares.
_COMMON_PARAMETER_COUNT = 3
#: Smallest temperature, relative to T_*. Lower temperatures occur only in trial steps of the
#: integrator.
_MIN_TEMPERATURE = 1e-3
#: Limits of the effective normal stress, in sigma_*, that is computed from the friction
#: coefficient. The limits are exceeded only in trial steps of the integrator.
_MIN_NORMAL_STRESS, _MAX_NORMAL_STRESS = 1e-12, 1e12
#: Number of Newton iterations for the normal stress, if it depends nonlinearly on shear stress.
_NORMAL_STRESS_ITERATION_COUNT = 30
#: Largest change of ln V between two points along the branch of steady sliding.
_MAX_LOG_SLIP_RATE_CHANGE = 0.25


class TemperatureTerms(NamedTuple):
    """Contributions of the temperature to the equations of a scene.

    Parameters
    ----------
    temperature_rate : callable
        Function ``temperature_rate`` of the temperature part.
    state_index : int
        Negative index of the temperature rise in the tuple of states.
    parameter_index : int
        Index of the first parameter of the temperature in ``p``.
    parameter_count : int
        Number of parameters.
    affects_friction : bool
        True if an activation term is not zero.
    changes_pressure : bool
        True if heating raises the pore pressure.
    normal_stress_is_linear : bool
        True if normal stress is a linear function of shear stress.
    """

    temperature_rate: Function
    state_index: int
    parameter_index: int
    parameter_count: int
    affects_friction: bool
    changes_pressure: bool
    normal_stress_is_linear: bool


def build_temperature_terms(scene: SceneView) -> TemperatureTerms | None:
    """Return the contributions of the temperature, or None if it is constant.

    Parameters
    ----------
    scene : Scene
        Scene with a temperature.

    Returns
    -------
    TemperatureTerms or None
        Contributions to the equations.
    """
    temperature, stress = scene.parts.temperature, scene.parts.normal_stress
    if not temperature.unknowns:
        return None
    return TemperatureTerms(
        temperature_rate=temperature.temperature_rate,
        state_index=-1 - len(scene.pressure_source.unknowns),
        parameter_index=LAW + len(collect_parameter_values(scene.parts.law, scene)),
        parameter_count=len(temperature_parameter_values(scene)),
        affects_friction=any(temperature.activation),
        changes_pressure=scene.parts.fluid.pressurisation_factor != 0.0,
        normal_stress_is_linear=stress.normal_stress is None or stress.coupling is not None,
    )


def inverse_temperature_change(rise: float) -> float:
    r"""Compute the change of the inverse temperature.

    Parameters
    ----------
    rise : float
        Temperature rise :math:`\vartheta`.

    Returns
    -------
    float
        Value of :math:`\Lambda = T_*/T - 1`.
    """
    return -rise / max(1.0 + rise, _MIN_TEMPERATURE)


def add_temperature_to_strength(strength_function: Function, terms: TemperatureTerms) -> Function:
    """Return a friction relation that depends on temperature.

    Parameters
    ----------
    strength_function : callable
        Function ``(g, psis, p) -> (strength, slope, shift, shift_slope)``.
    terms : TemperatureTerms
        Contributions of the temperature.

    Returns
    -------
    callable
        Function with the same arguments and values.
    """
    place, first = terms.state_index, terms.parameter_index
    second = first + 1

    def thermal_strength(g: float, psis: Numbers, p: Numbers) -> tuple[float, float, float, float]:
        value, slope, shift, shift_slope = strength_function(g, psis, p)
        change = inverse_temperature_change(psis[place])
        return value - p[first] * change, slope, shift - p[second] * change, shift_slope

    return thermal_strength


def build_state_variable_function(terms: TemperatureTerms) -> Function:
    r"""Return a function that removes the effect of temperature from the state.

    Parameters
    ----------
    terms : TemperatureTerms
        Contributions of the temperature.

    Returns
    -------
    callable
        Function ``(difference, psis, p)`` that returns :math:`\Theta`. The argument
        ``difference`` is :math:`\Psi - \mathrm{shift} = \Theta + b q_b \Lambda`.
    """
    place, second = terms.state_index, terms.parameter_index + 1

    def state_variable(difference: float, psis: Numbers, p: Numbers) -> float:
        return difference - p[second] * inverse_temperature_change(psis[place])

    return state_variable


def state_variable_at_constant_temperature(difference: float, psis: Numbers, p: Numbers) -> float:
    r"""Return the state variable at constant temperature.

    Parameters
    ----------
    difference : float
        Sum of the states of the law minus the shift.
    psis : tuple of float
        States of the scene. This argument is ignored.
    p : tuple of float
        Parameters of the scene. This argument is ignored.

    Returns
    -------
    float
        State variable :math:`\Theta`, which is equal to ``difference``.
    """
    return difference


def temperature_derivatives(rise: float, parameters: Numbers) -> tuple[float, float]:
    r"""Compute the derivatives of strength and shift with respect to temperature.

    Parameters
    ----------
    rise : float
        Temperature rise :math:`\vartheta`.
    parameters : tuple of float
        Parameters of the temperature, which start with :math:`a q_a` and :math:`b q_b`.

    Returns
    -------
    strength_derivative, shift_derivative : float
        Derivatives with respect to :math:`\vartheta`, :math:`a q_a/(1 + \vartheta)^2` and
        :math:`b q_b/(1 + \vartheta)^2`.
    """
    falling = max(1.0 + rise, _MIN_TEMPERATURE) ** -2
    return parameters[0] * falling, parameters[1] * falling


def add_temperature_to_contribution(
    contribution_function: Function, terms: TemperatureTerms
) -> Function:
    r"""Return the contribution of all states and temperature to the slip rate.

    Parameters
    ----------
    contribution_function : callable
        Function ``(changes, g, psis, p) -> float`` of the other states.
    terms : TemperatureTerms
        Contributions of the temperature.

    Returns
    -------
    callable
        Function with the same arguments. The function returns the decrease of
        :math:`a \ln(V/V_*)` due to changes of the states.
    """
    place, first = terms.state_index, terms.parameter_index
    end = first + 2

    def thermal_contribution(changes: Numbers, g: float, psis: Numbers, p: Numbers) -> float:
        gained = temperature_derivatives(psis[place], p[first:end])[0]
        return contribution_function(changes, g, psis, p) - gained * changes[place]

    return thermal_contribution


def build_normal_stress_from_friction_function(
    total_normal_stress_function: Function, *, has_pressure: bool, is_linear: bool
) -> Function:
    r"""Return a function for the normal stress at a friction coefficient.

    Parameters
    ----------
    total_normal_stress_function : callable
        Function ``(g, p) -> (sigma/sigma_* - 1, slope)``.
    has_pressure : bool
        Whether the last state is a pore pressure or a decrease of normal stress.
    is_linear : bool
        Whether normal stress is a linear function of shear stress.

    Returns
    -------
    callable
        Function ``(friction, psis, p)`` that returns the effective normal stress :math:`s` in
        :math:`\sigma_*`.

    Notes
    -----
    The frictional stress :math:`g` solves :math:`\mu_* + g = \mu s(g)`. Newton's method needs a
    single iteration if :math:`s` is a linear function of :math:`g`.
    """
    iterations = 1 if is_linear else _NORMAL_STRESS_ITERATION_COUNT

    def normal_stress(friction: float, psis: Numbers, p: Numbers) -> float:
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


def append_temperature_evolution(
    law_evolutions: Function,
    auxiliary_rates: Function | None,
    normal_stress_function: Function,
    law_state_count: int,
    terms: TemperatureTerms,
) -> Function:
    r"""Return an evolution function for law states, temperature and pressure.

    Parameters
    ----------
    law_evolutions : callable
        Function ``evolutions`` of the law.
    auxiliary_rates : callable or None
        Function ``auxiliary_rates`` of the loading and the fluid.
    normal_stress_function : callable
        Output of `build_normal_stress_from_friction_function`.
    law_state_count : int
        Number of states of the law.
    terms : TemperatureTerms
        Contributions of the temperature.

    Returns
    -------
    callable
        Function ``(log_slip_rate, psis, shift, fraction, p)`` that returns the changes of all
        states. The friction coefficient is
        :math:`\mu = \mu_* + a \ln V + \Psi - \mathrm{shift} - (b q_b - a q_a) \Lambda`.
    """
    place, first = law_state_count, terms.parameter_index
    own, end = first + _COMMON_PARAMETER_COUNT, first + terms.parameter_count
    after, rate, state_sum = place + 1, terms.temperature_rate, build_sum_function(law_state_count)
    changes_pressure = terms.changes_pressure

    def warming(x: float, psis: Numbers, shift: float, fraction: float, p: Numbers) -> float:
        rise, activated = psis[place], p[first + 1] - p[first]
        friction = p[MU_STAR] + p[A] * x + state_sum(psis) - shift
        friction -= activated * inverse_temperature_change(rise)
        stress = normal_stress_function(friction, psis, p)
        return rate(x, rise, friction, stress, fraction, p[own:end])

    def evolutions(x: float, psis: Numbers, shift: float, fraction: float, p: Numbers) -> Numbers:
        changes = law_evolutions(x, psis[:place], shift, fraction, p)
        return (*changes, warming(x, psis, shift, fraction, p))

    if auxiliary_rates is None:
        return evolutions

    def evolutions_with_pressure(
        x: float, psis: Numbers, shift: float, fraction: float, p: Numbers
    ) -> Numbers:
        others = auxiliary_rates(x, psis[after:], fraction, p)
        heated = warming(x, psis, shift, fraction, p)
        pressed = others[-1]
        if changes_pressure:
            pressed += p[first + 2] * heated
        changes = law_evolutions(x, psis[:place], shift, fraction, p)
        return (*changes, heated, *others[:-1], pressed)

    return evolutions_with_pressure


def insert_temperature_steady_state(
    law_steady_states: Function, auxiliary_steady_states: Function | None
) -> Function:
    """Return the steady states of a scene with a temperature.

    Parameters
    ----------
    law_steady_states : callable
        Function ``steady_states`` of the law.
    auxiliary_steady_states : callable or None
        Function ``auxiliary_steady_states`` of the loading and the fluid.

    Returns
    -------
    callable
        Function ``(log_slip_rate, shift, p)``. The temperature rise is NaN, because
        `steady_temperature_rise` must solve an equation for it. The distance from steady sliding
        does not contain the temperature rise.
    """

    def steady_states(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
        return (*law_steady_states(log_slip_rate, shift, p), math.nan)

    if auxiliary_steady_states is None:
        return steady_states

    def all_steady_states(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
        of_law = law_steady_states(log_slip_rate, shift, p)
        return (*of_law, math.nan, *auxiliary_steady_states(log_slip_rate, p))

    return all_steady_states


@cached_per_scene
def steady_temperature_rise(scene: SceneView, log_slip_rate: float) -> float:
    r"""Compute the temperature rise of steady sliding.

    Several temperatures may be steady at the same slip rate. The function follows the temperature
    from its value at :math:`V_*`, which is zero, to the slip rate.

    Parameters
    ----------
    scene : Scene
        Scene whose temperature is an unknown.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    float
        Temperature rise :math:`\vartheta`. The result is NaN if the steady temperature cannot be
        followed to the slip rate, for example because heat accumulates without limit.
    """
    functions, p = scene.equation_functions.friction_functions, scene.friction_parameter_values
    place = scene.parts.law.state_count
    evolution_term = temperature_parameter_values(scene)[1]

    def warming(rise: float, x: float) -> float:
        shift = -evolution_term * inverse_temperature_change(rise)
        steady = functions.steady_states(x, shift, p)
        psis = (*steady[:place], rise, *steady[place + 1 :])
        return float(functions.evolutions(x, psis, shift, math.exp(min(x, 0.0)), p)[place])

    count = max(1, math.ceil(abs(log_slip_rate) / _MAX_LOG_SLIP_RATE_CHANGE))
    rise, before = 0.0, 0.0
    for step in range(count + 1):
        x = log_slip_rate * step / count
        guess = 2.0 * rise - before if step > 1 else rise
        before = rise
        if warming(guess, x) == 0.0:
            rise = guess
            continue
        rise, solution = newton(
            warming, guess, args=(x,), tol=1e-18, rtol=1e-13, full_output=True, disp=False
        )
        if not solution.converged or not -1.0 < rise < math.inf:
            return math.nan
    return float(rise)


def thermal_friction_change(scene: SceneView, states: Numbers) -> float:
    r"""Compute the change of steady friction by the temperature rise.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters.
    states : tuple of float
        States of steady sliding.

    Returns
    -------
    float
        Change of the friction coefficient, :math:`(a q_a - b q_b) \Lambda`. The change is zero if
        the friction does not depend on temperature.
    """
    if not any(scene.parts.temperature.activation):
        return 0.0
    direct, evolution = temperature_parameter_values(scene)[:2]
    rise = states[scene.parts.law.state_count]
    return (direct - evolution) * inverse_temperature_change(rise)
