"""Functions that estimate the error of the slow-manifold approximation in a recorded motion.

A comparison of two runs with different tolerances does not reveal the error of the slow-manifold
approximation, because both runs use the same approximation.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator

import numpy as np

from rsfstudy.motion.recording import (
    FIRST_STATE_COLUMN,
    MOTION_VARIABLE_NAMES,
    REGIME_COLUMN,
    SAMPLE_NUMBER_COLUMN,
    SAMPLES_PER_INTEGRATION_STEP,
    SPRING_AND_FRICTIONAL_STRESS_COLUMNS,
)
from rsfstudy.parts import (
    BOUNDARY_PRESSURE_RATE,
    LOAD_VELOCITY,
    LOADING,
    LOG_LOAD_VELOCITY,
    SEGMENT_LOG_VELOCITY,
    SEGMENT_START,
    SEGMENT_STRESS_RATE,
    SEGMENT_VELOCITY,
    A,
)
from rsfstudy.slider import NEGLIGIBLE_SECOND_ORDER_WEIGHT, FloatTuple, Scene

#: Safety factor of the error estimate. Without the safety factor, the error of friction is up to
#: 1.4 times the error estimate in random scenes. In these scenes, the thresholds for changes of
#: regime are three to ten times larger than usual.
_ERROR_SAFETY_FACTOR = 2.0
_SLIP_COLUMN, _SLIP_RATE_COLUMN = (
    MOTION_VARIABLE_NAMES.index("slip"),
    MOTION_VARIABLE_NAMES.index("log10_slip_rate"),
)


def estimate_neglected_inertia_error(
    scene: Scene, recorded_rows: np.ndarray, slow_regime_number: int, initial_log_slip_rate: float
) -> np.ndarray:
    r"""Estimate the error in ln V due to the approximation of inertia.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    recorded_rows : ndarray
        Rows of a recording, from ``MotionRecorder.as_table``.
    slow_regime_number : int
        Index of the slow-manifold regime in ``recorded_rows``.
    initial_log_slip_rate : float
        Value of :math:`\ln(V/V_*)` before the first row.

    Returns
    -------
    ndarray of shape (rows,)
        Error estimate of ln V for the motion up to each row. The estimate is zero if the scene has
        no inertia.

    Notes
    -----
    The error estimate is the sum of two contributions:

    - The residual of the inertial equation of motion on the slow manifold. Let :math:`W` be the
      inertia weight and :math:`s` the sum of slip and load point displacement. Friction is smaller
      than spring stress by :math:`a W \, d(\ln V)/ds`. The residual divided by :math:`a` is the
      local error :math:`e` of ln V. The resulting change in spring stress and state is at most the
      integral of :math:`e` over :math:`(1 + K/a) \, d\delta + |d\Psi|/a`. Errors decay along the
      motion, so the largest :math:`e` is another upper bound.
    - The slip, in D_c, that is neglected because ln V jumps when the motion returns to the slow
      manifold. The state does not evolve over this slip.
    """
    if not scene.has_mass:
        return np.zeros(len(recorded_rows))
    rates = np.append(initial_log_slip_rate, math.log(10.0) * recorded_rows[:, _SLIP_RATE_COLUMN])
    norms = scene.inertial_time * np.exp(rates)
    softness = scene.stiffness / scene.a
    on_manifold = recorded_rows[:, REGIME_COLUMN] == slow_regime_number
    arrives = on_manifold & (recorded_rows[:, SAMPLE_NUMBER_COLUMN] == 0.0)
    slips = softness * np.maximum(norms[1:], norms[:-1]) ** 2 * np.abs(np.diff(rates))
    # Residuals are evaluated at the middle and end of each step and at the beginning of each
    # regime.
    used = np.flatnonzero(
        on_manifold
        & (recorded_rows[:, SAMPLE_NUMBER_COLUMN] % (SAMPLES_PER_INTEGRATION_STEP // 2) == 0.0)
    )
    jumps = np.cumsum(np.where(arrives, slips, 0.0))
    if not used.size:
        return _ERROR_SAFETY_FACTOR * jumps
    left = np.maximum.accumulate(
        _compute_log_slip_rate_change_bounds(scene, recorded_rows[used], norms[1:][used])
    )
    # All other rows are assigned the estimate of the next evaluated row, because residuals may rise
    # steeply.
    numbers = np.arange(len(recorded_rows))
    number = np.minimum(np.searchsorted(used, numbers), used.size - 1)
    number -= (np.abs(used[number] - numbers) >= SAMPLES_PER_INTEGRATION_STEP // 2) & (number > 0)
    return _ERROR_SAFETY_FACTOR * (jumps + left[number])


def _compute_log_slip_rate_change_bounds(
    scene: Scene, recorded_rows: np.ndarray, slip_rate_norms: np.ndarray
) -> np.ndarray:
    """Compute upper bounds on the change in ln V due to force balance residuals.

    For each row, the upper bound is the smaller of two values: the integrated residual and the
    largest residual so far.
    """
    residuals = np.array(
        list(_iterate_equation_of_motion_residuals(scene, recorded_rows, slip_rate_norms))
    )
    states = recorded_rows[
        :, FIRST_STATE_COLUMN : FIRST_STATE_COLUMN + scene.parts.law.state_count
    ].sum(axis=1)
    softness = scene.stiffness / scene.a
    ways = (1.0 + softness) * np.diff(recorded_rows[:, _SLIP_COLUMN]) + np.abs(
        np.diff(states)
    ) / scene.a
    # A rupture may separate the first row of a regime from the previous row.
    ways[recorded_rows[1:, SAMPLE_NUMBER_COLUMN] == 0.0] = 0.0
    sums = np.append(0.0, np.cumsum(0.5 * (residuals[1:] + residuals[:-1]) * ways))
    found: np.ndarray = np.minimum(np.maximum.accumulate(residuals), sums)
    return found


def _iterate_equation_of_motion_residuals(
    scene: Scene, recorded_rows: np.ndarray, slip_rate_norms: np.ndarray
) -> Iterator[float]:
    """Yield the residual of the equation of motion at each row, divided by parameter a.

    The residual is set to zero if the inertia weight is negligible.
    """
    segments = list(_iterate_segment_scenes(scene))
    begins = [begin for begin, _acting, _p in segments]
    for row, norm in zip(recorded_rows, slip_rate_norms.tolist(), strict=True):
        # The last row of a segment and the first row of the next segment have the same time.
        side = bisect_right if row[SAMPLE_NUMBER_COLUMN] == 0.0 else bisect_left
        _begin, acting, p = segments[max(side(begins, row[0]) - 1, 0)]
        load = acting.inertial_time * abs(p[LOAD_VELOCITY])
        weight = acting.stiffness / acting.a * norm * (norm + load)
        known = (
            weight > NEGLIGIBLE_SECOND_ORDER_WEIGHT
            and len(row) >= FIRST_STATE_COLUMN + acting.state_count
        )
        yield _compute_force_balance_residual(acting, p, row, weight) if known else 0.0


def _compute_force_balance_residual(
    segment_scene: Scene, parameters: FloatTuple, recorded_row: np.ndarray, inertia_weight: float
) -> float:
    """Compute the residual of the equation of motion at a row, divided by parameter a.

    The recorded row must belong to the slow-manifold regime.
    """
    equations = segment_scene.equations_against_displacement()
    state = (
        recorded_row[SPRING_AND_FRICTIONAL_STRESS_COLUMNS][0] - segment_scene.mu_star,
        *recorded_row[FIRST_STATE_COLUMN : FIRST_STATE_COLUMN + segment_scene.state_count].tolist(),
    )
    rates = equations.rate_function(state, parameters)
    point = equations.motion_point_function(state, rates, parameters)
    missing: float = point.spring_stress - point.frictional_stress
    missing -= parameters[A] * inertia_weight * point.log_slip_rate_derivative
    return abs(missing) / parameters[A]


def _iterate_segment_scenes(scene: Scene) -> Iterator[tuple[float, Scene, FloatTuple]]:
    """Yield the start time, scene and parameters of each loading segment."""
    for acting, table in scene.segment_sequences_without_jumps:
        for n, row in enumerate(table.tolist()):
            p = list(acting.parameter_values)
            if n > 0:
                p[LOAD_VELOCITY], p[LOG_LOAD_VELOCITY] = (
                    row[SEGMENT_VELOCITY],
                    row[SEGMENT_LOG_VELOCITY],
                )
            if n > 0 and not math.isnan(row[SEGMENT_STRESS_RATE]):
                p[BOUNDARY_PRESSURE_RATE if acting.parts.fluid.unknowns else LOADING] = row[
                    SEGMENT_STRESS_RATE
                ]
            yield row[SEGMENT_START], acting, tuple(p)
