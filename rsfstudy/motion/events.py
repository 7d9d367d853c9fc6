"""Kinds of events of a motion, and rows of their table; `within_steps` finds and locates them.

The table has them in order, each with its time, slip and point.

Who measures a motion asks to be told of

    maximum(of), minimum(of)    an extremum of a quantity
    rise(of, to), fall(of, to)  its crossing of a level, on the way up or down
    settling(part)              the distance from steady sliding is below a fraction of the largest
                                distance so far. The event is reported at the end of each such step
                                in the last segment of loading, unless normal stress goes on
                                changing there or small changes of steady sliding grow.

and of nothing else. Each may end the motion. Quantities are the numbers of a `Point`, and the
friction coefficient that is read, ``reading`` (see `readings`); extrema are told of
``log_slip_rate``, ``spring_stress`` and ``reading``. Beside what was asked for, a motion tells its
start, every change of regime, every segment of its loading that begins, its end in time, and the
end of the step with which all has been recorded that was asked for. What happens from one regime or
segment to the next is told where that begins. A motion that cannot go on ends with `Halt`, which
says why.
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
    """Return the specification of a motion that comes close to steady sliding.

    The distance, in ln V or in a state over b, must fall below a fraction of the largest distance
    so far. Unknowns that a part lists in `excluded_from_distance` do not count.
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
