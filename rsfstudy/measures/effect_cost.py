"""Cost of the effects of a scene in a limit cycle: unknowns, right-hand sides, and how much
longer one takes than in the plainest scene.
"""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import dataclass, replace
from typing import ClassVar

from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.quantity import Output
from rsfstudy.slider.equations import Equations, between_ruptures, in_rupture
from rsfstudy.slider.scene import Scene

#: Evaluations timed together, and how often: the forms of the equations take short turns, so that
#: a busy moment of the machine falls on all of them.
_EVALUATIONS, _TURNS = 100, 25
#: Unknowns at which they are evaluated; further states are 0.
_BETWEEN_RUPTURES, _IN_RUPTURE = (0.01, 0.0), (0.01, 10.0, 0.01)

_CYCLE = LimitCycle(phases=2)
#: Of its numbers, those that are kept.
_OF_CYCLE = tuple(
    replace(about, error=about.name == LimitCycle.headline)
    for about in LimitCycle.outputs
    if about.error or about.name == "work_per_cycle"
)


#: What its numbers are.
_OUTPUTS = (
    *_OF_CYCLE,
    Output("unknowns", "", "1", "unknowns of the equations between ruptures"),
    Output("unknowns_in_rupture", "", "1", "unknowns of the equations where mass acts"),
    Output("share_in_rupture", "", "1", "share of the right-hand sides where mass acts"),
    Output(
        "evaluation_cost",
        "",
        "1",
        "time of a right-hand side between ruptures over one in the plainest scene",
    ),
    Output(
        "evaluation_cost_in_rupture",
        "",
        "1",
        "time of a right-hand side where mass acts over one in the plainest scene",
    ),
    Output("time_per_evaluation", "", "s", "time of one right-hand side between ruptures"),
    Output(
        "time_per_evaluation_in_rupture", "", "s", "time of one right-hand side where mass acts"
    ),
)


@dataclass(frozen=True)
class EffectCost(Measure):
    """A limit cycle, with what its effects cost: the numbers of the cycle, the unknowns of each
    form of the equations, the share of the work that the full equations took, and the time of one
    right-hand side of each form, also relative to that of the plainest scene of the same law:
    constant normal stress, quasi-static.
    """

    name: ClassVar[str] = "effect_cost"
    headline = "recurrence_interval"
    typical_work = 20_000
    outputs = _OUTPUTS
    clocks: ClassVar[tuple[bool, ...]] = (False, True)

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """The cycle under this meter; the forms of the equations on their own."""
        costs = _costs(scene)
        try:
            cycle = _CYCLE.find(scene, accuracy, meter)
        except Halt as halt:
            return Outcome(halt.status, costs, str(halt))
        spent = meter.by_regime.get("inertial", 0)
        costs["share_in_rupture"] = spent / meter.spent if meter.spent else math.nan
        names = [name for about in _OF_CYCLE for name in about.names]
        kept = {name: cycle.values[name] for name in names if name in cycle.values}
        return Outcome(cycle.status, {**kept, **costs}, cycle.message)


def _costs(scene: Scene) -> dict[str, float]:
    """Unknowns of the forms of the equations of a scene, and the time of a right-hand side."""
    slow = between_ruptures(scene, clock=False)
    forms: dict[str, tuple[Equations, tuple[float, ...]]] = {"": (slow, _BETWEEN_RUPTURES)}
    if scene.inertia:
        forms["_in_rupture"] = in_rupture(scene), _IN_RUPTURE
    plainest = scene.with_(
        normal_stress="constant", fluid="drained", inertia=False, radiation_damping=0.0
    )
    timed = {"plainest": (between_ruptures(plainest, clock=False), _BETWEEN_RUPTURES), **forms}
    turns = [{where: _seconds(*form) for where, form in timed.items()} for _turn in range(_TURNS)]
    costs = {}
    for where, (form, _state) in forms.items():
        ratios = [seconds[where] / seconds["plainest"] for seconds in turns]
        costs[f"unknowns{where}"] = float(len(form.unknowns))
        costs[f"evaluation_cost{where}"] = statistics.median(ratios)
        costs[f"time_per_evaluation{where}"] = statistics.median(s[where] for s in turns)
    return costs


def _seconds(equations: Equations, state: tuple[float, ...]) -> float:
    """Processor time of one right-hand side."""
    rate, p = equations.rate, equations.p
    state += (0.0,) * (len(equations.unknowns) - len(state))
    began = time.thread_time()
    for _ in range(_EVALUATIONS):
        rate(state, p)
    return (time.thread_time() - began) / _EVALUATIONS
