"""Radiation damping: waves carry stress away in proportion to slip rate (quasi-dynamic motion)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.parameter_layout import DYNAMICS, LARGEST_LOG_SLIP_RATE, A
from rsfstudy.slider.parts import NON_NEGATIVE, Function, Numbers, number
from rsfstudy.slider.scene_view import SceneView

_MAX_ITERATIONS = 200
_STEP_TOLERANCE = 1e-15
#: How far strength may be off where Newton's steps have become small, over its size: on the floor
#: of normal stress, which only trial steps meet, slopes are so steep that they are small anywhere.
_BALANCE_TOLERANCE = 1e-6
#: ln V beyond which only trial steps look for a balance: radiation would be 10^300 eta.
_MAX_LOG_SLIP_RATE = 690.0


def compute_radiated_stress(log_slip_rate: float, damping: float) -> float:
    """Stress that waves carry away, over sigma_*: ``eta (V - V_*)``, so that it vanishes at V_*.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    damping : float
        eta V_*/sigma_*; for an elastic half-space eta = G/(2 c_s).

    References
    ----------
    Rice (1993), J. Geophys. Res. 98, 9885-9907.
    """
    return damping * math.expm1(log_slip_rate)


def slip_rate(friction: FrictionFunctions) -> tuple[Function, Function]:
    """ln(V/V_*) at which friction and radiation together balance the spring, the frictional stress
    there, and the state lost to stress; and its derivative, ``[a + strength'(g) eta V] d ln V =
    strength'(g) df - dPsi``.

    Solves ``strength(f - eta (V - 1)) = a ln V + Psi`` by Newton's method. The left side falls with
    V and the right side grows, so there is one root, which bisection keeps in its bracket where
    Newton's steps would leave it or shrink too slowly.
    """
    strength, state_sum = friction.strength, friction.state_sum
    contribution = friction.state_contribution

    def balance(spring_stress: float, psis: Numbers, p: Numbers) -> tuple[float, float, float]:
        a, damping, psi = p[A], p[DYNAMICS], state_sum(psis)
        # slip backwards is no part of it: radiation is at least -eta, which bounds ln V from above
        low, high = (
            -math.inf,
            min((strength(spring_stress + damping, psis, p)[0] - psi) / a, _MAX_LOG_SLIP_RATE),
        )
        # a good guess where radiation takes most of the stress
        x = min(high, math.log(max(a * high / damping, 1.0))) if high > 0.0 else high
        before = math.inf
        for _ in range(_MAX_ITERATIONS):
            g = spring_stress - damping * math.expm1(x)
            value, slope, shift, _shift_slope = strength(g, psis, p)
            missing = value - psi - a * x
            if missing > 0.0:
                low = x
            else:
                high = x
            change = missing / (a + slope * damping * math.exp(x))
            balanced = abs(missing) <= _BALANCE_TOLERANCE * (1.0 + abs(psi) + a * abs(x))
            if balanced and abs(change) <= _STEP_TOLERANCE * (1.0 + abs(x)):
                return x, g, shift
            # where normal stress is nearly lost, slopes are so steep that such steps lead nowhere
            slow = abs(change) > 0.5 * abs(before) or abs(change) <= _STEP_TOLERANCE * (
                1.0 + abs(x)
            )
            before = change
            if slow or not low < x + change <= high:
                before = math.inf
                x = 0.5 * (max(low, high - 1e3) + high)
            else:
                x += change
        g = spring_stress - damping * math.expm1(x)
        return x, g, strength(g, psis, p)[2]

    def growth(state: Numbers, rates: Numbers, x: float, g: float, p: Numbers) -> float:
        psis = state[1:]
        slope = strength(g, psis, p)[1]
        resists = p[A] + slope * p[DYNAMICS] * math.exp(min(x, LARGEST_LOG_SLIP_RATE))
        return (slope * rates[0] - contribution(rates[1:], g, psis, p)) / resists

    return balance, growth


@dataclass(frozen=True, kw_only=True)
class RadiationDamping(Dynamics):
    """Friction and radiation share the stress of the spring, ``f = g + eta (V - V_*)``."""

    radiation_damping: float = number(
        0.0,
        r"$\eta V_*/\sigma_*$",
        "1",
        "stress that waves carry away at V_star",
        "sigma_*",
        rule=NON_NEGATIVE,
    )

    name = "radiation_damping"
    selected_by = "radiation_damping"
    regime = "quasi_dynamic"
    slip_rate = staticmethod(slip_rate)

    @property
    def effects(self) -> tuple[str, ...]:
        return ("radiation_damping",)

    def numbers(self, scene: SceneView) -> Numbers:
        """eta V_*/sigma_*."""
        return (self.radiation_damping,)

    def radiated_stress(self, log_slip_rate: float) -> float:
        return compute_radiated_stress(log_slip_rate, self.radiation_damping)

    def radiated_stress_slope(self, log_slip_rate: float) -> float:
        return self.radiation_damping * math.exp(log_slip_rate)
