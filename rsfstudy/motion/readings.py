"""Readings of a rig along a motion: friction coefficient and load point displacement."""

from __future__ import annotations

import math

import numpy as np

from rsfstudy.motion.events import Event
from rsfstudy.motion.recording import OBSERVED, READ
from rsfstudy.slider.equations import IN_RUPTURE
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.system import UNITS, path_metric

#: Smallest square of a direction cosine of the path in a rupture, where ln V changes at once.
LEAST = 1e-12


def unsteady(scene: Scene, point: Point, load_velocity: float) -> float:
    """Distance of a point from steady sliding at a load point velocity, in ln V or in the state
    over b.
    """
    size = scene.a * scene.parts.law.size_over_a
    return max(
        abs(point.log_slip_rate - math.log(abs(load_velocity))),
        point.distance_from_steady_state / size,
    )


def growth_along_path(scene: Scene, event: Event, load_velocity: float) -> float:
    """Compute the growth rate of ln V at an event with respect to path length.

    During a rupture the clock is the path length in inertial time. The growth rate is converted to
    the unit of path length that is used between ruptures.

    Parameters
    ----------
    scene : Scene
    event : Event
    load_velocity : float
        Load point velocity V_0/V_*.
    """
    growth = event.point.growth
    if event.regime != IN_RUPTURE:
        return growth
    norm = scene.inertial_time * (math.exp(event.point.log_slip_rate) + load_velocity)
    slant = growth / (UNITS * math.sqrt(max(1.0 - (growth / UNITS) ** 2, LEAST)) * norm)
    return UNITS * slant * path_metric(slant)


def watched(scene: Scene) -> tuple[str, float]:
    """Quantity that an engine watches to tell extrema and levels of the friction coefficient that
    is read, and what it is above it: spring stress itself where nothing changes normal stress and
    slip rate alone tells where that is extreme.
    """
    parts = scene.parts
    stressed = parts.normal_stress.normal_stress is not None or parts.loading.unknowns
    if not stressed and not parts.law.regularised:
        return "spring_stress", scene.mu_star
    return "reading", 0.0


def friction_coefficient_of(table: np.ndarray) -> np.ndarray:
    """The friction coefficient along a recorded motion."""
    return table[:, READ.index("friction_coefficient")]


def load_point_of(scene: Scene, table: np.ndarray) -> np.ndarray:
    """Load point displacement along a recorded motion, since before its first step: slip, and by
    how much the spring is longer.
    """
    longer = (table[:, OBSERVED.index("shear_stress")] - scene.mu_star) / scene.stiffness
    return np.asarray(table[:, OBSERVED.index("slip")] + longer)
