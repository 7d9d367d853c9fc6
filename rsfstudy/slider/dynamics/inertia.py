"""Inertia: the mass of the slider, through its period of free oscillation T.

Where mass hardly acts, the motion follows the slow manifold of the full equations; where it does,
the full equations themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.parameter_layout import (
    DYNAMICS,
    LARGEST_LOG_SLIP_RATE,
    LOAD_VELOCITY,
    STIFFNESS,
    A,
)
from rsfstudy.slider.parts import Function, Numbers, flag
from rsfstudy.slider.scene_functions import velocity_ratios
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.states import state_step_function

#: Rates beyond this, per inertial time, occur in trial steps only. A motion hands over to the slow
#: manifold long before its slip rate relaxes that fast.
LARGEST_RUPTURE_RATE = 1e30
#: Weights (K/a) w (w + w_0) of mass below which its second order is nothing, and below which even
#: the growth of the first is; and the displacement in D_c over which growth is differenced.
NEGLIGIBLE_SECOND_ORDER_WEIGHT, NEGLIGIBLE_GROWTH_WEIGHT, DIFFERENCE_STEP = 1e-7, 1e-9, 1e-6
#: V_0/V between which it says what the slip rate is: not in trial steps far beyond, nor where the
#: load point rests or contact is stationary.
MIN_VELOCITY_RATIO, MAX_VELOCITY_RATIO = 1e-60, 1e40


def slip_rate(friction: FrictionFunctions) -> tuple[Function, Function]:
    """Slip rate on the slow manifold, and its derivative.

    Friction g has the stress f of the spring less what accelerates the mass. With x = ln(V/V_*) and
    displacement s (slip and load point together), the full equations read

        f - g = r = a W(x) dx/ds,    a x = strength(f - r) - Psi,

    in which W(x) = (K/a) w (w + w_0) is the weight of mass, w = V T/(2 pi D_c), and w_0 the same of
    the load point velocity. Where W is small, so is r. The series in W begins with motion without
    mass, x_0, whose derivative along a motion at slip rate x is G(x):

        x_0 = [strength(f) - Psi]/a,    G(x) = [strength'(f) df/ds(x) - dPsi/ds(x)]/a;

        first order:   r_1 = a W(x_0) G(x_0),    x_1 = x_0 - strength'(f) r_1/a;
        second order:  r_2 = a W(x_1) [G(x_1) - d(x_0 - x_1)/ds],
                       x_2 = [strength(f - r_2) - Psi]/a.

    The error of r_2 and x_2 is of order W**3, that is w**6. In the code `quasi_static_values` gives
    x_0, G(x_0), strength'(f) and W(x_0). In `inertial_stress`, which is r_2, `first` is r_1,
    `trails` is x_0
    - x_1, `slowed` is x_1, `changes` are dPsi/ds(x_1) at the shift of f - r_1, `growing` is G(x_1),
    and d(x_0 - x_1)/ds is a difference over `DIFFERENCE_STEP`. `balance` gives x_2 and f - r_2;
    `log_slip_rate_offset` is x_2 - x_0, by the slope of strength halfway; `growth` is dx_2/ds, of G
    along the motion and a difference of `log_slip_rate_offset`. With pore pressure
    `state_contribution` stands for dPsi/ds in G.
    """
    strength, state_sum, evolutions = friction.strength, friction.state_sum, friction.evolutions
    contribution, ahead = friction.state_contribution, state_step_function(friction.state_count)

    def balance(spring_stress: float, psis: Numbers, p: Numbers) -> tuple[float, float, float]:
        alone = quasi_static_values(spring_stress, psis, p)
        g = spring_stress - inertial_stress(spring_stress, psis, alone, p)
        if g == spring_stress:  # mass is lost to rounding
            return alone[0], g, alone[4]
        value, _slope, shift, _shift_slope = strength(g, psis, p)
        return (value - state_sum(psis)) / p[A], g, shift

    def inertial_stress(spring_stress: float, psis: Numbers, alone: Numbers, p: Numbers) -> float:
        """The stress that accelerates the mass, over sigma_*, from what is so without mass."""
        x, growing, slope, weight, _shift = alone
        first = clamped_inertial_stress(weight, growing, p)
        if weight <= NEGLIGIBLE_SECOND_ORDER_WEIGHT:
            return first
        trails = slope * first / p[A]
        slowed, slower, fraction = velocity_ratios(x - trails, p)
        shift = strength(spring_stress - first, psis, p)[2]
        loading = p[STIFFNESS] * (slower - 1.0) * fraction
        changes = evolutions(slowed, psis, shift, fraction, p)
        growing = (slope * loading - contribution(changes, spring_stress, psis, p)) / p[A]
        _x, growing_ahead, slope_ahead, weight_ahead, _shift = quasi_static_values(
            spring_stress + DIFFERENCE_STEP * loading, ahead(psis, changes, DIFFERENCE_STEP), p
        )
        trails_ahead = slope_ahead * clamped_inertial_stress(weight_ahead, growing_ahead, p) / p[A]
        return clamped_inertial_stress(
            compute_inertia_weight(slowed, slower, p),
            growing - (trails_ahead - trails) / DIFFERENCE_STEP,
            p,
        )

    def quasi_static_values(spring_stress: float, psis: Numbers, p: Numbers) -> Numbers:
        """ln(V/V_*) and its growth, both quasi-static, the slope of strength, the weight of mass
        there, and the state lost to stress.
        """
        a = p[A]
        value, slope, shift, _shift_slope = strength(spring_stress, psis, p)
        x = (value - state_sum(psis)) / a
        clamped, slower, fraction = velocity_ratios(x, p)
        loading = p[STIFFNESS] * (slower - 1.0) * fraction
        changes = evolutions(clamped, psis, shift, fraction, p)
        growing = (slope * loading - contribution(changes, spring_stress, psis, p)) / a
        return x, growing, slope, compute_inertia_weight(x, slower, p), shift

    def log_slip_rate_offset(spring_stress: float, psis: Numbers, p: Numbers) -> float:
        """ln V on the slow manifold less its quasi-static value; a difference of both would leave
        rounding errors that show in its growth.
        """
        taken = inertial_stress(spring_stress, psis, quasi_static_values(spring_stress, psis, p), p)
        return -strength(spring_stress - 0.5 * taken, psis, p)[1] * taken / p[A]

    def growth(state: Numbers, rates: Numbers, x: float, g: float, p: Numbers) -> float:
        """The quasi-static one along the motion, and the change of what ln V differs by from its
        quasi-static value: without that, slip would be fastest ``(K/a) w**2`` D_c too early.
        """
        spring_stress, psis = state[0], state[1:]
        slope = strength(spring_stress, psis, p)[1]
        quasi_static = (slope * rates[0] - contribution(rates[1:], spring_stress, psis, p)) / p[A]
        if compute_inertia_weight(x, velocity_ratios(x, p)[1], p) <= NEGLIGIBLE_GROWTH_WEIGHT:
            return quasi_static
        then = log_slip_rate_offset(
            spring_stress + DIFFERENCE_STEP * rates[0], ahead(psis, rates[1:], DIFFERENCE_STEP), p
        )
        return (
            quasi_static + (then - log_slip_rate_offset(spring_stress, psis, p)) / DIFFERENCE_STEP
        )

    return balance, growth


def clamped_inertial_stress(
    inertia_weight: float, log_slip_rate_derivative: float, p: Numbers
) -> float:
    """The stress that accelerates the mass where ln V grows so: no more than a, which is far more
    than the motion meets before it leaves the slow manifold, so that trial steps beyond keep their
    sense of direction.
    """
    stress = p[A] * inertia_weight * log_slip_rate_derivative
    return stress if abs(stress) < p[A] else max(-p[A], min(stress, p[A]))


def compute_inertia_weight(x: float, slower: float, p: Numbers) -> float:
    """(K/a) w (w + w_0): how much ln V trails its quasi-static value per unit growth. Of the
    exponentials, that of V_0/V serves where there is one.
    """
    load = p[LOAD_VELOCITY] * p[DYNAMICS]
    if MIN_VELOCITY_RATIO < slower < MAX_VELOCITY_RATIO:
        norm = load / slower
    else:
        norm = math.exp(min(x + p[DYNAMICS + 1], LARGEST_LOG_SLIP_RATE / 4.0))
    return p[STIFFNESS] / p[A] * norm * (norm + load)


def rupture_rate(friction: FrictionFunctions) -> Function:
    """The full equations: unknowns f, x = ln(V/V_*) and g, in inertial time T/(2 pi), and the
    states but the first.

        df = K (w_0 - w),   dx = (f - g)/(K w),   strength'(g) dg = a dx + w dPsi/d(delta),

    with w = V T/(2 pi D_c), from m d2(delta)/dt2 = k (delta_0 - delta) - tau and m/k = (T/2 pi)**2.
    Keeping g as an unknown needs no inverse of `strength`.
    """
    strength, states_at = friction.strength, friction.states_from_strength
    evolutions, contribution = friction.evolutions, friction.state_contribution

    def rates(state: Numbers, p: Numbers) -> Numbers:
        spring_stress, x, g, others = state[0], state[1], state[2], state[3:]
        a, stiffness = p[A], p[STIFFNESS]
        log_norm = x + p[DYNAMICS + 1]
        if abs(log_norm) > LARGEST_LOG_SLIP_RATE:
            log_norm = math.copysign(LARGEST_LOG_SLIP_RATE, log_norm)
        norm = math.exp(log_norm)
        value, slope, shift, _shift_slope = strength(g, others, p)
        faster = clamp_rate((spring_stress - g) / (stiffness * norm))
        changes = evolutions(x, states_at(value, x, others, p), shift, norm, p)
        return (
            clamp_rate(stiffness * (p[LOAD_VELOCITY] * p[DYNAMICS] - norm)),
            faster,
            clamp_rate((a * faster + contribution(changes, g, others, p)) / slope),
            *changes[1:],
        )

    return rates


def clamp_rate(rate: float) -> float:
    """A rate that a motion meets, or the largest."""
    return (
        rate
        if abs(rate) < LARGEST_RUPTURE_RATE
        else max(min(rate, LARGEST_RUPTURE_RATE), -LARGEST_RUPTURE_RATE)
    )


@dataclass(frozen=True, kw_only=True)
class Inertia(Dynamics):
    """A slider with mass: ``m dV/dt = tau - sigma mu``, with ``m = k (T/2 pi)**2``."""

    inertia: bool = flag(False, "whether the slider has mass")

    name = "inertia"
    selected_by = "inertia"
    regime = "slow_manifold"
    slip_rate = staticmethod(slip_rate)
    rupture_rate = staticmethod(rupture_rate)

    @property
    def effects(self) -> tuple[str, ...]:
        return ("inertia",)

    def numbers(self, scene: SceneView) -> Numbers:
        """T V_*/(2 pi D_c) and its logarithm."""
        return scene.inertial_time, math.log(scene.inertial_time)

    def slip_rate_norm(self, scene: SceneView, log_slip_rate: float) -> float:
        return scene.inertial_time * math.exp(log_slip_rate)

    @classmethod
    def rejection_error(cls, name: str, value: Any) -> InvalidValue:
        rule = "stands in for mass, and this scene has mass"
        return InvalidValue(name, value, rule, remedy="Leave one of them out.")
