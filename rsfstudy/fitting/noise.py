"""White and autoregressive models of the noise of a record.

The autoregressive coefficients are estimated by restricted maximum likelihood (REML), which
accounts for the noise that the fit absorbs. Let J be the derivatives of the model, R the
correlation matrix of the noise, p the number of parameters and n the number of rows. REML minimises

    (n - p) ln(S/(n - p)) + ln|R| + ln|J' R^-1 J|,

where S is the sum of squared residuals of generalised least squares. Rows with another sampling
interval have another noise process, with its own standard deviation and correlation. If the
sampling interval changes, the rows before the change still predict the rows after it, scaled by the
ratio of the standard deviations.

The process is ``e_i = c_1 e_(i-1) + ... + c_m e_(i-m) + w_i`` with white noise w. The process is
stationary if its partial autocorrelations are between -1 and 1. The search therefore varies the
partial autocorrelations.

References
----------
Patterson and Thompson (1971), Biometrika 58, 545-554, for REML; Burg (1967), Proc. 37th Meeting of
the Society of Exploration Geophysicists, for the initial guess; Barndorff-Nielsen and Schou (1973),
J. Multivar. Anal. 3, 408-419, for partial autocorrelations; Ljung and Box (1978), Biometrika 65,
297-303.
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
from rsfstudy.fitting.averaging import AveragingCorrelation
from rsfstudy.fitting.sampling_runs import (
    SamplingRun,
    count_processes,
    find_level_changes,
    find_runs,
    index_rows,
    split_runs,
)
from rsfstudy.fitting.whiteness_test import LAG_COUNT as LAG_COUNT
from rsfstudy.fitting.whiteness_test import ljung_box_p_value as ljung_box_p_value

WHITE, AUTOREGRESSIVE = "white", "ar"
#: Highest order that is looked for, and samples that each coefficient takes at least.
MAX_ORDER, _SAMPLES_PER_COEFFICIENT = 12, 10
#: Largest partial correlation, and slope of what REML minimises at which the search ends.
_MAX_PARTIAL_AUTOCORRELATION, _GRADIENT_TOLERANCE = 0.999, 0.02
#: Passes in which the noise levels and the autoregressive process are estimated in turn.
_LEVEL_PASSES = 2
#: Smallest standard deviation of a level, relative to that of all residuals.
_MIN_RELATIVE_SD = 1e-3
#: Largest logarithm of a level relative to the first one.
_MAX_LOG_LEVEL_RATIO = 30.0


def check_noise_name(name: str) -> None:
    """Raise ``InvalidValue`` if the name of a noise model is unknown."""
    if name not in (WHITE, AUTOREGRESSIVE, *(f"ar{order}" for order in range(1, MAX_ORDER + 1))):
        choices = (WHITE, AUTOREGRESSIVE, f"ar1 to ar{MAX_ORDER}")
        raise InvalidValue("noise", name, "is unknown", choices=choices)


@dataclass(frozen=True)
class NoiseModel:
    """Noise of a record, with an autoregressive process for each sampling interval.

    The standard deviation of the noise (its level) may also change along the record.

    Attributes
    ----------
    runs : tuple of SamplingRun
    partial_autocorrelations : ndarray, shape (processes, order)
        Partial autocorrelations of each process.
    level_sds : ndarray, shape (levels,)
        Standard deviation of each level, relative to the first level.
    kept_mask : ndarray of bool, shape (rows,), optional
        False for outliers, which are excluded. By default, all rows are kept.
    averaging_correlation : AveragingCorrelation, optional
        Correlation due to averaging, which is removed before the correlation of the process.
    """

    runs: tuple[SamplingRun, ...]
    partial_autocorrelations: np.ndarray
    level_sds: np.ndarray
    kept_mask: np.ndarray | None = None
    averaging_correlation: AveragingCorrelation | None = None

    @property
    def order(self) -> int:
        """Order of the autoregressive processes."""
        return int(self.partial_autocorrelations.shape[1])

    def whiten(self, columns: np.ndarray) -> np.ndarray:
        """Remove the correlation of the noise from columns.

        Each row is replaced by its prediction error, divided by the standard error of the
        prediction from earlier rows.

        Parameters
        ----------
        columns : ndarray, shape (rows, columns)

        Returns
        -------
        ndarray, shape (kept rows, columns)
        """
        columns = self.drop_outliers(columns)
        columns = (
            columns
            if self.averaging_correlation is None
            else self.averaging_correlation.whiten(columns)
        )
        scaled = columns / self.level_sds[index_rows(self.runs, "level")][:, None]
        found = np.empty_like(columns)
        for run in self.runs:
            known = min(run.preceding_rows, self.order)
            part = scaled[run.start - known : run.stop]
            found[run.start : run.stop] = _prediction_errors(part, *self.predictors[run.process])[
                known:
            ]
        return found

    def drop_outliers(self, columns: np.ndarray) -> np.ndarray:
        """Remove the rows of outliers from columns."""
        return columns if self.kept_mask is None else columns[self.kept_mask]

    @cached_property
    def predictors(self) -> list[tuple[list[list[float]], list[float]]]:
        """Coefficients and variances of each process (see ``_levinson_durbin``)."""
        return [*map(_levinson_durbin, self.partial_autocorrelations)]

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the correlation matrix R."""
        total = (
            0.0
            if self.averaging_correlation is None
            else self.averaging_correlation.log_determinant
        )
        for first, last, number, before, level in self.runs:
            variances = self.predictors[number][1]
            early = variances[min(before, self.order) : min(before + last - first, self.order)]
            total += math.fsum(map(math.log, early))
            total += (last - first - len(early)) * math.log(variances[-1])
            total += 2.0 * (last - first) * math.log(self.level_sds[level])
        return total

    @property
    def effective_sample_size(self) -> float:
        """Effective sample size for a mean.

        The effective sample size is n divided by the power at zero frequency, ``(1 - k_1^2)(1 -
        k_2^2).../(1 - c_1 - ... - c_m)^2``, where k are the partial autocorrelations. For an AR(1)
        process, the effective sample size is ``n (1 - rho)/(1 + rho)``.
        """
        power = self._power_at_zero
        lasts = ((run.stop - run.start, run.process) for run in self.runs)
        each = (
            1.0
            if self.averaging_correlation is None
            else self.averaging_correlation.rows_per_independent_row
        )
        return sum(max(1.0, rows / max(power[n], 1.0) / each) for rows, n in lasts)

    @property
    def _power_at_zero(self) -> list[float]:
        """Power at zero frequency of each process, divided by its variance."""
        told = ((c[-1], v[-1]) for c, v in self.predictors)
        return [left / (1.0 - math.fsum(last)) ** 2 for last, left in told]

    @property
    def degrees_of_freedom(self) -> float:
        """Degrees of freedom of the power at zero frequency.

        This power determines the errors of slow trends. The degrees of freedom are 2 divided by the
        variance of the logarithm of the power. The variance includes the uncertainty of the
        estimated coefficients.
        """
        total = 0.0
        rows = np.bincount(index_rows(self.runs, "process")).tolist()
        for count, told, power in zip(rows, self.predictors, self._power_at_zero, strict=True):
            # coefficients have the covariance (variance left) R^-1/rows
            ones = _prediction_errors(np.ones((self.order, 1)), *told)
            total += count / (1.0 + 2.0 * power * float(np.square(ones).sum()))
        return total


