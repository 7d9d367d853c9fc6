r"""Normal stress that varies with shear stress.

A driving stress inclined to the fault couples normal stress to shear stress. If the loading imposes
a change in normal stress, this is a change in :math:`\sigma_3`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.normal_stress._effect_on_state import NormalStressWithStateEffect
from rsfstudy.slider.parameter_layout import (
    IMPOSED_NORMAL_STRESS,
    LARGEST_NORMAL_STRESS_EXCESS,
    NORMAL_STRESS,
    SMALLEST_NORMAL_STRESS_EXCESS,
)
from rsfstudy.slider.parts import POSITIVE, FloatTuple, number
from rsfstudy.slider.scene_view import SceneView


def compute_normal_stress_minus_reference(
    frictional_stress: float, p: FloatTuple
) -> tuple[float, float]:
    r"""Compute the normal stress under an inclined driving stress.

    See ``NormalStress`` for the arguments. The function reads :math:`\cot\phi` from
    ``p[NORMAL_STRESS + 1]``.

    Notes
    -----
    If the loading changes :math:`\sigma_3` by :math:`e \sigma_*`, the relation :math:`\sigma =
    \sigma_3 + \tau_f \cot\phi` gives

    .. math::

        \frac{\sigma}{\sigma_*} = 1 + e + \cot\phi \, \frac{\tau_f - \tau_*}{\sigma_*}.

    Here :math:`\tau_f` is the frictional stress, which is the shear stress on the fault. It differs
    from the spring stress if the slider has inertia or radiation damping. The stress
    :math:`\tau_* = \mu_* \sigma_*` is its value in steady sliding at :math:`V_*`.

    The change in :math:`\sigma_3` does not affect shear stress.
    """
    cot_phi = p[NORMAL_STRESS + 1]
    excess = cot_phi * frictional_stress + p[IMPOSED_NORMAL_STRESS]
    if not SMALLEST_NORMAL_STRESS_EXCESS <= excess <= LARGEST_NORMAL_STRESS_EXCESS:
        excess = min(max(excess, SMALLEST_NORMAL_STRESS_EXCESS), LARGEST_NORMAL_STRESS_EXCESS)
    return excess, cot_phi


@dataclass(frozen=True, kw_only=True)
class VariableNormalStress(NormalStressWithStateEffect):
    r"""Normal stress coupled to the frictional stress by an inclined driving stress.

    Parameters
    ----------
    alpha : float, default: 0.56
        Coefficient :math:`\alpha` of the effect of normal stress on the state variable.
    phi : float, default: 60.0
        Angle :math:`\phi` between the driving stress and the fault normal, in degrees.

    Notes
    -----
    The normal stress, and the change in the state variable that is added to the evolution law, are

    .. math::

        \sigma = \sigma_3 + \tau_f \cot\phi, \quad d\Theta = -\alpha \frac{d\sigma}{\sigma},

    where :math:`\tau_f` is the frictional stress, which differs from the spring stress if the
    slider has inertia or radiation damping.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940; eq. 5 of
    doi:10.1007/s11589-014-0098-4.
    """

    phi: float = number(
        60.0,
        r"$\phi$",
        "degree",
        "angle between the driving stress and the fault normal",
        rule=POSITIVE,
    )

    name = "variable"
    normal_stress = staticmethod(compute_normal_stress_minus_reference)

    @property
    def cot_phi(self) -> float:
        """Derivative of normal stress with respect to shear stress."""
        return 1.0 / math.tan(math.radians(self.phi))

    @property
    def coupling(self) -> tuple[float, float]:
        r"""Coupling coefficients of normal stress.

        The coefficients are :math:`\cot\phi` and :math:`\alpha`.
        """
        return self.cot_phi, self.alpha

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ("inclined_driving", *super().effects)

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the coefficient alpha and the cotangent of phi.

        See ``Part.parameter_values``.
        """
        return self.alpha, self.cot_phi

    def compute_frictional_stress_lower_bound(self, scene: SceneView) -> float:
        """Compute the frictional stress at which normal stress vanishes.

        See ``NormalStress.compute_frictional_stress_lower_bound``.
        """
        return -(1.0 + scene.imposed_normal_stress) / self.cot_phi

    def check(self, scene: SceneView) -> None:
        r"""Check the angle of the driving stress.

        See ``Part.check``. The angle must be greater than :math:`\arctan\mu_*`, because
        :math:`\sigma_3` must be positive, and less than 90 degrees.
        """
        if self.phi >= 90.0:
            remedy = "For constant normal stress (90 degrees), set normal_stress='constant'."
            raise self.build_field_error("phi", "must be less than 90 degrees", remedy)
        lowest = math.degrees(math.atan(scene.mu_star))
        if self.phi <= lowest:
            rule = (
                f"must exceed atan(mu_star) = {lowest:.6g} degrees, because the principal "
                "stress sigma_3 would otherwise be negative"
            )
            raise self.build_field_error("phi", rule, "Increase phi, or decrease mu_star.")
