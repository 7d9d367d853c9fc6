"""Detection and fitting of drops of shear stress in a record."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rsfstudy.analysis.drop_detection import Candidate, Detection, detect_drops
from rsfstudy.analysis.drop_fit import Drop, fit_drop

#: Smallest fitted drop, in half widths of its 95 % interval.
_DIFFERS = 1.0


class FoundDrop(NamedTuple):
    """A fitted drop, and the candidate from which it was fitted."""

    drop: Drop
    candidate: Candidate


def find_drops(time: np.ndarray, stress: np.ndarray) -> tuple[list[FoundDrop], Detection]:
    """Find and fit the drops of stress in a record.

    If two fitted drops overlap, their candidates are merged and fitted again as one drop.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)

    Returns
    -------
    drops : list of FoundDrop
        Drops in order of time.
    detection : Detection
    """
    detection = detect_drops(time, stress)
    candidates = detection.candidates
    while True:
        found = _fitted(time, stress, candidates, detection)
        merged = _merged(found)
        if len(merged) == len(candidates):
            break
        candidates = merged
    sure = [of for of in found if _size(of.drop) > _DIFFERS * of.drop.drop_error]
    if sure:  # slow drops increase the noise estimate of long windows
        residual = float(np.median([of.drop.residual for of in sure]))
        detection = detection._replace(noise=min(detection.noise, residual))
    return sure, detection


def _size(drop: Drop) -> float:
    return drop.before - drop.after


def _fitted(
    time: np.ndarray, stress: np.ndarray, candidates: list[Candidate], detection: Detection
) -> list[FoundDrop]:
    """Fit each candidate, limited to the interval between its neighbours."""
    ends = [float(time[0]), *(one.ends for one in candidates)]
    begins = [*(one.begins for one in candidates[1:]), float(time[-1])]
    return [
        FoundDrop(fit_drop(time, stress, one, room, detection.noise), one)
        for one, room in zip(candidates, zip(ends, begins, strict=False), strict=False)
    ]


def _merged(found: list[FoundDrop]) -> list[Candidate]:
    """Merge the candidates of overlapping drops."""
    merged: list[Candidate] = []
    reached = -np.inf
    for drop, candidate in found:
        if merged and drop.begins < reached:
            last = merged[-1]
            window = max(last.window, candidate.window)
            error = min(last.error, candidate.error)
            correlation = max(last.correlation, candidate.correlation)
            ends = max(last.ends, candidate.ends)
            merged[-1] = Candidate(last.begins, ends, window, error, correlation)
        else:
            merged.append(candidate)
        reached = max(reached, drop.ends)
    return merged
