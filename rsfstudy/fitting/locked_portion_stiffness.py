r"""Stiffness of the machine from the portions of a record in which the fault is locked.

If the load point starts, stops or reverses, the fault is almost locked until friction has changed
considerably. The slope of friction against load point displacement is then the stiffness :math:`k`
divided by the normal stress. However, the fault slips slowly at the slip rate :math:`V`, which
reduces the slope of friction:

.. math:: d\mu/dx = k (1 - v), \qquad v = V/V_l,

where :math:`V_l` is the load point velocity. With the direct effect :math:`a` and a state variable
that changes in proportion to slip, :math:`d \ln v/dx = (k/a) (1 + g v)`. The constant :math:`g` is
-1 if the state variable is constant, and :math:`b/(k D_c) - 1` for the ageing law after a long
hold. The solution is

.. math::

    \mu = \mu_1 + k x + \frac{a}{g} \ln\left[1 - g v_1 \left(e^{k x/a} - 1\right)\right],

where :math:`\mu_1` and :math:`v_1` are the values at :math:`x = 0`. The curve is fitted by
generalised least squares with correlated noise. The direct effect :math:`a` and the constant
:math:`g` have broad prior distributions. The standard error of the stiffness :math:`k` therefore
includes the uncertainty due to the slip.

Friction may have a trend during sliding. A trend with load point displacement contributes to the
slope of a locked portion, whereas a trend with slip does not. The fit does not distinguish between
these two kinds of trend. Half of the trend is therefore subtracted from the stiffness, and the
other half is included in the standard error.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from rsfstudy.fitting.friction_trend import fit_friction_trend
from rsfstudy.fitting.line_segmentation import CumulativeSumsForLineFits
from rsfstudy.fitting.local_regression import compute_weighted_mean
from rsfstudy.fitting.noise_models import (
    AUTOREGRESSIVE_NOISE_NAME,
    build_white_noise_model,
    fit_noise_model,
)
from rsfstudy.fitting.velocity_steps import LoadingStep, noise_variance
from rsfstudy.netcdf_encoding import copy_with_cf_encoding

#: Kinds of locked portions of a record.
RELOADING, UNLOADING, INITIAL_LOADING = "reloading", "unloading", "initial loading"
#: A portion ends where the slope falls below this fraction of its largest value. During unloading,
#: the fault slips forward at first, and the slope is up to twice the stiffness.
_MIN_SLOPE_OVER_LARGEST_SLOPE_BY_KIND = {RELOADING: 0.6, UNLOADING: 0.3, INITIAL_LOADING: 0.6}
#: Smallest ratio of a slope to its standard error, and smallest number of rows of a portion.
_MIN_SLOPE_SIGMAS, _MIN_ROWS_OF_LOCKED_PORTION = 12.0, 10
#: Slopes are computed in windows. In each window, friction changes by this fraction of the change
#: in friction in the whole portion.
_SLOPE_WINDOW_FRICTION_CHANGE_FRACTION = 0.15
#: Largest number of rows of a portion. The rows of longer portions are thinned.
_MAX_ROWS_OF_LOCKED_PORTION = 3000
#: Smallest increase in friction during the initial loading.
_MIN_FRICTION_RISE_OF_INITIAL_LOADING = 0.05
#: Mean and standard deviation of the prior distributions of ln a and g.
_PRIOR_OF_LOG_A, _PRIOR_OF_STATE_CHANGE = (math.log(0.01), 0.7), (0.0, 1.5)
#: Bounds of ln |v|, ln a and g. The slip rate ratio v belongs to the last row of a portion, or to
#: the first row of an unloading portion. At the end of a loading portion, v is less than 1, because
#: friction still increases.
_BOUNDS_OF_LOG_RATE_RATIO, _BOUNDS_OF_LOG_A, _BOUNDS_OF_STATE_CHANGE = (
    (-12.0, -0.05),
    (math.log(5e-4), math.log(0.1)),
    (-1.0, 12.0),
)
#: Number of times that the noise and the parameters are estimated in turn.
_NOISE_ESTIMATION_PASSES = 3
#: The first value is the number of rows after a step that are used to extrapolate the load point
#: displacement back to the step. The second value is a number of standard deviations of the noise.
#: A step is immediate if the recorded displacements during the step deviate from the displacements
#: of an immediate step by at most this number of standard deviations.
_ROWS_AFTER_STEP, _MAX_DEVIATION_OF_IMMEDIATE_STEP = 20, 5.0
#: Largest relative standard error of the stiffness of a portion. Portions with larger errors are
#: ignored.
_MAX_RELATIVE_STIFFNESS_STDERR = 0.25


class LockedPortion(NamedTuple):
    """Portion of a record in which the fault is almost locked.

    Parameters
    ----------
    portion_kind : str
        Kind of portion: "reloading", "unloading" or "initial loading".
    time, load_point_displacement, friction : ndarray, shape (rows,)
        Times in s, load point displacements in um since the beginning of the portion, and friction.
    """

    portion_kind: str
    time: np.ndarray
    load_point_displacement: np.ndarray
    friction: np.ndarray


def measure_stiffness(
    time: np.ndarray,
    displacement: np.ndarray,
    friction: np.ndarray,
    normal_stress: np.ndarray | None,
    steps: Sequence[LoadingStep],
) -> xr.Dataset:
    """Measure the stiffness in all locked portions of a record.

    Parameters
    ----------
    time, displacement, friction : ndarray, shape (rows,)
        Times in s, load point displacements in um, and friction.
    normal_stress : ndarray, shape (rows,), or None
        Normal stress in Pa.
    steps : sequence of LoadingStep
        Steps of the record in order of time.

    Returns
    -------
    xarray.Dataset
        Stiffnesses (see ``Record.stiffness``).
    """
    moves = [step for step in steps if step.changes_velocity]
    if moves:
        first_velocity = moves[0].velocity_before
    else:
        first_velocity = float(np.polyfit(time - time[0], displacement, 1)[0])
    moves.insert(0, LoadingStep(float(time[0]), float(time[0]), 0.0, first_velocity))
    trend, trend_stderr = fit_friction_trend(time, friction, moves)
    rows: list[tuple[str, float, float, float, float, float]] = []
    if len(time) < _MIN_ROWS_OF_LOCKED_PORTION:
        return _build_stiffness_table(rows, 0.0, has_normal_stress=normal_stress is not None)
    for portion in find_locked_portions(time, displacement, friction, moves):
        value, stderr = fit_stiffness(portion)
        if 0.0 < stderr < _MAX_RELATIVE_STIFFNESS_STDERR * value:
            begins, ends = portion.time[[0, -1]].tolist()
            inside = (time >= begins) & (time <= ends)
            stress = math.nan if normal_stress is None else float(normal_stress[inside].mean())
            rows.append((portion.portion_kind, begins, ends, value - 0.5 * trend, stderr, stress))
    if any(row[0] != INITIAL_LOADING for row in rows):
        rows = [row for row in rows if row[0] != INITIAL_LOADING]
    by_trend = 0.5 * math.hypot(trend, trend_stderr)
    return _build_stiffness_table(rows, by_trend, has_normal_stress=normal_stress is not None)


def _build_stiffness_table(
    portion_rows: Sequence[tuple[str, float, float, float, float, float]],
    stiffness_error_from_trend: float,
    *,
    has_normal_stress: bool,
) -> xr.Dataset:
    """Build a table of the locked portions and the mean stiffness.

    Each row contains the kind, begin, end, stiffness, standard error and normal stress of a
    portion. ``stiffness_error_from_trend`` is the error of all stiffnesses due to the trend of
    friction.
    """
    begins, ends, values, errors, stresses = (
        np.array([row[1:] for row in portion_rows], dtype=float).reshape(-1, 5).T
    )
    kinds = np.array([row[0] for row in portion_rows], dtype=object)
    number = {"long_name": "number of the portion", "units": "1"}
    table = xr.Dataset(
        {
            "kind": ("portion", kinds, {"long_name": "kind of the portion"}),
            "begins": (
                "portion",
                begins,
                {"long_name": "time at the beginning of the portion", "units": "s"},
            ),
            "ends": (
                "portion",
                ends,
                {"long_name": "time at the end of the portion", "units": "s"},
            ),
        },
        {"portion": ("portion", np.arange(1, len(portion_rows) + 1), number)},
    )
    scales = {
        "stiffness": (np.ones(len(portion_rows)), "um-1", "stiffness divided by normal stress")
    }
    if has_normal_stress:
        scales["machine_stiffness"] = stresses, "Pa um-1", "stiffness of the machine"
    for name, (scale, units, words) in scales.items():
        each, spread = values * scale, errors * scale
        mean, stderr = math.nan, math.nan
        if portion_rows:
            mean, stderr = compute_weighted_mean(each, spread)
            stderr = math.hypot(stderr, stiffness_error_from_trend * float(scale.mean()))
        about = {"long_name": words, "units": units}
        of_error = {"long_name": f"standard error of the {words}", "units": units}
        table[f"portion_{name}"] = "portion", each, about
        table[f"portion_{name}_stderr"] = "portion", spread, of_error
        table[name], table[f"{name}_stderr"] = ((), mean, about), ((), stderr, of_error)
    return copy_with_cf_encoding(table)


def find_locked_portions(
    time: np.ndarray,
    displacement: np.ndarray,
    friction: np.ndarray,
    steps: Sequence[LoadingStep],
) -> Iterator[LockedPortion]:
    """Find the portions of a record in which the fault is almost locked.

    Parameters
    ----------
    time, displacement, friction : ndarray, shape (rows,)
        Times in s, load point displacements in um, and friction.
    steps : sequence of LoadingStep
        Start of the record, followed by the steps in order of time.

    Yields
    ------
    LockedPortion
        Portions in order of time.
    """
    noise_sd = math.sqrt(noise_variance(time, displacement))
    end_times = [*(step.start for step in steps[1:]), float(time[-1])]
    for number, (step, ends) in enumerate(zip(steps, end_times, strict=True)):
        if not number:
            kind = INITIAL_LOADING
        elif step.velocity_after < 0.0 <= step.velocity_before:
            kind = UNLOADING
        elif step.velocity_after > 0.0 >= step.velocity_before:
            kind = RELOADING
        else:
            continue
        if not step.velocity_after:
            continue
        begins = (
            _find_end_time_of_loading_step(time, displacement, step, noise_sd)
            if number
            else step.end
        )
        rows = (time >= begins) & (time < ends)
        moved = step.velocity_after * (time[rows] - step.middle_time)
        portion = _remove_rows_after_slip_onset(
            LockedPortion(kind, time[rows], moved, friction[rows])
        )
        if portion is not None:
            yield portion


def _find_end_time_of_loading_step(
    time: np.ndarray, displacement: np.ndarray, loading_step: LoadingStep, noise_sd: float
) -> float:
    """Return the time in s after which the load point velocity is constant.

    If a record has few rows before an immediate step, the detected step lasts longer than the
    actual step.
    """
    later = np.flatnonzero(time > loading_step.end)[:_ROWS_AFTER_STEP]
    inside = (time > loading_step.start) & (time < loading_step.end)
    if len(later) < 2:
        return loading_step.end
    late = time - loading_step.middle_time
    line = loading_step.velocity_before * np.minimum(
        late, 0.0
    ) + loading_step.velocity_after * np.maximum(late, 0.0)
    level = float(np.mean((displacement - line)[later]))
    off = np.abs((displacement - line)[inside] - level).max(initial=0.0)
    is_immediate = off <= _MAX_DEVIATION_OF_IMMEDIATE_STEP * noise_sd
    gap = float(np.median(np.diff(time[later])))
    change = loading_step.velocity_after - loading_step.velocity_before
    # The time of the step has an uncertainty.
    guard = math.cbrt(noise_sd**2 * gap / change**2) if change else 0.0
    return (loading_step.middle_time if is_immediate else loading_step.end) + guard


def _remove_rows_after_slip_onset(portion: LockedPortion) -> LockedPortion | None:
    """Remove the rows that were recorded after the fault began to slip.

    The result is None if friction does not change considerably at the beginning of the portion.
    """
    count = len(portion.time)
    if count < _MIN_ROWS_OF_LOCKED_PORTION:
        return None
    x = np.abs(portion.load_point_displacement - portion.load_point_displacement[0])
    y = portion.friction - portion.friction[0]
    y = -y if portion.portion_kind == UNLOADING else y
    half = max(int(np.argmax(y >= 0.5 * y.max())), 1)
    width = max(
        int(np.argmax(y >= _SLOPE_WINDOW_FRICTION_CHANGE_FRACTION * y.max())),
        _MIN_ROWS_OF_LOCKED_PORTION // 2,
    )
    if count < 2 * width:
        return None
    starts = np.arange(count - width + 1)
    sums = CumulativeSumsForLineFits(x, y, np.ones(count))
    _mt, _mx, squares, products, _xx = sums.compute_weighted_moments(starts, starts + width)
    slopes = products / squares
    # The fault is locked at the beginning, so the steepest slope is sought before friction has
    # changed by half of its change in the whole portion.
    steepest = float(slopes[:half].max())
    sd = math.sqrt(noise_variance(portion.time, y))
    if not steepest > _MIN_SLOPE_SIGMAS * sd / math.sqrt(float(squares.mean())):
        return None
    low = slopes < _MIN_SLOPE_OVER_LARGEST_SLOPE_BY_KIND[portion.portion_kind] * steepest
    last = int(np.argmax(low)) + width // 2 if low.any() else count
    if last < _MIN_ROWS_OF_LOCKED_PORTION or (
        portion.portion_kind == INITIAL_LOADING
        and y[last - 1] < _MIN_FRICTION_RISE_OF_INITIAL_LOADING
    ):
        return None
    every = -(-last // _MAX_ROWS_OF_LOCKED_PORTION)
    rows = slice(0, last, every)
    return LockedPortion(portion.portion_kind, *(of[rows] for of in portion[1:]))


def fit_stiffness(portion: LockedPortion) -> tuple[float, float]:
    """Fit the stiffness to a portion of a record.

    Parameters
    ----------
    portion : LockedPortion
        Portion of the record to which the stiffness is fitted.

    Returns
    -------
    stiffness : float
        Stiffness divided by normal stress, in 1/um.
    stderr : float
        Standard error of the stiffness.
    """
    time, x, y = portion.time, portion.load_point_displacement, portion.friction
    slope, level = np.polyfit(x, y, 1)
    unloads = portion.portion_kind == UNLOADING
    rate = 0.0 if unloads else math.log(0.3)
    first = np.array([level, math.log(max(slope, 1e-12)), rate, _PRIOR_OF_LOG_A[0], 0.0])
    bounds = np.array(
        [(-np.inf, np.inf), first[1] + np.array([-3.0, 3.0]), _BOUNDS_OF_LOG_RATE_RATIO,
         _BOUNDS_OF_LOG_A, _BOUNDS_OF_STATE_CHANGE]
    ).T  # fmt: skip
    bounds[1, 2] += unloads  # Sliding precedes the unloading, so |v| is about 1.
    prior_means, prior_sds = np.array([_PRIOR_OF_LOG_A, _PRIOR_OF_STATE_CHANGE]).T
    noise, noise_sd = build_white_noise_model(time), math.sqrt(noise_variance(time, y))

    def left(parameters: np.ndarray) -> np.ndarray:
        residuals = y - _compute_friction_while_locked(x, parameters, unloads)
        whitened = noise.whiten_columns(residuals[:, None])[:, 0] / noise_sd
        return np.append(whitened, (parameters[3:] - prior_means) / prior_sds)

    for _ in range(_NOISE_ESTIMATION_PASSES):
        found = least_squares(left, first, "3-point", bounds, x_scale="jac", xtol=1e-10)
        first = found.x
        residuals = y - _compute_friction_while_locked(x, first, unloads)
        jacobian = _compute_locked_friction_jacobian(x, first, unloads)
        least = max(noise_sd * 1e-3, 1e-12)
        noise = fit_noise_model(
            AUTOREGRESSIVE_NOISE_NAME, time, residuals, jacobian, min_noise_sd=least
        )
        innovations = noise.whiten_columns(residuals[:, None])[:, 0]
        noise_sd = max(float(np.linalg.norm(innovations)) / math.sqrt(len(y) - 3), least)
    whitened = noise.whiten_columns(jacobian) / noise_sd
    precision = whitened.T @ whitened
    precision[3:, 3:] += np.diag(prior_sds**-2.0)
    covariance = np.linalg.pinv(precision, hermitian=True)
    stiffness = math.exp(first[1])
    return stiffness, stiffness * math.sqrt(covariance[1, 1])


def _compute_locked_friction_jacobian(
    displacement: np.ndarray, parameters: np.ndarray, is_unloading: bool
) -> np.ndarray:
    """Return the derivatives of friction with respect to the parameters."""
    columns = []
    for number in range(len(parameters)):
        step = np.zeros(len(parameters))
        step[number] = 1e-5
        ends = (
            _compute_friction_while_locked(displacement, parameters + sign * step, is_unloading)
            for sign in (1, -1)
        )
        columns.append((next(ends) - next(ends)) / 2e-5)
    return np.column_stack(columns)


def _compute_friction_while_locked(
    displacement: np.ndarray, parameters: np.ndarray, is_unloading: bool
) -> np.ndarray:
    """Compute friction of an almost locked fault.

    The parameters are friction at zero displacement, ln k, ln |v|, ln a and g, where k is the
    stiffness divided by normal stress, v is the slip rate ratio, a is the direct effect and g is a
    constant.
    """
    level, log_k, log_rate, log_a, g = parameters.tolist()
    k, a = math.exp(log_k), math.exp(log_a)
    z = np.minimum(k * displacement / a, 600.0)
    if is_unloading:
        rate = -math.exp(log_rate)
    else:  # The slip rate ratio belongs to the last row.
        end = math.exp(-min(k * displacement[-1] / a, 600.0))
        rate = 1.0 / max(math.exp(-log_rate) / end + g * (1.0 / end - 1.0), 1e-300)
    loss = rate * np.expm1(z)
    if abs(g) > 1e-6:
        loss = -np.log1p(np.maximum(-g * loss, -1.0 + 1e-12)) / g
    return np.asarray(level + k * displacement - a * loss)
