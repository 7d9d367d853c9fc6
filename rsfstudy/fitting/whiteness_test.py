"""Test of whitened residuals for autocorrelation."""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

#: The number of lags in the autocorrelation test is the sum of this value and the order of the
#: noise model.
LAG_COUNT_BEYOND_AR_ORDER = 20


def compute_ljung_box_p_value(whitened_residuals: np.ndarray, autoregressive_order: int) -> float:
    r"""Compute the p-value of the Ljung-Box test for autocorrelation.

    Parameters
    ----------
    whitened_residuals : ndarray, shape (rows,)
        Whitened residuals.
    autoregressive_order : int
        Order of the autoregressive noise model. The degrees of freedom of the test are the number
        of lags minus this order.

    Returns
    -------
    float
        The p-value of the test.

    Notes
    -----
    The test statistic [1]_ is

    .. math:: n (n + 2) \sum_k \frac{r_k^2}{n - k},

    where :math:`r_k` is the autocorrelation of the whitened residuals at lag :math:`k`, and
    :math:`n` is the number of rows. If the residuals are white, the statistic has a chi-squared
    distribution.

    References
    ----------
    .. [1] Ljung and Box (1978), Biometrika 65, 297-303.
    """
    count, seen = len(whitened_residuals), whitened_residuals - whitened_residuals.mean()
    lags = np.arange(1, min(LAG_COUNT_BEYOND_AR_ORDER + autoregressive_order, count // 4) + 1)
    correlations = np.array([seen[lag:] @ seen[:-lag] for lag in lags]) / (seen @ seen)
    size = count * (count + 2.0) * float(np.sum(correlations**2 / (count - lags)))
    return float(chi2.sf(size, max(len(lags) - autoregressive_order, 1)))
