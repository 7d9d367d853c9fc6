"""Records of motions: what the measures share that keep points of a motion, or read numbers off it
as an experimenter does.
"""

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
    """Outputs along `phase`: quantities of the vocabulary, of each point that is kept."""
    return tuple(Output(name, dims=("phase",)) for name in names)


class Record(NamedTuple):
    """A motion from the beginning of a segment of loading on.

    Attributes
    ----------
    begun : list of Event
        Where that segment begins, and each later one.
    before : list of float
        The friction coefficient the instant before. With mass, that after tells of the slow
        manifold that the motion comes to within the inertial time.
    peak : Event or None
        The extreme that was asked for; None where there is none.
    end : Event
        The last event.
    rows : ndarray
        What was recorded, shape (rows, columns): see `motion.recording`.
    neglected : ndarray
        Error of ln V by the inertia that is neglected up to each row: see
        `motion.neglected_inertia`.
    """

    begun: list[Event]
    before: list[float]
    peak: Event | None
    end: Event
    rows: np.ndarray
    neglected: np.ndarray

    @property
    def begin(self) -> Event:
        """Where the record begins."""
        return self.begun[0]

    def neglected_until(self, time: float) -> float:
        """Return the error of ln V by the inertia that is neglected up to a time."""
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
    """Record of a motion up to its first extreme in a segment of loading, or to where the next one
    begins without one; or as long as told.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    meter : Meter
    asked : sequence of EventSpecification
        The extreme first; others may end the motion.
    first, within : int
        Numbers, from 0, of the segment at which the record begins, and of the one in which the
        extreme is.
    until : float
        Time at which to end, in D_c/V_*.
    halts : bool
        Whether the motion may be unable to go on once the extreme is reached.

    Raises
    ------
    Halt
        Where the motion cannot go on.
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
    """Quantities of a record along its path, with time and slip since its beginning."""
    found = {name: path[name] for name in ("friction_coefficient", "log10_slip_rate")}
    return {"time": path["time"] - begin.time, "slip": path["slip"] - path["slip"][0], **found}


@guard_methods
@dataclass(frozen=True)
class Recorded(Measure):
    """Base of them: the record is kept along `phase`, at so many points as the field `phases`
    says.
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
    """Estimate the error of a number that is read at single instants.

    On a stiff machine stability limits the steps, so that the errors of two runs may agree at an
    instant by chance. What that hides is a part of the number, and of the friction that it is a
    difference of: of a, by which friction changes where ln V does by 1. So of y, of y' by the
    refined run, with eps the accuracy asked for and e the neglected inertia, the error is ``3 |y -
    y'| + 0.01 eps |y| + (0.1 eps + e) a |dy/dmu|``.

    Parameters
    ----------
    value, refined : float
        Results of the first run, and of the refined one.
    by_friction : float
        Change of the number by that of a friction coefficient which it is read from, dy/dmu.
    scene : Scene
    accuracy : Accuracy
    neglected : float
        Error of ln V that both runs share, because both neglect the same part of inertia.

    Returns
    -------
    float
        In the units of the number.
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
    """Estimate the errors of several numbers, as `<name>_error` (see `error_of`)."""
    shared = neglected or dict.fromkeys(values, 0.0)
    return {
        f"{name}_error": error_of(
            value, refined[name], by_friction[name], scene, accuracy, shared[name]
        )
        for name, value in values.items()
    }
