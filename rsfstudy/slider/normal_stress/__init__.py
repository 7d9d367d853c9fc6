"""Normal stress while shear stress changes, one file a case."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy._deprecation import renamed_members
from rsfstudy.slider.parts import Function, Part, discover_parts
from rsfstudy.slider.requirements import SHEAR_STRESS
from rsfstudy.slider.scene_view import SceneView


@renamed_members
@dataclass(frozen=True, kw_only=True)
class NormalStress(Part):
    """Base of the cases of normal stress.

    A case states ``normal_stress(friction, p) -> (excess, change)``: normal stress over its
    reference value less 1, and its derivative with respect to frictional stress over sigma_*. None
    where normal stress is constant.
    """

    derived_properties = ("depends_on_shear_stress", "coupling", "min_frictional_stress")
    defining_methods = frozenset({"normal_stress", "state_effect", "numbers"})
    received_quantities = frozenset({SHEAR_STRESS})
    normal_stress: ClassVar[Function | None] = None

    @property
    def state_effect(self) -> Function | None:
        """``state_effect(friction, ratio, change, p) -> (shift, slope)``: by how much normal stress
        lowers the state variable, and its derivative with respect to friction.
        """
        return None

    @property
    def depends_on_shear_stress(self) -> bool:
        """True if normal stress changes while slip goes on, and not by the loading alone."""
        return bool(self.effects)

    @property
    def coupling(self) -> tuple[float, float] | None:
        """d sigma/d tau, and the effect alpha of normal stress on the state, if that is all."""
        return None

    def min_frictional_stress(self, scene: SceneView) -> float:
        """Deviation of frictional stress, over sigma_*, at which normal stress vanishes."""
        return -math.inf


BUILT_IN_PARTS = discover_parts(__name__, __path__)
