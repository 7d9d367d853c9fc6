"""Functions that compute the errors of step times and velocities due to load point noise.

The model of the load point displacement consists of a straight line before the first step and
another straight line after each step. The covariance matrix of the step times and velocities is
computed from the derivatives of the modelled displacement and from the noise of the residuals, as
in a fit of friction.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_triangular

from rsfstudy.fitting import noise_models
from rsfstudy.fitting.outliers import find_rounding_quantum
from rsfstudy.fitting.record import Record
from rsfstudy.fitting.velocity_steps import LoadingStep
from rsfstudy.fitting.window_model import LOADING_STEP_SHIFT_OVER_STANDARD_ERROR

#: Largest number of block averages from which the noise is estimated. An autoregressive process of
#: block averages also describes slow fluctuations of the load point around its set point.
_MAX_BLOCK_AVERAGES_FOR_NOISE_ESTIMATE = 1000
#: The noise of the load point displacement is neglected if the ratio of the noise to the total
#: displacement of the record is less than this value.
_MIN_NOISE_OVER_TOTAL_DISPLACEMENT = 1e-7
#: Rounding errors are not random if the ratio of the noise to the rounding unit of displacement is
#: less than the first value. The second value is the number of random phases in the simulation of
#: rounding errors.
_MIN_DISPLACEMENT_NOISE_PER_QUANTUM, _ROUNDING_PHASE_DRAW_COUNT = 0.4, 200


def copy_steps_shifted_by_their_errors(
    record: Record, steps: Sequence[LoadingStep]
) -> list[list[LoadingStep]]:
    """Return copies of the steps with shifted times and velocities.

    The errors of the step times and velocities are correlated, but they can be written as a sum of
    statistically independent errors. In each copy of the steps, the step times and velocities are
    shifted by 1 % of one independent error.

    Parameters
    ----------
    record : Record
        Record that contains the steps.
    steps : sequence of LoadingStep
        Successive steps of load point velocity.

    Returns
    -------
    list of list of LoadingStep
        One copy of the steps for each independent error. The list is empty if the user specified
        the steps, or if the displacement has no noise.
    """
    if record.specified_steps is not None or not steps:
        return []
    speeds = np.array([steps[0].velocity_before, *(step.velocity_after for step in steps)])
    moved = []
    for late, faster in _compute_step_time_and_velocity_errors(record, steps, speeds):
        v = speeds + LOADING_STEP_SHIFT_OVER_STANDARD_ERROR * faster
        shifts = zip(
            steps, LOADING_STEP_SHIFT_OVER_STANDARD_ERROR * late, v[:-1], v[1:], strict=True
        )
        moved.append(
            [
                s._replace(
                    start=s.start + t, end=s.end + t, velocity_before=one, velocity_after=two
                )
                for s, t, one, two in shifts
            ]
        )
    return moved


def integrate_load_point_velocity(
    loading: np.ndarray, time: np.ndarray, zero_displacement_time: float
) -> np.ndarray:
    """Integrate the load point velocity to obtain the displacement.

    In contrast to the recorded displacement, the computed displacement has no noise. In the
    recorded displacement, noise dominates the differences between neighbouring rows. Generalised
    least squares uses these differences, so the noise would bias the fitted trend.

    Parameters
    ----------
    loading : ndarray, shape (segments, 4)
        Segments of constant velocity (see
        ``rsfstudy.fitting.recorded_loading.build_loading_history``). The velocity of the first
        segment is also used before the first segment.
    time : ndarray, shape (rows,)
        Times in s.
    zero_displacement_time : float
        Time in s at which the computed displacement is zero.

    Returns
    -------
    ndarray, shape (rows,)
        Load point displacement in um.
    """
    begins, speeds = loading[:, 0], loading[:, 1]
    knots = np.concatenate([[0.0], np.cumsum(np.diff(begins) * speeds[:-1])])

    def moved(at: np.ndarray) -> np.ndarray:
        piece = np.maximum(np.searchsorted(begins, at, side="right") - 1, 0)
        return np.asarray(knots[piece] + speeds[piece] * (at - begins[piece]))

    return np.asarray(moved(time) - moved(np.array([zero_displacement_time])))


def _compute_step_time_and_velocity_errors(
    record: Record, steps: Sequence[LoadingStep], velocities: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Compute independent errors of the step times and velocities.

    Returns
    -------
    list of (ndarray, ndarray)
        Pair of arrays for each independent error: the shifts of the step times in s, with shape
        (steps,), and the changes in the velocities in um/s, with shape (steps + 1,).
    """
    found, time = record.loading_steps, record.time
    begins = max((s.end for s in found if s.end < steps[0].start), default=time[0])
    ends = min((s.start for s in found if s.start > steps[-1].end), default=time[-1])
    rows = (time >= begins) & (time <= ends)
    for step in steps:
        rows &= (time <= step.start) | (time >= step.end)
    t, x = time[rows] - begins, record.columns["displacement"][rows]
    at = np.array([0.5 * (s.start + s.end) for s in steps]) - begins
    knots, moves = np.array([0.0, *at, ends - begins]), np.flatnonzero(velocities)
    late = -np.diff(velocities) * (t[:, None] > at)
    lasts = np.clip(t[:, None], knots[:-1], knots[1:]) - knots[:-1]
    columns = np.column_stack([late, lasts[:, moves], np.ones(len(t)), x - x[0]])
    best = np.linalg.lstsq(columns[:, :-1], columns[:, -1])[0]
    columns[:, -1] -= columns[:, :-1] @ best
    if (
        not np.std(columns[:, -1]) > _MIN_NOISE_OVER_TOTAL_DISPLACEMENT * np.ptp(x)
        or len(t) < 4 * columns.shape[1]
    ):
        return []
    quantum = find_rounding_quantum(record.columns["displacement"])
    if np.std(columns[:, -1]) < _MIN_DISPLACEMENT_NOISE_PER_QUANTUM * quantum:
        exact = columns[:, :-1] @ best + x[0]
        root = _compute_covariance_root_from_rounding(
            columns[:, :-1], exact, np.searchsorted(at, t), quantum
        )
    else:
        root = _compute_covariance_root_from_noise(t, columns)
    # The detected steps differ from the least-squares solution for all rows.
    missed = best[:-1] - np.concatenate([np.zeros(len(at)), velocities[moves]])
    root = np.column_stack([root, missed])
    faster = np.zeros((len(velocities), root.shape[1]))
    faster[moves] = root[len(at) :]
    return [*zip(root[: len(at)].T, faster.T, strict=True)]


