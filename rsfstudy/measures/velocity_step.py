"""Response of friction to a step of load point velocity."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rsfstudy.analysis.settling import settled_flag
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Outcome
from rsfstudy.measures._records import Record, Recorded, errors_of, followed, recorded, since
from rsfstudy.measures._single_step import check_leaves_alone
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import Event, fall, maximum, minimum, rise
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.readings import friction_coefficient_of, unsteady, watched
from rsfstudy.motion.recording import OBSERVED, READ, along_path
from rsfstudy.quantity import Output
from rsfstudy.slider.loading import Segment
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.steady import steady_excess
from rsfstudy.status import Status

#: Part of the record, at its end, over which friction must stay, and within which part of the
#: direct effect.
_LAST, _STAYS = 0.1, 0.01
#: Part of ln r within which slip is steady before the step.
_STEADY = 1e-3

#: What is read off: name, symbol, scale and meaning.
_READ_OFF = (
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
        for name, symbol, scale, meaning in _READ_OFF
    ),
    Output("settled", long_name="whether friction has settled at the end of the record"),
    Output(
        "closed_form_departure",
        long_name="largest departure of friction, from the peak on, from that of a stiff slider",
    ),
    *recorded("load_point_displacement", "slip", "friction_coefficient", "log10_slip_rate"),
)


class _Step(NamedTuple):
    """The step that is evaluated.

    Velocities are in V_*, and times in D_c/V_*.
    """

    before: float
    after: float
    start_time: float
    duration: float

    @property
    def ratio(self) -> float:
        """Logarithm ln r of the ratio of the velocities after and before the step."""
        return math.log(self.after / self.before)


@guard_methods
@dataclass(frozen=True)
class VelocityStep(Recorded):
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
    headline = "apparent_a_minus_b"
    typical_work = 8_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.step_number < 1:
            raise InvalidValue("step_number", self.step_number, "must be at least 1")
        if not 1.0 <= self.record < math.inf:
            raise InvalidValue("record", self.record, "must be at least 1 D_c, and finite")

    def scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error of each result.

        The scale is the sum of the absolute value of the result, and of its change if friction
        changes by ``a``.
        """
        slopes = self._by_friction(self._step(scene).ratio, values)
        return {name: abs(values[name]) + scene.a * abs(slopes[name]) for name in slopes}

    def _by_friction(self, ratio: float, values: Mapping[str, Any]) -> dict[str, float]:
        """Return the derivative of each result with respect to friction.

        The derivative is 1/ln r for a, b and a - b. For slip distances, friction changes by b ln
        r/(e D_c) per displacement, because 1/e of the evolution b ln r remains at this point of an
        exponential.
        """
        evolved = values["apparent_b"] * ratio
        over_friction = math.e / evolved if evolved else math.nan
        return {
            **dict.fromkeys(self.estimated, 1.0),
            **dict.fromkeys(("apparent_a", "apparent_b", "apparent_a_minus_b"), 1.0 / ratio),
            "apparent_slip_distance": over_friction * values["apparent_slip_distance"],
            "corrected_slip_distance": over_friction * values["corrected_slip_distance"],
        }

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Compute the response to the step, and the errors of the results.

        The motion is computed again with smaller tolerances to estimate the errors. In each run,
        the motion is also followed from its peak until 1/e of the evolution remains.
        """
        check_leaves_alone(scene)
        step = self._step(scene)
        records = [self._follow(scene, step, a, meter) for a in (accuracy, accuracy.refined())]
        (record, values), (_again, again) = records
        slopes = self._by_friction(step.ratio, values)
        neglected = dict.fromkeys(slopes, record.neglected_until(record.end.time))
        errors = errors_of(values, again, slopes, scene, accuracy, neglected)
        found = {**values, **errors, **self._shown(scene, step, record)}
        if not abs(values["apparent_b"]) > errors["apparent_b_error"]:
            text = "friction has no extremum after the step, or does not evolve from there"
            return Outcome(Status.NOT_APPLICABLE, found, text)
        return Outcome(Status.OK, found)

    def _step(self, scene: Scene) -> _Step:
        """Return the step to read, or raise ``Halt`` if the segment is not a step."""
        history = scene.parts.loading.segments
        if self.step_number > len(history):
            raise Halt(Status.NOT_APPLICABLE, f"the loading has {len(history)} segments")
        earlier, own = history[: self.step_number - 1], history[self.step_number - 1]
        before = earlier[-1] if earlier else Segment(1.0)
        if own.load_velocity == before.load_velocity:
            raise Halt(Status.NO_STEP, "the load point goes on as before")
        changed = own.displacement or own.normal_stress != before.normal_stress
        if min(own.load_velocity, before.load_velocity) <= 0.0 or changed:
            text = "a hold, a reversal, a displacement or a change of normal stress is no step"
            raise Halt(Status.NOT_APPLICABLE, text)
        start_time = math.fsum(segment.duration for segment in earlier)
        duration = min(own.duration, self.record / own.load_velocity)
        return _Step(before.load_velocity, own.load_velocity, start_time, duration)

    def _follow(
        self, scene: Scene, step: _Step, accuracy: Accuracy, meter: Meter
    ) -> tuple[Record, dict[str, float]]:
        """Record the motion, and return the record and the results."""
        extreme = maximum if step.ratio > 0.0 else minimum
        number, end = self.step_number - 1, step.start_time + step.duration
        turn = extreme(watched(scene)[0])
        record = followed(scene, accuracy, meter, [turn], number, number, until=end)
        return record, self._read(step, record, self._left(scene, record, accuracy, meter))

    def _read(self, step: _Step, record: Record, left: Event | None) -> dict[str, float]:
        """Return the results that are read from a record.

        Results that depend on the peak are NaN if there is no peak.
        """
        before, after = record.before[0], record.end.point.reading
        top = record.peak.point.reading if record.peak else math.nan
        return {
            "apparent_a": (top - before) / step.ratio,
            "apparent_b": (top - after) / step.ratio,
            "apparent_a_minus_b": (after - before) / step.ratio,
            "apparent_slip_distance": step.after * left.time if left else math.nan,
            "corrected_slip_distance": left.slip if left else math.nan,
            "peak_friction": top,
            "friction_before": before,
            "friction_after": after,
        }

    def _left(self, scene: Scene, record: Record, accuracy: Accuracy, meter: Meter) -> Event | None:
        """Return the event at which 1/e of the evolution remains.

        The time and slip of the event are relative to the peak. The motion is followed from the
        peak, because the integration step that contains the peak may contain a crossing of the
        level on either side.
        """
        peak = record.peak
        if peak is None or not peak.time < record.end.time:
            return None
        after, top = (e.point.reading for e in (record.end, peak))
        of, above = watched(scene)
        level = after + (top - after) / math.e - above
        # with a state that strengthens, evolution may go the way of the direct effect
        watch = fall(of, level, ends=True) if top > after else rise(of, level, ends=True)
        stepped = scene.acting(self.step_number - 1)
        rest = record.end.time - peak.time
        events = follow(stepped, accuracy, meter, [watch], start=peak.point, until=rest)
        return next((event for event in events if event.watch == watch), None)

    def _shown(self, scene: Scene, step: _Step, record: Record) -> dict[str, float | np.ndarray]:
        """Return the record, the flag ``settled`` and the closed-form departure."""
        rows, friction = record.rows, friction_coefficient_of(record.rows)
        late = record.end.time - _LAST * step.duration
        # there may be few samples, in long steps
        last = [np.interp(late, rows[:, 0], friction), *friction[rows[:, 0] >= late]]
        turned = record.peak or record.end
        direct = turned.point.reading - record.before[0]
        path = since(record.begin, along_path(rows, self.phases, READ))
        stepped = scene.acting(self.step_number - 1)
        is_flat = bool(np.ptp(last) < _STAYS * abs(direct))
        return {
            "settled": settled_flag(stepped, is_flat=is_flat),
            "closed_form_departure": _departure(scene, step, record),
            "load_point_displacement": step.after * path.pop("time"),
            **path,
        }


def _departure(scene: Scene, step: _Step, record: Record) -> float:
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
    before, after = math.log(step.before), math.log(step.after)
    steady = steady_excess(scene, after) - steady_excess(scene, before)
    steady += scene.dynamics.radiated(after) - scene.dynamics.radiated(before)
    slip = record.rows[:, OBSERVED.index("slip")]
    later = record.rows[:, 0] >= record.peak.time
    left = np.array([relaxation(step.ratio, at) for at in (slip[later] - slip[0]).tolist()])
    expected = steady + scene.b * left
    seen = (friction_coefficient_of(record.rows) - record.before[0])[later]
    return float(np.abs(seen - expected).max())


def _has_closed_form(scene: Scene, step: _Step, record: Record) -> bool:
    """Return True if the closed form of a rigid slider applies.

    The closed form applies if friction is the only effect and if sliding before the step is steady.
    If the law has a characteristic slip rate, the velocity before the step must also be V_*.
    """
    law, stress, fluid = scene.parts.law, scene.parts.normal_stress, scene.parts.fluid
    stress_acts = stress.normal_stress or stress.state_effect or law.feels_stress
    if stress_acts or stress.effects or fluid.unknowns:
        return False
    if not law.scale_free and step.before != 1.0:
        return False
    return unsteady(scene, record.begin.point, step.before) < _STEADY * abs(step.ratio)
