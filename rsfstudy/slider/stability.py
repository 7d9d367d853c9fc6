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

from rsfstudy.slider.equations import build_friction_relation
from rsfstudy.slider.evolution_derivatives import (
    Matrix,
    StateEvolutionDerivatives,
    compute_state_evolution_derivatives,
)
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.steady_state import SteadySliding, steady_sliding

#: Critical stiffness over a, and growth per slip in D_c, that rounding leaves where there is none.
_MIN_CRITICAL_STIFFNESS_OVER_A, _GROWTH_RATE_FLOOR = 1e-12, 1e-9
#: Rounding error of growth rates, relative to the largest.
_RELATIVE_ROOT_ROUNDING_ERROR = 64.0 * 2.0**-52

#: Part of the next coefficient below which the one of mass is small, and steps of Newton from the
#: growth rates without it.
_SMALL_MASS_RATIO, _NEWTON_STEPS = 1e-6, 2

PolynomialCoefficients = list[float]


def critical_stiffness(
    scene: SceneView, log_slip_rate: float, *, quasi_static: bool = False
) -> float:
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
    scene = scene.under_steady_loading
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        return math.nan
    around = _linearise_force_balance(scene, steady, quasi_static=quasi_static)
    crossings = _find_critical_stiffnesses(around, _MIN_CRITICAL_STIFFNESS_OVER_A * scene.a)
    critical = crossings[-1] if crossings else 0.0
    # of one state drained, no perturbation grows beyond the only crossing
    if scene.state_count == 1 or critical == math.inf:
        return critical
    return math.inf if _is_unstable_at_stiffness(around, 2.0 * critical or scene.a) else critical


def all_critical_stiffnesses(scene: SceneView, log_slip_rate: float) -> list[float]:
    """Every stiffness over sigma_*/D_c at which small changes of steady sliding come to grow or to
    decay, or more of them grow, from the smallest up: several states may have more than one.

    Those K at which a root of ``K (1 + w**2 p**2) + eta V p + G(p) = 0`` is imaginary.
    """
    scene = scene.under_steady_loading
    steady = steady_sliding(scene, log_slip_rate)
    return (
        []
        if steady is None
        else _find_critical_stiffnesses(
            _linearise_force_balance(scene, steady), _MIN_CRITICAL_STIFFNESS_OVER_A * scene.a
        )
    )


class _LinearisedForceBalance(NamedTuple):
    """Terms that balance a spring around steady sliding: friction above/below, waves and mass."""

    friction_response_numerator: PolynomialCoefficients
    friction_response_denominator: PolynomialCoefficients
    radiation_damping: float
    slip_rate_norm: float


def _linearise_force_balance(
    scene: SceneView,
    steady_state: SteadySliding,
    evolution_derivatives: StateEvolutionDerivatives | None = None,
    *,
    quasi_static: bool = False,
) -> _LinearisedForceBalance:
    damping = (
        0.0 if quasi_static else scene.dynamics.radiated_stress_slope(steady_state.log_slip_rate)
    )
    norm = 0.0 if quasi_static else scene.dynamics.slip_rate_norm(scene, steady_state.log_slip_rate)
    return _LinearisedForceBalance(
        *linear_friction_response(scene, steady_state, evolution_derivatives), damping, norm
    )


def _find_critical_stiffnesses(
    linearised_balance: _LinearisedForceBalance, min_stiffness: float
) -> list[float]:
    """Stiffnesses above the least at which a growth rate is imaginary, from the smallest up;
    ``math.inf`` for one that mass leaves none for.
    """
    # at p = i omega, as polynomials in omega**2
    (a_even, a_odd), (b_even, b_odd) = (
        _split_even_and_odd_powers(linearised_balance.friction_response_numerator),
        _split_even_and_odd_powers(linearised_balance.friction_response_denominator),
    )
    size = _add_polynomials(
        _multiply_polynomials(b_even, b_even), [0.0, *_multiply_polynomials(b_odd, b_odd)]
    )
    resists = _add_polynomials(
        _multiply_polynomials(a_even, b_even), [0.0, *_multiply_polynomials(a_odd, b_odd)]
    )
    turns = _add_polynomials(
        _multiply_polynomials(a_odd, b_even), [-x for x in _multiply_polynomials(a_even, b_odd)]
    )
    crossings = []
    for squared in _positive_real_roots(
        _add_polynomials(resists, [linearised_balance.radiation_damping * x for x in size])
    ):
        elastic = (
            squared * _evaluate_polynomial(turns, squared) / _evaluate_polynomial(size, squared)
        )
        inertial = 1.0 - linearised_balance.slip_rate_norm**2 * squared
        crossings.append(elastic / inertial if inertial > 0.0 else math.inf)
    return sorted(stiffness for stiffness in crossings if stiffness > min_stiffness)


