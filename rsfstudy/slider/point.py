"""A point of a motion."""

from __future__ import annotations

from typing import NamedTuple


class Point(NamedTuple):
    """The motion at one instant, whatever the unknowns it was computed with.

    Attributes
    ----------
    log_slip_rate : float
        ln(V/V_*).
    growth : float
        Its derivative with respect to the clock of the equations, length along the path.
    spring_stress, friction : float
        Deviations f and g of spring stress and of frictional stress from tau_*, over sigma_*.
    psi : float
        The sum of the states of the law, freed of stress.
    state : float
        State variable Theta (the sum, where a law has several).
    imbalance : float
        Its distance from steady sliding at this slip rate, Theta + b ln(V/V_*) for most laws.
    distance_from_steady_state : float
        The largest such distance of a state, without sign. States that a part lists in
        `excluded_from_distance` are left out.
    coefficient : float
        Friction coefficient.
    normal_stress : float
        Effective normal stress over sigma_*.
    reading : float
        Friction coefficient as a rig reads it: spring stress over normal stress less the pore
        pressure outside the fault.
    reading_growth : float
        Its derivative with respect to the clock of the equations.
    psis : tuple of float
        States freed of stress, and those of a fluid.
    """

    log_slip_rate: float
    growth: float
    spring_stress: float
    friction: float
    psi: float
    state: float
    imbalance: float
    distance_from_steady_state: float
    coefficient: float
    normal_stress: float
    reading: float
    reading_growth: float
    psis: tuple[float, ...]
