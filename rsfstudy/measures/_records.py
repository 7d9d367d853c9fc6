"""Records of motions, shared by measures that store or evaluate a motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.motion.accuracy import Accuracy, error_between
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import Event, EventSpecification, Kind
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.neglected_inertia import estimate_neglected_inertia
from rsfstudy.motion.readings import friction_coefficient_of
from rsfstudy.motion.recording import PLACE, Recording
from rsfstudy.motion.starting import before_start
from rsfstudy.quantity import Output
from rsfstudy.slider.derived import derived
from rsfstudy.slider.scene import Scene

#: Part of the accuracy asked for to which the errors of two runs may agree by chance.
BY_CHANCE = 0.01
#: Part of the same, times a, by which the friction coefficient of two runs may agree by chance at
#: an instant: of 7,071 numbers of random holds 22 err by up to 22 times their estimates without it,
#: and four by up to 1.7 times with it (study coverage).
_AT_AN_INSTANT = 0.1

#: What is kept of a record while normal stress changes.
KEPT = (
    "time",
    "load_point_displacement",
    "slip",
    "friction_coefficient",
    "normal_stress_ratio",
    "log10_slip_rate",
)


def recorded(*names: str) -> tuple[Output, ...]:
    """Return the outputs along ``phase`` for some quantities of the vocabulary."""
    return tuple(Output(name, dims=("phase",)) for name in names)


class Record(NamedTuple):
    """A motion from the beginning of a loading segment.

    Attributes
    ----------
    begun : list of Event
        Beginnings of this segment and of all later segments.
    before : list of float
        Friction coefficient immediately before each beginning. With inertia, the friction
        coefficient immediately after a beginning is the value on the slow manifold, which the
        motion approaches within the inertial time.
    peak : Event or None
        The requested extremum. None if there is no extremum.
    end : Event
        The last event.
    rows : ndarray
        Recorded samples, shape (rows, columns). See ``motion.recording`` for the columns.
    neglected : ndarray
        Error of ln V due to inertia that is neglected up to each row (see
        ``motion.neglected_inertia``).
    """

    begun: list[Event]
    before: list[float]
    peak: Event | None
    end: Event
    rows: np.ndarray
    neglected: np.ndarray

    @property
    def begin(self) -> Event:
        """Beginning of the record."""
        return self.begun[0]

    def neglected_until(self, time: float) -> float:
        """Return the error of ln V due to inertia neglected up to a given time."""
        row = min(int(np.searchsorted(self.rows[:, 0], time)), len(self.rows) - 1)
        return float(self.neglected[row])


def followed(
    scene: Scene,
    accuracy: Accuracy,
    meter: Meter,
    asked: Sequence[EventSpecification],
    first: int,
    within: int,
    *,
    until: float = math.inf,
    halts: bool = False,
) -> Record:
    """Record a motion up to its first extremum in a loading segment.

    If there is no extremum, the record ends at the beginning of the next segment. If ``until`` is
    given, the record ends at this time.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    meter : Meter
    asked : sequence of EventSpecification
        The extremum, followed by other events that may end the motion.
    first, within : int
        Indices of the segment at which the record begins, and of the segment that contains the
        extremum.
    until : float
        End time in D_c/V_*.
    halts : bool
        If True, ignore a ``Halt`` after the extremum.

    Returns
    -------
    Record

    Raises
    ------
    Halt
        If the motion cannot continue.
    """
    recording, begun, peak = Recording(), list[Event](), None
    try:
        for event in follow(
            scene, accuracy, meter, asked, clock=True, recording=recording, until=until
        ):
            if event.kind in (Kind.START, Kind.SEGMENT):
                begun.append(event)
            elif event.watch == asked[0] and len(begun) == within + 1 and peak is None:
                peak = event
            if until == math.inf and (peak is not None or len(begun) > within + 1):
                break
    except Halt:
        if peak is None or not halts:
            raise
    rows, start = recording.seen(scene), before_start(scene)
    slow = recording.number(scene.dynamics.regime)
    neglected = estimate_neglected_inertia(scene, rows, slow, start.log_slip_rate)
    shown = rows[:, 0] >= begun[first].time
    rows, neglected = rows[shown], neglected[shown]
    rows[0, PLACE] = 0.0  # of the step that ends there, no other rows are left
    friction, later = friction_coefficient_of(rows), begun[max(first, 1) :]
    before = [float(friction[rows[:, 0] == each.time][0]) for each in later]
    if first == 0:
        before.insert(0, start.reading)
    return Record(begun[first:], before, peak, event, rows, neglected)


def since(begin: Event, path: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the quantities along a record, with time and slip from its start."""
    found = {name: path[name] for name in ("friction_coefficient", "log10_slip_rate")}
    return {"time": path["time"] - begin.time, "slip": path["slip"] - path["slip"][0], **found}


@guard_methods
@dataclass(frozen=True)
class Recorded(Measure):
    """Base class of measures that keep a record along ``phase``.

    The field ``phases`` sets the number of points of the record.
    """

    def __post_init__(self) -> None:
        if self.points < 2:
            raise InvalidValue("phases", self.points, "must be at least 2")

    @property
    def points(self) -> int:
        """Number of points of the record that are kept."""
        return int(self.plain_fields["phases"])

    @derived
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"phase": np.linspace(0.0, 1.0, self.points)}


def error_of(
    value: float,
    refined: float,
    by_friction: float,
    scene: Scene,
    accuracy: Accuracy,
    neglected: float = 0.0,
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
    by_friction : float
        Derivative dy/dmu of the result with respect to the friction coefficient from which the
        result is read.
    scene : Scene
    accuracy : Accuracy
    neglected : float
        Error of ln V that both runs share, because both neglect the same part of inertia.

    Returns
    -------
    float
        Error in the units of the result.
    """
    friction = (_AT_AN_INSTANT * accuracy.rtol + neglected) * scene.a
    chance = BY_CHANCE * accuracy.rtol
    return error_between(value, refined, chance) + friction * abs(by_friction)


def errors_of(
    values: Mapping[str, float],
    refined: Mapping[str, float],
    by_friction: Mapping[str, float],
    scene: Scene,
    accuracy: Accuracy,
    neglected: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """Estimate the errors of several results that are read at single instants.

    See ``error_of`` for the estimate.

    Returns
    -------
    dict
        Errors by name, as ``<name>_error``.
    """
    shared = neglected or dict.fromkeys(values, 0.0)
    return {
        f"{name}_error": error_of(
            value, refined[name], by_friction[name], scene, accuracy, shared[name]
        )
        for name, value in values.items()
    }
