"""Steady sliding and its linear stability, from the friction relation of a scene alone.

At a steady ln(V/V_*) = x the states Psi_i rest where their law says, -b x + shift(g) for most, so
that frictional stress g solves

    strength(g) = a x + sum of Psi_i.

A small change of slip that goes as exp(p s), s being slip over D_c, changes frictional stress by
G(p) times itself. With D = strength', S = shift', and the slopes M, E_x and E_s of the evolution of
the states with respect to one another, to x and to the shift,

    [D - S 1.(p - M)^-1 E_s] dg = p [a + 1.(p - M)^-1 E_x] du.

Spring, waves and mass balance it where K (1 + w**2 p**2) + eta V p + G(p) = 0, w being
V T/(2 pi D_c). The critical stiffness is the K at which p is imaginary. Nothing here depends on
which parts the scene has.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from rsfstudy.slider.equations import evolutions_of, relation_of, resting_of
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.states import total

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene

#: Deviation of frictional stress, over sigma_*, beyond which none counts as steady.
_STRONGEST = 1e9
#: Step of the differences that give the slopes of a law, in ln V, and their weights: order eight.
#: States take a part of it, over b, because each of several may have a small part of b.
_STEP, _PART = 0.05, 0.05
_WEIGHTS = ((1, 4.0 / 5.0), (2, -1.0 / 5.0), (3, 4.0 / 105.0), (4, -1.0 / 280.0))

#: Critical stiffness over a that rounding leaves where there is none.
_ROUNDING = 1e-12

Polynomial = list[float]


@dataclass(frozen=True)
class Steady:
    """Steady sliding at ln(V/V_*) = `log_rate`.

    Attributes
    ----------
    log_rate : float
    friction, spring : float
        Deviations of frictional stress and of spring stress from tau_*, over sigma_*.
    psis : tuple of float
        States freed of stress.
    """

    log_rate: float
    friction: float
    spring: float
    psis: Numbers


def steady_sliding(scene: Scene, log_rate: float) -> Steady | None:
    """Steady sliding of a scene at ln(V/V_*); None where no stress is as weak or as strong."""
    excess = scene.a * log_rate + total(resting_of(scene, log_rate, 0.0))
    friction = stress_at(scene, excess)
    if friction is None:
        return None
    spring = friction + scene.dynamics.radiated(log_rate)
    shift = relation_of(scene)(friction)[2]
    return Steady(log_rate, friction, spring, resting_of(scene, log_rate, shift))


def stress_at(scene: Scene, excess: float) -> float | None:
    """Deviation of frictional stress at which the friction coefficient is mu_* + `excess`; None
    where it never is.
    """
    relation = relation_of(scene)

    def missing(friction: float) -> float:
        value, _slope, shift, _shift_slope = relation(friction)
        return value - shift - excess

    return _root(missing, excess, scene.parts.normal_stress.weakest(scene))


def stress_after_jump(scene: Scene, excess: float) -> float | None:
    """Deviation of frictional stress at which strength is `excess`: that of a sudden change; None
    where it never is.
    """
    relation = relation_of(scene)
    lowest = scene.parts.normal_stress.weakest(scene)
    return _root(lambda friction: relation(friction)[0] - excess, excess, lowest)


def _root(missing: Callable[[float], float], near: float, lowest: float) -> float | None:
    """Where a growing function vanishes, above `lowest`; None where it does not."""
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
    if value - shift > 1e6 or scene.b <= scene.a:
        return -math.inf
    return (value - shift) / (scene.a - scene.b)


def critical_stiffness(scene: Scene, log_rate: float, *, quasi_static: bool = False) -> float:
    """Critical stiffness ``k_cr D_c/sigma_*`` of steady sliding at ln(V/V_*).

    Parameters
    ----------
    scene : Scene
        Its own stiffness does not matter.
    log_rate : float
        ln(V/V_*).
    quasi_static : bool
        Leave mass and radiation out.

    Returns
    -------
    float
        Zero where sliding is stable at every stiffness, ``math.inf`` where it is unstable at every
        stiffness, and NaN where there is no steady sliding.

    References
    ----------
    Dieterich and Linker (1992), Geophys. Res. Lett. 19, 1691-1694, for one state variable without
    mass: ``(b - a) sigma_ss / (D_c [1 - cot(phi) (mu_ss - alpha)])``.
    """
    steady = steady_sliding(scene, log_rate)
    if steady is None:
        return math.nan
    damping = 0.0 if quasi_static else scene.dynamics.damping(log_rate)
    norm = 0.0 if quasi_static else scene.dynamics.norm(scene, log_rate)
    above, below = response(scene, steady)
    # at p = i omega, as polynomials in omega**2
    (a_even, a_odd), (b_even, b_odd) = _parts(above), _parts(below)
    size = _sum(_product(b_even, b_even), [0.0, *_product(b_odd, b_odd)])
    resists = _sum(_product(a_even, b_even), [0.0, *_product(a_odd, b_odd)])
    turns = _sum(_product(a_odd, b_even), [-x for x in _product(a_even, b_odd)])
    critical = 0.0
    for squared in _positive_roots(_sum(resists, [damping * x for x in size])):
        elastic = squared * _value(turns, squared) / _value(size, squared)
        inertial = 1.0 - norm**2 * squared
        critical = max(critical, elastic / inertial if inertial > 0.0 else math.inf)
    return critical if critical > _ROUNDING * scene.a else 0.0


def response(scene: Scene, steady: Steady) -> tuple[Polynomial, Polynomial]:
    """Friction against slip around steady sliding, ``G(p) = p above(p)/below(p)``: coefficients of
    the two polynomials, from the constant one up.
    """
    _value, slope, _shift, shift_slope = relation_of(scene)(steady.friction)
    by_rate, by_shift, by_state = slopes_of_law(scene, steady)
    denominator, adjugate = resolvent(by_state)
    above = [scene.a * x for x in denominator]
    below = [slope * x for x in denominator]
    for power, matrix in enumerate(adjugate):
        above[power] += float((matrix @ by_rate).sum())
        below[power] -= shift_slope * float((matrix @ by_shift).sum())
    return above, below


def slopes_of_law(scene: Scene, steady: Steady) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives of the evolution of the states per unit slip at steady sliding: with respect to
    ln V, to the shift, and to each state (columns).
    """
    evolutions, b = evolutions_of(scene), scene.b
    shift = relation_of(scene)(steady.friction)[2]
    count = len(steady.psis)
    slopes = np.zeros((count, count + 2))
    for column in range(count + 2):
        scale = 1.0 if column == 0 else _PART * b
        for number, weight in _WEIGHTS:
            for sign in (1.0, -1.0):
                x, stress, *psis = (
                    value + sign * number * _STEP * scale * (place == column)
                    for place, value in enumerate((steady.log_rate, shift, *steady.psis))
                )
                changes = evolutions(x, tuple(psis), stress)
                slopes[:, column] += sign * weight / (_STEP * scale) * np.array(changes)
    return slopes[:, 0], slopes[:, 1], slopes[:, 2:]


