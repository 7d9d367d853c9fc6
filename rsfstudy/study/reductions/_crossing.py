"""Level crossing of a sampled curve, with bounds on its position between samples."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

#: Number of samples at least.
MIN_SAMPLES = 4
#: Intervals on either side of the bracket in which the curve is examined.
_NEIGHBOUR_INTERVALS = 3
#: Changes of slope, relative to the largest slope, that count as rounding errors.
_SLOPE_ROUNDING_ERROR = 1e-9
#: The same, relative to the largest change and to the smallest slope nearby, that count for an
#: oscillation.
_OSCILLATION_THRESHOLD = 0.1


class CrossingStatus(IntEnum):
    """Outcome of the search for a crossing.

    Files contain the integer value, so the values must not change.
    """

    OK, OUT_OF_REACH, NOT_UNIQUE, UNRESOLVED, TOO_FEW_POINTS = range(5)


class Crossing(NamedTuple):
    """Position of a level crossing, with lower and upper bounds and the verdict."""

    position: float
    lower_bound: float
    upper_bound: float
    status: CrossingStatus


def find_crossing(x: np.ndarray, y: np.ndarray, level: float) -> Crossing:
    """Find the position at which a sampled curve reaches a level.

    The bounds allow for curves that differ from the straight chord between two samples. If the
    slope changes by T in total within an interval of width h, the curve departs from the chord at
    distance u from the first sample by at most ``T u (h - u)/h``. T is estimated by the change of
    slope from the previous chord to the next chord. This estimate is exact for a single kink, and
    for a parabola the estimate is twice the true value. In the first and the last interval, the
    kink may also be located next to the end, and the curve then follows the neighbouring chord.

    If the slope does not vary monotonically over the neighbouring intervals, changes of opposite
    sign partly cancel. The largest T among these intervals is then doubled and used for all of
    them. If the changes of slope alternate in sign, the samples may hide an oscillation. The bounds
    then enclose at least the whole interval.

    Parameters
    ----------
    x, y : ndarray
        Samples, with x in ascending order.
    level : float

    Returns
    -------
    Crossing
        The position and the bounds are NaN unless the samples cross the level exactly once. The
        verdict is ``UNRESOLVED`` if a hidden oscillation could reach the level in other intervals.
    """
    if x.size < MIN_SAMPLES:
        return _no_crossing(CrossingStatus.TOO_FEW_POINTS)
    places = find_all_crossings(x, y, level)
    if len(places) != 1:
        return _no_crossing(CrossingStatus.NOT_UNIQUE if places else CrossingStatus.OUT_OF_REACH)
    place, widths = places[0], np.diff(x)
    slopes = np.diff(y) / widths
    bracket = int(np.clip(np.searchsorted(x, place) - 1, 0, slopes.size - 1))
    near = range(
        max(bracket - _NEIGHBOUR_INTERVALS, 0), min(bracket + _NEIGHBOUR_INTERVALS + 1, slopes.size)
    )
    turns, alternates = _slope_changes(slopes, near)
    bounds, far = [place], False
    for n in near if alternates else (bracket,):
        span = _crossing_bounds(slopes[n], turns[n], widths[n], level - y[n])
        if span:
            bounds += [x[n] + end for end in span]
            far |= abs(n - bracket) >= _NEIGHBOUR_INTERVALS
    if alternates:
        bounds += [x[bracket], x[bracket + 1]]
    if bracket in (0, slopes.size - 1):
        span = _crossing_bounds_at_end(slopes, widths, level - y[bracket], is_first=bracket == 0)
        bounds += [x[bracket] + end for end in span]
    verdict = CrossingStatus.UNRESOLVED if far else CrossingStatus.OK
    return Crossing(place, float(min(bounds)), float(max(bounds)), verdict)


def find_all_crossings(x: np.ndarray, y: np.ndarray, level: float) -> list[float]:
    """Return all positions at which the interpolant of the samples reaches a level."""
    off, curve = y - level, PchipInterpolator(x, y)
    places: list[float] = x[off == 0.0].tolist()
    # between two samples it is monotone, and at them it has their values but for rounding
    known = dict(zip(x.tolist(), off.tolist(), strict=True))
    for first in np.flatnonzero(off[:-1] * off[1:] < 0.0):
        ends = x[first : first + 2].tolist()
        places.append(brentq(lambda x: known.get(x, curve(x) - level), *ends, xtol=1e-15))
    return places


def _no_crossing(verdict: CrossingStatus) -> Crossing:
    return Crossing(math.nan, math.nan, math.nan, verdict)


def _slope_changes(slopes: np.ndarray, near: range) -> tuple[dict[int, float], bool]:
    """Estimate the total change of slope within each of the given intervals.

    Returns
    -------
    turns : dict of int to float
        Total change of slope, by the number of the interval.
    alternates : bool
        True if the changes of slope alternate in sign.
    """
    bends = np.diff(slopes)
    sizes = np.abs(bends)
    turns = {}
    for n in near:
        beside = sizes[max(n - 1, 0) : n + 1]
        turns[n] = 2.0 * float(beside.mean())  # at an end, the other change is not known
    within = bends[near.start : near.stop - 1]
    if not _count_sign_reversals(within, _SLOPE_ROUNDING_ERROR * float(np.abs(slopes).max())):
        return turns, False
    largest = 2.0 * max(turns.values())
    # the small changes on either side of a kink, or noise, do not make an oscillation
    noticeable = _OSCILLATION_THRESHOLD * float(np.abs(within).max())
    steady = largest < 2.0 * _OSCILLATION_THRESHOLD * float(
        np.abs(slopes[near.start : near.stop]).min()
    )
    return dict.fromkeys(near, largest), not steady and _count_sign_reversals(
        within, noticeable
    ) > 1


def _count_sign_reversals(bends: np.ndarray, least: float) -> int:
    """Count the sign reversals among changes of slope larger than a minimum."""
    counted = bends[np.abs(bends) > least]
    return int((counted[1:] * counted[:-1] < 0.0).sum())


def _crossing_bounds(
    slope: float, turn: float, width: float, rise: float
) -> tuple[float, float] | None:
    """Return the first and last possible position of a crossing in an interval.

    Positions are relative to the first sample, and ``rise`` is the level minus the value of the
    first sample. The result is None if the level cannot be reached.
    """
    if slope < 0.0:
        slope, rise = -slope, -rise
    if rise > slope * width:  # seen from the other end, it is below the sample
        mirrored = _crossing_bounds(slope, turn, width, slope * width - rise)
        return None if mirrored is None else (width - mirrored[1], width - mirrored[0])
    if rise < 0.0:
        excess = turn - slope
        root = excess**2 + 4.0 * turn / width * rise
        if excess <= 0.0 or root < 0.0:
            return None
        middle, half = 0.5 * width * excess / turn, 0.5 * width * math.sqrt(root) / turn
        return middle - half, middle + half
    rises, falls = slope + turn, slope - turn
    steeper = math.sqrt(max(rises**2 - 4.0 * turn / width * rise, 0.0))
    flatter = math.sqrt(falls**2 + 4.0 * turn / width * rise)
    first = 2.0 * rise / (rises + steeper) if rises else 0.0
    last = 2.0 * rise / (falls + flatter) if falls > 0.0 else width * (flatter - falls) / (2 * turn)
    return min(first, width), min(last, width)


def _crossing_bounds_at_end(
    slopes: np.ndarray, widths: np.ndarray, rise: float, is_first: bool
) -> tuple[float, float]:
    """Return the first and last possible position of a crossing in an end interval.

    The curve may have one kink in this interval. Its distance from the chord is at most the
    difference between the slopes of this chord and the neighbouring chord, multiplied by the
    distance from the inner sample.
    """
    slope, following = (slopes[0], slopes[1]) if is_first else (slopes[-1], slopes[-2])
    width = float(widths[0] if is_first else widths[-1])
    if slope < 0.0:
        slope, following, rise = -slope, -following, -rise
    bend, climb = abs(following - slope), rise if is_first else slope * width - rise
    first = max((climb - bend * width) / (slope - bend), 0.0) if slope > bend else 0.0
    last = min((climb + bend * width) / (slope + bend), width)
    return (first, last) if is_first else (width - last, width - first)