def white_noise(time: np.ndarray) -> NoiseModel:
    """Return white noise with one level for each sampling interval."""
    runs = find_runs(time)
    return NoiseModel(runs, np.zeros((count_processes(runs), 0)), np.ones(count_processes(runs)))


def fit_noise(
    name: str,
    time: np.ndarray,
    residuals: np.ndarray,
    jacobian: np.ndarray,
    kept_mask: np.ndarray | None = None,
    min_sd: float = 0.0,
    averaging_time: float = 0.0,
) -> NoiseModel:
    """Estimate the noise from the residuals of a fit by REML.

    Parameters
    ----------
    name : str
        "white", "ar" for the order that minimises the AIC, or "ar1", "ar2" and so on.
    time : ndarray, shape (rows,)
    residuals : ndarray, shape (rows,)
    jacobian : ndarray, shape (rows, parameters)
        Derivatives of the model.
    kept_mask : ndarray of bool, shape (rows,), optional
        False for outliers. By default, all rows are kept.
    min_sd : float
        Lower bound of the standard deviation of a level, such as the rounding error.
    averaging_time : float
        Averaging time of friction in s, or 0 if friction was not averaged.

    Returns
    -------
    NoiseModel
        Noise with one process for each sampling interval, and one level for each segment.
    """
    begin, min_sd = guess_noise(name, time, residuals, kept_mask, min_sd, averaging_time)
    shape, order = begin.partial_autocorrelations.shape, begin.order
    if not order and len(begin.level_sds) == 1:
        return begin

    def noise(x: np.ndarray) -> NoiseModel:
        partial = _MAX_PARTIAL_AUTOCORRELATION * np.tanh(
            x[: begin.partial_autocorrelations.size]
        ).reshape(shape)
        logs = np.clip(
            x[begin.partial_autocorrelations.size :], -_MAX_LOG_LEVEL_RATIO, _MAX_LOG_LEVEL_RATIO
        )
        sizes = np.exp(np.append(0.0, logs))
        return NoiseModel(
            begin.runs, partial, np.maximum(sizes, min_sd), kept_mask, begin.averaging_correlation
        )

    columns = begin.drop_outliers(np.column_stack([jacobian, residuals]))
    columns = (
        columns
        if begin.averaging_correlation is None
        else begin.averaging_correlation.whiten(columns)
    )
    products = _LaggedProducts(begin.runs, columns, order)

    def misfit(x: np.ndarray) -> float:
        return products.reml_objective(noise(x))

    x = np.append(
        np.arctanh(begin.partial_autocorrelations.ravel() / _MAX_PARTIAL_AUTOCORRELATION),
        np.log(begin.level_sds[1:]),
    )
    if not math.isfinite(misfit(x)):  # the residuals vanish
        return noise(x)
    with np.errstate(invalid="ignore", over="ignore"):  # the misfit may be infinite near by
        found = minimize(misfit, x, method="BFGS", options={"gtol": _GRADIENT_TOLERANCE})
    return noise(found.x if found.fun <= misfit(x) else x)


