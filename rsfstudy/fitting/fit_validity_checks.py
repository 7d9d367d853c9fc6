"""Functions that test whether the standard errors of a fit are valid.

If the standard errors are not valid, the status of the fit is ``errors_not_valid``, but the
parameter values can still be used. Each check that fails returns a string that describes the
violated condition and suggests a remedy. The string has no final full stop.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from rsfstudy.fitting.fit_solution import FitSolution
from rsfstudy.fitting.joint_window_model import strip_window_number
from rsfstudy.fitting.noise_models import compute_ljung_box_p_value
from rsfstudy.fitting.whiteness_test import LAG_COUNT_BEYOND_AR_ORDER
from rsfstudy.fitting.window_model import LOGARITHMIC_PARAMETERS
from rsfstudy.formatting import format_count_with_noun

#: Names of the parameters that are slip distances.
SLIP_DISTANCE_PARAMETER_NAMES = ("slip_distance", "slip_distance_2")
#: Significance level of the test for autocorrelated whitened residuals.
WHITENESS_TEST_SIGNIFICANCE_LEVEL = 0.01
#: Standard deviation of friction below which the residuals are numerical errors rather than noise.
MIN_FRICTION_NOISE_SD = 1e-7
#: Largest ratio of the root mean square residual of a fit to the root mean square residual of an
#: ordinary least-squares fit.
_MAX_RESIDUAL_RMS_OVER_OLS_RESIDUAL_RMS = 2.0
#: Rounding errors depend on friction if the ratio of the noise to the rounding unit of friction is
#: less than the first value. The second value is the largest fraction of rows that may be outliers.
_MIN_FRICTION_NOISE_PER_QUANTUM, _MAX_OUTLIER_FRACTION = 0.4, 0.05
#: Smallest number of rows per slip distance for which confidence intervals are reliable.
_MIN_ROWS_PER_SLIP_DISTANCE = 1.5
#: Largest accepted asymmetry of a 95 % confidence interval. The asymmetry is the ratio between the
#: longer side and the shorter side of the confidence interval of the logarithm of a parameter.
_MAX_CONFIDENCE_INTERVAL_ASYMMETRY = 3.0
#: Largest number of outliers that a message lists.
_MAX_LISTED_OUTLIERS = 10


def find_reasons_for_invalid_stderrs(
    fit_solution: FitSolution, recorded_friction: np.ndarray
) -> tuple[str, ...]:
    """Return the reasons why the standard errors of a fit are not valid.

    Parameters
    ----------
    fit_solution : FitSolution
        Result of the fit.
    recorded_friction : ndarray, shape (rows,)
        Recorded friction.

    Returns
    -------
    tuple of str
        Reasons why the standard errors are not valid. The tuple is empty if they are valid.
    """
    if fit_solution.noise_sd < MIN_FRICTION_NOISE_SD:
        return ()
    return (
        *_yield_warning_if_misfit_is_large(fit_solution, recorded_friction),
        *_yield_warning_if_rounding_is_coarse(fit_solution),
        *_yield_warning_if_outliers_are_many(fit_solution),
        *_yield_warning_if_residuals_correlate(fit_solution),
    )


def describe_asymmetric_confidence_intervals(
    fit_solution: FitSolution, interval_ends: Mapping[str, tuple[float, float]]
) -> tuple[str, ...]:
    """Describe the parameters with very asymmetric confidence intervals.

    A record may provide only a lower or an upper limit for a parameter, for example for the
    stiffness of a very stiff machine. In this case, the standard errors of all parameters that are
    correlated with this parameter are too small.

    Parameters
    ----------
    fit_solution : FitSolution
        Result of the fit.
    interval_ends : mapping of str to (float, float)
        Ends of the 95 % confidence intervals of the free parameters.

    Returns
    -------
    tuple of str
        One reason for each parameter with a very asymmetric confidence interval.
    """
    reasons = []
    for name in (
        n
        for n in fit_solution.free_parameters
        if strip_window_number(n) in LOGARITHMIC_PARAMETERS and min(interval_ends[n]) > 0.0
    ):
        below, above = (
            abs(math.log(end / fit_solution.parameter_values[name])) for end in interval_ends[name]
        )
        if max(below, above) > _MAX_CONFIDENCE_INTERVAL_ASYMMETRY * min(below, above):
            low, high = interval_ends[name]
            reasons.append(
                f"the 95 % confidence interval of {name} is asymmetric ({low:.3g} to {high:.3g}), "
                f"so standard errors do not describe it. Specify {name} instead of fitting it, or "
                "sample faster"
            )
    return tuple(reasons)


def describe_outliers(outlier_rows: np.ndarray) -> str:
    """Return a remark that lists the outliers.

    Parameters
    ----------
    outlier_rows : ndarray of int
        Row indices of the outliers in the window, starting from 0. The numbers in the remark start
        from 1.

    Returns
    -------
    str
        Remark, or an empty string if there are no outliers.
    """
    if not len(outlier_rows):
        return ""
    names = ", ".join(str(row + 1) for row in outlier_rows[:_MAX_LISTED_OUTLIERS].tolist())
    more = " and more" * (len(outlier_rows) > _MAX_LISTED_OUTLIERS)
    count = format_count_with_noun(len(outlier_rows), "outlier")
    verb = "was" if len(outlier_rows) == 1 else "were"
    return f"{count} {verb} omitted: rows {names}{more} of the window"


def _yield_warning_if_misfit_is_large(
    fit_solution: FitSolution, recorded_friction: np.ndarray
) -> Iterator[str]:
    """Yield a warning message if the residuals of the fit are too large."""
    size = float(
        np.sqrt(np.mean(fit_solution.noise_model.drop_outlier_rows(fit_solution.residuals) ** 2))
    )
    if not size < np.std(recorded_friction):
        yield (
            "the fit is not better than a constant (R2 is not positive). Check the step, the "
            "stiffness and the law"
        )
    elif size > _MAX_RESIDUAL_RMS_OVER_OLS_RESIDUAL_RMS * fit_solution.ols_residual_rms:
        yield (
            f"the residuals ({size:.2g}) are {size / fit_solution.ols_residual_rms:.1f} times as "
            "large as those of an ordinary least-squares fit, so part of the response is "
            "attributed to noise. Check the time of the step, the trend and the law"
        )


def _yield_warning_if_rounding_is_coarse(fit_solution: FitSolution) -> Iterator[str]:
    """Yield a warning message if the rounding of friction is too coarse."""
    if is_friction_rounding_too_coarse(fit_solution):
        yield (
            f"friction is rounded to {fit_solution.friction_rounding_quantum:.2g}, more than 2.5 "
            "times the noise, so rounding errors are not random. Export the record with more "
            "digits"
        )


def is_friction_rounding_too_coarse(fit_solution: FitSolution) -> bool:
    """Return True if the rounding of friction is too coarse.

    Rounding errors are random only if the standard deviation of the noise exceeds 0.4 times the
    rounding unit of friction.

    Parameters
    ----------
    fit_solution : FitSolution
        Result of the fit.

    Returns
    -------
    bool
        True if rounding errors are not random.
    """
    variance = (
        fit_solution.noise_sd * float(fit_solution.noise_model.relative_noise_levels.min())
    ) ** 2 - fit_solution.friction_rounding_quantum**2 / 12.0
    return (
        variance < (_MIN_FRICTION_NOISE_PER_QUANTUM * fit_solution.friction_rounding_quantum) ** 2
    )


def _yield_warning_if_outliers_are_many(fit_solution: FitSolution) -> Iterator[str]:
    """Yield a warning message if too many rows of the record are outliers."""
    count, rows = len(fit_solution.outlier_rows), len(fit_solution.residuals)
    if count > _MAX_OUTLIER_FRACTION * rows:
        yield f"{count} of {rows} rows are outliers. Remove them from the record, or check the law"


def _yield_warning_if_residuals_correlate(fit_solution: FitSolution) -> Iterator[str]:
    """Yield a warning message if the whitened residuals are autocorrelated."""
    p_value = compute_ljung_box_p_value(
        fit_solution.whitened_residuals, fit_solution.noise_model.autoregressive_order
    )
    if p_value < WHITENESS_TEST_SIGNIFICANCE_LEVEL:
        yield (
            f"the whitened residuals are still autocorrelated (p = {p_value:.2g}), so the law, "
            "the trend or the noise model does not describe the record. Compare another law, add "
            "a curved trend or use a shorter window. If the noise is periodic, remove the "
            "oscillation from the record first"
        )


def describe_load_point_noise(
    fit_solution: FitSolution, loading_history_source: str, displacement_noise_sd: float
) -> str:
    """Return a remark about the noise in the load point displacement.

    Parameters
    ----------
    fit_solution : FitSolution
        Result of the fit.
    loading_history_source : {"steps", "recorded"}
        Loading of the model (see ``rsfstudy.fitting.Fit``).
    displacement_noise_sd : float
        Standard deviation of the load point noise in um.

    Returns
    -------
    str
        Remark, or an empty string if the displacement noise has little effect on the parameters.
    """
    if loading_history_source == "steps":
        by_loading = (
            fit_solution.fit_coordinate_covariance
            - fit_solution.fit_coordinate_covariance_from_stiffness
        )
        moved = np.diag(by_loading) > 2.0 * np.diag(
            fit_solution.fit_coordinate_covariance_from_noise
        )
        pairs = zip(fit_solution.free_parameters, moved.tolist(), strict=True)
        names = ", ".join(n for n, most in pairs if most and strip_window_number(n) != "step_time")
        remedy = (
            ""
            if "step_time" in fit_solution.free_parameters
            else ". Fitting step_time as well reduces this error"
        )
        text = (
            f"most of the standard error of {names} is due to noise of the load point "
            f"displacement{remedy}"
        )
        return text if names else ""
    if "slip_distance" not in fit_solution.free_parameters:
        return ""
    # A displacement error x changes ln V of a stiff slider by k x/a. The resulting change of the
    # fitted slip distance is of second order in x.
    shift = (
        0.5
        * (
            fit_solution.parameter_values["stiffness"]
            * displacement_noise_sd
            / fit_solution.parameter_values["a"]
        )
        ** 2
    )
    if (
        shift
        < fit_solution.compute_parameter_stderr("slip_distance")
        / fit_solution.parameter_values["slip_distance"]
    ):
        return ""
    return (
        f"the noise of the recorded load point, {displacement_noise_sd:.2g} um, changes "
        f"slip_distance by about {100.0 * shift:.2g} %, which is more than its standard error. "
        "Consider loading='steps'"
    )


def find_unidentified_parameters(
    fit_solution: FitSolution, displacement_per_row: float
) -> tuple[str, ...]:
    """Return the parameters that the record does not constrain.

    A slip distance is not constrained if fewer than 1.5 rows are recorded while the load point
    moves by this slip distance.

    Parameters
    ----------
    fit_solution : FitSolution
        Result of the fit.
    displacement_per_row : float
        Load point displacement in um between successive rows after the step.

    Returns
    -------
    tuple of str
        Names of the unconstrained parameters.
    """
    sparse = [
        n
        for n in SLIP_DISTANCE_PARAMETER_NAMES
        if fit_solution.parameter_values.get(n, math.inf)
        < _MIN_ROWS_PER_SLIP_DISTANCE * displacement_per_row
    ]
    return tuple(
        n
        for n in fit_solution.free_parameters
        if n in (*fit_solution.unidentified_parameters, *sparse)
    )


def describe_unidentified_parameters(
    fit_solution: FitSolution,
    parameter_names: tuple[str, ...],
    displacement_per_row: float,
    *,
    direct_effect_is_at_bound: bool,
) -> str:
    """Return the message for parameters that the record does not constrain.

    Parameters
    ----------
    fit_solution : FitSolution
        Result of the fit.
    parameter_names : tuple of str
        Names of the unconstrained parameters.
    displacement_per_row : float
        Load point displacement in um between successive rows after the step.
    direct_effect_is_at_bound : bool
        True if the direct effect is at its lower bound.

    Returns
    -------
    str
        Message that lists the parameters and the possible reasons.
    """
    text = f"the record does not constrain {', '.join(parameter_names)}"
    if sparse := set(parameter_names) - set(fit_solution.unidentified_parameters):
        rows = min(fit_solution.parameter_values[name] for name in sparse) / displacement_per_row
        text += f"; the record has {rows:.1f} rows per slip distance, and "
        text += (
            f"at least {_MIN_ROWS_PER_SLIP_DISTANCE:g} are required. Sample faster after the step"
        )
    if "a" in parameter_names and direct_effect_is_at_bound:
        text += "; friction does not change at the velocity step. "
        text += "Check whether columns (such as time and displacement) are exchanged"
    return text


def describe_whiteness(p_value: float, noise_order: int, rows: int) -> str:
    """Describe the result of the autocorrelation test of whitened residuals.

    Parameters
    ----------
    p_value : float
        P-value of the autocorrelation test.
    noise_order : int
        Order of the autoregressive noise model.
    rows : int
        Number of rows of the window.

    Returns
    -------
    str
        Description on a single line, for display in a terminal.

    Examples
    --------
    >>> from rsfstudy.fitting import describe_whiteness
    >>> text = describe_whiteness(0.41, 1, 500)
    >>> "0.41" in text
    True
    """
    verdict = (
        "are still autocorrelated"
        if p_value < WHITENESS_TEST_SIGNIFICANCE_LEVEL
        else "show no autocorrelation"
    )
    last = min(LAG_COUNT_BEYOND_AR_ORDER + noise_order, rows // 4)
    return f"whitened residuals {verdict} up to lag {last} (p = {p_value:.2g})"
