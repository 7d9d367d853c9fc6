"""Forms of the equations of motion, which share one friction relation and one point.

Between ruptures spring stress f and the state Psi (or the states of a law that has several) are all
that changes, against slip plus load point displacement, ds = (V + V_0) dt:

    df/ds = K (V_0 - V)/(V + V_0),   dPsi/ds = V/(V + V_0) dPsi/d(delta),   dt/ds = 1/(V + V_0),

with x = ln(V/V_*) and x_0 = ln(V_0/V_*). How x follows from f and Psi is for the dynamics to say.
In ruptures, the full equations tell all changes against inertial time.

Both are integrated along the path in displacement, or inertial time, and ln V together,
d(sigma)**2 = ds**2 + (dx/6)**2, with K (V_0 - V)/(V + V_0) - dPsi/ds over a for dx/ds. While
contact heals, or slip comes to its end after a rupture, ln V falls as the logarithm of s or of what
is left of the time: a step in either would have to be a part of all that has passed, or is to come;
along the path it is a few units of ln V. Where slip is fastest, a path that bends within one unit
of ln V would cost more steps than one that bends within six (four to twelve do as well).

They are functions of floats in which `assembly` fills in the parts of a scene, and the number of
its states.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import (
    LOAD_VELOCITY,
    LOG_LOAD_RATE,
    MU_STAR,
    STIFFNESS,
    A,
    B,
    balance,
    changes,
    effective_stress,
    evolution,
    evolutions,
    felt,
    growth,
    normal_stress,
    outer_stress,
    outer_stress_change,
    resting,
    rupture_point,
    rupture_rate,
    scaled,
    strength,
)
from rsfstudy.slider.states import states_at, total

#: ln(V/V_*) below which slip counts as stopped, 10^-290: a motion ends there if nothing loads it.
SLOWEST = -290.0 * math.log(10.0)

#: Where slip is slower than V_0 by this in ln V, contact is stationary: the state then changes by
#: less than exp(-100) of itself over all the slip there is.
STATIONARY = 100.0

#: Units of ln V that are as long a way as slip of D_c, or inertial time.
UNITS = 6.0
#: From where on the square of a slant, and 1 more than that, are the same number.
STEEP = 1e9
#: How many states there are, where unknowns begin that are none, and where those of the full
#: equations do.
STATES, BEYOND, BEYOND_FULL = 1, 2, 3


class Point(NamedTuple):
    """What the slider does at one instant, whatever the unknowns it was computed with.

    Attributes
    ----------
    log_rate : float
        ln(V/V_*).
    growth : float
        Its derivative with respect to the clock of the equations, length along the path.
    spring, friction : float
        Deviations f and g of spring stress and of frictional stress from tau_*, over sigma_*.
    psis : tuple of float
        States freed of stress, and those of a fluid.
    psi : float
        The sum of those of the law.
    state : float
        State variable Theta (the sum, where a law has several).
    imbalance : float
        Its distance from steady sliding at this slip rate, Theta + b ln(V/V_*) for most laws.
    unrest : float
        The largest such distance of a state, without sign.
    coefficient : float
        Friction coefficient.
    normal_stress : float
        Effective normal stress over sigma_*.
    reading : float
        Friction coefficient as a rig reads it: spring stress over normal stress less the pore
        pressure outside the fault.
    reading_growth : float
        Its derivative with respect to the clock of the equations.
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
    reading: float
    reading_growth: float


def unchanged_normal_stress(friction: float, p: Numbers) -> tuple[float, float]:
    """Constant normal stress."""
    return 0.0, 0.0


