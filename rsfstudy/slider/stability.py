"""Linear stability of steady sliding, from the friction relation of a scene alone.

A small change of slip that goes as exp(p s), s being slip over D_c, changes frictional stress by
G(p) times itself. With D = strength', S = shift', and the slopes M, E_x and E_s of the evolution of
the states with respect to one another, to x and to the shift,

    [D - S 1.(p - M)^-1 E_s] dg = p [a + 1.(p - M)^-1 E_x] du.

Pore pressure P, the last state where there is a fluid, takes -dstrength/dP from a x in the place of
the 1 of a state of the law, and porosity nothing; P moves the shift too, so that E_s dshift/dP is
part of its column of M.

Normal stress that something outside changes by -dP acts on friction and on the shift alone: with
the slopes F and S_P of strength and shift with respect to P, friction changes by

    -[F - S_P 1.(p - M)^-1 E_s] dP / [D - S 1.(p - M)^-1 E_s]

beside G(p) du.

Spring, waves and mass balance it where K (1 + w**2 p**2) + eta V p + G(p) = 0, w being
V T/(2 pi D_c). The critical stiffness is the K at which p is imaginary. Nothing here depends on
which parts the scene has.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import zip_longest
from operator import mul
from typing import NamedTuple

import numpy as np

from rsfstudy.slider.derived import once
from rsfstudy.slider.equations import relation_of
from rsfstudy.slider.law_slopes import LawSlopes, Matrix, slopes_of_law
from rsfstudy.slider.parts import Scene
from rsfstudy.slider.steady import Steady, steady_sliding

#: Critical stiffness over a, and growth per slip in D_c, that rounding leaves where there is none.
_ROUNDING, _STILL = 1e-12, 1e-9
#: Rounding error of growth rates, relative to the largest.
_ROUNDING_OF_ROOTS = 64.0 * 2.0**-52

#: Part of the next coefficient below which the one of mass is small, and steps of Newton from the
#: growth rates without it.
_LIGHT, _POLISHED = 1e-6, 2

Polynomial = list[float]


def critical_stiffness(scene: Scene, log_slip_rate: float, *, quasi_static: bool = False) -> float:
    """Critical stiffness ``k_cr D_c/sigma_*`` of steady sliding at ln(V/V_*).

    Parameters
    ----------
    scene : Scene
        Its own stiffness does not matter.
    log_slip_rate : float
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
    scene = scene.unforced
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        return math.nan
    around = _around(scene, steady, quasi_static=quasi_static)
    crossings = _crossings(around, _ROUNDING * scene.a)
    critical = crossings[-1] if crossings else 0.0
    # of one state drained, no perturbation grows beyond the only crossing
    if scene.states == 1 or critical == math.inf:
        return critical
    return math.inf if _grows(around, 2.0 * critical or scene.a) else critical


def critical_stiffnesses(scene: Scene, log_slip_rate: float) -> list[float]:
    """Every stiffness over sigma_*/D_c at which small changes of steady sliding come to grow or to
    decay, or more of them grow, from the smallest up: several states may have more than one.

    Those K at which a root of ``K (1 + w**2 p**2) + eta V p + G(p) = 0`` is imaginary.
    """
    scene = scene.unforced
    steady = steady_sliding(scene, log_slip_rate)
    return [] if steady is None else _crossings(_around(scene, steady), _ROUNDING * scene.a)


class _Around(NamedTuple):
    """Terms that balance a spring around steady sliding: friction above/below, waves and mass."""

    above: Polynomial
    below: Polynomial
    damping: float
    norm: float


def _around(
    scene: Scene, steady: Steady, slopes: LawSlopes | None = None, *, quasi_static: bool = False
) -> _Around:
    damping = 0.0 if quasi_static else scene.dynamics.damping(steady.log_slip_rate)
    norm = 0.0 if quasi_static else scene.dynamics.norm(scene, steady.log_slip_rate)
    return _Around(*response(scene, steady, slopes), damping, norm)


def _crossings(around: _Around, least: float) -> list[float]:
    """Stiffnesses above the least at which a growth rate is imaginary, from the smallest up;
    ``math.inf`` for one that mass leaves none for.
    """
    # at p = i omega, as polynomials in omega**2
    (a_even, a_odd), (b_even, b_odd) = _parts(around.above), _parts(around.below)
    size = _sum(_product(b_even, b_even), [0.0, *_product(b_odd, b_odd)])
    resists = _sum(_product(a_even, b_even), [0.0, *_product(a_odd, b_odd)])
    turns = _sum(_product(a_odd, b_even), [-x for x in _product(a_even, b_odd)])
    crossings = []
    for squared in _positive_roots(_sum(resists, [around.damping * x for x in size])):
        elastic = squared * _value(turns, squared) / _value(size, squared)
        inertial = 1.0 - around.norm**2 * squared
        crossings.append(elastic / inertial if inertial > 0.0 else math.inf)
    return sorted(stiffness for stiffness in crossings if stiffness > least)


