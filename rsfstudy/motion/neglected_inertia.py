"""Error estimate of the slow manifold approximation along a recorded motion.

The comparison of two runs with different tolerances does not reveal this error, because both runs
use the same approximation on the slow manifold.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator

import numpy as np

from rsfstudy.motion.recording import OBSERVED, PLACE, REGIME, SAMPLES, STATES, STRESSES
from rsfstudy.slider.dynamics.inertia import LIGHT
from rsfstudy.slider.equations import by_displacement
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.places import (
    BEGINS,
    LOAD_VELOCITY,
    LOADING,
    LOG_LOAD_RATE,
    LOG_VELOCITY,
    RATE,
    RECHARGE,
    VELOCITY,
    A,
)
from rsfstudy.slider.scene import Scene

#: Largest ratio of errors to estimates without this factor, rounded up: over random scenes with
#: thresholds loosened three to ten times, friction errs by up to 1.4 times its estimate.
_SAFETY = 2.0
_SLIP, _RATE = OBSERVED.index("slip"), OBSERVED.index("log10_slip_rate")


def estimate_neglected_inertia(
    scene: Scene, rows: np.ndarray, slow: int, log_slip_rate: float
) -> np.ndarray:
    """Estimate the error in ln V that the approximate treatment of inertia causes.

    The estimate is the sum of two contributions:

    - The residual of the full equation of motion on the slow manifold. If W is the weight of mass
      and s is the displacement of slip and load point together, friction is smaller than spring
      stress by ``a W d(ln V)/ds``. The residual divided by a is the local error e of ln V. The
      resulting change of spring stress and state is at most the integral of e over
      ``(1 + K/a) d(slip) + |dPsi|/a``. The motion is attracted to its course, so the largest e is
      an upper bound as well.
    - The slip, in units of D_c, that is neglected when ln V jumps to the slow manifold. The state
      does not evolve over this slip.

    Parameters
    ----------
    scene : Scene
    rows : ndarray
        Rows of a recording, as in ``Recording.seen``.
    slow : int
        Number of the slow-manifold regime in these rows.
    log_slip_rate : float
        ln(V/V_*) before the first row.

    Returns
    -------
    ndarray of shape (rows,)
        Error estimate of ln V for the motion up to each row. The estimate is zero if the scene has
        no inertia.
    """
    if not scene.has_mass:
        return np.zeros(len(rows))
    rates = np.append(log_slip_rate, math.log(10.0) * rows[:, _RATE])
    norms = scene.inertial_time * np.exp(rates)
    softness = scene.stiffness / scene.a
    on_manifold = rows[:, REGIME] == slow
    arrives = on_manifold & (rows[:, PLACE] == 0.0)
    slips = softness * np.maximum(norms[1:], norms[:-1]) ** 2 * np.abs(np.diff(rates))
    # the middle and the end of each step, and the beginning of each regime
    used = np.flatnonzero(on_manifold & (rows[:, PLACE] % (SAMPLES // 2) == 0.0))
    jumps = np.cumsum(np.where(arrives, slips, 0.0))
    if not used.size:
        return _SAFETY * jumps
    left = np.maximum.accumulate(_accumulated(scene, rows[used], norms[1:][used]))
    # rows in between count as the next one that is used, because residuals may rise steeply
    numbers = np.arange(len(rows))
    number = np.minimum(np.searchsorted(used, numbers), used.size - 1)
    number -= (np.abs(used[number] - numbers) >= SAMPLES // 2) & (number > 0)
    return _SAFETY * (jumps + left[number])


def _accumulated(scene: Scene, rows: np.ndarray, norms: np.ndarray) -> np.ndarray:
    """Compute an upper bound of the change of ln V due to residuals up to each row.

    The bound is the smaller of the integrated residual and the largest residual so far.
    """
    residuals = np.array(list(_residuals(scene, rows, norms)))
    states = rows[:, STATES : STATES + scene.parts.law.states].sum(axis=1)
    softness = scene.stiffness / scene.a
    ways = (1.0 + softness) * np.diff(rows[:, _SLIP]) + np.abs(np.diff(states)) / scene.a
    ways[rows[1:, PLACE] == 0.0] = 0.0  # a rupture may come between these two rows
    sums = np.append(0.0, np.cumsum(0.5 * (residuals[1:] + residuals[:-1]) * ways))
    found: np.ndarray = np.minimum(np.maximum.accumulate(residuals), sums)
    return found


def _residuals(scene: Scene, rows: np.ndarray, norms: np.ndarray) -> Iterator[float]:
    """Yield the residual of the equation of motion, divided by a, at each row.

    The residual is set to zero where the mass is negligible.
    """
    segments = list(_segments(scene))
    begins = [begin for begin, _acting, _p in segments]
    for row, norm in zip(rows, norms.tolist(), strict=True):
        # the last row of a segment has the time at which the next one begins
        side = bisect_right if row[PLACE] == 0.0 else bisect_left
        _begin, acting, p = segments[max(side(begins, row[0]) - 1, 0)]
        load = acting.inertial_time * abs(p[LOAD_VELOCITY])
        weight = acting.stiffness / acting.a * norm * (norm + load)
        known = weight > LIGHT and len(row) >= STATES + acting.states
        yield _residual(acting, p, row, weight) if known else 0.0


def _residual(acting: Scene, p: Numbers, row: np.ndarray, weight: float) -> float:
    """Compute the residual of the equation of motion, divided by a, at one row.

    The row must be on the slow manifold.
    """
    equations = by_displacement(acting)
    state = (row[STRESSES][0] - acting.mu_star, *row[STATES : STATES + acting.states].tolist())
    point = equations.point(state, equations.rate(state, p), p)
    missing: float = point.spring_stress - point.friction - p[A] * weight * point.growth
    return abs(missing) / p[A]


def _segments(scene: Scene) -> Iterator[tuple[float, Scene, Numbers]]:
    """Yield the start time, the scene and the parameters of each segment of loading."""
    for acting, table in scene.chains:
        for n, row in enumerate(table.tolist()):
            p = list(acting.numbers)
            if n > 0:
                p[LOAD_VELOCITY], p[LOG_LOAD_RATE] = row[VELOCITY], row[LOG_VELOCITY]
            if n > 0 and not math.isnan(row[RATE]):
                p[RECHARGE if acting.parts.fluid.unknowns else LOADING] = row[RATE]
            yield row[BEGINS], acting, tuple(p)
