"""The engines of rsfstudy: cycles followed from a point, all events found on the way."""

from __future__ import annotations

from contest.hand import Found
from contest.problem import BUDGET, Problem, meter
from rsfstudy.analysis.cycles import cycles
from rsfstudy.motion.accuracy import Accuracy


class Ours:
    """One of the engines."""

    def __init__(self, engine: str) -> None:
        self.engine, self.name = engine, f"rsfstudy, {engine}"

    def prepare(self, law: str, variable: bool) -> None:
        """Nothing to do: the first call compiles."""

    def run(self, problems: list[Problem], tolerance: float) -> Found:
        """One cycle of each problem."""
        found: Found = []
        accuracy = Accuracy(tolerance, budget=BUDGET, engine=self.engine)
        for it in problems:
            cycle = next(cycles(it.scene, accuracy, meter(self.engine), it.begin))
            assert cycle is not None
            found.append((cycle.interval, cycle.highest - cycle.lowest))
        return found
