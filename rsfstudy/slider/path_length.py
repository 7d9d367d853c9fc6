r"""Velocity ratios, and the path length along which motions are integrated.

The equations between ruptures and in ruptures are both integrated along the path length
:math:`\lambda`, which combines displacement (or inertial time) :math:`\delta` with
:math:`x = \ln(V/V_*)`:

.. math::

    d\lambda^2 = d\delta^2 + (dx/6)^2, \qquad
    \frac{dx}{d\delta} \approx \frac{1}{a} \left[\frac{K (V_0 - V)}{V + V_0} -
    \frac{d\Psi}{d\delta}\right].

While contacts heal, :math:`\ln V` decreases as the logarithm of displacement. When slip ends after
a rupture, :math:`\ln V` decreases as the logarithm of the remaining time. If displacement or time
were the independent variable, each integration step would have to be a fraction of the elapsed or
remaining displacement or time. Measured in path length, the interval in which contacts heal or slip
ends is only a few units long. The factor of 6 in the path length reduces the number of integration
steps where slip is fastest, because the path bends over six units of :math:`\ln V` instead of one
unit. Factors from 4 to 12 instead of 6 give similar results.
"""

from __future__ import annotations

import math

from rsfstudy.slider.parameter_layout import LOAD_VELOCITY, LOG_LOAD_VELOCITY
from rsfstudy.slider.parts import Numbers

#: Lower limit of ln(V/V_*), the logarithm of 10^-290. A motion without loading ends at this slip
#: rate.
STOPPED_LOG_SLIP_RATE = -290.0 * math.log(10.0)

#: Largest difference between ln V_0 and ln V. The rate functions replace a larger difference by
#: this limit. At lower slip rates the contact is treated as stationary, because the remaining slip
#: changes the state by a relative amount below exp(-100).
MAX_LOG_LOAD_OVER_SLIP_VELOCITY = 100.0

#: Change of ln V that adds as much path length as one unit of displacement (D_c) or inertial time.
LOG_SLIP_RATE_PER_PATH_LENGTH = 6.0
#: Largest slope of the path whose square is computed. The slope is the derivative of ln V/6 with
#: respect to displacement or inertial time. Adding 1 to the square of a larger slope has no effect
#: in double precision.
MAX_FINITE_PATH_SLOPE = 1e9

VelocityRatios = tuple[float, float, float]


def velocity_ratios(log_slip_rate: float, p: Numbers) -> VelocityRatios:
    r"""Compute the slip rate and its ratios to the load point velocity.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`, limited from below.
    load_ratio : float
        Velocity ratio :math:`V_0/V`.
    slip_fraction : float
        Ratio of slip to the sum of slip and load point displacement, :math:`V/(V + V_0)`.

    Notes
    -----
    Below the lower limit of :math:`\ln(V/V_*)`, the contact is treated as stationary. At low slip
    rates, the change of the state per unit slip may grow in proportion to :math:`1/V`. The product
    of this change and the fraction :math:`V/(V + V_0)` remains finite. Without the lower limit of
    :math:`\ln(V/V_*)`, the change of the state per unit slip would overflow and the fraction would
    underflow.
    """
    least = p[LOG_LOAD_VELOCITY] - MAX_LOG_LOAD_OVER_SLIP_VELOCITY
    x = least if log_slip_rate < least else log_slip_rate
    slower = math.exp(p[LOG_LOAD_VELOCITY] - x)
    return x, slower, 1.0 / (1.0 + slower)


def time_per_displacement(velocity_ratio_values: VelocityRatios, p: Numbers) -> float:
    """Compute the derivative of time with respect to displacement.

    Parameters
    ----------
    velocity_ratio_values : tuple of float
        Output of `velocity_ratios`.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    float
        Value of :math:`1/(V + V_0)` in units of :math:`1/V_*`.
    """
    x, slower, fraction = velocity_ratio_values
    if p[LOAD_VELOCITY] != 0.0:
        return slower * fraction / abs(p[LOAD_VELOCITY])
    return math.exp(-max(x, STOPPED_LOG_SLIP_RATE))


def displacement_per_path_length(path_slope: float) -> float:
    r"""Compute the derivative of displacement with respect to path length.

    Parameters
    ----------
    path_slope : float
        Slope of the path, the derivative of :math:`\ln V/6` with respect to displacement or
        inertial time. The square of the slope may overflow when slip stops, so the function does
        not square very large slopes.

    Returns
    -------
    float
        Displacement per unit path length.
    """
    if abs(path_slope) > MAX_FINITE_PATH_SLOPE:
        return 1.0 / abs(path_slope)
    return 1.0 / math.sqrt(1.0 + path_slope * path_slope)