def normal_stress_alone(friction: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
    """Effective normal stress where no pore pressure changes it."""
    return normal_stress(friction, p)


def normal_stress_change(
    friction: float, friction_change: float, changes: Numbers, p: Numbers
) -> float:
    """Its change where frictional stress and the states change so."""
    return normal_stress(friction, p)[1] * friction_change


def reading_growth(
    spring: float,
    spring_change: float,
    friction: float,
    friction_change: float,
    psis: Numbers,
    changes: Numbers,
    p: Numbers,
) -> float:
    """Change of the friction coefficient that is read, ``(mu_* + f)/s``, s outside the fault."""
    ratio = 1.0 + outer_stress(friction, psis, p)[0]
    ratio_change = outer_stress_change(friction, friction_change, changes, p)
    return (spring_change - (p[MU_STAR] + spring) / ratio * ratio_change) / ratio


def evolutions_of_one(
    log_rate: float, psis: Numbers, shift: float, share: float, p: Numbers
) -> Numbers:
    """Evolution of the only state of a law, per unit slip times a share."""
    return (share * evolution(log_rate, psis[0] - shift, p),)


def resting_of_one(log_rate: float, shift: float, p: Numbers) -> Numbers:
    """Steady sliding of most laws, Theta = -b ln(V/V_*)."""
    return (shift - p[B] * log_rate,)


def pace(log_rate: float, p: Numbers) -> tuple[float, float, float]:
    """ln(V/V_*), V_0/V, and the share V/(V + V_0) that slip has in slip and load point displacement
    together.

    Where slip is much slower than the load point, ln V is that of stationary contact: evolution per
    unit slip may grow like 1/V there, so that its product with the share has a limit, whose factors
    would underflow and overflow.
    """
    x = max(log_rate, p[LOG_LOAD_RATE] - STATIONARY)
    slower = math.exp(p[LOG_LOAD_RATE] - x)
    return x, slower, 1.0 / (1.0 + slower)


def duration(x: float, slower: float, share: float, p: Numbers) -> float:
    """Time over slip and load point displacement together, ``1/(V + V_0)``."""
    if p[LOAD_VELOCITY] > 0.0:
        return slower * share / p[LOAD_VELOCITY]
    return math.exp(-max(x, SLOWEST))


def by_displacement(state: Numbers, p: Numbers) -> Numbers:
    """Derivatives of f and Psi between ruptures, against slip and load point displacement."""
    psis = state[1:BEYOND]
    log_rate, _friction, shift = balance(state[0], psis, p)
    x, slower, share = pace(log_rate, p)
    loading = p[STIFFNESS] * (slower - 1.0) * share
    return (loading, *evolutions(x, psis, shift, share, p))


def by_displacement_with_time(state: Numbers, p: Numbers) -> Numbers:
    """The same, and time as a passenger."""
    psis = state[1:BEYOND]
    log_rate, _friction, shift = balance(state[0], psis, p)
    x, slower, share = pace(log_rate, p)
    loading = p[STIFFNESS] * (slower - 1.0) * share
    return (loading, *evolutions(x, psis, shift, share, p), duration(x, slower, share, p))


def by_displacement_either_way(state: Numbers, p: Numbers) -> Numbers:
    """Either of them where slip may reverse: it then loads the spring, and displacement is its
    magnitude plus that of the load point.
    """
    forward = changes(state, p)
    if p[MU_STAR] + state[0] >= 0.0:
        return forward
    _x, _slower, share = pace(balance(state[0], state[1:BEYOND], p)[0], p)
    return (forward[0] + 2.0 * p[STIFFNESS] * share, *forward[1:])


def advance(slant: float) -> float:
    """Displacement along a path that is so steep: its square may overflow where slip stops."""
    if abs(slant) > STEEP:
        return 1.0 / abs(slant)
    return 1.0 / math.sqrt(1.0 + slant * slant)


def along_path(state: Numbers, p: Numbers) -> Numbers:
    """Derivatives between ruptures, along the path."""
    by = changes(state, p)
    return scaled(by, advance((by[0] - total(by[1:BEYOND])) / (UNITS * p[A])))


def rupture_along_path(state: Numbers, p: Numbers) -> Numbers:
    """Derivatives in a rupture, along the path."""
    by = rupture_rate(state, p)
    return scaled(by, advance(by[1] / UNITS))


def rupture_along_path_with_time(state: Numbers, p: Numbers) -> Numbers:
    """The same, and inertial time as a passenger."""
    by = rupture_rate(state[:BEYOND_FULL], p)
    return scaled((*by, 1.0), advance(by[1] / UNITS))


def point_in_rupture(state: Numbers, rates: Numbers, p: Numbers) -> Any:
    """What the slider does in a rupture."""
    return rupture_point(state[:BEYOND_FULL], rates[:BEYOND_FULL], p)


def point(state: Numbers, rates: Numbers, p: Numbers) -> Point:
    """What the slider does between ruptures."""
    unknowns = state[:BEYOND]
    spring, psis = unknowns[0], unknowns[1:]
    x, friction, _shift = balance(spring, psis, p)
    change, changes = growth(unknowns, rates[:BEYOND], x, friction, p), rates[1:BEYOND]
    slope = strength(friction, psis, p)[1]
    friction_change = (p[A] * change + felt(changes, friction, psis, p)) / slope
    reads = reading_growth(spring, rates[0], friction, friction_change, psis, changes, p)
    return point_at(x, change, spring, friction, psis, reads, p)


def point_at(
    log_rate: float,
    growth: float,
    spring: float,
    friction: float,
    psis: Numbers,
    reading_growth: float,
    p: Numbers,
) -> Point:
    """The point, with what friction says of it."""
    _value, _slope, shift, _shift_slope = strength(friction, psis, p)
    ratio = 1.0 + effective_stress(friction, psis, p)[0]
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
        (p[MU_STAR] + friction) / ratio,
        ratio,
        (p[MU_STAR] + spring) / (1.0 + outer_stress(friction, psis, p)[0]),
        reading_growth,
    )


def rigid_rate(state: Numbers, p: Numbers) -> Numbers:
    """A rigid slider at the ln(V/V_*) that stands last in `p`: ``strength'(g) dg = dPsi`` against
    slip. Unknowns are g, and the states but the first.
    """
    others = state[1:]
    value, slope, shift, _shift_slope = strength(state[0], others, p)
    changes = evolutions(p[-1], states_at(value, p[-1], others, p), shift, 1.0, p)
    return (felt(changes, state[0], others, p) / slope, *changes[1:])


def rigid_point(state: Numbers, rates: Numbers, p: Numbers) -> Point:
    """What a rigid slider does."""
    psis = states_at(strength(state[0], state[1:], p)[0], p[-1], state[1:], p)
    reads = reading_growth(state[0], rates[0], state[0], rates[0], psis, rates, p)
    return point_at(p[-1], 0.0, state[0], state[0], psis, reads, p)
