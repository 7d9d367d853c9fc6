"""Quasi-static motion: friction alone balances the spring."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.parameter_layout import A
from rsfstudy.slider.parts import Function, Numbers


def slip_rate(friction: FrictionFunctions) -> tuple[Function, Function]:
    """``a ln(V/V_*) = strength(f) - Psi`` with f the deviation of spring stress, and its
    derivative, ``a d ln V = strength'(f) df - dPsi``.
    """
    strength, state_sum = friction.strength, friction.state_sum
    contribution = friction.state_contribution

    def balance(spring_stress: float, psis: Numbers, p: Numbers) -> tuple[float, float, float]:
        value, _slope, shift, _shift_slope = strength(spring_stress, psis, p)
        return (value - state_sum(psis)) / p[A], spring_stress, shift

    def growth(state: Numbers, rates: Numbers, x: float, g: float, p: Numbers) -> float:
        psis = state[1:]
        slope = strength(g, psis, p)[1]
        return (slope * rates[0] - contribution(rates[1:], g, psis, p)) / p[A]

    return balance, growth


@dataclass(frozen=True, kw_only=True)
class QuasiStatic(Dynamics):
    """Neither mass nor radiation."""

    name = "quasi_static"
    regime = "quasi_static"
    allows_reversed_slip = True
    slip_rate = staticmethod(slip_rate)
