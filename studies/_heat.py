"""Scenes, references and claims that all studies of frictional heat use."""

from collections.abc import Callable, Sequence
from typing import Any

from rsfstudy import Claim, Scene

RICE = "Rice (2006)"
#: References of the studies, by effect.
FLASH_REFERENCES = [
    f"{RICE}, J. Geophys. Res. 111, B05311",
    "Noda, Dunham and Rice (2009), J. Geophys. Res. 114, B07302",
]
HEATING_REFERENCES = [
    "Chester (1994), J. Geophys. Res. 99, 7247-7261",
    "Blanpied, Tullis and Weeks (1998), J. Geophys. Res. 103, 489-511",
]
PRESSURE_REFERENCES = [
    f"{RICE}, J. Geophys. Res. 111, B05311",
    "Segall and Rice (2006), J. Geophys. Res. 111, B09316",
]
#: Source of expected values that were computed independently, with different equations and a
#: different integrator.
INDEPENDENT = "independent integration, or closed form, in other variables"

#: Fault with flash heating, with the parameters of the benchmark problem SCEC TPV104.
FLASH_FAULT = Scene(
    law="flash_heating",
    normal_stress="constant",
    a=0.01,
    b_over_a=1.4,
    mu_star=0.6,
    weakening_velocity_ratio=1e5,
    weakened_friction=0.2,
)
#: Fault with b - a = 0.005 that is heated by slip.
HEATED_FAULT = Scene(
    normal_stress="constant",
    a=0.01,
    b_over_a=1.5,
    mu_star=0.6,
    stiffness=0.0025,
    temperature="shear_heating",
    heating=0.001,
    cooling=0.1,
)
#: Fault with thermal pressurisation. E is the undrained increase of pore pressure due to a slip of
#: D_c at a friction coefficient of 1. The pressurisation factor is 1, so E is equal to the field
#: ``heating``.
PRESSURISED_FAULT = HEATED_FAULT.with_(
    fluid="thermal", pressurisation=1.0, drainage=0.05, heating=0.01, cooling=0.01
)


def known_value_claim(
    claim_id: str,
    statement: str,
    variable: str,
    where: dict[str, Any],
    published: float,
    relative_tolerance: float,
) -> Claim:
    """Return a claim that compares a result with a reference value.

    Parameters
    ----------
    claim_id : str
        Identifier of the claim.
    statement : str
        Statement of the claim.
    variable : str
        Name of the variable.
    where : dict
        Coordinates of the cell in the lattice.
    published : float
        Expected value.
    relative_tolerance : float
        Tolerance relative to the expected value.

    Returns
    -------
    Claim
        Claim about the variable.
    """
    return Claim(
        id=claim_id,
        statement=statement,
        source=INDEPENDENT,
        variable=variable,
        where=where,
        published=published,
        tolerance=relative_tolerance * abs(published),
        reason="the accuracy of the study, or the printed digits of the value",
    )


def closest_to(target: float) -> Callable[[Sequence[float]], float]:
    """Return a function that selects the axis value closest to a target.

    Parameters
    ----------
    target : float
        Value to compare with.

    Returns
    -------
    callable
        Function that takes the axis values, and returns the axis value closest to the target.
    """
    return lambda values: min(values, key=lambda value: abs(value - target))