def _compute_growth_rates(
    linearised_balance: _LinearisedForceBalance, stiffness: float
) -> np.ndarray:
    """Growth rates p at a stiffness, the fastest first."""
    spring_stress = [
        stiffness,
        linearised_balance.radiation_damping,
        stiffness * linearised_balance.slip_rate_norm**2,
    ]
    polynomial = _add_polynomials(
        _multiply_polynomials(spring_stress, linearised_balance.friction_response_denominator),
        [0.0, *linearised_balance.friction_response_numerator],
    )
    light = (
        0.0 < abs(polynomial[-1]) < _SMALL_MASS_RATIO * abs(polynomial[-2])
        and linearised_balance.slip_rate_norm > 0.0
    )
    roots = _find_roots_if_one_is_distant(polynomial) if light else np.roots(polynomial[::-1])
    return np.asarray(roots[np.argsort(-roots.real)])


def _find_roots_if_one_is_distant(polynomial: PolynomialCoefficients) -> np.ndarray:
    """Roots of which a small mass makes one, 1e20 of the others: next to it they would lose digits,
    and are found without it.
    """
    falling = polynomial[::-1]
    roots = np.append(np.roots(falling[1:]), -falling[1] / falling[0]).astype(complex)
    for _ in range(_NEWTON_STEPS):
        off, slope = np.polyval(falling, roots), np.polyval(np.polyder(falling), roots)
        roots -= np.divide(off, slope, out=np.zeros_like(roots), where=slope != 0.0)
    return roots


def _is_unstable_at_stiffness(
    linearised_balance: _LinearisedForceBalance, stiffness: float
) -> bool:
    return bool(_compute_growth_rates(linearised_balance, stiffness)[0].real > _GROWTH_RATE_FLOOR)


def linear_friction_response(
    scene: SceneView,
    steady_state: SteadySliding,
    evolution_derivatives: StateEvolutionDerivatives | None = None,
) -> tuple[PolynomialCoefficients, PolynomialCoefficients]:
    """Compute the response of friction to small changes of slip in steady sliding.

    The response is the rational function ``G(p) = p above(p)/below(p)``. See the module docstring
    for its definition, ``G(p) = p [a + 1.(p - M)^-1 E_x]/[D - S 1.(p - M)^-1 E_s]``. For a law with
    one state at constant normal stress, ``G(p) = p [a - b/(p + 1)]``, in units of sigma_*/D_c.

    Parameters
    ----------
    scene : Scene
    steady_state : SteadySliding
    evolution_derivatives : LawSlopes, optional
        Derivatives of the state evolution. By default the derivatives are computed.

    Returns
    -------
    above, below : list of float
        Coefficients of the numerator and denominator polynomials, in ascending order.

    References
    ----------
    Rice and Ruina (1983), J. Appl. Mech. 50, 343-349.
    """
    _value, slope, _shift, shift_slope = build_friction_relation(scene)(
        steady_state.frictional_stress
    )
    by_rate, by_shift, by_state, _error = (
        evolution_derivatives or compute_state_evolution_derivatives(scene, steady_state)
    )
    by_state = [list(row) for row in by_state]
    weights, shifting = _state_weights_in_log_slip_rate(scene, steady_state)
    for row, of_shift in zip(by_state, by_shift, strict=True):
        row[-1] += of_shift * shifting
    denominator, adjugate = compute_matrix_resolvent(by_state)
    above = [scene.a * x for x in denominator]
    below = [slope * x for x in denominator]
    for power, matrix in enumerate(adjugate):
        for weight, row in zip(weights, matrix, strict=True):
            above[power] += weight * _dot_product(row, by_rate)
            below[power] -= shift_slope * (weight * _dot_product(row, by_shift))
    return above, below


def _state_weights_in_log_slip_rate(
    scene: SceneView, steady_state: SteadySliding
) -> tuple[list[float], float]:
    """Change of a ln V by each state, and by how much the last moves the shift."""
    law, fluid = scene.parts.law.state_count, len(scene.parts.fluid.unknowns)
    if not fluid:
        return [1.0] * law, 0.0
    by_pressure = scene.equation_functions.friction_functions.pressure_derivatives
    gained, shifted = by_pressure(
        steady_state.frictional_stress, steady_state.states, scene.friction_parameter_values
    )
    return [*[1.0] * law, *[0.0] * (fluid - 1), -gained], shifted


def _dot_product(first: Sequence[float], second: Sequence[float]) -> float:
    return sum(map(mul, first, second))


def compute_matrix_resolvent(matrix: Matrix) -> tuple[PolynomialCoefficients, list[Matrix]]:
    """Characteristic polynomial of a matrix M, and the adjugate of p - M, whose quotient is the
    inverse of p - M: coefficients from the constant one up (Faddeev and LeVerrier).
    """
    places = range(len(matrix))
    coefficients, terms = [1.0], [[[float(i == j) for j in places] for i in places]]
    for order in range(1, len(matrix) + 1):
        columns = list(zip(*terms[0], strict=True))
        term = [[_dot_product(row, column) for column in columns] for row in matrix]
        coefficients.insert(0, -sum(term[i][i] for i in places) / order)
        for i in places:
            term[i][i] += coefficients[0]
        terms.insert(0, term)
    return coefficients, terms[1:]


