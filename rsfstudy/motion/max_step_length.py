"""Longest steps of the clocks of an integration."""

from __future__ import annotations

#: Longest step of any clock. A motion at rest would otherwise double its steps until they overflow.
MAX_STEP_LENGTH = 1e9
#: Longest step along the path, as far as slip of D_c is: longer ones may pass a turn of the motion
#: that none of their stages sees. Stationary contact has no turns, up to a few units of ln V before
#: slip takes up again; and normal stress stretches them all.
LONGEST_PATH_STEP, STATIONARY_LOG_RATE_SCALE = 3.0, 10.0


def compute_max_step_length(
    log_slip_rate: float, normal_stress: float, log_load_velocity: float
) -> float:
    """Longest step of a form whose clock is length along the path."""
    stationary = max(1.0, (log_load_velocity - log_slip_rate) / STATIONARY_LOG_RATE_SCALE)
    return min(LONGEST_PATH_STEP * stationary * max(1.0, normal_stress), MAX_STEP_LENGTH)
