"""Implementation of Brent's root-finding method that Numba can compile."""

from __future__ import annotations

import math

from rsfstudy.slider import NumericFunction

_MAX_BRENT_ITERATIONS = 100


def build_root_finder(function: NumericFunction) -> NumericFunction:
    """Build a function that finds a root of another function.

    Parameters
    ----------
    function : callable
        Function ``function(x, given)`` with a float argument ``x`` and additional arguments
        ``given``.

    Returns
    -------
    callable
        Function ``root(low, high, at_low, at_high, finest, relative, given)``. The returned root
        lies between ``low`` and ``high``. The error tolerance of the root is the sum of the
        absolute tolerance ``finest`` and the relative tolerance ``relative``. The function values
        ``at_low`` and ``at_high`` must have opposite signs.

    References
    ----------
    Brent, R. P. (1973), Algorithms for Minimization Without Derivatives, chapter 4.
    """

    def root(low, high, at_low, at_high, finest, relative, given):  # type: ignore[no-untyped-def]
        latest, best, other = low, high, low
        at_latest, at_best, at_other = at_low, at_high, at_low
        move = earlier = best - latest
        for _ in range(_MAX_BRENT_ITERATIONS):
            if at_latest != 0.0 and at_best != 0.0 and (at_latest < 0.0) != (at_best < 0.0):
                other, at_other = latest, at_latest
                move = earlier = best - latest
            if abs(at_other) < abs(at_best):
                latest, best, other = best, other, best
                at_latest, at_best, at_other = at_best, at_other, at_best
            enough = 0.5 * (finest + relative * abs(best))
            half = 0.5 * (other - best)
            if at_best == 0.0 or abs(half) < enough:
                return best
            tried = half
            if abs(earlier) > enough and abs(at_best) < abs(at_latest):
                tried = compute_root_interpolation_step(
                    latest, best, other, at_latest, at_best, at_other
                )
                if not 2.0 * abs(tried) < min(abs(earlier), 3.0 * abs(half) - enough):
                    tried = move = half
            else:
                move = half
            earlier, move = move, tried
            latest, at_latest = best, at_best
            best += move if abs(move) > enough else math.copysign(enough, half)
            at_best = function(best, given)
        return best

    return root


def compute_root_interpolation_step(
    previous: float,
    best: float,
    other: float,
    value_at_previous: float,
    value_at_best: float,
    value_at_other: float,
) -> float:
    """Compute the distance from the best estimate of a root to the next estimate.

    Linear interpolation is used if only two of the three points are distinct, and inverse quadratic
    interpolation if all three points are distinct.

    Parameters
    ----------
    previous, best, other : float
        Previous estimate, best estimate, and other end of the bracket.
    value_at_previous, value_at_best, value_at_other : float
        Function values at the three points.

    Returns
    -------
    float
        Signed distance from ``best`` to the next estimate of the root.
    """
    if previous == other:
        return -value_at_best * (best - previous) / (value_at_best - value_at_previous)
    to_latest = (value_at_previous - value_at_best) / (previous - best)
    to_other = (value_at_other - value_at_best) / (other - best)
    numerator = value_at_other * to_other - value_at_previous * to_latest
    return (
        -value_at_best * numerator / (to_other * to_latest * (value_at_other - value_at_previous))
    )
