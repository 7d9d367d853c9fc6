"""Normal stress while shear stress changes, one file a case."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy.slider.parts import Function, Part, Scene, found_in
from rsfstudy.slider.requirements import SHEAR_STRESS


@dataclass(frozen=True, kw_only=True)
class NormalStress(Part):
    """Base of the cases of normal stress.

    A case states ``normal_stress(friction, p) -> (excess, change)``: normal stress over its
    reference value less 1, and its derivative with respect to frictional stress over sigma_*. None
    where normal stress is constant.
    """

    conclusions = ("follows_friction", "coupling", "weakest")
    equations = frozenset({"normal_stress", "state_effect", "numbers"})
    receives = frozenset({SHEAR_STRESS})
    normal_stress: ClassVar[Function | None] = None

    @property
    def state_effect(self) -> Function | None:
        """``state_effect(friction, ratio, change, p) -> (shift, slope)``: by how much normal stress
        lowers the state variable, and its derivative with respect to friction.
        """
        return None

    @property
    def follows_friction(self) -> bool:
        """True if normal stress changes while slip goes on, and not by the loading alone."""
        return bool(self.effects)

    @property
    def coupling(self) -> tuple[float, float] | None:
        """d sigma/d tau, and the effect alpha of normal stress on the state, if that is all."""
        return None

    def weakest(self, scene: Scene) -> float:
        """Deviation of frictional stress, over sigma_*, at which normal stress vanishes."""
        return -math.inf


PARTS = found_in(__name__, __path__)
