"""Test of whitened residuals for autocorrelation.

References
----------
Ljung and Box (1978), Biometrika 65, 297-303.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

#: Number of lags in the test of whitened residuals.
LAG_COUNT = 20


def ljung_box_p_value(whitened_residuals: np.ndarray, order: int) -> float:
    """Compute the p-value of the Ljung-Box test for autocorrelation.

    The test statistic is ``n (n + 2) sum r_k^2/(n - k)``, where r_k is the autocorrelation of the
    whitened residuals at lag k (Ljung and Box, 1978). The statistic is compared with a chi-squared
    distribution.

    Parameters
    ----------
    whitened_residuals : ndarray, shape (rows,)
        Whitened residuals.
    order : int
        Number of estimated coefficients, which is subtracted from the degrees of freedom.

    Returns
    -------
    float
    """
    count, seen = len(whitened_residuals), whitened_residuals - whitened_residuals.mean()
    lags = np.arange(1, min(LAG_COUNT + order, count // 4) + 1)
    correlations = np.array([seen[lag:] @ seen[:-lag] for lag in lags]) / (seen @ seen)
    size = count * (count + 2.0) * float(np.sum(correlations**2 / (count - lags)))
    return float(chi2.sf(size, max(len(lags) - order, 1)))
