"""Functions that fit the trend of friction with load point displacement during steady sliding."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.polynomial import polynomial

from rsfstudy.fitting.linear_friction_before_step import find_start_of_linear_friction
from rsfstudy.fitting.local_regression import compute_weighted_mean, fit_linear_model
from rsfstudy.fitting.velocity_steps import LoadingStep

#: The window of steady sliding before a step begins at this fraction of the time between the
#: previous step and the step.
_STEADY_START_FRACTION_OF_STEP_INTERVAL = 0.5
#: Largest and smallest number of rows of a window.
_MAX_ROWS, MIN_ROWS = 4000, 12


def select_steady_rows_before_step(
    time: np.ndarray, friction: np.ndarray, start_time: float, end_time: float
) -> np.ndarray:
    """Select the rows before a step in which friction is a linear function of time.

    Parameters
    ----------
    time, friction : ndarray, shape (rows,)
        Times in s and friction.
    start_time, end_time : float
        Times in s between which the rows are selected. ``start_time`` is the end of the previous
        step, or the start of the record if there is no previous step. ``end_time`` is the start of
        the step. If there is a previous step, rows in the first half of the interval are not
        selected.

    Returns
    -------
    ndarray of int
        Indices of the rows. The array is empty if there are too few rows.
    """
    share = _STEADY_START_FRACTION_OF_STEP_INTERVAL if start_time > time[0] else 0.0
    start_time += share * (end_time - start_time)
    rows = np.flatnonzero((time >= start_time) & (time < end_time))
    if len(rows) < MIN_ROWS:
        return rows[:0]
    begins = find_start_of_linear_friction(time, friction, start_time, end_time)
    rows = rows[time[rows] >= begins][-_MAX_ROWS:]
    return rows if len(rows) >= MIN_ROWS else rows[:0]


def fit_friction_trend(
    time: np.ndarray, friction: np.ndarray, steps: Sequence[LoadingStep]
) -> tuple[float, float]:
    """Fit the common trend of friction in all intervals of steady sliding.

    Parameters
    ----------
    time, friction : ndarray, shape (rows,)
        Times in s and friction.
    steps : sequence of LoadingStep
        Steps of the record in order of time.

    Returns
    -------
    trend : float
        Change in friction per um of load point displacement. The trend is 0 if the record contains
        no steady sliding before or after a step.
    stderr : float
        Standard error of the trend.
    """
    found = []
    for start_time, end_time, velocity in _iterate_sliding_intervals(time, steps):
        rows = select_steady_rows_before_step(time, friction, start_time, end_time)
        if len(rows):
            moved = polynomial.polyvander(velocity * (time[rows] - end_time), 1)
            line = fit_linear_model(
                time[rows], friction[rows], moved, estimate_noise_by_moments=True
            )
            found.append((line.coefficients[1], math.sqrt(line.coefficient_covariance[1, 1])))
    return compute_weighted_mean(*np.array(found).T) if found else (0.0, 0.0)


def _iterate_sliding_intervals(
    time: np.ndarray, steps: Sequence[LoadingStep]
) -> Iterator[tuple[float, float, float]]:
    """Iterate over the intervals of forward load point motion between steps.

    Each item contains the start and the end of the interval in s, and the velocity in um/s.
    """
    for number, step in enumerate(steps):
        if step.velocity_before > 0.0:
            yield (
                (steps[number - 1].end if number else float(time[0])),
                step.start,
                step.velocity_before,
            )
    if steps and steps[-1].velocity_after > 0.0:
        yield steps[-1].end, float(time[-1]), steps[-1].velocity_after
