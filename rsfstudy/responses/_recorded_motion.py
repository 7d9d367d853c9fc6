"""Records of motions, and errors of results that are read from them at an instant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rsfstudy.motion import (
    SAMPLE_COLUMN,
    Accuracy,
    Event,
    EventKind,
    EventSpecification,
    MotionStopped,
    Recording,
    WorkMeter,
    estimate_error,
    estimate_neglected_inertia,
    friction_coefficient,
    integrate_events,
    point_before_start,
)
from rsfstudy.slider import Scene, largest_growth_rate

#: Part of the accuracy asked for to which the errors of two runs may agree by chance.
COINCIDENCE_FLOOR = 0.01
#: Part of the same, times a, by which the friction coefficient of two runs may agree by chance at
#: an instant: of 7,071 numbers of random holds 22 err by up to 22 times their estimates without it,
#: and four by up to 1.7 times with it (study coverage).
_INSTANT_FRICTION_ERROR = 0.1


class RecordedMotion(NamedTuple):
    """A motion from the beginning of a loading segment.

    Attributes
    ----------
    segment_starts : list of Event
        Beginnings of this segment and of all later segments.
    friction_before_starts : list of float
        Friction coefficient immediately before each beginning. With inertia, the friction
        coefficient immediately after a beginning is the value on the slow manifold, which the
        motion approaches within the inertial time.
    peak : Event or None
        The requested extremum. None if there is no extremum.
    last_event : Event
        The last event.
    rows : ndarray
        Recorded samples, shape (rows, columns). See ``motion.recording`` for the columns.
    neglected_inertia_error : ndarray
        Error of ln V due to inertia that is neglected up to each row (see
        ``motion.neglected_inertia``).
    """

    segment_starts: list[Event]
    friction_before_starts: list[float]
    peak: Event | None
    last_event: Event
    rows: np.ndarray
    neglected_inertia_error: np.ndarray

    @property
    def start(self) -> Event:
        """Beginning of the record."""
        return self.segment_starts[0]

    def neglected_error_until(self, time: float) -> float:
        """Return the error of ln V due to inertia neglected up to a given time."""
        row = min(int(np.searchsorted(self.rows[:, 0], time)), len(self.rows) - 1)
        return float(self.neglected_inertia_error[row])


def record_motion(
    scene: Scene,
    accuracy: Accuracy,
    meter: WorkMeter,
    specifications: Sequence[EventSpecification],
    first_segment: int,
    peak_segment: int,
    *,
    end_time: float = math.inf,
    allow_early_stop: bool = False,
) -> RecordedMotion:
    """Record a motion up to its first extremum in a loading segment.

    If there is no extremum, the record ends at the beginning of the next segment. If ``end_time``
    is given, the record ends at this time.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    meter : WorkMeter
    specifications : sequence of EventSpecification
        The extremum, followed by other events that may end the motion.
    first_segment, peak_segment : int
        Indices of the segment at which the record begins, and of the segment that contains the
        extremum.
    end_time : float
        End time in D_c/V_*.
    allow_early_stop : bool
        If True, ignore a ``MotionStopped`` after the extremum.

    Returns
    -------
    RecordedMotion

    Raises
    ------
    MotionStopped
        If the motion cannot continue.
    """
    recording, begun, peak = Recording(), list[Event](), None
    try:
        for event in integrate_events(
            scene,
            accuracy,
            meter,
            specifications,
            with_time=True,
            recording=recording,
            until=end_time,
        ):
            if event.kind in (EventKind.START, EventKind.SEGMENT):
                begun.append(event)
            elif (
                event.specification == specifications[0]
                and len(begun) == peak_segment + 1
                and peak is None
            ):
                peak = event
            if end_time == math.inf and (peak is not None or len(begun) > peak_segment + 1):
                break
    except MotionStopped:
        if peak is None or not allow_early_stop:
            raise
    rows, start = recording.table(scene), point_before_start(scene)
    slow = recording.regime_number(scene.dynamics.regime)
    neglected = estimate_neglected_inertia(scene, rows, slow, start.log_slip_rate)
    shown = rows[:, 0] >= begun[first_segment].time
    rows, neglected = rows[shown], neglected[shown]
    rows[0, SAMPLE_COLUMN] = 0.0  # of the step that ends there, no other rows are left
    friction, later = friction_coefficient(rows), begun[max(first_segment, 1) :]
    before = [float(friction[rows[:, 0] == each.time][0]) for each in later]
    if first_segment == 0:
        before.insert(0, start.apparent_friction)
    return RecordedMotion(begun[first_segment:], before, peak, event, rows, neglected)


def relative_to_start(start: Event, path: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the quantities along a record, with time and slip from its start."""
    found = {name: path[name] for name in ("friction_coefficient", "log10_slip_rate")}
    return {"time": path["time"] - start.time, "slip": path["slip"] - path["slip"][0], **found}


def estimate_instant_error(
    value: float,
    refined: float,
    friction_derivative: float,
    scene: Scene,
    accuracy: Accuracy,
    neglected_error: float = 0.0,
) -> float:
    """Estimate the error of a result that is read at a single instant.

    If the machine is stiff, stability limits the time steps. The errors of two runs may then agree
    at an instant by chance. The estimate therefore includes two additional terms: a fraction of the
    result, and a fraction of the friction from which the result is read. Let y and y' be the
    results of the first and the refined run, eps the requested accuracy, and e the error of ln V
    due to neglected inertia. The error is ``3 |y - y'| + 0.01 eps |y| + (0.1 eps + e) a |dy/dmu|``,
    because friction changes by ``a`` if ln V changes by 1.

    Parameters
    ----------
    value, refined : float
        Results of the first run and of the refined run.
    friction_derivative : float
        Derivative dy/dmu of the result with respect to the friction coefficient from which the
        result is read.
    scene : Scene
    accuracy : Accuracy
    neglected_error : float
        Error of ln V that both runs share, because both neglect the same part of inertia.

    Returns
    -------
    float
        Error in the units of the result.
    """
    friction = (_INSTANT_FRICTION_ERROR * accuracy.rtol + neglected_error) * scene.a
    chance = COINCIDENCE_FLOOR * accuracy.rtol
    return estimate_error(value, refined, chance) + friction * abs(friction_derivative)


def estimate_instant_errors(
    values: Mapping[str, float],
    refined: Mapping[str, float],
    friction_derivatives: Mapping[str, float],
    scene: Scene,
    accuracy: Accuracy,
    neglected_errors: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """Estimate the errors of several results that are read at single instants.

    See ``estimate_instant_error`` for the estimate.

    Returns
    -------
    dict
        Errors by name, as ``<name>_error``.
    """
    shared = neglected_errors or dict.fromkeys(values, 0.0)
    return {
        f"{name}_error": estimate_instant_error(
            value, refined[name], friction_derivatives[name], scene, accuracy, shared[name]
        )
        for name, value in values.items()
    }


def settled_flag(scene: Scene, *, is_flat: bool) -> float:
    """Return 1 if friction has settled at the end of a record, and 0 if not.

    Parameters
    ----------
    scene : Scene
        A scene under the last loading segment of the record.
    is_flat : bool
        True if friction is nearly constant at the end of the record.

    Returns
    -------
    float
        0 if friction is not constant, or if small perturbations of steady sliding grow. NaN if the
        growth rate of small perturbations is zero within its error. Otherwise 1.
    """
    if not is_flat:
        return 0.0
    growth = largest_growth_rate(scene, scene.log_load_velocity)
    if growth is not None and growth.is_undecided:
        return math.nan
    return 0.0 if growth is not None and growth.is_positive else 1.0
