"""Functions that check and convert rig quantities and derive scene fields from the quantities.

The function ``convert_rig_value_to_si`` converts quantities of a rig. This function calls
``units.convert_to_si``, and also converts stiffness in units of friction divided by displacement.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue, RsfStudyWarning
from rsfstudy.exception_conversion import find_stacklevel_of_user_code
from rsfstudy.rig.units import compute_conversion_factor, convert_to_si, multiply_by_exact_fraction
from rsfstudy.slider import SceneFields


class RigQuantity(NamedTuple):
    """Properties of a quantity of a rig.

    Parameters
    ----------
    si_units : str
        SI units.
    min_usual_value, max_usual_value : float
        Range of common values in SI units. Values outside this range cause a warning.
    symbol : str
        Symbol in LaTeX.
    description : str
        Description of the quantity.
    """

    si_units: str
    min_usual_value: float
    max_usual_value: float
    symbol: str
    description: str


RIG_QUANTITIES: Mapping[str, RigQuantity] = {
    "normal_stress": RigQuantity("Pa", 1e2, 1e10, r"$\sigma_*$", "normal stress"),
    "slip_distance": RigQuantity("m", 1e-9, 1e-1, "$D_c$", "slip distance"),
    "reference_velocity": RigQuantity(
        "m/s", 1e-13, 1e1, "$V_*$", "velocity of the load point before the test"
    ),
    "stiffness": RigQuantity("Pa/m", 1e4, 1e15, "$k$", "stiffness of the machine with its sample"),
    "period": RigQuantity("s", 1e-6, 1e3, "$T$", "period of free oscillation"),
    "mass": RigQuantity("kg/m^2", 1e-2, 1e9, "$m$", "mass per unit fault area"),
    "shear_modulus": RigQuantity("Pa", 1e5, 1e12, "$G$", "shear modulus of the medium"),
    "density": RigQuantity("kg/m^3", 1e2, 2e4, r"$\rho$", "density of the medium"),
    "thermal_diffusivity": RigQuantity(
        "m^2/s", 1e-8, 1e-4, r"$\alpha_{th}$", "thermal diffusivity of the fault"
    ),
    "heat_capacity": RigQuantity(
        "J/m^3/K", 1e5, 1e7, r"$\rho c$", "volumetric heat capacity of the fault"
    ),
    "shear_zone_width": RigQuantity("m", 1e-7, 1e1, "$w$", "width of the shear zone"),
    "reference_temperature": RigQuantity(
        "K", 1e2, 2e3, "$T_*$", "temperature in steady sliding at the reference velocity"
    ),
    "heat_loss_width": RigQuantity(
        "m", 1e-7, 1e2, "$w_h$", "distance over which heat is conducted away"
    ),
    "direct_activation_energy": RigQuantity(
        "J/mol", 1e3, 1e6, "$Q_a$", "activation energy of the direct effect"
    ),
    "evolution_activation_energy": RigQuantity(
        "J/mol", 1e3, 1e6, "$Q_b$", "activation energy of the evolution effect"
    ),
    "pressurisation_factor": RigQuantity(
        "Pa/K",
        1e3,
        1e8,
        r"$\Lambda_p$",
        "change of undrained pore pressure per change of temperature",
    ),
}
#: Quantities that shear heating requires, and optional quantities for shear heating.
REQUIRED_SHEAR_HEATING_QUANTITIES = (
    "thermal_diffusivity", "heat_capacity", "shear_zone_width", "reference_temperature"
)  # fmt: skip
OPTIONAL_SHEAR_HEATING_QUANTITIES = (
    "heat_loss_width", "direct_activation_energy", "evolution_activation_energy",
    "pressurisation_factor",
)  # fmt: skip
#: Gas constant in J/(mol K).
GAS_CONSTANT = 8.31446261815324
#: Quantities that every rig needs, because they determine the scales of all other quantities.
REQUIRED_RIG_QUANTITIES = ("normal_stress", "slip_distance", "reference_velocity")
#: Axis names that differ from the names of rig quantities. Such an axis name is needed if a scene
#: field has the same name as the rig quantity.
AXIS_NAME_BY_RIG_QUANTITY = {"normal_stress": "sigma_star"}
#: Names of rig quantities, keyed by the names that axes use.
RIG_QUANTITY_BY_AXIS_NAME = {
    AXIS_NAME_BY_RIG_QUANTITY.get(name, name): name for name in RIG_QUANTITIES
}
#: SI units, keyed by the scales of scene fields. A scale is the dimensionless unit of a scene
#: field.
SI_UNIT_BY_DIMENSIONLESS_UNIT = {
    "sigma_*": "Pa", "D_c": "m", "V_*": "m/s", "D_c/V_*": "s", "sigma_*/D_c": "Pa/m",
    "V_*/D_c": "1/s", "s": "s", "s-1": "1/s",
}  # fmt: skip
#: Units in tables and figures, keyed by SI units.
DISPLAY_UNIT_BY_SI_UNIT = {"Pa": "MPa", "m": "um", "m/s": "um/s", "Pa/m": "MPa/um"}
#: Descriptions of scene fields by name.
SCENE_QUANTITY_BY_FIELD_NAME = {about.name: about for about in SceneFields.QUANTITIES}
#: Names of velocity ratios in scenes, keyed by the names of the corresponding velocities.
RATIO_FIELD_BY_DIMENSIONAL_NAME = {
    name.removesuffix("_ratio"): name
    for name, about in SCENE_QUANTITY_BY_FIELD_NAME.items()
    if about.scale == "V_*" and name.endswith("_ratio")
}


def convert_to_si_and_warn_if_unusual(
    quantity_name: str, value: Any, normal_stress: float | None = None
) -> float:
    """Convert a rig quantity to SI units, and warn about unusual values.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity.
    value : quantity
        Value of the quantity.
    normal_stress : float, optional
        Normal stress in Pa. The argument is required for a stiffness in units of friction divided
        by displacement.

    Returns
    -------
    float
        Value in SI units.

    Raises
    ------
    InvalidValue
        If the value is not a quantity, if its units are incompatible, or if the value is not
        positive.
    """
    units, least, most, *_words = RIG_QUANTITIES[quantity_name]
    found = convert_rig_value_to_si(quantity_name, value, units, normal_stress)
    if not found > 0.0:
        raise InvalidValue(
            quantity_name,
            value,
            "must be positive",
            remedy=f"Pass a positive value in {units}, or a positive value with units.",
        )
    if not least <= found <= most:
        text = (
            f"{quantity_name} is {found:g} {units}: this value is unusual for a rig. Check the "
            "units."
        )
        warnings.warn(text, RsfStudyWarning, stacklevel=find_stacklevel_of_user_code())
    return found


def convert_rig_value_to_si(
    quantity_name: str, value: Any, units: str, normal_stress: float | None
) -> float:
    """Convert a rig quantity to SI units.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity.
    value : quantity
        Value of the quantity.
    units : str
        SI units of the quantity.
    normal_stress : float or None
        Normal stress in Pa. A stiffness in units of friction divided by displacement is multiplied
        by the normal stress.

    Returns
    -------
    float
        Value in SI units.

    Raises
    ------
    InvalidValue
        If the value is not a quantity, or if its units are incompatible.
    """
    try:
        return convert_to_si(quantity_name, value, units)
    except InvalidValue:
        if (
            units == "Pa/m"
            and normal_stress is not None
            and is_stiffness_in_friction_per_length(value)
        ):
            return convert_to_si(quantity_name, value, "1/m") * normal_stress
        raise


def is_stiffness_in_friction_per_length(stiffness: Any) -> bool:
    """Return True if a stiffness has units of friction over displacement.

    Parameters
    ----------
    stiffness : quantity
        Stiffness whose units are checked.

    Returns
    -------
    bool
        True if the units are compatible with 1/m.
    """
    if not isinstance(stiffness, str) and not hasattr(stiffness, "magnitude"):
        return False
    try:
        convert_to_si("stiffness", stiffness, "1/m")
    except InvalidValue:
        return False
    return True


def check_rig_quantities_are_consistent(rig_values: Mapping[str, Any]) -> None:
    """Check that the quantities of a rig do not contradict each other.

    Parameters
    ----------
    rig_values : mapping of str to float
        Quantities of the rig in SI units.

    Raises
    ------
    InvalidValue
        If both mass and period are given, if a mass is given without a stiffness, if only one of
        shear modulus and density is given, or if a quantity that shear heating requires is missing.
    """
    if "mass" in rig_values and "period" in rig_values:
        rule = f"cannot be combined with period = {rig_values['period']:g} s"
        raise InvalidValue("mass", rig_values["mass"], rule, remedy="Omit one of the two.")
    if "mass" in rig_values and "stiffness" not in rig_values:
        remedy = "Pass stiffness= as well, or replace mass= by period=."
        raise InvalidValue(
            "mass",
            rig_values["mass"],
            "requires a stiffness, because the period of free oscillation depends on mass and "
            "stiffness",
            remedy=remedy,
        )
    if ("shear_modulus" in rig_values) != ("density" in rig_values):
        remedy = "Pass shear_modulus= and density= together, or omit both."
        raise InvalidValue(
            "density",
            rig_values.get("density"),
            "requires shear_modulus, because both determine radiation damping",
            remedy=remedy,
        )
    given = [
        n
        for n in (*REQUIRED_SHEAR_HEATING_QUANTITIES, *OPTIONAL_SHEAR_HEATING_QUANTITIES)
        if n in rig_values
    ]
    missing = [n for n in REQUIRED_SHEAR_HEATING_QUANTITIES if n not in rig_values]
    if given and missing:
        rule = (
            f"requires {', '.join(missing)}, because shear heating depends on all of "
            "these quantities"
        )
        remedy = "Pass these quantities as well, or omit all quantities of shear heating."
        raise InvalidValue(given[0], rig_values[given[0]], rule, remedy=remedy)


def convert_rig_to_display_units(
    rig: Mapping[str, float], excluded_axis_names: Collection[str] = ()
) -> dict[str, tuple[float, str]]:
    """Convert the quantities of a rig to display units.

    Parameters
    ----------
    rig : mapping of str to float
        Quantities of the rig in SI units.
    excluded_axis_names : collection of str, optional
        Axis names of quantities to omit, for example because an axis varies them.

    Returns
    -------
    dict of str to (float, str)
        Value and units of each quantity.
    """
    units = {
        n: RIG_QUANTITIES[n].si_units
        for n in rig
        if AXIS_NAME_BY_RIG_QUANTITY.get(n, n) not in excluded_axis_names
    }
    shown = {n: DISPLAY_UNIT_BY_SI_UNIT.get(si, si) for n, si in units.items()}
    return {
        n: (
            multiply_by_exact_fraction(rig[n], 1 / compute_conversion_factor(n, shown[n], si)),
            shown[n],
        )
        for n, si in units.items()
    }


def derive_scene_fields_from_rig(
    rig_values: Mapping[str, Any], *, with_shear_heating: bool = True
) -> dict[str, Any]:
    """Compute the scene fields that follow from the rig quantities.

    Parameters
    ----------
    rig_values : mapping of str to float or ndarray
        Quantities of the rig in SI units.
    with_shear_heating : bool, default: True
        If True, the result includes the fields of shear heating and thermal pressurisation.

    Returns
    -------
    dict of str to float or ndarray
        Values of fields such as ``stiffness``, ``reference_rate`` and ``radiation_damping``. If the
        rig quantities are arrays, the values are arrays.
    """
    found = {"reference_rate": rig_values["reference_velocity"] / rig_values["slip_distance"]}
    if "stiffness" in rig_values:
        found["stiffness"] = (
            rig_values["stiffness"] * rig_values["slip_distance"] / rig_values["normal_stress"]
        )
    if "mass" in rig_values:
        found["period"] = 2.0 * np.pi * np.sqrt(rig_values["mass"] / rig_values["stiffness"])
    if "period" in rig_values:
        found["period"] = rig_values["period"]
    if "density" in rig_values:
        impedance = 0.5 * np.sqrt(rig_values["shear_modulus"] * rig_values["density"])
        found["radiation_damping"] = (
            impedance * rig_values["reference_velocity"] / rig_values["normal_stress"]
        )
    choices: dict[str, Any] = {"inertia": True} if "period" in found else {}
    if with_shear_heating and "heat_capacity" in rig_values:
        found |= _derive_shear_heating_fields(rig_values)
        choices["temperature"] = "shear_heating"
        choices |= {"fluid": "thermal"} if "pressurisation" in found else {}
    plain = {name: v if isinstance(v, np.ndarray) else float(v) for name, v in found.items()}
    return plain | choices


def _derive_shear_heating_fields(rig: Mapping[str, Any]) -> dict[str, Any]:
    """Compute the scene fields that describe shear heating and thermal pressurisation."""
    temperature, stress = rig["reference_temperature"], rig["normal_stress"]
    per_slip = rig["heat_capacity"] * rig["shear_zone_width"] * temperature
    width = rig.get("heat_loss_width", rig["shear_zone_width"])
    rate = rig["reference_velocity"] / rig["slip_distance"]
    found = {
        "heating": stress * rig["slip_distance"] / per_slip,
        "cooling": rig["thermal_diffusivity"] / (width * width) / rate,
    }
    for name in ("direct_activation", "evolution_activation"):
        if f"{name}_energy" in rig:
            found[name] = rig[f"{name}_energy"] / (GAS_CONSTANT * temperature)
    if "pressurisation_factor" in rig:
        found["pressurisation"] = rig["pressurisation_factor"] * temperature / stress
    return found


def is_dimensionless_field_with_scale(field_name: str) -> bool:
    """Return True if a scene field is expressed in a dimensionless unit.

    Parameters
    ----------
    field_name : str
        Name of the field.

    Returns
    -------
    bool
        True for fields such as ``hold_time``. The result is False for ratios and for fields without
        a scale.
    """
    return (
        field_name in SCENE_QUANTITY_BY_FIELD_NAME
        and bool(SCENE_QUANTITY_BY_FIELD_NAME[field_name].scale)
        and not field_name.endswith("_ratio")
    )


def find_si_units_of_scene_field(field_name: str, value: Any) -> str | None:
    """Return the SI units for a value of a scene field.

    Parameters
    ----------
    field_name : str
        Name of the field.
    value : object
        Value of the field.

    Returns
    -------
    str or None
        SI units, or None if the value has no units, for example if a ratio is a plain number.
    """
    about = SCENE_QUANTITY_BY_FIELD_NAME.get(field_name)
    plain = isinstance(value, int | float | np.number)
    if about is None or isinstance(value, type) or (plain and field_name.endswith("_ratio")):
        return None
    if about.scale:
        return SI_UNIT_BY_DIMENSIONLESS_UNIT[about.scale]
    with_units = hasattr(value, "magnitude") or (isinstance(value, str) and about.units)
    return (
        (SI_UNIT_BY_DIMENSIONLESS_UNIT.get(about.units) or ("1" if about.units == "1" else None))
        if with_units
        else None
    )
