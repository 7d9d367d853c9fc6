"""Oscillation of imposed normal stress.

Examples of normal stress oscillations are tides, passing seismic waves and modulation by a testing
machine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.loading import _oscillation_base
from rsfstudy.slider.parts import NON_NEGATIVE, FloatTuple, number
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class NormalStressOscillation(_oscillation_base.OscillationBase):
    r"""Oscillation of imposed normal stress while the load point velocity is constant.

    If the driving stress is inclined to the fault, the oscillation changes the stress
    :math:`\sigma_3`. The other fields are described in ``OscillationBase``.

    Parameters
    ----------
    oscillation_amplitude : float, default: 0.0
        Amplitude :math:`A` in :math:`\sigma_*`.

    Notes
    -----
    For times from :math:`t_b` to :math:`t_b + N_o T_o`, the imposed normal stress is

    .. math::

        \frac{\sigma}{\sigma_*} = 1 + A \sin\left[\frac{2 \pi (t - t_b)}{T_o} + \phi_o\right].

    Before and after the oscillation, the imposed normal stress is :math:`\sigma_*`. By default, the
    oscillation begins immediately with zero phase and has no end. The default load point velocity
    is :math:`V_*`.

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
    field_name_that_selects_part = "oscillation_amplitude"
    unknowns = (
        Quantity(
            "oscillation_ahead",
            "$y$",
            "1",
            "oscillation with a phase shift of a quarter period",
            "sigma_*",
        ),
        Quantity("oscillation_relief", "$P$", "1", "imposed decrease of normal stress", "sigma_*"),
    )

    def check(self, scene: SceneView) -> None:
        """Check that normal stress remains positive.

        See ``Part.check``.
        """
        if self.oscillation_amplitude >= 1.0:
            remedy = "The normal stress must stay positive during the oscillation."
            raise self.build_field_error("oscillation_amplitude", "must be less than 1", remedy)
        super().check(scene)

    def initial_unknowns(self, scene: SceneView) -> FloatTuple:
        """Return the values of the unknowns y and P at the initial phase.

        See ``Loading.initial_unknowns``.
        """
        amplitude, angle = self.oscillation_amplitude, self.initial_phase_in_radians
        return amplitude * math.cos(angle), -amplitude * math.sin(angle)

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the angular frequency and the amplitude.

        See ``Part.parameter_values``.
        """
        return self.angular_frequency, self.oscillation_amplitude
