"""Random scenes, drawn from wide ranges of every parameter, and the questions asked of them."""

import math
import zlib
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from rsfstudy import Scene
from rsfstudy.measures import Measure
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.healing import Healing
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.rigid_response import RigidResponse
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.measures.velocity_step import VelocityStep

from ._normal_stress_response import NormalStressResponse
from ._normal_stress_transient import NormalStressTransient

#: What draws a number.
Draw = Callable[[np.random.Generator], float]


def between(low: float, high: float) -> Draw:
    """Any number between two, as likely as another."""
    return lambda draw: float(draw.uniform(low, high))


def decades(low: float, high: float) -> Draw:
    """Any number between two, each decade as likely as another."""
    exponent = between(math.log(low), math.log(high))
    return lambda draw: math.exp(exponent(draw))


def either_way(size: Draw) -> Draw:
    """A size, and a sign."""
    return lambda draw: size(draw) * (1.0 if draw.uniform() < 0.5 else -1.0)


class Question(NamedTuple):
    """Question that may be asked of a random scene: a measure, and what is drawn of the spring and
    the loading; numbers of the measure's own choice of scene are given as they are.
    """

    measure: Measure
    scene: Mapping[str, Draw | float]


_UNSTABLE, _STABLE = between(0.3, 0.97), between(1.0, 2.5)
#: Rigs from soft to stiff.
_RIG = decades(1.1, 300.0)
_FASTER, _ANY_RATE = decades(1.1, 100.0), decades(0.03, 30.0)

QUESTIONS: Mapping[str, Question] = {
    "limit cycle": Question(
        LimitCycle(phases=2), {"stiffness_ratio": _UNSTABLE, "load_velocity_ratio": _FASTER}
    ),
    "step response": Question(
        StepResponse(peaks=3, phases=2),
        {"stiffness_ratio": _STABLE, "load_velocity_ratio": _FASTER},
    ),
    "rate step": Question(CriticalStep(), {"stiffness_ratio": _STABLE}),
    "displacement step": Question(
        CriticalStep(of="displacement_step"), {"stiffness_ratio": _STABLE}
    ),
}
#: The same of the readings of a laboratory.
READINGS: Mapping[str, Question] = {
    "rigid response": Question(
        RigidResponse(points=2), {"load_velocity_ratio": decades(1e-4, 1e4)}
    ),
    "velocity step": Question(
        VelocityStep(phases=2), {"stiffness_ratio": _RIG, "load_velocity_ratio": _ANY_RATE}
    ),
    "healing": Question(
        Healing(phases=2),
        {"stiffness_ratio": _RIG, "load_velocity_ratio": _ANY_RATE, "hold_time": decades(1.0, 1e5)},
    ),
    "normal stress transient": Question(
        NormalStressTransient(phases=2),
        {
            "stiffness_ratio": _RIG,
            "load_velocity_ratio": 1.0,
            "normal_stress_step": either_way(decades(0.003, 0.3)),
        },
    ),
    "normal stress response": Question(
        NormalStressResponse(),
        {
            "stiffness_ratio": _RIG,
            "load_velocity_ratio": _ANY_RATE,
            "oscillation_amplitude": decades(1e-4, 0.03),
            "oscillation_period": decades(0.3, 300.0),
        },
    ),
}
ALL = {**QUESTIONS, **READINGS}


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
    ranges: Mapping[str, Draw | float] = {
        "a": decades(0.003, 0.025),
        "b_over_a": decades(0.1, 4.5),
        "mu_star": between(0.5, 0.85),
        "period": decades(0.1, 1000.0),
        "reference_rate": decades(1e-10, 1e-6),
        **ALL[question].scene,
    }
    fields = {name: by(draw) if callable(by) else by for name, by in ranges.items()}
    fields["b_over_a"] += 1.0
    angle, alpha = between(0.05, 0.95)(draw), between(0.0, 0.6)(draw)
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
