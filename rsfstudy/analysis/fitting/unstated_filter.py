"""Detection of averaged friction if the user did not specify a filter.

A running mean over m rows causes notches in the spectrum of the noise, and smooths the peak of a
velocity step. The function tests a model with both effects, linearised in the parameters. If the
criterion improves and a parameter changes noticeably, friction was probably averaged.
"""

from __future__ import annotations

import math

import numpy as np

from rsfstudy.analysis.fitting import noise as noises
from rsfstudy.analysis.fitting.averaging import average
from rsfstudy.analysis.fitting.fitted import Fitted, compute_criterion

#: Rows of the averages that are tried, improvement of the criterion that decides, and change of a
#: parameter, in standard errors, that matters.
_ROWS, _DECIDES, _MATTERS = range(2, 21), 20.0, 0.5
#: Largest number of rows that are tested, and passes in which noise and parameters are found.
_MOST, _PASSES = 20_000, 2


def find_averaging(found: Fitted, time: np.ndarray, noise: str) -> tuple[str, ...]:
    """Test whether friction was averaged before it was recorded.

    Parameters
    ----------
    found : Fitted
        Result of a fit without a filter.
    time : ndarray, shape (rows,)
        Times in s.
    noise : str
        Noise model (see ``noise.fitted``).

    Returns
    -------
    tuple of str
        The reason why the standard errors are not valid, with the averaging time that describes the
        record best. Empty if no averaging time describes the record better than unaveraged
        friction.
    """
    windows = np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) <= 0.0) + 1)
    interval = float(np.median(np.diff(time[windows[0]])))
    least = found.quantum / math.sqrt(12.0)
    columns = np.column_stack([found.jacobian, found.curve])

    def describe(averaging: float) -> tuple[float, float]:
        averaged = columns
        if averaging:
            parts = [average(time[rows], columns[rows], averaging) for rows in windows]
            averaged = np.concatenate(parts)
        left = found.residuals + columns[:, -1] - averaged[:, -1]
        jacobian, kept = averaged[:, :-1], found.noise.kept
        moved = np.zeros(jacobian.shape[1])
        for _ in range(_PASSES):
            guessed = left - jacobian @ moved
            there = noises.guess_noise(noise, time, guessed, kept, least, averaging)[0]
            whitened = there.whitened(np.column_stack([jacobian, left]))
            moved = np.linalg.lstsq(whitened[:, :-1], whitened[:, -1])[0]
        innovations = whitened[:, -1] - whitened[:, :-1] @ moved
        criterion = compute_criterion(innovations, there, len(moved), len(time))
        return criterion, float(np.max(np.abs(moved) / found.spread))

    if len(time) > _MOST or not np.isfinite(columns).all():
        return ()
    plain = describe(0.0)[0]
    tried = [(*describe(rows * interval), rows * interval) for rows in _ROWS]
    best, change, averaging = min(tried)
    if not (plain - best > _DECIDES and change > _MATTERS):
        return ()
    return (
        f"friction looks averaged over about {averaging:.3g} s, which changes a parameter by "
        f"{change:.1f} standard errors: pass `averaging=` (`--averaging`) or `low_pass=`",
    )
