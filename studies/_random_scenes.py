"""Random scenes, drawn from wide ranges of every parameter, and the questions asked of them."""

import math
import zlib
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from rsfstudy import Scene
from rsfstudy.measures import (
    CriticalStep,
    Healing,
    LimitCycle,
    Measure,
    RigidResponse,
    StepResponse,
    VelocityStep,
)

from ._normal_stress_response import NormalStressResponse
from ._normal_stress_transient import NormalStressTransient

#: What draws a number.
DrawFunction = Callable[[np.random.Generator], float]


def draw_uniform(low: float, high: float) -> DrawFunction:
    """Any number between two, as likely as another."""
    return lambda draw: float(draw.uniform(low, high))


def draw_log_uniform(low: float, high: float) -> DrawFunction:
    """Any number between two, each decade as likely as another."""
    exponent = draw_uniform(math.log(low), math.log(high))
    return lambda draw: math.exp(exponent(draw))


def draw_signed(size: DrawFunction) -> DrawFunction:
    """A size, and a sign."""
    return lambda draw: size(draw) * (1.0 if draw.uniform() < 0.5 else -1.0)


class Question(NamedTuple):
    """Question that may be asked of a random scene: a measure, and what is drawn of the spring and
    the loading; numbers of the measure's own choice of scene are given as they are.
    """

    measure: Measure
    scene: Mapping[str, DrawFunction | float]


_UNSTABLE_STIFFNESS_RATIO, _STABLE_STIFFNESS_RATIO = draw_uniform(0.3, 0.97), draw_uniform(1.0, 2.5)
#: Rigs from soft to stiff.
_RIG_STIFFNESS_RATIO = draw_log_uniform(1.1, 300.0)
_STEP_UP, _STEP_UP_OR_DOWN = draw_log_uniform(1.1, 100.0), draw_log_uniform(0.03, 30.0)

MOTION_QUESTIONS: Mapping[str, Question] = {
    "limit cycle": Question(
        LimitCycle(phases=2),
        {"stiffness_ratio": _UNSTABLE_STIFFNESS_RATIO, "load_velocity_ratio": _STEP_UP},
    ),
    "step response": Question(
        StepResponse(peaks=3, phases=2),
        {"stiffness_ratio": _STABLE_STIFFNESS_RATIO, "load_velocity_ratio": _STEP_UP},
    ),
    "rate step": Question(CriticalStep(), {"stiffness_ratio": _STABLE_STIFFNESS_RATIO}),
    "displacement step": Question(
        CriticalStep(of="displacement_step"), {"stiffness_ratio": _STABLE_STIFFNESS_RATIO}
    ),
}
#: The same of the readings of a laboratory.
LABORATORY_QUESTIONS: Mapping[str, Question] = {
    "rigid response": Question(
        RigidResponse(points=2), {"load_velocity_ratio": draw_log_uniform(1e-4, 1e4)}
    ),
    "velocity step": Question(
        VelocityStep(phases=2),
        {"stiffness_ratio": _RIG_STIFFNESS_RATIO, "load_velocity_ratio": _STEP_UP_OR_DOWN},
    ),
    "healing": Question(
        Healing(phases=2),
        {
            "stiffness_ratio": _RIG_STIFFNESS_RATIO,
            "load_velocity_ratio": _STEP_UP_OR_DOWN,
            "hold_time": draw_log_uniform(1.0, 1e5),
        },
    ),
    "normal stress transient": Question(
        NormalStressTransient(phases=2),
        {
            "stiffness_ratio": _RIG_STIFFNESS_RATIO,
            "load_velocity_ratio": 1.0,
            "normal_stress_step": draw_signed(draw_log_uniform(0.003, 0.3)),
        },
    ),
    "normal stress response": Question(
        NormalStressResponse(),
        {
            "stiffness_ratio": _RIG_STIFFNESS_RATIO,
            "load_velocity_ratio": _STEP_UP_OR_DOWN,
            "oscillation_amplitude": draw_log_uniform(1e-4, 0.03),
            "oscillation_period": draw_log_uniform(0.3, 300.0),
        },
    ),
}
ALL_QUESTIONS = {**MOTION_QUESTIONS, **LABORATORY_QUESTIONS}


def random_scene(like: Scene, question: str, sample: int) -> Scene:
    """A scene of the same law, normal stress condition and dynamics as another, with numbers drawn
    from wide ranges.

    Raises
    ------
    InvalidValue
        Where the question is of a loading that has no meaning for that normal stress condition.
    """
    kind = f"{question} {like.law} {' '.join(like.effects)}"
    draw = np.random.default_rng([sample, zlib.crc32(kind.encode())])
    ranges: Mapping[str, DrawFunction | float] = {
        "a": draw_log_uniform(0.003, 0.025),
        "b_over_a": draw_log_uniform(0.1, 4.5),
        "mu_star": draw_uniform(0.5, 0.85),
        "period": draw_log_uniform(0.1, 1000.0),
        "reference_rate": draw_log_uniform(1e-10, 1e-6),
        **ALL_QUESTIONS[question].scene,
    }
    fields = {name: by(draw) if callable(by) else by for name, by in ranges.items()}
    fields["b_over_a"] += 1.0
    angle, alpha = draw_uniform(0.05, 0.95)(draw), draw_uniform(0.0, 0.6)(draw)
    if like.alpha is not None:
        fields["alpha"] = alpha
    if like.phi is not None:
        lowest = math.degrees(math.atan(fields["mu_star"]))
        fields["phi"] = lowest + angle * (90.0 - lowest)
    if like.radiation_damping:
        # about the impedance of spring and mass
        inertial_time = fields["period"] * fields["reference_rate"] / (2.0 * math.pi)
        impedance = fields.get("stiffness_ratio", 1.0) * fields["a"] * inertial_time
        fields["radiation_damping"] = impedance * (fields["b_over_a"] - 1.0)
    return like.with_(**fields)
