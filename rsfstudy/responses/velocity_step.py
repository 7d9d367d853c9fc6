"""Response of friction to a step of load point velocity."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base import (
    Outcome,
    RecordingMeasure,
    check_loading_changes_stress_only_in_steps,
    create_outputs_along_phase,
)
from rsfstudy.motion import (
    Event,
    Integrator,
    MotionRecorder,
    MotionStopped,
    fall,
    maximum,
    minimum,
    resample_motion_along_path,
    rise,
)
from rsfstudy.parts import Segment
from rsfstudy.quantities import Output
from rsfstudy.responses._motion_quantities import (
    choose_friction_quantity_for_events,
    compute_distance_from_steady_sliding,
)
from rsfstudy.responses._recorded_motion import (
    RecordedMotion,
    compute_motion_relative_to_start,
    compute_settled_friction_flag,
    estimate_errors_at_instants,
    record_motion_until_peak,
)
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: Length of the last part of the record, in which friction must be constant, as a fraction of the
#: length of the record. The second number is the largest permitted variation of friction in this
#: part, as a fraction of the direct effect.
_SETTLING_WINDOW_FRACTION, _SETTLING_TOLERANCE = 0.1, 0.01
#: Largest permitted distance from steady sliding before the step, divided by the logarithm of the
#: velocity ratio of the step.
_MAX_UNSTEADINESS_OVER_LOG_VELOCITY_STEP = 1e-3

#: Results of the measure, with symbols, scales and meanings.
_APPARENT_PARAMETER_OUTPUTS = (
    ("apparent_a", "$a$", "", "apparent direct effect parameter a"),
    ("apparent_b", "$b$", "", "apparent evolution effect parameter b"),
    ("apparent_a_minus_b", "$a-b$", "", "apparent rate dependence of friction a - b"),
    *(
        (
            name,
            "$D_c$",
            "D_c",
            f"{moved} from the peak to the point where 1/e of the evolution remains",
        )
        for name, moved in (
            ("apparent_slip_distance", "load point displacement"),
            ("corrected_slip_distance", "slip"),
        )
    ),
    ("peak_friction", r"$\mu$", "", "friction coefficient at the peak after the step"),
    ("friction_before", r"$\mu$", "", "friction coefficient just before the step"),
    ("friction_after", r"$\mu$", "", "friction coefficient at the end of the record"),
)
_VELOCITY_STEP_OUTPUTS = (
    *(
        Output(name, symbol, "1", meaning, scale, error=True)
        for name, symbol, scale, meaning in _APPARENT_PARAMETER_OUTPUTS
    ),
    Output(
        "settled",
        long_name="1 if friction has reached the steady state at the end of the "
        "record, otherwise 0",
    ),
    Output(
        "closed_form_departure",
        long_name="largest difference of friction after the peak from the friction of a stiff "
        "slider",
    ),
    *create_outputs_along_phase(
        "load_point_displacement", "slip", "friction_coefficient", "log10_slip_rate"
    ),
)


class _EvaluatedVelocityStep(NamedTuple):
    """Velocity step that the measure evaluates.

    Velocities are in units of V_*, and times are in units of D_c/V_*.
    """

    velocity_before: float
    velocity_after: float
    start_time: float
    duration: float

    @property
    def log_velocity_ratio(self) -> float:
        """Logarithm ln r of the velocity ratio of the step."""
        return math.log(self.velocity_after / self.velocity_before)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class VelocityStep(RecordingMeasure):
    r"""Friction parameters read from the response to a velocity step.

    The definitions are the same as in laboratory studies. The parameter ``a`` follows from the
    extremum of friction after the step, and ``a - b`` follows from friction at the end of the
    record. The slip distance is measured from the extremum of friction to the point at which the
    difference between friction and its final value has decreased to 1/e of the difference at the
    extremum. The slip distance is reported as load point displacement and as slip, which excludes
    the elongation of the spring. The results are not corrected for the stiffness of the machine, so
    they differ from the true parameters if the machine is soft.

    ``settled`` is 1 if friction varies by less than a hundredth of the direct effect over the last
    tenth of the record, and if small perturbations of steady sliding do not grow. Otherwise the
    output ``settled`` is 0. If the largest growth rate of small perturbations is zero within its
    error, the output ``settled`` is NaN.

    If friction has no extremum after the step, or if ``b`` is smaller than its error, the status is
    ``not_applicable``, and the outcome contains only the available results. Distances are in units
    of D_c. The record of the motion begins at the step. The recorded quantities have the shape
    (phases,).

    Parameters
    ----------
    step_number : int, default: 1
        Number of the loading segment that begins with the step, counted from 1.
    record : float, default: 20.0
        Largest load point displacement over which the motion is recorded after the step, in units
        of D_c. The record also ends at the next step.
    phases : int, default: 400
        Number of points of the record along ``phase``.

    Raises
    ------
    InvalidValue
        If ``step_number`` or ``record`` is less than 1, or if ``phases`` is less than 2.

    Notes
    -----
    Let :math:`r` be the ratio of the velocities after and before the step, :math:`\mu_0` friction
    before the step, :math:`\mu_p` friction at the first extremum after the step, and :math:`\mu_1`
    friction at the end of the record. The extremum is a maximum for a step up, and a minimum for a
    step down. The definitions of [1]_ are

    .. math::

        a &= (\mu_p - \mu_0)/\ln r, \\
        b &= (\mu_p - \mu_1)/\ln r, \\
        a - b &= (\mu_1 - \mu_0)/\ln r.

    ``closed_form_departure`` is the largest difference from the friction of a rigid slider after
    the same slip :math:`x`,

    .. math:: \mu - \mu_0 = (a - b) \ln r + b\,g(\ln r, x),

    with :math:`g = e^{-x} \ln r` under the slip law and :math:`g = \ln[1 + (r - 1) e^{-x}]` under
    the slowness law. If normal stress or pore pressure affects friction, or if the law has no
    closed form, the result is NaN.

    References
    ----------
    .. [1] Marone, C. (1998). Laboratory-derived friction laws and their application to seismic
       faulting. Annu. Rev. Earth Planet. Sci., 26, 643-696, Fig. 3.

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import VelocityStep
    >>> scene = Scene(normal_stress="constant", load_velocity_ratio=10, stiffness_ratio=10)
    >>> outcome = VelocityStep(record=10.0)(scene, Accuracy(rtol=1e-4))
    >>> round(scene.a - scene.b, 4), round(outcome.values["apparent_a_minus_b"], 4)
    (-0.0145, -0.0145)

    The machine is soft, so the apparent direct effect is smaller than the true direct effect:

    >>> round(scene.a, 4), round(outcome.values["apparent_a"], 4)
    (0.0145, 0.0116)
    """

    step_number: int = 1
    record: float = 20.0
    phases: int = 400
    name: ClassVar[str] = "velocity_step"
    primary_output = "apparent_a_minus_b"
    typical_rhs_evaluations = 8_000
    outputs = _VELOCITY_STEP_OUTPUTS

    def __post_init__(self) -> None:
        """Check the fields of the measure."""
        super().__post_init__()
        if self.step_number < 1:
            raise InvalidValue("step_number", self.step_number, "must be at least 1")
        if not 1.0 <= self.record < math.inf:
            raise InvalidValue("record", self.record, "must be finite and at least 1 D_c")

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error of each result.

        The scale is the sum of two terms: the absolute value of the result, and the change in the
        result if friction changes by the direct effect parameter ``a``.

        Parameters
        ----------
        scene : Scene
            Scene of the computation.
        values : mapping of str to float or ndarray
            Results by name.

        Returns
        -------
        mapping of str to float
            Scales by name of the result.
        """
        slopes = self._compute_output_derivatives_by_friction(
            self._find_evaluated_step(scene).log_velocity_ratio, values
        )
        return {name: abs(values[name]) + scene.a * abs(slopes[name]) for name in slopes}

    def _compute_output_derivatives_by_friction(
        self, log_velocity_ratio: float, values: Mapping[str, Any]
    ) -> dict[str, float]:
        """Return the derivatives of the results with respect to friction.

        The derivative is 1/ln r for a, b and a - b. For the slip distances, the method assumes that
        friction evolves exponentially with slip, by the total amount b ln r. When 1/e of this
        amount remains, friction changes by b ln r/(e D_c) per unit slip, and the derivative is the
        inverse of this rate.
        """
        evolved = values["apparent_b"] * log_velocity_ratio
        over_friction = math.e / evolved if evolved else math.nan
        return {
            **dict.fromkeys(self.names_of_outputs_with_error, 1.0),
            **dict.fromkeys(
                ("apparent_a", "apparent_b", "apparent_a_minus_b"), 1.0 / log_velocity_ratio
            ),
            "apparent_slip_distance": over_friction * values["apparent_slip_distance"],
            "corrected_slip_distance": over_friction * values["corrected_slip_distance"],
        }

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the response to the step, and error estimates.

        The motion is computed twice, with the requested accuracy and with smaller tolerances. The
        difference between the two runs determines the error estimates. Each run also integrates the
        motion from the extremum of friction until 1/e of the evolution of friction remains.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status, results and message.
        """
        check_loading_changes_stress_only_in_steps(scene)
        step = self._find_evaluated_step(scene)
        records = [
            self._record_motion_and_read_results(scene, step, each)
            for each in (integrator, integrator.refined())
        ]
        (record, values), (_again, again) = records
        slopes = self._compute_output_derivatives_by_friction(step.log_velocity_ratio, values)
        neglected = dict.fromkeys(
            slopes, record.get_neglected_inertia_error_until(record.end_event.time)
        )
        errors = estimate_errors_at_instants(values, again, slopes, scene, integrator, neglected)
        found = {**values, **errors, **self._compute_outputs_along_record(scene, step, record)}
        if not abs(values["apparent_b"]) > errors["apparent_b_error"]:
            text = "friction has no extremum after the step, or does not evolve after the extremum"
            return Outcome(Status.NOT_APPLICABLE, found, text)
        return Outcome(Status.OK, found)

    def _find_evaluated_step(self, scene: Scene) -> _EvaluatedVelocityStep:
        """Return the step that the measure evaluates.

        Raises
        ------
        MotionStopped
            If the loading segment does not exist or does not begin with a velocity step.
        """
        history = scene.parts.loading.segments
        if self.step_number > len(history):
            raise MotionStopped(Status.NOT_APPLICABLE, f"the loading has {len(history)} segments")
        earlier, own = history[: self.step_number - 1], history[self.step_number - 1]
        before = earlier[-1] if earlier else Segment(1.0)
        if own.load_velocity == before.load_velocity:
            raise MotionStopped(Status.NO_STEP, "the load point velocity does not change")
        changed = own.displacement or own.normal_stress != before.normal_stress
        if min(own.load_velocity, before.load_velocity) <= 0.0 or changed:
            text = (
                "a hold, a reversal, a displacement step or a change of normal stress is not "
                "a velocity step"
            )
            raise MotionStopped(Status.NOT_APPLICABLE, text)
        start_time = math.fsum(segment.duration for segment in earlier)
        duration = min(own.duration, self.record / own.load_velocity)
        return _EvaluatedVelocityStep(before.load_velocity, own.load_velocity, start_time, duration)

    def _record_motion_and_read_results(
        self,
        scene: Scene,
        evaluated_step: _EvaluatedVelocityStep,
        integrator: Integrator,
    ) -> tuple[RecordedMotion, dict[str, float]]:
        """Record the motion, and return the record and the results."""
        extreme = maximum if evaluated_step.log_velocity_ratio > 0.0 else minimum
        number, end = self.step_number - 1, evaluated_step.start_time + evaluated_step.duration
        turn = extreme(choose_friction_quantity_for_events(scene)[0])
        record = record_motion_until_peak(scene, integrator, [turn], number, number, end_time=end)
        return record, self._read_step_results(
            evaluated_step, record, self._find_friction_decay_event(scene, record, integrator)
        )

    def _read_step_results(
        self,
        evaluated_step: _EvaluatedVelocityStep,
        recorded_motion: RecordedMotion,
        friction_decay_event: Event | None,
    ) -> dict[str, float]:
        """Return the results that are read from a record.

        Results that depend on the extremum of friction are NaN if friction has no extremum.
        """
        before, after = (
            recorded_motion.friction_before_segments[0],
            recorded_motion.end_event.point.apparent_friction,
        )
        top = (
            recorded_motion.peak_event.point.apparent_friction
            if recorded_motion.peak_event
            else math.nan
        )
        return {
            "apparent_a": (top - before) / evaluated_step.log_velocity_ratio,
            "apparent_b": (top - after) / evaluated_step.log_velocity_ratio,
            "apparent_a_minus_b": (after - before) / evaluated_step.log_velocity_ratio,
            "apparent_slip_distance": evaluated_step.velocity_after * friction_decay_event.time
            if friction_decay_event
            else math.nan,
            "corrected_slip_distance": friction_decay_event.slip
            if friction_decay_event
            else math.nan,
            "peak_friction": top,
            "friction_before": before,
            "friction_after": after,
        }

    def _find_friction_decay_event(
        self,
        scene: Scene,
        recorded_motion: RecordedMotion,
        integrator: Integrator,
    ) -> Event | None:
        """Return the event at which the friction change has decayed to 1/e.

        At this event, the difference between friction and its final value is 1/e of the difference
        at the extremum of friction. The time and slip of the event are measured from this extremum.
        The method integrates the motion again from the extremum of friction. It does not search the
        recorded steps, because friction may cross the level of the event both before and after the
        extremum within a single step.
        """
        peak = recorded_motion.peak_event
        if peak is None or not peak.time < recorded_motion.end_event.time:
            return None
        after, top = (e.point.apparent_friction for e in (recorded_motion.end_event, peak))
        of, above = choose_friction_quantity_for_events(scene)
        level = after + (top - after) / math.e - above
        # If a state strengthens friction, the evolution may have the sign of the direct effect.
        watch = fall(of, level, terminal=True) if top > after else rise(of, level, terminal=True)
        stepped = scene.segment_scene(self.step_number - 1)
        rest = recorded_motion.end_event.time - peak.time
        events = integrator.follow(stepped, [watch], start=peak.point, until=rest)
        return next((event for event in events if event.specification == watch), None)

    def _compute_outputs_along_record(
        self, scene: Scene, evaluated_step: _EvaluatedVelocityStep, recorded_motion: RecordedMotion
    ) -> dict[str, float | np.ndarray]:
        """Return the recorded quantities, the flag ``settled`` and ``closed_form_departure``."""
        rows, friction = (
            recorded_motion.recorded_rows,
            MotionRecorder.get_friction_coefficient(recorded_motion.recorded_rows),
        )
        late = recorded_motion.end_event.time - _SETTLING_WINDOW_FRACTION * evaluated_step.duration
        # The last tenth of the record may contain few samples, because time steps may be long.
        last = [np.interp(late, rows[:, 0], friction), *friction[rows[:, 0] >= late]]
        turned = recorded_motion.peak_event or recorded_motion.end_event
        direct = turned.point.apparent_friction - recorded_motion.friction_before_segments[0]
        path = compute_motion_relative_to_start(
            recorded_motion.start_event,
            resample_motion_along_path(rows, self.phases, MotionRecorder.RECORDED_VARIABLE_NAMES),
        )
        stepped = scene.segment_scene(self.step_number - 1)
        is_flat = bool(np.ptp(last) < _SETTLING_TOLERANCE * abs(direct))
        return {
            "settled": compute_settled_friction_flag(stepped, is_friction_constant=is_flat),
            "closed_form_departure": _compute_max_departure_from_closed_form(
                scene, evaluated_step, recorded_motion
            ),
            "load_point_displacement": evaluated_step.velocity_after * path.pop("time"),
            **path,
        }


def _compute_max_departure_from_closed_form(
    scene: Scene, evaluated_step: _EvaluatedVelocityStep, recorded_motion: RecordedMotion
) -> float:
    """Compute the largest difference from the friction of a rigid slider.

    Only friction after its extremum is compared with the friction of a rigid slider. The result is
    NaN if there is no closed form.
    """
    relaxation = scene.parts.law.state_relaxation_function
    if (
        relaxation is None
        or recorded_motion.peak_event is None
        or not _is_closed_form_applicable(scene, evaluated_step, recorded_motion)
    ):
        return math.nan
    before, after = (
        math.log(evaluated_step.velocity_before),
        math.log(evaluated_step.velocity_after),
    )
    steady = scene.steady_friction_minus_reference(after) - scene.steady_friction_minus_reference(
        before
    )
    steady += scene.dynamics.radiated_stress(after) - scene.dynamics.radiated_stress(before)
    slip = recorded_motion.recorded_rows[:, MotionRecorder.MOTION_VARIABLE_NAMES.index("slip")]
    later = recorded_motion.recorded_rows[:, 0] >= recorded_motion.peak_event.time
    left = np.array(
        [
            relaxation(evaluated_step.log_velocity_ratio, at)
            for at in (slip[later] - slip[0]).tolist()
        ]
    )
    expected = steady + scene.b * left
    seen = (
        MotionRecorder.get_friction_coefficient(recorded_motion.recorded_rows)
        - recorded_motion.friction_before_segments[0]
    )[later]
    return float(np.abs(seen - expected).max())


def _is_closed_form_applicable(
    scene: Scene, evaluated_step: _EvaluatedVelocityStep, recorded_motion: RecordedMotion
) -> bool:
    """Return True if the closed form of a rigid slider applies.

    The closed form requires steady sliding before the step, and a friction coefficient that does
    not depend on normal stress, pore pressure or temperature. If the law has a characteristic slip
    rate, the velocity before the step must also be V_*.
    """
    law, stress, fluid = scene.parts.law, scene.parts.normal_stress, scene.parts.fluid
    stress_acts = stress.normal_stress or stress.state_effect or law.depends_on_stress
    if stress_acts or stress.effects or fluid.unknowns or scene.parts.temperature.unknowns:
        return False
    if not law.lacks_characteristic_slip_rate and evaluated_step.velocity_before != 1.0:
        return False
    return compute_distance_from_steady_sliding(
        scene, recorded_motion.start_event.point, evaluated_step.velocity_before
    ) < _MAX_UNSTEADINESS_OVER_LOG_VELOCITY_STEP * abs(evaluated_step.log_velocity_ratio)
