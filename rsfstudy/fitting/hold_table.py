r"""Functions that build a table of holds and compute the healing rate.

The healing rate is the slope of an ordinary least-squares line of healing against the decimal
logarithm of the hold duration [1]_.

References
----------
.. [1] Marone (1998), Nature 391, 69-72.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.quantities import Quantity

#: Quantities of a hold, in the order of the columns of the table.
HOLD_QUANTITIES = (
    Quantity("begins", "$t$", "s", "time at the beginning of the hold"),
    Quantity("duration", "$t_h$", "s", "duration of the hold"),
    Quantity("velocity_before", "$V_0$", "um s-1", "load point velocity before the hold"),
    Quantity("velocity_after", "$V_1$", "um s-1", "load point velocity after the hold"),
    Quantity("friction_before", r"$\mu_0$", "1", "friction before the hold"),
    Quantity("peak_friction", r"$\mu_p$", "1", "peak friction on reloading"),
    Quantity("healing", r"$\Delta\mu$", "1", "peak friction minus friction before the hold"),
    Quantity("relaxation", r"$\Delta\mu_c$", "1", "change of friction during the hold"),
    Quantity("peak_displacement", "", "um", "load point displacement from reloading to the peak"),
)
#: Number of quantities in the table that have no error estimate.
_COUNT_OF_QUANTITIES_WITHOUT_UNCERTAINTY = 4


def build_hold_table(
    exact_values: np.ndarray,
    values: np.ndarray,
    errors: np.ndarray,
    healing_covariance: np.ndarray,
    error_suffix: str = "stderr",
) -> xr.Dataset:
    """Build the table of holds, and compute the healing rate.

    Parameters
    ----------
    exact_values : ndarray, shape (holds, 4)
        Quantities without errors: start and duration of each hold, and load point velocities before
        and after each hold.
    values, errors : ndarray, shape (holds, 5)
        Friction before the hold, peak friction, healing, relaxation and peak displacement, and
        their errors.
    healing_covariance : ndarray, shape (holds, holds)
        Covariance matrix of healing.
    error_suffix : str, default: "stderr"
        Suffix of the variables that contain the errors.

    Returns
    -------
    xarray.Dataset
        Table of holds.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import build_hold_table
    >>> exact = np.array([[0.0, 10.0, 1.0, 1.0], [50.0, 100.0, 1.0, 1.0]])
    >>> values = np.array([[0.6, 0.61, 0.01, -0.01, 20.0], [0.6, 0.63, 0.03, -0.01, 25.0]])
    >>> table = build_hold_table(exact, values, np.zeros((2, 5)), np.zeros((2, 2)))
    >>> round(float(table["healing_rate"]), 3)
    0.02
    """
    words = "standard error" if error_suffix == "stderr" else "error estimate"
    numbers = np.column_stack([exact_values, values])
    data: dict[str, Any] = {
        q.name: ("hold", numbers[:, n], q.variable_attributes)
        for n, q in enumerate(HOLD_QUANTITIES)
    }
    for n, about in enumerate(HOLD_QUANTITIES[_COUNT_OF_QUANTITIES_WITHOUT_UNCERTAINTY:]):
        named = {**about.variable_attributes, "long_name": f"{words} of {about.long_name}"}
        data[f"{about.name}_{error_suffix}"] = "hold", errors[:, n], named
    rate, stderr, intercept = fit_healing_rate(exact_values[:, 1], values[:, 2], healing_covariance)
    for name, value, meaning in (
        ("healing_rate", rate, "increase of healing per decade of hold duration"),
        ("healing_rate_stderr", stderr, "standard error of the healing rate"),
        ("healing_intercept", intercept, "healing of the fitted line at a hold duration of 1 s"),
    ):
        data[name] = (), value, {"long_name": meaning, "units": "1"}
    number = {"long_name": "number of the hold", "units": "1"}
    coordinates = {"hold": ("hold", np.arange(1, len(numbers) + 1), number)}
    return copy_with_cf_encoding(xr.Dataset(data, coordinates))


def fit_healing_rate(
    durations: np.ndarray, healing: np.ndarray, covariance: np.ndarray
) -> tuple[float, float, float]:
    """Fit healing as a linear function of the decimal logarithm of the hold duration.

    Parameters
    ----------
    durations, healing : ndarray, shape (holds,)
        Durations in s and healing. Holds whose healing is NaN are ignored.
    covariance : ndarray, shape (holds, holds)
        Covariance matrix of healing.

    Returns
    -------
    rate : float
        Slope of the ordinary least-squares line, or NaN if there are fewer than two different
        durations.
    stderr : float
        Standard error of the slope. The error is computed from the covariance matrix. If the
        scatter of healing about the line is larger than expected from the covariance matrix, the
        error is computed from the scatter.
    intercept : float
        Healing at a hold duration of 1 s, computed from the line.
    """
    known = np.isfinite(healing)
    x, y = np.log10(durations[known]), healing[known]
    if len(x) < 2 or not np.ptp(x) > 0.0:
        return math.nan, math.nan, math.nan
    columns = np.column_stack([x, np.ones(len(x))])
    weights = np.linalg.pinv(columns)
    slope, intercept = weights @ y
    variance = float(weights[0] @ covariance[np.ix_(known, known)] @ weights[0])
    if len(x) > 2:
        left = y - columns @ (slope, intercept)
        variance = max(variance, float(left @ left) / (len(x) - 2) * float(weights[0] @ weights[0]))
    return float(slope), math.sqrt(variance), float(intercept)
