"""Sizes and times of drops of shear stress, with errors.

The stress around a drop is modelled by three connected lines: before, during and after the drop.
The lines meet at the times at which the drop begins and ends. For each pair of times, the lines are
fitted by least squares. The pair with the smallest sum of squares determines the drop, which is the
difference between the highest and the lowest stress. The confidence intervals of the times contain
all pairs whose sum of squares exceeds the minimum by less than a fixed multiple of the noise
variance [1]_.

References
----------
.. [1] Yao (1987), The Annals of Statistics 15, 1321-1328, for the time of a change in noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rsfstudy.analysis.drop_detection import Candidate

#: Length of each side of the fit, in windows and in durations; fewest and most samples of a side.
_SPAN, _DURATIONS, _LEAST, _MOST = 3.0, 1.0, 16, 400
#: Largest number of samples in a fit. Longer records are averaged.
_THIN = 300
#: Windows beyond the candidate in which the drop may begin or end.
_REACH = 2.0
#: Number of times in each grid for the beginning and the end, and number of grid refinements.
_GRID, _REFINED = 16, 3
#: Largest slope of the lines before and after the drop, relative to the slope of the drop.
_STEEP = 0.3
#: Largest difference between the falls of stress on both sides, relative to the drop.
_FALLS = 0.5
#: Excess of the sum of squares, in variances of the noise, at the ends of 95 % intervals: of the
#: time of a sudden change (twice -ln 0.0253), and of a parameter.
_OF_TIME, _OF_SIZE = 7.4, 3.84
#: Standard errors in half of a 95 % interval.
HALF = 1.96
#: Error of a time between two samples, relative to the sampling interval.
_BETWEEN = 0.55
#: Fewest samples next to a drop that show the stress before or after the drop.
_SHOWS_END = 3


class Drop(NamedTuple):
    """A fitted drop of stress. Errors are half widths of 95 % intervals.

    Attributes
    ----------
    begins, ends : float
        Times at which stress is highest and lowest.
    before, after : float
        Highest and lowest stress.
    begins_error, ends_error, before_error, after_error, drop_error : float
        Errors of the values above, and of the drop ``before - after``.
    residual : float
        Standard deviation of the samples around the fitted lines.
    starts_inside, stops_inside : bool
        True if the record contains no stress before the drop, or no stress after it.
    """

    begins: float
    ends: float
    before: float
    after: float
    begins_error: float
    ends_error: float
    before_error: float
    after_error: float
    drop_error: float
    residual: float
    starts_inside: bool
    stops_inside: bool


class _Lines(NamedTuple):
    """Least-squares fits of three connected lines, one for each pair of times.

    Attributes
    ----------
    pairs : ndarray, shape (pairs, 2)
        Times at which the lines meet.
    values : ndarray, shape (pairs, 4)
        Coefficients (see ``_lines``).
    inverse : ndarray, shape (pairs, 4, 4)
        Inverse of the normal matrix.
    squares : ndarray, shape (pairs,)
        Sum of squares of the residuals.
    """

    pairs: np.ndarray
    values: np.ndarray
    inverse: np.ndarray
    squares: np.ndarray

    @property
    def best(self) -> int:
        """Index of the first pair with the smallest sum of squares.

        Differences due to rounding errors are ignored.
        """
        return int(np.argmax(self.squares <= self.squares.min() * (1.0 + 1e-9)))


def fit_drop(
    time: np.ndarray,
    stress: np.ndarray,
    candidate: Candidate,
    room: tuple[float, float],
    noise: float,
) -> Drop:
    """Fit three connected lines to the stress around a drop.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)
    candidate : Candidate
    room : (float, float)
        End of the previous drop and beginning of the next drop.
    noise : float
        Standard deviation of the noise.

    Returns
    -------
    Drop
    """
    rows = _rows_around(time, candidate, room)
    every = -(-len(rows) // _THIN)
    whole = rows[: len(rows) // every * every]
    t, y = (of[whole].reshape(-1, every).mean(axis=1) for of in (time, stress))
    origin, scale = float(t[0]), float(t[-1] - t[0])
    t = (t - origin) / scale
    begins, ends = ((at - origin) / scale for at in candidate[:2])
    lines = _search(t, y, begins, ends, candidate.window / scale)
    best = lines.best
    left = float(lines.squares[best]) / max(len(t) - 6, 1)
    variance = max(left, 0.25 * noise**2 / every) * candidate.correlation**2
    excess = lines.squares - lines.squares[best]
    late = np.abs(lines.pairs[excess <= _OF_TIME * variance] - lines.pairs[best]).max(axis=0)
    sizes = lines.values[:, 0] - lines.values[:, 1]
    spread = float(np.abs(sizes[excess <= _OF_SIZE * variance] - sizes[best]).max())
    inverse = lines.inverse[best]
    variances = np.array([inverse[0, 0], inverse[1, 1], inverse[:2, :2].trace()])
    variances[2] -= 2.0 * inverse[0, 1]
    of_before, of_after, of_drop = HALF * np.sqrt(np.maximum(variance * variances, 0.0))
    begins, t1 = t0, _ = lines.pairs[best].tolist()
    (early, later), gaps = np.searchsorted(t, (t0, t1), "right"), np.diff(t)
    last = len(gaps) - 1
    gap0, gap1 = (float(gaps[min(max(at - 1, 0), last)]) for at in (early, later))
    if not ((t > t0) & (t < t1)).any():  # the drop is between two samples
        begins = float(t[max(early - 1, 0)]) + 0.5 * gap0
    return Drop(
        begins=origin + scale * begins,
        ends=origin + scale * t1,
        before=float(lines.values[best, 0]),
        after=float(lines.values[best, 1]),
        begins_error=scale * (float(late[0]) + _BETWEEN * gap0),
        ends_error=scale * (float(late[1]) + gap1),
        before_error=float(of_before + spread),
        after_error=float(of_after + spread),
        drop_error=float(of_drop + spread),
        residual=float(np.sqrt(left * every)),
        starts_inside=bool(rows[0] == 0 and (t <= t0).sum() < _SHOWS_END),
        stops_inside=bool(rows[-1] == len(time) - 1 and (t >= t1).sum() <= _SHOWS_END),
    )


def _rows_around(time: np.ndarray, candidate: Candidate, room: tuple[float, float]) -> np.ndarray:
    """Return the rows around a drop, without the rows of neighbouring drops."""
    begins, ends, window = candidate[:3]
    reach = max(_SPAN * window, _DURATIONS * (ends - begins))
    first = int(np.searchsorted(time, begins, "left"))
    last = int(np.searchsorted(time, ends, "right"))
    start = min(int(np.searchsorted(time, begins - reach)), first - _LEAST)
    stop = max(int(np.searchsorted(time, ends + reach)), last + _LEAST)
    start = max(start, first - _MOST, int(np.searchsorted(time, room[0])), 0)
    stop = min(stop, last + _MOST, int(np.searchsorted(time, room[1], "right")), len(time))
    start, stop = min(start, max(first - 2, 0)), max(stop, min(last + 2, len(time)))
    return np.arange(start, stop)


def _search(t: np.ndarray, y: np.ndarray, begins: float, ends: float, window: float) -> _Lines:
    """Search for the times at which the drop begins and ends.

    The search evaluates a grid of pairs of times. The grid is refined around the best pair several
    times.
    """
    reach = max(_REACH * window, ends - begins)
    halves = np.sort(np.concatenate([t, 0.5 * (t[1:] + t[:-1])]))
    starts = halves[(halves >= begins - reach) & (halves < ends)]
    stops = halves[(halves > begins) & (halves <= ends + reach)]
    parts: list[_Lines] = []
    for level in range(_REFINED + 1):
        pairs = np.array([(u, v) for u in _thinned(starts) for v in _thinned(stops) if u < v])
        if len(pairs):
            parts.append(_lines(t, y, pairs))
        found = parts[int(np.argmin([part.squares.min() for part in parts]))]
        best = found.pairs[found.best]
        near = [_near(halves, at, ends - begins + 2.0 * reach, level) for at in best]
        starts, stops = near
    return _Lines(*map(np.concatenate, zip(*parts, strict=True)))


def _thinned(times: np.ndarray) -> list[float]:
    """Select an evenly spaced subset of the times."""
    places = np.unique(np.linspace(0, len(times) - 1, _GRID).round().astype(int))
    return [float(times[place]) for place in places] if len(times) else []


def _near(times: np.ndarray, at: float, extent: float, level: int) -> np.ndarray:
    """Select the times near the best time for the next level of the search.

    The last levels contain the immediate neighbours of the best time.
    """
    reach = extent / _GRID * (4.0 / _GRID) ** level
    place = int(np.searchsorted(times, at))
    around = times[max(place - _GRID // 3, 0) : place + _GRID // 3 + 1]
    within = times[np.abs(times - at) <= 2.0 * reach]
    return within if level < _REFINED - 1 and len(within) > len(around) else around


def _lines(t: np.ndarray, y: np.ndarray, pairs: np.ndarray) -> _Lines:
    """Fit three connected lines for each pair of times.

    The coefficients are the stress at both times, and the slopes before and after the drop. Some
    pairs describe only a part of a longer drop, and are rejected. A pair is rejected if stress
    outside the drop falls at more than 0.3 times the rate within the drop. It is also rejected if
    the line on one side falls by half of the drop more than it would with the slope of the other
    side.
    """
    t0, t1 = pairs[:, :1], pairs[:, 1:]
    share = np.clip((t - t0) / (t1 - t0), 0.0, 1.0)
    columns = np.stack([1.0 - share, share, np.minimum(t - t0, 0.0), np.maximum(t - t1, 0.0)], -1)
    turned = columns.transpose(0, 2, 1)
    normal = turned @ columns
    # a small ridge term, because a slope is undetermined if one side has no samples
    normal += 1e-9 * np.eye(4) * len(t)
    inverse = np.linalg.inv(normal)
    centre = y.mean()
    values = (inverse @ (turned @ (y - centre))[:, :, None])[:, :, 0]
    left = y - centre - (columns @ values[:, :, None])[:, :, 0]
    squares = np.square(left).sum(axis=1)
    drop, lasts = values[:, 0] - values[:, 1], (t1 - t0)[:, 0]
    goes_on = (values[:, 2:].min(axis=1) < -_STEEP * drop / lasts) | (drop <= 0.0)
    for own, other, beside in ((2, 3, pairs[:, 0] - t[0]), (3, 2, t[-1] - pairs[:, 1])):
        fall = np.minimum(values[:, other], 0.0) - values[:, own]
        goes_on |= fall * np.maximum(beside, 0.0) > _FALLS * drop
    values[:, :2] += centre
    squares[goes_on] += 1e3 * (float(np.square(y - centre).sum()) + 1e-300)
    return _Lines(pairs, values, inverse, squares)
