"""Estimate of the remaining time of a run, based on the first finished cells."""

from __future__ import annotations

import math

#: Minimum number of timed cells, and maximum relative standard error of their mean time. The
#: remaining time is estimated only if both conditions are met, so that the estimate is correct to a
#: factor of two.
_MIN_TIMED_CELLS, _MAX_RELATIVE_STDERR = 12, 0.2


class RemainingTimeEstimator:
    """Estimate of the time needed to compute the remaining cells of a run.

    The first cells of a run are spread over the whole lattice (see
    ``order_cells_by_golden_section``), so their mean time is typical of the remaining cells.

    Parameters
    ----------
    worker_count : int
        Number of cells that are computed at the same time.
    """

    def __init__(self, worker_count: int) -> None:
        self._worker_count = worker_count
        self._count, self._sum, self._sum_of_squares = 0, 0.0, 0.0

    def record_cell_time(self, seconds: float) -> None:
        """Record the wall time of a finished cell.

        Parameters
        ----------
        seconds : float
            Wall time in s. NaN is ignored.
        """
        if not math.isnan(seconds):
            self._count += 1
            self._sum += seconds
            self._sum_of_squares += seconds * seconds

    def estimate_remaining_seconds(self, remaining_cell_count: int) -> float | None:
        """Estimate the time needed to compute the remaining cells.

        Parameters
        ----------
        remaining_cell_count : int
            Number of cells that are not finished.

        Returns
        -------
        float or None
            Time in s. The value is None if too few cells are finished, or if their times vary so
            much that the mean time is uncertain.
        """
        if self._count < _MIN_TIMED_CELLS or self._sum <= 0.0:
            return None
        mean = self._sum / self._count
        variance = max(0.0, self._sum_of_squares / self._count - mean * mean)
        if math.sqrt(variance / self._count) > _MAX_RELATIVE_STDERR * mean:
            return None
        return remaining_cell_count * mean / self._worker_count
