"""Constant normal stress."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.normal_stress import NormalStress
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class ConstantNormalStress(NormalStress):
    r"""Constant normal stress.

    Notes
    -----
    The normal stress is

    .. math::

        \sigma = \sigma_*.
    """

    name = "constant"
    rejection_condition_and_remedy = (
        "when normal stress is constant",
        "set normal_stress='variable'",
    )
    coupling = (0.0, 0.0)

    def check(self, scene: SceneView) -> None:
        """Check that the loading does not change normal stress.

        See ``Part.check``.
        """
        if scene.changes_normal_stress:
            remedy = (
                "Set normal_stress='imposed'. If normal stress also depends on shear stress, "
                "set normal_stress='variable'."
            )
            rule = "cannot be combined with a loading or noise that changes normal stress"
            raise InvalidValue("normal_stress", self.name, rule, remedy=remedy)
