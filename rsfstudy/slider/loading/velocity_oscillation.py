"""Oscillation of the load point velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.loading import _oscillation_base
from rsfstudy.slider.parts import NON_NEGATIVE, FloatTuple, number
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class VelocityOscillation(_oscillation_base.OscillationBase):
    r"""Oscillation of the load point velocity about a mean velocity.

    The other fields are described in ``OscillationBase``.

    Parameters
    ----------
    velocity_oscillation : float, optional
        Amplitude :math:`A_V` of the oscillation, relative to the mean velocity. By default there is
        no oscillation.

    Notes
    -----
    For times from :math:`t_b` to :math:`t_b + N_o T_o`, the load point velocity is

    .. math::

        V_{\mathrm{load}}(t) = V_0 \left\{1 + A_V \sin\left[\frac{2 \pi (t - t_b)}{T_o}
          + \phi_o\right]\right\}.

    The velocity is :math:`V_0` before and after the oscillation. The displacement of the load point
    relative to its mean motion is

    .. math::

        D = R \left\{\cos \phi_o - \cos[\omega (t - t_b) + \phi_o]\right\}, \quad
          R = \frac{A_V V_0}{\omega}, \quad \omega = \frac{2 \pi}{T_o}.

    The displacement :math:`D` imposes the shear stress :math:`K D`. The last unknown of the loading
    represents this shear stress (see the module ``friction``).
    """

    velocity_oscillation: float | None = number(
        None,
        "$A_V$",
        "1",
        "amplitude of an oscillation of load point velocity, divided by the mean velocity",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )

    name = "velocity_oscillation"
    field_name_that_selects_part = "velocity_oscillation"
    adds_load_point_displacement_unknown = True
    unknowns = (
        Quantity(
            "load_point_behind",
            "$y$",
            "1",
            "load point displacement with a delay of a quarter period",
            "sigma_*",
        ),
        Quantity("load_point_ahead", "$P$", "1", "stress due to the load point", "sigma_*"),
    )

    def check(self, scene: SceneView) -> None:
        """Check the amplitude and the mean velocity of the oscillation.

        See ``Part.check``. The load point may move backwards only if the law allows reversed slip.
        The mean velocity must not be zero.
        """
        if (self.velocity_oscillation or 0.0) > 1.0 and not scene.parts.law.regularised:
            rule = (
                "must be 1 or less, because at larger values the load point moves backwards, but "
                "friction is defined for forward slip only"
            )
            remedy = "Set regularised=True, which permits reversed slip."
            raise self.build_field_error("velocity_oscillation", rule, remedy)
        if self.load_velocity == 0.0:
            rule = "must be greater than 0, because velocity_oscillation is relative to it"
            raise self.build_field_error("load_velocity_ratio", rule)
        super().check(scene)

    def initial_unknowns(self, scene: SceneView) -> FloatTuple:
        r"""Return the values of the unknowns at the initial phase.

        See ``Loading.initial_unknowns``. The last unknown is :math:`-K R \cos(\omega t + \phi_o)`.
        """
        stress = self.compute_shear_stress_amplitude(scene)
        return -stress * math.sin(self.initial_phase_in_radians), -stress * math.cos(
            self.initial_phase_in_radians
        )

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the parameters of the oscillation.

        The parameters are the angular frequency, the stress amplitude and the initial value of the
        last unknown.

        See ``Part.parameter_values``.
        """
        return (
            self.angular_frequency,
            self.compute_shear_stress_amplitude(scene),
            self.initial_unknowns(scene)[1],
        )

    def compute_shear_stress_amplitude(self, scene: SceneView) -> float:
        r"""Compute the amplitude of the imposed shear stress.

        Parameters
        ----------
        scene : Scene
            Scene that the loading belongs to.

        Returns
        -------
        float
            Amplitude :math:`K R` in :math:`\sigma_*`.
        """
        amplitude = (self.velocity_oscillation or 0.0) * self.load_velocity
        return scene.stiffness * amplitude / self.angular_frequency