def _compute_covariance_root_from_noise(
    time: np.ndarray, jacobian_and_residual_columns: np.ndarray
) -> np.ndarray:
    """Compute a square root of the covariance matrix of errors due to random noise.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Times in s.
    jacobian_and_residual_columns : ndarray, shape (rows, parameters + 1)
        Derivatives of displacement with respect to the parameters, followed by the residuals. The
        last parameter is the initial displacement.

    Returns
    -------
    ndarray
        A matrix :math:`A` such that :math:`A A^T` is the covariance matrix of the times and
        velocities.
    """
    every = -(-len(time) // _MAX_BLOCK_AVERAGES_FOR_NOISE_ESTIMATE)
    table = np.column_stack([time, jacobian_and_residual_columns])[: len(time) // every * every]
    time, *rest = table.reshape(-1, every, table.shape[1]).mean(axis=1).T
    jacobian, left = np.array(rest[:-1]).T, rest[-1]
    told = noise_models.fit_noise_model(
        noise_models.AUTOREGRESSIVE_NOISE_NAME, time, left, jacobian
    )
    white = told.whiten_columns(np.eye(len(time)))
    size = np.linalg.norm(white @ left) / np.sqrt(len(time) - jacobian.shape[1])
    # The steps are ordinary least-squares estimates, so their covariance matrix is J^+ R J^+'
    # with the pseudoinverse J^+ = (J'J)^-1 J' and the correlation matrix R of the noise.
    acting = solve_triangular(white, np.linalg.pinv(jacobian).T, trans="T", lower=True)
    return np.asarray(size * np.linalg.qr(acting)[1].T[:-1, :-1])


def _compute_covariance_root_from_rounding(
    jacobian: np.ndarray,
    unrounded_displacement: np.ndarray,
    row_segments: np.ndarray,
    rounding_quantum: float,
) -> np.ndarray:
    """Compute a square root of the covariance matrix of errors due to rounding.

    At a constant velocity, the rounding errors are periodic rather than random. However, the phase
    of the rounding errors is arbitrary in each straight segment. The function therefore fits lines
    to simulated rounding errors with random phases.

    Returns
    -------
    ndarray
        A matrix :math:`A` such that :math:`A A^T` is the covariance matrix of the times and
        velocities.
    """
    rng = np.random.default_rng(0)
    phases = (
        rounding_quantum
        * rng.random((_ROUNDING_PHASE_DRAW_COUNT, row_segments.max() + 1))[:, row_segments]
    )
    errors = (
        rounding_quantum * np.rint((unrounded_displacement + phases) / rounding_quantum)
        - unrounded_displacement
        - phases
    )
    moved = errors @ np.linalg.pinv(jacobian).T
    return np.asarray(np.linalg.qr(moved / np.sqrt(_ROUNDING_PHASE_DRAW_COUNT))[1].T[:-1])
