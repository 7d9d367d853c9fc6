"""A drained fault: pore pressure never changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.fluid import Fluid


@dataclass(frozen=True, kw_only=True)
class Drained(Fluid):
    """Constant pore pressure: nothing to add to the friction relation."""

    name = "drained"

    @classmethod
    def refuse(cls, name: str, value: Any) -> InvalidValue:
        return InvalidValue(
            name,
            value,
            "has no meaning while the fault is drained",
            remedy=f"Leave {name} out, or set fluid='dilatant'.",
        )
