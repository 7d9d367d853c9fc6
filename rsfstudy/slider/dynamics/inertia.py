"""Inertia: the mass of the slider, through its period of free oscillation T.

Where mass hardly acts, the motion follows the slow manifold of the full equations; where it does,
the full equations themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.parts import Numbers, flag
from rsfstudy.slider.slots import (
    LARGEST_EXPONENT,
    LOAD_VELOCITY,
    STIFFNESS,
    A,
    evolutions,
    felt,
    moved,
    pace,
    point_at,
    reading_growth,
    strength,
)
from rsfstudy.slider.states import states_at, total

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene

OWN = 0
#: Rates beyond this, per inertial time, occur in trial steps only. A motion hands over to the slow
#: manifold long before its slip rate relaxes that fast.
LARGEST_RATE = 1e30
#: Weights (K/a) w (w + w_0) of mass below which its second order is nothing, and below which even
#: the growth of the first is; and the displacement in D_c over which growth is differenced.
LIGHT, LIGHTER, AHEAD = 1e-7, 1e-9, 1e-6
#: V_0/V between which it says what the slip rate is: not in trial steps far beyond, nor where the
#: load point rests or contact is stationary.
LEAST, MOST = 1e-60, 1e40


def balance(spring: float, psis: Numbers, p: Numbers) -> tuple[float, float, float]:
    """Slip rate on the slow manifold, frictional stress, and the state lost to normal stress.

    Friction has the stress of the spring less what accelerates the mass, ``K w (w + w_0) dx`` with
    dx the growth of ln V per unit of combined displacement (slip and load point), w = V T/(2 pi
    D_c) and w_0 the same of the load point velocity. The slip rate that trails by that of
    quasi-static growth is right to first order in w**2, and with its growth friction is to second:
    the error is of order w**6.

    Parameters
    ----------
    spring : float
        Deviation f of spring stress from tau_*, over sigma_*.
    psis : tuple of float
        States freed of stress.
    p : tuple of float
        T V_*/(2 pi D_c) at OWN, and its logarithm.
    """
    friction = spring - resistance(spring, psis, p)
    value, _slope, shift, _shift_slope = strength(friction, psis, p)
    return (value - total(psis)) / p[A], friction, shift


def resistance(spring: float, psis: Numbers, p: Numbers) -> float:
    """The stress that accelerates the mass, over sigma_*."""
    x, growing, slope, weight = without_mass(spring, psis, p)
    first = resisted(weight, growing, p)
    if weight <= LIGHT:
        return first
    trails = slope * first / p[A]
    slowed, slower, share = pace(x - trails, p)
    shift = strength(spring - first, psis, p)[2]
    loading = p[STIFFNESS] * (slower - 1.0) * share
    changes = evolutions(slowed, psis, shift, share, p)
    growing = (slope * loading - felt(changes, spring, psis, p)) / p[A]
    _x, growing_ahead, slope_ahead, weight_ahead = without_mass(
        spring + AHEAD * loading, moved(psis, changes, AHEAD), p
    )
    trails_ahead = slope_ahead * resisted(weight_ahead, growing_ahead, p) / p[A]
    return resisted(weight_at(slowed, slower, p), growing - (trails_ahead - trails) / AHEAD, p)


def resisted(weight: float, growing: float, p: Numbers) -> float:
    """The same where ln V grows so: no more than a, which is far more than the motion meets before
    it leaves the slow manifold, so that trial steps beyond keep their sense of direction.
    """
    return max(-p[A], min(p[A] * weight * growing, p[A]))


def weight_at(x: float, slower: float, p: Numbers) -> float:
    """(K/a) w (w + w_0): how much ln V trails its quasi-static value per unit growth. Of the
    exponentials, that of V_0/V serves where there is one.
    """
    load = p[LOAD_VELOCITY] * p[OWN]
    if LEAST < slower < MOST:
        norm = load / slower
    else:
        norm = math.exp(min(x + p[OWN + 1], LARGEST_EXPONENT / 4.0))
    return p[STIFFNESS] / p[A] * norm * (norm + load)


def without_mass(spring: float, psis: Numbers, p: Numbers) -> tuple[float, float, float, float]:
    """ln(V/V_*) and its growth, both quasi-static, the slope of strength, and the weight of mass
    there.
    """
    a = p[A]
    value, slope, shift, _shift_slope = strength(spring, psis, p)
    x = (value - total(psis)) / a
    clamped, slower, share = pace(x, p)
    loading = p[STIFFNESS] * (slower - 1.0) * share
    changes = evolutions(clamped, psis, shift, share, p)
    growing = (slope * loading - felt(changes, spring, psis, p)) / a
    return x, growing, slope, weight_at(x, slower, p)


def trailing(spring: float, psis: Numbers, p: Numbers) -> float:
    """ln V on the slow manifold less its quasi-static value; a difference of both would leave
    rounding errors that show in its growth.
    """
    taken = resistance(spring, psis, p)
    return -strength(spring - 0.5 * taken, psis, p)[1] * taken / p[A]


def growth(state: Numbers, rates: Numbers, x: float, friction: float, p: Numbers) -> float:
    """The quasi-static one along the motion, and the change of what ln V differs by from its
    quasi-static value: without that, slip would be fastest ``(K/a) w**2`` D_c too early.
    """
    spring, psis = state[0], state[1:]
    slope = strength(spring, psis, p)[1]
    quasi_static = (slope * rates[0] - felt(rates[1:], spring, psis, p)) / p[A]
    if weight_at(x, pace(x, p)[1], p) <= LIGHTER:
        return quasi_static
    ahead = trailing(spring + AHEAD * rates[0], moved(psis, rates[1:], AHEAD), p)
    return quasi_static + (ahead - trailing(spring, psis, p)) / AHEAD


def rupture_rate(state: Numbers, p: Numbers) -> Numbers:
    """The full equations: unknowns f, x = ln(V/V_*) and g, in inertial time T/(2 pi), and the
    states but the first.

        df = K (w_0 - w),   dx = (f - g)/(K w),   strength'(g) dg = a dx + w dPsi/d(delta),

    with w = V T/(2 pi D_c), from m d2(delta)/dt2 = k (delta_0 - delta) - tau and m/k = (T/2 pi)**2.
    Keeping g as an unknown needs no inverse of `strength`.
    """
    spring, x, friction, others = state[0], state[1], state[2], state[3:]
    a, stiffness = p[A], p[STIFFNESS]
    norm = math.exp(max(min(x + p[OWN + 1], LARGEST_EXPONENT), -LARGEST_EXPONENT))
    value, slope, shift, _shift_slope = strength(friction, others, p)
    faster = bounded((spring - friction) / (stiffness * norm))
    changes = evolutions(x, states_at(value, x, others, p), shift, norm, p)
    return (
        bounded(stiffness * (p[LOAD_VELOCITY] * p[OWN] - norm)),
        faster,
        bounded((a * faster + felt(changes, friction, others, p)) / slope),
        *changes[1:],
    )


def bounded(rate: float) -> float:
    """A rate that a motion meets, or the largest."""
    return max(min(rate, LARGEST_RATE), -LARGEST_RATE)


def rupture_point(state: Numbers, rates: Numbers, p: Numbers) -> tuple[Any, ...]:
    """What the slider does where mass acts."""
    spring, x, friction = state[0], state[1], state[2]
    psis = states_at(strength(friction, state[3:], p)[0], x, state[3:], p)
    reads = reading_growth(spring, rates[0], friction, rates[2], psis, rates, p)
    return point_at(x, rates[1], spring, friction, psis, reads, p)


@dataclass(frozen=True, kw_only=True)
class Inertia(Dynamics):
    """A slider with mass."""

    inertia: bool = flag(False, "whether the slider has mass")

    name = "inertia"
    called_by = "inertia"
    regime = "slow_manifold"
    balance = staticmethod(balance)
    growth = staticmethod(growth)
    rupture_rate = staticmethod(rupture_rate)
    rupture_point = staticmethod(rupture_point)

    @property
    def effects(self) -> tuple[str, ...]:
        return ("inertia",)

    def numbers(self, scene: Scene) -> Numbers:
        """T V_*/(2 pi D_c) and its logarithm."""
        return scene.inertial_time, math.log(scene.inertial_time)

    def norm(self, scene: Scene, log_rate: float) -> float:
        return scene.inertial_time * math.exp(log_rate)

    @classmethod
    def refuse(cls, name: str, value: Any) -> InvalidValue:
        return InvalidValue(
            name,
            value,
            "stands in for mass, and this scene has mass",
            remedy="Leave one of them out.",
        )
