"""What the load point does at the start: a step of its velocity, a step of its displacement, or
both.
"""

from __future__ import annotations


def load_velocity(load_velocity_ratio: float | None, displacement_step: float) -> float:
    """V_0/V_* after the step.

    A scene that does not say otherwise holds its load point after a displacement step (V_0 = 0)
    and otherwise goes on at the reference rate (V_0 = V_*).
    """
    if load_velocity_ratio is None:
        return 1.0 if displacement_step == 0.0 else 0.0
    return load_velocity_ratio


def spring_stress_step(displacement_step: float, stiffness: float) -> float:
    """Instantaneous change of spring stress over sigma_*: ``K d`` for a load point step d in
    D_c.
    """
    return stiffness * displacement_step
