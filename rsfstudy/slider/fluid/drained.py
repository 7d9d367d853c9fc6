"""A drained fault: pore pressure never changes."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.fluid import Fluid


@dataclass(frozen=True, kw_only=True)
class DrainedFluid(Fluid):
    """Constant pore pressure, ``dp/dt = 0``: nothing to add to the friction relation."""

    name = "drained"
    rejection_hint = "while the fault is drained", "set fluid='dilatant'"
