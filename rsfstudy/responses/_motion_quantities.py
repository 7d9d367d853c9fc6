"""Functions that compute the quantities that response measures need at points of a motion."""

from __future__ import annotations

import math

from rsfstudy.motion import Event
from rsfstudy.slider import (
    LOG_SLIP_RATE_PER_PATH_LENGTH,
    MotionPoint,
    Scene,
    compute_displacement_per_path_length,
)

#: Lower bound of the squared direction cosine of the path. The direction cosine vanishes if ln V
#: changes suddenly during a rupture.
MIN_SQUARED_DIRECTION_COSINE_OF_PATH = 1e-12


def compute_distance_from_steady_sliding(
    scene: Scene, motion_point: MotionPoint, load_velocity: float
) -> float:
    """Compute the distance of a point from steady sliding at a given load point velocity.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    motion_point : MotionPoint
        Point of the motion.
    load_velocity : float
        Load point velocity in units of V_*.

    Returns
    -------
    float
        Larger of two numbers. The first number is the difference between ln V and its value in
        steady sliding. The second number is the difference between the state and its value in
        steady sliding, in units of b.
    """
    size = scene.a * scene.parts.law.steady_state_change_per_log_rate_over_a
    return max(
        abs(motion_point.log_slip_rate - math.log(abs(load_velocity))),
        motion_point.distance_from_steady_state / size,
    )


def compute_log_slip_rate_slope_along_path(
    scene: Scene, event: Event, load_velocity: float
) -> float:
    """Compute the growth rate of ln V with respect to path length at an event.

    During a rupture, path length is defined with inertial time instead of displacement. In this
    case, the growth rate is converted to the path length that is used between ruptures.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    event : Event
        Event of the motion.
    load_velocity : float
        Load point velocity in units of V_*.

    Returns
    -------
    float
        Growth rate per unit path length.
    """
    growth = event.point.log_slip_rate_derivative
    if event.regime != Scene.RUPTURE_REGIME:
        return growth
    norm = scene.inertial_time * (math.exp(event.point.log_slip_rate) + load_velocity)
    slant = growth / (
        LOG_SLIP_RATE_PER_PATH_LENGTH
        * math.sqrt(
            max(
                1.0 - (growth / LOG_SLIP_RATE_PER_PATH_LENGTH) ** 2,
                MIN_SQUARED_DIRECTION_COSINE_OF_PATH,
            )
        )
        * norm
    )
    return LOG_SLIP_RATE_PER_PATH_LENGTH * slant * compute_displacement_per_path_length(slant)


def choose_friction_quantity_for_events(scene: Scene) -> tuple[str, float]:
    """Choose the quantity that is used to detect events of the friction coefficient.

    If normal stress is constant and the law is not regularised, the spring stress differs from the
    friction coefficient only by a constant. In this case, the spring stress is used.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.

    Returns
    -------
    quantity : str
        Attribute of ``MotionPoint``: ``"spring_stress"`` or ``"apparent_friction"``.
    offset : float
        Friction coefficient minus the quantity.
    """
    parts = scene.parts
    stressed = parts.normal_stress.normal_stress is not None or scene.stress_imposing_part.unknowns
    if not stressed and not parts.law.regularised:
        return "spring_stress", scene.mu_star
    return "apparent_friction", 0.0
