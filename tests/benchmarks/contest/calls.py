"""Times of user-level calls at equal error, and of first calls."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import rsfstudy
from rsfstudy import Scene

ENGINES = ("compiled", "scipy")
CALLS = ("limit_cycle", "critical_step")
_FIRST = """
import time
began = time.perf_counter()
import rsfstudy
scene = rsfstudy.Scene(
    law="slip", b_over_a=2.0, stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True
)
rsfstudy.limit_cycle(scene, rtol=1e-6, engine="{engine}")
print(time.perf_counter() - began)
"""


def cycling_scene(law: str, normal_stress: str, b_over_a: float = 2.0) -> Scene:
    """Return the scene of the benchmark."""
    return Scene(
        law=law,
        normal_stress=normal_stress,
        b_over_a=b_over_a,
        stiffness_ratio=0.8,
        load_velocity_ratio=2.0,
        inertia=True,
    )


def make_call(call: str, law: str, normal_stress: str) -> Callable[[float, str], list[float]]:
    """Return a function of rtol and engine that returns numbers to compare."""
    if call == "limit_cycle":
        scene = cycling_scene(law, normal_stress)

        def numbers(rtol: float, engine: str) -> list[float]:
            found = rsfstudy.limit_cycle(scene, rtol=rtol, engine=engine)
            return [float(found["recurrence_interval"]), float(found["static_stress_drop"])]
    else:
        scene = Scene(law=law, normal_stress=normal_stress, b_over_a=2.0, stiffness_ratio=1.3)

        def numbers(rtol: float, engine: str) -> list[float]:
            found = rsfstudy.critical_step(scene, rtol=rtol, engine=engine)
            return [float(found["critical_velocity_ratio"]) - 1.0]

    return numbers


def compare_at_equal_error(
    numbers: Callable[[float, str], list[float]], target: float, rounds: int
) -> Any:
    """Compare the engines at equal measured error.

    For each engine, the result contains the loosest rtol that meets the target, its
    measured error, and the shortest time of a call in milliseconds. The engines are timed
    alternately.
    """
    truth = numbers(1e-11, "compiled")

    def error(rtol: float, engine: str) -> float:
        pairs = zip(numbers(rtol, engine), truth, strict=True)
        errors = [abs(x / y - 1.0) for x, y in pairs]
        return math.inf if any(map(math.isnan, errors)) else max(errors)

    found: dict[str, list[float]] = {}
    for engine in ENGINES:
        # Both engines take the same steps, so SciPy starts at the rtol of the compiled engine.
        rung = 4 if engine == "compiled" else round(-2.0 * math.log10(found["compiled"][0]))
        while rung < 22 and (reached := error(10.0 ** (-rung / 2.0), engine)) > target:
            rung += 1
        found[engine] = [10.0 ** (-rung / 2.0), reached, math.inf]
    for _ in range(rounds):
        for engine, row in found.items():
            began = time.perf_counter()
            numbers(row[0], engine)
            row[2] = min(row[2], 1e3 * (time.perf_counter() - began))
    return found


def first_use_times(rounds: int) -> dict[str, float]:
    """Return the time in s until a new process has computed its first cell.

    The time includes the import. The shortest time of all rounds is returned.
    """
    found: dict[str, list[float]] = {}

    def run(name: str, engine: str, folder: str) -> None:
        words = [sys.executable, "-c", _FIRST.format(engine=engine)]
        around = {**os.environ, "XDG_CACHE_HOME": folder}
        said = subprocess.run(words, env=around, capture_output=True, text=True, check=True)
        found.setdefault(name, []).append(float(said.stdout))

    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            run("scipy", "scipy", folder)
            run("compiled, first use", "compiled", folder)
            run("compiled, second use", "compiled", folder)
    return {name: min(seconds) for name, seconds in found.items()}
