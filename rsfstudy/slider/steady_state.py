"""Steady sliding, from the friction relation of a scene alone.

At a steady ln(V/V_*) = x the states Psi_i rest where their law says, -b x + shift(g) for most, so
that frictional stress g solves

    strength(g) = a x + sum of Psi_i.

Nothing here depends on which parts the scene has.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from scipy.optimize import brentq

from rsfstudy.slider.equations import build_friction_relation, compute_steady_states
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_view import SceneView

#: Deviation of frictional stress, over sigma_*, beyond which none counts as steady.
_MAX_STEADY_FRICTIONAL_STRESS = 1e9
#: ln(V/V_*) below which steady sliding is not followed.
_MIN_LOG_SLIP_RATE = -1e6


@dataclass(frozen=True)
class SteadySliding:
    """Steady sliding at ln(V/V_*) = `log_slip_rate`.

    Attributes
    ----------
    log_slip_rate : float
    frictional_stress, spring_stress : float
        Deviations of frictional stress and of spring stress from tau_*, over sigma_*.
    states : tuple of float
        States freed of stress.
    """

    log_slip_rate: float
    frictional_stress: float
    spring_stress: float
    states: Numbers


@cached_per_scene
def steady_sliding(scene: SceneView, log_slip_rate: float) -> SteadySliding | None:
    """Steady sliding of a scene at ln(V/V_*), found once; None where no stress is as weak or as
    strong.

    Frictional stress g solves ``strength(g) = a ln(V/V_*) + sum of Psi_i``, and spring stress is
    that and what waves radiate.

    Parameters
    ----------
    scene : Scene
    log_slip_rate : float
        ln(V/V_*).
    """
    friction = frictional_stress_for_friction(
        scene, steady_friction_minus_reference(scene, log_slip_rate)
    )
    if friction is None:
        return None
    spring_stress = friction + scene.dynamics.radiated_stress(log_slip_rate)
    shift = build_friction_relation(scene)(friction)[2]
    return SteadySliding(
        log_slip_rate, friction, spring_stress, compute_steady_states(scene, log_slip_rate, shift)
    )


def steady_friction_minus_reference(scene: SceneView, log_slip_rate: float) -> float:
    """Steady friction coefficient at a slip rate, less mu_*.

    ``mu_ss - mu_* = (a - b) ln(V/V_*)`` by most laws.

    Parameters
    ----------
    scene : Scene
    log_slip_rate : float
        ln(V/V_*).

    References
    ----------
    Ruina (1983), J. Geophys. Res. 88, 10359-10370.
    """
    psi = scene.equation_functions.friction_functions.state_sum(
        compute_steady_states(scene, log_slip_rate, 0.0)
    )
    return float(scene.a * log_slip_rate + psi)


def frictional_stress_for_friction(
    scene: SceneView, friction_minus_reference: float
) -> float | None:
    """Deviation of frictional stress from tau_*, over sigma_*, at which the friction coefficient is
    mu_* + `excess`; None where it never is.

    ``(mu_* + g)/s(g) = mu_* + excess``, s being the normal stress ratio; where normal stress
    follows shear stress there is none below phi = atan(mu_ss), eq. 9 of
    doi:10.1007/s11589-014-0098-4.

    Parameters
    ----------
    scene : Scene
    friction_minus_reference : float
        Friction coefficient less mu_*.
    """
    relation = build_friction_relation(scene)

    def residual(friction: float) -> float:
        value, _slope, shift, _shift_slope = relation(friction)
        return value - shift - friction_minus_reference

    return _find_root_of_increasing_function(
        residual, friction_minus_reference, _min_frictional_stress(scene)
    )


def frictional_stress_after_jump(
    scene: SceneView, strength: float, states: Numbers = ()
) -> float | None:
    """Deviation of frictional stress from tau_*, over sigma_*, just after a sudden change; None
    where there is none.

    The states freed of stress stay as they are, so that ``strength(g) = excess`` with ``excess = a
    ln(V/V_*) + sum of Psi_i`` (eqs. 12 and 13 of doi:10.1007/s11589-014-0098-4).

    Parameters
    ----------
    scene : Scene
    strength : float
        What strength becomes, over sigma_*.
    states : tuple of float, optional
        States freed of stress, by which pore pressure is told; else that of steady sliding.
    """
    relation = build_friction_relation(scene, states)
    return _find_root_of_increasing_function(
        lambda friction: relation(friction)[0] - strength, strength, _min_frictional_stress(scene)
    )


def _min_frictional_stress(scene: SceneView) -> float:
    """Deviation of frictional stress above which slip is forward and normal stress positive."""
    weakest = scene.parts.normal_stress.min_frictional_stress(scene)
    # where slip may reverse, strength grows with stress of either sign
    return max(weakest, -scene.mu_star) if scene.parts.law.regularised else weakest


def _find_root_of_increasing_function(
    increasing_function: Callable[[float], float], initial_guess: float, lower_bound: float
) -> float | None:
    """Zero of a growing function, above `lowest`; None where there is none."""
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
        if stride > _MAX_STEADY_FRICTIONAL_STRESS or low == high:
            return None
        at = increasing_function(low)
    if high == low:
        while increasing_function(high) <= 0.0:
            if high > _MAX_STEADY_FRICTIONAL_STRESS:
                return None
            low, high = high, high + stride
            stride *= 2.0
    return float(brentq(increasing_function, low, high, xtol=1e-22, rtol=8.9e-16, maxiter=500))


def min_steady_log_slip_rate(scene: SceneView) -> float:
    """Smallest ln(V/V_*) with steady sliding: where stress would grow without bound; ``-inf`` where
    there is none.

    Of a driving stress at the angle phi, without an effect of normal stress on the law, it is where
    ``mu_ss = tan(phi)``, eq. 9 of doi:10.1007/s11589-014-0098-4.
    """
    value, _slope, shift, _shift_slope = build_friction_relation(scene)(
        _MAX_STEADY_FRICTIONAL_STRESS
    )
    strongest = value - shift
    if strongest > 1e6:
        return -math.inf
    if scene.parts.law.steady_states is None:
        return strongest / (scene.a - scene.b) if scene.b > scene.a else -math.inf
    slower = -1.0
    while steady_friction_minus_reference(scene, slower) <= strongest:
        slower *= 2.0
        if slower < _MIN_LOG_SLIP_RATE:
            return -math.inf
    return float(
        brentq(
            lambda x: steady_friction_minus_reference(scene, x) - strongest, slower, 0.0, xtol=1e-12
        )
    )
