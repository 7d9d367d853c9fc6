r"""White and autoregressive models of the noise of a record.

The function ``fit_noise_model`` estimates a ``NoiseModel`` from the residuals of a fit by
restricted maximum likelihood (REML) [1]_. REML accounts for the noise variance that the fitted
parameters absorb. Let :math:`J` be the Jacobian of the model, :math:`R` the correlation matrix of
the noise, :math:`p` the number of parameters, and :math:`n` the number of rows. REML minimises

.. math:: (n - p) \ln\frac{S}{n - p} + \ln|R| + \ln|J^T R^{-1} J|,

where :math:`S` is the sum of squared residuals of generalised least squares.

The noise is an autoregressive process :math:`e_i = c_1 e_{i-1} + \dots + c_m e_{i-m} + w_i` with
white noise :math:`w`. The process is stationary if all partial autocorrelations are between -1 and
1. The search therefore varies the partial autocorrelations instead of the coefficients [2]_. The
Burg method [3]_ provides the initial guess.

The REML search does not change the order :math:`m`. Before the search, the "ar" noise model selects
the order that minimises the Akaike information criterion (AIC) of the Burg coefficients. The
autoregressive order is the same for all sampling intervals. The function
``fit_solution.compute_aic`` computes another quantity, the corrected AIC of the complete fit.

Each sampling interval has a separate noise process, with its own standard deviation and
correlation. If the sampling interval changes, the noise after the change is still predicted from
the rows before the change. These rows are scaled by the standard deviation of the noise after the
change, divided by the standard deviation before the change.

References
----------
.. [1] Patterson and Thompson (1971), Biometrika 58, 545-554.
.. [2] Barndorff-Nielsen and Schou (1973), J. Multivar. Anal. 3, 408-419.
.. [3] Burg (1967), Proc. 37th Meeting of the Society of Exploration Geophysicists.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.noise_correlation_from_averaging import NoiseCorrelationFromAveraging
from rsfstudy.fitting.uniform_sampling_runs import (
    UniformSamplingRun,
    count_noise_processes,
    expand_run_field_to_rows,
    find_noise_level_changes,
    find_uniform_sampling_runs,
    split_runs_at_noise_level_changes,
)
from rsfstudy.fitting.whiteness_test import (
    LAG_COUNT_BEYOND_AR_ORDER as LAG_COUNT_BEYOND_AR_ORDER,
)
from rsfstudy.fitting.whiteness_test import compute_ljung_box_p_value as compute_ljung_box_p_value

#: Names of the noise models: white noise, and an autoregressive process with an automatic order.
WHITE_NOISE_NAME, AUTOREGRESSIVE_NOISE_NAME = "white", "ar"
#: Highest order of the autoregressive process, and smallest number of rows per coefficient.
MAX_AUTOREGRESSIVE_ORDER, _MIN_SAMPLES_PER_COEFFICIENT = 12, 10
#: The first value is the largest absolute value of a partial autocorrelation. The search ends if
#: the gradient of the REML objective is less than the second value.
_MAX_PARTIAL_AUTOCORRELATION, _REML_GRADIENT_TOLERANCE = 0.999, 0.02
#: Largest number of iterations. Each iteration estimates the noise levels and the autoregressive
#: process.
_MAX_NOISE_LEVEL_REFINEMENT_PASSES = 2
#: Smallest noise level, relative to the root mean square of the residuals. The noise level is the
#: standard deviation of the noise in a segment of the record.
_MIN_NOISE_LEVEL_SD_OVER_RESIDUAL_RMS = 1e-3
#: Largest logarithm of the ratio of a noise level to the first noise level.
_MAX_LOG_NOISE_LEVEL_RATIO = 30.0


def check_noise_model_name(noise_model_name: str) -> None:
    """Raise ``InvalidValue`` if the name of a noise model is unknown.

    Parameters
    ----------
    noise_model_name : str
        Name of the noise model, such as "white", "ar" or "ar2".

    Raises
    ------
    InvalidValue
        If the name is unknown.
    """
    if noise_model_name not in (
        WHITE_NOISE_NAME,
        AUTOREGRESSIVE_NOISE_NAME,
        *(f"ar{order}" for order in range(1, MAX_AUTOREGRESSIVE_ORDER + 1)),
    ):
        rule = (
            f"must be {WHITE_NOISE_NAME!r}, {AUTOREGRESSIVE_NOISE_NAME!r}, or 'ar1' to "
            f"'ar{MAX_AUTOREGRESSIVE_ORDER}'"
        )
        raise InvalidValue("noise", noise_model_name, rule)


@dataclass(frozen=True)
class NoiseModel:
    """Noise model with an autoregressive process for each sampling interval.

    The noise level is the standard deviation of the noise, and may change along the record.

    Parameters
    ----------
    uniform_sampling_runs : tuple of UniformSamplingRun
        Runs of consecutive rows with the same noise process and noise level.
    partial_autocorrelations : ndarray, shape (processes, order)
        Partial autocorrelations of each autoregressive process.
    relative_noise_levels : ndarray, shape (levels,)
        Noise levels relative to the first noise level.
    non_outlier_mask : ndarray of bool, shape (rows,), optional
        Mask that is False for outliers. By default, no rows are outliers.
    correlation_from_averaging : NoiseCorrelationFromAveraging, optional
        Correlation due to averaging by a data logger. This correlation is removed before the
        autoregressive correlation.
    """

    uniform_sampling_runs: tuple[UniformSamplingRun, ...]
    partial_autocorrelations: np.ndarray
    relative_noise_levels: np.ndarray
    non_outlier_mask: np.ndarray | None = None
    correlation_from_averaging: NoiseCorrelationFromAveraging | None = None

    @property
    def autoregressive_order(self) -> int:
        """Order of the autoregressive processes."""
        return int(self.partial_autocorrelations.shape[1])

    def whiten_columns(self, sample_columns: np.ndarray) -> np.ndarray:
        """Remove the noise correlation from the columns of an array.

        Each value is replaced by its prediction error, divided by the standard deviation of the
        prediction error. The prediction uses earlier rows.

        Parameters
        ----------
        sample_columns : ndarray, shape (rows, columns)
            Array to whiten, including the rows of outliers.

        Returns
        -------
        ndarray, shape (kept rows, columns)
            Whitened array without the rows of outliers.
        """
        sample_columns = self.drop_outlier_rows(sample_columns)
        sample_columns = (
            sample_columns
            if self.correlation_from_averaging is None
            else self.correlation_from_averaging.whiten_columns(sample_columns)
        )
        scaled = (
            sample_columns
            / self.relative_noise_levels[
                expand_run_field_to_rows(self.uniform_sampling_runs, "noise_level_index")
            ][:, None]
        )
        found = np.empty_like(sample_columns)
        for run in self.uniform_sampling_runs:
            known = min(run.row_count_since_time_restart, self.autoregressive_order)
            part = scaled[run.start_row - known : run.stop_row]
            found[run.start_row : run.stop_row] = _compute_scaled_prediction_errors(
                part, *self.prediction_coefficients_and_variances[run.noise_process_index]
            )[known:]
        return found

    def drop_outlier_rows(self, sample_columns: np.ndarray) -> np.ndarray:
        """Remove the rows of outliers from an array.

        Parameters
        ----------
        sample_columns : ndarray, shape (rows, ...)
            Array with one entry per row.

        Returns
        -------
        ndarray, shape (kept rows, ...)
            Array without the rows of outliers.
        """
        return (
            sample_columns
            if self.non_outlier_mask is None
            else sample_columns[self.non_outlier_mask]
        )

    @cached_property
    def prediction_coefficients_and_variances(self) -> list[tuple[list[list[float]], list[float]]]:
        """Coefficients and error variances of the linear prediction, for each noise process.

        The list contains the result of ``_run_levinson_durbin_recursion`` for each noise process.
        """
        return [*map(_run_levinson_durbin_recursion, self.partial_autocorrelations)]

    @property
    def correlation_log_determinant(self) -> float:
        """Log-determinant of the correlation matrix R."""
        total = (
            0.0
            if self.correlation_from_averaging is None
            else self.correlation_from_averaging.correlation_log_determinant
        )
        for first, last, number, before, level in self.uniform_sampling_runs:
            variances = self.prediction_coefficients_and_variances[number][1]
            early = variances[
                min(before, self.autoregressive_order) : min(
                    before + last - first, self.autoregressive_order
                )
            ]
            total += math.fsum(map(math.log, early))
            total += (last - first - len(early)) * math.log(variances[-1])
            total += 2.0 * (last - first) * math.log(self.relative_noise_levels[level])
        return total

    @property
    def effective_sample_size(self) -> float:
        r"""Effective sample size for estimating a mean.

        The effective sample size is the number of rows :math:`n` divided by the ratio of the
        spectral power at zero frequency to the variance. This ratio is

        .. math:: \frac{(1 - k_1^2)(1 - k_2^2) \cdots}{(1 - c_1 - \dots - c_m)^2},

        where :math:`k_i` are the partial autocorrelations and :math:`c_i` are the coefficients. For
        an AR(1) process with correlation :math:`\rho`, the effective sample size is
        :math:`n (1 - \rho)/(1 + \rho)`.
        """
        power = self._zero_frequency_power_over_variance
        lasts = (
            (run.stop_row - run.start_row, run.noise_process_index)
            for run in self.uniform_sampling_runs
        )
        each = (
            1.0
            if self.correlation_from_averaging is None
            else self.correlation_from_averaging.row_count_per_independent_sample
        )
        return sum(max(1.0, rows / max(power[n], 1.0) / each) for rows, n in lasts)

    @property
    def _zero_frequency_power_over_variance(self) -> list[float]:
        """Power at zero frequency, divided by the variance, for each noise process."""
        told = ((c[-1], v[-1]) for c, v in self.prediction_coefficients_and_variances)
        return [left / (1.0 - math.fsum(last)) ** 2 for last, left in told]

    @property
    def low_frequency_noise_degrees_of_freedom(self) -> float:
        """Degrees of freedom of the estimated spectral power at zero frequency.

        The power at zero frequency determines the standard errors of slow trends. The degrees of
        freedom are 2 divided by the variance of the logarithm of the power. The variance includes
        the uncertainty of the estimated coefficients.
        """
        total = 0.0
        rows = np.bincount(
            expand_run_field_to_rows(self.uniform_sampling_runs, "noise_process_index")
        ).tolist()
        for count, told, power in zip(
            rows,
            self.prediction_coefficients_and_variances,
            self._zero_frequency_power_over_variance,
            strict=True,
        ):
            # The coefficients have the covariance matrix (innovation variance) R^-1/rows.
            ones = _compute_scaled_prediction_errors(np.ones((self.autoregressive_order, 1)), *told)
            total += count / (1.0 + 2.0 * power * float(np.square(ones).sum()))
        return total


def build_white_noise_model(time: np.ndarray) -> NoiseModel:
    """Return a white noise model with one noise level for each sampling interval.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Times in s.

    Returns
    -------
    NoiseModel
        White noise model. All noise levels are equal to 1.
    """
    runs = find_uniform_sampling_runs(time)
    return NoiseModel(
        runs, np.zeros((count_noise_processes(runs), 0)), np.ones(count_noise_processes(runs))
    )


def fit_noise_model(
    noise_model_name: str,
    time: np.ndarray,
    residuals: np.ndarray,
    jacobian: np.ndarray,
    non_outlier_mask: np.ndarray | None = None,
    min_noise_sd: float = 0.0,
    averaging_time: float = 0.0,
) -> NoiseModel:
    """Estimate the noise by REML from the residuals of a fit.

    Parameters
    ----------
    noise_model_name : str
        Noise model: "white" for white noise, "ar" for the autoregressive order that minimises the
        AIC, or "ar1", "ar2" and so on for a fixed order.
    time : ndarray, shape (rows,)
        Times in s.
    residuals : ndarray, shape (rows,)
        Residuals of the fit.
    jacobian : ndarray, shape (rows, parameters)
        Derivatives of the model with respect to the parameters.
    non_outlier_mask : ndarray of bool, shape (rows,), optional
        Mask that is False for outliers. By default, no rows are outliers.
    min_noise_sd : float, default: 0.0
        Lower bound on the noise levels, for example the standard deviation of rounding errors.
    averaging_time : float, default: 0.0
        Averaging time of friction in s, or 0 if friction was not averaged.

    Returns
    -------
    NoiseModel
        Noise model with one process for each sampling interval, and one noise level for each
        segment of the record.
    """
    begin, min_noise_sd = estimate_noise_model_by_moments(
        noise_model_name, time, residuals, non_outlier_mask, min_noise_sd, averaging_time
    )
    shape, order = begin.partial_autocorrelations.shape, begin.autoregressive_order
    if not order and len(begin.relative_noise_levels) == 1:
        return begin

    def noise(x: np.ndarray) -> NoiseModel:
        partial = _MAX_PARTIAL_AUTOCORRELATION * np.tanh(
            x[: begin.partial_autocorrelations.size]
        ).reshape(shape)
        logs = np.clip(
            x[begin.partial_autocorrelations.size :],
            -_MAX_LOG_NOISE_LEVEL_RATIO,
            _MAX_LOG_NOISE_LEVEL_RATIO,
        )
        sizes = np.exp(np.append(0.0, logs))
        return NoiseModel(
            begin.uniform_sampling_runs,
            partial,
            np.maximum(sizes, min_noise_sd),
            non_outlier_mask,
            begin.correlation_from_averaging,
        )

    columns = begin.drop_outlier_rows(np.column_stack([jacobian, residuals]))
    columns = (
        columns
        if begin.correlation_from_averaging is None
        else begin.correlation_from_averaging.whiten_columns(columns)
    )
    products = _LaggedProductSums(begin.uniform_sampling_runs, columns, order)

    def misfit(x: np.ndarray) -> float:
        return products.compute_restricted_likelihood_objective(noise(x))

    x = np.append(
        np.arctanh(begin.partial_autocorrelations.ravel() / _MAX_PARTIAL_AUTOCORRELATION),
        np.log(begin.relative_noise_levels[1:]),
    )
    if not math.isfinite(misfit(x)):  # All residuals are zero.
        return noise(x)
    # The objective function may be infinite for some partial autocorrelations that the search
    # evaluates.
    with np.errstate(invalid="ignore", over="ignore"):
        found = minimize(misfit, x, method="BFGS", options={"gtol": _REML_GRADIENT_TOLERANCE})
    return noise(found.x if found.fun <= misfit(x) else x)


def estimate_noise_model_by_moments(
    noise_model_name: str,
    time: np.ndarray,
    residuals: np.ndarray,
    non_outlier_mask: np.ndarray | None = None,
    min_noise_sd: float = 0.0,
    averaging_time: float = 0.0,
) -> tuple[NoiseModel, float]:
    """Estimate the noise by the method of moments from the residuals of a fit.

    Parameters
    ----------
    noise_model_name : str
        Noise model (see ``fit_noise_model``).
    time : ndarray, shape (rows,)
        Times in s.
    residuals : ndarray, shape (rows,)
        Residuals of the fit.
    non_outlier_mask : ndarray of bool, shape (rows,), optional
        Mask that is False for outliers. By default, no rows are outliers.
    min_noise_sd : float, default: 0.0
        Lower bound on the noise levels.
    averaging_time : float, default: 0.0
        Averaging time of friction in s, or 0 if friction was not averaged.

    Returns
    -------
    noise : NoiseModel
        Noise model of the record.
    min_noise_sd : float
        Lower bound on the noise levels, relative to the first noise level.
    """
    if non_outlier_mask is not None:
        time, residuals = time[non_outlier_mask], residuals[non_outlier_mask]
    overlap = NoiseCorrelationFromAveraging(time, averaging_time) if averaging_time else None
    if overlap is not None:
        residuals = overlap.whiten_columns(residuals)
    min_noise_sd = max(
        min_noise_sd,
        _MIN_NOISE_LEVEL_SD_OVER_RESIDUAL_RMS * math.sqrt(float(np.mean(np.square(residuals)))),
        1e-300,
    )
    found, first = _estimate_noise_of_runs_by_moments(
        noise_model_name, find_uniform_sampling_runs(time), residuals, min_noise_sd
    )
    return replace(
        found, non_outlier_mask=non_outlier_mask, correlation_from_averaging=overlap
    ), min_noise_sd / first


def _estimate_noise_of_runs_by_moments(
    noise_model_name: str,
    sampling_runs: tuple[UniformSamplingRun, ...],
    residuals: np.ndarray,
    min_noise_sd: float,
) -> tuple[NoiseModel, float]:
    """Estimate the noise model and the noise levels by the method of moments.

    Returns
    -------
    noise : NoiseModel
        Noise model with noise levels relative to the first noise level.
    first : float
        First noise level.
    """
    stated, count = (
        noise_model_name.removeprefix(AUTOREGRESSIVE_NOISE_NAME),
        count_noise_processes(sampling_runs),
    )
    runs, knots, innovations = sampling_runs, list[int](), residuals
    scale = np.ones(len(residuals))
    for _ in range(1 + _MAX_NOISE_LEVEL_REFINEMENT_PASSES):
        levels = expand_run_field_to_rows(runs, "noise_level_index")
        squares = np.bincount(levels, np.square(innovations)) / np.bincount(levels)
        scale = np.maximum(scale * np.sqrt(squares)[levels], min_noise_sd)
        scaled = residuals / scale
        parts = [
            [scaled[r.start_row : r.stop_row] for r in sampling_runs if r.noise_process_index == n]
            for n in range(count)
        ]
        order = (
            0
            if noise_model_name == WHITE_NOISE_NAME
            else int(stated)
            if stated
            else _select_autoregressive_order(parts)
        )
        partial = np.array([_estimate_burg_coefficients(part, order) for part in parts]).reshape(
            count, order
        )
        sizes = scale[np.unique(levels, return_index=True)[1]]
        found = NoiseModel(runs, partial, sizes)
        innovations = found.whiten_columns(residuals[:, None])[:, 0]
        before, knots = knots, find_noise_level_changes(innovations * scale, min_noise_sd)
        if knots == before:
            break
        runs = split_runs_at_noise_level_changes(sampling_runs, knots)
    first = float(found.relative_noise_levels[0])
    return NoiseModel(
        found.uniform_sampling_runs,
        found.partial_autocorrelations,
        found.relative_noise_levels / first,
    ), first


class _LaggedProductSums:
    """Sums of products of each row with the preceding rows.

    The sum of squares of whitened columns can be computed from the sums of products for any
    autoregressive coefficients. The computing time of the search is therefore independent of the
    number of rows.

    Parameters
    ----------
    sampling_runs : tuple of UniformSamplingRun
        Runs of consecutive rows with the same noise process and noise level.
    columns : ndarray, shape (rows, columns)
        Derivatives of the model, followed by the residuals.
    autoregressive_order : int
        Order of the autoregressive processes.
    """

    def __init__(
        self,
        sampling_runs: Sequence[UniformSamplingRun],
        columns: np.ndarray,
        autoregressive_order: int,
    ) -> None:
        self.row_count, self.parameter_count = len(columns), columns.shape[1] - 1
        # The derivatives may be almost linearly dependent, so they are replaced by an orthonormal
        # basis. The replacement changes the objective function only by a constant.
        base, left = np.linalg.qr(columns[:, :-1])[0], columns[:, -1]
        left = left - base @ (base.T @ left)
        columns = np.column_stack([base, left / (np.linalg.norm(left) or 1.0)])
        width = columns.shape[1]
        self.noise_levels_of_processes = sorted(
            {(run.noise_process_index, run.noise_level_index) for run in sampling_runs}
        )
        self.lagged_product_sums = np.zeros(
            (
                len(self.noise_levels_of_processes),
                autoregressive_order + 1,
                autoregressive_order + 1,
                width,
                width,
            )
        )
        #: Properties of the first rows of each run. The first item is an array with the first rows
        #: of the run, and with the earlier rows from which the first rows are predicted. The other
        #: items are the number of earlier rows, the index of the noise process, and the noise
        #: levels of all rows in the array.
        self.initial_row_blocks: list[tuple[np.ndarray, int, int, np.ndarray]] = []
        levels = expand_run_field_to_rows(sampling_runs, "noise_level_index")
        for run in sampling_runs:
            known = min(run.row_count_since_time_restart, autoregressive_order)
            rows = slice(
                run.start_row - known, min(run.start_row + autoregressive_order, run.stop_row)
            )
            if autoregressive_order:
                self.initial_row_blocks.append(
                    (columns[rows], known, run.noise_process_index, levels[rows])
                )
            part = columns[run.start_row : run.stop_row]
            later = [
                part[autoregressive_order - lag : len(part) - lag]
                for lag in range(autoregressive_order + 1)
            ]
            sums = self.lagged_product_sums[
                self.noise_levels_of_processes.index(
                    (run.noise_process_index, run.noise_level_index)
                )
            ]
            for i in range(autoregressive_order + 1 if len(part) > autoregressive_order else 0):
                for j in range(i + 1):
                    found = later[i].T @ later[j]
                    sums[i, j] += found
                    if i > j:
                        sums[j, i] += found.T

    def compute_restricted_likelihood_objective(self, noise_model: NoiseModel) -> float:
        """Compute the REML objective function up to a constant.

        Parameters
        ----------
        noise_model : NoiseModel
            Noise model with the same sampling runs and the same autoregressive order.

        Returns
        -------
        float
            Value of the objective function, or infinity if all residuals are zero.
        """
        total = np.zeros(self.lagged_product_sums.shape[-2:])
        for (number, level), sums in zip(
            self.noise_levels_of_processes, self.lagged_product_sums, strict=True
        ):
            coefficients, variances = noise_model.prediction_coefficients_and_variances[number]
            full = np.append(1.0, -np.array(coefficients[-1]))
            scale = variances[-1] * noise_model.relative_noise_levels[level] ** 2
            total += np.einsum("i,j,ijab->ab", full, full, sums) / scale
        for early, known, number, levels in self.initial_row_blocks:
            scaled = early / noise_model.relative_noise_levels[levels][:, None]
            begun = _compute_scaled_prediction_errors(
                scaled, *noise_model.prediction_coefficients_and_variances[number]
            )[known:]
            total += begun.T @ begun
        try:
            triangle = np.diag(np.linalg.cholesky(total))
        except np.linalg.LinAlgError:
            return math.inf
        free = self.row_count - self.parameter_count
        told = 2.0 * math.fsum(map(math.log, triangle[:-1]))
        return float(
            2.0 * free * math.log(triangle[-1]) + noise_model.correlation_log_determinant + told
        )


def _select_autoregressive_order(residual_runs_per_process: Sequence[Sequence[np.ndarray]]) -> int:
    r"""Return the autoregressive order that minimises the AIC.

    For each noise process with :math:`n` samples and Burg coefficients :math:`k_i`, the AIC is
    :math:`n \sum_{i=1}^m \ln(1 - k_i^2) + 2 m`. The AIC is summed over the noise processes.
    """
    shortest = min(max(map(len, part)) for part in residual_runs_per_process)
    highest = min(MAX_AUTOREGRESSIVE_ORDER, shortest // _MIN_SAMPLES_PER_COEFFICIENT)
    criterion = np.zeros(highest + 1)
    for part in residual_runs_per_process:
        samples = sum(map(len, part))
        left = np.cumsum(np.log1p(-(np.array(_estimate_burg_coefficients(part, highest)) ** 2)))
        criterion[1:] += samples * left + 2.0 * np.arange(1, highest + 1)
    return int(np.argmin(criterion))


def _estimate_burg_coefficients(residual_runs: Sequence[np.ndarray], order: int) -> list[float]:
    """Estimate partial autocorrelations with the Burg method."""
    forward, backward = [[p - p.mean() for p in residual_runs] for _ in range(2)]
    found = []
    for _ in range(order):
        ahead = [f[1:] for f in forward if len(f) > 1]
        behind = [b[:-1] for b in backward if len(b) > 1]
        above = sum(float(f @ b) for f, b in zip(ahead, behind, strict=True))
        below = sum(float(f @ f + b @ b) for f, b in zip(ahead, behind, strict=True))
        k = 2.0 * above / below if below > 0.0 else 0.0
        found.append(
            min(max(k, -0.99 * _MAX_PARTIAL_AUTOCORRELATION), 0.99 * _MAX_PARTIAL_AUTOCORRELATION)
        )
        forward = [f - found[-1] * b for f, b in zip(ahead, behind, strict=True)]
        backward = [b - found[-1] * f for f, b in zip(ahead, behind, strict=True)]
    return found


def _run_levinson_durbin_recursion(
    partial_autocorrelations: Sequence[float] | np.ndarray,
) -> tuple[list[list[float]], list[float]]:
    """Compute prediction coefficients with the Levinson-Durbin recursion.

    Returns
    -------
    coefficients : list of list of float
        Coefficients for predicting a row from the m previous rows, in order of increasing lag. The
        list contains one item for each m from 0 to the order.
    variances : list of float
        Variance of the prediction error for each m, relative to the variance of the process.
    """
    coefficients: list[list[float]] = [[]]
    variances = [1.0]
    for k in map(float, partial_autocorrelations):
        last = coefficients[-1]
        turned = [c - k * d for c, d in zip(last, reversed(last), strict=True)]
        coefficients.append([*turned, k])
        variances.append(variances[-1] * (1.0 - k * k))
    return coefficients, variances


def _compute_scaled_prediction_errors(
    sample_columns: np.ndarray, coefficients: list[list[float]], variances: list[float]
) -> np.ndarray:
    """Compute prediction errors divided by their standard deviations."""
    full = np.append(1.0, -np.array(coefficients[-1]))
    # The function ``lfilter`` rejects empty arrays.
    is_plain = len(full) == 1 or not sample_columns.size
    found = (
        sample_columns.copy()
        if is_plain
        else np.asarray(lfilter(full, [1.0], sample_columns, axis=0))
    )
    for row, told in enumerate(coefficients[: min(len(coefficients) - 1, len(sample_columns))]):
        found[row] = sample_columns[row] - np.array(told) @ sample_columns[:row][::-1]
        found[row] /= math.sqrt(variances[row])
    found[len(coefficients) - 1 :] /= math.sqrt(variances[-1])
    return found
