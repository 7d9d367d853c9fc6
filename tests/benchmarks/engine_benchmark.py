"""The compiled engine against the SciPy engine and against peers.

    python tests/benchmarks/engine_benchmark.py

Needs the extra ``peers``. All contestants take turns in one process; times are the shortest of
rounds, and ratios are to the compiled engine. Errors are measured: the larger relative error of
recurrence interval and static stress drop, against the package at its smallest tolerance. Each
contestant is given the loosest tolerance, by factors of 10^(1/2), that meets the error asked for;
who meets it at none, or cannot be installed or made to run, is shown failing.

A peer integrates one cycle from a point on the limit cycle, between marks that it is told; the
engines find events of their own. The Numba loop by hand, of the same method, is the limit.
numbalsoda has no wheel for Python 3.11 and later, and builds only where a Fortran compiler is.

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

#: Rungs of the ladder of tolerances, in half decades.
_LAST_RUNG, _TIGHTEST_RSFSTUDY_RUNG = 26, 22
#: Rungs by which a search begins at a tolerance looser than the error asked for.
_START_RUNGS_LOOSER = 3
#: Rungs beyond the first that meets it, among which the cheapest is sought.
_EXTRA_RUNGS = 2
#: Accuracies for which the package would set the marks, the loosest first.
_MARK_RTOLS = (1e-4, 1e-7, 1e-8, 1e-9, 1e-10)
#: Range of b/a of many scenes: where mass acts in a rupture, whatever the accuracy.
_B_OVER_A = 1.5, 3.0
#: Shortest time to measure, in seconds.
_MIN_MEASURED_TIME = 0.01
#: Whose tolerance a slow contestant's search begins with: that of the same steps.
_TOLERANCE_SOURCE = {
    "rsfstudy, scipy": "rsfstudy, compiled",
    "SciPy loop by hand": "Numba loop by hand",
}
#: Seconds after which a failing contestant is given up, and beyond which a run is slow.
_FAILURE_TIMEOUT, _SLOW_RUN_TIME = 60.0, 2.0
console = Console(width=120)


@dataclass
class Entry:
    """A contestant in one case: with which tolerance, with which error, how fast, or why not."""

    contestant: Any
    problems: list[Problem]
    rung: int = 0
    error: float = math.inf
    ms: float = math.inf
    failed: str = ""
    started_at: float = field(default_factory=time.perf_counter)

    @property
    def tolerance(self) -> float:
        """The tolerance of the rung."""
        return float(10.0 ** (-self.rung / 2.0))

    def choose_tolerance(self, first: int, target: float, more: int) -> None:
        """Find the cheapest tolerance that meets the target: of the loosest that does, and some
        more, because too loose a tolerance may cost more steps.
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
        """Error at a rung, and the seconds of a second run."""
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
        """Time it once more."""
        times, began = 0, time.perf_counter()
        while times == 0 or time.perf_counter() - began < _MIN_MEASURED_TIME:
            self.contestant.run(self.problems, self.tolerance)
            times += 1
        passed = time.perf_counter() - began
        self.ms = min(self.ms, 1e3 * passed / times / len(self.problems))


@contextlib.contextmanager
def silence_c_output() -> Iterator[None]:
    """Nothing of what libraries in C print, which warn of tolerances that are too loose."""
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
    """Have contestants prepare; why those that cannot, cannot."""
    failed = {}
    for contestant in contestants:
        try:
            contestant.prepare(law, variable)
        except Exception as error:
            failed[contestant.name] = f"{type(error).__name__}: {error}"
    return failed


def with_best_marks(problems: list[Problem], judge: Any, target: float) -> list[Problem]:
    """Problems, each with the loosest marks that leave an error well below the target, or with the
    best of all.
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
    """Entries of all contestants, timed in turns."""
    entries: dict[str, Entry] = {}
    for contestant in contestants:
        entry = Entry(contestant, problems, failed=failed.get(contestant.name, ""))
        if not entry.failed:
            like = entries.get(_TOLERANCE_SOURCE.get(contestant.name, ""))
            with silence_c_output():
                # the same steps are cheapest for both
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
    """Print the table of a case, and why contestants fail."""
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
    """Print the tables."""
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
