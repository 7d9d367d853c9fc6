"""The quantities of a rig, and the fields of a scene that are measured in units of them."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np

from rsfstudy.error_boundary import user_stacklevel
from rsfstudy.errors import InvalidValue, RsfStudyWarning
from rsfstudy.rig.units import convert_to_si, multiply_exactly, unit_factor
from rsfstudy.slider import FIELD_QUANTITIES


class RigQuantity(NamedTuple):
    """What a rig may state: SI units, the range that is usual, beyond which it warns, a
    symbol, and what it is.
    """

    units: str
    min_usual: float
    max_usual: float
    symbol: str
    meaning: str


RIG_QUANTITIES: Mapping[str, RigQuantity] = {
    "normal_stress": RigQuantity("Pa", 1e2, 1e10, r"$\sigma_*$", "normal stress"),
    "slip_distance": RigQuantity("m", 1e-9, 1e-1, "$D_c$", "slip distance"),
    "reference_velocity": RigQuantity(
        "m/s", 1e-13, 1e1, "$V_*$", "velocity of the load point before the test"
    ),
    "stiffness": RigQuantity("Pa/m", 1e4, 1e15, "$k$", "stiffness of the machine with its sample"),
    "period": RigQuantity("s", 1e-6, 1e3, "$T$", "period of free oscillation"),
    "mass": RigQuantity("kg/m^2", 1e-2, 1e9, "$m$", "mass over the area of the fault"),
    "shear_modulus": RigQuantity("Pa", 1e5, 1e12, "$G$", "shear modulus of the medium"),
    "density": RigQuantity("kg/m^3", 1e2, 2e4, r"$\rho$", "density of the medium"),
}
#: What it must state: the scales of all else.
REQUIRED_QUANTITIES = ("normal_stress", "slip_distance", "reference_velocity")
#: What axes call those that are fields of scenes in another sense.
AXIS_NAME = {"normal_stress": "sigma_star"}
#: Quantities by the names that they have on axes.
RIG_NAME = {AXIS_NAME.get(name, name): name for name in RIG_QUANTITIES}
#: SI units of fields of a scene, by what they are measured in or their own units.
SI_UNITS = {
    "sigma_*": "Pa", "D_c": "m", "V_*": "m/s", "D_c/V_*": "s", "sigma_*/D_c": "Pa/m",
    "V_*/D_c": "1/s", "s": "s", "s-1": "1/s",
}  # fmt: skip
#: Units in which what a rig states is shown, by its SI units.
DISPLAY_UNITS = {"Pa": "MPa", "m": "um", "m/s": "um/s", "Pa/m": "MPa/um"}
#: What fields of scenes are.
SCENE_QUANTITIES = {about.name: about for about in FIELD_QUANTITIES}
#: Slip rates of a scene, by the names that they have where they are no ratios.
RATIO_FIELD = {
    name.removesuffix("_ratio"): name
    for name, about in SCENE_QUANTITIES.items()
    if about.scale == "V_*" and name.endswith("_ratio")
}


def to_si_checked(name: str, value: Any, stress: float | None = None) -> float:
    """A quantity of a rig in SI units; warns of what is unusual.

    Raises
    ------
    InvalidValue
        For what is no quantity, of another kind, or not positive.
    """
    units, least, most, *_words = RIG_QUANTITIES[name]
    found = convert_rig_value(name, value, units, stress)
    if not found > 0.0:
        raise InvalidValue(name, value, "must be positive", remedy=f"Give it in {units}.")
    if not least <= found <= most:
        text = f"{name} is {found:g} {units}: unusual for a rig. Is the unit right?"
        warnings.warn(text, RsfStudyWarning, stacklevel=user_stacklevel())
    return found


def convert_rig_value(name: str, value: Any, units: str, stress: float | None) -> float:
    """A quantity in SI units; a stiffness may be of friction, over the normal stress in Pa."""
    try:
        return convert_to_si(name, value, units)
    except InvalidValue:
        if units == "Pa/m" and stress is not None and is_friction_stiffness(value):
            return convert_to_si(name, value, "1/m") * stress
        raise


def is_friction_stiffness(stiffness: Any) -> bool:
    """True if a stiffness is friction over displacement, in 1/length."""
    if not isinstance(stiffness, str) and not hasattr(stiffness, "magnitude"):
        return False
    try:
        convert_to_si("stiffness", stiffness, "1/m")
    except InvalidValue:
        return False
    return True


def check_consistency(rig: Mapping[str, Any]) -> None:
    """Refuse quantities that do not go with one another.

    Raises
    ------
    InvalidValue
        For mass beside period, mass without stiffness, and one of shear modulus and density.
    """
    if "mass" in rig and "period" in rig:
        rule = f"give mass or period (here {rig['period']:g} s), not both"
        raise InvalidValue("mass", rig["mass"], rule)
    if "mass" in rig and "stiffness" not in rig:
        remedy = "State the stiffness too, or the period."
        raise InvalidValue("mass", rig["mass"], "needs a stiffness to oscillate", remedy=remedy)
    if ("shear_modulus" in rig) != ("density" in rig):
        remedy = "State shear_modulus and density, or neither."
        raise InvalidValue("density", rig.get("density"), "goes with shear_modulus", remedy=remedy)


def in_display_units(
    rig: Mapping[str, float], without: Collection[str] = ()
) -> dict[str, tuple[float, str]]:
    """Numbers and units in which what a rig states is shown, but for what these axes vary."""
    units = {n: RIG_QUANTITIES[n].units for n in rig if AXIS_NAME.get(n, n) not in without}
    shown = {n: DISPLAY_UNITS.get(si, si) for n, si in units.items()}
    return {
        n: (multiply_exactly(rig[n], 1 / unit_factor(n, shown[n], si)), shown[n])
        for n, si in units.items()
    }


def derive_scene_fields(rig: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a scene that a rig decides; arrays where its quantities are."""
    found = {"reference_rate": rig["reference_velocity"] / rig["slip_distance"]}
    if "stiffness" in rig:
        found["stiffness"] = rig["stiffness"] * rig["slip_distance"] / rig["normal_stress"]
    if "mass" in rig:
        found["period"] = 2.0 * np.pi * np.sqrt(rig["mass"] / rig["stiffness"])
    if "period" in rig:
        found["period"] = rig["period"]
    if "density" in rig:
        impedance = 0.5 * np.sqrt(rig["shear_modulus"] * rig["density"])
        found["radiation_damping"] = impedance * rig["reference_velocity"] / rig["normal_stress"]
    plain = {name: v if isinstance(v, np.ndarray) else float(v) for name, v in found.items()}
    return plain | ({"inertia": True} if "period" in found else {})


def is_scaled_field(name: str) -> bool:
    """True of a field of a scene that is measured in a unit of the slider, and no ratio."""
    return (
        name in SCENE_QUANTITIES
        and bool(SCENE_QUANTITIES[name].scale)
        and not name.endswith("_ratio")
    )


def field_si_units(name: str, value: Any) -> str | None:
    """SI units of a value of a field of a scene; None where it is none in units: a ratio that is a
    plain number, or a field of another kind.
    """
    about = SCENE_QUANTITIES.get(name)
    plain = isinstance(value, int | float | np.number)
    if about is None or isinstance(value, type) or (plain and name.endswith("_ratio")):
        return None
    if about.scale:
        return SI_UNITS[about.scale]
    with_units = hasattr(value, "magnitude") or (isinstance(value, str) and about.units)
    return (
        (SI_UNITS.get(about.units) or ("1" if about.units == "1" else None)) if with_units else None
    )
