"""Functions that split a record into runs with uniform sampling and noise.

The sampling intervals are classified by their running mean, so that timing jitter does not affect
the classes. Changes in the noise level are detected by binary segmentation of the whitened
residuals.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

#: Two sampling intervals belong to different classes if their ratio exceeds this value.
_MAX_RATIO_IN_SAMPLING_INTERVAL_CLASS = 2.0
#: Number of rows in the running mean of the sampling intervals, smallest number of rows of a class
#: with a separate noise process, and smallest number of rows of a run.
_RUNNING_MEAN_ROWS, _MIN_ROWS_PER_NOISE_PROCESS, _MIN_ROWS_PER_SAMPLING_RUN = 15, 100, 30
#: Criteria for separate noise levels. The first two values are the smallest number of rows, and the
#: smallest fraction of the record. The third value is the smallest increase in the likelihood,
#: divided by ln n for n rows. The fourth value is the largest number of changes in the noise level.
(
    _MIN_ROWS_PER_NOISE_LEVEL,
    _MIN_RECORD_FRACTION_PER_NOISE_LEVEL,
    _MIN_GAIN_OF_NOISE_LEVEL_CHANGE,
    _MAX_LEVEL_CHANGES,
) = 30, 0.08, 3.0, 7
#: Variance of the logarithm of the absolute value of Gaussian noise, and lower bound of the
#: differences between successive rows relative to their root mean square.
_VARIANCE_OF_LOG_ABSOLUTE_GAUSSIAN, _MIN_ABSOLUTE_VALUE_OVER_RMS = math.pi**2 / 8.0, 0.01


class UniformSamplingRun(NamedTuple):
    """Consecutive rows with the same sampling interval and noise level.

    Parameters
    ----------
    start_row, stop_row : int
        Index of the first row, and index of the row after the last row.
    noise_process_index : int
        Index of the noise process.
    row_count_since_time_restart : int
        Number of rows between the last restart of the clock and the start of the run.
    noise_level_index : int
        Index of the noise level.
    """

    start_row: int
    stop_row: int
    noise_process_index: int
    row_count_since_time_restart: int
    noise_level_index: int


def find_uniform_sampling_runs(time: np.ndarray) -> tuple[UniformSamplingRun, ...]:
    """Find runs of consecutive rows with the same sampling interval.

    A new run also begins when the clock restarts, for example between the windows of a joint fit.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Times in s.

    Returns
    -------
    tuple of UniformSamplingRun
        Runs that cover all rows. Each noise process has a single noise level. The index of the
        noise level is equal to the index of the noise process.
    """
    kinds, begins = _classify_sampling_intervals(time), np.diff(time) <= 0.0
    bounds = (np.flatnonzero((np.diff(kinds) != 0) | begins) + 1).tolist()
    found, begun = [], 0
    for first, last in itertools.pairwise([0, *bounds, len(time)]):
        begun = first if first and begins[first - 1] else begun
        found.append(
            UniformSamplingRun(first, last, int(kinds[first]), first - begun, int(kinds[first]))
        )
    return tuple(found)


def split_runs_at_noise_level_changes(
    sampling_runs: Sequence[UniformSamplingRun], change_rows: Sequence[int]
) -> tuple[UniformSamplingRun, ...]:
    """Divide runs of equally spaced samples where the noise level changes.

    Parameters
    ----------
    sampling_runs : sequence of UniformSamplingRun
        Runs that cover all rows.
    change_rows : sequence of int
        Rows at which the noise level changes. Changes close to the ends of a run are ignored.

    Returns
    -------
    tuple of UniformSamplingRun
        Runs of rows. Between two changes, each noise process has a separate noise level.
    """
    found: list[UniformSamplingRun] = []
    levels: dict[tuple[int, int], int] = {}
    for run in sampling_runs:
        inside = [
            k
            for k in change_rows
            if run.start_row + _MIN_ROWS_PER_SAMPLING_RUN
            <= k
            <= run.stop_row - _MIN_ROWS_PER_SAMPLING_RUN
        ]
        for first, last in itertools.pairwise([run.start_row, *inside, run.stop_row]):
            segment = sum(k <= first for k in change_rows)
            level = levels.setdefault((segment, run.noise_process_index), len(levels))
            found.append(
                UniformSamplingRun(
                    first,
                    last,
                    run.noise_process_index,
                    run.row_count_since_time_restart + first - run.start_row,
                    level,
                )
            )
    return tuple(found)


def count_noise_processes(sampling_runs: Sequence[UniformSamplingRun]) -> int:
    """Return the number of noise processes in a sequence of runs.

    Parameters
    ----------
    sampling_runs : sequence of UniformSamplingRun
        Runs that cover all rows.

    Returns
    -------
    int
        Number of noise processes.
    """
    return 1 + max(run.noise_process_index for run in sampling_runs)


def expand_run_field_to_rows(
    sampling_runs: Sequence[UniformSamplingRun], run_field_name: str
) -> np.ndarray:
    """Return the noise process index or the noise level index of each row.

    Parameters
    ----------
    sampling_runs : sequence of UniformSamplingRun
        Runs that cover all rows.
    run_field_name : {"process", "level"}
        Name of the index to return: the index of the noise process, or of the noise level.

    Returns
    -------
    ndarray of int, shape (rows,)
        Index of the noise process, or of the noise level, for each row.
    """
    return np.repeat(
        [getattr(run, run_field_name) for run in sampling_runs],
        [run.stop_row - run.start_row for run in sampling_runs],
    )


def find_noise_level_changes(
    whitened_residuals: np.ndarray, min_absolute_difference: float = 0.0
) -> list[int]:
    """Find the rows at which the standard deviation of the noise changes.

    The function segments the logarithms of the absolute differences between successive residuals. A
    model misfit near a step is either smooth or short, and therefore affects only a few of the
    differences. In contrast, a change in the noise level affects all differences after the change.

    Parameters
    ----------
    whitened_residuals : ndarray, shape (rows,)
        Whitened residuals.
    min_absolute_difference : float, default: 0.0
        Lower bound on the absolute differences between successive residuals.

    Returns
    -------
    list of int
        Index of the first row of each segment except the first segment.
    """
    count, size = len(whitened_residuals), np.abs(np.diff(whitened_residuals, prepend=0.0))
    shortest = max(
        _MIN_ROWS_PER_NOISE_LEVEL, math.ceil(_MIN_RECORD_FRACTION_PER_NOISE_LEVEL * count)
    )
    least = _MIN_ABSOLUTE_VALUE_OVER_RMS * float(np.sqrt(np.mean(np.square(size)))) or 1.0
    logs = np.log(np.maximum(size, max(least, min_absolute_difference)))
    sums = np.concatenate([[0.0], np.cumsum(logs - logs.mean())])
    segments, found = [(0, count)], []
    while segments:
        first, last = segments.pop()
        at = np.arange(first + shortest, last - shortest + 1)
        if not len(at):
            continue
        apart = (sums[at] - sums[first]) / (at - first) - (sums[last] - sums[at]) / (last - at)
        gains = (
            (at - first)
            * (last - at)
            / (last - first)
            * np.square(apart)
            / _VARIANCE_OF_LOG_ABSOLUTE_GAUSSIAN
        )
        best = int(np.argmax(gains))
        if gains[best] > _MIN_GAIN_OF_NOISE_LEVEL_CHANGE * math.log(count):
            found.append((float(gains[best]), int(at[best])))
            segments += [(first, int(at[best])), (int(at[best]), last)]
    rows = sorted(row for _gain, row in sorted(found, reverse=True)[:_MAX_LEVEL_CHANGES])
    squares = np.square(np.maximum(np.abs(whitened_residuals), max(least, min_absolute_difference)))
    bounds = [0, *rows, count]
    return [
        _refine_row_of_noise_level_change(squares, *bounds[n : n + 3]) for n in range(len(rows))
    ]


def _refine_row_of_noise_level_change(
    squared_residuals: np.ndarray, first_row: int, initial_row: int, stop_row: int
) -> int:
    """Refine the location of a noise level change by maximum likelihood.

    Parameters
    ----------
    squared_residuals : ndarray, shape (rows,)
        Squares of the whitened residuals.
    first_row, initial_row, stop_row : int
        First row of the segment before the change, estimated row of the change, and end (exclusive)
        of the segment after the change.

    Returns
    -------
    int
        Row at which the noise level changes.
    """
    reach = min(
        _MIN_ROWS_PER_SAMPLING_RUN, (initial_row - first_row) // 2, (stop_row - initial_row) // 2
    )
    before, after = (
        squared_residuals[first_row : initial_row - reach].mean(),
        squared_residuals[initial_row + reach : stop_row].mean(),
    )
    near = squared_residuals[initial_row - reach : initial_row + reach]
    costs = near * (1.0 / before - 1.0 / after) + math.log(before / after)
    return initial_row - reach + int(np.argmin(np.concatenate([[0.0], np.cumsum(costs)])))


def _classify_sampling_intervals(time: np.ndarray) -> np.ndarray:
    """Return the class of the sampling interval of each row.

    Returns
    -------
    ndarray of int, shape (rows,)
        Class of the sampling interval of each row, numbered from 0.
    """
    gaps = np.diff(time)
    gaps[gaps <= 0.0] = np.median(gaps)
    smooth = np.log(uniform_filter1d(gaps, min(_RUNNING_MEAN_ROWS, len(gaps)), mode="nearest"))
    kinds = np.rint((smooth - np.median(smooth)) / math.log(_MAX_RATIO_IN_SAMPLING_INTERVAL_CLASS))
    kinds = np.append(kinds[:1], kinds)
    lasts = np.diff([0, *(np.flatnonzero(np.diff(kinds)) + 1), len(kinds)])
    steady = np.repeat(lasts, lasts) >= _MIN_ROWS_PER_SAMPLING_RUN
    names, counts = np.unique(kinds[steady], return_counts=True)
    rows = np.flatnonzero(steady & np.isin(kinds, names[counts >= _MIN_ROWS_PER_NOISE_PROCESS]))
    if not len(rows):
        return np.zeros(len(time), dtype=int)
    nearest = np.minimum(np.searchsorted(rows, np.arange(len(time))), len(rows) - 1)
    found = np.unique(kinds[rows[nearest]], return_inverse=True)[1]
    for row in (np.flatnonzero(np.diff(found)) + 1).tolist():
        at = _refine_sampling_interval_change(np.log(gaps), row)
        found[min(row, at) : max(row, at)] = found[row - 1 if at > row else row]
    return np.asarray(found)


def _refine_sampling_interval_change(log_sampling_intervals: np.ndarray, initial_row: int) -> int:
    """Refine the row at which the sampling interval changes.

    The refined row minimises the sum of squared deviations of the sampling intervals from their
    means before and after the row.
    """
    first, last = (
        max(initial_row - 1 - 2 * _RUNNING_MEAN_ROWS, 0),
        min(initial_row - 1 + 2 * _RUNNING_MEAN_ROWS, len(log_sampling_intervals)),
    )
    part = log_sampling_intervals[first:last]
    costs = [np.var(part[:k]) * k + np.var(part[k:]) * (len(part) - k) for k in range(1, len(part))]
    return first + 2 + int(np.argmin(costs))
