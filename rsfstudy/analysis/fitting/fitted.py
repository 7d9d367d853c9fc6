"""The result of a search: parameters, their covariance, and the noise of the record."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rsfstudy.analysis.fitting.model import slope
from rsfstudy.analysis.fitting.noise import Noise


@dataclass(frozen=True)
class Fitted:
    """Result of a fit.

    Attributes
    ----------
    values : dict
        All parameters, those that were not free too.
    free : tuple of str
    covariance : ndarray
        Of the free parameters, or of their logarithms (see `LOGARITHMIC`).
    by_noise : ndarray
        What noise of friction alone makes of it; the rest is that of load point displacement.
    errors : dict
        Numerical errors of the free parameters.
    noise : Noise
    noise_sd : float
        Standard deviation of the noise.
    degrees_of_freedom : float
        Degrees of freedom of the intervals.
    curve : ndarray
        Friction along the rows, without trend.
    residuals : ndarray
        Recorded friction less the fitted friction with its trend.
    innovations : ndarray
        Residuals freed of correlation, over their size.
    jacobian : ndarray
        Derivatives of the curve with trend by the free parameters, or their logarithms.
    criterion : float
        Akaike's, of the likelihood of this record with this noise: less is better.
    unidentified : tuple of str
        Free parameters that the record does not tell.
    white_size : float
        Root mean square of the residuals of the ordinary least-squares fit.
    quantum : float
        To which friction is rounded; 0 if it is not.
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
    criterion: float
    unidentified: tuple[str, ...]
    white_size: float
    quantum: float

    @property
    def outliers(self) -> np.ndarray:
        """Rows that were left out."""
        kept = self.noise.kept
        return np.zeros(0, dtype=int) if kept is None else np.flatnonzero(~kept)

    @property
    def all_innovations(self) -> np.ndarray:
        """Whitened residuals of all rows; NaN for outliers."""
        return np.insert(self.innovations, self.outliers - np.arange(len(self.outliers)), np.nan)

    @property
    def slopes(self) -> np.ndarray:
        """Derivatives of the free parameters by their coordinates."""
        return np.array([slope(name, self.values[name]) for name in self.free])

    @property
    def spread(self) -> np.ndarray:
        """Standard errors of the coordinates of the free parameters."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def band(self) -> np.ndarray:
        """Standard error of the curve with trend along the rows: ``sqrt(J C J')``, C being the
        covariance of parameters.
        """
        variances = np.einsum("ij,jk,ik->i", self.jacobian, self.covariance, self.jacobian)
        # below 0 by rounding, where a parameter is not told
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)))

    def stderr(self, name: str) -> float:
        """Standard error of a parameter."""
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
