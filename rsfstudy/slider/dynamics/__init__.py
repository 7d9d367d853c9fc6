"""Dynamics: the forces that balance the spring besides friction, one file a case.

A case states how slip rate follows from spring stress and state, by functions that take the
friction of a scene (see `friction.FrictionFunctions`) and return functions of floats:

- ``slip_rate(friction) -> (balance, growth)``, where ``balance(spring, psis, p)`` gives ln(V/V_*),
  frictional stress g and the state lost to stress, and ``growth(state, rates, x, g, p)`` the
  derivative of x = ln(V/V_*) along the motion, where the state (spring, *psis) changes by `rates`;
- ``rupture_rate(friction) -> rate``, where ``rate(state, p)`` gives the derivatives of the unknowns
  f, x, g and the states but the first by the full equations, in inertial time, where the others do
  not serve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rsfstudy._deprecation import renamed_members
from rsfstudy.slider.parts import Function, Part, discover_parts
from rsfstudy.slider.requirements import PART_QUANTITIES
from rsfstudy.slider.scene_view import SceneView


@renamed_members
@dataclass(frozen=True, kw_only=True)
class Dynamics(Part):
    """Base of the cases of dynamics."""

    #: Name of the form between ruptures, as it appears in results.
    regime: ClassVar[str]
    received_quantities = frozenset(PART_QUANTITIES)
    slip_rate: ClassVar[Function]
    rupture_rate: ClassVar[Function | None] = None
    #: Whether slip may reverse, in the regularised form of friction.
    allows_reversed_slip: ClassVar[bool] = False

    @classmethod
    def required_functions(cls) -> tuple[str, ...]:
        return ("slip_rate",)

    def radiated_stress(self, log_slip_rate: float) -> float:
        """Part of the spring stress that waves carry away at ln(V/V_*), over sigma_*."""
        return 0.0

    def radiated_stress_slope(self, log_slip_rate: float) -> float:
        """Derivative of the radiated stress with respect to ln V."""
        return 0.0

    def slip_rate_norm(self, scene: SceneView, log_slip_rate: float) -> float:
        """w = V T/(2 pi D_c) where mass acts, and 0 where there is none."""
        return 0.0


BUILT_IN_PARTS = discover_parts(__name__, __path__)