def _rates(around: _Around, stiffness: float) -> np.ndarray:
    """Growth rates p at a stiffness, the fastest first."""
    spring_stress = [stiffness, around.damping, stiffness * around.norm**2]
    polynomial = _sum(_product(spring_stress, around.below), [0.0, *around.above])
    light = 0.0 < abs(polynomial[-1]) < _LIGHT * abs(polynomial[-2]) and around.norm > 0.0
    roots = _with_one_far_off(polynomial) if light else np.roots(polynomial[::-1])
    return np.asarray(roots[np.argsort(-roots.real)])


def _with_one_far_off(polynomial: Polynomial) -> np.ndarray:
    """Roots of which a small mass makes one, 1e20 of the others: next to it they would lose digits,
    and are found without it.
    """
    falling = polynomial[::-1]
    roots = np.append(np.roots(falling[1:]), -falling[1] / falling[0]).astype(complex)
    for _ in range(_POLISHED):
        off, slope = np.polyval(falling, roots), np.polyval(np.polyder(falling), roots)
        roots -= np.divide(off, slope, out=np.zeros_like(roots), where=slope != 0.0)
    return roots


def _grows(around: _Around, stiffness: float) -> bool:
    return bool(_rates(around, stiffness)[0].real > _STILL)


def response(
    scene: Scene, steady: Steady, slopes: LawSlopes | None = None
) -> tuple[Polynomial, Polynomial]:
    """Compute the response of friction to small changes of slip in steady sliding.

    The response is the rational function ``G(p) = p above(p)/below(p)``. See the module docstring
    for its definition, ``G(p) = p [a + 1.(p - M)^-1 E_x]/[D - S 1.(p - M)^-1 E_s]``. For a law with
    one state at constant normal stress, ``G(p) = p [a - b/(p + 1)]``, in units of sigma_*/D_c.

    Parameters
    ----------
    scene : Scene
    steady : Steady
    slopes : LawSlopes, optional
        Derivatives of the state evolution. By default the derivatives are computed.

    Returns
    -------
    above, below : list of float
        Coefficients of the numerator and denominator polynomials, in ascending order.

    References
    ----------
    Rice and Ruina (1983), J. Appl. Mech. 50, 343-349.
    """
    _value, slope, _shift, shift_slope = relation_of(scene)(steady.friction)
    by_rate, by_shift, by_state, _error = slopes or slopes_of_law(scene, steady)
    by_state = [list(row) for row in by_state]
    weights, shifting = _actions(scene, steady)
    for row, of_shift in zip(by_state, by_shift, strict=True):
        row[-1] += of_shift * shifting
    denominator, adjugate = resolvent(by_state)
    above = [scene.a * x for x in denominator]
    below = [slope * x for x in denominator]
    for power, matrix in enumerate(adjugate):
        for weight, row in zip(weights, matrix, strict=True):
            above[power] += weight * _dot(row, by_rate)
            below[power] -= shift_slope * (weight * _dot(row, by_shift))
    return above, below


def _actions(scene: Scene, steady: Steady) -> tuple[list[float], float]:
    """Change of a ln V by each state, and by how much the last moves the shift."""
    law, fluid = scene.parts.law.states, len(scene.parts.fluid.unknowns)
    if not fluid:
        return [1.0] * law, 0.0
    by_pressure = scene.functions.friction.by_pressure
    gained, shifted = by_pressure(steady.friction, steady.psis, scene.numbers_of_friction)
    return [*[1.0] * law, *[0.0] * (fluid - 1), -gained], shifted


def _dot(first: Sequence[float], second: Sequence[float]) -> float:
    return sum(map(mul, first, second))


def resolvent(matrix: Matrix) -> tuple[Polynomial, list[Matrix]]:
    """Characteristic polynomial of a matrix M, and the adjugate of p - M, whose quotient is the
    inverse of p - M: coefficients from the constant one up (Faddeev and LeVerrier).
    """
    places = range(len(matrix))
    coefficients, terms = [1.0], [[[float(i == j) for j in places] for i in places]]
    for order in range(1, len(matrix) + 1):
        columns = list(zip(*terms[0], strict=True))
        term = [[_dot(row, column) for column in columns] for row in matrix]
        coefficients.insert(0, -sum(term[i][i] for i in places) / order)
        for i in places:
            term[i][i] += coefficients[0]
        terms.insert(0, term)
    return coefficients, terms[1:]


def growth_rates(scene: Scene, log_slip_rate: float) -> np.ndarray:
    """Growth rates p of small changes of steady sliding at the stiffness of the scene.

    The roots of ``K (1 + w**2 p**2) + eta V p + G(p) = 0`` with w = V T/(2 pi D_c). Small changes
    go as exp(p V t/D_c).

    Parameters
    ----------
    scene : Scene
    log_slip_rate : float
        ln(V/V_*).

    Returns
    -------
    ndarray of complex
        Per slip in D_c, the fastest first.

    Raises
    ------
    ValueError
        Where there is no steady sliding.
    """
    scene = scene.unforced
    return _rates(_around(scene, _sliding(scene, log_slip_rate)), scene.stiffness)


