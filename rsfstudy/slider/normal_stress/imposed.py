"""Imposed normal stress: constant but where the loading changes it, as on a rig with a normal load
of its own; a rise of it lowers the state variable.
"""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.normal_stress._state_effect import NormalStressWithStateEffect
from rsfstudy.slider.parameter_layout import IMPOSED_NORMAL_STRESS
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene_view import SceneView


def normal_stress(friction: float, p: Numbers) -> tuple[float, float]:
    """Normal stress over its reference value less 1: what the loading has made of it, whatever
    shear stress does.
    """
    return p[IMPOSED_NORMAL_STRESS], 0.0


@dataclass(frozen=True, kw_only=True)
class ImposedNormalStress(NormalStressWithStateEffect):
    """Normal stress that the loading imposes, with an effect `alpha` of it on the state.

    ``sigma = sigma_* + Delta_sigma(t)`` and ``dTheta = -alpha dsigma/sigma`` beside the evolution
    law.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940.
    """

    name = "imposed"
    rejection_hint = (
        "while normal stress does not follow shear stress",
        "set normal_stress='variable'",
    )
    normal_stress = staticmethod(normal_stress)
    depends_on_shear_stress = False

    @property
    def coupling(self) -> tuple[float, float]:
        return 0.0, self.alpha

    def numbers(self, scene: SceneView) -> Numbers:
        """alpha."""
        return (self.alpha,)
