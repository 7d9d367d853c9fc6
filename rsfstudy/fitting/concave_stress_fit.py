"""Functions that measure the highest stress before a drop and the lowest stress after a drop.

The shear stress of a spring-slider increases during loading. Slip before the event reduces the rate
of increase, until the stress reaches a maximum and decreases. Therefore, stress is a concave
function of time until the middle of the drop. Similarly, stress is a convex function of time after
the middle of the drop. The function ``measure_stress_extrema`` fits a concave function and a convex
function to the samples by least squares [1]_. The highest and the lowest stress are the maximum of
the concave function and the minimum of the convex function. The fit has no smoothing parameter, so
it describes a sudden drop after linear loading as well as a gradual maximum of stress.

A concave piecewise linear function with nodes at all samples has as many parameters as samples, but
the constraint makes the slope change at only a few nodes. The standard errors are computed from a
linear least-squares fit with only these nodes. These standard errors exceed the actual standard
deviation by up to a factor of two, because the constraint also reduces the variance.

References
----------
.. [1] Hildreth (1954), Journal of the American Statistical Association 49, 598-619.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from rsfstudy.fitting.stress_drop_detection import StressDropCandidate
from rsfstudy.fitting.three_line_stress_drop_fit import (
    HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS,
    MIN_SAMPLES_BESIDE_DROP,
    FittedStressDrop,
)

#: Number of samples that are averaged into one row, relative to the number of samples between the
#: row and the corner at which the drop begins or ends.
_BLOCK_SIZE_OVER_DISTANCE = 0.15
#: The number of samples on one side of a drop is halved only if at least this number remains.
_MIN_SIDE_SAMPLES = 16
#: A concave function does not describe the stress if the mean square of the residuals of the rows
#: exceeds the variance of the noise by more than this factor.
_MAX_RESIDUAL_VARIANCE_RATIO = 4.0
#: Numbers of samples in a block for the estimate of correlated noise. The last length is used only
#: for standard errors, because the means of long blocks may contain the curvature of stress.
_NOISE_BLOCK_SIZES = (1, 8, 32)
#: Tolerance of times relative to the mean sampling interval.
_TIME_TOLERANCE = 1e-6
#: Smallest number of blocks for the estimate of correlated noise.
_MIN_NOISE_BLOCKS = 8
#: Smallest significant change of slope in standard errors.
_MIN_SLOPE_CHANGE_IN_STDERRS = 2.0
#: If stress decreases throughout, the drop begins where the rate of decrease exceeds this fraction
#: of the fastest rate.
_START_RATE_OVER_FASTEST_RATE = 0.1
#: Smallest coefficient of a change of slope, relative to the range of stress.
_MIN_SLOPE_CHANGE = 1e-9


class _ConcaveFit(NamedTuple):
    """Concave function that was fitted to the stress before a drop.

    Parameters
    ----------
    times, row_means, weights : ndarray, shape (rows,)
        Mean times and stresses of the rows, and numbers of samples.
    values : ndarray, shape (rows,)
        Values of the concave function.
    design_matrix : ndarray, shape (rows, parameters)
        Design matrix of a linear fit with the nodes at which the slope changes.
    row_variance : float
        Mean square of the residuals of the rows, scaled to the variance of one sample. If the
        variance of the means of blocks of samples is larger, ``row_variance`` is this variance.
    residuals : ndarray, shape (samples,)
        Residuals of the samples before the drop begins.
    """

    times: np.ndarray
    row_means: np.ndarray
    weights: np.ndarray
    values: np.ndarray
    design_matrix: np.ndarray
    row_variance: float
    residuals: np.ndarray

    @property
    def scaled_residuals(self) -> np.ndarray:
        """Residuals of the samples, scaled to account for the number of fitted parameters."""
        count = len(self.residuals)
        freedom = max(count - self.design_matrix.shape[1], 1)
        return np.asarray(self.residuals * math.sqrt(count / freedom))

    def compute_maximum(self, variance: float) -> tuple[float, float, float]:
        """Compute the highest stress.

        The maximum of the concave function underestimates the stress before a sudden drop, because
        the function can follow the noise of the last samples downwards. Therefore, the function is
        also fitted without the insignificant changes of slope. Each fit gives a lower and an upper
        limit of the highest stress. The result is the midpoint of the smallest interval that
        contains both intervals.

        Parameters
        ----------
        variance : float
            Variance of the noise of one sample.

        Returns
        -------
        maximum : float
            Middle between the limits of the highest stress.
        stderr : float
            Standard error of the maximum.
        half_range : float
            Half of the difference between the limits of the highest stress.
        """
        low, high, stderr = self._find_limits_of_maximum(self.values, self.design_matrix, variance)
        columns, values = self._remove_insignificant_slope_changes(variance)
        limits = self._find_limits_of_maximum(values, columns, variance)
        low, high = min(low, limits[0]), max(high, limits[1])
        return 0.5 * (low + high), max(stderr, limits[2]), 0.5 * (high - low)

    def _remove_insignificant_slope_changes(self, variance: float) -> tuple[np.ndarray, np.ndarray]:
        """Remove insignificant slope changes, and return the design matrix and fitted values."""
        columns, root = self.design_matrix, np.sqrt(self.weights)
        while True:
            inverse = np.linalg.pinv(columns * root[:, None])
            coefficients = inverse @ (self.row_means * root)
            stderrs = np.sqrt(variance * np.square(inverse).sum(axis=1))
            ratios = coefficients[2:] - _MIN_SLOPE_CHANGE_IN_STDERRS * stderrs[2:]
            if not len(ratios) or ratios.min() >= 0.0:
                return columns, columns @ coefficients
            worst = int(np.argmin(coefficients[2:] / np.maximum(stderrs[2:], 1e-300)))
            columns = np.delete(columns, 2 + worst, axis=1)

    def _find_limits_of_maximum(
        self, values: np.ndarray, columns: np.ndarray, variance: float
    ) -> tuple[float, float, float]:
        """Return limits of the highest stress, and the standard error of the lower limit.

        Between two rows, the stress may exceed the values at both rows. Because the function is
        concave, the stress cannot exceed the extrapolated lines of the two neighbouring intervals.
        """
        row = int(np.argmax(values))
        if row == 0:  # Stress decreases throughout, so there is no maximum before the drop.
            slopes = np.diff(values) / np.diff(self.times)
            limit = min(_START_RATE_OVER_FASTEST_RATE * float(slopes[-1]), 0.0)
            row = int(np.searchsorted(-slopes, -limit, "right"))
        covariance = np.linalg.pinv(columns.T @ (columns * self.weights[:, None]))
        stderr = math.sqrt(max(variance * float(columns[row] @ covariance @ columns[row]), 0.0))
        bounds = (_bound_stress_between_rows(self.times, values, at) for at in (row - 1, row))
        return float(values[row]), max(float(values[row]), *bounds), stderr


def measure_stress_extrema(
    time: np.ndarray,
    stress: np.ndarray,
    fitted_drop: FittedStressDrop,
    candidate: StressDropCandidate,
    adjacent_drop_times: tuple[float, float],
    noise_sd: float,
) -> tuple[FittedStressDrop, np.ndarray]:
    """Replace the start and end stresses of a drop by the highest and lowest stress.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)
        Times and shear stresses of the samples, in any units.
    fitted_drop : FittedStressDrop
        Fit of three straight lines to the drop. If the record has too few samples on one side of
        the drop, the stress on this side is not replaced.
    candidate : StressDropCandidate
        Detected drop.
    adjacent_drop_times : (float, float)
        End of the previous drop, and start of the next drop.
    noise_sd : float
        Standard deviation of the noise.

    Returns
    -------
    drop : FittedStressDrop
        Fitted drop with the highest stress before the drop, the lowest stress after the drop, and
        their errors.
    residuals : ndarray
        Residuals of the samples before and after the drop, scaled to the variance of the noise. The
        array is empty if the record has too few samples on both sides.
    """
    start, end = fitted_drop.start_time, fitted_drop.end_time
    correlation = candidate.stderr_factor_of_correlated_noise
    middle, (previous, following) = 0.5 * (start + end), adjacent_drop_times
    fits = (
        _fit_longest_concave_part(time, stress, (previous, start, middle)),
        _fit_longest_concave_part(-time[::-1], -stress[::-1], (-following, -end, -middle)),
    )
    known = [fit for fit in fits if fit is not None]
    if not known:
        return fitted_drop, np.empty(0)
    residuals = np.concatenate([fit.scaled_residuals for fit in known])
    residual_variance = float(np.square(residuals).mean())
    variance = max(residual_variance, 0.25 * noise_sd**2) * correlation**2
    stresses = [fitted_drop.stress_before, -fitted_drop.stress_after]
    stderrs, half_ranges = [math.nan] * 2, [math.nan] * 2
    for side, fit in enumerate(fits):
        if fit is not None:
            stresses[side], stderrs[side], half_ranges[side] = fit.compute_maximum(
                max(variance, fit.row_variance)
            )
    before, after = (
        HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS * stderr + half_range
        for stderr, half_range in zip(stderrs, half_ranges, strict=True)
    )
    both = HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS * math.hypot(*stderrs) + sum(half_ranges)
    drop = fitted_drop._replace(
        stress_before=stresses[0],
        stress_after=-stresses[1],
        stress_before_error=before if fits[0] else fitted_drop.stress_before_error,
        stress_after_error=after if fits[1] else fitted_drop.stress_after_error,
        stress_drop_error=both if len(known) == 2 else fitted_drop.stress_drop_error,
    )
    return drop, residuals


def _fit_longest_concave_part(
    time: np.ndarray, stress: np.ndarray, limits: tuple[float, float, float]
) -> _ConcaveFit | None:
    """Fit a concave function to the longest range of samples that it can describe.

    The initial range of samples begins midway between the previous drop and this drop, and ends at
    the middle of this drop. The number of samples before the drop is halved until a concave
    function describes these samples within the noise.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)
        Times and shear stresses of the samples.
    limits : (float, float, float)
        End of the previous drop, and start and middle of this drop.

    Returns
    -------
    _ConcaveFit or None
        Fit, or None if there are too few samples before the drop or the fit does not converge.
    """
    previous, start, middle = limits
    # The limits may coincide with samples, so the rounding of times must not decide.
    tolerance = _TIME_TOLERANCE * (time[-1] - time[0]) / len(time)
    earliest = 0.5 * (previous + start) - tolerance
    first = int(np.searchsorted(time, max(earliest, time[0])))
    corner, stop = (int(np.searchsorted(time, at + tolerance)) for at in (start, middle))
    stop = min(max(stop, corner + 1), len(time))
    count = corner - first
    if count < MIN_SAMPLES_BESIDE_DROP:
        return None
    while True:
        part = slice(corner - count, stop)
        fit = _fit_concave_function(time[part], stress[part], count)
        if fit is None:
            return None
        variances = _estimate_noise_variances(stress[part][:count])
        limit = _MAX_RESIDUAL_VARIANCE_RATIO * max(variances[:-1])
        if count < 2 * _MIN_SIDE_SAMPLES or fit.row_variance <= limit:
            return fit._replace(row_variance=max(fit.row_variance, *variances))
        count //= 2


def _estimate_noise_variances(stress: np.ndarray) -> list[float]:
    """Estimate the variance of the noise from second differences.

    The second differences remove the stress increase due to a constant loading rate. If the noise
    is correlated, the means of blocks of samples have a larger variance.

    Returns
    -------
    list of float
        Variances of the means of blocks of 1, 8 and 32 samples, multiplied by the number of samples
        in a block. The variance is 0 if there are too few blocks.
    """
    variances = []
    for length in _NOISE_BLOCK_SIZES:
        means = stress[: len(stress) // length * length].reshape(-1, length).mean(axis=1)
        enough = len(means) >= _MIN_NOISE_BLOCKS
        # The variance of the second differences of white noise is six times the noise variance.
        squares = np.square(np.diff(means, 2)).mean() / 6.0 if enough else 0.0
        variances.append(length * float(squares))
    return variances


def _fit_concave_function(time: np.ndarray, stress: np.ndarray, corner: int) -> _ConcaveFit | None:
    """Fit a concave function to the samples before the middle of a drop.

    Samples are averaged in blocks whose length increases with the distance from the corner.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)
        Times and shear stresses of the samples.
    corner : int
        Index of the first sample after the beginning of the drop.

    Returns
    -------
    _ConcaveFit or None
        Fit, or None if the algorithm does not converge.
    """
    edges = np.unique(
        np.concatenate(
            [corner - _build_block_edges(corner), corner + _build_block_edges(len(time) - corner)]
        )
    )
    weights = np.diff(edges).astype(float)
    t, y = (np.add.reduceat(of, edges[:-1]) / weights for of in (time, stress))
    scaled = (t - t[0]) / (t[-1] - t[0])
    centre, size = float(y.mean()), float(np.ptp(y)) or 1.0
    bends = -np.maximum(scaled[:, None] - scaled[None, 1:-1], 0.0)
    one, root = np.ones_like(scaled), np.sqrt(weights)
    # The nonnegative least-squares algorithm requires two columns for a coefficient of any sign.
    columns = np.column_stack([one, -one, scaled, -scaled, bends])
    try:
        coefficients, norm = nnls(
            columns * root[:, None], (y - centre) / size * root, maxiter=100 * columns.shape[1]
        )
    except RuntimeError:  # The number of iterations exceeds the maximum.
        return None
    values = centre + size * (columns @ coefficients)
    active = np.flatnonzero(coefficients[4:] > _MIN_SLOPE_CHANGE)
    return _ConcaveFit(
        times=t,
        row_means=y,
        weights=weights,
        values=values,
        design_matrix=np.column_stack([one, scaled, bends[:, active]]),
        row_variance=float(norm * size) ** 2 / max(len(t) - len(active) - 2, 1),
        residuals=(stress - np.interp(time, t, values))[:corner],
    )


def _build_block_edges(count: int) -> np.ndarray:
    """Return block edges whose spacing is proportional to the distance from the corner."""
    edges = [0]
    while edges[-1] < count:
        length = max(int(_BLOCK_SIZE_OVER_DISTANCE * edges[-1]), 1)
        edges.append(min(edges[-1] + length, count))
    return np.array(edges)


def _bound_stress_between_rows(times: np.ndarray, values: np.ndarray, row: int) -> float:
    """Return an upper bound on a concave function between a row and the next row."""
    if not 0 < row < len(times) - 1:
        return -math.inf
    slopes = np.diff(values) / np.diff(times)
    at, rise = float(times[row + 1] - times[row]), float(slopes[row - 1])
    if row + 1 < len(slopes):
        fall = float(slopes[row + 1])
        meeting = (float(values[row + 1] - values[row]) - fall * at) / max(rise - fall, 1e-300)
        at = min(max(meeting, 0.0), at)
    return float(values[row]) + rise * at
