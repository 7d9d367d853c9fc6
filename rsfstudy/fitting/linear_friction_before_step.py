"""Function that finds the interval before a step in which friction is linear in time."""

from __future__ import annotations

import math

import numpy as np

from rsfstudy.fitting.line_segmentation import CumulativeSumsForLineFits
from rsfstudy.fitting.outliers import find_non_outlier_mask, find_rounding_quantum

#: Limits for the amount of data. The first two values are the largest number of block averages of
#: friction, and the smallest number of block averages in each of two lines. The third value is the
#: smallest number of rows to test.
_MAX_FITTED_BLOCK_AVERAGES, _MIN_BLOCK_AVERAGES_BESIDE_BREAK, _MIN_ROWS_OF_LINEAR_PORTION = (
    120,
    6,
    20,
)
#: Smallest decrease in the sum of squared residuals if two lines are fitted instead of one line.
#: The decrease is divided by the residual variance and by ln n for n block averages. The residual
#: variance is increased if the residuals are correlated.
_MIN_RESIDUAL_REDUCTION_BY_SLOPE_BREAK = 15.0
#: Earlier rows are discarded only if their friction deviates from the line through the later rows
#: by more than these limits. The first limit is an absolute value, and the second limit is in
#: standard deviations of the residuals. For comparison, a tenfold velocity step changes friction by
#: about 0.02.
_MIN_FRICTION_DEPARTURE_FROM_LINE, _MIN_FRICTION_DEPARTURE_SIGMAS = 4e-4, 4.0
#: Fraction of the rows before a step from which the noise is estimated. These rows are the rows
#: closest to the step.
_FRACTION_OF_ROWS_FOR_NOISE_ESTIMATE = 0.4
#: Upper bound on the estimated correlation between successive block averages.
_MAX_CORRELATION_OF_BLOCK_AVERAGES = 0.98


def find_start_of_linear_friction(
    record_time: np.ndarray, record_friction: np.ndarray, start_time: float, end_time: float
) -> float:
    """Find the time from which friction is a linear function of time until a step.

    Rows at the beginning of the tested interval are discarded if two conditions are met. First, two
    separate lines must fit friction far better than a single line. The comparison of the two fits
    accounts for the correlation of the residuals. Second, friction in the earlier rows must differ
    noticeably from the line through the later rows. The test of both conditions is repeated with
    the remaining rows until no rows are discarded. Before the test, outliers are replaced by
    interpolated values.

    Parameters
    ----------
    record_time : ndarray, shape (rows,)
        Times of the record in s.
    record_friction : ndarray, shape (rows,)
        Recorded friction.
    start_time, end_time : float
        Start and end of the tested interval in s.

    Returns
    -------
    float
        Time in s at which the linear interval begins. The result is ``start_time`` if friction is
        linear in the whole interval.
    """
    rows = np.flatnonzero((record_time >= start_time) & (record_time < end_time))
    time, friction = record_time[rows], record_friction[rows]
    kept = find_non_outlier_mask(friction, np.zeros(len(friction)), find_rounding_quantum(friction))
    if kept is not None:
        friction = np.interp(time, time[kept], friction[kept])
    while len(time) >= max(_MIN_ROWS_OF_LINEAR_PORTION, 4 * _MIN_BLOCK_AVERAGES_BESIDE_BREAK):
        every = max(1, len(time) // _MAX_FITTED_BLOCK_AVERAGES)
        used = len(time) // every * every
        of_means = (of[-used:].reshape(-1, every).mean(axis=1) for of in (time, friction))
        break_at = _find_slope_break(*of_means)
        if break_at == 0:
            break
        first = len(time) - used + break_at * every
        time, friction = time[first:], friction[first:]
    return float(time[0]) if len(time) and len(time) < len(rows) else start_time


def _find_slope_break(row_times: np.ndarray, friction: np.ndarray) -> int:
    """Fit two lines to friction, and find the row at which the second line should begin.

    Returns
    -------
    int
        Index of the row at which the second line begins, or 0 if a single line is sufficient.
    """
    count = len(row_times)
    sums = CumulativeSumsForLineFits(
        row_times - row_times[0], friction - friction[0], np.ones(count)
    )
    places = np.arange(
        _MIN_BLOCK_AVERAGES_BESIDE_BREAK, count - _MIN_BLOCK_AVERAGES_BESIDE_BREAK + 1
    )
    both = sums.compute_line_residual_squares(0, places) + sums.compute_line_residual_squares(
        places, count
    )
    place = int(places[np.argmin(both)])
    time, moved = row_times - row_times[0], friction - friction[0]
    # Curvature in the earlier rows is not noise, so the noise is estimated from the last rows.
    last = count - max(
        int(_FRACTION_OF_ROWS_FOR_NOISE_ESTIMATE * count), _MIN_BLOCK_AVERAGES_BESIDE_BREAK
    )
    (x0, v0), (x1, v1) = sums.fit_line(last, count), sums.fit_line(place, count)
    left = (moved - x0 - v0 * time)[last:]
    size = float(np.sqrt(left @ left / (len(left) - 2)))
    rho = float(left[1:] @ left[:-1] / max(left @ left, 1e-300))
    # Subtracting the fitted line reduces the estimated correlation.
    rho += 4.0 * (1.0 + rho) / len(left)
    rho = min(max(rho, 0.0), _MAX_CORRELATION_OF_BLOCK_AVERAGES)
    gain = float(sums.compute_line_residual_squares(0, count)) - float(both.min())
    departs = float(np.abs(moved[:place] - x1 - v1 * time[:place]).max())
    worth = (
        _MIN_RESIDUAL_REDUCTION_BY_SLOPE_BREAK
        * math.log(count)
        * size**2
        * (1.0 + rho)
        / (1.0 - rho)
    )
    return (
        place
        if gain > worth
        and departs > max(_MIN_FRICTION_DEPARTURE_FROM_LINE, _MIN_FRICTION_DEPARTURE_SIGMAS * size)
        else 0
    )
