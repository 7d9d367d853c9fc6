"""Inertia of the slider, defined by the period T of free oscillation.

If inertia is weak, the motion follows the slow manifold of the inertial equations of motion
(``build_slow_manifold_slip_rate_functions``). During ruptures, the inertial equations of motion are
integrated (``build_rate_function_for_ruptures``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.integration_path_length import compute_velocity_ratios
from rsfstudy.slider.parameter_layout import (
    DYNAMICS,
    LOAD_VELOCITY,
    LOG_SLIP_RATE_UPPER_LIMIT,
    STIFFNESS,
    A,
)
from rsfstudy.slider.parts import FloatTuple, NumericFunction, flag
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.state_variable_functions import build_function_adding_state_changes

#: Upper limit of the rates of the unknowns per unit of inertial time. Larger rates occur only in
#: trial steps of the integrator. A motion returns to the slow manifold long before its slip rate
#: changes at such a large rate.
MAX_RATE_OF_UNKNOWNS_PER_INERTIAL_TIME = 1e30
#: If the inertia weight is less than the first constant, the second-order term of the slow manifold
#: is negligible. If the inertia weight is less than the second constant, the derivative of the
#: first-order term is negligible. The third constant is the displacement step of difference
#: quotients, in D_c.
NEGLIGIBLE_SECOND_ORDER_WEIGHT, NEGLIGIBLE_GROWTH_WEIGHT, DIFFERENCE_STEP = 1e-7, 1e-9, 1e-6
#: Range of the ratio V_0/V in which the slip rate V is computed from the ratio. The ratio V_0/V is
#: outside this range in extreme trial steps, if the load point is stationary, or if the contact is
#: stationary.
MIN_VELOCITY_RATIO, MAX_VELOCITY_RATIO = 1e-60, 1e40


def build_slow_manifold_slip_rate_functions(
    friction_functions: FrictionFunctions,
) -> tuple[NumericFunction, NumericFunction]:
    r"""Return the functions that compute the slip rate on the slow manifold.

    See ``Dynamics`` for the argument and for the returned functions.

    Notes
    -----
    The frictional stress :math:`g` equals the spring stress :math:`f` minus the stress that
    accelerates the mass. We write :math:`x = \ln(V/V_*)`, :math:`S` for the function ``strength``
    and :math:`s` for the sum of slip and load point displacement. The inertial equations of motion
    are

    .. math::

        f - g = r = a W(x) \frac{dx}{ds}, \quad a x = S(f - r) - \Psi.

    The inertia weight, which measures the effect of the mass, is :math:`W(x) = (K/a) w (w + w_0)`,
    with :math:`w = V T/(2 \pi D_c)` and :math:`w_0 = V_0 T/(2 \pi D_c)`. If :math:`W` is small,
    :math:`r` is small as well, and the solution is a series in :math:`W`. The series starts with
    the motion without inertia:

    .. math::

        x_0 = \frac{S(f) - \Psi}{a}, \quad
          G(x) = \frac{1}{a} \left[S'(f) \frac{df}{ds}(x) - \frac{d\Psi}{ds}(x)\right].

    Here :math:`G(x)` is the derivative of :math:`x_0` along a motion with the slip rate :math:`x`.
    The first-order and second-order terms are

    .. math::

        r_1 = a W(x_0) G(x_0), \quad x_1 = x_0 - S'(f) \frac{r_1}{a},

        r_2 = a W(x_1) \left[G(x_1) - \frac{d(x_0 - x_1)}{ds}\right], \quad
          x_2 = \frac{S(f - r_2) - \Psi}{a}.

    The error of :math:`r_2` and :math:`x_2` is of order :math:`W^3`, which is of order :math:`w^6`.

    The inner functions compute the following terms:

    - ``quasi_static_values`` returns :math:`x_0`, :math:`G(x_0)`, :math:`S'(f)` and :math:`W(x_0)`.
    - ``inertial_stress`` returns :math:`r_2`. In this function, ``first`` is :math:`r_1`,
      ``trails`` is :math:`x_0 - x_1`, ``slowed`` is :math:`x_1`, ``changes`` are the derivatives
      :math:`d\Psi/ds` at :math:`x_1` and at the shift of :math:`f - r_1`, and ``growing`` is
      :math:`G(x_1)`. The derivative :math:`d(x_0 - x_1)/ds` is a difference quotient with the step
      ``DIFFERENCE_STEP``.
    - ``balance`` returns :math:`x_2` and :math:`f - r_2`.
    - ``log_slip_rate_offset`` returns :math:`x_2 - x_0`, computed with the slope of :math:`S` at
      the midpoint.
    - ``growth`` returns :math:`dx_2/ds`, the sum of :math:`G` along the motion and a difference
      quotient of ``log_slip_rate_offset``.

    If the scene has pore pressure, ``state_contribution_to_friction`` replaces :math:`d\Psi/ds` in
    :math:`G`.
    """
    strength, state_sum, evolutions = (
        friction_functions.strength,
        friction_functions.state_sum,
        friction_functions.state_evolutions,
    )
    contribution, spring_stress_rate, ahead = (
        friction_functions.state_contribution_to_friction,
        friction_functions.spring_stress_rate,
        build_function_adding_state_changes(friction_functions.state_count),
    )

    def balance(
        spring_stress: float, psis: FloatTuple, p: FloatTuple
    ) -> tuple[float, float, float]:
        alone = quasi_static_values(spring_stress, psis, p)
        g = spring_stress - inertial_stress(spring_stress, psis, alone, p)
        if g == spring_stress:  # The effect of inertia is below the rounding error.
            return alone[0], g, alone[4]
        value, _slope, shift, _shift_slope = strength(g, psis, p)
        return (value - state_sum(psis)) / p[A], g, shift

    def inertial_stress(
        spring_stress: float, psis: FloatTuple, alone: FloatTuple, p: FloatTuple
    ) -> float:
        """Compute the stress that accelerates the mass, in units of sigma_*.

        The quasi-static motion is passed as the tuple that ``quasi_static_values`` returns.
        """
        x, growing, slope, weight, _shift = alone
        first = compute_bounded_inertial_stress(weight, growing, p)
        if weight <= NEGLIGIBLE_SECOND_ORDER_WEIGHT:
            return first
        trails = slope * first / p[A]
        ratios = compute_velocity_ratios(x - trails, p)
        slowed, slower, fraction = ratios
        shift = strength(spring_stress - first, psis, p)[2]
        loading = spring_stress_rate(slower, 1.0, ratios, p)
        changes = evolutions(slowed, psis, shift, fraction, p)
        growing = (slope * loading - contribution(changes, spring_stress, psis, p)) / p[A]
        _x, growing_ahead, slope_ahead, weight_ahead, _shift = quasi_static_values(
            spring_stress + DIFFERENCE_STEP * loading, ahead(psis, changes, DIFFERENCE_STEP), p
        )
        trails_ahead = (
            slope_ahead * compute_bounded_inertial_stress(weight_ahead, growing_ahead, p) / p[A]
        )
        return compute_bounded_inertial_stress(
            compute_inertia_weight(slowed, slower, p),
            growing - (trails_ahead - trails) / DIFFERENCE_STEP,
            p,
        )

    def quasi_static_values(spring_stress: float, psis: FloatTuple, p: FloatTuple) -> FloatTuple:
        """Compute the quasi-static motion and the inertia weight.

        The returned tuple contains ln(V/V_*), its derivative, the slope of the strength, the
        inertia weight and the decrease in the state due to stress.
        """
        a = p[A]
        value, slope, shift, _shift_slope = strength(spring_stress, psis, p)
        x = (value - state_sum(psis)) / a
        ratios = compute_velocity_ratios(x, p)
        clamped, slower, fraction = ratios
        loading = spring_stress_rate(slower, 1.0, ratios, p)
        changes = evolutions(clamped, psis, shift, fraction, p)
        growing = (slope * loading - contribution(changes, spring_stress, psis, p)) / a
        return x, growing, slope, compute_inertia_weight(x, slower, p), shift

    def log_slip_rate_offset(spring_stress: float, psis: FloatTuple, p: FloatTuple) -> float:
        """Compute the difference between ln V and its quasi-static value.

        The function does not subtract two values of ln V, because rounding errors would then affect
        the derivative of the difference.
        """
        taken = inertial_stress(spring_stress, psis, quasi_static_values(spring_stress, psis, p), p)
        return -strength(spring_stress - 0.5 * taken, psis, p)[1] * taken / p[A]

    def growth(state: FloatTuple, rates: FloatTuple, x: float, g: float, p: FloatTuple) -> float:
        """Compute the derivative of ln V along the motion.

        The derivative includes the rate of change of ``log_slip_rate_offset``. Without this
        contribution, the peak slip rate would occur too early, by a slip distance of
        ``(K/a) w**2`` in units of D_c.
        """
        spring_stress, psis = state[0], state[1:]
        slope = strength(spring_stress, psis, p)[1]
        quasi_static = (slope * rates[0] - contribution(rates[1:], spring_stress, psis, p)) / p[A]
        if (
            compute_inertia_weight(x, compute_velocity_ratios(x, p)[1], p)
            <= NEGLIGIBLE_GROWTH_WEIGHT
        ):
            return quasi_static
        then = log_slip_rate_offset(
            spring_stress + DIFFERENCE_STEP * rates[0], ahead(psis, rates[1:], DIFFERENCE_STEP), p
        )
        return (
            quasi_static + (then - log_slip_rate_offset(spring_stress, psis, p)) / DIFFERENCE_STEP
        )

    return balance, growth


def compute_bounded_inertial_stress(
    inertia_weight: float, log_slip_rate_derivative: float, p: FloatTuple
) -> float:
    r"""Compute the bounded stress that accelerates the mass.

    The magnitude of the stress is limited to :math:`a`. A motion leaves the slow manifold long
    before the accelerating stress reaches this limit. The limit is exceeded only in trial steps of
    the integrator. In such trial steps, the limited stress is finite and has the correct sign.

    Parameters
    ----------
    inertia_weight : float
        Inertia weight :math:`W`.
    log_slip_rate_derivative : float
        Derivative of :math:`\ln V` with respect to displacement.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    float
        Stress in :math:`\sigma_*`, between :math:`-a` and :math:`a`.
    """
    stress = p[A] * inertia_weight * log_slip_rate_derivative
    return stress if abs(stress) < p[A] else max(-p[A], min(stress, p[A]))


def compute_inertia_weight(
    log_slip_rate: float, load_to_slip_velocity_ratio: float, p: FloatTuple
) -> float:
    r"""Compute the inertia weight, which measures the effect of the mass.

    The inertia weight is the lag of :math:`\ln V` behind its quasi-static value, divided by the
    derivative of :math:`\ln V`. If possible, the function computes the slip rate from the ratio
    ``load_to_slip_velocity_ratio``, because this avoids evaluating an exponential function.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    load_to_slip_velocity_ratio : float
        Ratio :math:`V_0/V`.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    float
        Inertia weight :math:`W = (K/a) w (w + w_0)`.
    """
    load = p[LOAD_VELOCITY] * p[DYNAMICS]
    if MIN_VELOCITY_RATIO < load_to_slip_velocity_ratio < MAX_VELOCITY_RATIO:
        norm = load / load_to_slip_velocity_ratio
    else:
        norm = math.exp(min(log_slip_rate + p[DYNAMICS + 1], LOG_SLIP_RATE_UPPER_LIMIT / 4.0))
    return p[STIFFNESS] / p[A] * norm * (norm + load)


def build_rate_function_for_ruptures(friction_functions: FrictionFunctions) -> NumericFunction:
    r"""Return the rate function of the inertial equations of motion.

    The unknowns are :math:`f`, :math:`x = \ln(V/V_*)`, :math:`g` and all states except the first.
    The independent variable is inertial time in units of :math:`T/(2 \pi)`. Because :math:`g` is an
    unknown, the function does not have to invert ``strength`` to compute :math:`g`.

    See ``Dynamics`` for the argument.

    Notes
    -----
    The equation of motion and the mass are

    .. math::

        m \frac{d^2\delta}{dt^2} = k (\delta_0 - \delta) - \tau, \quad
          \frac{m}{k} = \left(\frac{T}{2 \pi}\right)^2.

    With :math:`w = V T/(2 \pi D_c)` and the function ``strength``, written as :math:`S`, the
    derivatives with respect to inertial time are

    .. math::

        \dot{f} = K (w_0 - w), \quad \dot{x} = \frac{f - g}{K w}, \quad
          S'(g) \, \dot{g} = a \dot{x} + w \frac{d\Psi}{d\delta}.
    """
    strength, states_at = friction_functions.strength, friction_functions.states_from_strength
    evolutions, contribution = (
        friction_functions.state_evolutions,
        friction_functions.state_contribution_to_friction,
    )

    def rates(state: FloatTuple, p: FloatTuple) -> FloatTuple:
        spring_stress, x, g, others = state[0], state[1], state[2], state[3:]
        a, stiffness = p[A], p[STIFFNESS]
        log_norm = x + p[DYNAMICS + 1]
        if abs(log_norm) > LOG_SLIP_RATE_UPPER_LIMIT:
            log_norm = math.copysign(LOG_SLIP_RATE_UPPER_LIMIT, log_norm)
        norm = math.exp(log_norm)
        value, slope, shift, _shift_slope = strength(g, others, p)
        faster = limit_rate_per_inertial_time((spring_stress - g) / (stiffness * norm))
        changes = evolutions(x, states_at(value, x, others, p), shift, norm, p)
        return (
            limit_rate_per_inertial_time(stiffness * (p[LOAD_VELOCITY] * p[DYNAMICS] - norm)),
            faster,
            limit_rate_per_inertial_time(
                (a * faster + contribution(changes, g, others, p)) / slope
            ),
            *changes[1:],
        )

    return rates


def limit_rate_per_inertial_time(rate: float) -> float:
    """Limit the magnitude of a rate to ``MAX_RATE_OF_UNKNOWNS_PER_INERTIAL_TIME``.

    Parameters
    ----------
    rate : float
        Rate per inertial time.

    Returns
    -------
    float
        The rate, or the limit with the sign of the rate.
    """
    return (
        rate
        if abs(rate) < MAX_RATE_OF_UNKNOWNS_PER_INERTIAL_TIME
        else max(
            min(rate, MAX_RATE_OF_UNKNOWNS_PER_INERTIAL_TIME),
            -MAX_RATE_OF_UNKNOWNS_PER_INERTIAL_TIME,
        )
    )


@dataclass(frozen=True, kw_only=True)
class Inertia(Dynamics):
    r"""Slider with mass.

    Parameters
    ----------
    inertia : bool, default: False
        If True, the slider has mass. The mass follows from the fields ``period`` and
        ``reference_rate`` of the scene.

    Notes
    -----
    With the shear stress :math:`\tau` of the spring, the equation of motion is

    .. math::

        m \frac{dV}{dt} = \tau - \sigma \mu, \quad m = k \left(\frac{T}{2 \pi}\right)^2.
    """

    inertia: bool = flag(False, "1 if the slider has mass, otherwise 0")

    name = "inertia"
    field_name_that_selects_part = "inertia"
    regime_name = "slow_manifold"
    build_slip_rate_functions = staticmethod(build_slow_manifold_slip_rate_functions)
    build_rate_function_for_ruptures = staticmethod(build_rate_function_for_ruptures)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ("inertia",)

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        r"""Return the time scale of inertia and its logarithm.

        See ``Part.parameter_values``. The time scale is :math:`T V_*/(2 \pi D_c)`.
        """
        return scene.inertial_time, math.log(scene.inertial_time)

    def compute_slip_rate_norm(self, scene: SceneView, log_slip_rate: float) -> float:
        """Compute the slip rate norm, which measures the effect of inertia.

        See ``Dynamics.compute_slip_rate_norm``.
        """
        return scene.inertial_time * math.exp(log_slip_rate)

    @classmethod
    def build_field_rejection_error(cls, field_name: str, value: Any) -> InvalidValue:
        """Return the error for a field that belongs to another dynamics class.

        See ``Part.build_field_rejection_error``.
        """
        rule = "approximates inertia, so it cannot be combined with inertia=True"
        return InvalidValue(field_name, value, rule, remedy="Omit one of the two.")
