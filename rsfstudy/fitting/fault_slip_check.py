"""Function that tests whether a displacement is the slip of the fault."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

#: Maximum number of rows in the comparison, and number of trial times for the change in velocity.
_MAX_ROWS, _TRIAL_TIMES = 400, 40
#: Two straight lines are fitted to the displacement, and to the displacement plus elastic
#: shortening. If the second sum of squared residuals is less than this fraction of the first sum,
#: the displacement is the slip of the fault.
_MAX_RESIDUAL_SQUARES_RATIO_IF_SLIP = 0.1


def displacement_is_slip(
    time: np.ndarray, displacement: np.ndarray, shortening: np.ndarray
) -> bool:
    """Return True if a displacement is the slip of the fault.

    At a velocity step, the load point changes from one constant velocity to another constant
    velocity. The slip rate of the fault, in contrast, is not constant before or after the step. The
    load point displacement is the sum of the slip and the elastic shortening of the machine. If the
    displacement is the slip of the fault, only this sum has a constant velocity before and after
    the step.

    Parameters
    ----------
    time, displacement : ndarray, shape (rows,)
        Times and displacements of the rows around a velocity step, from the previous step to the
        next step.
    shortening : ndarray, shape (rows,)
        Elastic shortening of the machine: shear stress divided by stiffness, in the units of the
        displacement.

    Returns
    -------
    bool
        True if two straight lines fit the sum of displacement and shortening much better than they
        fit the displacement.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import displacement_is_slip
    >>> time = np.arange(0.0, 100.0)
    >>> load_point = np.where(time < 50.0, time, 50.0 + 10.0 * (time - 50.0))
    >>> shortening = 300.0 + 10.0 * np.where(time < 50.0, 0.0, np.exp(-(time - 50.0) / 5.0))
    >>> displacement_is_slip(time, load_point, shortening)
    False
    >>> displacement_is_slip(time, load_point - shortening, shortening)
    True
    """
    every = -(-len(time) // _MAX_ROWS)
    time, displacement, shortening = (of[::every] for of in (time, displacement, shortening))
    if len(time) < _TRIAL_TIMES:
        return False
    alone = _compute_residual_squares_of_two_lines(time, displacement)
    return (
        _compute_residual_squares_of_two_lines(time, displacement + shortening)
        < _MAX_RESIDUAL_SQUARES_RATIO_IF_SLIP * alone
    )


def _compute_residual_squares_of_two_lines(time: np.ndarray, displacement: np.ndarray) -> float:
    """Fit two connected straight lines, and return the sum of squared residuals."""
    scaled = (time - time[0]) / (time[-1] - time[0])
    centred = displacement - displacement.mean()

    def squares(bend: float) -> float:
        lines = np.column_stack([np.ones_like(scaled), scaled, np.maximum(scaled - bend, 0.0)])
        best = np.linalg.lstsq(lines, centred)[0]
        return float(((centred - lines @ best) ** 2).sum())

    trials = np.linspace(0.0, 1.0, _TRIAL_TIMES + 2)
    best = 1 + int(np.argmin([squares(bend) for bend in trials[1:-1]]))
    found = minimize_scalar(squares, bounds=(trials[best - 1], trials[best + 1]), method="bounded")
    return float(found.fun)
