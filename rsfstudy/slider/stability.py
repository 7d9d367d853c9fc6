r"""Linear stability of steady sliding, computed from the friction relation.

`critical_stiffness` and `largest_linear_growth_rate` are the main functions. Both functions work
for any combination of parts.

Consider a small perturbation of slip, :math:`du`, that grows as :math:`\exp(p s)` with slip
:math:`s` in units of :math:`D_c`. The perturbation of the frictional stress is
:math:`dg = G(p) \, du` with

.. math::

    G(p) = \frac{p [a + 1^T (p - M)^{-1} E_x]}{D - S \, 1^T (p - M)^{-1} E_s}.

Here :math:`D` and :math:`S` are the derivatives of strength and of the shift with respect to
frictional stress. The matrix :math:`M` and the vectors :math:`E_x` and :math:`E_s` contain the
derivatives of the state evolution with respect to the states, to :math:`x = \ln V` and to the
shift. The sum of the states of the law acts on friction, so the vector of weights is :math:`1^T`.
If the scene has a fluid, the weight of the pore pressure :math:`P`, the last state, is minus the
derivative of strength with respect to :math:`P`, and the weight of porosity is 0. Because the
pressure also changes the shift, the last column of :math:`M` includes the product of :math:`E_s`
and the derivative of the shift with respect to :math:`P`.

If an external load changes the normal stress by :math:`-dP`, the frictional stress changes by an
additional term,

.. math::

    -\frac{F - S_P \, 1^T (p - M)^{-1} E_s}{D - S \, 1^T (p - M)^{-1} E_s} \, dP,

in which :math:`F` and :math:`S_P` are the derivatives of strength and of the shift with respect to
:math:`P`.

The perturbation satisfies the force balance if :math:`K (1 + w^2 p^2) + \eta V p + G(p) = 0` with
:math:`w = V T/(2 \pi D_c)`. The critical stiffness is the stiffness :math:`K` for which :math:`p`
is imaginary.
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
    NestedListMatrix,
    StateEvolutionDerivatives,
    compute_state_evolution_derivatives,
)
from rsfstudy.slider.parameter_layout import temperature_parameter_values
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.steady_state import SteadySliding, steady_sliding
from rsfstudy.slider.temperature_functions import temperature_derivatives

#: Limits below which a result cannot be distinguished from zero because of rounding errors. The
#: first limit applies to a critical stiffness divided by a. The second limit applies to a growth
#: rate per slip distance of D_c.
_MIN_CRITICAL_STIFFNESS_OVER_A, _GROWTH_RATE_FLOOR = 1e-12, 1e-9
#: Rounding error of the growth rates, relative to the largest growth rate.
_RELATIVE_ROOT_ROUNDING_ERROR = 64.0 * 2.0**-52

#: The mass is treated as small if the ratio of the two leading polynomial coefficients is below the
#: first constant. The second constant is the number of Newton iterations for a small mass.
_SMALL_MASS_RATIO, _NEWTON_STEPS = 1e-6, 2

PolynomialCoefficients = list[float]


def critical_stiffness(
    scene: SceneView, log_slip_rate: float, *, quasi_static: bool = False
) -> float:
    r"""Compute the critical stiffness of steady sliding at a slip rate.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters. The stiffness of the scene is not used.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    quasi_static : bool, default: False
        Whether to ignore inertia and radiation damping.

    Returns
    -------
    float
        Critical stiffness :math:`k_{cr} D_c/\sigma_*`. The result is 0 if sliding is stable at
        every stiffness, ``math.inf`` if sliding is unstable at every stiffness, and NaN if steady
        sliding does not exist at this slip rate.

    Notes
    -----
    For one state variable without inertia,

    .. math::

        k_{cr} = \frac{(b - a) \sigma_{ss}}{D_c [1 - \cot\phi \, (\mu_{ss} - \alpha)]}.

    References
    ----------
    Dieterich and Linker (1992), Geophys. Res. Lett. 19, 1691-1694.
    """
    scene = scene.under_steady_loading
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        return math.nan
    around = _linearise_force_balance(scene, steady, quasi_static=quasi_static)
    crossings = _find_critical_stiffnesses(around, _MIN_CRITICAL_STIFFNESS_OVER_A * scene.a)
    critical = crossings[-1] if crossings else 0.0
    # With one state and constant pore pressure, no perturbation grows above the only critical
    # stiffness.
    if scene.state_count == 1 or critical == math.inf:
        return critical
    return math.inf if _is_unstable_at_stiffness(around, 2.0 * critical or scene.a) else critical


def all_critical_stiffnesses(scene: SceneView, log_slip_rate: float) -> list[float]:
    r"""Compute all stiffnesses at which the stability of sliding changes.

    A scene with several states may have more than one critical stiffness. At each critical
    stiffness, the number of growing perturbations changes.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters. The stiffness of the scene is not used.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    list of float
        Critical stiffnesses in units of :math:`\sigma_*/D_c`, in ascending order. The list is empty
        if steady sliding does not exist at this slip rate.

    Notes
    -----
    The critical stiffnesses are the values of :math:`K` at which the equation
    :math:`K (1 + w^2 p^2) + \eta V p + G(p) = 0` has an imaginary root.
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
    """Coefficients of the force balance, linearised around steady sliding."""

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
    """Find all stiffnesses for which a growth rate is imaginary, above a minimum.

    The stiffnesses are in ascending order. If no finite stiffness exists for a frequency because of
    inertia, the list of stiffnesses contains ``math.inf``.
    """
    # For p = i omega, the polynomials depend on omega**2 only.
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
    """Compute the growth rates p at a stiffness, largest real part first."""
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
    roots = _find_roots_with_one_distant_root(polynomial) if light else np.roots(polynomial[::-1])
    return np.asarray(roots[np.argsort(-roots.real)])


