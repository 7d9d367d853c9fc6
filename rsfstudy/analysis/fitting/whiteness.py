"""Test of whitened residuals for autocorrelation.

References
----------
Ljung and Box (1978), Biometrika 65, 297-303.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

#: Lags at which residuals freed of correlation are tested for what is left of it.
LAGS = 20


def whiteness(innovations: np.ndarray, order: int) -> float:
    """Chance that white noise looks as correlated as residuals freed of correlation: of chi^2
    as large as ``n (n + 2) sum r_k^2/(n - k)``, r_k being their autocorrelation at lag k (Ljung and
    Box, 1978).

    Parameters
    ----------
    innovations : ndarray, shape (samples,)
    order : int
        Coefficients that were found; by so many there are fewer degrees of freedom.
    """
    count, seen = len(innovations), innovations - innovations.mean()
    lags = np.arange(1, min(LAGS + order, count // 4) + 1)
    correlations = np.array([seen[lag:] @ seen[:-lag] for lag in lags]) / (seen @ seen)
    size = count * (count + 2.0) * float(np.sum(correlations**2 / (count - lags)))
    return float(chi2.sf(size, max(len(lags) - order, 1)))
