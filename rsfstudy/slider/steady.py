"""Steady sliding, from the friction relation of a scene alone.

At a steady ln(V/V_*) = x the states Psi_i rest where their law says, -b x + shift(g) for most, so
that frictional stress g solves

    strength(g) = a x + sum of Psi_i.

Nothing here depends on which parts the scene has.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from scipy.optimize import brentq

from rsfstudy.slider.derived import once
from rsfstudy.slider.equations import relation_of, steady_states_of
from rsfstudy.slider.parts import Numbers, Scene

#: Deviation of frictional stress, over sigma_*, beyond which none counts as steady.
_STRONGEST = 1e9
#: ln(V/V_*) below which steady sliding is not followed.
_SLOWEST = -1e6


@dataclass(frozen=True)
class Steady:
    """Steady sliding at ln(V/V_*) = `log_slip_rate`.

    Attributes
    ----------
    log_slip_rate : float
    friction, spring_stress : float
        Deviations of frictional stress and of spring stress from tau_*, over sigma_*.
    psis : tuple of float
        States freed of stress.
    """

    log_slip_rate: float
    friction: float
    spring_stress: float
    psis: Numbers


@once
def steady_sliding(scene: Scene, log_slip_rate: float) -> Steady | None:
    """Steady sliding of a scene at ln(V/V_*), found once; None where no stress is as weak or as
    strong.
    """
    friction = stress_at(scene, steady_excess(scene, log_slip_rate))
    if friction is None:
        return None
    spring_stress = friction + scene.dynamics.radiated(log_slip_rate)
    shift = relation_of(scene)(friction)[2]
    return Steady(
        log_slip_rate, friction, spring_stress, steady_states_of(scene, log_slip_rate, shift)
    )


def steady_excess(scene: Scene, log_slip_rate: float) -> float:
    """Steady friction coefficient at ln(V/V_*), less mu_*: (a - b) ln(V/V_*) by most laws."""
    psi = scene.functions.friction.state_sum(steady_states_of(scene, log_slip_rate, 0.0))
    return float(scene.a * log_slip_rate + psi)


def stress_at(scene: Scene, excess: float) -> float | None:
    """Deviation of frictional stress at which the friction coefficient is mu_* + `excess`; None
    where it never is.
    """
    relation = relation_of(scene)

    def missing(friction: float) -> float:
        value, _slope, shift, _shift_slope = relation(friction)
        return value - shift - excess

    return _root(missing, excess, _weakest(scene))


def stress_after_jump(scene: Scene, excess: float, psis: Numbers = ()) -> float | None:
    """Deviation of frictional stress at which strength is `excess`: that of a sudden change; None
    where it never is. At the pore pressure of steady sliding, unless states are given.
    """
    relation = relation_of(scene, psis)
    return _root(lambda friction: relation(friction)[0] - excess, excess, _weakest(scene))


def _weakest(scene: Scene) -> float:
    """Deviation of frictional stress above which slip is forward and normal stress positive."""
    weakest = scene.parts.normal_stress.weakest(scene)
    # where slip may reverse, strength grows with stress of either sign
    return max(weakest, -scene.mu_star) if scene.parts.law.regularised else weakest


def _root(missing: Callable[[float], float], near: float, lowest: float) -> float | None:
    """Zero of a growing function, above `lowest`; None where there is none."""
    low = near if near > lowest else 0.5 * lowest
    high, stride = low, 1e-3 + abs(low)
    at = missing(low)
    if at == 0.0:
        return float(low)
    while at > 0.0:
        high = low
        low = (
            max(low - stride, lowest + 0.5 * (low - lowest))
            if math.isfinite(lowest)
            else (low - stride)
        )
        stride *= 2.0
        if stride > _STRONGEST or low == high:
            return None
        at = missing(low)
    if high == low:
        while missing(high) <= 0.0:
            if high > _STRONGEST:
                return None
            low, high = high, high + stride
            stride *= 2.0
    return float(brentq(missing, low, high, xtol=1e-22, rtol=8.9e-16, maxiter=500))


def slowest_steady(scene: Scene) -> float:
    """Smallest ln(V/V_*) with steady sliding: where stress would grow without bound; ``-inf`` where
    there is none.
    """
    value, _slope, shift, _shift_slope = relation_of(scene)(_STRONGEST)
    strongest = value - shift
    if strongest > 1e6:
        return -math.inf
    if scene.parts.law.steady_states is None:
        return strongest / (scene.a - scene.b) if scene.b > scene.a else -math.inf
    slower = -1.0
    while steady_excess(scene, slower) <= strongest:
        slower *= 2.0
        if slower < _SLOWEST:
            return -math.inf
    return float(brentq(lambda x: steady_excess(scene, x) - strongest, slower, 0.0, xtol=1e-12))
