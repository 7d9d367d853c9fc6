"""Segmentation of a record into runs with uniform sampling and noise.

Sampling intervals are classified by their running mean, so that all intervals of a clock with
jitter fall into one class. Changes of the noise level are detected by binary segmentation of the
whitened residuals.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

#: Sampling intervals whose ratio is smaller than this factor belong to one class.
_MAX_INTERVAL_RATIO = 2.0
#: Rows of the running mean of sampling intervals, fewest rows of a class with a noise process of
#: its own, and fewest rows of a run.
_MEAN_ROWS, _MIN_PROCESS_ROWS, _MIN_RUN_ROWS = 15, 100, 30
#: Fewest rows with a noise level of their own, and as a fraction of the record; the least squared
#: change of the mean logarithm at a change of the level, in its variances and over ln n; and the
#: largest number of changes.
_MIN_LEVEL_ROWS, _MIN_LEVEL_FRACTION, _MIN_LEVEL_GAIN, _MAX_LEVEL_CHANGES = 30, 0.08, 3.0, 7
#: Variance of the logarithm of the absolute value of Gaussian noise, and the least difference of
#: rows relative to the root mean square.
_LOG_VARIANCE, _MIN_RELATIVE_DIFFERENCE = math.pi**2 / 8.0, 0.01


class SamplingRun(NamedTuple):
    """Consecutive rows with the same sampling interval and the same noise level.

    Attributes
    ----------
    start, stop : int
        Index of the first row, and index after the last row.
    process : int
        Index of the noise process.
    preceding_rows : int
        Number of earlier rows since the clock started.
    level : int
        Index of the noise level.
    """

    start: int
    stop: int
    process: int
    preceding_rows: int
    level: int


def find_runs(time: np.ndarray) -> tuple[SamplingRun, ...]:
    """Find the runs of rows with the same sampling interval.

    If the clock restarts, as in joint fits, a new run begins. Each noise process has one noise
    level at this stage, so both have the same index.
    """
    kinds, begins = _classify_intervals(time), np.diff(time) <= 0.0
    bounds = (np.flatnonzero((np.diff(kinds) != 0) | begins) + 1).tolist()
    found, begun = [], 0
    for first, last in itertools.pairwise([0, *bounds, len(time)]):
        begun = first if first and begins[first - 1] else begun
        found.append(SamplingRun(first, last, int(kinds[first]), first - begun, int(kinds[first])))
    return tuple(found)


def split_runs(runs: Sequence[SamplingRun], change_rows: Sequence[int]) -> tuple[SamplingRun, ...]:
    """Split runs at the rows at which the noise level changes.

    Each segment of the record has its own noise levels.
    """
    found: list[SamplingRun] = []
    levels: dict[tuple[int, int], int] = {}
    for run in runs:
        inside = [
            k for k in change_rows if run.start + _MIN_RUN_ROWS <= k <= run.stop - _MIN_RUN_ROWS
        ]
        for first, last in itertools.pairwise([run.start, *inside, run.stop]):
            segment = sum(k <= first for k in change_rows)
            level = levels.setdefault((segment, run.process), len(levels))
            found.append(
                SamplingRun(first, last, run.process, run.preceding_rows + first - run.start, level)
            )
    return tuple(found)


def count_processes(runs: Sequence[SamplingRun]) -> int:
    """Return the number of noise processes."""
    return 1 + max(run.process for run in runs)


def index_rows(runs: Sequence[SamplingRun], field: str) -> np.ndarray:
    """Return the index of the noise process, or of the noise level, for each row.

    Parameters
    ----------
    runs : sequence of SamplingRun
    field : {"process", "level"}
        Return the index of the process or of the level.
    """
    return np.repeat([getattr(run, field) for run in runs], [run.stop - run.start for run in runs])


def find_level_changes(whitened_residuals: np.ndarray, min_difference: float = 0.0) -> list[int]:
    """Find the rows at which the standard deviation of the noise changes.

    The function segments the logarithms of the absolute differences between successive rows. Misfit
    of the model near a step is either smooth or short, so it affects few of these differences. A
    change of the noise level affects all of them.

    Parameters
    ----------
    whitened_residuals : ndarray, shape (rows,)
        Whitened residuals.
    min_difference : float
        Lower bound of the absolute differences.

    Returns
    -------
    list of int
        Index of the first row of each segment except the first segment.
    """
    count, size = len(whitened_residuals), np.abs(np.diff(whitened_residuals, prepend=0.0))
    shortest = max(_MIN_LEVEL_ROWS, math.ceil(_MIN_LEVEL_FRACTION * count))
    least = _MIN_RELATIVE_DIFFERENCE * float(np.sqrt(np.mean(np.square(size)))) or 1.0
    logs = np.log(np.maximum(size, max(least, min_difference)))
    sums = np.concatenate([[0.0], np.cumsum(logs - logs.mean())])
    segments, found = [(0, count)], []
    while segments:
        first, last = segments.pop()
        at = np.arange(first + shortest, last - shortest + 1)
        if not len(at):
            continue
        apart = (sums[at] - sums[first]) / (at - first) - (sums[last] - sums[at]) / (last - at)
        gains = (at - first) * (last - at) / (last - first) * np.square(apart) / _LOG_VARIANCE
        best = int(np.argmax(gains))
        if gains[best] > _MIN_LEVEL_GAIN * math.log(count):
            found.append((float(gains[best]), int(at[best])))
            segments += [(first, int(at[best])), (int(at[best]), last)]
    rows = sorted(row for _gain, row in sorted(found, reverse=True)[:_MAX_LEVEL_CHANGES])
    squares = np.square(np.maximum(np.abs(whitened_residuals), max(least, min_difference)))
    bounds = [0, *rows, count]
    return [_refine_change(squares, *bounds[n : n + 3]) for n in range(len(rows))]


def _refine_change(squares: np.ndarray, first: int, row: int, last: int) -> int:
    """Refine the row at which the noise level changes, by the Gaussian likelihood.

    Parameters
    ----------
    squares : ndarray, shape (rows,)
        Squares of the whitened residuals.
    first, row, last : int
        First row of the segment before the change, the row that is refined, and the row after the
        last row of the segment that follows.
    """
    reach = min(_MIN_RUN_ROWS, (row - first) // 2, (last - row) // 2)
    before, after = squares[first : row - reach].mean(), squares[row + reach : last].mean()
    near = squares[row - reach : row + reach]
    costs = near * (1.0 / before - 1.0 / after) + math.log(before / after)
    return row - reach + int(np.argmin(np.concatenate([[0.0], np.cumsum(costs)])))


def _classify_intervals(time: np.ndarray) -> np.ndarray:
    """Return the class of the sampling interval of each row: 0, 1 and so on."""
    gaps = np.diff(time)
    gaps[gaps <= 0.0] = np.median(gaps)
    smooth = np.log(uniform_filter1d(gaps, min(_MEAN_ROWS, len(gaps)), mode="nearest"))
    kinds = np.rint((smooth - np.median(smooth)) / math.log(_MAX_INTERVAL_RATIO))
    kinds = np.append(kinds[:1], kinds)
    lasts = np.diff([0, *(np.flatnonzero(np.diff(kinds)) + 1), len(kinds)])
    steady = np.repeat(lasts, lasts) >= _MIN_RUN_ROWS
    names, counts = np.unique(kinds[steady], return_counts=True)
    rows = np.flatnonzero(steady & np.isin(kinds, names[counts >= _MIN_PROCESS_ROWS]))
    if not len(rows):
        return np.zeros(len(time), dtype=int)
    nearest = np.minimum(np.searchsorted(rows, np.arange(len(time))), len(rows) - 1)
    found = np.unique(kinds[rows[nearest]], return_inverse=True)[1]
    for row in (np.flatnonzero(np.diff(found)) + 1).tolist():
        at = _refine_boundary(np.log(gaps), row)
        found[min(row, at) : max(row, at)] = found[row - 1 if at > row else row]
    return np.asarray(found)


def _refine_boundary(logs: np.ndarray, row: int) -> int:
    """Refine the row at which the sampling interval changes, by least squares."""
    first, last = max(row - 1 - 2 * _MEAN_ROWS, 0), min(row - 1 + 2 * _MEAN_ROWS, len(logs))
    part = logs[first:last]
    costs = [np.var(part[:k]) * k + np.var(part[k:]) * (len(part) - k) for k in range(1, len(part))]
    return first + 2 + int(np.argmin(costs))
