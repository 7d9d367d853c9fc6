"""Kinds of events of a motion, and the rows of the event table.

The module ``within_steps`` detects and locates the events. The table lists the events in order,
each with its time, slip and point. A measure can request the following events:

    maximum(of), minimum(of)    extremum of a quantity
    rise(of, to), fall(of, to)  upward or downward crossing of a level by a quantity
    settling(part)              distance from steady sliding below a fraction of the largest
                                distance so far. The event is reported at the end of each such step
                                in the last segment of loading, unless normal stress still changes
                                or steady sliding is unstable.

Each requested event may end the motion. The available quantities are the attributes of a ``Point``.
The attribute ``reading`` is the friction coefficient that a rig measures. Extrema are available for
``log_slip_rate``, ``spring_stress`` and ``reading``.

In addition to the requested events, the table lists the start of the motion, each change of regime,
the beginning of each segment of loading, the end of the motion, and the end of the step in which
the last requested sample was recorded. An event at the transition between two regimes or segments
is reported at the beginning of the later regime or segment. If a motion cannot continue, it raises
``Halt`` with the reason.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from rsfstudy.slider.point import Point


class Kind(StrEnum):
    """Kinds of events."""

    START = "start"
    MAXIMUM = "maximum"
    MINIMUM = "minimum"
    RISE = "rise"
    FALL = "fall"
    SETTLED = "settled"
    REGIME = "regime"
    SEGMENT = "segment"
    SAMPLED = "sampled"
    END = "end"

    # that of an enumeration is written in Python, and tables of events are looked up by it
    __hash__ = str.__hash__


class EventSpecification(NamedTuple):
    """Event specification; whether the motion ends there; and whether whoever asks can wait for it,
    and for the beginning, until something else has happened: an engine may then tell several events
    at once.
    """

    kind: Kind
    of: str = ""
    level: float = 0.0
    ends: bool = False
    waits: bool = False


def maximum(of: str, *, ends: bool = False, waits: bool = False) -> EventSpecification:
    """A maximum of ``log_slip_rate``, ``spring_stress`` or ``reading``."""
    return EventSpecification(Kind.MAXIMUM, of, ends=ends, waits=waits)


def minimum(of: str, *, ends: bool = False, waits: bool = False) -> EventSpecification:
    """A minimum of ``log_slip_rate``, ``spring_stress`` or ``reading``."""
    return EventSpecification(Kind.MINIMUM, of, ends=ends, waits=waits)


def rise(of: str, to: float, *, ends: bool = False, waits: bool = False) -> EventSpecification:
    """A quantity on its way up, at a level."""
    return EventSpecification(Kind.RISE, of, to, ends, waits)


def fall(of: str, to: float, *, ends: bool = False, waits: bool = False) -> EventSpecification:
    """A quantity on its way down, at a level."""
    return EventSpecification(Kind.FALL, of, to, ends, waits)


def settling(part: float, *, ends: bool = False) -> EventSpecification:
    """Return the specification of an event for motions that approach steady sliding.

    The event occurs if the distance from steady sliding falls below a fraction of the largest
    distance so far. The distance is measured in ln V and in each state divided by b. Unknowns
    listed in the attribute ``excluded_from_distance`` of a part are ignored.
    """
    return EventSpecification(Kind.SETTLED, level=part, ends=ends)


class Event(NamedTuple):
    """One row of the table.

    Attributes
    ----------
    kind : Kind
    watch : EventSpecification or None
        What was asked for, if it was.
    time, slip : float
        Since the start, in D_c/V_* and D_c; NaN in a motion without clock.
    point : Point
        What the slider does then.
    regime : str
        The equations in use.
    work : int
        Right-hand sides spent so far.
    clock : float
        Clock of those equations, since they have been in use: length along the path, or slip of a
        rigid slider.
    """

    kind: Kind
    watch: EventSpecification | None
    time: float
    slip: float
    point: Point
    regime: str
    work: int
    clock: float
