"""Linear stability of steady sliding: the critical stiffness from algebra, and from growth of the
assembled equations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import brentq

from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.stepping import Meter
from rsfstudy.slider import steady_state
from rsfstudy.slider.effects import radiation_damping
from rsfstudy.slider.equations import (
    Equations,
    inertial,
    radiated,
    slow_manifold,
    strength_of,
    without_mass,
)
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Step of the central differences in units of the scale of an unknown: rounding and truncation
#: balance there.
_DIFFERENCE = 1e-4
#: Slip rate norm from which growth is found from the full equations; below, double precision does
#: not see mass in them, and the slow manifold, of first order in mass, is exact enough.
_MASS_SHOWS = 1e-3
#: Rise of the critical stiffness by mass beyond which no spring counts as stiff enough.
_LARGEST_RISE = 1e6


@dataclass(frozen=True)
class LinearStability(Measure):
    """Critical stiffness of steady sliding at the load point velocity of the scene, over
    sigma_*/D_c.

    Twice: by the closed form, and as the stiffness at which small perturbations of the assembled
    equations neither grow nor decay, so that algebra and code vouch for each other.
    """

    name: ClassVar[str] = "linear_stability"

    @property
    def headline(self) -> str:
        return "critical_stiffness"

    @property
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        names = (
            "critical_stiffness",
            "critical_stiffness_error",
            "critical_stiffness_from_growth",
            "critical_stiffness_explicit",
            "relative_critical_stiffness",
            "rise_by_dynamics",
            "steady_friction",
            "steady_normal_stress",
        )
        return dict.fromkeys(names, ())

    @property
    def sought(self) -> tuple[str, ...]:
        return ("stiffness_ratio",)

    @property
    def typical_work(self) -> int:
        return 100

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Closed form, and the root of the growth in stiffness; their difference is the error of
        the algebra.
        """
        load, cot_phi = scene.log_load_rate, scene.cot_phi
        mu_ss = steady_state.steady_friction(load, scene.mu_star, scene.a, scene.b)
        if load <= steady_state.lowest_log_rate(scene.mu_star, scene.a, scene.b, cot_phi):
            return Outcome(
                Status.NO_STEADY_STATE,
                {"steady_friction": mu_ss},
                "phi < atan(mu_ss): the slider locks while stress rises, and runs while it falls",
            )
        sigma_ss = steady_state.steady_normal_stress(mu_ss, scene.mu_star, cot_phi)
        values = {"steady_friction": mu_ss, "steady_normal_stress": sigma_ss}
        parameters = (load, scene.mu_star, scene.a, scene.b, cot_phi, scene.alpha or 0.0)
        massless, rise = steady_state.critical_stiffness(*parameters), 0.0
        if scene.radiation_damping > 0.0:
            damping = scene.radiation_damping * scene.load_velocity
            damped = radiation_damping.critical_stiffness(
                massless, damping, mu_ss, scene.alpha or 0.0, cot_phi
            )
            if damped <= 0.0:
                return Outcome(
                    Status.STABLE_AT_ANY_STIFFNESS,
                    values,
                    f"at eta V = {damping:.3g} sigma_* radiation damps every perturbation",
                )
            rise = damped / massless - 1.0
        if scene.inertia:
            norm = scene.load_velocity * scene.inertial_time
            rise = steady_state.rise_by_mass(massless, norm, mu_ss, sigma_ss, scene.a, cot_phi)
            if rise > _LARGEST_RISE:
                return Outcome(
                    Status.UNSTABLE_AT_ANY_STIFFNESS,
                    values,
                    f"at V T/(2 pi D_c) = {norm:.3g} the direct effect cannot damp the spring",
                )
        closed = massless * (1.0 + rise)
        found = _threshold(scene, closed, meter)
        return Outcome(
            Status.OK,
            {
                "critical_stiffness": closed,
                "critical_stiffness_error": abs(found - closed) + 1e-15 * closed,
                "critical_stiffness_from_growth": found,
                "critical_stiffness_explicit": steady_state.critical_stiffness_explicit(*parameters)
                * (1.0 + rise),
                "relative_critical_stiffness": closed / scene.critical_stiffness,
                "rise_by_dynamics": rise,
                **values,
            },
        )


def _threshold(scene: Scene, near: float, meter: Meter) -> float:
    """Stiffness at which perturbations of steady sliding neither grow nor decay."""
    load = scene.log_load_rate
    mu_ss = steady_state.steady_friction(load, scene.mu_star, scene.a, scene.b)
    friction = steady_state.steady_shear_stress(mu_ss, scene.mu_star, scene.cot_phi)
    psi = strength_of(scene)(friction)[0] - scene.a * load
    spring = friction + radiated(scene, load)
    with_mass = scene.inertia and scene.load_velocity * scene.inertial_time > _MASS_SHOWS
    around = near / scene.critical_stiffness

    def growth_at(ratio: float) -> float:
        changed = scene.with_(stiffness_ratio=ratio)
        if with_mass:
            meter.charge("inertial", 6)
            return growth_with_mass(changed, spring)
        meter.charge("quasi_static", 4)
        return growth(changed, spring, psi)

    found = float(brentq(growth_at, 0.5 * around, 2.0 * around, xtol=1e-15, rtol=1e-14))
    return found * scene.critical_stiffness


def growth(scene: Scene, spring: float, psi: float) -> float:
    """Twice the growth rate of small oscillations about a steady state: the trace of the Jacobian.

    Its determinant is positive for every stiffness, so the trace alone decides.
    """
    assemble = slow_manifold if scene.inertia else without_mass
    jacobian = _jacobian(assemble(scene, clock=False), (spring, psi))
    return math.fsum(jacobian[i][i] for i in range(2))


def growth_with_mass(scene: Scene, spring: float) -> float:
    """What has the sign of the growth of small oscillations by the full equations: with the
    characteristic polynomial p**3 + c2 p**2 + c1 p + c0, it is c0 - c1 c2 (Routh).
    """
    state = (spring, scene.log_load_rate, spring)
    j = np.array(_jacobian(inertial(scene), state))
    c2 = -float(np.trace(j))
    c1 = 0.5 * (float(np.trace(j)) ** 2 - float(np.trace(j @ j)))
    c0 = -float(np.linalg.det(j))
    return c0 - c1 * c2


def _jacobian(equations: Equations, state: tuple[float, ...]) -> list[list[float]]:
    """Derivatives of the rates (rows) by the unknowns (columns), by central differences."""
    columns = []
    for number, scale in enumerate(equations.scales):
        step = _DIFFERENCE * scale
        ahead, behind = (
            equations.rate(0.0, [x + sign * step * (i == number) for i, x in enumerate(state)])
            for sign in (1.0, -1.0)
        )
        columns.append([(u - v) / (2.0 * step) for u, v in zip(ahead, behind, strict=True)])
    return [list(row) for row in zip(*columns, strict=True)]