def guess_noise(
    name: str,
    time: np.ndarray,
    residuals: np.ndarray,
    kept_mask: np.ndarray | None = None,
    min_sd: float = 0.0,
    averaging_time: float = 0.0,
) -> tuple[NoiseModel, float]:
    """Estimate the noise by the method of moments.

    See ``fitted`` for the parameters.

    Returns
    -------
    noise : NoiseModel
    min_sd : float
        Lower bound of the standard deviation of a level, relative to the first level.
    """
    if kept_mask is not None:
        time, residuals = time[kept_mask], residuals[kept_mask]
    overlap = AveragingCorrelation(time, averaging_time) if averaging_time else None
    if overlap is not None:
        residuals = overlap.whiten(residuals)
    min_sd = max(min_sd, _MIN_RELATIVE_SD * math.sqrt(float(np.mean(np.square(residuals)))), 1e-300)
    found, first = _estimate_by_moments(name, find_runs(time), residuals, min_sd)
    return replace(found, kept_mask=kept_mask, averaging_correlation=overlap), min_sd / first


def _estimate_by_moments(
    name: str, sampling_runs: tuple[SamplingRun, ...], residuals: np.ndarray, min_sd: float
) -> tuple[NoiseModel, float]:
    """Compute the initial guess of the noise by the method of moments.

    Returns
    -------
    noise : NoiseModel
    first : float
        Standard deviation of the first level.
    """
    stated, count = name.removeprefix(AUTOREGRESSIVE), count_processes(sampling_runs)
    runs, knots, innovations = sampling_runs, list[int](), residuals
    scale = np.ones(len(residuals))
    for _ in range(1 + _LEVEL_PASSES):
        levels = index_rows(runs, "level")
        squares = np.bincount(levels, np.square(innovations)) / np.bincount(levels)
        scale = np.maximum(scale * np.sqrt(squares)[levels], min_sd)
        scaled = residuals / scale
        parts = [
            [scaled[r.start : r.stop] for r in sampling_runs if r.process == n]
            for n in range(count)
        ]
        order = 0 if name == WHITE else int(stated) if stated else _select_order(parts)
        partial = np.array([_burg_coefficients(part, order) for part in parts]).reshape(
            count, order
        )
        sizes = scale[np.unique(levels, return_index=True)[1]]
        found = NoiseModel(runs, partial, sizes)
        innovations = found.whiten(residuals[:, None])[:, 0]
        before, knots = knots, find_level_changes(innovations * scale, min_sd)
        if knots == before:
            break
        runs = split_runs(sampling_runs, knots)
    first = float(found.level_sds[0])
    return NoiseModel(found.runs, found.partial_autocorrelations, found.level_sds / first), first


