"""Normal stress imposed by the loading, independent of shear stress.

An example is a testing machine that applies normal load and shear load separately.
"""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.normal_stress._effect_on_state import NormalStressWithStateEffect
from rsfstudy.slider.parameter_layout import IMPOSED_NORMAL_STRESS
from rsfstudy.slider.parts import FloatTuple
from rsfstudy.slider.scene_view import SceneView


def compute_normal_stress_minus_reference(
    frictional_stress: float, p: FloatTuple
) -> tuple[float, float]:
    r"""Compute the imposed normal stress.

    See ``NormalStress`` for the arguments. The function reads the imposed change in normal stress
    from ``p[IMPOSED_NORMAL_STRESS]``.
    """
    return p[IMPOSED_NORMAL_STRESS], 0.0


@dataclass(frozen=True, kw_only=True)
class ImposedNormalStress(NormalStressWithStateEffect):
    r"""Imposed normal stress that also affects the state variable.

    The field ``alpha`` is described in ``NormalStressWithStateEffect``.

    Notes
    -----
    The normal stress, and the change in the state variable that is added to the evolution law, are

    .. math::

        \sigma = \sigma_* + \Delta\sigma(t), \quad d\Theta = -\alpha \frac{d\sigma}{\sigma}.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940.
    """

    name = "imposed"
    rejection_condition_and_remedy = (
        "when normal stress does not depend on shear stress",
        "set normal_stress='variable'",
    )
    normal_stress = staticmethod(compute_normal_stress_minus_reference)
    depends_on_shear_stress = False

    @property
    def coupling(self) -> tuple[float, float]:
        r"""Coupling coefficients of normal stress.

        The first coefficient is zero, because normal stress does not depend on shear stress. The
        second coefficient is :math:`\alpha`.
        """
        return 0.0, self.alpha

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the coefficient alpha of the effect of normal stress on the state.

        See ``Part.parameter_values``.
        """
        return (self.alpha,)
