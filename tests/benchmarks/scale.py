"""Benchmark of the overhead per cell: run ``scale.py [--million]``.

Trivial cells are computed in studies of 10^3, 10^4, 10^5 and, with ``--million``, 10^6
cells, with both engines, each in a new process. The table contains the time per cell of
each phase, the CPU time of all processes, the memory of the driver and the bytes on disk. A
real lattice is then computed with one worker and with two workers, alternately.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar
from unittest import mock

import numpy as np

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.execution import study_run
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.integrator import Integrator
from rsfstudy.status import Status


@dataclass(frozen=True)
class TrivialMeasure(Measure):
    """Measure that returns b/a without computing time."""

    name: ClassVar[str] = "free"
    primary_output: ClassVar[str] = "total"
    variables: ClassVar = {"total": ()}
    typical_rhs_evaluations: ClassVar[int] = 1

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Return b/a, and charge one right-hand-side evaluation."""
        integrator.work_meter.charge("any", 1)
        return Outcome(Status.OK, {"total": scene.b_over_a})


def lattice(cells: int) -> Study:
    """Return a study of ten rows of trivial cells."""
    return Study(
        name="scale",
        title="Cells that cost nothing",
        base=Scene(),
        axes=[
            Axis("a", np.linspace(0.01, 0.02, 10)),
            Axis("b_over_a", np.linspace(1.5, 3.0, cells // 10)),
        ],
        measure=TrivialMeasure(),
    )


def peak_memory() -> int:
    """Return the peak memory of this process in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


#: Phases of a run, by the methods that execute them.
PHASE_OF_METHOD = {
    "__init__": "planning",
    "_compute_missing_cells": "computing",
    "_write_results": "writing",
}


@contextlib.contextmanager
def time_phases(seconds: dict[str, float]) -> Iterator[None]:
    """Measure the time of each phase of a run."""

    def noting(method: Callable[..., Any], phase: str) -> Callable[..., Any]:
        def noted(*words: Any, **options: Any) -> Any:
            began = time.perf_counter()
            try:
                return method(*words, **options)
            finally:
                seconds[phase] = time.perf_counter() - began

        return noted

    with contextlib.ExitStack() as stack:
        for name, phase in PHASE_OF_METHOD.items():
            noted = noting(getattr(study_run.StudyRun, name), phase)
            stack.enter_context(mock.patch.object(study_run.StudyRun, name, noted))
        yield


def cpu_time() -> float:
    """Return the CPU time in s of this process and its finished children."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def measure_run(
    cells: int, workers: int, format: str = "netcdf", engine: str = "scipy"
) -> dict[str, float]:
    """Run a study in this process and return times in us per cell.

    The phase times include the measure. The time ``beyond`` excludes it.
    """
    options = {"workers": workers, "progress": False, "format": format, "engine": engine}
    with tempfile.TemporaryDirectory() as output:
        rsfstudy.run(lattice(100), output=output, **options)
    seconds: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as output, time_phases(seconds):
        before, used, began = peak_memory(), cpu_time(), time.perf_counter()
        results = rsfstudy.run(lattice(cells), output=output, **options)
        seconds["all"] = time.perf_counter() - began
        spent = cpu_time() - used
        sizes = {p.suffix: p.stat().st_size for p in Path(output).iterdir() if p.is_file()}
    physics = float(results["wall_time"].sum()) / max(1, workers)
    return {
        **{phase: 1e6 * took / cells for phase, took in seconds.items()},
        "beyond": 1e6 * (seconds["all"] - physics) / cells,
        "cpu": 1e6 * spent / cells,
        "bytes": (peak_memory() - before) / cells,
        "file": sizes.get(".nc", 0) / cells,
        "journal": sizes[".sqlite"] / cells,
    }


def measure_in_subprocess(*words: int | str) -> dict[str, float]:
    """Return the result of ``measure_run`` from a new process."""
    command = [sys.executable, __file__, *map(str, words)]
    said = subprocess.run(command, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(said.stdout)
    return found


def parallel_speedup(repeats: int = 3) -> list[float]:
    """Return the time with one worker divided by the time with two workers.

    The study is a lattice of 4,500 velocity steps.
    """
    ratios = []
    for _ in range(repeats):
        times = []
        for workers in (1, 2):
            with tempfile.TemporaryDirectory() as output:
                began = time.perf_counter()
                rsfstudy.run(
                    "rate_step_boundary",
                    b_over_a=np.linspace(1.3, 6.0, 1500),
                    workers=workers,
                    output=output,
                    progress=False,
                )
                times.append(time.perf_counter() - began)
        ratios.append(times[0] / times[1])
        print(f"  {times[0]:.1f} s on one worker, {times[1]:.1f} s on two: {ratios[-1]:.2f}")
    return ratios


COLUMNS = {
    "beyond": "us a cell beyond physics",
    **{phase: phase for phase in PHASE_OF_METHOD.values()},
    "cpu": "CPU",
    "bytes": "driver, bytes a cell",
    "file": "file",
    "journal": "journal",
}


def main(largest: int) -> None:
    """Print the table of ``studies/pages/explanation/accuracy_and_cost.md``."""
    print(f"| cells | engine | workers | {' | '.join(COLUMNS.values())} |")
    print("|---" * (3 + len(COLUMNS)) + "|")
    sizes = [size for size in (10**3, 10**4, 10**5, 10**6) if size <= largest]
    cases = itertools.product(sizes, ("scipy", "compiled"), (0, 2), ("netcdf",))
    for cells, engine, workers, format in (*cases, (10**5, "scipy", 2, "zarr")):
        found = measure_in_subprocess(cells, workers, format, engine)
        name = engine if format == "netcdf" else f"{engine} ({format})"
        numbers = " | ".join(f"{found[column]:.0f}" for column in COLUMNS)
        print(f"| {cells:,} | {name} | {workers} | {numbers} |", flush=True)
    print("\n4,500 rate steps:")
    ratios = parallel_speedup()
    print(f"  median {statistics.median(ratios):.2f}")


if __name__ == "__main__":
    asked = sys.argv[1:]
    if asked and asked[0] != "--million":
        print(json.dumps(measure_run(int(asked[0]), int(asked[1]), *asked[2:])))
    else:
        main(10**6 if asked else 10**5)
