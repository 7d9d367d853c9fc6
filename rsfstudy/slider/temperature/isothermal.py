"""Constant temperature of the fault."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.temperature import Temperature


@dataclass(frozen=True, kw_only=True)
class Isothermal(Temperature):
    """Temperature model in which the fault always has the temperature of steady sliding at V_*."""

    name = "isothermal"
    rejection_condition_and_remedy = "at constant temperature", "set temperature='shear_heating'"
