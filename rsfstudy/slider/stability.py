r"""Linear stability of steady sliding, computed from the friction relation.

The main functions are `compute_critical_stiffness` and `compute_largest_linear_growth_rate`, which
work for any combination of parts.

A small perturbation of slip, :math:`du`, grows as :math:`\exp(p s)` with slip :math:`s` in units of
:math:`D_c`. The module ``linear_response`` computes the perturbation of the frictional stress,
:math:`dg = G(p) \, du`.

The perturbation satisfies the force balance if :math:`K (1 + w^2 p^2) + \eta V p + G(p) = 0` with
:math:`w = V T/(2 \pi D_c)`. The critical stiffness is the stiffness :math:`K` for which :math:`p`
is imaginary.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.evolution_derivatives import compute_state_evolution_derivatives
from rsfstudy.slider.linear_response import LinearisedForceBalance, linearise_force_balance
from rsfstudy.slider.polynomials import (
    add_polynomials,
    compute_dot_product,
    compute_resolvent_polynomials,
    evaluate_polynomial,
    find_positive_real_roots,
    find_roots_with_one_very_large_root,
    multiply_polynomials,
    split_even_and_odd_powers,
)
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.steady_state import SteadySliding, compute_steady_sliding

#: Results below these limits cannot be distinguished from zero, because they are as small as
#: rounding errors. The first number is the limit for the critical stiffness divided by a. The
#: second number is the limit for the growth rate per unit slip in D_c.
_MIN_CRITICAL_STIFFNESS_OVER_A, _GROWTH_RATE_FLOOR = 1e-12, 1e-9
#: Rounding error of all growth rates, as a fraction of the largest growth rate.
_RELATIVE_GROWTH_RATE_ROUNDING_ERROR = 64.0 * 2.0**-52

#: If the ratio of the two leading coefficients of the polynomial is below this limit, the mass of
#: the slider is treated as small.
_SMALL_LEADING_COEFFICIENT_RATIO = 1e-6


def compute_critical_stiffness(
    scene: SceneView, log_slip_rate: float, *, quasi_static: bool = False
) -> float:
    r"""Compute the critical stiffness of steady sliding at a given slip rate.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters. The function does not use the stiffness of the
        scene.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    quasi_static : bool, default: False
        If True, the function ignores inertia and radiation damping. The property
        ``Scene.critical_stiffness`` is computed with this option at :math:`V_*`.

    Returns
    -------
    float
        Critical stiffness :math:`k_{cr} D_c/\sigma_*`. The result is 0 if sliding is stable at
        every stiffness, ``math.inf`` if sliding is unstable at every stiffness, and NaN if steady
        sliding does not exist at this slip rate.

    Notes
    -----
    For one state variable, constant pore pressure, and no inertia or radiation damping,

    .. math::

        k_{cr} = \frac{(b - a) \sigma_{ss}}{D_c [1 - \cot\phi \, (\mu_{ss} - \alpha)]}.

    References
    ----------
    Dieterich and Linker (1992), Geophys. Res. Lett. 19, 1691-1694.
    """
    scene = scene.steadily_loaded_scene
    steady = compute_steady_sliding(scene, log_slip_rate)
    if steady is None:
        return math.nan
    around = linearise_force_balance(scene, steady, quasi_static=quasi_static)
    crossings = _find_critical_stiffnesses(around, _MIN_CRITICAL_STIFFNESS_OVER_A * scene.a)
    critical = crossings[-1] if crossings else 0.0
    # A scene with one state and constant pore pressure has a single critical stiffness, above which
    # no perturbation grows.
    if scene.state_count == 1 or critical == math.inf:
        return critical
    return math.inf if _is_unstable_at_stiffness(around, 2.0 * critical or scene.a) else critical


def compute_all_critical_stiffnesses(scene: SceneView, log_slip_rate: float) -> list[float]:
    r"""Compute all critical stiffnesses of steady sliding at a given slip rate.

    At a critical stiffness, a small perturbation of steady sliding neither grows nor decays. A
    scene with several states may have more than one critical stiffness.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters. The function does not use the stiffness of the
        scene.
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
    scene = scene.steadily_loaded_scene
    steady = compute_steady_sliding(scene, log_slip_rate)
    return (
        []
        if steady is None
        else _find_critical_stiffnesses(
            linearise_force_balance(scene, steady), _MIN_CRITICAL_STIFFNESS_OVER_A * scene.a
        )
    )


