"""Result of a fit: parameters, covariance matrix and noise of the record."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rsfstudy.analysis.fitting.model import slope
from rsfstudy.analysis.fitting.noise import Noise


@dataclass(frozen=True)
class Fitted:
    """Result of a fit.

    A coordinate is a parameter, or its logarithm for the parameters in ``LOGARITHMIC``.

    Attributes
    ----------
    values : dict
        Values of all parameters, including fixed parameters.
    free : tuple of str
        Names of the free parameters.
    covariance : ndarray
        Covariance matrix of the coordinates of the free parameters.
    by_noise : ndarray
        Contribution of the noise of friction to the covariance matrix. The remainder is the
        contribution of the noise of load point displacement.
    errors : dict
        Numerical errors of the free parameters.
    noise : Noise
    noise_sd : float
        Standard deviation of the noise.
    degrees_of_freedom : float
        Degrees of freedom of the confidence intervals.
    curve : ndarray
        Friction of the model at each row, without the trend.
    residuals : ndarray
        Recorded friction minus fitted friction, which includes the trend.
    innovations : ndarray
        Whitened residuals divided by their standard deviation.
    jacobian : ndarray
        Derivatives of the curve and its trend with respect to the coordinates.
    by_loading : ndarray, shape (rows, errors)
        Changes of friction by one standard error of the times and velocities of the steps.
    criterion : float
        Akaike's information criterion of the fit, including the noise model. Smaller values are
        better.
    unidentified : tuple of str
        Free parameters that the record does not constrain.
    white_size : float
        Root mean square of the residuals of the ordinary least-squares fit.
    quantum : float
        Quantum to which friction is rounded, or 0 if friction is not rounded.
    """

    values: dict[str, float]
    free: tuple[str, ...]
    covariance: np.ndarray
    by_noise: np.ndarray
    errors: dict[str, float]
    noise: Noise
    noise_sd: float
    degrees_of_freedom: float
    curve: np.ndarray
    residuals: np.ndarray
    innovations: np.ndarray
    jacobian: np.ndarray
    by_loading: np.ndarray
    criterion: float
    unidentified: tuple[str, ...]
    white_size: float
    quantum: float

    @property
    def outliers(self) -> np.ndarray:
        """Indices of the rows that were excluded as outliers."""
        kept = self.noise.kept
        return np.zeros(0, dtype=int) if kept is None else np.flatnonzero(~kept)

    @property
    def all_innovations(self) -> np.ndarray:
        """Whitened residuals of all rows, with NaN for outliers."""
        return np.insert(self.innovations, self.outliers - np.arange(len(self.outliers)), np.nan)

    @property
    def slopes(self) -> np.ndarray:
        """Derivatives of the free parameters with respect to their coordinates."""
        return np.array([slope(name, self.values[name]) for name in self.free])

    @property
    def spread(self) -> np.ndarray:
        """Standard errors of the coordinates of the free parameters."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def band(self) -> np.ndarray:
        """Standard error of the fitted curve and its trend at each row.

        The standard error is ``sqrt(J C J')``, where J is the Jacobian and C is the covariance
        matrix.
        """
        variances = np.einsum("ij,jk,ik->i", self.jacobian, self.covariance, self.jacobian)
        # rounding errors may cause negative values if a parameter is not constrained
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)))

    def stderr(self, name: str) -> float:
        """Return the standard error of a parameter."""
        return float((self.spread * self.slopes)[self.free.index(name)])


def compute_criterion(innovations: np.ndarray, noise: Noise, parameters: int, count: int) -> float:
    """Compute Akaike's criterion, corrected for few samples (Hurvich and Tsai, 1989).

    It is ``n [ln(2 pi S/n) + 1] + ln|R| + 2 k n/(n - k - 1)`` for n rows, a sum of squares S of the
    innovations and k parameters, including those of the noise and one for each outlier.
    """
    parameters, size = parameters + count - len(innovations), float(innovations @ innovations)
    every = parameters + noise.partial.size + len(noise.sizes)
    likelihood = count * (math.log(2.0 * math.pi * size / count) + 1.0) + noise.log_determinant
    return likelihood + 2.0 * every * count / max(count - every - 1.0, 1.0)
