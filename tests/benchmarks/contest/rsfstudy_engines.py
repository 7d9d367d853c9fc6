"""The engines of rsfstudy, which detect all events of a cycle."""

from __future__ import annotations

from contest.hand_written_loops import CycleNumbers
from contest.problem import BUDGET, Problem
from rsfstudy.limit_cycles.stick_slip_cycles import iterate_stick_slip_cycles
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integrator import Integrator


class RsfstudyEngine:
    """Participant that uses an engine of rsfstudy."""

    def __init__(self, engine: str) -> None:
        self.engine, self.name = engine, f"rsfstudy, {engine}"
        #: Integrator of the last run.
        self.integrator = Integrator(Accuracy(engine=engine))

    def prepare(self, law: str, variable: bool) -> None:
        """Do nothing, because the first call compiles the equations."""

    def run(self, problems: list[Problem], tolerance: float) -> CycleNumbers:
        """Integrate one cycle of each problem."""
        found: CycleNumbers = []
        self.integrator = Integrator(Accuracy(tolerance, budget=BUDGET, engine=self.engine))
        for it in problems:
            cycle = next(iterate_stick_slip_cycles(it.scene, self.integrator, it.begin))
            assert cycle is not None
            found.append(
                (
                    cycle.recurrence_interval,
                    cycle.max_spring_stress_minus_steady - cycle.min_spring_stress_minus_steady,
                )
            )
        return found