class GrowthRate(NamedTuple):
    """Largest growth rate of small perturbations of steady sliding, per slip in D_c.

    Attributes
    ----------
    value : float
        Real part of the growth rate.
    error : float
        Error estimate of the real part.
    """

    value: float
    error: float

    @property
    def is_positive(self) -> bool:
        """True if the growth rate exceeds its error estimate."""
        return self.value > self.error

    @property
    def is_undecided(self) -> bool:
        """True if the growth rate is zero within its error estimate."""
        return abs(self.value) <= self.error


@once
def largest_growth_rate(scene: Scene, log_slip_rate: float) -> GrowthRate | None:
    """Compute the largest growth rate of small perturbations of steady sliding.

    The growth rate is computed at the stiffness of the scene. Its error estimate includes the
    errors of the derivatives of the law and the rounding errors of the roots.

    Parameters
    ----------
    scene : Scene
    log_slip_rate : float
        ln(V/V_*).

    Returns
    -------
    GrowthRate or None
        None if steady sliding does not exist at this slip rate.
    """
    scene = scene.unforced
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        return None
    slopes = slopes_of_law(scene, steady)
    error = slopes.relative_error

    def rates(part: float) -> np.ndarray:
        changed = slopes.with_relative_change(part)
        return _rates(_around(scene, steady, changed), scene.stiffness)

    found = rates(0.0)
    changes = [abs(rates(part)[0].real - found[0].real) for part in (error, -error)]
    # the root that a small mass sends far off is found apart from the others
    sizes = np.sort(np.abs(found))[: -1 if scene.has_mass else None]
    rounding = _ROUNDING_OF_ROOTS * float(sizes.max(initial=0.0))
    return GrowthRate(float(found[0].real), float(max(changes)) + rounding + _STILL)


def response_to_normal_stress(scene: Scene, log_slip_rate: float, frequency: float) -> complex:
    """Spring stress over imposed normal stress in small oscillations around steady sliding, of a
    scene whose loading goes on changing that.

    At constant shear stress and with the laws that rest at Theta = -b ln(V/V_*) it is ``K [mu + (mu
    - alpha) p]/[a p**2 + (K - b + a) p + K]``, with p = i omega D_c/V and stress over sigma, which
    has its resonance at omega D_c/V = sqrt((b - a)/a) as K falls to its critical value.

    Parameters
    ----------
    scene : Scene
    log_slip_rate : float
        ln(V/V_*).
    frequency : float
        omega D_c/V_*.

    Raises
    ------
    ValueError
        Where there is no steady sliding.
    """
    still = scene.unforced
    steady = _sliding(still, log_slip_rate)
    psis = (*steady.psis, *(0.0 for _unknown in scene.pressure_source.unknowns))
    by_pressure, p = scene.functions.friction.by_pressure, scene.numbers_of_friction
    gained, shifted = by_pressure(steady.friction, psis, p)
    _by_rate, by_shift, by_state, _error = slopes_of_law(still, steady)
    denominator, adjugate = resolvent(by_state)
    forced = [gained * x for x in denominator]
    for power, matrix in enumerate(adjugate):
        forced[power] -= shifted * math.fsum(_dot(row, by_shift) for row in matrix)
    around, stiffness = _around(still, steady), scene.stiffness
    spring_stress = [stiffness, around.damping, stiffness * around.norm**2]
    at = 1j * frequency * math.exp(-log_slip_rate)
    left, above, below, balance = (
        complex(np.polyval(polynomial[::-1], at))
        for polynomial in (forced, around.above, around.below, spring_stress)
    )
    return stiffness * left / (balance * below + at * above)


def _sliding(scene: Scene, log_slip_rate: float) -> Steady:
    """Steady sliding, which there must be."""
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        raise ValueError(f"there is no steady sliding at ln(V/V_*) = {log_slip_rate:g}")
    return steady


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
    return [x + y for x, y in zip_longest(first, second, fillvalue=0.0)]


def _value(polynomial: Polynomial, at: float) -> float:
    return math.fsum([x * at**n for n, x in enumerate(polynomial)])


def _positive_roots(polynomial: Polynomial) -> list[float]:
    while polynomial and polynomial[-1] == 0.0:
        polynomial = polynomial[:-1]
    if len(polynomial) == 2:
        roots = [-polynomial[0] / polynomial[1]]
    else:
        every = np.roots(polynomial[::-1])
        roots = every.real[np.abs(every.imag) <= 1e-12 * np.abs(every)].tolist()
    return [root for root in roots if root > 0.0]
