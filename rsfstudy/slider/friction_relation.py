r"""Friction relation between stress, slip rate and states.

With the deviation of frictional stress :math:`g = (\tau - \tau_*)/\sigma_*`, the normal stress
ratio :math:`s = \sigma/\sigma_*` and the state :math:`\Psi = \Theta + \mathrm{shift}(g)`, the
friction law :math:`\tau = \sigma [\mu_* + a \ln(V/V_*) + \Theta]` becomes

.. math::

    a \ln(V/V_*) + \Psi = \mathrm{strength}(g), \qquad
    \mathrm{strength}(g) = \frac{\mu_* + g}{s(g)} - \mu_* + \mathrm{shift}(g).

The shift is the stress-induced decrease in the state variable :math:`\Theta`, for example
:math:`\alpha \ln s`. The state :math:`\Psi` does not change when stress changes suddenly. Only the
evolution law changes :math:`\Psi`. If a law has several states, :math:`\Psi` is the sum of all
states.

The functions of this module take and return floats. The arguments are:

- ``g`` or ``frictional_stress`` is the deviation of the frictional stress from :math:`\tau_*`, in
  units of :math:`\sigma_*`.
- ``psis`` or ``states`` is the tuple of the states of the scene. The functions only use the
  unknowns that come after the states of the law, such as the pore pressure.
- ``p`` is the tuple of the parameters of the scene (see ``parameter_layout``).
- ``ratio`` and ``change`` are the normal stress ratio :math:`s` and its derivative with respect to
  ``g``.

A function for the effective or total normal stress returns ``(s - 1, slope)``. A function for the
effect of stress on the state takes the arguments ``(g, ratio, change, p)`` and returns ``(shift,
slope)``. A function for the friction relation takes the arguments ``(g, psis, p)`` and returns
``(strength, slope, shift, shift_slope)``. All slopes are derivatives with respect to ``g``.
"""

from __future__ import annotations

import math
from functools import cache

from rsfstudy.slider.parameter_layout import (
    LARGEST_NORMAL_STRESS_EXCESS,
    LOADING,
    MU_STAR,
    SMALLEST_NORMAL_STRESS_EXCESS,
    STRESS_DEPENDENCE,
    A,
)
from rsfstudy.slider.parts import FloatTuple, NumericFunction

#: Lower limit of the magnitude of the friction coefficient in scenes in which the slip direction
#: may reverse. At zero stress, the limit keeps the logarithm of the slip rate finite.
_MIN_NONZERO_FRICTION_COEFFICIENT = 1e-280


def return_zero_normal_stress_change(
    frictional_stress: float, p: FloatTuple
) -> tuple[float, float]:
    """Return a zero change in normal stress and a zero derivative."""
    return 0.0, 0.0


@cache
def build_effective_normal_stress_function(
    total_normal_stress_function: NumericFunction, pressure_index: int
) -> NumericFunction:
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

    def total_normal_stress(g: float, psis: FloatTuple, p: FloatTuple) -> tuple[float, float]:
        return total_normal_stress_function(g, p)

    def effective_normal_stress(g: float, psis: FloatTuple, p: FloatTuple) -> tuple[float, float]:
        excess, change = total_normal_stress_function(g, p)
        return min(
            max(excess - psis[pressure_index], SMALLEST_NORMAL_STRESS_EXCESS),
            LARGEST_NORMAL_STRESS_EXCESS,
        ), change

    return effective_normal_stress if pressure_index else total_normal_stress


@cache
def build_pore_pressure_function(pressure_index: int) -> NumericFunction:
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

    def pressure(psis: FloatTuple) -> float:
        return psis[pressure_index]

    return pressure if pressure_index else return_zero_pore_pressure


def return_zero_pore_pressure(states: FloatTuple) -> float:
    """Return zero pore pressure."""
    return 0.0


FrictionRelationValues = tuple[float, float, float, float]


def compute_strength_at_constant_normal_stress(
    frictional_stress: float, states: FloatTuple, p: FloatTuple
) -> FrictionRelationValues:
    """Evaluate the friction relation at constant normal stress.

    The function is used for scenes in which stress does not change the state variable.
    """
    return frictional_stress, 1.0, 0.0, 0.0


def return_zero_stress_effect_on_state(
    frictional_stress: float,
    normal_stress_ratio: float,
    normal_stress_derivative: float,
    p: FloatTuple,
) -> tuple[float, float]:
    """Return a shift and slope of zero, because stress does not change the state."""
    return 0.0, 0.0


def build_strength_function(
    normal_stress_function: NumericFunction, state_effect_function: NumericFunction
) -> NumericFunction:
    r"""Return the friction relation for variable normal stress.

    The first argument is the function that computes the effective normal stress. The second
    argument is the function that computes the effect of stress on the state.

    Notes
    -----
    With :math:`q = s - 1 - s' g`, the function evaluates

    .. math::

        \frac{\tau}{\sigma} - \mu_* = \frac{g (1 - \mu_* s') - \mu_* q}{s}, \qquad
        \frac{\partial}{\partial g} \frac{\tau}{\sigma} = \frac{1 - \mu_* s' + q}{s^2}.

    If :math:`s - 1` is proportional to :math:`g`, :math:`q` is zero. The formula then keeps its
    relative accuracy for arbitrarily large :math:`g`.
    """

    def strength(g: float, psis: FloatTuple, p: FloatTuple) -> FrictionRelationValues:
        excess, change = normal_stress_function(g, psis, p)
        ratio, mu_star = 1.0 + excess, p[MU_STAR]
        bend, support = excess - change * g, 1.0 - mu_star * change
        value, slope = (g * support - mu_star * bend) / ratio, (support + bend) / (ratio * ratio)
        shift, shift_slope = state_effect_function(g, ratio, change, p)
        return value + shift, slope + shift_slope, shift, shift_slope

    return strength


