"""Random scenes, and measures to compute for each scene.

A question combines a measure with probability distributions of the loading parameters. All other
parameters of a scene are drawn from wide ranges.
"""

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

#: Function that draws a random number.
DrawFunction = Callable[[np.random.Generator], float]


def draw_uniform(low: float, high: float) -> DrawFunction:
    """Return a function that draws uniformly distributed numbers.

    Parameters
    ----------
    low : float
        Lower end of the range.
    high : float
        Upper end of the range.

    Returns
    -------
    DrawFunction
        Function that draws a number with a random number generator.
    """
    return lambda draw: float(draw.uniform(low, high))


def draw_log_uniform(low: float, high: float) -> DrawFunction:
    """Return a function that draws log-uniformly distributed numbers.

    Parameters
    ----------
    low : float
        Lower end of the range.
    high : float
        Upper end of the range.

    Returns
    -------
    DrawFunction
        Function that draws a number with a random number generator.
    """
    exponent = draw_uniform(math.log(low), math.log(high))
    return lambda draw: math.exp(exponent(draw))


def draw_signed(size: DrawFunction) -> DrawFunction:
    """Return a function that draws numbers with a random sign.

    Parameters
    ----------
    size : DrawFunction
        Function that draws the absolute value.

    Returns
    -------
    DrawFunction
        Function that draws a number with a random number generator.
    """
    return lambda draw: size(draw) * (1.0 if draw.uniform() < 0.5 else -1.0)


class Question(NamedTuple):
    """Question about a random scene.

    Parameters
    ----------
    measure : Measure
        Measure that is computed for the scene.
    scene : mapping
        Fields of the spring and of the loading, each with a fixed value or a function that draws
        the value.
    """

    measure: Measure
    scene: Mapping[str, DrawFunction | float]


_UNSTABLE_STIFFNESS_RATIO, _STABLE_STIFFNESS_RATIO = draw_uniform(0.3, 0.97), draw_uniform(1.0, 2.5)
#: Stiffness of testing machines relative to the critical stiffness.
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
#: Questions about quantities that are measured in laboratory tests.
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
    """Draw a random scene.

    The random number generator is seeded with the sample number and the type of the scene. Calls
    with the same arguments therefore return the same scene.

    Parameters
    ----------
    like : Scene
        Scene that determines the law, the normal stress condition and the dynamics.
    question : str
        Name of the question.
    sample : int
        Number of the random sample.

    Returns
    -------
    Scene
        Scene with random parameters.

    Raises
    ------
    InvalidValue
        If the loading of the question is not compatible with the normal stress condition.
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
        # The radiation damping is close to the impedance of the spring and the mass.
        inertial_time = fields["period"] * fields["reference_rate"] / (2.0 * math.pi)
        impedance = fields.get("stiffness_ratio", 1.0) * fields["a"] * inertial_time
        fields["radiation_damping"] = impedance * (fields["b_over_a"] - 1.0)
    return like.with_(**fields)
