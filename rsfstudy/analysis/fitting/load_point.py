"""What noise of load point displacement leaves open of the times and velocities of steps.

Displacement is ``x_0 + V_0 t`` up to the first step and goes on with the velocity of each piece.
Its derivatives by x_0, times and velocities, and the noise of what straight pieces leave (see
`noise`), tell their covariance, as in a fit of friction.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_triangular

from rsfstudy.analysis.fitting import noise
from rsfstudy.analysis.fitting.record import Record
from rsfstudy.analysis.fitting.steps import Step

#: Means of rows of which noise is told: an autoregressive process of them remembers long enough for
#: a load point that wanders about its set point.
_MEANS = 1000
#: Part of the displacement of a record that noise exceeds; standard deviations by which steps are
#: moved, little enough for derivatives, and part of a velocity, or of the time up to its step.
_CLEAN, _MOVED, _PART = 1e-7, 0.01, 0.5


def moved_steps(
    record: Record, steps: Sequence[Step]
) -> list[tuple[list[Step], list[Step], float]]:
    """Steps of a record moved back and forth by errors that are independent and add up to those of
    their times and velocities; none where steps are stated or displacement is without noise.

    Parameters
    ----------
    record : Record
    steps : sequence of Step
        Some of those of the record, one after the other.

    Returns
    -------
    list of (list of Step, list of Step, float)
        Those moved back and forth, and by how many standard deviations.
    """
    if record.stated is not None or not steps:
        return []
    found, time = record.found, record.time
    begins = max((s.ends for s in found if s.ends < steps[0].begins), default=time[0])
    ends = min((s.begins for s in found if s.begins > steps[-1].ends), default=time[-1])
    speeds = np.array([steps[0].before, *(s.after for s in steps)])
    errors = _errors(record, begins, ends, steps, speeds)
    lasts = np.diff([begins, *(0.5 * (s.begins + s.ends) for s in steps)])
    moved = []
    for late, faster in errors:
        parts = np.abs(np.concatenate([late / lasts, faster[speeds > 0.0] / speeds[speeds > 0.0]]))
        size = min(_MOVED, _PART / max(float(parts.max()), 1e-300))
        back, forth = (
            [
                Step(s.begins + t, s.ends + t, one, other)
                for s, t, (one, other) in zip(
                    steps, by * late, itertools.pairwise(speeds + by * faster), strict=True
                )
            ]
            for by in (-size, size)
        )
        moved.append((back, forth, size))
    return moved


def _errors(
    record: Record, begins: float, ends: float, steps: Sequence[Step], speeds: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Independent errors of the times, shape (steps,), and velocities, shape (steps + 1,)."""
    rows = (record.time >= begins) & (record.time <= ends)
    for step in steps:
        rows &= (record.time <= step.begins) | (record.time >= step.ends)
    t, x = record.time[rows] - begins, record.columns["displacement"][rows]
    at = np.array([0.5 * (s.begins + s.ends) for s in steps]) - begins
    knots, moves = np.array([0.0, *at, ends - begins]), np.flatnonzero(speeds)
    late = -np.diff(speeds) * (t[:, None] > at)
    lasts = np.clip(t[:, None], knots[:-1], knots[1:]) - knots[:-1]
    columns = np.column_stack([late, lasts[:, moves], np.ones(len(t)), x - x[0]])
    best = np.linalg.lstsq(columns[:, :-1], columns[:, -1])[0]
    left = columns[:, -1] - columns[:, :-1] @ best
    if not np.std(left) > _CLEAN * np.ptp(x) or len(t) < 4 * columns.shape[1]:
        return []
    columns[:, -1] = left
    every = -(-len(t) // _MEANS)
    t, columns = (
        of[: len(t) // every * every].reshape(-1, every, *of.shape[1:]).mean(axis=1)
        for of in (t, columns)
    )
    told = noise.fitted(noise.AUTOREGRESSIVE, t, columns[:, -1], columns[:, :-1])
    white = told.whitened(np.eye(len(t)))
    size = np.linalg.norm(white @ columns[:, -1]) / np.sqrt(len(t) - columns.shape[1] + 1.0)
    # lines are those of least squares, with J^+ R J^+' for covariance, J^+ = (J'J)^-1 J'
    inverse = np.linalg.pinv(columns[:, :-1])
    acting = solve_triangular(white, inverse.T, trans="T", lower=True)
    root = size * np.linalg.qr(acting)[1].T[:-1, :-1]
    # steps are found where displacement parts best, which need not be where all of it would have it
    missed = best[:-1] - np.concatenate([np.zeros(len(at)), speeds[moves]])
    root = np.column_stack([root, missed])
    faster = np.zeros((len(speeds), root.shape[1]))
    faster[moves] = root[len(at) :]
    return [*zip(root[: len(at)].T, faster.T, strict=True)]
