"""Answers to benchmark problems, computed with rsfstudy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import islice

import numpy as np

from rsfstudy.errors import RsfStudyError
from rsfstudy.measures import CriticalStep, LimitCycle, Measure
from rsfstudy.motion import Accuracy, EventKind, Integrator, MotionRecorder, MotionStopped, maximum
from rsfstudy.referee.benchmark_problem_files import BenchmarkProblem
from rsfstudy.status import Status

AnswerValuesByQuantity = dict[str, np.ndarray]
#: Maximum number of evaluations of the right-hand side per answer.
MAX_RHS_EVALUATIONS_PER_ANSWER = 5_000_000


def compute_answer(problem: BenchmarkProblem, accuracy: Accuracy) -> AnswerValuesByQuantity:
    """Compute the answer to a benchmark problem.

    Parameters
    ----------
    problem : BenchmarkProblem
        Problem to solve.
    accuracy : Accuracy
        Tolerance, work budget and engine of the integration.

    Returns
    -------
    dict of str to ndarray
        Columns of the answer in SI units.

    Raises
    ------
    RsfStudyError
        If the simulated motion ends before the answer is complete, or if a requested number does
        not exist or cannot be computed.
    """
    found = {
        "series": _compute_series_answer,
        "peaks": _compute_times_and_slip_rates_of_peaks,
        "numbers": _compute_requested_scalar_quantities,
    }[problem.report]
    try:
        told = found(problem, accuracy)
    except MotionStopped as halt:
        raise RsfStudyError(f"{problem.title}: {halt.status.label} ({halt})") from halt
    return {name: told[name] for name in problem.answer_column_names}


def compute_effective_normal_stress_series(problem: BenchmarkProblem) -> np.ndarray:
    """Compute the effective normal stress at the times of a time series.

    Parameters
    ----------
    problem : BenchmarkProblem
        Problem whose answer is a series.

    Returns
    -------
    ndarray, shape (n,)
        Effective normal stress in Pa.
    """
    asked = replace(problem, quantities=["normal_stress"])
    return compute_answer(asked, Accuracy(1e-11, MAX_RHS_EVALUATIONS_PER_ANSWER))["normal_stress"]


def _compute_series_answer(problem: BenchmarkProblem, accuracy: Accuracy) -> AnswerValuesByQuantity:
    r"""Compute a time series at the times that the problem specifies.

    The state variables :math:`\Theta` of the simulated motion are converted to :math:`\theta =
    \theta_* e^{\Theta/b}`. Before the conversion, the effect of normal stress on the state is
    subtracted from the state variables. The effect is distributed among the state variables in
    proportion to :math:`|b|`.
    """
    scene, rig = problem.scene, problem.rig
    at = np.array(problem.times) * rig.dimensionless("1 s")
    recording = MotionRecorder(sample_times=at)
    moving = Integrator(accuracy).follow(
        scene,
        recording=recording,
        until=float(at[-1]),
        resume_from=problem.initial_motion_state,
    )
    for _ in moving:
        pass
    seen = recording.as_table(scene)
    told = dict(zip(MotionRecorder.MOTION_VARIABLE_NAMES, seen.T, strict=False))
    sigma, b = rig.normal_stress, np.array(problem.b_values)
    states = seen[
        :,
        MotionRecorder.FIRST_STATE_COLUMN_INDEX : MotionRecorder.FIRST_STATE_COLUMN_INDEX + len(b),
    ]
    taken = states.sum(axis=1) - told["state_variable"]
    states = states - np.outer(taken, np.abs(b) / np.abs(b).sum())
    thetas = (np.array(problem.steady_thetas_at_reference_velocity) * np.exp(states / b)).T
    return {
        "time": np.array(problem.times),
        "friction": told["frictional_stress"] / told["normal_stress_ratio"],
        "slip_rate": rig.reference_velocity * 10.0 ** told["log10_slip_rate"],
        "theta": thetas[0],
        "theta_1": thetas[0],
        "theta_2": thetas[-1],
        "slip": rig.slip_distance * told["slip"],
        "normal_stress": sigma * told["normal_stress_ratio"],
        "pore_pressure": sigma * seen[:, -1],
    }


def _compute_times_and_slip_rates_of_peaks(
    problem: BenchmarkProblem, accuracy: Accuracy
) -> AnswerValuesByQuantity:
    """Compute the times and values of slip rate maxima."""
    rig = problem.rig
    watched = Integrator(accuracy).follow(
        problem.scene,
        [maximum("log_slip_rate")],
        with_time=True,
        resume_from=problem.initial_motion_state,
    )
    peaks = list(islice((e for e in watched if e.kind is EventKind.MAXIMUM), problem.count))
    return {
        "event": np.arange(1.0, problem.count + 1.0),
        "time": np.array([e.time for e in peaks]) / rig.dimensionless("1 s"),
        "slip_rate": rig.reference_velocity * np.exp([e.point.log_slip_rate for e in peaks]),
    }


def _compute_requested_scalar_quantities(
    problem: BenchmarkProblem, accuracy: Accuracy
) -> AnswerValuesByQuantity:
    """Compute an answer that consists of single numbers."""
    told: dict[str, float] = {}
    for names, find in _COMPUTE_FUNCTION_BY_SCALAR_QUANTITIES.items():
        if {*names} & {*problem.quantities}:
            told |= zip(names, find(problem, accuracy), strict=True)
    return {name: np.array([value]) for name, value in told.items()}


def _apply_measure_to_problem(
    problem: BenchmarkProblem, accuracy: Accuracy, measure: Measure
) -> Mapping[str, float]:
    """Apply a measure to the scene of a problem.

    Raises
    ------
    RsfStudyError
        If the status of the measure is not ok.
    """
    found = measure(problem.scene, accuracy)
    if found.status is not Status.OK:
        raise RsfStudyError(f"{measure.name}: {found.status.label} ({found.message})")
    return found.values


def _compute_linear_stability_quantities(
    problem: BenchmarkProblem, accuracy: Accuracy
) -> tuple[float, ...]:
    """Compute the critical stiffness, the growth rate and the frequency."""
    scene, rig = problem.scene, problem.rig
    growth = scene.linear_growth_rates(scene.log_load_velocity)[0] * scene.load_velocity
    stiffness = scene.critical_stiffness_at(scene.log_load_velocity)
    scale, rate = rig.normal_stress / rig.slip_distance, rig.dimensionless("1 s")
    return stiffness * scale, growth.real * rate, abs(growth.imag) * rate


def _compute_critical_velocity(problem: BenchmarkProblem, accuracy: Accuracy) -> tuple[float]:
    """Compute the critical load point velocity in m/s."""
    found = _apply_measure_to_problem(problem, accuracy, CriticalStep())
    return (problem.rig.reference_velocity * found["critical_velocity_ratio"],)


def _compute_critical_displacement_step(
    problem: BenchmarkProblem, accuracy: Accuracy
) -> tuple[float]:
    """Compute the critical displacement step in m."""
    found = _apply_measure_to_problem(problem, accuracy, CriticalStep(of="displacement_step"))
    return (problem.rig.slip_distance * found["critical_displacement"],)


def _compute_limit_cycle_quantities(
    problem: BenchmarkProblem, accuracy: Accuracy
) -> tuple[float, ...]:
    """Compute the recurrence interval, stress drops and slip rates."""
    rig, found = problem.rig, _apply_measure_to_problem(problem, accuracy, LimitCycle(phases=2))
    drops = (rig.normal_stress * found[f"{name}_stress_drop"] for name in ("static", "dynamic"))
    rates = (rig.reference_velocity * 10.0 ** found[f"{m}_log10_slip_rate"] for m in ("max", "min"))
    return found["recurrence_interval"] / rig.dimensionless("1 s"), *drops, *rates


_COMPUTE_FUNCTION_BY_SCALAR_QUANTITIES: Mapping[
    tuple[str, ...], Callable[[BenchmarkProblem, Accuracy], tuple[float, ...]]
] = {
    (
        "critical_stiffness",
        "growth_rate",
        "angular_frequency",
    ): _compute_linear_stability_quantities,
    ("critical_velocity",): _compute_critical_velocity,
    ("critical_displacement",): _compute_critical_displacement_step,
    (
        "recurrence_interval",
        "static_stress_drop",
        "dynamic_stress_drop",
        "peak_slip_rate",
        "slowest_slip_rate",
    ): _compute_limit_cycle_quantities,
}
