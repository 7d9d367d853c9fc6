"""Benchmark of the compiled engine, the SciPy engine and other solvers.

    python tests/benchmarks/engine_benchmark.py

The benchmark needs the extra ``peers``. All contestants are timed alternately in one
process. The times are the shortest of several rounds, and the ratios are relative to the
compiled engine. The error is the larger relative error of the recurrence interval and the
static stress drop. The reference values are computed with the package at its smallest
tolerance. Each contestant uses the loosest tolerance, in steps of a factor of 10^(1/2),
that meets the requested error. A contestant fails if no tolerance meets the error, or if
the contestant cannot be installed or run.

The other solvers integrate one cycle from a point on the limit cycle, between given marks.
The engines of rsfstudy detect the events themselves. The Numba loop by hand uses the same
method and is the lower limit of the time. The package numbalsoda has no wheel for Python
3.11 or newer and needs a Fortran compiler.

``--quick`` runs one law, one normal stress and one error.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import itertools
import math
import os
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from contest import calls
from contest.hand_written_loops import HandNumba, HandScipy
from contest.libraries import Cyrk, Diffrax, Heyoka, Numbalsoda, Sundae
from contest.problem import Problem, cycle_problem, with_marks
from contest.rsfstudy_engines import RsfstudyEngine
from rich.console import Console
from rich.table import Table

#: Smallest tolerances, in half decades.
_LAST_RUNG, _TIGHTEST_RSFSTUDY_RUNG = 26, 22
#: Half decades between the requested error and the first, looser tolerance of a search.
_START_RUNGS_LOOSER = 3
#: Half decades between the first tolerance that meets the error and the last tolerance of a
#: search.
_EXTRA_RUNGS = 2
#: Accuracies at which the package sets the marks, from loose to tight.
_MARK_RTOLS = (1e-4, 1e-7, 1e-8, 1e-9, 1e-10)
#: Range of b/a of many scenes, in which inertia affects the rupture at every accuracy.
_B_OVER_A = 1.5, 3.0
#: Minimum measured time in s.
_MIN_MEASURED_TIME = 0.01
#: Contestants whose search starts at the tolerance of another contestant with the same steps.
_TOLERANCE_SOURCE = {
    "rsfstudy, scipy": "rsfstudy, compiled",
    "SciPy loop by hand": "Numba loop by hand",
}
#: Time in s after which a failing contestant is stopped, and time in s above which a run is
#: slow.
_FAILURE_TIMEOUT, _SLOW_RUN_TIME = 60.0, 2.0
console = Console(width=120)


@dataclass
class Entry:
    """Result of a contestant in one case.

    The result contains the tolerance, the measured error and the time, or the reason for
    the failure.
    """

    contestant: Any
    problems: list[Problem]
    rung: int = 0
    error: float = math.inf
    ms: float = math.inf
    failed: str = ""
    started_at: float = field(default_factory=time.perf_counter)

    @property
    def tolerance(self) -> float:
        """Tolerance of the result."""
        return float(10.0 ** (-self.rung / 2.0))

    def choose_tolerance(self, first: int, target: float, more: int) -> None:
        """Find the cheapest tolerance that meets the target.

        The search continues beyond the loosest suitable tolerance, because a tolerance that
        is too loose may need more steps.
        """
        last = (
            _TIGHTEST_RSFSTUDY_RUNG if isinstance(self.contestant, RsfstudyEngine) else _LAST_RUNG
        )
        meeting: list[tuple[float, int, float]] = []
        for rung in range(first, last + 1):
            if self.failed and time.perf_counter() - self.started_at > _FAILURE_TIMEOUT:
                break
            error, seconds = self.try_rung(rung)
            if error <= target:
                meeting.append((seconds, rung, error))
            if meeting and (rung >= meeting[0][1] + more or seconds > _SLOW_RUN_TIME):
                break
        if meeting:
            self.failed = ""
            _seconds, self.rung, self.error = min(meeting)
        else:
            self.failed = self.failed or f"no tolerance meets {target:g}"

    def try_rung(self, rung: int) -> tuple[float, float]:
        """Return the error at a tolerance, and the time of a second run."""
        tolerance = 10.0 ** (-rung / 2.0)
        try:
            found = self.contestant.run(self.problems, tolerance)
            error = max(it.error(x) for it, x in zip(self.problems, found, strict=True))
            began = time.perf_counter()
            self.contestant.run(self.problems, tolerance)
        except Exception as wrong:
            self.failed = f"{type(wrong).__name__}: {wrong}"
            return math.inf, math.inf
        return error, time.perf_counter() - began

    def time_again(self) -> None:
        """Repeat the time measurement and keep the shortest time."""
        times, began = 0, time.perf_counter()
        while times == 0 or time.perf_counter() - began < _MIN_MEASURED_TIME:
            self.contestant.run(self.problems, self.tolerance)
            times += 1
        passed = time.perf_counter() - began
        self.ms = min(self.ms, 1e3 * passed / times / len(self.problems))


@contextlib.contextmanager
def silence_c_output() -> Iterator[None]:
    """Suppress the output of C libraries, which warn of loose tolerances."""
    flush = ctypes.CDLL(None).fflush
    kept, nowhere = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    flush(None)
    for number in (1, 2):
        os.dup2(nowhere, number)
    try:
        yield
    finally:
        flush(None)
        for number, before in zip((1, 2), kept, strict=True):
            os.dup2(before, number)
            os.close(before)
        os.close(nowhere)


def prepare_contestants(contestants: list[Any], law: str, variable: bool) -> dict[str, str]:
    """Prepare all contestants, and return the error messages of failures."""
    failed = {}
    for contestant in contestants:
        try:
            contestant.prepare(law, variable)
        except Exception as error:
            failed[contestant.name] = f"{type(error).__name__}: {error}"
    return failed


def with_best_marks(problems: list[Problem], judge: Any, target: float) -> list[Problem]:
    """Return each problem with the loosest marks that are accurate enough.

    If no marks leave an error well below the target, the most accurate marks are used.
    """

    def ready(it: Problem) -> Problem:
        errors: dict[float, Problem] = {}
        for rtol in _MARK_RTOLS:
            known = with_marks(it, rtol)
            error = it.error(judge.run([known], 1e-12)[0])
            if error <= 0.3 * target:
                return known
            errors[error] = known
        return errors[min(errors)]

    return [ready(it) for it in problems]


def race(
    contestants: list[Any],
    failed: dict[str, str],
    problems: list[Problem],
    target: float,
    rounds: int,
) -> list[Entry]:
    """Return the results of all contestants, timed alternately."""
    entries: dict[str, Entry] = {}
    for contestant in contestants:
        entry = Entry(contestant, problems, failed=failed.get(contestant.name, ""))
        if not entry.failed:
            like = entries.get(_TOLERANCE_SOURCE.get(contestant.name, ""))
            with silence_c_output():
                # The cheapest tolerance is the same for both, because both take the same steps.
                first = (
                    like.rung if like else round(-2.0 * math.log10(target)) - _START_RUNGS_LOOSER
                )
                entry.choose_tolerance(first, target, 0 if like else _EXTRA_RUNGS)
        entries[contestant.name] = entry
    for _ in range(rounds):
        for entry in entries.values():
            if not entry.failed:
                entry.time_again()
    return list(entries.values())


def print_case(case: str, one: list[Entry], many: list[Entry]) -> None:
    """Print the table of a case, and the reasons for failures."""
    head = ("tolerance", "error", "ms", "ratio")
    scenes = len(many[0].problems)
    table = Table(
        "contestant", *head, *head, title=f"{case}: a cycle of one scene, and of {scenes}"
    )
    for column in table.columns[1:]:
        column.justify = "right"
    base = one[0].ms, many[0].ms
    for pair in zip(one, many, strict=True):
        cells = []
        for entry, unit in zip(pair, base, strict=True):
            if entry.failed:
                cells += ["[red]fails[/red]", "", "", ""]
            else:
                ratio = f"{entry.ms / unit:.2f}"
                cells += [f"{entry.tolerance:.0e}", f"{entry.error:.0e}", f"{entry.ms:.3f}", ratio]
        table.add_row(pair[0].contestant.name, *cells)
    console.print(table)
    reasons = {(e.contestant.name, e.failed.splitlines()[0]) for e in one + many if e.failed}
    for name, why in sorted(reasons):
        console.print(f"{name} fails: {why}", markup=False)


def main() -> None:
    """Run the benchmark and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one law and one error")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--scenes", type=int, default=64, help="how many at once")
    parser.add_argument("--laws", default="slip,slowness")
    parser.add_argument("--stresses", default="constant,variable")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore")
    judge = HandNumba()
    contestants = [
        RsfstudyEngine("compiled"),
        judge,
        Cyrk(),
        Numbalsoda(),
        Sundae(),
        Heyoka(),
        Diffrax(),
        HandScipy(),
        RsfstudyEngine("scipy"),
    ]
    laws = ("slip",) if chosen.quick else chosen.laws.split(",")
    stresses = ("constant",) if chosen.quick else chosen.stresses.split(",")
    targets = (1e-6,) if chosen.quick else (1e-6, 1e-9)
    count = 8 if chosen.quick else chosen.scenes
    for law, stress in itertools.product(laws, stresses):
        failed = prepare_contestants(contestants, law, stress == "variable")
        alone = [cycle_problem(calls.cycling_scene(law, stress))]
        together = [
            cycle_problem(calls.cycling_scene(law, stress, x))
            for x in np.linspace(*_B_OVER_A, count)
        ]
        head = "call", "error", "compiled, ms", "scipy, ms", "ratio"
        of_calls = Table(*head, title=f"{law}, {stress}")
        for target in targets:
            results = [
                race(contestants, failed, with_best_marks(of, judge, target), target, rounds)
                for of, rounds in ((alone, chosen.rounds), (together, max(1, chosen.rounds // 2)))
            ]
            print_case(f"{law}, {stress}, {target:g}", *results)
            for call in calls.CALLS:
                found = calls.compare_at_equal_error(
                    calls.make_call(call, law, stress), target, chosen.rounds
                )
                ours, theirs = (found[engine][2] for engine in calls.ENGINES)
                ratio = f"{theirs / ours:.1f}"
                of_calls.add_row(call, f"{target:g}", f"{ours:.1f}", f"{theirs:.1f}", ratio)
        console.print(of_calls)
    uses = Table("seconds until the first cell", "s")
    for name, seconds in calls.first_use_times(1 if chosen.quick else 3).items():
        uses.add_row(name, f"{seconds:.2f}")
    console.print(uses)


if __name__ == "__main__":
    main()
