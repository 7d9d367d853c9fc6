"""Recording of motions, and error estimates of results read from a record.

Measures call ``record_motion`` twice, with two accuracies, and compare the results of the two runs
with ``estimate_instant_errors``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rsfstudy._deprecation import renamed_names
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base.measure import Measure
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
from rsfstudy.quantities import Output
from rsfstudy.slider import Scene, cached_attribute

#: Error that two runs may share by chance, as a fraction of the requested relative accuracy.
COINCIDENCE_FLOOR = 0.01
#: Error of the friction coefficient that two runs may share by chance at a single instant, as a
#: fraction of a times the requested accuracy. In the study ``coverage``, with 7,071 results of
#: random holds, 22 errors exceed their estimates without this term, by a factor of up to 22. With
#: the term, four errors exceed their estimates, by a factor of up to 1.7.
_INSTANT_FRICTION_ERROR = 0.1

#: Variables along ``phase`` that are recorded if normal stress changes.
PHASE_VARIABLES = (
    "time",
    "load_point_displacement",
    "slip",
    "friction_coefficient",
    "normal_stress_ratio",
    "log10_slip_rate",
)


def phase_outputs(*names: str) -> tuple[Output, ...]:
    """Return outputs along the dimension ``phase``.

    Parameters
    ----------
    *names : str
        Names of quantities in the common vocabulary.

    Returns
    -------
    tuple of Output
        One output per name.
    """
    return tuple(Output(name, dims=("phase",)) for name in names)


class RecordedMotion(NamedTuple):
    """Record of a motion from the beginning of a loading segment.

    Parameters
    ----------
    segment_starts : list of Event
        Beginnings of this segment and of all later segments.
    friction_before_starts : list of float
        Friction coefficient immediately before each beginning. With inertia, the motion approaches
        the slow manifold after a beginning within the inertial time, and the value immediately
        after the beginning is the value on the slow manifold.
    peak : Event or None
        Requested extremum, or None if the motion has no extremum.
    last_event : Event
        Last event of the motion.
    rows : ndarray, shape (n, columns)
        Recorded samples. The columns are documented in ``rsfstudy.motion.recording``.
    neglected_inertia_error : ndarray, shape (n,)
        Error of ln V up to each row that is caused by neglected inertia. See
        ``rsfstudy.motion.neglected_inertia``.
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
        """Return the error of ln V that is caused by neglected inertia.

        Parameters
        ----------
        time : float
            Time up to which the error accumulates, in units of D_c/V_*.

        Returns
        -------
        float
            Error of ln V at this time, or at the end of the record if the record ends earlier.
        """
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
        Scene of the motion.
    accuracy : Accuracy
        Requested accuracy.
    meter : WorkMeter
        Counter of right-hand-side evaluations.
    specifications : sequence of EventSpecification
        Specification of the extremum, followed by other events that may end the motion.
    first_segment : int
        Index of the loading segment at which the record begins.
    peak_segment : int
        Index of the loading segment that contains the extremum.
    end_time : float, default: inf
        End time in units of D_c/V_*.
    allow_early_stop : bool, default: False
        If True, ignore a ``MotionStopped`` after the extremum.

    Returns
    -------
    RecordedMotion
        The record and its extremum.

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
    # The other samples of the step that ends at the first row are not part of the record.
    rows[0, SAMPLE_COLUMN] = 0.0
    friction, later = friction_coefficient(rows), begun[max(first_segment, 1) :]
    before = [float(friction[rows[:, 0] == each.time][0]) for each in later]
    if first_segment == 0:
        before.insert(0, start.apparent_friction)
    return RecordedMotion(begun[first_segment:], before, peak, event, rows, neglected)


def relative_to_start(start: Event, path: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the quantities along a record relative to its beginning.

    Parameters
    ----------
    start : Event
        Beginning of the record.
    path : mapping of str to ndarray
        Quantities along the record.

    Returns
    -------
    dict of str to ndarray
        Time and slip since the beginning, friction coefficient, and logarithm of the slip rate.
    """
    found = {name: path[name] for name in ("friction_coefficient", "log10_slip_rate")}
    return {"time": path["time"] - start.time, "slip": path["slip"] - path["slip"][0], **found}


@guard_methods
@dataclass(frozen=True)
class RecordingMeasure(Measure):
    """Base class of measures that store a record along ``phase``.

    A subclass defines the field ``phases``, which sets the number of points of the record.
    """

    def __post_init__(self) -> None:
        """Check the number of points of the record."""
        if self.point_count < 2:
            raise InvalidValue("phases", self.point_count, "must be at least 2")

    @property
    def point_count(self) -> int:
        """Number of points of the record that are stored."""
        return int(self.plain_fields["phases"])

    @cached_attribute
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        """Coordinate values of ``phase``, from 0 to 1."""
        return {"phase": np.linspace(0.0, 1.0, self.point_count)}


def estimate_instant_error(
    value: float,
    refined: float,
    friction_derivative: float,
    scene: Scene,
    accuracy: Accuracy,
    neglected_error: float = 0.0,
) -> float:
    r"""Estimate the error of a result that is read at a single instant.

    If the machine is stiff, stability limits the time steps, so the errors of two runs may agree by
    chance at a single instant. The estimate therefore includes a fraction of the result, and a
    fraction of the friction from which the result is read.

    Parameters
    ----------
    value : float
        Result of the first run.
    refined : float
        Result of the refined run.
    friction_derivative : float
        Derivative of the result with respect to the friction coefficient from which the result is
        read.
    scene : Scene
        Scene of the motion.
    accuracy : Accuracy
        Accuracy of the first run.
    neglected_error : float, default: 0.0
        Error of ln V that both runs share, because both runs neglect the same part of inertia.

    Returns
    -------
    float
        Error in the units of the result.

    Notes
    -----
    Let :math:`y` and :math:`y'` be the results of the first and of the refined run,
    :math:`\epsilon` the requested accuracy, and :math:`e` the error of :math:`\ln V` due to
    neglected inertia. The error is

    .. math:: 3\,|y - y'| + 0.01\,\epsilon\,|y| + (0.1\,\epsilon + e)\,a\,|dy/d\mu|,

    because friction changes by :math:`a` if :math:`\ln V` changes by 1.
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

    The function ``estimate_instant_error`` documents the estimate.

    Parameters
    ----------
    values : mapping of str to float
        Results of the first run by name.
    refined : mapping of str to float
        Results of the refined run by name.
    friction_derivatives : mapping of str to float
        Derivatives of the results with respect to the friction coefficient.
    scene : Scene
        Scene of the motion.
    accuracy : Accuracy
        Accuracy of the first run.
    neglected_errors : mapping of str to float, optional
        Errors of ln V by name of the result. By default, all errors are zero.

    Returns
    -------
    dict of str to float
        Errors by name, as ``<name>_error``.
    """
    shared = neglected_errors or dict.fromkeys(values, 0.0)
    return {
        f"{name}_error": estimate_instant_error(
            value, refined[name], friction_derivatives[name], scene, accuracy, shared[name]
        )
        for name, value in values.items()
    }


if not TYPE_CHECKING:
    __getattr__ = renamed_names(__name__)
