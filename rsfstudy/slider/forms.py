"""Forms of the equations of motion, which share one clock, one friction relation and one point.

Between ruptures spring stress f and the state Psi (or the states of a law that has several) are all
that changes, against slip plus load point displacement, ds = (V + V_0) dt, in which every rate is
of order one from arrest to rupture:

    df/ds = -K tanh[(x - x_0)/2],   dPsi/ds = V/(V + V_0) dPsi/d(delta),   dt/ds = 1/(V + V_0),

with x = ln(V/V_*) and x_0 = ln(V_0/V_*). How x follows from f and Psi is for the dynamics to say.

They are functions of floats in which `assembly` fills in the parts of a scene, and the number of
states of its law.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import (
    LARGEST_EXPONENT,
    LOAD_VELOCITY,
    LOG_LOAD_RATE,
    MU_STAR,
    STIFFNESS,
    B,
    balance,
    evolution,
    evolutions,
    growth,
    normal_stress,
    resting,
    strength,
)
from rsfstudy.slider.states import states_at, total

#: ln(V/V_*) below which slip counts as stopped, 10^-290: a motion ends there if nothing loads it.
SLOWEST = -290.0 * math.log(10.0)

#: Where slip is slower than V_0 by this in ln V, contact is stationary: the state then changes by
#: less than exp(-100) of itself over all the slip there is.
STATIONARY = 100.0

#: How many states the law has, and where unknowns begin that are none.
STATES, BEYOND = 1, 2


class Point(NamedTuple):
    """What the slider does at one instant, whatever the unknowns it was computed with.

    Attributes
    ----------
    log_rate : float
        ln(V/V_*).
    growth : float
        Its derivative with respect to the clock of the equations.
    spring, friction : float
        Deviations f and g of spring stress and of frictional stress from tau_*, over sigma_*.
    psis : tuple of float
        States freed of stress.
    psi : float
        Their sum.
    state : float
        State variable Theta (the sum, where a law has several).
    imbalance : float
        Its distance from steady sliding at this slip rate, Theta + b ln(V/V_*) for most laws.
    unrest : float
        The largest such distance of a state, without sign.
    coefficient : float
        Friction coefficient.
    normal_stress : float
        Normal stress over sigma_*.
    """

    log_rate: float
    growth: float
    spring: float
    friction: float
    psis: tuple[float, ...]
    psi: float
    state: float
    imbalance: float
    unrest: float
    coefficient: float
    normal_stress: float


def unchanged_normal_stress(friction: float, p: Numbers) -> tuple[float, float]:
    """Constant normal stress."""
    return 0.0, 0.0


def evolutions_of_one(
    log_rate: float, psis: Numbers, shift: float, share: float, p: Numbers
) -> Numbers:
    """Evolution of the only state of a law, per unit slip times a share."""
    return (share * evolution(log_rate, psis[0] - shift, p),)


def resting_of_one(log_rate: float, shift: float, p: Numbers) -> Numbers:
    """Steady sliding of most laws, Theta = -b ln(V/V_*)."""
    return (shift - p[B] * log_rate,)


def combined_rate(log_rate: float, load_velocity: float) -> float:
    """Rate (V + V_0)/V_* of slip and load point displacement together."""
    return math.exp(max(min(log_rate, LARGEST_EXPONENT), SLOWEST)) + load_velocity


def evolving(log_rate: float, psis: Numbers, shift: float, p: Numbers) -> Numbers:
    """Evolution of the states per unit of slip and load point displacement together:
    ``V/(V + V_0) dTheta/d(delta)``.

    Evolution per unit slip may grow like 1/V as slip slows down, so that the product has a limit,
    that of stationary contact. There it is taken a little faster than slip goes, because its
    factors would underflow and overflow.
    """
    load = p[LOG_LOAD_RATE]
    x = max(log_rate, load - STATIONARY)
    return evolutions(x, psis, shift, 1.0 / (1.0 + math.exp(load - x)), p)


def evolving_alone(log_rate: float, psis: Numbers, shift: float, p: Numbers) -> Numbers:
    """The same, for a law of one state."""
    load = p[LOG_LOAD_RATE]
    x = max(log_rate, load - STATIONARY)
    return (evolution(x, psis[0] - shift, p) / (1.0 + math.exp(load - x)),)


def rate(state: Numbers, p: Numbers) -> Numbers:
    """Derivatives of f and Psi between ruptures."""
    psis = state[1:BEYOND]
    x, _friction, shift = balance(state[0], psis, p)
    loading = -p[STIFFNESS] * math.tanh(0.5 * (x - p[LOG_LOAD_RATE]))
    return (loading, *evolving(x, psis, shift, p))


def rate_with_time(state: Numbers, p: Numbers) -> Numbers:
    """The same, and time as a passenger."""
    psis = state[1:BEYOND]
    x, _friction, shift = balance(state[0], psis, p)
    loading = -p[STIFFNESS] * math.tanh(0.5 * (x - p[LOG_LOAD_RATE]))
    lasts = 1.0 / combined_rate(x, p[LOAD_VELOCITY])
    return (loading, *evolving(x, psis, shift, p), lasts)


def point(state: Numbers, rates: Numbers, p: Numbers) -> Point:
    """What the slider does between ruptures."""
    unknowns = state[:BEYOND]
    spring, psis = unknowns[0], unknowns[1:]
    x, friction, _shift = balance(spring, psis, p)
    change = growth(unknowns, rates[:BEYOND], x, friction, p)
    return point_at(x, change, spring, friction, psis, p)


def point_at(
    log_rate: float, growth: float, spring: float, friction: float, psis: Numbers, p: Numbers
) -> Point:
    """The point, with what friction says of it."""
    value, _slope, shift, _shift_slope = strength(friction, p)
    ratio = 1.0 + normal_stress(friction, p)[0]
    rest = resting(log_rate, shift, p)
    psi, unrest = total(psis), 0.0
    for i in range(STATES):
        unrest = max(unrest, abs(psis[i] - rest[i]))
    return Point(
        log_rate,
        growth,
        spring,
        friction,
        psis,
        psi,
        psi - shift,
        psi - total(rest),
        unrest,
        p[MU_STAR] + value - shift,
        ratio,
    )


def rigid_rate(state: Numbers, p: Numbers) -> Numbers:
    """A rigid slider at the ln(V/V_*) that stands last in `p`: ``strength'(g) dg = dPsi`` against
    slip. Unknowns are g, and the states but the first.
    """
    value, slope, shift, _shift_slope = strength(state[0], p)
    changes = evolutions(p[-1], states_at(value, p[-1], state[1:], p), shift, 1.0, p)
    return (total(changes) / slope, *changes[1:])


def rigid_point(state: Numbers, rates: Numbers, p: Numbers) -> Point:
    """What a rigid slider does."""
    psis = states_at(strength(state[0], p)[0], p[-1], state[1:], p)
    return point_at(p[-1], 0.0, state[0], state[0], psis, p)
