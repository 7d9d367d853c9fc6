"""Names, meanings and help texts of the options that define a rig."""

from __future__ import annotations

#: Example values of the rig options. The help texts show these values.
EXAMPLE_VALUES_OF_RIG_OPTIONS = {
    "normal_stress": "5 MPa",
    "slip_distance": "10 um",
    "reference_velocity": "1 um/s",
    "stiffness": "0.1 MPa/um",
    "period": "10 ms",
    "mass": "1e4 kg/m^2",
    "shear_modulus": "30 GPa",
    "density": "2700 kg/m^3",
    "thermal_diffusivity": "1 mm^2/s",
    "heat_capacity": "2.4 MJ/m^3/K",
    "shear_zone_width": "0.1 mm",
    "reference_temperature": "295 K",
    "heat_loss_width": "0.7 mm",
    "direct_activation_energy": "89 kJ/mol",
    "evolution_activation_energy": "89 kJ/mol",
    "pressurisation_factor": "0.14 MPa/K",
    "load_velocity": "10 um/s",
}


#: Meanings of the rig options. The texts repeat the descriptions in ``Rig.QUANTITIES``. The class
#: is not imported, because the import would delay the start of every command.
MEANINGS_OF_RIG_OPTIONS = {
    "normal_stress": "normal stress",
    "slip_distance": "slip distance",
    "reference_velocity": "velocity of the load point before the test",
    "stiffness": "stiffness of the machine with its sample",
    "period": "period of free oscillation",
    "mass": "mass per unit fault area",
    "shear_modulus": "shear modulus of the medium",
    "density": "density of the medium",
    "thermal_diffusivity": "thermal diffusivity of the fault",
    "heat_capacity": "volumetric heat capacity of the fault",
    "shear_zone_width": "width of the shear zone",
    "reference_temperature": "temperature in steady sliding at the reference velocity",
    "heat_loss_width": "distance over which heat is conducted away",
    "direct_activation_energy": "activation energy of the direct effect",
    "evolution_activation_energy": "activation energy of the evolution effect",
    "pressurisation_factor": "change of undrained pore pressure per change of temperature",
    "load_velocity": "load point velocity",
}


def describe_rig_option(option_name: str) -> str:
    """Return the help text of a rig option.

    Parameters
    ----------
    option_name : str
        Name of the quantity of the rig.

    Returns
    -------
    str
        Help text with the meaning and an example value.
    """
    meaning, example = (
        MEANINGS_OF_RIG_OPTIONS[option_name],
        EXAMPLE_VALUES_OF_RIG_OPTIONS[option_name],
    )
    return f"Rig parameter: {meaning}. Numbers without units are in SI units. Example: '{example}'."
