"""State of a motion at a point in time."""

from __future__ import annotations

from typing import NamedTuple

from rsfstudy._deprecation import add_former_member_names


@add_former_member_names
class MotionPoint(NamedTuple):
    r"""Stress, slip rate and states of a motion at a point in time.

    The attributes are the same for all equations of motion, although the equations have different
    unknowns.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    log_slip_rate_derivative : float
        Derivative of ``log_slip_rate`` with respect to the independent variable of the equations,
        which is usually path length.
    spring_stress : float
        Deviation :math:`f` of the spring stress from :math:`\tau_*`, in :math:`\sigma_*`.
    frictional_stress : float
        Deviation :math:`g` of the frictional stress from :math:`\tau_*`, in :math:`\sigma_*`.
    psi : float
        Sum of the states :math:`\Psi_i` of the law. The effect of stress is not included in these
        states.
    state : float
        State variable :math:`\Theta`. If the law has several states, ``state`` is the sum of the
        states.
    steady_state_offset : float
        Difference between the state variable and the value of the state variable in steady sliding
        at the same slip rate. For most laws, the steady-state offset is
        :math:`\Theta + b \ln(V/V_*)`.
    distance_from_steady_state : float
        Largest absolute difference between a state and its steady value. Unknowns in
        ``excluded_from_distance`` are ignored.
    friction_coefficient : float
        Friction coefficient.
    normal_stress : float
        Effective normal stress in :math:`\sigma_*`.
    apparent_friction : float
        Friction coefficient that is measured in an experiment. It is the spring stress divided by
        the difference between normal stress and the pore pressure outside the fault.
    apparent_friction_derivative : float
        Derivative of ``apparent_friction`` with respect to the independent variable.
    psis : tuple of float
        States :math:`\Psi_i` of the law, followed by the unknowns of the loading and the fluid.
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
