"""Readings of a rig along a motion, and motions that are resampled along their paths."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rsfstudy.motion.engine_factory import call_with_arrays
from rsfstudy.motion.engines import SCIPY
from rsfstudy.motion.events import Event
from rsfstudy.motion.recording import (
    MOTION_VARIABLES,
    RECORDED_VARIABLES,
    SAMPLE_COLUMN,
    SAMPLES_PER_STEP,
    resample_along_path,
)
from rsfstudy.slider import PATH_LOG_RATE_SCALE, RUPTURE_REGIME, Point, Scene, path_metric

#: Smallest square of a direction cosine of the path in a rupture, where ln V changes at once.
MIN_SQUARED_COSINE = 1e-12
#: Columns of a recorded motion that the length of its path depends on.
_PATH_COLUMNS = tuple(
    MOTION_VARIABLES.index(name) for name in ("time", "log10_slip_rate", "shear_stress")
)


def distance_from_steady(scene: Scene, point: Point, load_velocity: float) -> float:
    """Distance of a point from steady sliding at a load point velocity, in ln V or in the state
    over b.
    """
    size = scene.a * scene.parts.law.state_change_over_a
    return max(
        abs(point.log_slip_rate - math.log(abs(load_velocity))),
        point.distance_from_steady_state / size,
    )


def growth_rate_along_path(scene: Scene, event: Event, load_velocity: float) -> float:
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
    growth = event.point.log_slip_rate_derivative
    if event.regime != RUPTURE_REGIME:
        return growth
    norm = scene.inertial_time * (math.exp(event.point.log_slip_rate) + load_velocity)
    slant = growth / (
        PATH_LOG_RATE_SCALE
        * math.sqrt(max(1.0 - (growth / PATH_LOG_RATE_SCALE) ** 2, MIN_SQUARED_COSINE))
        * norm
    )
    return PATH_LOG_RATE_SCALE * slant * path_metric(slant)


def friction_event_quantity(scene: Scene) -> tuple[str, float]:
    """Quantity that an engine watches to tell extrema and levels of the friction coefficient that
    is read, and what it is above it: spring stress itself where nothing changes normal stress and
    slip rate alone tells where that is extreme.
    """
    parts = scene.parts
    stressed = parts.normal_stress.normal_stress is not None or parts.loading.unknowns
    if not stressed and not parts.law.regularised:
        return "spring_stress", scene.mu_star
    return "apparent_friction", 0.0


def friction_coefficient(table: np.ndarray) -> np.ndarray:
    """The friction coefficient along a recorded motion."""
    return table[:, RECORDED_VARIABLES.index("friction_coefficient")]


def load_point_displacement(scene: Scene, table: np.ndarray) -> np.ndarray:
    """Load point displacement along a recorded motion, since before its first step: slip, and by
    how much the spring is longer.
    """
    longer = (table[:, MOTION_VARIABLES.index("shear_stress")] - scene.mu_star) / scene.stiffness
    return np.asarray(table[:, MOTION_VARIABLES.index("slip")] + longer)


def sample_along_path(
    table: np.ndarray, count: int, names: Sequence[str] = MOTION_VARIABLES, engine: str = SCIPY
) -> dict[str, np.ndarray]:
    """Resample a recorded motion at points that are spread along its path.

    Half of the points are spread evenly by path length in time, ln V and stress. The other half
    follow the integration steps, which are short where the path bends. Each extremum of slip rate
    and of stress is one of the points.

    Parameters
    ----------
    table : ndarray
        Rows of a recorded motion.
    count : int
        Number of points.
    names : sequence of str
        Names of the first columns, which are returned.
    engine : str
        Name of the engine that runs the resampling loop.

    Returns
    -------
    dict of str to ndarray
        Values of each column at the points. The values are NaN if the table is empty.
    """
    if not len(table):
        return {name: np.full(count, np.nan) for name in names}
    columns, found = np.ascontiguousarray(table.T), np.empty((len(names), count))
    path, at, room = np.zeros(len(table)), np.empty(count), np.empty(SAMPLES_PER_STEP + 1)
    seen = [columns[place] for place in (*_PATH_COLUMNS, SAMPLE_COLUMN)]
    call_with_arrays(resample_along_path, engine, columns, *seen, path, at, room, found)
    # times of a rupture may differ by less than rounding
    np.maximum.accumulate(found[0], out=found[0])
    return dict(zip(names, found, strict=True))
