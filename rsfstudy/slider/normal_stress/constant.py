"""Constant normal stress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.normal_stress import NormalStress


@dataclass(frozen=True, kw_only=True)
class Constant(NormalStress):
    """Constant normal stress: nothing to add to the friction relation."""

    name = "constant"
    coupling = (0.0, 0.0)

    @classmethod
    def refuse(cls, name: str, value: Any) -> InvalidValue:
        return InvalidValue(
            name,
            value,
            "has no meaning while normal stress is constant",
            remedy=f"Leave {name} out, or set normal_stress='variable'.",
        )
