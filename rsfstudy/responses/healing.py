"""Healing: what a hold of the load point does to friction, as an experimenter reads it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import (
    Outcome,
    RecordingMeasure,
    phase_outputs,
    settles_to_steady_sliding,
)
from rsfstudy.motion import (
    RECORDED_VARIABLES,
    Accuracy,
    Event,
    EventKind,
    MotionStopped,
    WorkMeter,
    approach_to_steady_state,
    friction_coefficient,
    load_point_displacement,
    maximum,
    sample_along_path,
)
from rsfstudy.parts import Segment
from rsfstudy.quantities import Output
from rsfstudy.responses._readings import (
    distance_from_steady,
    friction_event_quantity,
    growth_rate_along_path,
)
from rsfstudy.responses._recorded_motion import (
    RecordedMotion,
    estimate_instant_errors,
    record_motion,
    relative_to_start,
)
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: Distance from steady sliding within which a hold begins in it, in ln V or in the state over b.
_STEADY_TOLERANCE = 1e-3
#: How far friction may turn beside steady sliding, over the local tolerance: up to 1.9 in 7,000
#: random motions at 1e-2 to 1e-6.
_PEAK_NOISE_FACTOR = 3.0
#: Part of the largest distance from steady sliding at which there is no more peak to come.
_STEADY_FRACTION = 1e-6

_PEAK_DISPLACEMENT_MEANING = "load point displacement from reloading to the peak of friction"
_HEALING_MEANING = "healing: peak friction on reloading less friction before the hold"
_RELAXATION_MEANING = "change of friction during the hold: that at its end less that before"
_OUTPUTS = (
    Output("healing", r"$\Delta\mu$", "1", _HEALING_MEANING, error=True),
    Output("relaxation", r"$\Delta\mu_c$", "1", _RELAXATION_MEANING, error=True),
    Output(
        "peak_displacement", r"$\delta_0/D_c$", "1", _PEAK_DISPLACEMENT_MEANING, "D_c", error=True
    ),
    *phase_outputs(
        "time", "load_point_displacement", "slip", "friction_coefficient", "log10_slip_rate"
    ),
)


@guard_methods
@dataclass(frozen=True)
class Healing(RecordingMeasure):
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
    primary_output = "healing"
    typical_work = 4_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.record < math.inf:
            raise InvalidValue("record", self.record, "must be positive and finite")

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Differences of friction, and a, which is what ln V is in it; the displacement, and D_c,
        over which friction turns.
        """
        least = {"healing": scene.a, "relaxation": scene.a, "peak_displacement": 1.0}
        return {name: abs(values[name]) + scale for name, scale in least.items()}

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """Numbers read off a motion, and once more with smaller tolerances for the errors."""
        hold = _find_hold(scene)
        first = _record_hold(scene, hold, accuracy, meter)
        said = _describe_initial_state(
            scene, hold, first.start, max(_STEADY_TOLERANCE, accuracy.rtol)
        )
        peakless = Outcome(
            Status.NOT_APPLICABLE,
            {"relaxation": first.friction_before_starts[1] - first.friction_before_starts[0]},
            "; ".join(filter(None, ("no peak of friction on reloading", said))),
        )
        if first.peak is None:
            if first.last_event.kind is EventKind.SETTLED:
                settles_to_steady_sliding(scene)  # halts if that is undecided
            return peakless
        again = _record_hold(
            scene, hold, accuracy.refined(), meter, self._record_end_time(scene, hold, first.peak)
        )
        if again.peak is None:
            return peakless
        values, refined = (
            _read_values(scene, record, peak)
            for record, peak in ((first, first.peak), (again, again.peak))
        )
        history = scene.parts.loading.segments
        # friction peaks where slip rate passes that of the load point, ln V being friction over a
        growth = growth_rate_along_path(scene, first.peak, history[hold + 1].load_velocity)
        turning = 1.0 / (scene.a * growth) if growth else math.inf
        by_friction = {"healing": 1.0, "relaxation": 1.0, "peak_displacement": turning}
        neglected = dict.fromkeys(values, first.neglected_error_until(first.peak.time))
        neglected["relaxation"] = first.neglected_error_until(first.segment_starts[1].time)
        # the displacement depends on the growth of friction there, whose error rises earlier
        neglected["peak_displacement"] = first.neglected_error_until(math.inf)
        errors = estimate_instant_errors(values, refined, by_friction, scene, accuracy, neglected)
        above = again.peak.point.apparent_friction - float(friction_coefficient(again.rows)[-1])
        # beside steady sliding friction turns within the tolerance, where two runs may agree
        if above <= max(
            errors["healing_error"], _PEAK_NOISE_FACTOR * accuracy.refined().local_tolerance
        ):
            return peakless
        return Outcome(Status.OK, {**values, **errors, **self._record_values(scene, again)}, said)

    def _record_end_time(self, scene: Scene, hold: int, peak: Event) -> float:
        """Time at which the record ends."""
        history = scene.parts.loading.segments
        goes_on = self.record / history[hold + 1].load_velocity
        return min(peak.time + goes_on, math.fsum(s.duration for s in history[: hold + 2]))

    def _record_values(self, scene: Scene, record: RecordedMotion) -> dict[str, np.ndarray]:
        """The record itself, from the beginning of the hold on."""
        path = sample_along_path(record.rows, self.phases, RECORDED_VARIABLES)
        moved = load_point_displacement(scene, np.column_stack([*path.values()]))
        return {
            **relative_to_start(record.start, path),
            "load_point_displacement": moved - moved[0],
        }