def _find_critical_stiffnesses(
    linearised_balance: LinearisedForceBalance, min_stiffness: float
) -> list[float]:
    """Find all critical stiffnesses above a given minimum.

    At a critical stiffness, a pair of growth rates is purely imaginary. The stiffnesses are in
    ascending order. If inertia makes a critical stiffness infinite, the list contains ``math.inf``.
    """
    # For p = i omega, the polynomials depend on omega**2 only.
    (a_even, a_odd), (b_even, b_odd) = (
        split_even_and_odd_powers(linearised_balance.friction_response_numerator),
        split_even_and_odd_powers(linearised_balance.friction_response_denominator),
    )
    size = add_polynomials(
        multiply_polynomials(b_even, b_even), [0.0, *multiply_polynomials(b_odd, b_odd)]
    )
    resists = add_polynomials(
        multiply_polynomials(a_even, b_even), [0.0, *multiply_polynomials(a_odd, b_odd)]
    )
    turns = add_polynomials(
        multiply_polynomials(a_odd, b_even), [-x for x in multiply_polynomials(a_even, b_odd)]
    )
    crossings = []
    for squared in find_positive_real_roots(
        add_polynomials(resists, [linearised_balance.radiation_damping * x for x in size])
    ):
        elastic = squared * evaluate_polynomial(turns, squared) / evaluate_polynomial(size, squared)
        inertial = 1.0 - linearised_balance.slip_rate_norm**2 * squared
        crossings.append(elastic / inertial if inertial > 0.0 else math.inf)
    return sorted(stiffness for stiffness in crossings if stiffness > min_stiffness)


def _compute_growth_rates(
    linearised_balance: LinearisedForceBalance, stiffness: float
) -> np.ndarray:
    """Compute the growth rates p at a given stiffness, sorted by descending real part."""
    spring_stress = [
        stiffness,
        linearised_balance.radiation_damping,
        stiffness * linearised_balance.slip_rate_norm**2,
    ]
    polynomial = add_polynomials(
        multiply_polynomials(spring_stress, linearised_balance.friction_response_denominator),
        [0.0, *linearised_balance.friction_response_numerator],
    )
    light = (
        0.0 < abs(polynomial[-1]) < _SMALL_LEADING_COEFFICIENT_RATIO * abs(polynomial[-2])
        and linearised_balance.slip_rate_norm > 0.0
    )
    roots = find_roots_with_one_very_large_root(polynomial) if light else np.roots(polynomial[::-1])
    return np.asarray(roots[np.argsort(-roots.real)])


def _is_unstable_at_stiffness(linearised_balance: LinearisedForceBalance, stiffness: float) -> bool:
    return bool(_compute_growth_rates(linearised_balance, stiffness)[0].real > _GROWTH_RATE_FLOOR)


def compute_linear_growth_rates(scene: SceneView, log_slip_rate: float) -> np.ndarray:
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
    scene = scene.steadily_loaded_scene
    return _compute_growth_rates(
        linearise_force_balance(scene, _compute_steady_sliding_or_raise(scene, log_slip_rate)),
        scene.stiffness,
    )


class GrowthRateWithError(NamedTuple):
    """Largest growth rate of small perturbations of steady sliding.

    Parameters
    ----------
    real_part : float
        Real part of the growth rate, per unit slip in :math:`D_c`.
    error_estimate : float
        Error estimate of the real part.
    """

    real_part: float
    error_estimate: float

    @property
    def is_positive(self) -> bool:
        """True if the growth rate exceeds its error estimate."""
        return self.real_part > self.error_estimate

    @property
    def is_zero_within_error(self) -> bool:
        """True if the growth rate is zero within its error estimate."""
        return abs(self.real_part) <= self.error_estimate


