"""Quasi-static motion: friction alone balances the spring."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import A, strength
from rsfstudy.slider.states import total


def balance(spring: float, psis: Numbers, p: Numbers) -> tuple[float, float, float]:
    """``a ln(V/V_*) = strength(f) - Psi`` with f the deviation of spring stress."""
    value, _slope, shift, _shift_slope = strength(spring, p)
    return (value - total(psis)) / p[A], spring, shift


def growth(state: Numbers, rates: Numbers, x: float, friction: float, p: Numbers) -> float:
    """``a d ln V = strength'(f) df - dPsi``."""
    return (strength(friction, p)[1] * rates[0] - total(rates[1:])) / p[A]


@dataclass(frozen=True, kw_only=True)
class QuasiStatic(Dynamics):
    """Neither mass nor radiation."""

    name = "quasi_static"
    regime = "quasi_static"
    balance = staticmethod(balance)
    growth = staticmethod(growth)
