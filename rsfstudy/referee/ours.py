"""Answers of rsfstudy to problems."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import islice

import numpy as np

from rsfstudy.errors import RsfStudyError
from rsfstudy.measures import Measure
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import Kind, maximum
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.recording import OBSERVED, STATES, Recording
from rsfstudy.referee.problem import Problem
from rsfstudy.slider.stability import critical_stiffness, growth_rates
from rsfstudy.status import Status

Table = dict[str, np.ndarray]
#: What answers may cost.
BUDGET = 5_000_000


def answer(problem: Problem, accuracy: Accuracy) -> Table:
    """Columns of the answer in SI units, by name.

    Raises
    ------
    RsfStudyError
        Where the motion ends before all is told, or a number that is asked for does not exist, or
        is not found.
    """
    found = {"series": _series, "peaks": _peaks, "numbers": _numbers}[problem.report]
    try:
        told = found(problem, accuracy)
    except Halt as halt:
        raise RsfStudyError(f"{problem.title}: {halt.status.label} ({halt})") from halt
    return {name: told[name] for name in problem.columns}


def normal_stress(problem: Problem) -> np.ndarray:
    """Effective normal stress in Pa at the times of a series, to which friction refers."""
    asked = replace(problem, quantities=["normal_stress"])
    return answer(asked, Accuracy(1e-11, BUDGET))["normal_stress"]


def _series(problem: Problem, accuracy: Accuracy) -> Table:
    scene, rig = problem.scene, problem.rig
    at = np.array(problem.times) * rig.dimensionless("1 s")
    recording, meter = Recording(at=at), Meter(accuracy.budget, engine=accuracy.engine)
    moving = follow(
        scene, accuracy, meter, recording=recording, until=float(at[-1]), since=problem.since
    )
    for _ in moving:
        pass
    seen = recording.seen(scene)
    told = dict(zip(OBSERVED, seen.T, strict=False))
    sigma, b = rig.normal_stress, np.array(problem.b)
    states = seen[:, STATES : STATES + len(b)]
    taken = states.sum(axis=1) - told["state_variable"]
    states = states - np.outer(taken, np.abs(b) / np.abs(b).sum())
    thetas = (np.array(problem.theta_star) * np.exp(states / b)).T
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


def _peaks(problem: Problem, accuracy: Accuracy) -> Table:
    rig, meter = problem.rig, Meter(accuracy.budget, engine=accuracy.engine)
    watched = follow(
        problem.scene, accuracy, meter, [maximum("log_slip_rate")], clock=True, since=problem.since
    )
    peaks = list(islice((e for e in watched if e.kind is Kind.MAXIMUM), problem.count))
    return {
        "event": np.arange(1.0, problem.count + 1.0),
        "time": np.array([e.time for e in peaks]) / rig.dimensionless("1 s"),
        "slip_rate": rig.reference_velocity * np.exp([e.point.log_slip_rate for e in peaks]),
    }


def _numbers(problem: Problem, accuracy: Accuracy) -> Table:
    told: dict[str, float] = {}
    for names, find in _FINDERS.items():
        if {*names} & {*problem.quantities}:
            told |= zip(names, find(problem, accuracy), strict=True)
    return {name: np.array([value]) for name, value in told.items()}


def _measured(problem: Problem, accuracy: Accuracy, measure: Measure) -> Mapping[str, float]:
    found = measure(problem.scene, accuracy)
    if found.status is not Status.OK:
        raise RsfStudyError(f"{measure.name}: {found.status.label} ({found.message})")
    return found.values


def _linear(problem: Problem, accuracy: Accuracy) -> tuple[float, ...]:
    scene, rig = problem.scene, problem.rig
    growth = growth_rates(scene, scene.log_load_rate)[0] * scene.load_velocity
    stiffness = critical_stiffness(scene, scene.log_load_rate)
    scale, rate = rig.normal_stress / rig.slip_distance, rig.dimensionless("1 s")
    return stiffness * scale, growth.real * rate, abs(growth.imag) * rate


def _critical_velocity(problem: Problem, accuracy: Accuracy) -> tuple[float]:
    found = _measured(problem, accuracy, CriticalStep())
    return (problem.rig.reference_velocity * found["critical_velocity_ratio"],)


def _critical_displacement(problem: Problem, accuracy: Accuracy) -> tuple[float]:
    found = _measured(problem, accuracy, CriticalStep(of="displacement_step"))
    return (problem.rig.slip_distance * found["critical_displacement"],)


def _cycle(problem: Problem, accuracy: Accuracy) -> tuple[float, ...]:
    rig, found = problem.rig, _measured(problem, accuracy, LimitCycle(phases=2))
    drops = (rig.normal_stress * found[f"{name}_stress_drop"] for name in ("static", "dynamic"))
    rates = (rig.reference_velocity * 10.0 ** found[f"{m}_log10_slip_rate"] for m in ("max", "min"))
    return found["recurrence_interval"] / rig.dimensionless("1 s"), *drops, *rates


_FINDERS: Mapping[tuple[str, ...], Callable[[Problem, Accuracy], tuple[float, ...]]] = {
    ("critical_stiffness", "growth_rate", "angular_frequency"): _linear,
    ("critical_velocity",): _critical_velocity,
    ("critical_displacement",): _critical_displacement,
    (
        "recurrence_interval",
        "static_stress_drop",
        "dynamic_stress_drop",
        "peak_slip_rate",
        "slowest_slip_rate",
    ): _cycle,
}
