"""Forms of the equations of motion, which share one clock, one friction relation and one point.

Between ruptures two unknowns suffice, spring stress f and state Psi, against slip plus load point
displacement, ds = (V + V_0) dt, in which every rate is of order one from arrest to rupture:

    df/ds = -K tanh[(x - x_0)/2],   dPsi/ds = V/(V + V_0) dPsi/d(delta),   dt/ds = 1/(V + V_0),

with x = ln(V/V_*) and x_0 = ln(V_0/V_*). How x follows from f and Psi is for the dynamics to say.

They are functions of floats in which `assembly` fills in the parts of a scene.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import (
    LARGEST_EXPONENT,
    LOAD_VELOCITY,
    LOG_LOAD_RATE,
    MU_STAR,
    STIFFNESS,
    A,
    B,
    balance,
    evolution,
    growth,
    normal_stress,
    strength,
)

#: ln(V/V_*) below which slip counts as stopped, 10^-290: a motion ends there if nothing loads it.
SLOWEST = -290.0 * math.log(10.0)

#: Where slip is slower than V_0 by this in ln V, contact is stationary: the state then changes by
#: less than exp(-100) of itself over all the slip there is.
STATIONARY = 100.0

State = Sequence[float]


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
    psi : float
        State freed of stress.
    state : float
        State variable Theta.
    imbalance : float
        Its distance from steady sliding, Theta + b ln(V/V_*).
    coefficient : float
        Friction coefficient.
    normal_stress : float
        Normal stress over sigma_*.
    """

    log_rate: float
    growth: float
    spring: float
    friction: float
    psi: float
    state: float
    imbalance: float
    coefficient: float
    normal_stress: float


def unchanged_normal_stress(friction: float, p: Numbers) -> tuple[float, float]:
    """Constant normal stress."""
    return 0.0, 0.0


def combined_rate(log_rate: float, load_velocity: float) -> float:
    """Rate (V + V_0)/V_* of slip and load point displacement together."""
    return math.exp(max(min(log_rate, LARGEST_EXPONENT), SLOWEST)) + load_velocity


def evolving(log_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state per unit of slip and load point displacement together:
    ``V/(V + V_0) dTheta/d(delta)``.

    Evolution per unit slip may grow like 1/V as slip slows down, so that the product has a limit,
    that of stationary contact. There it is taken a little faster than slip goes, because its
    factors would underflow and overflow.
    """
    load = p[LOG_LOAD_RATE]
    x = max(log_rate, load - STATIONARY)
    return evolution(x, state, p) / (1.0 + math.exp(load - x))


def rate(state: State, p: Numbers) -> list[float]:
    """Derivatives of f and Psi between ruptures."""
    spring, psi = state[0], state[1]
    x, _friction, shift = balance(spring, psi, p)
    return [
        -p[STIFFNESS] * math.tanh(0.5 * (x - p[LOG_LOAD_RATE])),
        evolving(x, psi - shift, p),
    ]


def rate_with_time(state: State, p: Numbers) -> list[float]:
    """The same, and time as a passenger."""
    spring, psi = state[0], state[1]
    x, _friction, shift = balance(spring, psi, p)
    return [
        -p[STIFFNESS] * math.tanh(0.5 * (x - p[LOG_LOAD_RATE])),
        evolving(x, psi - shift, p),
        1.0 / combined_rate(x, p[LOAD_VELOCITY]),
    ]


def point(state: State, rates: State, p: Numbers) -> Point:
    """What the slider does between ruptures."""
    spring, psi = float(state[0]), float(state[1])
    x, friction, _shift = balance(spring, psi, p)
    moving = float(rates[0]), float(rates[1])
    change = growth((spring, psi), moving, x, friction, p)
    return point_at(x, change, spring, friction, psi, p)


def point_at(
    log_rate: float, growth: float, spring: float, friction: float, psi: float, p: Numbers
) -> Point:
    """The point, with what friction says of it."""
    value, _slope, shift, _shift_slope = strength(friction, p)
    ratio = 1.0 + normal_stress(friction, p)[0]
    state, coefficient = psi - shift, p[MU_STAR] + value - shift
    imbalance = state + p[B] * log_rate
    return Point(log_rate, growth, spring, friction, psi, state, imbalance, coefficient, ratio)


def rigid_rate(state: State, p: Numbers) -> list[float]:
    """A rigid slider at the ln(V/V_*) that stands last in `p`: ``strength'(g) dg = dPsi`` against
    slip.
    """
    value, slope, shift, _shift_slope = strength(state[0], p)
    return [evolution(p[-1], value - shift - p[A] * p[-1], p) / slope]


def rigid_point(state: State, rates: State, p: Numbers) -> Point:
    """What a rigid slider does."""
    friction = float(state[0])
    psi = strength(friction, p)[0] - p[A] * p[-1]
    return point_at(p[-1], 0.0, friction, friction, psi, p)