class _LaggedProducts:
    """Sums of products of lagged columns.

    The sum of squares of whitened columns follows from these sums for any coefficients. The cost of
    the search is therefore independent of the number of rows.

    Parameters
    ----------
    runs : tuple of SamplingRun
    columns : ndarray, shape (rows, columns)
        Derivatives of the model, followed by the residuals.
    order : int
        Order of the autoregressive processes.
    """

    def __init__(self, runs: Sequence[SamplingRun], columns: np.ndarray, order: int) -> None:
        self.row_count, self.parameter_count = len(columns), columns.shape[1] - 1
        # derivatives may be next to dependent: those of the same span are as good, up to a constant
        base, left = np.linalg.qr(columns[:, :-1])[0], columns[:, -1]
        left = left - base @ (base.T @ left)
        columns = np.column_stack([base, left / (np.linalg.norm(left) or 1.0)])
        width = columns.shape[1]
        self.process_levels = sorted({(run.process, run.level) for run in runs})
        self.sums = np.zeros((len(self.process_levels), order + 1, order + 1, width, width))
        #: For each run: the first rows and the rows before them that predict them, the number of
        #: rows before them, the process of the run, and the levels of these rows.
        self.initial_blocks: list[tuple[np.ndarray, int, int, np.ndarray]] = []
        levels = index_rows(runs, "level")
        for run in runs:
            known = min(run.preceding_rows, order)
            rows = slice(run.start - known, min(run.start + order, run.stop))
            if order:
                self.initial_blocks.append((columns[rows], known, run.process, levels[rows]))
            part = columns[run.start : run.stop]
            later = [part[order - lag : len(part) - lag] for lag in range(order + 1)]
            sums = self.sums[self.process_levels.index((run.process, run.level))]
            for i in range(order + 1 if len(part) > order else 0):
                for j in range(i + 1):
                    found = later[i].T @ later[j]
                    sums[i, j] += found
                    if i > j:
                        sums[j, i] += found.T

    def reml_objective(self, noise: NoiseModel) -> float:
        """Compute the objective function of REML, up to a constant.

        Returns
        -------
        float
            Infinity if the residuals vanish.
        """
        total = np.zeros(self.sums.shape[-2:])
        for (number, level), sums in zip(self.process_levels, self.sums, strict=True):
            coefficients, variances = noise.predictors[number]
            full = np.append(1.0, -np.array(coefficients[-1]))
            scale = variances[-1] * noise.level_sds[level] ** 2
            total += np.einsum("i,j,ijab->ab", full, full, sums) / scale
        for early, known, number, levels in self.initial_blocks:
            scaled = early / noise.level_sds[levels][:, None]
            begun = _prediction_errors(scaled, *noise.predictors[number])[known:]
            total += begun.T @ begun
        try:
            triangle = np.diag(np.linalg.cholesky(total))
        except np.linalg.LinAlgError:
            return math.inf
        free = self.row_count - self.parameter_count
        told = 2.0 * math.fsum(map(math.log, triangle[:-1]))
        return float(2.0 * free * math.log(triangle[-1]) + noise.log_determinant + told)


def _select_order(parts: Sequence[Sequence[np.ndarray]]) -> int:
    """Return the autoregressive order that minimises Akaike's criterion."""
    shortest = min(max(map(len, part)) for part in parts)
    highest = min(MAX_ORDER, shortest // _SAMPLES_PER_COEFFICIENT)
    criterion = np.zeros(highest + 1)
    for part in parts:
        samples = sum(map(len, part))
        left = np.cumsum(np.log1p(-(np.array(_burg_coefficients(part, highest)) ** 2)))
        criterion[1:] += samples * left + 2.0 * np.arange(1, highest + 1)
    return int(np.argmin(criterion))


def _burg_coefficients(part: Sequence[np.ndarray], order: int) -> list[float]:
    """Estimate partial autocorrelations by Burg's recursion."""
    forward, backward = [[p - p.mean() for p in part] for _ in range(2)]
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


def _levinson_durbin(
    partial: Sequence[float] | np.ndarray,
) -> tuple[list[list[float]], list[float]]:
    """Compute prediction coefficients by the Levinson-Durbin recursion.

    Returns
    -------
    coefficients : list of list of float
        Coefficients that predict a row from the previous 0, 1, 2, ... rows, in order of increasing
        lag.
    variances : list of float
        Variance of each prediction error, relative to the variance of the process.
    """
    coefficients: list[list[float]] = [[]]
    variances = [1.0]
    for k in map(float, partial):
        last = coefficients[-1]
        turned = [c - k * d for c, d in zip(last, reversed(last), strict=True)]
        coefficients.append([*turned, k])
        variances.append(variances[-1] * (1.0 - k * k))
    return coefficients, variances


def _prediction_errors(
    columns: np.ndarray, coefficients: list[list[float]], variances: list[float]
) -> np.ndarray:
    """Compute prediction errors divided by their standard errors."""
    full = np.append(1.0, -np.array(coefficients[-1]))
    is_plain = len(full) == 1 or not columns.size  # lfilter refuses empty arrays
    found = columns.copy() if is_plain else np.asarray(lfilter(full, [1.0], columns, axis=0))
    for row, told in enumerate(coefficients[: min(len(coefficients) - 1, len(columns))]):
        found[row] = columns[row] - np.array(told) @ columns[:row][::-1]
        found[row] /= math.sqrt(variances[row])
    found[len(coefficients) - 1 :] /= math.sqrt(variances[-1])
    return found
