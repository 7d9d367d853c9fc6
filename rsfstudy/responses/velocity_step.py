"""Response of friction to a step of load point velocity."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import Outcome, RecordingMeasure, check_steady_loading, phase_outputs
from rsfstudy.motion import (
    MOTION_VARIABLES,
    RECORDED_VARIABLES,
    Accuracy,
    Event,
    MotionStopped,
    WorkMeter,
    fall,
    friction_coefficient,
    integrate_events,
    maximum,
    minimum,
    rise,
    sample_along_path,
)
from rsfstudy.parts import Segment
from rsfstudy.quantities import Output
from rsfstudy.responses._readings import distance_from_steady, friction_event_quantity
from rsfstudy.responses._recorded_motion import (
    RecordedMotion,
    estimate_instant_errors,
    record_motion,
    relative_to_start,
    settled_flag,
)
from rsfstudy.slider import Scene, steady_friction_excess
from rsfstudy.status import Status

#: Part of the record, at its end, over which friction must stay, and within which part of the
#: direct effect.
_SETTLING_WINDOW_FRACTION, _SETTLING_TOLERANCE = 0.1, 0.01
#: Part of ln r within which slip is steady before the step.
_STEADY_TOLERANCE = 1e-3

#: What is read off: name, symbol, scale and meaning.
_APPARENT_QUANTITIES = (
    ("apparent_a", "$a$", "", "direct effect parameter as read off"),
    ("apparent_b", "$b$", "", "evolution effect parameter as read off"),
    ("apparent_a_minus_b", "$a-b$", "", "rate dependence of friction as read off"),
    *(
        (name, "$D_c$", "D_c", f"{moved} from the peak until 1/e of the evolution is left")
        for name, moved in (
            ("apparent_slip_distance", "load point displacement"),
            ("corrected_slip_distance", "slip"),
        )
    ),
    ("peak_friction", r"$\mu$", "", "friction coefficient at the peak after the step"),
    ("friction_before", r"$\mu$", "", "friction coefficient just before the step"),
    ("friction_after", r"$\mu$", "", "friction coefficient at the end of the record"),
)
_OUTPUTS = (
    *(
        Output(name, symbol, "1", meaning, scale, error=True)
        for name, symbol, scale, meaning in _APPARENT_QUANTITIES
    ),
    Output("settled", long_name="whether friction has settled at the end of the record"),
    Output(
        "closed_form_departure",
        long_name="largest departure of friction, from the peak on, from that of a stiff slider",
    ),
    *phase_outputs("load_point_displacement", "slip", "friction_coefficient", "log10_slip_rate"),
)


class _EvaluatedStep(NamedTuple):
    """The step that is evaluated.

    Velocities are in V_*, and times in D_c/V_*.
    """

    velocity_before: float
    velocity_after: float
    start_time: float
    duration: float

    @property
    def log_velocity_ratio(self) -> float:
        """Logarithm ln r of the ratio of the velocities after and before the step."""
        return math.log(self.velocity_after / self.velocity_before)


@guard_methods
@dataclass(frozen=True)
class VelocityStep(RecordingMeasure):
    """Response to one step of load point velocity, as read from a record.

    The definitions are those used in the laboratory. Let mu_0 be friction before a step by a factor
    r, mu_p friction at the first extremum after the step, and mu_1 friction at the end of the
    record. The extremum is a peak for a step up, and a trough for a step down. Then

        a = (mu_p - mu_0)/ln r,   b = (mu_p - mu_1)/ln r,   a - b = (mu_1 - mu_0)/ln r.

    D_c is the displacement from the extremum until friction reaches mu_1 + (mu_p - mu_1)/e. D_c is
    reported as load point displacement and as slip, which excludes the change of length of the
    spring. The results are not corrected for the stiffness of the machine, so they show the effect
    of a soft spring. Friction has settled if it varies by less than a hundredth of mu_p - mu_0 over
    the last tenth of the record, and if small perturbations of steady sliding do not grow. If the
    stability is undecided within its error, ``settled`` is NaN. If there is no extremum, or if b is
    smaller than its error, the status is ``not_applicable``, and the results that exist are
    included. Distances are in D_c. The record begins at the step and has the shape (phases,).

    ``closed_form_departure`` is the largest difference from the friction of a rigid slider at the
    same slip x, ``(a - b) ln r + b g(ln r, x)``. The function g is ``ln r exp(-x)`` for the slip
    law and ``ln[1 + (r - 1) exp(-x)]`` for the slowness law. The result is NaN if normal stress or
    a fluid affects friction, or if the law has no closed form.

    Parameters
    ----------
    step_number : int
        Number of the loading segment to read, from 1.
    record : float
        Longest load point displacement after the step to record, in D_c. The record also ends at
        the next step.
    phases : int
        Number of points of the record along ``phase``.

    References
    ----------
    Marone (1998), Annu. Rev. Earth Planet. Sci. 26, 643-696, Fig. 3.
    """

    step_number: int = 1
    record: float = 20.0
    phases: int = 400
    name: ClassVar[str] = "velocity_step"
    primary_output = "apparent_a_minus_b"
    typical_work = 8_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.step_number < 1:
            raise InvalidValue("step_number", self.step_number, "must be at least 1")
        if not 1.0 <= self.record < math.inf:
            raise InvalidValue("record", self.record, "must be at least 1 D_c, and finite")

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error of each result.

        The scale is the sum of the absolute value of the result, and of its change if friction
        changes by ``a``.
        """
        slopes = self._friction_derivatives(self._find_step(scene).log_velocity_ratio, values)
        return {name: abs(values[name]) + scene.a * abs(slopes[name]) for name in slopes}

    def _friction_derivatives(self, ratio: float, values: Mapping[str, Any]) -> dict[str, float]:
        """Return the derivative of each result with respect to friction.

        The derivative is 1/ln r for a, b and a - b. For slip distances, friction changes by b ln
        r/(e D_c) per displacement, because 1/e of the evolution b ln r remains at this point of an
        exponential.
        """
        evolved = values["apparent_b"] * ratio
        over_friction = math.e / evolved if evolved else math.nan
        return {
            **dict.fromkeys(self.outputs_with_error, 1.0),
            **dict.fromkeys(("apparent_a", "apparent_b", "apparent_a_minus_b"), 1.0 / ratio),
            "apparent_slip_distance": over_friction * values["apparent_slip_distance"],
            "corrected_slip_distance": over_friction * values["corrected_slip_distance"],
        }

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """Compute the response to the step, and the errors of the results.

        The motion is computed again with smaller tolerances to estimate the errors. In each run,
        the motion is also followed from its peak until 1/e of the evolution remains.
        """
        check_steady_loading(scene)
        step = self._find_step(scene)
        records = [
            self._record_response(scene, step, a, meter) for a in (accuracy, accuracy.refined())
        ]
        (record, values), (_again, again) = records
        slopes = self._friction_derivatives(step.log_velocity_ratio, values)
        neglected = dict.fromkeys(slopes, record.neglected_error_until(record.last_event.time))
        errors = estimate_instant_errors(values, again, slopes, scene, accuracy, neglected)
        found = {**values, **errors, **self._record_values(scene, step, record)}
        if not abs(values["apparent_b"]) > errors["apparent_b_error"]:
            text = "friction has no extremum after the step, or does not evolve from there"
            return Outcome(Status.NOT_APPLICABLE, found, text)
        return Outcome(Status.OK, found)

    def _find_step(self, scene: Scene) -> _EvaluatedStep:
        """Return the step to read, or raise ``MotionStopped`` if the segment is not a step."""
        history = scene.parts.loading.segments
        if self.step_number > len(history):
            raise MotionStopped(Status.NOT_APPLICABLE, f"the loading has {len(history)} segments")
        earlier, own = history[: self.step_number - 1], history[self.step_number - 1]
        before = earlier[-1] if earlier else Segment(1.0)
        if own.load_velocity == before.load_velocity:
            raise MotionStopped(Status.NO_STEP, "the load point goes on as before")
        changed = own.displacement or own.normal_stress != before.normal_stress
        if min(own.load_velocity, before.load_velocity) <= 0.0 or changed:
            text = "a hold, a reversal, a displacement or a change of normal stress is no step"
            raise MotionStopped(Status.NOT_APPLICABLE, text)
        start_time = math.fsum(segment.duration for segment in earlier)
        duration = min(own.duration, self.record / own.load_velocity)
        return _EvaluatedStep(before.load_velocity, own.load_velocity, start_time, duration)

    def _record_response(
        self, scene: Scene, step: _EvaluatedStep, accuracy: Accuracy, meter: WorkMeter
    ) -> tuple[RecordedMotion, dict[str, float]]:
        """Record the motion, and return the record and the results."""
        extreme = maximum if step.log_velocity_ratio > 0.0 else minimum
        number, end = self.step_number - 1, step.start_time + step.duration
        turn = extreme(friction_event_quantity(scene)[0])
        record = record_motion(scene, accuracy, meter, [turn], number, number, end_time=end)
        return record, self._read_values(
            step, record, self._find_decay_event(scene, record, accuracy, meter)
        )

    def _read_values(
        self, step: _EvaluatedStep, record: RecordedMotion, left: Event | None
    ) -> dict[str, float]:
        """Return the results that are read from a record.

        Results that depend on the peak are NaN if there is no peak.
        """
        before, after = record.friction_before_starts[0], record.last_event.point.apparent_friction
        top = record.peak.point.apparent_friction if record.peak else math.nan
        return {
            "apparent_a": (top - before) / step.log_velocity_ratio,
            "apparent_b": (top - after) / step.log_velocity_ratio,
            "apparent_a_minus_b": (after - before) / step.log_velocity_ratio,
            "apparent_slip_distance": step.velocity_after * left.time if left else math.nan,
            "corrected_slip_distance": left.slip if left else math.nan,
            "peak_friction": top,
            "friction_before": before,
            "friction_after": after,
        }

    def _find_decay_event(
        self, scene: Scene, record: RecordedMotion, accuracy: Accuracy, meter: WorkMeter
    ) -> Event | None:
        """Return the event at which 1/e of the evolution remains.

        The time and slip of the event are relative to the peak. The motion is followed from the
        peak, because the integration step that contains the peak may contain a crossing of the
        level on either side.
        """
        peak = record.peak
        if peak is None or not peak.time < record.last_event.time:
            return None
        after, top = (e.point.apparent_friction for e in (record.last_event, peak))
        of, above = friction_event_quantity(scene)
        level = after + (top - after) / math.e - above
        # with a state that strengthens, evolution may go the way of the direct effect
        watch = fall(of, level, terminal=True) if top > after else rise(of, level, terminal=True)
        stepped = scene.segment_scene(self.step_number - 1)
        rest = record.last_event.time - peak.time
        events = integrate_events(stepped, accuracy, meter, [watch], start=peak.point, until=rest)
        return next((event for event in events if event.specification == watch), None)

    def _record_values(
        self, scene: Scene, step: _EvaluatedStep, record: RecordedMotion
    ) -> dict[str, float | np.ndarray]:
        """Return the record, the flag ``settled`` and the closed-form departure."""
        rows, friction = record.rows, friction_coefficient(record.rows)
        late = record.last_event.time - _SETTLING_WINDOW_FRACTION * step.duration
        # there may be few samples, in long steps
        last = [np.interp(late, rows[:, 0], friction), *friction[rows[:, 0] >= late]]
        turned = record.peak or record.last_event
        direct = turned.point.apparent_friction - record.friction_before_starts[0]
        path = relative_to_start(
            record.start, sample_along_path(rows, self.phases, RECORDED_VARIABLES)
        )
        stepped = scene.segment_scene(self.step_number - 1)
        is_flat = bool(np.ptp(last) < _SETTLING_TOLERANCE * abs(direct))
        return {
            "settled": settled_flag(stepped, is_flat=is_flat),
            "closed_form_departure": _closed_form_departure(scene, step, record),
            "load_point_displacement": step.velocity_after * path.pop("time"),
            **path,
        }


