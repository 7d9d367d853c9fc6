"""Properties of stress drops in a record: times, stresses, slip and slip rate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from rsfstudy.analysis.drop_detection import CHANCE, FOUND, falls, quantum_of, spread
from rsfstudy.analysis.drop_fit import HALF
from rsfstudy.analysis.drops import FoundDrop

#: Smallest excess of slip over the usual displacement: in standard deviations, and as a fraction.
_FASTER, _LEAST_EXCESS = 3.0, 0.1


class Place(NamedTuple):
    """Location of a drop among the samples.

    Attributes
    ----------
    begin : int
        Index of the first sample in the drop.
    end : int
        Index of the first sample after the drop.
    window : int
        Number of samples before and after the drop that are averaged.
    """

    begin: int
    end: int
    window: int


def moves_with_drops(times: np.ndarray, moves: np.ndarray, found: Sequence[Place]) -> bool:
    """Return True if displacement is faster during drops than around them.

    The displacement during each drop is compared with the displacement over the same duration
    before and after the drop.
    """
    excess = usual = variance = 0.0
    quantum = quantum_of(moves)
    noises = {n: max(spread(falls(moves, n)), quantum) for n in {place.window for place in found}}
    for begin, end, window in found:
        far = end + window - begin
        places = (begin - window - far, begin - window, end, end + far)
        starts = np.clip(places, 0, len(moves) - window)
        lasts, slips = (
            np.diff([of[at : at + window].mean() for at in starts]) for of in (times, moves)
        )
        # the record may not extend far enough before or after a drop
        ratios = (lasts[1] / np.where(lasts > 0.0, lasts, math.inf))[::2]
        moved, ratio = float((ratios * slips[::2]).max()), float(ratios.max())
        excess, usual = excess + float(slips[1]) - moved, usual + abs(moved)
        variance += 0.5 * noises[window] ** 2 * (1.0 + (1.0 + ratio) ** 2 + ratio**2)
    return bool(excess > max(_FASTER * math.sqrt(variance), _LEAST_EXCESS * usual))


def place_of(times: np.ndarray, found: FoundDrop, room: tuple[float, float]) -> Place:
    """Locate a drop among the samples.

    The window is shortened if it would overlap with a neighbouring drop or extend beyond the
    record.
    """
    drop, candidate = found
    begin = int(np.searchsorted(times, drop.begins, "right"))
    end = max(int(np.searchsorted(times, drop.ends, "left")), begin)
    before = int(np.searchsorted(times, drop.begins - candidate.window))
    first, last = (int(np.searchsorted(times, at)) for at in room)
    window = min(begin - before, begin - first, last - end, len(times) - end)
    window = max(min(window, len(times) // 4), 1)
    return Place(max(begin, window), min(end, len(times) - window), window)


def numbers_of(
    times: np.ndarray,
    stress: np.ndarray,
    moves: np.ndarray | None,
    found: FoundDrop,
    place: Place,
    room: tuple[float, float],
) -> tuple[dict[str, tuple[float, float]], int]:
    """Compute the properties of one event and their errors.

    Returns
    -------
    row : dict
        Pairs of a value and its error, which is the half width of a 95 % interval.
    cut : int
        0 if the record contains the stress before and after the event. 1 is added if the record
        begins during the event, and 2 if the record ends during the event.
    """
    drop = found.drop
    row = {
        "time": (drop.begins, drop.begins_error),
        "duration": (
            max(drop.ends - drop.begins, 0.0) or drop.ends_error,
            math.hypot(drop.begins_error, drop.ends_error),
        ),
        "stress_before": (drop.before, drop.before_error),
        "stress_after": (drop.after, drop.after_error),
        "static_stress_drop": (drop.before - drop.after, drop.drop_error),
    }
    cut = int(drop.starts_inside) + 2 * int(drop.stops_inside)
    if moves is not None:
        row |= _slip(times, stress, moves, found, place, room)
    return row, cut


def _slip(
    times: np.ndarray,
    stress: np.ndarray,
    moves: np.ndarray,
    found: FoundDrop,
    place: Place,
    room: tuple[float, float],
) -> dict[str, tuple[float, float]]:
    """Compute slip, peak slip rate and dynamic stress drop of an event.

    Returns
    -------
    dict
        Pairs of a value and its error. The peak slip rate and the dynamic stress drop are NaN if
        the slip rate does not exceed its noise.
    """
    (drop, candidate), (begin, end, window) = found, place
    size = drop.before - drop.after
    first, last = (int(np.searchsorted(times, at)) for at in room)
    # If the window is shifted by m samples, the difference of means decreases by m drop/window.
    # The noise of this change has a standard deviation of sqrt(3 m/window) times the error. Noise
    # shifts the drop further than this limit only once in 1,000.
    off = math.ceil(3.0 * window * (FOUND * candidate.error / size) ** 2)
    off = max(0, min(off, window, begin - window - first, last - end - window))
    begin, end = begin - off, end + off
    slips, rates = -falls(moves, window), np.diff(moves) / np.diff(times)
    fastest = begin - 1 + int(np.argmax(rates[begin - 1 : max(end, begin)]))
    noise = spread(rates)
    slip = moves[end : end + window].mean() - moves[begin - window : begin].mean()
    crept = abs(float(np.median(slips))) * (1.0 + 2.0 * off / window)
    row = {"slip": (slip, HALF * spread(slips) + crept)}
    row["peak_slip_rate"] = row["dynamic_stress_drop"] = math.nan, math.nan
    if rates[fastest] > noise * norm.isf(CHANCE / len(rates)):
        row["peak_slip_rate"] = rates[fastest], HALF * noise
        # the stress at this time is between the values of the two samples
        ends = stress[fastest : fastest + 2]
        reading = 0.5 * float(np.ptp(ends)) + HALF * spread(np.diff(stress))
        row["dynamic_stress_drop"] = drop.before - ends.mean(), drop.before_error + reading
    return row
