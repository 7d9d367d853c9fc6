"""Oscillating normal stress: what the rig, a tide or a passing wave imposes, for ever or for some
cycles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.loading import _oscillation_base
from rsfstudy.slider.parts import NON_NEGATIVE, Numbers, number
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class NormalStressOscillation(_oscillation_base.OscillationBase):
    """Oscillation of imposed normal stress under a steady load point velocity V_0.

    ``sigma/sigma_* = 1 + A sin(2 pi (t - t_b)/T_o + phi_o)`` for t from t_b to t_b + N_o T_o, with
    amplitude A, period T_o, phase phi_o in degrees and N_o cycles; sigma = sigma_* before and
    after. The defaults are t_b = 0, phi_o = 0, no end and V_0 = V_*. Of a driving stress inclined
    to the fault it is sigma_3 that changes so.

    References
    ----------
    Boettcher and Marone (2004), J. Geophys. Res. 109, B03406.
    """

    oscillation_amplitude: float = number(
        0.0,
        r"$A$",
        "1",
        "amplitude of an oscillation of imposed normal stress",
        "sigma_*",
        rule=NON_NEGATIVE,
    )

    name = "oscillation"
    selected_by = "oscillation_amplitude"
    unknowns = (
        Quantity("oscillation_ahead", "$y$", "1", "oscillation a quarter ahead", "sigma_*"),
        Quantity("oscillation_relief", "$P$", "1", "imposed fall of normal stress", "sigma_*"),
    )

    def check(self, scene: SceneView) -> None:
        """Normal stress that stays positive; see `Train`."""
        if self.oscillation_amplitude >= 1.0:
            remedy = "Normal stress stays positive: it oscillates by less than all of it."
            raise self.field_error("oscillation_amplitude", "must be less than 1", remedy)
        super().check(scene)

    def initial_unknowns(self, scene: SceneView) -> Numbers:
        """y and P of its phase."""
        amplitude, angle = self.oscillation_amplitude, self.initial_phase
        return amplitude * math.cos(angle), -amplitude * math.sin(angle)

    def numbers(self, scene: SceneView) -> Numbers:
        """omega D_c/V_*, and A."""
        return self.angular_frequency, self.oscillation_amplitude
