r"""Piecewise linear segmentation of the rows of a record.

Let :math:`S(i, j)` be the sum of squared residuals of the line fitted to the rows i to j. Binary
segmentation [1]_ [2]_ splits the rows at the row k that minimises :math:`S(i, k) + S(k, j)`. A
split is accepted if it reduces the sum of squares by more than :math:`12 \ln(j - i)` times the
noise variance. This threshold is far larger than the reduction expected by chance.

If a range of rows contains several changes in slope, the first split is biased [3]_ and often lies
a few rows away from the nearest change. If the first split misses the change by fewer than 5 rows,
later splits cannot correct it, because a segment must have at least 5 rows. A false segment with an
intermediate slope then spans the change. For this reason, the boundaries are refined afterwards.
Each boundary is moved between its two neighbouring boundaries to the row with the smallest sum of
squares. Two neighbouring boundaries are replaced by a single boundary if three lines do not fit
significantly better than two lines.

References
----------
.. [1] Scott and Knott (1974), Biometrics 30, 507-512.
.. [2] Bai and Perron (1998), Econometrica 66, 47-78.
.. [3] Bai (1997), Econometric Theory 13, 315-352.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

#: Smallest number of rows of a segment.
MIN_SEGMENT_ROWS = 5
#: Smallest reduction of the sum of squares by a split, divided by the noise variance and by ln n
#: for n rows.
_MIN_SQUARES_REDUCTION_BY_SEGMENT_SPLIT = 12.0
#: Largest increase of the sum of squares by the replacement of two boundaries by a single boundary,
#: divided by the noise variance and by ln n for n rows.
_MAX_SQUARES_INCREASE_BY_REPLACEMENT = 4.0
#: Largest mean square of the residuals with which a boundary moves, relative to the noise variance.
_MAX_RESIDUAL_VARIANCE_RATIO = 4.0
#: Largest number of passes over all boundaries in a refinement.
_MAX_REFINEMENT_PASSES = 20
#: Rounding error of a sum of squared residuals, divided by the sum of squares about the mean and by
#: the resolution of floating-point numbers.
_ROUNDING_ERROR_OF_RESIDUAL_SQUARES = 10.0

#: Function that returns the sum of squared residuals of the rows i to j.
ResidualSquaresFunction = Callable[[np.ndarray | int, np.ndarray | int], np.ndarray]
#: Straight line of displacement against time, as the displacement at time 0 and the velocity.
InterceptAndSlope = tuple[float, float]


class CumulativeSumsForLineFits:
    """Cumulative sums that are used to fit lines to any range of rows.

    The computing time of a fit does not depend on the number of rows in the range. In all methods,
    a range includes ``start_row`` and excludes ``stop_row``. If ``start_row`` or ``stop_row`` is an
    array, the methods return one result for each range.

    Parameters
    ----------
    time, displacement : ndarray, shape (rows,)
        Independent and dependent variable.
    weights : ndarray, shape (rows,)
        Weights of the squared residuals.
    """

    def __init__(self, time: np.ndarray, displacement: np.ndarray, weights: np.ndarray) -> None:
        columns = weights * np.array(
            [
                np.ones(len(time)),
                time,
                displacement,
                time * time,
                time * displacement,
                displacement * displacement,
            ]
        )
        self.cumulative_sums = np.concatenate([np.zeros((1, 6)), np.cumsum(columns.T, axis=0)])

    def compute_weighted_moments(
        self, start_row: np.ndarray | int, stop_row: np.ndarray | int
    ) -> tuple[np.ndarray, ...]:
        """Compute the weighted moments of a range of rows.

        Parameters
        ----------
        start_row, stop_row : int or ndarray of int
            First row of the range, and row after the last row of the range.

        Returns
        -------
        tuple of ndarray
            The mean of t, the mean of x, and the weighted sums of dt dt, dt dx and dx dx over the
            rows. Here, dt and dx are the deviations of t and x from their means.
        """
        n, st, sx, stt, stx, sxx = (
            self.cumulative_sums[stop_row] - self.cumulative_sums[start_row]
        ).T
        mt, mx = st / n, sx / n
        return mt, mx, stt - st * mt, stx - st * mx, sxx - sx * mx

    def compute_line_residual_squares(
        self, start_row: np.ndarray | int, stop_row: np.ndarray | int
    ) -> np.ndarray:
        """Compute the sum of squared residuals of a line fit.

        Parameters
        ----------
        start_row, stop_row : int or ndarray of int
            First row of the range, and row after the last row of the range.

        Returns
        -------
        ndarray
            Weighted sum of squared residuals of each range.
        """
        _mt, _mx, tt, tx, xx = self.compute_weighted_moments(start_row, stop_row)
        return np.asarray(np.maximum(xx - tx * tx / tt, 0.0))

    def compute_squares_about_mean(
        self, start_row: np.ndarray | int, stop_row: np.ndarray | int
    ) -> np.ndarray:
        """Compute the sum of squared deviations from the mean.

        Parameters
        ----------
        start_row, stop_row : int or ndarray of int
            First row of the range, and row after the last row of the range.

        Returns
        -------
        ndarray
            Weighted sum of squared deviations of each range.
        """
        return np.asarray(np.maximum(self.compute_weighted_moments(start_row, stop_row)[4], 0.0))

    def fit_line(self, start_row: int, stop_row: int) -> InterceptAndSlope:
        """Fit a line to a range of rows.

        Parameters
        ----------
        start_row, stop_row : int
            First row of the range, and row after the last row of the range.

        Returns
        -------
        intercept : float
            Value of x at t = 0.
        slope : float
            Slope of the line.
        """
        mt, mx, tt, tx, _xx = self.compute_weighted_moments(start_row, stop_row)
        return float(mx - tx / tt * mt), float(tx / tt)


def split_rows_into_segments(
    residual_squares_function: ResidualSquaresFunction,
    first_row: int,
    stop_row: int,
    variance_of_noise: float,
) -> set[int]:
    """Split rows into segments by binary segmentation.

    The function splits a segment if the split reduces the sum of squared residuals by far more than
    expected by chance.

    Parameters
    ----------
    residual_squares_function : callable
        Function that returns the sum of squared residuals of the rows i to j.
    first_row, stop_row : int
        First row of the range to split, and row after the last row of the range.
    variance_of_noise : float
        Variance of the noise.

    Returns
    -------
    set of int
        First row of each segment, and the row ``stop_row`` after the last segment.
    """
    open_parts, found = [(first_row, stop_row)], {first_row, stop_row}
    while open_parts:
        i, j = open_parts.pop()
        at = np.arange(i + MIN_SEGMENT_ROWS, j - MIN_SEGMENT_ROWS + 1)
        if not len(at):
            continue
        both = residual_squares_function(i, at) + residual_squares_function(at, j)
        best = int(at[np.argmin(both)])
        if (
            residual_squares_function(i, j) - both.min()
            > _MIN_SQUARES_REDUCTION_BY_SEGMENT_SPLIT * math.log(j - i) * variance_of_noise
        ):
            found.add(best)
            open_parts += [(i, best), (best, j)]
    return found


class SegmentBoundaryRefinement:
    """Refinement of the boundaries between segments.

    Parameters
    ----------
    time, displacement : ndarray, shape (rows,)
        Independent and dependent variable.
    weights : ndarray, shape (rows,)
        Weights of the squared residuals.
    variance_of_noise : float
        Variance of the noise of rows with unit weight.
    max_rows : int
        Largest number of rows on either side of a boundary from which the boundary is found.
    """

    def __init__(
        self,
        time: np.ndarray,
        displacement: np.ndarray,
        weights: np.ndarray,
        variance_of_noise: float,
        max_rows: int,
    ) -> None:
        self.time, self.displacement = time, displacement
        self.weights, self.variance_of_noise = weights, variance_of_noise
        self.max_rows = max_rows

    def refine(self, boundaries: list[int]) -> list[int]:
        """Move the boundaries, and replace pairs of boundaries that span a single change.

        Parameters
        ----------
        boundaries : list of int
            First row of each segment, and the row after the last segment.

        Returns
        -------
        list of int
            Refined boundaries. The number of boundaries does not increase.
        """
        found = list(boundaries)
        for _pass in range(_MAX_REFINEMENT_PASSES):
            previous, n = list(found), 1
            while n < len(found) - 1:
                if n < len(found) - 2:
                    single = self._find_single_boundary(*found[n - 1 : n + 3])
                    if single is not None:
                        found[n : n + 2] = [single]
                        n = max(n - 1, 1)
                        continue
                found[n] = self._find_best_boundary(*found[n - 1 : n + 2])
                n += 1
            if found == previous:
                break
        return found

    def fit_line(self, start_row: int, stop_row: int) -> InterceptAndSlope:
        """Fit a line to a range of rows.

        Parameters
        ----------
        start_row, stop_row : int
            First row of the range, and row after the last row of the range.

        Returns
        -------
        intercept : float
            Displacement at time 0.
        slope : float
            Slope of the line.
        """
        origin, line = self.time[start_row], self._sum(start_row, stop_row)
        level, slope = line.fit_line(0, stop_row - start_row)
        return float(self.displacement[start_row] + level - slope * origin), slope

    def fit_adjacent_lines(
        self, start_row: int, boundary: int, stop_row: int
    ) -> tuple[InterceptAndSlope, InterceptAndSlope]:
        """Fit one line on each side of a boundary, using at most ``max_rows`` rows per line.

        Parameters
        ----------
        start_row, boundary, stop_row : int
            First row of the first segment, first row of the second segment, and row after the
            second segment.

        Returns
        -------
        before, after : tuple of (float, float)
            Intercept and slope of each line.
        """
        i, j = self._limit_rows(start_row, boundary, boundary, stop_row)
        return self.fit_line(i, boundary), self.fit_line(boundary, j)

    def _limit_rows(
        self, start_row: int, first_boundary: int, last_boundary: int, stop_row: int
    ) -> tuple[int, int]:
        """Limit a range to ``max_rows`` rows before the first and after the last boundary."""
        return (
            max(start_row, first_boundary - self.max_rows),
            min(stop_row, last_boundary + self.max_rows),
        )

    def _sum(self, start_row: int, stop_row: int) -> CumulativeSumsForLineFits:
        """Return the cumulative sums of a range of rows, relative to its first row.

        Cumulative sums over a short range have smaller rounding errors than differences between
        cumulative sums over all rows.
        """
        rows = slice(start_row, stop_row)
        return CumulativeSumsForLineFits(
            self.time[rows] - self.time[start_row],
            self.displacement[rows] - self.displacement[start_row],
            self.weights[rows],
        )

    def _find_best_boundary(self, start_row: int, boundary: int, stop_row: int) -> int:
        """Fit two lines, and return the boundary with the smallest sum of squares.

        If the residuals of the best two lines are much larger than the noise, the boundary is not
        moved. In this case, slow deviations from the lines, such as periodic errors of a drive
        screw, dominate the sum of squares. The boundary with the smallest sum may then be far from
        the change in slope.
        """
        i, j = self._limit_rows(start_row, boundary, boundary, stop_row)
        at, sums = np.arange(MIN_SEGMENT_ROWS, j - i - MIN_SEGMENT_ROWS + 1), self._sum(i, j)
        squares = _compute_squares_of_two_lines(sums, at, j - i)
        best = int(np.argmin(squares))
        largest = _MAX_RESIDUAL_VARIANCE_RATIO * self.variance_of_noise * (j - i)
        if squares[best] > largest + _compute_rounding_error(sums, j - i):
            return boundary
        return i + int(at[best])

    def _find_single_boundary(
        self, start_row: int, first_boundary: int, second_boundary: int, stop_row: int
    ) -> int | None:
        """Find a single boundary that can replace two boundaries.

        Boundaries that are more than ``max_rows`` apart are not replaced.

        Returns
        -------
        int or None
            First row after the boundary, or None if the two boundaries are not replaced.
        """
        if second_boundary - first_boundary > self.max_rows:
            return None
        i, j = self._limit_rows(start_row, first_boundary, second_boundary, stop_row)
        sums, count, first, second = self._sum(i, j), j - i, first_boundary - i, second_boundary - i
        at = np.arange(MIN_SEGMENT_ROWS, count - MIN_SEGMENT_ROWS + 1)
        two_lines = _compute_squares_of_two_lines(sums, at, count)
        three_lines = sums.compute_line_residual_squares(
            np.array([0, first, second]), np.array([first, second, count])
        ).sum()
        variance = max(self.variance_of_noise, float(three_lines) / count)
        rounding = _compute_rounding_error(sums, count)
        allowed = _MAX_SQUARES_INCREASE_BY_REPLACEMENT * math.log(count) * variance + rounding
        best = int(np.argmin(two_lines))
        return i + int(at[best]) if two_lines[best] - three_lines <= allowed else None


def _compute_squares_of_two_lines(
    sums: CumulativeSumsForLineFits, boundaries: np.ndarray, stop_row: int
) -> np.ndarray:
    """Compute the sum of squared residuals of two lines for each possible boundary."""
    return np.asarray(
        sums.compute_line_residual_squares(0, boundaries)
        + sums.compute_line_residual_squares(boundaries, stop_row)
    )


def _compute_rounding_error(sums: CumulativeSumsForLineFits, stop_row: int) -> float:
    """Return the rounding error of the sum of squared residuals of all rows."""
    squares = float(sums.compute_squares_about_mean(0, stop_row))
    return float(_ROUNDING_ERROR_OF_RESIDUAL_SQUARES * np.finfo(float).eps * squares)
