"""Functions that find the positions at which a sampled curve crosses a level.

``find_unique_crossing`` returns the position of a crossing with lower and upper bounds. The bounds
account for the unknown shape of the curve between two samples.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

#: Minimum number of samples of a curve.
MIN_SAMPLES_FOR_CROSSING_SEARCH = 4
#: Number of intervals that are examined on each side of the interval with the crossing.
_INTERVALS_EXAMINED_BESIDE_CROSSING = 3
#: Changes in slope below this fraction of the largest slope are regarded as rounding errors.
_MIN_SLOPE_CHANGE_OVER_MAX_SLOPE = 1e-9
#: Smallest change in slope that indicates an oscillation, relative to the largest change in slope
#: and to the smallest slope of the neighbouring intervals.
_MIN_SLOPE_CHANGE_FOR_OSCILLATION = 0.1


class CrossingSearchStatus(IntEnum):
    """Outcome of the search for a level crossing.

    The integer values are stored in results files, so they must not be changed.
    """

    OK, OUT_OF_REACH, NOT_UNIQUE, UNRESOLVED, TOO_FEW_POINTS = range(5)


class LevelCrossing(NamedTuple):
    """Position of a level crossing, its bounds, and the status of the search.

    Parameters
    ----------
    position : float
        Position of the crossing.
    position_lower_bound, position_upper_bound : float
        Bounds of the position.
    search_status : CrossingSearchStatus
        Outcome of the search.
    """

    position: float
    position_lower_bound: float
    position_upper_bound: float
    search_status: CrossingSearchStatus


def find_unique_crossing(x: np.ndarray, y: np.ndarray, level: float) -> LevelCrossing:
    r"""Find the position at which a sampled curve reaches a level.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Samples, with x in ascending order.
    level : float
        Level that the curve must cross.

    Returns
    -------
    LevelCrossing
        The position and the bounds are NaN unless the samples cross the level exactly once. The
        status is ``UNRESOLVED`` if the curve could oscillate between two samples and thereby reach
        the level in another interval.

    Notes
    -----
    The bounds allow for curves that differ from the straight chord between two samples. If the
    slope changes by :math:`T` in total within an interval of width :math:`h`, the distance between
    the curve and the chord at a distance :math:`u` from the first sample of the interval is at most

    .. math:: \frac{T u (h - u)}{h}.

    :math:`T` is estimated by the change in slope from the previous chord to the next chord. The
    estimate is exact for a single kink. For a parabola, the estimate is twice the true value. In
    the first and the last interval, the kink may also be located next to the end of the curve. If
    the kink is next to the end of the curve, the curve follows the extrapolated chord of the
    neighbouring interval.

    If the slope does not vary monotonically over the neighbouring intervals, changes in slope with
    opposite signs partly cancel. In this case, the largest :math:`T` of the neighbouring intervals
    is doubled and used for all intervals. If the changes in slope alternate in sign, the samples
    may hide an oscillation, and the bounds enclose at least the whole interval.
    """
    if x.size < MIN_SAMPLES_FOR_CROSSING_SEARCH:
        return _build_result_without_crossing(CrossingSearchStatus.TOO_FEW_POINTS)
    places = find_all_crossings(x, y, level)
    if len(places) != 1:
        return _build_result_without_crossing(
            CrossingSearchStatus.NOT_UNIQUE if places else CrossingSearchStatus.OUT_OF_REACH
        )
    place, widths = places[0], np.diff(x)
    slopes = np.diff(y) / widths
    bracket = int(np.clip(np.searchsorted(x, place) - 1, 0, slopes.size - 1))
    near = range(
        max(bracket - _INTERVALS_EXAMINED_BESIDE_CROSSING, 0),
        min(bracket + _INTERVALS_EXAMINED_BESIDE_CROSSING + 1, slopes.size),
    )
    turns, alternates = _estimate_slope_changes(slopes, near)
    bounds, far = [place], False
    for n in near if alternates else (bracket,):
        span = _compute_crossing_bounds(slopes[n], turns[n], widths[n], level - y[n])
        if span:
            bounds += [x[n] + end for end in span]
            far |= abs(n - bracket) >= _INTERVALS_EXAMINED_BESIDE_CROSSING
    if alternates:
        bounds += [x[bracket], x[bracket + 1]]
    if bracket in (0, slopes.size - 1):
        span = _compute_crossing_bounds_at_curve_end(
            slopes, widths, level - y[bracket], is_first_interval=bracket == 0
        )
        bounds += [x[bracket] + end for end in span]
    verdict = CrossingSearchStatus.UNRESOLVED if far else CrossingSearchStatus.OK
    return LevelCrossing(place, float(min(bounds)), float(max(bounds)), verdict)


def find_all_crossings(x: np.ndarray, y: np.ndarray, level: float) -> list[float]:
    """Return all positions at which the interpolated curve reaches a level.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Samples, with x in ascending order.
    level : float
        Level that the curve must cross.

    Returns
    -------
    list of float
        Positions of the crossings.
    """
    off, curve = y - level, PchipInterpolator(x, y)
    places: list[float] = x[off == 0.0].tolist()
    # Between two samples the interpolant is monotone. At the samples, the values are used instead
    # of the interpolant to avoid rounding errors.
    known = dict(zip(x.tolist(), off.tolist(), strict=True))
    for first in np.flatnonzero(off[:-1] * off[1:] < 0.0):
        ends = x[first : first + 2].tolist()
        places.append(brentq(lambda x: known.get(x, curve(x) - level), *ends, xtol=1e-15))
    return places


def _build_result_without_crossing(crossing_status: CrossingSearchStatus) -> LevelCrossing:
    """Return a ``LevelCrossing`` that has a status but no position."""
    return LevelCrossing(math.nan, math.nan, math.nan, crossing_status)


def _estimate_slope_changes(
    slopes: np.ndarray, interval_numbers: range
) -> tuple[dict[int, float], bool]:
    """Estimate how much the slope of the curve changes within each interval.

    Parameters
    ----------
    slopes : ndarray, shape (n - 1,)
        Slopes of the chords.
    interval_numbers : range
        Indices of the intervals.

    Returns
    -------
    turns : dict of int to float
        Total change in slope within each interval, by interval index.
    alternates : bool
        True if the changes in slope alternate in sign.
    """
    bends = np.diff(slopes)
    sizes = np.abs(bends)
    turns = {}
    for n in interval_numbers:
        beside = sizes[max(n - 1, 0) : n + 1]
        turns[n] = 2.0 * float(beside.mean())  # At an end, only one change is known.
    within = bends[interval_numbers.start : interval_numbers.stop - 1]
    if not _count_sign_reversals(
        within, _MIN_SLOPE_CHANGE_OVER_MAX_SLOPE * float(np.abs(slopes).max())
    ):
        return turns, False
    largest = 2.0 * max(turns.values())
    # Small changes on either side of a kink, and noise, do not indicate an oscillation.
    noticeable = _MIN_SLOPE_CHANGE_FOR_OSCILLATION * float(np.abs(within).max())
    steady = largest < 2.0 * _MIN_SLOPE_CHANGE_FOR_OSCILLATION * float(
        np.abs(slopes[interval_numbers.start : interval_numbers.stop]).min()
    )
    return dict.fromkeys(interval_numbers, largest), not steady and _count_sign_reversals(
        within, noticeable
    ) > 1


def _count_sign_reversals(slope_changes: np.ndarray, min_slope_change: float) -> int:
    """Count how often successive slope changes reverse sign, ignoring small slope changes."""
    counted = slope_changes[np.abs(slope_changes) > min_slope_change]
    return int((counted[1:] * counted[:-1] < 0.0).sum())


def _compute_crossing_bounds(
    slope: float, total_slope_change: float, interval_width: float, level_minus_first_value: float
) -> tuple[float, float] | None:
    """Return bounds on the position of a crossing in an interval.

    Positions are measured from the first sample of the interval, and ``level_minus_first_value`` is
    the level minus the value of the first sample. The function returns None if the curve cannot
    reach the level.
    """
    if slope < 0.0:
        slope, level_minus_first_value = -slope, -level_minus_first_value
    if (
        level_minus_first_value > slope * interval_width
    ):  # The curve is mirrored, so that the level is below the first sample.
        mirrored = _compute_crossing_bounds(
            slope,
            total_slope_change,
            interval_width,
            slope * interval_width - level_minus_first_value,
        )
        return (
            None
            if mirrored is None
            else (interval_width - mirrored[1], interval_width - mirrored[0])
        )
    if level_minus_first_value < 0.0:
        excess = total_slope_change - slope
        root = excess**2 + 4.0 * total_slope_change / interval_width * level_minus_first_value
        if excess <= 0.0 or root < 0.0:
            return None
        middle, half = (
            0.5 * interval_width * excess / total_slope_change,
            0.5 * interval_width * math.sqrt(root) / total_slope_change,
        )
        return middle - half, middle + half
    rises, falls = slope + total_slope_change, slope - total_slope_change
    steeper = math.sqrt(
        max(rises**2 - 4.0 * total_slope_change / interval_width * level_minus_first_value, 0.0)
    )
    flatter = math.sqrt(
        falls**2 + 4.0 * total_slope_change / interval_width * level_minus_first_value
    )
    first = 2.0 * level_minus_first_value / (rises + steeper) if rises else 0.0
    last = (
        2.0 * level_minus_first_value / (falls + flatter)
        if falls > 0.0
        else interval_width * (flatter - falls) / (2 * total_slope_change)
    )
    return min(first, interval_width), min(last, interval_width)


def _compute_crossing_bounds_at_curve_end(
    slopes: np.ndarray,
    interval_widths: np.ndarray,
    level_minus_inner_value: float,
    is_first_interval: bool,
) -> tuple[float, float]:
    """Return the bounds of a crossing in the first or last interval.

    The curve may have one kink in the first or last interval. The distance between the curve and
    the chord of the interval is at most ``T * u``. ``T`` is the difference between the slope of
    this chord and the slope of the neighbouring chord. ``u`` is the distance from the inner sample
    of the interval to the position on the curve.
    """
    slope, following = (slopes[0], slopes[1]) if is_first_interval else (slopes[-1], slopes[-2])
    width = float(interval_widths[0] if is_first_interval else interval_widths[-1])
    if slope < 0.0:
        slope, following, level_minus_inner_value = -slope, -following, -level_minus_inner_value
    bend, climb = (
        abs(following - slope),
        level_minus_inner_value if is_first_interval else slope * width - level_minus_inner_value,
    )
    first = max((climb - bend * width) / (slope - bend), 0.0) if slope > bend else 0.0
    last = min((climb + bend * width) / (slope + bend), width)
    return (first, last) if is_first_interval else (width - last, width - first)
