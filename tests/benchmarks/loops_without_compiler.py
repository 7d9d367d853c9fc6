"""Benchmark of the engines without compiler against a SciPy loop by hand.

    python tests/benchmarks/loops_without_compiler.py [rounds]

All integrators use the same tolerance per step. The loop by hand receives the ends of its
stretches and detects no events. The times are the shortest CPU times of several alternating
rounds. The number of right-hand-side evaluations is also printed.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any
from unittest import mock

from contest import hand_written_loops
from contest.calls import cycling_scene
from contest.hand_written_loops import HandNumba, HandScipy
from contest.problem import Problem, cycle_problem
from contest.rsfstudy_engines import RsfstudyEngine
from engine_benchmark import with_best_marks

from rsfstudy.motion.accuracy import Accuracy

RTOL = 1e-5
ENGINES = "scipy", "python"


class CountingIntegrator(hand_written_loops.DOP853):  # type: ignore[misc]
    """SciPy's integrator with a counter of right-hand-side evaluations."""

    count = 0

    def __init__(self, rate: Callable[..., Any], *arguments: Any, **named: Any) -> None:
        def counted(t: float, y: Any) -> Any:
            CountingIntegrator.count += 1
            return rate(t, y)

        super().__init__(counted, *arguments, **named)


def evaluations_by_hand(run: Callable[[], Any]) -> int:
    """Return the number of evaluations of the loop by hand."""
    CountingIntegrator.count = 0
    with mock.patch.object(hand_written_loops, "DOP853", CountingIntegrator):
        run()
    return CountingIntegrator.count


def evaluations_of_engines(problems: list[Problem]) -> int:
    """Return the number of evaluations, which is equal for both engines."""
    engine = RsfstudyEngine("scipy")
    engine.run(problems, RTOL)
    return engine.integrator.evaluations


def shortest_times(runs: dict[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Return the shortest CPU time of each function, in s."""
    took = dict.fromkeys(runs, float("inf"))
    for _ in range(rounds):
        for name, run in runs.items():
            began = time.thread_time()
            run()
            took[name] = min(took[name], time.thread_time() - began)
    return took


def main(rounds: int) -> None:
    """Print the table of times and evaluations."""
    judge, by_hand = HandNumba(), HandScipy()
    tolerance = Accuracy(RTOL).local_tolerance
    print(f"{'':20}{'by hand':>10}{'sides':>7}{'scipy':>8}{'python':>8}{'sides':>7}")
    for law in ("slip", "slowness"):
        for stress in ("constant", "variable"):
            for contestant in (judge, by_hand):
                contestant.prepare(law, stress == "variable")
            problems = with_best_marks([cycle_problem(cycling_scene(law, stress))], judge, 1e-6)
            runs: dict[str, Callable[[], Any]] = {
                engine: partial(RsfstudyEngine(engine).run, problems, RTOL) for engine in ENGINES
            }
            runs["by hand"] = partial(by_hand.run, problems, tolerance)
            sides = evaluations_by_hand(runs["by hand"]), evaluations_of_engines(problems)
            took = shortest_times(runs, rounds)
            ratios = "".join(f"{took[engine] / took['by hand']:8.2f}" for engine in ENGINES)
            print(f"{law + ', ' + stress:20}{1e3 * took['by hand']:7.2f} ms{sides[0]:7}", end="")
            print(f"{ratios}{sides[1]:7}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
