"""What the effects of a scene cost in a limit cycle: unknowns, right-hand sides, and the time of
one.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy.core.accuracy import Accuracy
from rsfstudy.core.stepping import Halt, Meter
from rsfstudy.equations import Equations, inertial, slow_manifold, without_mass
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.scene import Scene

#: Evaluations timed together, and how often.
_EVALUATIONS, _REPEATS = 400, 5

_CYCLE = LimitCycle(phases=2)
_KEPT = (
    "recurrence_interval",
    "recurrence_interval_error",
    "static_stress_drop",
    "dynamic_stress_drop",
    "min_log10_slip_rate",
    "max_log10_slip_rate",
    "work_per_cycle",
)


@dataclass(frozen=True)
class EffectCost(Measure):
    """A limit cycle, with what its effects cost: the numbers of the cycle, the unknowns of each
    form of the equations, the share of the work that the full equations took, and the time of one
    right-hand side of each form.
    """

    name: ClassVar[str] = "effect_cost"

    @property
    def headline(self) -> str:
        return "recurrence_interval"

    @property
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        costs = ("unknowns", "unknowns_in_rupture", "share_in_rupture")
        times = ("time_per_evaluation", "time_per_evaluation_in_rupture")
        return dict.fromkeys((*_KEPT, *costs, *times), ())

    @property
    def typical_work(self) -> int:
        return 20_000

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """The cycle under this meter; then the forms of the equations on their own."""
        slow = (slow_manifold if scene.inertia else without_mass)(scene, clock=False)
        costs = {
            "unknowns": float(len(slow.unknowns)),
            "time_per_evaluation": _seconds(slow, (0.01, 0.0)),
        }
        if scene.inertia:
            fast = inertial(scene)
            costs |= {
                "unknowns_in_rupture": float(len(fast.unknowns)),
                "time_per_evaluation_in_rupture": _seconds(fast, (0.01, 10.0, 0.01)),
            }
        try:
            found = _CYCLE.find(scene, accuracy, meter)
        except Halt as halt:
            return Outcome(halt.status, costs, str(halt))
        spent = meter.by_regime.get("inertial", 0)
        costs["share_in_rupture"] = spent / meter.spent if meter.spent else math.nan
        kept = {name: found.values[name] for name in _KEPT if name in found.values}
        return Outcome(found.status, {**kept, **costs}, found.message)


def _seconds(equations: Equations, state: tuple[float, ...]) -> float:
    """Time of one right-hand side, median of several timings."""
    timings = []
    for _ in range(_REPEATS):
        began = time.perf_counter()
        for _ in range(_EVALUATIONS):
            equations.rate(0.0, state)
        timings.append((time.perf_counter() - began) / _EVALUATIONS)
    return statistics.median(timings)
