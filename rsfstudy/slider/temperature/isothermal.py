"""Constant temperature of the fault."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.temperature import Temperature


@dataclass(frozen=True, kw_only=True)
class Isothermal(Temperature):
    """Constant temperature, as in steady sliding at the reference velocity."""

    name = "isothermal"
    rejection_condition_and_remedy = "at constant temperature", "set temperature='shear_heating'"
