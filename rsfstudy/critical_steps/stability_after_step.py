"""Stability of steady sliding at the load point velocity after a step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from rsfstudy.motion import MotionStopped
from rsfstudy.slider import Scene, SteadySliding
from rsfstudy.status import Status

#: Smallest significant difference from neutral stability. The limit applies to the relative
#: difference between the stiffness and the critical stiffness, and to the decay rate per D_c of
#: slip.
_NEUTRAL_STABILITY_TOLERANCE = 1e-9


@dataclass(frozen=True)
class SteadySlidingWithStabilityMargin(SteadySliding):
    """Steady sliding at the load point velocity, with a property for the stability margin.

    At constant normal stress and critical stiffness, steady sliding is neutrally stable and every
    orbit is closed. Gu et al. (1984) prove this result for the slip law, and Ranjith and Rice
    (1999) prove it for the slowness law. If steady sliding is neutrally stable, only numerical
    errors change the height of the slip rate peaks.

    Parameters
    ----------
    scene : Scene
        Scene with the load point velocity.
    """

    scene: Scene

    @cached_property
    def stability_margin(self) -> float:
        """Stability margin of steady sliding. See the function ``compute_stability_margin``.

        The margin is computed at the first access, because the outcome of most motions does not
        depend on the margin.
        """
        scene, law = self.scene, self.scene.parts.law
        at_every_rate = (
            has_closed_orbits_at_critical_stiffness(scene)
            and law.lacks_characteristic_slip_rate
            and not law.regularised
        )
        if at_every_rate and not scene.has_mass and not scene.parts.loading.unknowns:
            margin = compute_stiffness_ratio_after_step(scene) - 1.0
        else:
            critical = scene.critical_stiffness_at(self.log_slip_rate)
            margin = scene.stiffness / critical - 1.0 if critical > 0.0 else math.inf
        if (
            margin < -_NEUTRAL_STABILITY_TOLERANCE
            and scene.state_count > 1
            and _is_stable_to_small_perturbations(scene)
        ):
            return -margin
        return margin

    @property
    def is_stable(self) -> bool:
        """True if small perturbations of steady sliding do not grow."""
        return self.stability_margin >= -_NEUTRAL_STABILITY_TOLERANCE


def has_frictional_damping_only(scene: Scene) -> bool:
    """Return True if friction is the only source of damping.

    The effective normal stress must also be constant, except for sudden changes by the loading.

    Parameters
    ----------
    scene : Scene
        Scene to test.

    Returns
    -------
    bool
        False if shear stress or pore pressure changes the effective normal stress, if the
        temperature changes, or if waves radiate stress.
    """
    parts = scene.parts
    varies = parts.normal_stress.depends_on_shear_stress or parts.fluid.effects
    if varies or parts.temperature.unknowns:
        return False
    return not scene.dynamics.radiated_stress_slope(0.0)


def has_closed_orbits_at_critical_stiffness(scene: Scene) -> bool:
    """Return True if every orbit is closed at the critical stiffness.

    Parameters
    ----------
    scene : Scene
        Scene to test.

    Returns
    -------
    bool
        True if the law has closed orbits and friction is the only source of damping.
    """
    law = scene.parts.law
    return (
        law.has_closed_orbits_at_critical_stiffness
        and not law.depends_on_stress
        and has_frictional_damping_only(scene)
    )


def compute_stiffness_ratio_after_step(scene: Scene) -> float:
    """Return the stiffness ratio k/k_cr after a step.

    If friction is the only source of damping, the critical stiffness at V_* is proportional to
    normal stress.

    Parameters
    ----------
    scene : Scene
        Scene with the step.

    Returns
    -------
    float
        Ratio of the stiffness to the critical stiffness at V_* and at the normal stress after the
        step.
    """
    return scene.stiffness_ratio / (1.0 + scene.imposed_normal_stress)


def is_neutrally_stable(scene: Scene, tolerance: float) -> bool:
    """Return True if growth and decay of perturbations are indistinguishable.

    The stiffness must be close to the critical stiffness, both at V_* and at the load point
    velocity. If friction is the only source of damping, the critical stiffness does not depend on
    slip rate under most laws.

    Parameters
    ----------
    scene : Scene
        Scene with the step.
    tolerance : float
        Maximum relative difference from the critical stiffness.

    Returns
    -------
    bool
        True if growth and decay are indistinguishable. The result is False if the load point is
        held. The result is also False if the stiffness is exactly critical and all orbits are
        closed. In both cases, the stability of steady sliding is known without integration.
    """
    off = abs(compute_stiffness_ratio_after_step(scene) - 1.0)
    known = scene.log_load_velocity == -math.inf or (
        off == 0.0 and has_closed_orbits_at_critical_stiffness(scene)
    )
    close = has_frictional_damping_only(scene) and off < tolerance and not known
    return close and abs(compute_stability_margin(scene)) < tolerance


def is_linearly_stable(scene: Scene) -> bool:
    """Return True if steady sliding at the load point velocity is stable.

    Parameters
    ----------
    scene : Scene
        Scene with the load point velocity.

    Returns
    -------
    bool
        True if small perturbations do not grow, or if the load point is held.
    """
    return compute_stability_margin(scene) >= -_NEUTRAL_STABILITY_TOLERANCE


def compute_stability_margin(scene: Scene) -> float:
    """Compute the stability margin of steady sliding.

    The margin is the relative excess of the stiffness over the critical stiffness at the load point
    velocity.

    Parameters
    ----------
    scene : Scene
        Scene with the load point velocity.

    Returns
    -------
    float
        Margin :math:`k/k_{cr}(V_0) - 1`. The margin is infinite if steady sliding is stable at
        every stiffness or if the load point is held. If steady sliding with several states is
        stable below the critical stiffness, the margin is the absolute value of
        :math:`k/k_{cr}(V_0) - 1`.

    References
    ----------
    Rice, J. R., & Ruina, A. L. (1983). Stability of steady frictional slipping. J. Appl. Mech., 50,
    343-349.
    """
    return (
        math.inf
        if scene.log_load_velocity == -math.inf
        else find_steady_sliding_and_stability_margin(scene).stability_margin
    )


def find_steady_sliding_and_stability_margin(scene: Scene) -> SteadySlidingWithStabilityMargin:
    """Compute steady sliding at the load point velocity of the scene.

    Parameters
    ----------
    scene : Scene
        Scene with the load point velocity.

    Returns
    -------
    SteadySlidingWithStabilityMargin
        Steady sliding.

    Raises
    ------
    MotionStopped
        If sliding cannot be steady at the load point velocity.
    """
    load = scene.log_load_velocity
    sliding = scene.compute_steady_sliding(load)
    if sliding is None:
        raise MotionStopped(
            Status.NO_STEADY_STATE,
            f"no steady state exists at V_0/V_* = {math.exp(load):.3g}: phi < atan(mu_ss)",
        )
    return SteadySlidingWithStabilityMargin(**vars(sliding), scene=scene)


def _is_stable_to_small_perturbations(scene: Scene) -> bool:
    """Return True if small perturbations of steady sliding decay.

    If the scene has several states, perturbations may decay even if the stiffness is below the
    critical stiffness.
    """
    return bool(
        scene.linear_growth_rates(scene.log_load_velocity)[0].real < -_NEUTRAL_STABILITY_TOLERANCE
    )
