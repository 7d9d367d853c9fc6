"""Healing: what a hold of the load point does to friction, as an experimenter reads it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rsfstudy.analysis.settling import is_attracted
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Outcome
from rsfstudy.measures._records import Record, Recorded, errors_of, followed, recorded, since
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.events import Event, Kind, maximum, settling
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.readings import (
    friction_coefficient_of,
    growth_along_path,
    load_point_of,
    unsteady,
    watched,
)
from rsfstudy.motion.recording import READ, along_path
from rsfstudy.quantity import Output
from rsfstudy.slider.loading import Segment
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Distance from steady sliding within which a hold begins in it, in ln V or in the state over b.
_STEADY = 1e-3
#: How far friction may turn beside steady sliding, over the local tolerance: up to 1.9 in 7,000
#: random motions at 1e-2 to 1e-6.
_TURNS = 3.0
#: Part of the largest distance from steady sliding at which there is no more peak to come.
_SETTLED = 1e-6

_DISPLACED = "load point displacement from reloading to the peak of friction"
_HEALED = "healing: peak friction on reloading less friction before the hold"
_RELAXED = "change of friction during the hold: that at its end less that before"
_OUTPUTS = (
    Output("healing", r"$\Delta\mu$", "1", _HEALED, error=True),
    Output("relaxation", r"$\Delta\mu_c$", "1", _RELAXED, error=True),
    Output("peak_displacement", r"$\delta_0/D_c$", "1", _DISPLACED, "D_c", error=True),
    *recorded("time", "load_point_displacement", "slip", "friction_coefficient", "log10_slip_rate"),
)


@guard_methods
@dataclass(frozen=True)
class Healing(Recorded):
    """Relaxation and healing by the first hold of a loading, by the definitions of the laboratory.

    With mu_0 before the hold, mu_h at its end and mu_p at the peak on reloading, relaxation is mu_h
    - mu_0 (below 0) and healing mu_p - mu_0, neither corrected for the stiffness of the rig.
    `peak_displacement` is that of the load point from reloading to the peak, in D_c. By the
    slowness law and b > a, healing grows by b as the logarithm of a long hold's time by 1, at every
    stiffness; by the slip law it falls with stiffness. Where a hold does not begin in steady
    sliding the message says so. A peak that stands above the end of the record by no more than its
    own error is none. The record, from the beginning of the hold on, has the shape (phases,), with
    times in D_c/V_*.

    Parameters
    ----------
    record : float
        Load point displacement after the peak that is recorded, in D_c.
    phases : int
        Points of the record that are kept along `phase`.

    References
    ----------
    Dieterich (1972), J. Geophys. Res. 77, 3690-3697; Marone (1998), Nature 391, 69-72.
    """

    record: float = 10.0
    phases: int = 300
    name: ClassVar[str] = "healing"
    headline = "healing"
    typical_work = 4_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.record < math.inf:
            raise InvalidValue("record", self.record, "must be positive and finite")

    def scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Differences of friction, and a, which is what ln V is in it; the displacement, and D_c,
        over which friction turns.
        """
        least = {"healing": scene.a, "relaxation": scene.a, "peak_displacement": 1.0}
        return {name: abs(values[name]) + scale for name, scale in least.items()}

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Numbers read off a motion, and once more with smaller tolerances for the errors."""
        hold = _hold(scene)
        first = _follow(scene, hold, accuracy, meter)
        said = _beginning(scene, hold, first.begin, max(_STEADY, accuracy.rtol))
        peakless = Outcome(
            Status.NOT_APPLICABLE,
            {"relaxation": first.before[1] - first.before[0]},
            "; ".join(filter(None, ("no peak of friction on reloading", said))),
        )
        if first.peak is None:
            if first.end.kind is Kind.SETTLED:
                is_attracted(scene)  # halts if that is undecided
            return peakless
        again = _follow(scene, hold, accuracy.refined(), meter, self._end(scene, hold, first.peak))
        if again.peak is None:
            return peakless
        values, refined = (
            _read(scene, record, peak)
            for record, peak in ((first, first.peak), (again, again.peak))
        )
        history = scene.parts.loading.segments
        # friction peaks where slip rate passes that of the load point, ln V being friction over a
        growth = growth_along_path(scene, first.peak, history[hold + 1].load_velocity)
        turning = 1.0 / (scene.a * growth) if growth else math.inf
        by_friction = {"healing": 1.0, "relaxation": 1.0, "peak_displacement": turning}
        neglected = dict.fromkeys(values, first.neglected_until(first.peak.time))
        neglected["relaxation"] = first.neglected_until(first.begun[1].time)
        # the displacement depends on the growth of friction there, whose error rises earlier
        neglected["peak_displacement"] = first.neglected_until(math.inf)
        errors = errors_of(values, refined, by_friction, scene, accuracy, neglected)
        above = again.peak.point.reading - float(friction_coefficient_of(again.rows)[-1])
        # beside steady sliding friction turns within the tolerance, where two runs may agree
        if above <= max(errors["healing_error"], _TURNS * accuracy.refined().solver):
            return peakless
        return Outcome(Status.OK, {**values, **errors, **self._shown(scene, again)}, said)

    def _end(self, scene: Scene, hold: int, peak: Event) -> float:
        """Time at which the record ends."""
        history = scene.parts.loading.segments
        goes_on = self.record / history[hold + 1].load_velocity
        return min(peak.time + goes_on, math.fsum(s.duration for s in history[: hold + 2]))

    def _shown(self, scene: Scene, record: Record) -> dict[str, np.ndarray]:
        """The record itself, from the beginning of the hold on."""
        path = along_path(record.rows, self.phases, READ)
        moved = load_point_of(scene, np.column_stack([*path.values()]))
        return {**since(record.begin, path), "load_point_displacement": moved - moved[0]}


def _hold(scene: Scene) -> int:
    """The number of the segment in which the load point is held first; `Halt` says why there is
    none.
    """
    history = scene.parts.loading.segments
    holds = [n for n, segment in enumerate(history[:-1]) if segment.load_velocity == 0.0]
    if not holds:
        raise Halt(Status.NO_STEP, "the load point is never held and moved again")
    before, hold, reload = (Segment(1.0), *history)[holds[0] : holds[0] + 3]
    if reload.load_velocity <= 0.0:
        why = "the hold is followed by another, or by a load point that moves back"
        raise Halt(Status.NOT_APPLICABLE, why)
    stresses = {before.normal_stress, hold.normal_stress, reload.normal_stress}
    if hold.displacement or reload.displacement or len(stresses) > 1:
        why = "the load point is displaced, or normal stress stepped, at an end of the hold"
        raise Halt(Status.NOT_APPLICABLE, why)
    return holds[0]


def _beginning(scene: Scene, hold: int, begin: Event, near: float) -> str:
    """Distance from steady sliding at which a hold begins, in words; empty where it is none."""
    before = (Segment(1.0), *scene.parts.loading.segments)[hold]
    away = unsteady(scene, begin.point, before.load_velocity)
    if away <= near:
        return ""
    return f"the hold does not begin in steady sliding, but {away:.2g} from it in ln V or state/b"


def _follow(
    scene: Scene, hold: int, accuracy: Accuracy, meter: Meter, until: float = math.inf
) -> Record:
    """From before the hold to the peak, or to where friction has settled or the next segment begins
    without one; or as long as told, or as the motion can go on after the peak.
    """
    peak, settled = maximum(watched(scene)[0]), settling(_SETTLED, ends=until == math.inf)
    asked = peak, settled
    return followed(scene, accuracy, meter, asked, hold, hold + 1, until=until, halts=True)


def _read(scene: Scene, record: Record, peak: Event) -> dict[str, float]:
    """Healing, relaxation and the displacement from reloading to the peak."""
    (before, held), reload = record.before[:2], record.begun[1]
    longer = (peak.point.spring_stress - reload.point.spring_stress) / scene.stiffness
    return {
        "healing": peak.point.reading - before,
        "relaxation": held - before,
        "peak_displacement": peak.slip - reload.slip + longer,
    }