def linear_growth_rates(scene: SceneView, log_slip_rate: float) -> np.ndarray:
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
    scene = scene.under_steady_loading
    return _compute_growth_rates(
        _linearise_force_balance(scene, _require_steady_sliding(scene, log_slip_rate)),
        scene.stiffness,
    )


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
    def is_zero_within_error(self) -> bool:
        """True if the growth rate is zero within its error estimate."""
        return abs(self.value) <= self.error


@cached_per_scene
def largest_linear_growth_rate(scene: SceneView, log_slip_rate: float) -> GrowthRate | None:
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
    scene = scene.under_steady_loading
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        return None
    slopes = compute_state_evolution_derivatives(scene, steady)
    error = slopes.relative_error

    def perturbed_growth_rates(part: float) -> np.ndarray:
        changed = slopes.with_relative_change(part)
        return _compute_growth_rates(
            _linearise_force_balance(scene, steady, changed), scene.stiffness
        )

    found = perturbed_growth_rates(0.0)
    changes = [
        abs(perturbed_growth_rates(part)[0].real - found[0].real) for part in (error, -error)
    ]
    # the root that a small mass sends far off is found apart from the others
    sizes = np.sort(np.abs(found))[: -1 if scene.has_mass else None]
    rounding = _RELATIVE_ROOT_ROUNDING_ERROR * float(sizes.max(initial=0.0))
    return GrowthRate(float(found[0].real), float(max(changes)) + rounding + _GROWTH_RATE_FLOOR)


def spring_response_to_normal_stress(
    scene: SceneView, log_slip_rate: float, angular_frequency: float
) -> complex:
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
    angular_frequency : float
        omega D_c/V_*.

    Raises
    ------
    ValueError
        Where there is no steady sliding.
    """
    still = scene.under_steady_loading
    steady = _require_steady_sliding(still, log_slip_rate)
    psis = (*steady.states, *(0.0 for _unknown in scene.pressure_source.unknowns))
    by_pressure, p = (
        scene.equation_functions.friction_functions.pressure_derivatives,
        scene.friction_parameter_values,
    )
    gained, shifted = by_pressure(steady.frictional_stress, psis, p)
    _by_rate, by_shift, by_state, _error = compute_state_evolution_derivatives(still, steady)
    denominator, adjugate = compute_matrix_resolvent(by_state)
    forced = [gained * x for x in denominator]
    for power, matrix in enumerate(adjugate):
        forced[power] -= shifted * math.fsum(_dot_product(row, by_shift) for row in matrix)
    around, stiffness = _linearise_force_balance(still, steady), scene.stiffness
    spring_stress = [stiffness, around.radiation_damping, stiffness * around.slip_rate_norm**2]
    at = 1j * angular_frequency * math.exp(-log_slip_rate)
    left, above, below, balance = (
        complex(np.polyval(polynomial[::-1], at))
        for polynomial in (
            forced,
            around.friction_response_numerator,
            around.friction_response_denominator,
            spring_stress,
        )
    )
    return stiffness * left / (balance * below + at * above)


def _require_steady_sliding(scene: SceneView, log_slip_rate: float) -> SteadySliding:
    """Steady sliding, which there must be."""
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        raise ValueError(f"there is no steady sliding at ln(V/V_*) = {log_slip_rate:g}")
    return steady


def _split_even_and_odd_powers(
    polynomial: PolynomialCoefficients,
) -> tuple[PolynomialCoefficients, PolynomialCoefficients]:
    """Real part, and imaginary part over omega, of a polynomial at i omega, in omega**2."""
    even = [x * (-1.0) ** n for n, x in enumerate(polynomial[0::2])]
    odd = [x * (-1.0) ** n for n, x in enumerate(polynomial[1::2])]
    return even, odd


def _multiply_polynomials(
    first: PolynomialCoefficients, second: PolynomialCoefficients
) -> PolynomialCoefficients:
    product = [0.0] * (len(first) + len(second) - 1)
    for i, x in enumerate(first):
        for j, y in enumerate(second):
            product[i + j] += x * y
    return product


def _add_polynomials(
    first: PolynomialCoefficients, second: PolynomialCoefficients
) -> PolynomialCoefficients:
    return [x + y for x, y in zip_longest(first, second, fillvalue=0.0)]


def _evaluate_polynomial(polynomial: PolynomialCoefficients, argument: float) -> float:
    return math.fsum([x * argument**n for n, x in enumerate(polynomial)])


def _positive_real_roots(polynomial: PolynomialCoefficients) -> list[float]:
    while polynomial and polynomial[-1] == 0.0:
        polynomial = polynomial[:-1]
    if len(polynomial) == 2:
        roots = [-polynomial[0] / polynomial[1]]
    else:
        every = np.roots(polynomial[::-1])
        roots = every.real[np.abs(every.imag) <= 1e-12 * np.abs(every)].tolist()
    return [root for root in roots if root > 0.0]