def compute_shear_stress_effect_on_state(
    frictional_stress: float,
    normal_stress_ratio: float,
    normal_stress_derivative: float,
    p: FloatTuple,
) -> tuple[float, float]:
    r"""Compute the effect of shear stress on the state variable.

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


def build_sum_of_two_state_effects(
    first_effect: NumericFunction, second_effect: NumericFunction
) -> NumericFunction:
    """Return a function that adds two effects of stress on the state."""

    def combined_effect(
        g: float, ratio: float, change: float, p: FloatTuple
    ) -> tuple[float, float]:
        shift, slope = first_effect(g, ratio, change, p)
        other_shift, other_slope = second_effect(g, ratio, change, p)
        return shift + other_shift, slope + other_slope

    return combined_effect


def extend_relation_to_reversed_slip(forward_relation: NumericFunction) -> NumericFunction:
    r"""Return the friction relation of a fault that may slip backwards.

    The argument is the function that computes the friction relation for forward slip. In the
    returned friction relation, the logarithm of the slip rate is :math:`\ln(|V|/V_*)`.

    Notes
    -----
    In the regularised law :math:`V = 2 V_* \exp[-(\mu_* + \Theta)/a] \sinh[\tau/(a \sigma)]`, the
    slip rate has the same sign as the shear stress. The friction relation becomes

    .. math::

        a \ln\frac{|V|}{V_*} = \frac{|\tau|}{\sigma} + a \ln\left[1 - e^{-2 |\tau|/(a
        \sigma)}\right] - \mu_* - \Theta.

    For forward slip, the relative difference between the regularised law and the usual law is about
    :math:`e^{-2 \mu/a}`, which is 1e-46 for typical parameters.

    References
    ----------
    Rice and Ben-Zion (1996), Proc. Natl. Acad. Sci. 93, 3811-3818.
    """

    def reversible_relation(g: float, psis: FloatTuple, p: FloatTuple) -> FrictionRelationValues:
        forward, slope, shift, shift_slope = forward_relation(g, psis, p)
        a, mu_star = p[A], p[MU_STAR]
        coefficient_now = mu_star + forward - shift
        size = max(abs(coefficient_now), _MIN_NONZERO_FRICTION_COEFFICIENT)
        value = size + a * math.log(-math.expm1(-2.0 * size / a)) - mu_star + shift
        steeper = math.copysign(1.0 / math.tanh(size / a), coefficient_now)
        return value, (slope - shift_slope) * steeper + shift_slope, shift, shift_slope

    return reversible_relation


def build_strength_derivatives_by_pressure(
    normal_stress_function: NumericFunction, state_effect_function: NumericFunction
) -> NumericFunction:
    r"""Return a function that computes derivatives of strength with respect to pressure.

    The first argument is the function that computes the effective normal stress. The second
    argument is the function that computes the effect of stress on the state. The returned function
    ``(g, psis, p)`` computes the derivatives of strength and of the shift with respect to pore
    pressure, at constant frictional stress.

    Notes
    -----
    The derivative of strength is :math:`(\mu_* + g)/s^2` plus the derivative of the shift. To
    compute the derivative of the shift, the function for the effect of stress is called twice, and
    the two returned slopes are subtracted. The first slope is evaluated with a normal stress
    derivative of -1, and the second slope with a normal stress derivative of 0.
    """

    def pressure_derivatives(g: float, psis: FloatTuple, p: FloatTuple) -> tuple[float, float]:
        ratio = 1.0 + normal_stress_function(g, psis, p)[0]
        along = state_effect_function(g, ratio, -1.0, p)[1]
        shift = along - state_effect_function(g, ratio, 0.0, p)[1]
        return (p[MU_STAR] + g) / ratio**2 + shift, shift

    return pressure_derivatives


def return_zero_load_point_oscillation(states: FloatTuple, p: FloatTuple) -> float:
    """Return zero, because a load point that moves steadily adds no stress."""
    return 0.0


def compute_load_point_oscillation_stress(states: FloatTuple, p: FloatTuple) -> float:
    r"""Compute the shear stress :math:`K D` due to an oscillation of the load point.

    The unknown of the loading is the last element of the tuple of states. The stress is zero at the
    start of the oscillation.
    """
    return states[-1] - p[LOADING + 2]


def add_load_point_oscillation_to_argument(friction_function: NumericFunction) -> NumericFunction:
    """Return a friction function that includes the load point stress.

    The argument g of ``friction_function`` is the total frictional stress. The argument g of the
    returned function does not include the load point stress :math:`K D`.
    """

    def function_with_load_point_stress(g: float, psis: FloatTuple, p: FloatTuple) -> FloatTuple:
        return friction_function(g + compute_load_point_oscillation_stress(psis, p), psis, p)

    return function_with_load_point_stress


def build_strength_derivatives_by_load_point(strength_function: NumericFunction) -> NumericFunction:
    """Return a function that computes derivatives with respect to the load point stress.

    The argument is the function that computes the friction relation of the scene. The returned
    function ``(g, psis, p)`` computes the derivatives of strength and of the shift with respect to
    :math:`K D`. The derivatives are equal to the derivatives with respect to g.
    """

    def load_point_derivatives(g: float, psis: FloatTuple, p: FloatTuple) -> tuple[float, float]:
        _value, slope, _shift, shift_slope = strength_function(g, psis, p)
        return slope, shift_slope

    return load_point_derivatives