def _find_hold(scene: Scene) -> int:
    """The number of the segment in which the load point is held first; `MotionStopped` says why
    there is none.
    """
    history = scene.parts.loading.segments
    holds = [n for n, segment in enumerate(history[:-1]) if segment.load_velocity == 0.0]
    if not holds:
        raise MotionStopped(Status.NO_STEP, "the load point is never held and moved again")
    before, hold, reload = (Segment(1.0), *history)[holds[0] : holds[0] + 3]
    if reload.load_velocity <= 0.0:
        why = "the hold is followed by another, or by a load point that moves back"
        raise MotionStopped(Status.NOT_APPLICABLE, why)
    stresses = {before.normal_stress, hold.normal_stress, reload.normal_stress}
    if hold.displacement or reload.displacement or len(stresses) > 1:
        why = "the load point is displaced, or normal stress stepped, at an end of the hold"
        raise MotionStopped(Status.NOT_APPLICABLE, why)
    return holds[0]


def _describe_initial_state(scene: Scene, hold: int, begin: Event, tolerance: float) -> str:
    """Distance from steady sliding at which a hold begins, in words; empty where it is none."""
    before = (Segment(1.0), *scene.parts.loading.segments)[hold]
    away = distance_from_steady(scene, begin.point, before.load_velocity)
    if away <= tolerance:
        return ""
    return f"the hold does not begin in steady sliding, but {away:.2g} from it in ln V or state/b"


def _record_hold(
    scene: Scene, hold: int, accuracy: Accuracy, meter: WorkMeter, until: float = math.inf
) -> RecordedMotion:
    """From before the hold to the peak, or to where friction has settled or the next segment begins
    without one; or as long as told, or as the motion can go on after the peak.
    """
    peak, settled = (
        maximum(friction_event_quantity(scene)[0]),
        approach_to_steady_state(_STEADY_FRACTION, terminal=until == math.inf),
    )
    asked = peak, settled
    return record_motion(
        scene, accuracy, meter, asked, hold, hold + 1, end_time=until, allow_early_stop=True
    )


def _read_values(scene: Scene, record: RecordedMotion, peak: Event) -> dict[str, float]:
    """Healing, relaxation and the displacement from reloading to the peak."""
    (before, held), reload = record.friction_before_starts[:2], record.segment_starts[1]
    longer = (peak.point.spring_stress - reload.point.spring_stress) / scene.stiffness
    return {
        "healing": peak.point.apparent_friction - before,
        "relaxation": held - before,
        "peak_displacement": peak.slip - reload.slip + longer,
    }
