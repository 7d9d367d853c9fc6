"""Noise correlation due to averaging by a data logger."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cholesky_banded, solve_banded

#: The first value is added to the diagonal of the correlation matrix, so that frequencies without
#: noise do not receive an infinite weight in the fit. The second value is the largest number of
#: rows within an averaging time.
_UNAVERAGED_NOISE_VARIANCE_FRACTION, MAX_ROWS_PER_AVERAGING_TIME = 0.002, 200


class NoiseCorrelationFromAveraging:
    r"""Correlation matrix of the noise in rows whose averaging times overlap.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Times in s. A row whose time is not later than the time of the preceding row begins a new
        window. Rows of different windows are not correlated.
    averaging_time : float
        Averaging time in s.

    Attributes
    ----------
    cholesky_factor : ndarray
        Lower Cholesky factor of the correlation matrix, in banded form.
    row_count_per_independent_sample : float
        Number of correlated rows that contain as much information as one independent row.

    Notes
    -----
    If white noise is averaged over a time :math:`T`, the correlation of the rows i and j is
    :math:`\max(1 - |t_i - t_j|/T, 0)`.
    """

    def __init__(self, time: np.ndarray, averaging_time: float) -> None:
        clock = np.concatenate([[0], np.cumsum(np.diff(time) <= 0.0)])
        band = [np.full(len(time), 1.0 + _UNAVERAGED_NOISE_VARIANCE_FRACTION)]
        for lag in range(1, min(MAX_ROWS_PER_AVERAGING_TIME, len(time) - 1)):
            apart = np.abs(time[lag:] - time[:-lag]) / averaging_time
            overlap = np.where(clock[lag:] == clock[:-lag], np.maximum(1.0 - apart, 0.0), 0.0)
            if not overlap.any():
                break
            band.append(np.append(overlap, np.zeros(lag)))
        self.cholesky_factor = cholesky_banded(np.array(band), lower=True)
        self.row_count_per_independent_sample = float(1.0 + 2.0 * np.sum(band[1:]) / len(time))

    def whiten_columns(self, sample_columns: np.ndarray) -> np.ndarray:
        """Remove the noise correlation from the columns of an array.

        Parameters
        ----------
        sample_columns : ndarray, shape (rows, columns)
            Array with correlated rows.

        Returns
        -------
        ndarray, shape (rows, columns)
            Product of the inverse of the Cholesky factor and the array.
        """
        if not sample_columns.size:
            return sample_columns
        return np.asarray(
            solve_banded((len(self.cholesky_factor) - 1, 0), self.cholesky_factor, sample_columns)
        )

    @property
    def correlation_log_determinant(self) -> float:
        """Logarithm of the determinant of the correlation matrix."""
        return float(2.0 * np.sum(np.log(self.cholesky_factor[0])))


def apply_running_mean(
    time: np.ndarray,
    sample_columns: np.ndarray,
    averaging_time: float,
    window_centre_offset: float = 0.0,
) -> np.ndarray:
    """Compute the running mean of each column of an array.

    Between the rows, the function interpolates the columns linearly. Before the first row and after
    the last row, the columns are assumed to be constant.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Times in s, in increasing order.
    sample_columns : ndarray, shape (rows, columns)
        Array whose columns are averaged.
    averaging_time : float
        Averaging time in s.
    window_centre_offset : float, default: 0.0
        Time in s from each row to the centre of its averaging interval.

    Returns
    -------
    ndarray, shape (rows, columns)
        Running mean of each column.
    """
    at = np.concatenate([[time[0] - averaging_time], time, [time[-1] + averaging_time]])
    padded = np.concatenate([sample_columns[:1], sample_columns, sample_columns[-1:]])
    pieces = 0.5 * np.diff(at)[:, None] * (padded[1:] + padded[:-1])
    sums = np.concatenate([np.zeros((1, sample_columns.shape[1])), np.cumsum(pieces, axis=0)])
    ends = [
        np.column_stack([np.interp(time + side, at, column) for column in sums.T])
        for side in (
            window_centre_offset + 0.5 * averaging_time,
            window_centre_offset - 0.5 * averaging_time,
        )
    ]
    return np.asarray((ends[0] - ends[1]) / averaging_time)
