"""Functions that detect outliers and rounded values in a record."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter, rank_filter

#: Number of neighbours on each side of a row for computing the median of the neighbours, and number
#: of rows per block for estimating the local standard deviation.
_NEIGHBOURS_PER_SIDE_FOR_MEDIAN, _ROWS_PER_RESIDUAL_SCALE_BLOCK = 3, 100
#: Smallest deviation of an outlier from the median of its neighbours. The first limit is in
#: standard deviations. The second limit is relative to the deviation of the model friction from the
#: median of its neighbours. Because of the second limit, a misfit at a peak of the model is not an
#: outlier.
_OUTLIER_SIGMAS, _MIN_OUTLIER_OVER_MODEL_DEPARTURE = 6.0, 2.0
#: Ratio of the standard deviation to the median absolute deviation for Gaussian noise.
_STANDARD_DEVIATION_PER_MAD = 1.4826
#: Largest deviation of rounded values from multiples of the rounding unit, relative to the rounding
#: unit.
_MAX_DEVIATION_OVER_ROUNDING_QUANTUM = 0.02


def find_rounding_quantum(samples: np.ndarray) -> float:
    """Find the rounding unit of an array of values.

    Rounded values are integer multiples of the rounding unit, plus a constant offset.

    Parameters
    ----------
    samples : ndarray
        Values such as friction or displacement.

    Returns
    -------
    float
        Rounding unit, or 0 if the values are not rounded.
    """
    distinct = np.unique(samples)
    gaps = np.diff(distinct)
    gaps = gaps[gaps > 1e-12 * max(abs(distinct[0]), abs(distinct[-1]))]
    if not len(gaps):
        return 0.0
    multiples = (distinct - distinct[0]) / gaps.min()
    quantum = float(gaps.min() * multiples[-1] / max(np.rint(multiples[-1]), 1.0))
    multiples = (distinct - distinct[0]) / quantum
    return (
        quantum
        if np.abs(multiples - np.rint(multiples)).max() < _MAX_DEVIATION_OVER_ROUNDING_QUANTUM
        else 0.0
    )


def find_non_outlier_mask(
    residuals: np.ndarray, model_friction: np.ndarray, rounding_quantum: float
) -> np.ndarray | None:
    """Find the rows that are not outliers.

    The function compares each residual with the median of the neighbouring residuals. A row is an
    outlier if its residual differs from this median by more than six local standard deviations. The
    function also compares the model friction of each row with the median model friction of the
    neighbouring rows. The difference between the residual and the median residual must be more than
    twice the largest such difference of the model friction in nearby rows. This second condition is
    necessary because a misfit at a peak of the model is not an outlier.

    Parameters
    ----------
    residuals : ndarray, shape (rows,)
        Residuals of a fit.
    model_friction : ndarray, shape (rows,)
        Fitted friction.
    rounding_quantum : float
        Rounding unit of friction, or 0 if friction is not rounded.

    Returns
    -------
    ndarray of bool, shape (rows,), or None
        Mask that is False for outliers. The result is None if there are no outliers.
    """
    off = residuals - _compute_median_of_neighbours(residuals)
    blocks = np.array_split(np.abs(off), max(len(off) // _ROWS_PER_RESIDUAL_SCALE_BLOCK, 1))
    least = max(
        0.5 * rounding_quantum, 0.1 * _STANDARD_DEVIATION_PER_MAD * float(np.median(np.abs(off)))
    )
    scales = [max(_STANDARD_DEVIATION_PER_MAD * float(np.median(block)), least) for block in blocks]
    # If the noise level changes within a block, one of the neighbouring blocks has the higher noise
    # level.
    scale = np.repeat(maximum_filter(scales, 3), [len(block) for block in blocks])
    peaked = maximum_filter(
        np.abs(model_friction - _compute_median_of_neighbours(model_friction)),
        2 * _NEIGHBOURS_PER_SIDE_FOR_MEDIAN + 1,
    )
    found = np.abs(off) > np.maximum(
        _OUTLIER_SIGMAS * scale, _MIN_OUTLIER_OVER_MODEL_DEPARTURE * peaked
    )
    return ~found if found.any() and scale.min() > 0.0 else None


def _compute_median_of_neighbours(samples: np.ndarray) -> np.ndarray:
    """Compute the median of the neighbours of each row, excluding the row itself."""
    around = np.ones(2 * _NEIGHBOURS_PER_SIDE_FOR_MEDIAN + 1, dtype=bool)
    around[_NEIGHBOURS_PER_SIDE_FOR_MEDIAN] = False
    lower, upper = (
        rank_filter(samples, rank, footprint=around, mode="mirror")
        for rank in (_NEIGHBOURS_PER_SIDE_FOR_MEDIAN - 1, _NEIGHBOURS_PER_SIDE_FOR_MEDIAN)
    )
    return np.asarray(0.5 * (lower + upper))
