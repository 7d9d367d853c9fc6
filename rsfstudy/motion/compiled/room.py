"""The arrays of one regime of a compiled motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rsfstudy.motion.compiled.order_eight import ALL_STAGES, ROWS
from rsfstudy.motion.compiled.table import PSIS, SLOW


class Room(NamedTuple):
    """Unknowns at the beginning of a step, at its end and within; the stages of a step and its
    dense output; the points there; and when events happen.
    """

    y: np.ndarray
    new: np.ndarray
    within: np.ndarray
    scales: np.ndarray
    stages: np.ndarray
    dense: np.ndarray
    before: np.ndarray
    after: np.ndarray
    between: np.ndarray
    when: np.ndarray


def room(y, scales, states, watches):
    """Room for a regime."""
    unknowns = len(scales)
    return Room(
        y,
        np.empty(unknowns),
        np.empty(unknowns),
        scales,
        np.empty((ALL_STAGES, unknowns)),
        np.empty((ROWS, unknowns)),
        np.empty(PSIS + states),
        np.empty(PSIS + states),
        np.empty(PSIS + states),
        np.empty(watches),
    )


def spend(now, evaluations):
    """Count right-hand sides."""
    if now.regime == SLOW:
        now.spent_slow += evaluations
    else:
        now.spent_fast += evaluations
