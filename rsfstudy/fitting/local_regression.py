r"""Functions that fit linear models and local polynomials by generalised least squares.

The maximum of noisy samples overestimates the height of a peak. The last sample before a sudden
change is only a noisy estimate of the value before the change. The functions of this module
therefore fit a polynomial to the samples in a window. A window that is too long biases the
polynomial, and a window that is too short increases the variance of the polynomial. The function
``choose_longest_polynomial_window`` selects the longest window in which a polynomial describes the
samples within their noise. The estimate then uses a polynomial of higher degree in the same window,
so that the bias of the estimate is small compared with its standard error [1]_.

References
----------
.. [1] Calonico, Cattaneo and Titiunik (2014), Econometrica 82, 2295-2326.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from rsfstudy.fitting.noise_models import (
    AUTOREGRESSIVE_NOISE_NAME,
    NoiseModel,
    estimate_noise_model_by_moments,
    fit_noise_model,
)
from rsfstudy.fitting.outliers import find_non_outlier_mask, find_rounding_quantum
from rsfstudy.fitting.uniform_sampling_runs import UniformSamplingRun

#: Number of times that the noise and the coefficients are estimated in turn.
_NOISE_ESTIMATION_PASSES = 2
#: A polynomial does not describe the samples if two further terms reduce the sum of squares by more
#: than this number of noise variances. The limit is the 99.9 % quantile of the chi-squared
#: distribution with two degrees of freedom.
_MAX_CHI_SQUARED_OF_HIGHER_TERMS = 13.8
#: Number of successive windows that may be rejected by chance. If more windows are rejected in
#: succession, longer windows are not tested.
_MAX_SUCCESSIVE_REJECTED_WINDOWS = 1
#: Smallest standard deviation of the noise, relative to the range of the values.
_MIN_NOISE_SD_OVER_RANGE_OF_VALUES = 1e-9


class GeneralisedLeastSquaresFit(NamedTuple):
    """Solution of a linear least-squares problem with correlated noise.

    Parameters
    ----------
    coefficients : ndarray, shape (parameters,)
        Estimated coefficients.
    coefficient_covariance : ndarray, shape (parameters, parameters)
        Covariance matrix of the coefficients.
    noise_model : NoiseModel
        Noise model of the residuals.
    noise_sd : float
        Standard deviation of the noise at the first noise level.
    """

    coefficients: np.ndarray
    coefficient_covariance: np.ndarray
    noise_model: NoiseModel
    noise_sd: float


def fit_linear_model(
    time: np.ndarray,
    values: np.ndarray,
    jacobian: np.ndarray,
    *,
    estimate_noise_by_moments: bool = False,
) -> GeneralisedLeastSquaresFit:
    """Fit a linear model by generalised least squares.

    The noise is an autoregressive process, whose coefficients are estimated by restricted maximum
    likelihood (see ``rsfstudy.fitting.noise_models``). Outliers are excluded from the fit.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Times in s. If the rows belong to several windows, the time restarts in each window.
    values : ndarray, shape (rows,)
        Values to fit.
    jacobian : ndarray, shape (rows, parameters)
        Derivatives of the model with respect to the coefficients.
    estimate_noise_by_moments : bool, default: False
        If True, the noise is estimated by the method of moments.

    Returns
    -------
    GeneralisedLeastSquaresFit
        Coefficients, their covariance matrix and the noise.
    """
    coefficients = np.linalg.lstsq(jacobian, values)[0]
    quantum = find_rounding_quantum(values)
    least = max(
        quantum / math.sqrt(12.0), _MIN_NOISE_SD_OVER_RANGE_OF_VALUES * float(np.ptp(values)), 1e-12
    )
    for _ in range(_NOISE_ESTIMATION_PASSES):
        curve = jacobian @ coefficients
        kept = find_non_outlier_mask(values - curve, curve, quantum)
        left = values - curve
        noise = (
            estimate_noise_model_by_moments(AUTOREGRESSIVE_NOISE_NAME, time, left, kept, least)[0]
            if estimate_noise_by_moments
            else fit_noise_model(AUTOREGRESSIVE_NOISE_NAME, time, left, jacobian, kept, least)
        )
        whitened = noise.whiten_columns(np.column_stack([jacobian, values]))
        coefficients = np.linalg.lstsq(whitened[:, :-1], whitened[:, -1])[0]
    left = whitened[:, -1] - whitened[:, :-1] @ coefficients
    noise_sd = max(float(np.linalg.norm(left)) / math.sqrt(len(left) - jacobian.shape[1]), least)
    root = np.linalg.pinv(whitened[:, :-1])
    return GeneralisedLeastSquaresFit(coefficients, noise_sd**2 * root @ root.T, noise, noise_sd)


def compute_weighted_mean(values: np.ndarray, stderrs: np.ndarray) -> tuple[float, float]:
    """Compute the mean of values, weighted by their inverse variances.

    Parameters
    ----------
    values, stderrs : ndarray, shape (n,)
        Values and their standard errors.

    Returns
    -------
    mean : float
        Weighted mean.
    stderr : float
        Standard error of the mean. If the values scatter more than their standard errors, the
        standard error of the mean is multiplied by the ratio of the scatter to the standard errors
        (Birge ratio).

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import compute_weighted_mean
    >>> mean, stderr = compute_weighted_mean(np.array([1.0, 2.0]), np.array([1.0, 1.0]))
    >>> round(mean, 3), round(stderr, 3)
    (1.5, 0.707)
    """
    weights = 1.0 / stderrs**2
    mean = float(weights @ values / weights.sum())
    ratio = float(weights @ (values - mean) ** 2) / max(len(values) - 1, 1)
    return mean, math.sqrt(max(1.0, ratio) / float(weights.sum()))


def choose_longest_polynomial_window(
    windows: Iterable[np.ndarray],
    coordinate: np.ndarray,
    values: np.ndarray,
    degree: int,
    noise_reference_fit: GeneralisedLeastSquaresFit,
) -> tuple[np.ndarray, bool]:
    """Select the longest window in which a polynomial fits the values within the noise.

    Parameters
    ----------
    windows : iterable of ndarray
        Row indices of the windows, from the shortest window to the longest window.
    coordinate, values : ndarray, shape (rows,)
        Coordinates and values of the samples.
    degree : int
        Degree of the polynomial.
    noise_reference_fit : GeneralisedLeastSquaresFit
        Fit of other rows of the record, which have the same noise.

    Returns
    -------
    rows : ndarray
        Row indices of the selected window. If the polynomial is not adequate in any window, the
        shortest window is selected.
    is_adequate : bool
        True if the polynomial describes the samples in the selected window.
    """
    partial = noise_reference_fit.noise_model.partial_autocorrelations[:1]
    chosen: np.ndarray | None = None
    shortest: np.ndarray | None = None
    rejected = 0
    for rows in windows:
        run = (UniformSamplingRun(0, len(rows), 0, 0, 0),)
        columns = polynomial.polyvander(rescale_to_minus_one_to_one(coordinate[rows]), degree + 2)
        whitened = NoiseModel(run, partial, np.ones(1)).whiten_columns(
            np.column_stack([columns, values[rows] - values[rows].mean()])
        )
        low, high = (
            _compute_polynomial_residual_squares(whitened, degree + more) for more in (0, 2)
        )
        if low - high > _MAX_CHI_SQUARED_OF_HIGHER_TERMS * noise_reference_fit.noise_sd**2:
            rejected += 1
            shortest = rows if shortest is None else shortest
            if rejected > _MAX_SUCCESSIVE_REJECTED_WINDOWS:
                break
            continue
        chosen, rejected = rows, 0
    if chosen is not None:
        return chosen, True
    return (np.zeros(0, dtype=int) if shortest is None else shortest), False


def rescale_to_minus_one_to_one(coordinate: np.ndarray) -> np.ndarray:
    """Map coordinates linearly to the interval from -1 to 1.

    Parameters
    ----------
    coordinate : ndarray, shape (rows,)
        Increasing coordinates.

    Returns
    -------
    ndarray, shape (rows,)
        Normalised coordinates.
    """
    return np.asarray(2.0 * (coordinate - coordinate[0]) / (coordinate[-1] - coordinate[0]) - 1.0)


def find_polynomial_maximum_position(coefficients: np.ndarray) -> float:
    """Find the highest local maximum of a polynomial between -1 and 1.

    Parameters
    ----------
    coefficients : ndarray, shape (degree + 1,)
        Coefficients in the order of increasing powers.

    Returns
    -------
    float
        Position of the maximum, or NaN if there is no local maximum.
    """
    slope = polynomial.polyder(coefficients)
    roots = polynomial.polyroots(slope)
    found = roots[np.abs(roots.imag) < 1e-9].real
    found = found[
        (np.abs(found) <= 1.0) & (polynomial.polyval(found, polynomial.polyder(slope)) < 0)
    ]
    values = polynomial.polyval(found, coefficients)
    return float(found[np.argmax(values)]) if len(found) else math.nan


def _compute_polynomial_residual_squares(
    polynomial_and_sample_columns: np.ndarray, degree: int
) -> float:
    """Fit a polynomial to the last column, and return the residual sum of squares."""
    basis = np.linalg.qr(polynomial_and_sample_columns[:, : degree + 1])[0]
    left = polynomial_and_sample_columns[:, -1] - basis @ (
        basis.T @ polynomial_and_sample_columns[:, -1]
    )
    return float(left @ left)
