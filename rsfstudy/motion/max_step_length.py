"""Function that computes the maximum step size of the integration."""

from __future__ import annotations

#: Upper limit of all step sizes, which prevents overflow if the slider is at rest.
MAX_STEP_LENGTH = 1e9
#: Maximum step size in path length, in units of D_c. A longer step may skip a rapid change of the
#: motion between two Runge-Kutta stages. During stationary contact, no rapid changes occur until ln
#: V has increased to a few units below its steady-state value. The maximum step size therefore
#: increases with the difference between ln V_0 and ln V. The second constant is the value by which
#: the difference ln V_0 - ln V is divided.
LONGEST_PATH_STEP, STATIONARY_LOG_RATE_SCALE = 3.0, 10.0


def compute_max_step_length(
    log_slip_rate: float, normal_stress: float, log_load_velocity: float
) -> float:
    r"""Compute the maximum step size in path length.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    normal_stress : float
        Normal stress in sigma_*. If the normal stress exceeds sigma_*, the maximum step size is
        proportional to the normal stress.
    log_load_velocity : float
        Natural logarithm of the load point velocity, :math:`\ln(V_0/V_*)`.

    Returns
    -------
    float
        Maximum step size.
    """
    stationary = max(1.0, (log_load_velocity - log_slip_rate) / STATIONARY_LOG_RATE_SCALE)
    return min(LONGEST_PATH_STEP * stationary * max(1.0, normal_stress), MAX_STEP_LENGTH)
