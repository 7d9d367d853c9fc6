"""Selection of the part of a record with linear friction before a step."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from rsfstudy.fitting.outliers import find_kept_mask, find_quantum
from rsfstudy.fitting.record import Record
from rsfstudy.fitting.velocity_steps import RunningSums

#: Means of rows that are fitted, fewest of them on either side of a break, and fewest rows that
#: remain.
_MAX_MEANS, _MIN_SIDE_MEANS, _MIN_ROWS = 120, 6, 20
#: Gain in the sum of squares by a broken line, in variances of its residuals over ln n.
_MIN_BREAK_GAIN = 15.0
#: Departure of friction from the line of the later part that matters, in absolute terms and in
#: standard deviations of the residuals. A step of velocity by a factor of ten changes friction by
#: 0.02 or so.
_MIN_DEPARTURE, _MIN_DEPARTURE_SIGMAS = 4e-4, 4.0
#: Fraction of the rows, next to the step, from which the noise is estimated.
_NOISE_ROW_FRACTION = 0.4
#: Upper bound of the estimated correlation of successive means.
_MAX_CORRELATION = 0.98


@lru_cache(maxsize=256)
def find_linear_start(record: Record, start: float, end: float) -> float:
    """Find the start of the interval before a step in which friction varies linearly with time.

    Two conditions are tested. First, two separate lines must describe friction far better than a
    single line, after allowing for the correlation of the residuals. Second, the earlier part must
    deviate significantly from the line through the later part. If both conditions hold, the earlier
    part is discarded, and the remainder is tested again. Outliers are interpolated first.

    Parameters
    ----------
    record : Record
    start, end : float
        Times in s between which friction is tested.

    Returns
    -------
    float
        Time in s. The result is ``start`` if friction is linear throughout.
    """
    rows = np.flatnonzero((record.time >= start) & (record.time < end))
    time, friction = record.time[rows], record.columns["friction"][rows]
    kept = find_kept_mask(friction, np.zeros(len(friction)), find_quantum(friction))
    if kept is not None:
        friction = np.interp(time, time[kept], friction[kept])
    while len(time) >= max(_MIN_ROWS, 4 * _MIN_SIDE_MEANS):
        every = max(1, len(time) // _MAX_MEANS)
        used = len(time) // every * every
        of_means = (of[-used:].reshape(-1, every).mean(axis=1) for of in (time, friction))
        break_at = _find_break(*of_means)
        if break_at == 0:
            break
        first = len(time) - used + break_at * every
        time, friction = time[first:], friction[first:]
    return float(time[0]) if len(time) and len(time) < len(rows) else start


def _find_break(t: np.ndarray, friction: np.ndarray) -> int:
    """Find the row at which a split into two separate lines fits friction best.

    Returns
    -------
    int
        0 if a single line describes friction equally well.
    """
    count = len(t)
    sums = RunningSums(t - t[0], friction - friction[0], np.ones(count))
    places = np.arange(_MIN_SIDE_MEANS, count - _MIN_SIDE_MEANS + 1)
    both = sums.residual_squares(0, places) + sums.residual_squares(places, count)
    place = int(places[np.argmin(both)])
    time, moved = t - t[0], friction - friction[0]
    # the noise is estimated from the last part, because residuals of a curved part are not noise
    last = count - max(int(_NOISE_ROW_FRACTION * count), _MIN_SIDE_MEANS)
    (x0, v0), (x1, v1) = sums.fit_line(last, count), sums.fit_line(place, count)
    left = (moved - x0 - v0 * time)[last:]
    size = float(np.sqrt(left @ left / (len(left) - 2)))
    rho = float(left[1:] @ left[:-1] / max(left @ left, 1e-300))
    rho += 4.0 * (1.0 + rho) / len(left)  # the fit of the line reduces the correlation
    rho = min(max(rho, 0.0), _MAX_CORRELATION)
    gain = float(sums.residual_squares(0, count)) - float(both.min())
    departs = float(np.abs(moved[:place] - x1 - v1 * time[:place]).max())
    worth = _MIN_BREAK_GAIN * math.log(count) * size**2 * (1.0 + rho) / (1.0 - rho)
    return (
        place if gain > worth and departs > max(_MIN_DEPARTURE, _MIN_DEPARTURE_SIGMAS * size) else 0
    )
