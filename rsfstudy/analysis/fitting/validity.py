"""Checks of the standard errors of a fit.

If the standard errors are not valid, the status of the fit is ``errors_not_valid``, and its
parameter values can still be used. Each check returns a reason as a string without a final full
stop. The reason describes the violated condition and a remedy.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from rsfstudy.analysis.fitting.fitted import Fitted
from rsfstudy.analysis.fitting.joint import plain
from rsfstudy.analysis.fitting.model import LOGARITHMIC
from rsfstudy.analysis.fitting.noise import whiteness
from rsfstudy.wording import counted

#: Parameters that are slip distances.
DISTANCES = ("slip_distance", "slip_distance_2")
#: Significance level of the test for autocorrelated whitened residuals.
SIGNIFICANT = 0.01
#: Standard deviation of friction below which residuals are numerical, not statistical.
NEGLIGIBLE = 1e-7
#: Largest ratio of the residual standard deviation to that of an ordinary least-squares fit.
_LARGEST_RATIO = 2.0
#: Standard deviation of the noise, over the quantum of friction, below which rounding errors depend
#: on friction; and the largest fraction of rows that may be outliers.
_LEAST_NOISE, _MOST_OUTLIERS = 0.4, 0.05
#: Fewest rows within a slip distance for which confidence intervals are reliable.
_FEWEST_ROWS = 1.5
#: Largest ratio of the two sides of a 95 % interval, in the logarithm of a parameter.
_MOST_ASYMMETRIC = 3.0
#: Largest number of outliers that a message names.
_NAMED = 10


def find_reasons(found: Fitted, friction: np.ndarray) -> tuple[str, ...]:
    """Return the reasons why the standard errors of a fit are not valid.

    Parameters
    ----------
    found : Fitted
    friction : ndarray, shape (rows,)
        Recorded friction.

    Returns
    -------
    tuple of str
        Empty if the standard errors are valid.
    """
    if found.noise_sd < NEGLIGIBLE:
        return ()
    return (
        *_misfit(found, friction),
        *_rounding(found),
        *_outliers(found),
        *_autocorrelation(found),
    )


def describe_asymmetry(found: Fitted, ends: Mapping[str, tuple[float, float]]) -> tuple[str, ...]:
    """Return the parameters whose 95 % intervals are too asymmetric for standard errors.

    If the record constrains a parameter from one side only, such as the stiffness of a very stiff
    machine, the standard errors of all correlated parameters are too small.

    Parameters
    ----------
    found : Fitted
    ends : mapping of str to (float, float)
        Ends of the 95 % intervals, from the likelihood.

    Returns
    -------
    tuple of str
        Reasons why the standard errors are not valid.
    """
    reasons = []
    for name in (n for n in found.free if plain(n) in LOGARITHMIC and min(ends[n]) > 0.0):
        below, above = (abs(math.log(end / found.values[name])) for end in ends[name])
        if max(below, above) > _MOST_ASYMMETRIC * min(below, above):
            low, high = ends[name]
            reasons.append(
                f"the 95 % interval of {name} is asymmetric ({low:.3g} to {high:.3g}), so standard "
                f"errors do not describe it: specify {name} instead of fitting it, or sample faster"
            )
    return tuple(reasons)


def name_outliers(outliers: np.ndarray) -> str:
    """Return a remark that lists the outliers.

    Parameters
    ----------
    outliers : ndarray of int
        Indices of rows in the window. The remark numbers the rows from 1.

    Returns
    -------
    str
        Empty if there are no outliers.
    """
    if not len(outliers):
        return ""
    names = ", ".join(str(row + 1) for row in outliers[:_NAMED].tolist())
    more = " and more" * (len(outliers) > _NAMED)
    count = counted(len(outliers), "outlier")
    verb = "was" if len(outliers) == 1 else "were"
    return f"{count} {verb} left out: rows {names}{more} of the window"


def _misfit(found: Fitted, friction: np.ndarray) -> Iterator[str]:
    """Yield a reason if the residuals are too large."""
    size = float(np.sqrt(np.mean(found.noise.kept_rows(found.residuals) ** 2)))
    if not size < np.std(friction):
        yield (
            "the fit explains the record no better than its mean does (R2 is not positive): "
            "check the step, the stiffness and the law"
        )
    elif size > _LARGEST_RATIO * found.white_size:
        yield (
            f"the residuals ({size:.2g}) are {size / found.white_size:.1f} times as large as those "
            "of an ordinary least-squares fit, so part of the response is taken for noise: "
            "check the time of the step, the trend and the law"
        )


def _rounding(found: Fitted) -> Iterator[str]:
    """Yield a reason if the rounding of friction exceeds the noise."""
    if is_rounded(found):
        yield (
            f"friction is rounded to {found.quantum:.2g}, more than 2.5 times the noise, so "
            "rounding errors are not random: export the record with more digits"
        )


def is_rounded(found: Fitted) -> bool:
    """Return True if the rounding of friction is too coarse.

    Rounding errors are random only if the standard deviation of the noise exceeds 0.4 times the
    quantum of friction.
    """
    variance = (found.noise_sd * float(found.noise.sizes.min())) ** 2 - found.quantum**2 / 12.0
    return variance < (_LEAST_NOISE * found.quantum) ** 2


def _outliers(found: Fitted) -> Iterator[str]:
    """Yield a reason if too many rows are outliers."""
    count, rows = len(found.outliers), len(found.residuals)
    if count > _MOST_OUTLIERS * rows:
        yield f"{count} of {rows} rows are outliers: remove them from the record, or check the law"


def _autocorrelation(found: Fitted) -> Iterator[str]:
    """Yield a reason if the whitened residuals are autocorrelated."""
    p_value = whiteness(found.innovations, found.noise.order)
    if p_value < SIGNIFICANT:
        yield (
            f"the whitened residuals are still autocorrelated (p = {p_value:.2g}): "
            "the law, the trend or the noise model does not describe the record"
        )


def describe_load_point(found: Fitted, loading: str, noise: float) -> str:
    """Return a remark on the noise of the load point.

    Returns
    -------
    str
        Empty if the noise of the load point has little effect on the parameters.
    """
    if loading == "steps":
        moved = np.diag(found.covariance) > 2.0 * np.diag(found.by_noise)
        pairs = zip(found.free, moved.tolist(), strict=True)
        names = ", ".join(n for n, most in pairs if most and plain(n) != "step_time")
        remedy = "" if "step_time" in found.free else ": looked for, step_time lessens it"
        text = f"noise of load point displacement makes most of the error of {names}{remedy}"
        return text if names else ""
    if "slip_distance" not in found.free:
        return ""
    # of second order: ln V of a stiff slider follows the load point by k x/a
    shift = 0.5 * (found.values["stiffness"] * noise / found.values["a"]) ** 2
    if shift < found.stderr("slip_distance") / found.values["slip_distance"]:
        return ""
    return (
        f"noise of the recorded load point, {noise:.2g} um, moves slip_distance by some "
        f"{100.0 * shift:.2g} %, more than its standard error: see loading='steps'"
    )


def find_unidentified(found: Fitted, rows_apart: float) -> tuple[str, ...]:
    """Return the parameters that the record does not constrain.

    A slip distance is also unconstrained if the record has too few rows per slip distance.

    Parameters
    ----------
    found : Fitted
    rows_apart : float
        Load point displacement in um between rows after the step.

    Returns
    -------
    tuple of str
    """
    sparse = [n for n in DISTANCES if found.values.get(n, math.inf) < _FEWEST_ROWS * rows_apart]
    return tuple(n for n in found.free if n in (*found.unidentified, *sparse))


def describe_unidentified(
    found: Fitted, names: tuple[str, ...], rows_apart: float, *, is_least: bool
) -> str:
    """Return the message for parameters that the record does not constrain.

    Parameters
    ----------
    found : Fitted
    names : tuple of str
        Names of these parameters.
    rows_apart : float
        Load point displacement in um between rows after the step.
    is_least : bool
        True if the direct effect is at its lower bound.

    Returns
    -------
    str
    """
    text = f"the record does not constrain {', '.join(names)}"
    if sparse := set(names) - set(found.unidentified):
        rows = min(found.values[name] for name in sparse) / rows_apart
        text += f"; the record has {rows:.1f} rows per slip distance, and {_FEWEST_ROWS:g} are "
        text += "needed: sample faster after the step"
    if "a" in names and is_least:
        text += "; friction does not change at the step as velocity does: "
        text += "see whether columns (time and displacement, say) are exchanged"
    return text
