"""What balances the spring besides friction, one file a case.

A case states how slip rate follows from spring stress and state, as plain functions of floats that
`assembly` binds to the friction relation:

- ``balance(spring, psis, p) -> (log_rate, friction, shift)``: ln(V/V_*), the frictional stress, and
  the state lost to stress;
- ``growth(state, rates, x, friction, p)``: derivative of x = ln(V/V_*) along the motion, where the
  state (spring, *psis) changes by `rates`;
- ``rupture_rate(state, p)`` and ``rupture_point(state, rates, p)``: the full equations where the
  others do not serve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from rsfstudy.slider.parts import Function, Part, found_in

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Dynamics(Part):
    """Base of the cases of dynamics."""

    #: Name of the form between ruptures, as it appears in results.
    regime: ClassVar[str]
    balance: ClassVar[Function]
    growth: ClassVar[Function]
    rupture_rate: ClassVar[Function | None] = None
    #: Whether slip may reverse, in the regularised form of friction.
    reverses: ClassVar[bool] = False
    rupture_point: ClassVar[Function | None] = None

    @classmethod
    def functions(cls) -> tuple[str, ...]:
        return ("balance", "growth")

    def radiated(self, log_rate: float) -> float:
        """Part of the spring stress that waves carry away at ln(V/V_*), over sigma_*."""
        return 0.0

    def damping(self, log_rate: float) -> float:
        """Derivative of the radiated stress with respect to ln V."""
        return 0.0

    def norm(self, scene: Scene, log_rate: float) -> float:
        """w = V T/(2 pi D_c) where mass acts, and 0 where there is none."""
        return 0.0


PARTS = found_in(__name__, __path__)
