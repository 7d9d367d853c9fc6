"""Error estimate of the slow manifold along a recorded motion with inertia.

Two runs with different tolerances share this error if both stay on the slow manifold, so their
difference does not show it.
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
    """Estimate the error that the treatment of inertia leaves in a motion, as a change of ln V.

    The estimate has two contributions:

    - The residual of the full equation of motion on the slow manifold. With the weight of mass W
      and the displacement s of slip and load point together, friction must fall short of spring
      stress by ``a W d(ln V)/ds``. The residual over a is the local error e of ln V. It changes
      spring stress and state by no more than the integral of e over ``(1 + K/a) d(slip) +
      |dPsi|/a``, and the motion is attracted to its course, so the largest e is a bound as well.
    - The slip in D_c that is left out where ln V jumps to the slow manifold. The state then misses
      the evolution of that slip.

    Parameters
    ----------
    scene : Scene
    rows : ndarray
        Rows of a recording, as `Recording.seen` returns them.
    slow : int
        Number of the regime of the slow manifold in these rows.
    log_slip_rate : float
        ln(V/V_*) before the first row.

    Returns
    -------
    ndarray
        Error of ln V by the motion up to each row, shape (rows,). It is 0 without inertia.
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
    """Change of ln V by the residuals up to each row: no more than the largest residual."""
    residuals = np.array(list(_residuals(scene, rows, norms)))
    states = rows[:, STATES : STATES + scene.parts.law.states].sum(axis=1)
    softness = scene.stiffness / scene.a
    ways = (1.0 + softness) * np.diff(rows[:, _SLIP]) + np.abs(np.diff(states)) / scene.a
    ways[rows[1:, PLACE] == 0.0] = 0.0  # a rupture may come between these two rows
    sums = np.append(0.0, np.cumsum(0.5 * (residuals[1:] + residuals[:-1]) * ways))
    found: np.ndarray = np.minimum(np.maximum.accumulate(residuals), sums)
    return found


def _residuals(scene: Scene, rows: np.ndarray, norms: np.ndarray) -> Iterator[float]:
    """Residuals of the equation of motion over a, without those of a negligible mass."""
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
    """Residual of the equation of motion over a, at a row on the slow manifold."""
    equations = by_displacement(acting)
    state = (row[STRESSES][0] - acting.mu_star, *row[STATES : STATES + acting.states].tolist())
    point = equations.point(state, equations.rate(state, p), p)
    missing: float = point.spring_stress - point.friction - p[A] * weight * point.growth
    return abs(missing) / p[A]


def _segments(scene: Scene) -> Iterator[tuple[float, Scene, Numbers]]:
    """Segments of loading: when each begins, the scene of its chain, and its numbers."""
    for acting, table in scene.chains:
        for n, row in enumerate(table.tolist()):
            p = list(acting.numbers)
            if n > 0:
                p[LOAD_VELOCITY], p[LOG_LOAD_RATE] = row[VELOCITY], row[LOG_VELOCITY]
            if n > 0 and not math.isnan(row[RATE]):
                p[RECHARGE if acting.parts.fluid.unknowns else LOADING] = row[RATE]
            yield row[BEGINS], acting, tuple(p)
