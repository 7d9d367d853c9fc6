"""Function that reduces long curves to the pixel resolution of a plot.

A record may have millions of rows, but a plot has only about a thousand pixels. The functions keep
the minimum and the maximum of the curve in each column of pixels, so that spikes and stress drops
remain visible.
"""

from __future__ import annotations

import numpy as np


def thin_curve_to_pixels(
    x: np.ndarray, y: np.ndarray, x_limits: tuple[float, float], pixel_count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Reduce a curve to the minimum and the maximum in each pixel.

    Parameters
    ----------
    x : ndarray, shape (rows,)
        Horizontal coordinates. If a coordinate is smaller than an earlier coordinate, for example
        because of noise, the row belongs to the pixel of the largest earlier coordinate.
    y : ndarray, shape (rows,)
        Vertical coordinates without NaN.
    x_limits : (float, float)
        Visible range of ``x``.
    pixel_count : int
        Number of pixels between the limits.

    Returns
    -------
    x, y : ndarray
        Points of the curve in the visible range, with one further row on both sides. The arrays
        are not reduced if there are at most two rows per pixel. Otherwise, they contain two points
        per pixel that is not empty.
    """
    ordered = np.maximum.accumulate(x)
    first, last = (
        np.searchsorted(ordered, x_limits[0]),
        np.searchsorted(ordered, x_limits[1], "right"),
    )
    rows = slice(max(int(first) - 1, 0), min(int(last) + 1, len(x)))
    x, y, ordered = x[rows], y[rows], ordered[rows]
    if len(x) <= 2 * pixel_count:
        return x, y
    edges = np.searchsorted(ordered, np.linspace(*x_limits, pixel_count + 1)[1:-1])
    starts = np.unique(np.concatenate([[0], edges[edges < len(x)]]))
    ends = np.append(starts[1:], len(x)) - 1
    lowest, highest = np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)
    rises = y[starts] <= y[ends]
    left, right = np.where(rises, lowest, highest), np.where(rises, highest, lowest)
    return np.stack([x[starts], x[ends]], axis=1).ravel(), np.stack([left, right], axis=1).ravel()
