"""A point of a motion."""

from __future__ import annotations

from typing import NamedTuple

from rsfstudy._deprecation import renamed_members


@renamed_members
class Point(NamedTuple):
    """The motion at one instant, whatever the unknowns it was computed with.

    Attributes
    ----------
    log_slip_rate : float
        ln(V/V_*).
    log_slip_rate_derivative : float
        Its derivative with respect to the clock of the equations, length along the path.
    spring_stress, frictional_stress : float
        Deviations f and g of spring stress and of frictional stress from tau_*, over sigma_*.
    psi : float
        The sum of the states of the law, freed of stress.
    state : float
        State variable Theta (the sum, where a law has several).
    steady_state_offset : float
        Its distance from steady sliding at this slip rate, Theta + b ln(V/V_*) for most laws.
    distance_from_steady_state : float
        The largest such distance of a state, without sign. States that a part lists in
        `excluded_from_distance` are left out.
    friction_coefficient : float
        Friction coefficient.
    normal_stress : float
        Effective normal stress over sigma_*.
    apparent_friction : float
        Friction coefficient as a rig reads it: spring stress over normal stress less the pore
        pressure outside the fault.
    apparent_friction_derivative : float
        Its derivative with respect to the clock of the equations.
    psis : tuple of float
        States freed of stress, and those of a fluid.
    """

    log_slip_rate: float
    log_slip_rate_derivative: float
    spring_stress: float
    frictional_stress: float
    psi: float
    state: float
    steady_state_offset: float
    distance_from_steady_state: float
    friction_coefficient: float
    normal_stress: float
    apparent_friction: float
    apparent_friction_derivative: float
    psis: tuple[float, ...]
