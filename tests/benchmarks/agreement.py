"""Comparison of both engines for hard cases, named studies and random scenes.

    python tests/benchmarks/agreement.py              # hard cases, 300 random, 50 dilatant scenes
    python tests/benchmarks/agreement.py --scenes 1000
    python tests/benchmarks/agreement.py --studies    # named studies too, as they are declared

Both engines integrate the same functions with the same method. Therefore, the statuses must
be equal, and the numbers must agree within the sum of the error estimates.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table
from rsfstudy.named_studies._random_scenes import MOTION_QUESTIONS, random_scene

from rsfstudy import Scene
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.study import study_loader

#: Scenes whose fields are varied at random.
RANDOM_SCENE_TEMPLATES = [
    Scene(law=law, **stress, **dynamics)
    for law in ("slip", "slowness")
    for stress in ({"normal_stress": "constant"}, {"normal_stress": "variable"})
    for dynamics in ({}, {"inertia": True}, {"radiation_damping": 1e-9})
]
DILATANT_TEMPLATES = [
    like.with_(fluid="dilatant", dilatancy=0.001) for like in RANDOM_SCENE_TEMPLATES
]
#: Studies that neither measure times nor compare integrators.
STUDIES = (
    "rate_step_boundary",
    "rate_step_stiffness",
    "displacement_boundary",
    "bounded_slip",
    "limit_cycles",
    "stress_drop",
    "instability_norm",
    "rate_step_lattice",
    "rigid_response",
    "linear_stability",
)


class EngineComparison(NamedTuple):
    """Comparison of the outcomes of both engines for one scene.

    Attributes
    ----------
    same_end : bool
        True if both outcomes have the same status.
    largest_error_ratio : float
        Largest difference of a number, divided by the sum of both error estimates, or NaN if there
        are no numbers.
    work_ratio : float
        Right-hand-side evaluations of the compiled engine, divided by the evaluations with SciPy.
    description : str
        Measure, statuses and scene.
    """

    same_end: bool
    largest_error_ratio: float
    work_ratio: float
    description: str


def compare_engines(measure: Measure, scene: Scene, accuracy: Accuracy) -> EngineComparison:
    """Compute one scene with both engines and compare the outcomes."""
    plain, compiled = (
        measure(scene, replace(accuracy, engine=engine)) for engine in ("scipy", "compiled")
    )
    what = f"{measure.name} {plain.status.label}/{compiled.status.label} {scene!r}"
    more = compiled.rhs_evaluations / max(1, plain.rhs_evaluations)
    return EngineComparison(
        plain.status is compiled.status, _largest_error_ratio(plain, compiled), more, what
    )


def _largest_error_ratio(plain: Outcome, compiled: Outcome) -> float:
    ratios = [math.nan]
    for name, value in plain.values.items():
        if f"{name}_error" not in plain.values or name not in compiled.values:
            continue
        allowed = np.asarray(plain.values[f"{name}_error"]) + compiled.values[f"{name}_error"]
        apart = np.abs(np.asarray(value) - compiled.values[name])
        with np.errstate(invalid="ignore"):
            ratios += np.where(apart == 0.0, 0.0, apart / allowed).ravel().tolist()
    return float(np.fmax.reduce(ratios))


def random_scenes(
    count: int, likes: list[Scene] = RANDOM_SCENE_TEMPLATES
) -> Iterator[tuple[Measure, Scene, Accuracy]]:
    """Yield random scenes for all questions and templates.

    The requested accuracies alternate between three values.
    """
    kinds = [(question, like) for question in MOTION_QUESTIONS for like in likes]
    for number in range(count):
        question, like = kinds[number % len(kinds)]
        scene = random_scene(like, question, 10_000 + number)
        accuracy = Accuracy((1e-4, 1e-7, 1e-9)[number // len(kinds) % 3])
        yield MOTION_QUESTIONS[question].measure, scene, accuracy


def cells_of(name: str) -> Iterator[tuple[Measure, Scene, Accuracy]]:
    """Yield the cells of a named study."""
    study = study_loader.load_study(name)
    for scene, changes in study.cells():
        yield study.measure.with_(**changes), scene, study.accuracy


def hard_cases() -> Iterator[tuple[Measure, Scene, Accuracy]]:
    """Yield the scenes of the study of hard cases, each with its measure."""
    study: Any = study_loader.load_study("hard_cases")
    for problem in study.measure.problems:
        yield problem.measure, problem.scene, study.accuracy


def main() -> None:
    """Compare the engines and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--studies", action="store_true")
    asked = parser.parse_args()
    sources = {
        "hard cases": hard_cases(),
        "random scenes": random_scenes(asked.scenes),
        "random dilatant scenes": random_scenes(asked.scenes // 6, DILATANT_TEMPLATES),
    }
    sources |= {name: cells_of(name) for name in (STUDIES if asked.studies else ())}
    console = Console()
    table = Table("", "scenes", "end alike", "worst difference over errors", "work")
    for name, source in sources.items():
        every = [compare_engines(*one) for one in source]
        for one in every:
            if not one.same_end or one.largest_error_ratio > 1.0:
                console.print(f"{one.largest_error_ratio:.3g} {one.description}")
        worst = float(np.fmax.reduce([one.largest_error_ratio for one in every]))
        work = f"{min(o.work_ratio for o in every):.2f} to {max(o.work_ratio for o in every):.2f}"
        alike = sum(one.same_end for one in every)
        table.add_row(name, str(len(every)), str(alike), f"{worst:.2f}", work)
    console.print(table)


if __name__ == "__main__":
    main()
