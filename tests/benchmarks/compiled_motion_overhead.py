"""Benchmark of the overhead of measures around the compiled loop.

Run ``python tests/benchmarks/compiled_motion_overhead.py [rounds]``.

The ratio in the table is the time of a measure divided by the time of its calls of the
compiled loop. The calls are repeated with copies of their arguments. Measure and calls are
timed alternately, and the shortest times count.
"""

from __future__ import annotations

import sys
import time
from typing import Any
from unittest import mock

import numpy as np

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.measures import Measure
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.compiled import numba_backend

ACCURACY = Accuracy(1e-7, engine="compiled")


def cases() -> dict[str, tuple[Measure, Scene]]:
    """Return measures and scenes by name."""
    steps, soft = {"b_over_a": 2.0, "stiffness_ratio": 1.3}, {"b_over_a": 2.0}
    soft |= {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True}
    found: dict[str, tuple[Measure, Scene]] = {}
    for law in ("slip", "slowness"):
        for stress in ("constant", "variable"):
            kind = {"law": law, "normal_stress": stress}
            found[f"critical_step {law} {stress}"] = CriticalStep(), Scene(**kind, **steps)
            found[f"limit_cycle {law} {stress}"] = LimitCycle(), Scene(**kind, **soft)
    shift = CriticalStep(of="displacement_step")
    found["critical_step slip constant, displacement"] = shift, Scene(law="slip", **steps)
    return found


def record_calls(measure: Measure, scene: Scene) -> list[tuple[Any, ...]]:
    """Return copies of the arguments of all calls of the compiled loop."""
    run, kept = numba_backend.compile_or_load_motion_loop(), list[tuple[Any, ...]]()

    def noting(*arguments: Any) -> Any:
        kept.append(copy_arguments(arguments))
        return run(*arguments)

    with mock.patch.object(numba_backend, "compile_or_load_motion_loop", return_value=noting):
        measure(scene, ACCURACY)
    return kept


def copy_arguments(value: Any) -> Any:
    """Return a deep copy of arguments, because the loop works in place."""
    if isinstance(value, tuple):
        return tuple(map(copy_arguments, value))
    return value.copy() if isinstance(value, np.ndarray) else value


def measurement_time(measure: Measure, scene: Scene) -> float:
    """Return the time of one measurement of a scene without cached values."""
    fresh = Scene(**scene.as_dict())
    began = time.perf_counter()
    measure(fresh, ACCURACY)
    return time.perf_counter() - began


def repeated_call_time(calls: list[tuple[Any, ...]]) -> float:
    """Return the total time of the calls of the loop.

    The time of the copies is excluded.
    """
    run = numba_backend.compile_or_load_motion_loop()
    arguments = [copy_arguments(each) for each in calls]
    began = time.perf_counter()
    for each in arguments:
        run(*each)
    return time.perf_counter() - began


def main(rounds: int) -> None:
    """Print the table of times and ratios."""
    print(f"{'':44}{'measure':>10}{'motions':>10}{'ratio':>7}{'calls':>7}{'sides':>7}")
    for name, (measure, scene) in cases().items():
        calls = record_calls(measure, scene)
        sides = measure(scene, ACCURACY).rhs_evaluations
        took = min(measurement_time(measure, scene) for _ in range(3))
        motions = repeated_call_time(calls)
        for _ in range(rounds):
            took = min(took, measurement_time(measure, scene))
            motions = min(motions, repeated_call_time(calls))
        times = f"{1e6 * took:10.0f}{1e6 * motions:10.0f}{took / motions:7.2f}"
        print(f"{name:44}{times}{len(calls):7}{sides:7}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
