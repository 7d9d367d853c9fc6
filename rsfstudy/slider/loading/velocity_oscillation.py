"""Oscillating load point velocity, for ever or for some cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.loading import _oscillation_base
from rsfstudy.slider.parts import NON_NEGATIVE, Numbers, number
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class VelocityOscillation(_oscillation_base.OscillationBase):
    """Oscillation of load point velocity about its mean V_0.

    ``V_load(t) = V_0 [1 + A_V sin(2 pi (t - t_b)/T_o + phi_o)]`` for t from t_b to t_b + N_o T_o,
    with amplitude A_V over the mean, period T_o, phase phi_o in degrees and N_o cycles, and V_0
    before and after. The load point is ahead of its mean motion by
    ``D = R [cos(phi_o) - cos(omega (t - t_b) + phi_o)]`` with ``R = A_V V_0/omega`` and
    ``omega = 2 pi/T_o``, and so imposes shear stress K D, which its last unknown follows (see
    `friction`).
    """

    velocity_oscillation: float | None = number(
        None,
        "$A_V$",
        "1",
        "amplitude of an oscillation of load point velocity, over its mean",
        rule=NON_NEGATIVE,
        omit_if_none=True,
    )

    name = "velocity_oscillation"
    selected_by = "velocity_oscillation"
    has_load_point_unknown = True
    unknowns = (
        Quantity("load_point_behind", "$y$", "1", "load point a quarter behind", "sigma_*"),
        Quantity("load_point_ahead", "$P$", "1", "stress by the load point", "sigma_*"),
    )

    def check(self, scene: SceneView) -> None:
        """A load point that moves, back only where slip may; see `Train`."""
        if (self.velocity_oscillation or 0.0) > 1.0 and not scene.parts.law.regularised:
            rule = "must be 1 or less: the load point moves back, and friction is of forward slip"
            remedy = "Set regularised=True, by which slip reverses with shear stress."
            raise self.field_error("velocity_oscillation", rule, remedy)
        if self.load_velocity == 0.0:
            rule = "must be greater than 0: velocity_oscillation is over it"
            raise self.field_error("load_velocity_ratio", rule)
        super().check(scene)

    def initial_unknowns(self, scene: SceneView) -> Numbers:
        """The pair whose last is ``-K R cos(omega t + phase)``."""
        stress = self.stress_amplitude(scene)
        return -stress * math.sin(self.initial_phase), -stress * math.cos(self.initial_phase)

    def numbers(self, scene: SceneView) -> Numbers:
        """omega D_c/V_*, K R, and what the last unknown begins with."""
        return self.angular_frequency, self.stress_amplitude(scene), self.initial_unknowns(scene)[1]

    def stress_amplitude(self, scene: SceneView) -> float:
        """K R."""
        amplitude = (self.velocity_oscillation or 0.0) * self.load_velocity
        return scene.stiffness * amplitude / self.angular_frequency
