"""Quasi-static motion: friction alone balances the spring."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import A, felt, strength
from rsfstudy.slider.states import total


def balance(spring: float, psis: Numbers, p: Numbers) -> tuple[float, float, float]:
    """``a ln(V/V_*) = strength(f) - Psi`` with f the deviation of spring stress."""
    value, _slope, shift, _shift_slope = strength(spring, psis, p)
    return (value - total(psis)) / p[A], spring, shift


def growth(state: Numbers, rates: Numbers, x: float, friction: float, p: Numbers) -> float:
    """``a d ln V = strength'(f) df - dPsi``."""
    psis = state[1:]
    slope = strength(friction, psis, p)[1]
    return (slope * rates[0] - felt(rates[1:], friction, psis, p)) / p[A]


@dataclass(frozen=True, kw_only=True)
class QuasiStatic(Dynamics):
    """Neither mass nor radiation."""

    name = "quasi_static"
    regime = "quasi_static"
    reverses = True
    balance = staticmethod(balance)
    growth = staticmethod(growth)