def _find_roots_with_one_distant_root(polynomial: PolynomialCoefficients) -> np.ndarray:
    """Find the roots of a polynomial with one root of large magnitude.

    A small mass makes one root about 1e20 times larger than the other roots. If all roots were
    computed together, the small roots would lose digits. The function computes the small roots
    without the leading coefficient and improves all roots by Newton iterations.
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
    r"""Compute the response of friction to small perturbations of slip.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters.
    steady_state : SteadySliding
        Steady sliding of the scene.
    evolution_derivatives : StateEvolutionDerivatives, optional
        Derivatives of the state evolution. By default the function computes the derivatives.

    Returns
    -------
    above, below : list of float
        Coefficients of the numerator polynomial and of the denominator polynomial of the response,
        in ascending order.

    Notes
    -----
    The response is the rational function :math:`G(p) = p \, \mathrm{above}(p)/\mathrm{below}(p)`.
    The module docstring defines :math:`G(p)`. For a law with one state at constant normal stress,
    :math:`G(p) = p [a - b/(p + 1)]` in units of :math:`\sigma_*/D_c`.

    References
    ----------
    Rice and Ruina (1983), J. Appl. Mech. 50, 343-349.
    """
    _value, slope, _shift, shift_slope = build_friction_relation(scene, steady_state.states)(
        steady_state.frictional_stress
    )
    by_rate, by_shift, by_state, _error = (
        evolution_derivatives or compute_state_evolution_derivatives(scene, steady_state)
    )
    by_state = [list(row) for row in by_state]
    weights, shifting = _log_slip_rate_change_by_each_state(scene, steady_state)
    for row, of_shift in zip(by_state, by_shift, strict=True):
        for place, shift in shifting.items():
            row[place] += of_shift * shift
    denominator, adjugate = compute_resolvent_polynomials(by_state)
    above = [scene.a * x for x in denominator]
    below = [slope * x for x in denominator]
    for power, matrix in enumerate(adjugate):
        for weight, row in zip(weights, matrix, strict=True):
            above[power] += weight * _dot_product(row, by_rate)
            below[power] -= shift_slope * (weight * _dot_product(row, by_shift))
    return above, below


def _log_slip_rate_change_by_each_state(
    scene: SceneView, steady_state: SteadySliding
) -> tuple[list[float], dict[int, float]]:
    """Return the weight of each state in the friction relation.

    The function also returns the derivatives of the shift with respect to the temperature and the
    pore pressure, by the index of the state.
    """
    law, fluid = scene.parts.law.state_count, len(scene.parts.fluid.unknowns)
    weights, shifts = [1.0] * law, dict[int, float]()
    if scene.parts.temperature.unknowns:
        gained, shifts[law] = temperature_derivatives(
            steady_state.states[law], temperature_parameter_values(scene)
        )
        weights.append(-gained)
    if fluid:
        by_pressure = scene.equation_functions.friction_functions.pressure_derivatives
        gained, shifts[-1] = by_pressure(
            steady_state.frictional_stress, steady_state.states, scene.friction_parameter_values
        )
        weights += [*[0.0] * (fluid - 1), -gained]
    return weights, shifts


def _dot_product(first: Sequence[float], second: Sequence[float]) -> float:
    return sum(map(mul, first, second))


def compute_resolvent_polynomials(
    matrix: NestedListMatrix,
) -> tuple[PolynomialCoefficients, list[NestedListMatrix]]:
    """Compute the resolvent of a matrix by the Faddeev-LeVerrier algorithm.

    The resolvent :math:`(p - M)^{-1}` is the adjugate matrix of :math:`p - M`, divided by the
    characteristic polynomial of :math:`M`.

    Parameters
    ----------
    matrix : list of list of float
        Square matrix :math:`M`.

    Returns
    -------
    coefficients : list of float
        Coefficients of the characteristic polynomial, in ascending order.
    adjugate : list of list of list of float
        Matrix coefficients of the adjugate matrix, in ascending order.
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
    r"""Compute the growth rates of small perturbations of steady sliding.

    Parameters
    ----------
    scene : Scene
        Scene with a stiffness.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    ndarray of complex
        Growth rates per unit slip in :math:`D_c`, sorted by descending real part.

    Raises
    ------
    ValueError
        If steady sliding does not exist at this slip rate.

    Notes
    -----
    The growth rates are the roots of :math:`K (1 + w^2 p^2) + \eta V p + G(p) = 0` with
    :math:`w = V T/(2 \pi D_c)`. A small perturbation varies as :math:`\exp(p V t/D_c)`.
    """
    scene = scene.under_steady_loading
    return _compute_growth_rates(
        _linearise_force_balance(scene, _require_steady_sliding(scene, log_slip_rate)),
        scene.stiffness,
    )