def _closed_form_departure(scene: Scene, step: _EvaluatedStep, record: RecordedMotion) -> float:
    """Compute the largest difference from the friction of a rigid slider.

    Only friction after the peak is compared. A rigid slider with the same slip shows the steady
    change, ``(a - b) ln r`` for most laws, plus ``b relaxation(ln r, slip)``.

    Returns
    -------
    float
        NaN if there is no closed form.
    """
    relaxation = scene.parts.law.relaxation
    if relaxation is None or record.peak is None or not _has_closed_form(scene, step, record):
        return math.nan
    before, after = math.log(step.velocity_before), math.log(step.velocity_after)
    steady = steady_friction_excess(scene, after) - steady_friction_excess(scene, before)
    steady += scene.dynamics.radiated_stress(after) - scene.dynamics.radiated_stress(before)
    slip = record.rows[:, MOTION_VARIABLES.index("slip")]
    later = record.rows[:, 0] >= record.peak.time
    left = np.array(
        [relaxation(step.log_velocity_ratio, at) for at in (slip[later] - slip[0]).tolist()]
    )
    expected = steady + scene.b * left
    seen = (friction_coefficient(record.rows) - record.friction_before_starts[0])[later]
    return float(np.abs(seen - expected).max())


def _has_closed_form(scene: Scene, step: _EvaluatedStep, record: RecordedMotion) -> bool:
    """Return True if the closed form of a rigid slider applies.

    The closed form applies if friction is the only effect and if sliding before the step is steady.
    If the law has a characteristic slip rate, the velocity before the step must also be V_*.
    """
    law, stress, fluid = scene.parts.law, scene.parts.normal_stress, scene.parts.fluid
    stress_acts = stress.normal_stress or stress.state_effect or law.depends_on_stress
    if stress_acts or stress.effects or fluid.unknowns:
        return False
    if not law.scale_free and step.velocity_before != 1.0:
        return False
    return distance_from_steady(
        scene, record.start.point, step.velocity_before
    ) < _STEADY_TOLERANCE * abs(step.log_velocity_ratio)
