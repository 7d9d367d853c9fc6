"""Result of a fit: parameters, covariance matrix and noise of the record."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rsfstudy.fitting.noise import NoiseModel
from rsfstudy.fitting.window_model import coordinate_derivative


@dataclass(frozen=True)
class FitSolution:
    """Result of a fit.

    The coordinate of a parameter is the parameter itself, or its logarithm for slip distances and
    the stiffness.

    Attributes
    ----------
    values : dict
        Values of all parameters, including fixed parameters.
    free : tuple of str
        Names of the free parameters.
    covariance : ndarray
        Covariance matrix of the coordinates of the free parameters.
    noise_covariance : ndarray
        Contribution of the noise of friction to the covariance matrix. The remainder is the
        contribution of the noise of load point displacement.
    numerical_errors : dict
        Numerical errors of the free parameters.
    noise : NoiseModel
    noise_sd : float
        Standard deviation of the noise.
    degrees_of_freedom : float
        Degrees of freedom of the confidence intervals.
    model_friction : ndarray
        Friction of the model at each row, without the trend.
    residuals : ndarray
        Recorded friction minus fitted friction, which includes the trend.
    whitened_residuals : ndarray
        Whitened residuals divided by their standard deviation.
    jacobian : ndarray
        Derivatives of the curve and its trend with respect to the coordinates.
    by_loading : ndarray, shape (rows, errors)
        Changes of friction by one standard error of the times and velocities of the steps.
    aic : float
        Akaike's information criterion of the fit, including the noise model. Smaller values are
        better.
    unidentified : tuple of str
        Free parameters that the record does not constrain.
    ols_residual_rms : float
        Root mean square of the residuals of the ordinary least-squares fit.
    quantum : float
        Quantum to which friction is rounded, or 0 if friction is not rounded.
    """

    values: dict[str, float]
    free: tuple[str, ...]
    covariance: np.ndarray
    noise_covariance: np.ndarray
    numerical_errors: dict[str, float]
    noise: NoiseModel
    noise_sd: float
    degrees_of_freedom: float
    model_friction: np.ndarray
    residuals: np.ndarray
    whitened_residuals: np.ndarray
    jacobian: np.ndarray
    by_loading: np.ndarray
    aic: float
    unidentified: tuple[str, ...]
    ols_residual_rms: float
    quantum: float

    @property
    def outliers(self) -> np.ndarray:
        """Indices of the rows that were excluded as outliers."""
        kept = self.noise.kept_mask
        return np.zeros(0, dtype=int) if kept is None else np.flatnonzero(~kept)

    @property
    def all_whitened_residuals(self) -> np.ndarray:
        """Whitened residuals of all rows, with NaN for outliers."""
        return np.insert(
            self.whitened_residuals, self.outliers - np.arange(len(self.outliers)), np.nan
        )

    @property
    def coordinate_derivatives(self) -> np.ndarray:
        """Derivatives of the free parameters with respect to their coordinates."""
        return np.array([coordinate_derivative(name, self.values[name]) for name in self.free])

    @property
    def coordinate_stderr(self) -> np.ndarray:
        """Standard errors of the coordinates of the free parameters."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def curve_stderr(self) -> np.ndarray:
        """Standard error of the fitted curve and its trend at each row.

        The standard error is ``sqrt(J C J')``, where J is the Jacobian and C is the covariance
        matrix.
        """
        variances = np.einsum("ij,jk,ik->i", self.jacobian, self.covariance, self.jacobian)
        # rounding errors may cause negative values if a parameter is not constrained
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)))

    def stderr(self, name: str) -> float:
        """Return the standard error of a parameter."""
        return float((self.coordinate_stderr * self.coordinate_derivatives)[self.free.index(name)])


def compute_aic(
    whitened_residuals: np.ndarray, noise: NoiseModel, parameters: int, count: int
) -> float:
    """Compute Akaike's criterion, corrected for few samples (Hurvich and Tsai, 1989).

    It is ``n [ln(2 pi S/n) + 1] + ln|R| + 2 k n/(n - k - 1)`` for n rows, a sum of squares S of the
    innovations and k parameters, including those of the noise and one for each outlier.
    """
    parameters, size = (
        parameters + count - len(whitened_residuals),
        float(whitened_residuals @ whitened_residuals),
    )
    every = parameters + noise.partial_autocorrelations.size + len(noise.level_sds)
    likelihood = count * (math.log(2.0 * math.pi * size / count) + 1.0) + noise.log_determinant
    return likelihood + 2.0 * every * count / max(count - every - 1.0, 1.0)