class GrowthRate(NamedTuple):
    """Largest growth rate of small perturbations of steady sliding.

    Parameters
    ----------
    value : float
        Real part of the growth rate, per unit slip in :math:`D_c`.
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
    r"""Compute the largest growth rate of perturbations of steady sliding.

    Parameters
    ----------
    scene : Scene
        Scene with a stiffness.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    GrowthRate or None
        Growth rate with an error estimate. The error estimate includes the errors of the
        derivatives of the law and the rounding errors of the growth rates. The result is None if
        steady sliding does not exist at this slip rate.
    """
    scene = scene.under_steady_loading
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        return None
    slopes = compute_state_evolution_derivatives(scene, steady)
    error = slopes.relative_error

    def perturbed_growth_rates(part: float) -> np.ndarray:
        changed = slopes.with_perturbed_derivatives(part)
        return _compute_growth_rates(
            _linearise_force_balance(scene, steady, changed), scene.stiffness
        )

    found = perturbed_growth_rates(0.0)
    changes = [
        abs(perturbed_growth_rates(part)[0].real - found[0].real) for part in (error, -error)
    ]
    # A small mass makes one root very large. The rounding error excludes the large root, because
    # the large root is computed separately.
    sizes = np.sort(np.abs(found))[: -1 if scene.has_mass else None]
    rounding = _RELATIVE_ROOT_ROUNDING_ERROR * float(sizes.max(initial=0.0))
    return GrowthRate(float(found[0].real), float(max(changes)) + rounding + _GROWTH_RATE_FLOOR)


def spring_response_to_normal_stress(
    scene: SceneView, log_slip_rate: float, angular_frequency: float
) -> complex:
    r"""Compute the response of the spring stress to imposed normal stress.

    The function considers small oscillations of the normal stress around steady sliding. The
    loading of the scene must impose normal stress or pore pressure.

    Parameters
    ----------
    scene : Scene
        Scene whose loading changes the normal stress.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    angular_frequency : float
        Angular frequency :math:`\omega D_c/V_*`.

    Returns
    -------
    complex
        Ratio of the complex amplitude of the spring stress to the complex amplitude of the normal
        stress.

    Raises
    ------
    ValueError
        If steady sliding does not exist at this slip rate.

    Notes
    -----
    If :math:`\Theta = -b \ln(V/V_*)` in steady sliding, and if normal stress does not depend on
    shear stress, the response is

    .. math::

        \frac{K [\mu + (\mu - \alpha) p]}{a p^2 + (K - b + a) p + K}, \qquad
        p = \frac{i \omega D_c}{V},

    with stress in units of :math:`\sigma`. As :math:`K` decreases to its critical value, the
    response has a resonance at :math:`\omega D_c/V = \sqrt{(b - a)/a}`.
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
    denominator, adjugate = compute_resolvent_polynomials(by_state)
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
    """Return steady sliding, or raise ``ValueError`` if it does not exist."""
    steady = steady_sliding(scene, log_slip_rate)
    if steady is None:
        raise ValueError(f"there is no steady sliding at ln(V/V_*) = {log_slip_rate:g}")
    return steady


def _split_even_and_odd_powers(
    polynomial: PolynomialCoefficients,
) -> tuple[PolynomialCoefficients, PolynomialCoefficients]:
    """Return the real part and the imaginary part of a polynomial at i omega.

    The real part, and the imaginary part divided by omega, are polynomials in omega**2.
    """
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