@cached_per_scene
def compute_largest_linear_growth_rate(
    scene: SceneView, log_slip_rate: float
) -> GrowthRateWithError | None:
    r"""Compute the largest growth rate of perturbations of steady sliding.

    Parameters
    ----------
    scene : Scene
        Scene with a stiffness.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    GrowthRateWithError or None
        Growth rate with an error estimate. The error estimate includes the errors of the
        derivatives of the law, and rounding errors. If steady sliding does not exist at this slip
        rate, the function returns None.
    """
    scene = scene.steadily_loaded_scene
    steady = compute_steady_sliding(scene, log_slip_rate)
    if steady is None:
        return None
    slopes = compute_state_evolution_derivatives(scene, steady)
    error = slopes.max_relative_error_estimate

    def perturbed_growth_rates(part: float) -> np.ndarray:
        changed = slopes.with_perturbed_derivatives(part)
        return _compute_growth_rates(
            linearise_force_balance(scene, steady, changed), scene.stiffness
        )

    found = perturbed_growth_rates(0.0)
    changes = [
        abs(perturbed_growth_rates(part)[0].real - found[0].real) for part in (error, -error)
    ]
    # A small mass makes one root very large. The rounding error excludes the large root, because
    # the large root is computed separately.
    sizes = np.sort(np.abs(found))[: -1 if scene.has_mass else None]
    rounding = _RELATIVE_GROWTH_RATE_ROUNDING_ERROR * float(sizes.max(initial=0.0))
    return GrowthRateWithError(
        float(found[0].real), float(max(changes)) + rounding + _GROWTH_RATE_FLOOR
    )


def compute_spring_response_to_normal_stress(
    scene: SceneView, log_slip_rate: float, angular_frequency: float
) -> complex:
    r"""Compute the response of spring stress to oscillations of normal stress.

    The function assumes small oscillations of the normal stress around steady sliding. The loading
    of the scene must impose normal stress or pore pressure.

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
    InvalidValue
        If the temperature changes, because imposed normal stress also changes the heating.
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
    response develops a resonance at :math:`\omega D_c/V = \sqrt{(b - a)/a}`.
    """
    if scene.parts.temperature.unknowns:
        remedy = "Set temperature='isothermal', or simulate the oscillation."
        name = scene.parts.temperature.name
        raise InvalidValue("temperature", name, "has no linear response", remedy=remedy)
    still = scene.steadily_loaded_scene
    steady = _compute_steady_sliding_or_raise(still, log_slip_rate)
    psis = (*steady.states, *(0.0 for _unknown in scene.part_changing_effective_stress.unknowns))
    by_pressure, p = (
        scene.friction_law_functions.strength_derivatives_by_pressure,
        scene.friction_parameter_values,
    )
    gained, shifted = by_pressure(steady.frictional_stress, psis, p)
    _by_rate, by_shift, by_state, _error = compute_state_evolution_derivatives(still, steady)
    denominator, adjugate = compute_resolvent_polynomials(by_state)
    forced = [gained * x for x in denominator]
    for power, matrix in enumerate(adjugate):
        forced[power] -= shifted * math.fsum(compute_dot_product(row, by_shift) for row in matrix)
    around, stiffness = linearise_force_balance(still, steady), scene.stiffness
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


def _compute_steady_sliding_or_raise(scene: SceneView, log_slip_rate: float) -> SteadySliding:
    """Compute the state of steady sliding, or raise ``ValueError`` if it does not exist."""
    steady = compute_steady_sliding(scene, log_slip_rate)
    if steady is None:
        raise ValueError(f"steady sliding does not exist at ln(V/V_*) = {log_slip_rate:g}")
    return steady
