r"""Steady sliding, computed from the friction relation of a scene.

In steady sliding at :math:`x = \ln(V/V_*)`, the evolution law determines the states :math:`\Psi_i`.
For most laws with one state, :math:`\Psi = -b x + \mathrm{shift}(g)`. The frictional stress
:math:`g` is the solution of

.. math:: \mathrm{strength}(g) = a x + \sum_i \Psi_i.

The functions of this module work for any combination of parts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from scipy.optimize import brentq

from rsfstudy.slider.friction import build_friction_relation, compute_steady_states
from rsfstudy.slider.parts import FloatTuple
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.temperature_functions import compute_thermal_friction_change

#: Largest deviation of frictional stress, in units of sigma_*, that the root search considers.
_MAX_FRICTIONAL_STRESS_OF_ROOT_SEARCH = 1e9
#: Smallest ln(V/V_*) that the search for a minimum steady slip rate considers.
_MIN_LOG_SLIP_RATE_OF_ROOT_SEARCH = -1e6


@dataclass(frozen=True)
class SteadySliding:
    r"""Stresses and states in steady sliding at a given slip rate.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    frictional_stress : float
        Deviation of frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    spring_stress : float
        Deviation of spring stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    states : tuple of float
        States :math:`\Psi_i`. The effect of stress is not included in these states.
    """

    log_slip_rate: float
    frictional_stress: float
    spring_stress: float
    states: FloatTuple


@cached_per_scene
def compute_steady_sliding(scene: SceneView, log_slip_rate: float) -> SteadySliding | None:
    r"""Compute the stresses and states of steady sliding at a given slip rate.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    SteadySliding or None
        Stresses and states. The result is None if no frictional stress satisfies the friction
        relation, or if the steady temperature is unknown.

    Notes
    -----
    The frictional stress :math:`g` solves
    :math:`\mathrm{strength}(g) = a \ln(V/V_*) + \sum_i \Psi_i`. The spring stress is the sum of the
    frictional stress and the stress that radiation damping adds.
    """
    change = compute_steady_friction_minus_reference(scene, log_slip_rate)
    friction = (
        None if math.isnan(change) else compute_frictional_stress_from_friction(scene, change)
    )
    if friction is None:
        return None
    spring_stress = friction + scene.dynamics.radiated_stress(log_slip_rate)
    heated = scene.parts.temperature.unknowns
    # The steady temperature does not depend on the shift, but the shift depends on temperature.
    states = compute_steady_states(scene, log_slip_rate, 0.0) if heated else ()
    shift = build_friction_relation(scene, states)(friction)[2]
    return SteadySliding(
        log_slip_rate, friction, spring_stress, compute_steady_states(scene, log_slip_rate, shift)
    )


def compute_steady_friction_minus_reference(scene: SceneView, log_slip_rate: float) -> float:
    r"""Compute the steady friction coefficient minus its reference value.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    float
        Difference :math:`\mu_{ss} - \mu_*`. The result is NaN if the steady temperature is
        unknown.

    Notes
    -----
    For most laws, :math:`\mu_{ss} - \mu_* = (a - b) \ln(V/V_*)`.

    References
    ----------
    Ruina (1983), J. Geophys. Res. 88, 10359-10370.
    """
    states = compute_steady_states(scene, log_slip_rate, 0.0)
    psi = scene.friction_law_functions.state_sum(states)
    return float(scene.a * log_slip_rate + psi + compute_thermal_friction_change(scene, states))


def compute_frictional_stress_from_friction(
    scene: SceneView, friction_minus_reference: float
) -> float | None:
    r"""Compute the frictional stress from the friction coefficient.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    friction_minus_reference : float
        Friction coefficient minus :math:`\mu_*`.

    Returns
    -------
    float or None
        Deviation of frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`. The result
        is None if no frictional stress corresponds to the friction coefficient.

    Notes
    -----
    The stress :math:`g` solves :math:`(\mu_* + g)/s(g) = \mu`, with the normal stress ratio
    :math:`s`. If normal stress follows shear stress, the equation has no solution for loading
    angles :math:`\phi < \arctan \mu_{ss}` (eq. 9 of doi:10.1007/s11589-014-0098-4).
    """
    relation = build_friction_relation(scene)

    def residual(friction: float) -> float:
        value, _slope, shift, _shift_slope = relation(friction)
        return value - shift - friction_minus_reference

    return _find_root_of_increasing_function(
        residual, friction_minus_reference, _find_frictional_stress_lower_bound(scene)
    )


def compute_frictional_stress_from_strength(
    scene: SceneView, strength: float, states: FloatTuple = ()
) -> float | None:
    r"""Compute the frictional stress after a sudden change in stress or slip rate.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    strength : float
        Strength after the sudden change in stress or slip rate, in units of :math:`\sigma_*`.
    states : tuple of float, optional
        States :math:`\Psi_i`, from which the pore pressure is read. By default, the function uses
        the pore pressure of steady sliding.

    Returns
    -------
    float or None
        Deviation of frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`. The result
        is None if no frictional stress corresponds to `strength`.

    Notes
    -----
    The states :math:`\Psi_i` do not change when stress or slip rate changes suddenly, so that
    :math:`\mathrm{strength}(g) = a \ln(V/V_*) + \sum_i \Psi_i` (eqs. 12 and 13 of
    doi:10.1007/s11589-014-0098-4).
    """
    relation = build_friction_relation(scene, states)
    return _find_root_of_increasing_function(
        lambda friction: relation(friction)[0] - strength,
        strength,
        _find_frictional_stress_lower_bound(scene),
    )


def _find_frictional_stress_lower_bound(scene: SceneView) -> float:
    """Return the frictional stress above which slip is forward.

    Normal stress is positive if the frictional stress exceeds the returned stress.
    """
    weakest = scene.parts.normal_stress.compute_frictional_stress_lower_bound(scene)
    # If slip may reverse, strength increases with the magnitude of the stress, whose sign may be
    # positive or negative.
    return max(weakest, -scene.mu_star) if scene.parts.law.regularised else weakest


def _find_root_of_increasing_function(
    increasing_function: Callable[[float], float], initial_guess: float, lower_bound: float
) -> float | None:
    """Find the root of an increasing function above a lower bound.

    The function returns None if there is no root.
    """
    low = initial_guess if initial_guess > lower_bound else 0.5 * lower_bound
    high, stride = low, 1e-3 + abs(low)
    at = increasing_function(low)
    if at == 0.0:
        return float(low)
    while at > 0.0:
        high = low
        low = (
            max(low - stride, lower_bound + 0.5 * (low - lower_bound))
            if math.isfinite(lower_bound)
            else (low - stride)
        )
        stride *= 2.0
        if stride > _MAX_FRICTIONAL_STRESS_OF_ROOT_SEARCH or low == high:
            return None
        at = increasing_function(low)
    if high == low:
        while increasing_function(high) <= 0.0:
            if high > _MAX_FRICTIONAL_STRESS_OF_ROOT_SEARCH:
                return None
            low, high = high, high + stride
            stride *= 2.0
    return float(brentq(increasing_function, low, high, xtol=1e-22, rtol=8.9e-16, maxiter=500))


def find_min_steady_log_slip_rate(scene: SceneView) -> float:
    r"""Compute the smallest slip rate at which steady sliding exists.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.

    Returns
    -------
    float
        Smallest :math:`\ln(V/V_*)` of steady sliding. The steady stress becomes infinite as the
        slip rate decreases to this value. The result is ``-inf`` if steady sliding exists at all
        slip rates.

    Notes
    -----
    If normal stress follows shear stress at the angle :math:`\phi` and does not affect the state,
    the smallest slip rate is the solution of :math:`\mu_{ss} = \tan\phi` (eq. 9 of
    doi:10.1007/s11589-014-0098-4).
    """
    value, _slope, shift, _shift_slope = build_friction_relation(scene)(
        _MAX_FRICTIONAL_STRESS_OF_ROOT_SEARCH
    )
    strongest = value - shift
    if strongest > 1e6:
        return -math.inf
    if scene.parts.law.steady_states is None and not any(
        scene.parts.temperature.dimensionless_activation_energies
    ):
        return strongest / (scene.a - scene.b) if scene.b > scene.a else -math.inf

    def excess(log_slip_rate: float) -> float:
        change = compute_steady_friction_minus_reference(scene, log_slip_rate)
        # If there is no steady temperature, the slip rate is treated as too small.
        return 1.0 if math.isnan(change) else change - strongest

    slower = -1.0
    while excess(slower) <= 0.0:
        slower *= 2.0
        if slower < _MIN_LOG_SLIP_RATE_OF_ROOT_SEARCH:
            return -math.inf
    return float(brentq(excess, slower, 0.0, xtol=1e-12))
