r"""Functions that compute velocity ratios and derivatives with respect to path length.

Motions are integrated with the path length :math:`\lambda` as the independent variable. The path
length combines a variable :math:`\delta` with :math:`x = \ln(V/V_*)`. Between ruptures,
:math:`\delta` is displacement, and in ruptures, :math:`\delta` is inertial time. The path length is
defined by

.. math::

    d\lambda^2 = d\delta^2 + (dx/6)^2, \qquad
    \frac{dx}{d\delta} \approx \frac{1}{a} \left[\frac{K (V_0 - V)}{V + V_0} -
    \frac{d\Psi}{d\delta}\right].

While contacts heal, :math:`\ln V` decreases as the logarithm of displacement. When slip ends after
a rupture, :math:`\ln V` decreases as the logarithm of the remaining time. If displacement or time
were the independent variable, each integration step could cover only a fraction of the elapsed or
remaining interval, so many steps would be necessary. In contrast, the path length of such an
interval is only a few units. The change in :math:`\ln V` is divided by 6 because this reduces the
number of integration steps near the largest slip rate. With this divisor, the direction of the path
changes more gradually, namely while :math:`\ln V` changes by 6 instead of by 1. Any divisor between
4 and 12 leads to a similar number of steps.
"""

from __future__ import annotations

import math

from rsfstudy.slider.parameter_layout import LOAD_VELOCITY, LOG_LOAD_VELOCITY, STIFFNESS
from rsfstudy.slider.parts import FloatTuple

#: Lower limit of ln(V/V_*), equal to the natural logarithm of 10^-290. If the load point does not
#: move, a motion ends at this slip rate.
LOG_SLIP_RATE_OF_STOPPED_SLIP = -290.0 * math.log(10.0)

#: Upper limit of ln(V_0/V). The rate functions replace larger values by this limit. The contact is
#: then treated as stationary, because the neglected slip changes the state by a relative amount
#: below exp(-100).
MAX_LOG_RATIO_OF_LOAD_TO_SLIP_VELOCITY = 100.0

#: Change in ln V that has the same path length as one unit of displacement (D_c) or one unit of
#: inertial time.
LOG_SLIP_RATE_PER_PATH_LENGTH = 6.0
#: Largest slope of the path for which the square of the slope is computed. The slope is the
#: derivative of (ln V)/6 with respect to displacement or inertial time. For a larger slope, 1 plus
#: the square of the slope equals the square in double precision.
MAX_PATH_SLOPE_THAT_IS_SQUARED = 1e9

VelocityRatios = tuple[float, float, float]


def compute_velocity_ratios(log_slip_rate: float, p: FloatTuple) -> VelocityRatios:
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
    If :math:`\ln(V/V_*)` is below its lower limit, the contact is treated as stationary. At low
    slip rates, the derivative of the state with respect to slip may grow in proportion to
    :math:`1/V`. The product of this derivative and the fraction :math:`V/(V + V_0)` remains finite.
    Without the lower limit, however, the derivative would overflow and the fraction would
    underflow.
    """
    least = p[LOG_LOAD_VELOCITY] - MAX_LOG_RATIO_OF_LOAD_TO_SLIP_VELOCITY
    x = least if log_slip_rate < least else log_slip_rate
    slower = math.exp(p[LOG_LOAD_VELOCITY] - x)
    return x, slower, 1.0 / (1.0 + slower)


def compute_time_per_displacement(velocity_ratio_values: VelocityRatios, p: FloatTuple) -> float:
    """Compute the derivative of time with respect to displacement.

    Parameters
    ----------
    velocity_ratio_values : tuple of float
        Output of `compute_velocity_ratios`.
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
    return math.exp(-max(x, LOG_SLIP_RATE_OF_STOPPED_SLIP))


def compute_spring_stress_rate(
    relative_load_velocity: float,
    relative_slip_rate: float,
    velocity_ratio_values: VelocityRatios,
    p: FloatTuple,
) -> float:
    r"""Compute the derivative of the spring stress with respect to displacement.

    Parameters
    ----------
    relative_load_velocity, relative_slip_rate : float
        Load point velocity and slip rate, divided by the magnitude of the slip rate.
    velocity_ratio_values : tuple of float
        Output of `compute_velocity_ratios`.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    float
        Derivative :math:`K (V_0 - V)/(V + V_0)`.
    """
    return p[STIFFNESS] * (relative_load_velocity - relative_slip_rate) * velocity_ratio_values[2]


def compute_spring_stress_rate_with_noise(
    relative_load_velocity: float,
    relative_slip_rate: float,
    velocity_ratio_values: VelocityRatios,
    p: FloatTuple,
) -> float:
    """Compute the derivative of the spring stress in a scene with noise.

    The last parameter of the scene is the rate at which noise changes the spring stress. See
    `compute_spring_stress_rate` for the arguments.
    """
    steady = compute_spring_stress_rate(
        relative_load_velocity, relative_slip_rate, velocity_ratio_values, p
    )
    return steady + p[-1] * compute_time_per_displacement(velocity_ratio_values, p)


def compute_displacement_per_path_length(path_slope: float) -> float:
    r"""Compute the derivative of displacement with respect to path length.

    Parameters
    ----------
    path_slope : float
        Slope of the path, which is the derivative of :math:`(\ln V)/6` with respect to displacement
        or inertial time. When slip stops, the square of the slope may overflow, so the function
        does not square very large slopes.

    Returns
    -------
    float
        Derivative of displacement (or inertial time) with respect to path length.
    """
    if abs(path_slope) > MAX_PATH_SLOPE_THAT_IS_SQUARED:
        return 1.0 / abs(path_slope)
    return 1.0 / math.sqrt(1.0 + path_slope * path_slope)
