"""Solution of a fit: parameters, covariance matrix and noise.

The standard errors are computed from the covariance matrix. The module ``confidence_intervals``
computes intervals from the profile likelihood instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rsfstudy.fitting.noise_models import NoiseModel
from rsfstudy.fitting.window_model import compute_derivative_by_fit_coordinate


@dataclass(frozen=True)
class FitSolution:
    """Solution of a fit.

    The fit varies slip distances and stiffness on a logarithmic scale. The coordinate of a slip
    distance or a stiffness is therefore the logarithm of the parameter. For all other parameters,
    the coordinate is the parameter itself.

    Parameters
    ----------
    parameter_values : dict of {str: float}
        Values of all parameters, including the fixed parameters.
    free_parameters : tuple of str
        Names of the free parameters.
    fit_coordinate_covariance : ndarray, shape (parameters, parameters)
        Covariance matrix of the coordinates of the free parameters.
    fit_coordinate_covariance_from_noise : ndarray, shape (parameters, parameters)
        Contribution of the friction noise to the covariance matrix.
    fit_coordinate_covariance_from_stiffness : ndarray, shape (parameters, parameters)
        Contribution of the standard error of a fixed stiffness to the covariance matrix. The
        remaining contribution is due to noise in the load point displacement.
    parameter_numerical_errors : dict of {str: float}
        Numerical errors of the free parameters.
    noise_model : NoiseModel
        Noise model of the record.
    noise_sd : float
        Standard deviation of the noise.
    degrees_of_freedom : float
        Degrees of freedom of the confidence intervals.
    model_friction : ndarray, shape (rows,)
        Friction of the model without the trend.
    residuals : ndarray, shape (rows,)
        Recorded friction minus fitted friction. The fitted friction includes the trend.
    whitened_residuals : ndarray, shape (kept rows,)
        Whitened residuals divided by their standard deviation.
    jacobian : ndarray, shape (rows, parameters)
        Derivatives of the fitted friction with respect to the parameter coordinates.
    friction_change_by_loading_error : ndarray, shape (rows, errors)
        Change in friction due to each independent error of the step times and step velocities. The
        size of each error is one standard deviation.
    aic : float
        Akaike information criterion of the fit, including the noise model. A smaller value means a
        better fit.
    unidentified_parameters : tuple of str
        Names of the free parameters that the record does not constrain.
    ols_residual_rms : float
        Root mean square of the residuals of the ordinary least-squares fit.
    friction_rounding_quantum : float
        Rounding unit of the recorded friction, or 0 if friction is not rounded.
    """

    parameter_values: dict[str, float]
    free_parameters: tuple[str, ...]
    fit_coordinate_covariance: np.ndarray
    fit_coordinate_covariance_from_noise: np.ndarray
    fit_coordinate_covariance_from_stiffness: np.ndarray
    parameter_numerical_errors: dict[str, float]
    noise_model: NoiseModel
    noise_sd: float
    degrees_of_freedom: float
    model_friction: np.ndarray
    residuals: np.ndarray
    whitened_residuals: np.ndarray
    jacobian: np.ndarray
    friction_change_by_loading_error: np.ndarray
    aic: float
    unidentified_parameters: tuple[str, ...]
    ols_residual_rms: float
    friction_rounding_quantum: float

    @property
    def outlier_rows(self) -> np.ndarray:
        """Indices of the rows that were excluded as outliers."""
        kept = self.noise_model.non_outlier_mask
        return np.zeros(0, dtype=int) if kept is None else np.flatnonzero(~kept)

    @property
    def whitened_residuals_with_nan_outliers(self) -> np.ndarray:
        """Whitened residuals of all rows, with NaN for outliers."""
        return np.insert(
            self.whitened_residuals, self.outlier_rows - np.arange(len(self.outlier_rows)), np.nan
        )

    @property
    def parameter_derivatives_by_fit_coordinates(self) -> np.ndarray:
        """Derivatives of parameters with respect to their coordinates."""
        return np.array(
            [
                compute_derivative_by_fit_coordinate(name, self.parameter_values[name])
                for name in self.free_parameters
            ]
        )

    @property
    def fit_coordinate_stderr(self) -> np.ndarray:
        """Standard errors of the coordinates of the free parameters."""
        return np.asarray(np.sqrt(np.diag(self.fit_coordinate_covariance)))

    @property
    def fitted_friction_stderr(self) -> np.ndarray:
        """Standard error of the fitted friction at each row.

        The standard error is the square root of the diagonal of :math:`J C J^T`, where :math:`J` is
        the Jacobian and :math:`C` is the covariance matrix.
        """
        variances = np.einsum(
            "ij,jk,ik->i", self.jacobian, self.fit_coordinate_covariance, self.jacobian
        )
        # Rounding errors may cause negative variances if a parameter is not constrained.
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)))

    def compute_parameter_stderr(self, parameter_name: str) -> float:
        """Return the standard error of a parameter.

        Parameters
        ----------
        parameter_name : str
            Name of a free parameter.

        Returns
        -------
        float
            Standard error in the unit of the parameter.
        """
        return float(
            (self.fit_coordinate_stderr * self.parameter_derivatives_by_fit_coordinates)[
                self.free_parameters.index(parameter_name)
            ]
        )


def compute_aic(
    whitened_residuals: np.ndarray, noise_model: NoiseModel, parameter_count: int, row_count: int
) -> float:
    r"""Compute the corrected Akaike information criterion.

    Parameters
    ----------
    whitened_residuals : ndarray, shape (kept rows,)
        Whitened residuals without outliers.
    noise_model : NoiseModel
        Noise model that whitened the residuals.
    parameter_count : int
        Number of parameters of the model.
    row_count : int
        Number of rows, including outliers.

    Returns
    -------
    float
        Corrected Akaike information criterion. Smaller values are better.

    Notes
    -----
    With the correction for small samples [1]_, the criterion is

    .. math:: n [\ln(2 \pi S/n) + 1] + \ln|R| + \frac{2 k n}{n - k - 1},

    where :math:`n` is the number of rows, :math:`S` is the sum of squares of the whitened
    residuals, and :math:`R` is the correlation matrix of the noise. The number of parameters
    :math:`k` includes the parameters of the noise model and one parameter per outlier.

    References
    ----------
    .. [1] Hurvich and Tsai (1989), Biometrika 76, 297-307.
    """
    parameter_count, size = (
        parameter_count + row_count - len(whitened_residuals),
        float(whitened_residuals @ whitened_residuals),
    )
    every = (
        parameter_count
        + noise_model.partial_autocorrelations.size
        + len(noise_model.relative_noise_levels)
    )
    likelihood = (
        row_count * (math.log(2.0 * math.pi * size / row_count) + 1.0)
        + noise_model.correlation_log_determinant
    )
    return likelihood + 2.0 * every * row_count / max(row_count - every - 1.0, 1.0)
