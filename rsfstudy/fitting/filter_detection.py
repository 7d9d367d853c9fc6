"""Functions that detect whether friction was filtered before it was recorded.

A filter smooths the friction peak after a velocity step, and introduces a correlation into the
noise. A running mean over m rows also causes notches in the noise spectrum. The function
``detect_undeclared_filter`` compares linearised models with and without a filter. If the model
with a filter has a smaller AIC and noticeably different parameters, the friction was probably
filtered.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from rsfstudy.fitting import noise_models as noises
from rsfstudy.fitting.filters import LOW_PASS_ORDERS, Filter
from rsfstudy.fitting.fit_solution import FitSolution, compute_aic
from rsfstudy.fitting.noise_correlation_from_averaging import (
    MAX_ROWS_PER_AVERAGING_TIME,
    apply_running_mean,
)

#: Lengths of the tested running means in rows, and criteria for detecting a filter. The first
#: criterion is the smallest decrease in the AIC due to the filter. The second criterion is the
#: smallest change of a parameter due to the filter, in standard errors.
(
    _TESTED_AVERAGE_LENGTHS_IN_ROWS,
    _MIN_AIC_DECREASE_BY_RUNNING_MEAN,
    _MIN_PARAMETER_CHANGE_IN_STDERRS,
) = (
    range(2, 21),
    20.0,
    0.5,
)
#: Smallest decrease in the AIC for which a low-pass filter is detected. This limit is larger than
#: the limit for running means, because an inaccurate step time or stiffness has a similar effect to
#: a low-pass filter.
_MIN_AIC_DECREASE_BY_LOW_PASS_FILTER = 60.0
#: Corner frequencies of the low-pass filters that are tested, relative to the sampling rate.
_CORNER_FREQUENCIES_OVER_SAMPLING_RATE = (0.3, 0.2, 0.13, 0.09, 0.06, 0.04, 0.025, 0.015)
#: Largest number of rows for the filter test, and number of iterations. In each iteration, the
#: noise and the parameters are estimated.
_MAX_ROWS_FOR_FILTER_TEST, _NOISE_ESTIMATION_PASSES = 20_000, 2


def detect_undeclared_filter(
    fit_solution: FitSolution, time: np.ndarray, noise_model_name: str
) -> tuple[str, ...]:
    """Test whether friction was filtered before it was recorded.

    Filters by running means are tested for all records. Low-pass filters are tested only if the
    noise is correlated, because a low-pass filter would have introduced a correlation into white
    noise.

    Parameters
    ----------
    fit_solution : FitSolution
        Result of a fit without a filter.
    time : ndarray, shape (rows,)
        Times in s.
    noise_model_name : str
        Noise model (see ``rsfstudy.fitting.noise_models.fit_noise_model``).

    Returns
    -------
    tuple of str
        Reason why the standard errors are not valid, with the name of the filter that fits the
        record best. The tuple is empty if no model with a filter fits the record better than the
        model without a filter.
    """
    windows = np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) <= 0.0) + 1)
    least = fit_solution.friction_rounding_quantum / math.sqrt(12.0)
    # The delay caused by a filter is similar to an error of the step time.
    delays = (
        fit_solution.friction_change_by_loading_error[:, :0]
        if "step_time" in fit_solution.free_parameters
        else fit_solution.friction_change_by_loading_error
    )
    columns = np.column_stack([fit_solution.jacobian, delays, fit_solution.model_friction])
    free = len(fit_solution.fit_coordinate_stderr)

    shortest_interval = min(float(np.diff(time[rows]).min()) for rows in windows)

    def describe(kind: str, size: float) -> tuple[float, float]:
        """Return the AIC of a model with a filter, and the largest resulting parameter change.

        The change in each parameter is divided by the standard error of the parameter.
        """
        parts = [
            _apply_filter_to_columns(kind, size, time[rows], columns[rows]) for rows in windows
        ]
        filtered = np.concatenate(parts)
        left = fit_solution.residuals + columns[:, -1] - filtered[:, -1]
        jacobian, kept = filtered[:, :-1], fit_solution.noise_model.non_outlier_mask
        averaging = size if kind == "mean" else 0.0
        if averaging > MAX_ROWS_PER_AVERAGING_TIME * shortest_interval:
            return math.inf, 0.0
        moved = np.zeros(jacobian.shape[1])
        for _ in range(_NOISE_ESTIMATION_PASSES):
            guessed = left - jacobian @ moved
            there = noises.estimate_noise_model_by_moments(
                noise_model_name, time, guessed, kept, least, averaging
            )[0]
            whitened = there.whiten_columns(np.column_stack([jacobian, left]))
            moved = np.linalg.lstsq(whitened[:, :-1], whitened[:, -1])[0]
        innovations = whitened[:, -1] - whitened[:, :-1] @ moved
        criterion = compute_aic(innovations, there, len(moved), len(time))
        return criterion, float(np.max(np.abs(moved[:free]) / fit_solution.fit_coordinate_stderr))

    if len(time) > _MAX_ROWS_FOR_FILTER_TEST or not np.isfinite(columns).all():
        return ()
    # The noise model of the fit may describe unfiltered friction better than this estimate.
    plain = min(describe("", 0.0)[0], fit_solution.aic)
    interval = float(np.median(np.diff(time[windows[0]])))
    tried = [
        (*describe(kind, size), kind, size)
        for kind, size in _iterate_candidate_filters(fit_solution, interval)
    ]
    best, change, kind, size = min(tried)
    least_gain = (
        _MIN_AIC_DECREASE_BY_RUNNING_MEAN
        if kind == "mean"
        else _MIN_AIC_DECREASE_BY_LOW_PASS_FILTER
    )
    if not (plain - best > least_gain and change > _MIN_PARAMETER_CHANGE_IN_STDERRS):
        return ()
    if kind == "mean":
        seems, remedy = f"averaged over about {size:.3g} s", "`averaging=` (`--averaging`)"
    else:
        seems, remedy = f"low-pass filtered at about {size:.3g} Hz", "`low_pass=` (`--low-pass`)"
    return (
        f"friction was probably {seems}, which changes a parameter by {change:.1f} standard "
        f"errors. Pass {remedy}",
    )


def _iterate_candidate_filters(
    fit_solution: FitSolution, sampling_interval: float
) -> Iterator[tuple[str, float]]:
    """Iterate over the kinds and sizes of the filters to test."""
    for rows in _TESTED_AVERAGE_LENGTHS_IN_ROWS:
        yield "mean", rows * sampling_interval
    if fit_solution.noise_model.autoregressive_order:
        for kind in LOW_PASS_ORDERS:
            for corner in _CORNER_FREQUENCIES_OVER_SAMPLING_RATE:
                yield kind, corner / sampling_interval


def _apply_filter_to_columns(
    filter_kind: str,
    averaging_time_or_frequency: float,
    time: np.ndarray,
    sample_columns: np.ndarray,
) -> np.ndarray:
    """Apply a filter to the columns of a window."""
    if not filter_kind:
        return sample_columns
    if filter_kind == "mean":
        return apply_running_mean(time, sample_columns, averaging_time_or_frequency)
    one = Filter(filter_kind, averaging_time_or_frequency)
    at = one.compute_required_sample_times(time)
    return np.column_stack(
        [one.apply(time, np.interp(at, time, each)) for each in sample_columns.T]
    )
