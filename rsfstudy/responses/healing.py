"""Measure that computes frictional healing and relaxation due to a hold of the load point."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base import (
    Outcome,
    RecordingMeasure,
    check_loading_has_no_noise,
    create_outputs_along_phase,
    is_steady_sliding_linearly_stable,
)
from rsfstudy.motion import (
    Event,
    EventKind,
    Integrator,
    MotionRecorder,
    MotionStopped,
    approach_to_steady_state,
    maximum,
    resample_motion_along_path,
)
from rsfstudy.parts import Segment
from rsfstudy.quantities import Output
from rsfstudy.responses._motion_quantities import (
    choose_friction_quantity_for_events,
    compute_distance_from_steady_sliding,
    compute_log_slip_rate_slope_along_path,
)
from rsfstudy.responses._recorded_motion import (
    RecordedMotion,
    compute_motion_relative_to_start,
    estimate_errors_at_instants,
    record_motion_until_peak,
)
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: The motion before a hold is treated as steady if neither ln V, nor the state divided by b,
#: differs from its value in steady sliding by more than this number.
_MAX_STEADY_STATE_DISTANCE_BEFORE_HOLD = 1e-3
#: Peaks of friction near steady sliding are attributed to numerical errors if the ratio of their
#: height to the local tolerance is below this number. In 7,000 random motions with rtol from 1e-2
#: to 1e-6, the largest ratio of the height of such a peak to the local tolerance is 1.9.
_MAX_SPURIOUS_PEAK_OVER_LOCAL_TOLERANCE = 3.0
#: No further peak of friction is expected if the distance from steady sliding is less than this
#: fraction of the largest distance from steady sliding during the motion.
_SETTLED_DISTANCE_OVER_MAX_DISTANCE = 1e-6

_PEAK_DISPLACEMENT_LONG_NAME = "load point displacement from reloading to the peak of friction"
_HEALING_LONG_NAME = "healing: peak friction on reloading minus friction before the hold"
_RELAXATION_LONG_NAME = "friction at the end of the hold minus friction before the hold"
_HEALING_OUTPUTS = (
    Output("healing", r"$\Delta\mu$", "1", _HEALING_LONG_NAME, error=True),
    Output("relaxation", r"$\Delta\mu_c$", "1", _RELAXATION_LONG_NAME, error=True),
    Output(
        "peak_displacement", r"$\delta_0/D_c$", "1", _PEAK_DISPLACEMENT_LONG_NAME, "D_c", error=True
    ),
    *create_outputs_along_phase(
        "time", "load_point_displacement", "slip", "friction_coefficient", "log10_slip_rate"
    ),
)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Healing(RecordingMeasure):
    r"""Relaxation and healing of friction that the first hold in a loading causes.

    The definitions are the same as in laboratory studies. Relaxation is the change of friction
    during the hold, and is usually negative. Healing is the peak friction after reloading minus the
    friction before the hold. ``peak_displacement`` is the load point displacement from reloading to
    the peak, in units of D_c. The results are not corrected for the stiffness of the machine.

    If the hold does not begin in steady sliding, the message of the outcome reports the distance
    from steady sliding. If the peak friction exceeds the friction at the end of the record by less
    than the error of the peak, the status is ``not_applicable``. The record of the motion begins
    with the hold. The recorded quantities have the shape (phases,). Times are in units of D_c/V_*.

    Parameters
    ----------
    record : float, default: 10.0
        Load point displacement over which the motion is recorded after the peak of friction, in
        units of D_c.
    phases : int, default: 300
        Number of points of the record along ``phase``.

    Raises
    ------
    InvalidValue
        If ``record`` is not positive and finite, or if ``phases`` is less than 2.

    Notes
    -----
    Let :math:`\mu_0` be friction before the hold, :math:`\mu_h` friction at the end of the hold,
    and :math:`\mu_p` the peak friction after reloading [1]_. Then

    .. math:: \Delta\mu_c = \mu_h - \mu_0, \qquad \Delta\mu = \mu_p - \mu_0.

    Under the slowness law with :math:`b > a`, healing after long holds increases by :math:`b` if
    the natural logarithm of the hold time increases by 1. This healing does not depend on the
    stiffness. Under the slip law, healing decreases with increasing stiffness. The increase of
    static friction with the logarithm of time was first measured by Dieterich [2]_.

    References
    ----------
    .. [1] Marone, C. (1998). The effect of loading rate on static friction and the rate of fault
       healing during the earthquake cycle. Nature, 391, 69-72.
    .. [2] Dieterich, J. H. (1972). Time-dependent friction in rocks. J. Geophys. Res., 77,
       3690-3697.

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import Healing
    >>> scene = Scene(normal_stress="constant", hold_time=1000, stiffness_ratio=10)
    >>> outcome = Healing()(scene, Accuracy(rtol=1e-4))
    >>> round(outcome.values["healing"], 4)
    0.0554
    """

    record: float = 10.0
    phases: int = 300
    name: ClassVar[str] = "healing"
    primary_output = "healing"
    typical_rhs_evaluations = 4_000
    outputs = _HEALING_OUTPUTS

    def __post_init__(self) -> None:
        """Check the fields of the measure."""
        super().__post_init__()
        if not 0.0 < self.record < math.inf:
            raise InvalidValue("record", self.record, "must be a positive, finite number")

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error of each result.

        For healing and relaxation, the scale is the absolute value of the result plus the direct
        effect parameter ``a``, which is the change in friction for a unit change in ln V. For the
        peak displacement, the scale is the absolute value of the result plus D_c.

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
        least = {"healing": scene.a, "relaxation": scene.a, "peak_displacement": 1.0}
        return {name: abs(values[name]) + scale for name, scale in least.items()}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute relaxation and healing, and their error estimates.

        The motion is computed twice, with the requested accuracy and with smaller tolerances. The
        difference between the two runs determines the error estimates.

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
        check_loading_has_no_noise(scene)
        hold = _find_first_hold_segment_index(scene)
        first = _record_hold_and_reloading(scene, hold, integrator)
        said = _describe_unsteady_start_of_hold(
            scene,
            hold,
            first.start_event,
            max(_MAX_STEADY_STATE_DISTANCE_BEFORE_HOLD, integrator.result_tolerance()),
        )
        peakless = Outcome(
            Status.NOT_APPLICABLE,
            {"relaxation": first.friction_before_segments[1] - first.friction_before_segments[0]},
            "; ".join(filter(None, ("friction has no peak on reloading", said))),
        )
        if first.peak_event is None:
            if first.end_event.kind is EventKind.SETTLED:
                # The call raises MotionStopped if the stability is undecided.
                is_steady_sliding_linearly_stable(scene)
            return peakless
        again = _record_hold_and_reloading(
            scene,
            hold,
            integrator.refined(),
            self._compute_end_time_of_record(scene, hold, first.peak_event),
        )
        if again.peak_event is None:
            return peakless
        values, refined = (
            _read_healing_values(scene, record, peak)
            for record, peak in ((first, first.peak_event), (again, again.peak_event))
        )
        history = scene.parts.loading.segments
        # Friction peaks when the slip rate passes the load point velocity. A change of ln V by 1
        # changes friction by a.
        growth = compute_log_slip_rate_slope_along_path(
            scene, first.peak_event, history[hold + 1].load_velocity
        )
        turning = 1.0 / (scene.a * growth) if growth else math.inf
        by_friction = {"healing": 1.0, "relaxation": 1.0, "peak_displacement": turning}
        neglected = dict.fromkeys(
            values, first.get_neglected_inertia_error_until(first.peak_event.time)
        )
        neglected["relaxation"] = first.get_neglected_inertia_error_until(
            first.events_at_segment_starts[1].time
        )
        # The peak displacement depends on the growth rate of ln V at the peak. The error of the
        # growth rate rises earlier than the error of ln V, so the error at the end of the record is
        # used.
        neglected["peak_displacement"] = first.get_neglected_inertia_error_until(math.inf)
        errors = estimate_errors_at_instants(
            values, refined, by_friction, scene, integrator, neglected
        )
        above = again.peak_event.point.apparent_friction - float(
            MotionRecorder.get_friction_coefficient(again.recorded_rows)[-1]
        )
        # Near steady sliding, friction may have spurious peaks on which both runs agree.
        if above <= max(
            errors["healing_error"],
            _MAX_SPURIOUS_PEAK_OVER_LOCAL_TOLERANCE * integrator.refined().local_tolerance,
        ):
            return peakless
        return Outcome(
            Status.OK,
            {**values, **errors, **self._compute_outputs_along_record(scene, again)},
            said,
        )

    def _compute_end_time_of_record(
        self, scene: Scene, hold_index: int, peak_event: Event
    ) -> float:
        """Return the time at which the record ends, in units of D_c/V_*."""
        history = scene.parts.loading.segments
        goes_on = self.record / history[hold_index + 1].load_velocity
        return min(
            peak_event.time + goes_on, math.fsum(s.duration for s in history[: hold_index + 2])
        )

    def _compute_outputs_along_record(
        self, scene: Scene, recorded_motion: RecordedMotion
    ) -> dict[str, np.ndarray]:
        """Return the quantities since the start of the hold along the dimension ``phase``."""
        path = resample_motion_along_path(
            recorded_motion.recorded_rows, self.phases, MotionRecorder.RECORDED_VARIABLE_NAMES
        )
        moved = MotionRecorder.compute_load_point_displacement(
            scene, np.column_stack([*path.values()])
        )
        return {
            **compute_motion_relative_to_start(recorded_motion.start_event, path),
            "load_point_displacement": moved - moved[0],
        }


def _find_first_hold_segment_index(scene: Scene) -> int:
    """Return the index of the first loading segment with a held load point.

    Raises
    ------
    MotionStopped
        If no loading segment has a held load point, if the load point does not move forward after
        the hold, or if a displacement step or a normal stress step occurs at an end of the hold.
    """
    history = scene.parts.loading.segments
    holds = [n for n, segment in enumerate(history[:-1]) if segment.load_velocity == 0.0]
    if not holds:
        raise MotionStopped(
            Status.NO_STEP, "the loading contains no hold that is followed by reloading"
        )
    before, hold, reload = (Segment(1.0), *history)[holds[0] : holds[0] + 3]
    if reload.load_velocity <= 0.0:
        why = "the hold is followed by another hold or by a load point that moves backwards"
        raise MotionStopped(Status.NOT_APPLICABLE, why)
    stresses = {before.normal_stress, hold.normal_stress, reload.normal_stress}
    if hold.displacement or reload.displacement or len(stresses) > 1:
        why = "a displacement step or a normal stress step occurs at an end of the hold"
        raise MotionStopped(Status.NOT_APPLICABLE, why)
    return holds[0]


def _describe_unsteady_start_of_hold(
    scene: Scene, hold_index: int, hold_start_event: Event, tolerance: float
) -> str:
    """Return a message if a hold does not begin in steady sliding."""
    before = (Segment(1.0), *scene.parts.loading.segments)[hold_index]
    away = compute_distance_from_steady_sliding(scene, hold_start_event.point, before.load_velocity)
    if away <= tolerance:
        return ""
    return f"the hold does not begin in steady sliding: ln V or state/b differs by {away:.2g}"


def _record_hold_and_reloading(
    scene: Scene,
    hold_index: int,
    integrator: Integrator,
    end_time: float = math.inf,
) -> RecordedMotion:
    """Record a motion from the state before the hold to the peak of friction.

    If there is no peak, the record ends when friction has settled or when the next segment begins.
    If ``end_time`` is finite, the record ends at this time, or earlier if the motion cannot
    continue after the peak.
    """
    peak, settled = (
        maximum(choose_friction_quantity_for_events(scene)[0]),
        approach_to_steady_state(
            _SETTLED_DISTANCE_OVER_MAX_DISTANCE, terminal=end_time == math.inf
        ),
    )
    asked = peak, settled
    return record_motion_until_peak(
        scene,
        integrator,
        asked,
        hold_index,
        hold_index + 1,
        end_time=end_time,
        allow_early_stop=True,
    )


def _read_healing_values(
    scene: Scene, recorded_motion: RecordedMotion, peak_event: Event
) -> dict[str, float]:
    """Return healing, relaxation and the peak displacement."""
    (before, held), reload = (
        recorded_motion.friction_before_segments[:2],
        recorded_motion.events_at_segment_starts[1],
    )
    longer = (peak_event.point.spring_stress - reload.point.spring_stress) / scene.stiffness
    return {
        "healing": peak_event.point.apparent_friction - before,
        "relaxation": held - before,
        "peak_displacement": peak_event.slip - reload.slip + longer,
    }