def resolvent(matrix: np.ndarray) -> tuple[Polynomial, list[np.ndarray]]:
    """Characteristic polynomial of a matrix M, and the adjugate of p - M, whose quotient is the
    inverse of p - M: coefficients from the constant one up (Faddeev and LeVerrier).
    """
    size = len(matrix)
    coefficients, terms = [1.0], [np.eye(size)]
    for order in range(1, size + 1):
        product = matrix @ terms[0]
        coefficients.insert(0, -float(np.trace(product)) / order)
        terms.insert(0, product + coefficients[0] * np.eye(size))
    return coefficients, terms[1:]


def growth_rates(scene: Scene, log_rate: float) -> np.ndarray:
    """Growth rates p, per slip in D_c, of small changes of steady sliding at the stiffness of the
    scene; complex, the fastest first. They go as exp(p V t/D_c).

    Raises
    ------
    ValueError
        Where there is no steady sliding.
    """
    steady = steady_sliding(scene, log_rate)
    if steady is None:
        raise ValueError(f"there is no steady sliding at ln(V/V_*) = {log_rate:g}")
    above, below = response(scene, steady)
    spring = [
        scene.stiffness,
        scene.dynamics.damping(log_rate),
        scene.stiffness * scene.dynamics.norm(scene, log_rate) ** 2,
    ]
    polynomial = _sum(_product(spring, below), [0.0, *above])
    roots = np.roots(polynomial[::-1])
    return np.asarray(roots[np.argsort(-roots.real)])


def _parts(polynomial: Polynomial) -> tuple[Polynomial, Polynomial]:
    """Real part, and imaginary part over omega, of a polynomial at i omega, in omega**2."""
    even = [x * (-1.0) ** n for n, x in enumerate(polynomial[0::2])]
    odd = [x * (-1.0) ** n for n, x in enumerate(polynomial[1::2])]
    return even, odd


def _product(first: Polynomial, second: Polynomial) -> Polynomial:
    product = [0.0] * (len(first) + len(second) - 1)
    for i, x in enumerate(first):
        for j, y in enumerate(second):
            product[i + j] += x * y
    return product


def _sum(first: Polynomial, second: Polynomial) -> Polynomial:
    longer = max(len(first), len(second))
    padded = ([*p, *[0.0] * (longer - len(p))] for p in (first, second))
    return [x + y for x, y in zip(*padded, strict=True)]


def _value(polynomial: Polynomial, at: float) -> float:
    return math.fsum(x * at**n for n, x in enumerate(polynomial))


def _positive_roots(polynomial: Polynomial) -> list[float]:
    while polynomial and polynomial[-1] == 0.0:
        polynomial = polynomial[:-1]
    if len(polynomial) == 2:
        roots = [-polynomial[0] / polynomial[1]]
    else:
        every = np.roots(polynomial[::-1])
        roots = every.real[np.abs(every.imag) <= 1e-12 * np.abs(every)].tolist()
    return [root for root in roots if root > 0.0]
