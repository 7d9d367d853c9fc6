"""Kinds of events of a motion, and the rows of the event table.

The module ``step_events`` detects and locates the events. The table lists the events in order,
each with its time, slip and point. A measure can request the following events:

    maximum(quantity), minimum(quantity)
                                extremum of a quantity
    rise(quantity, level), fall(quantity, level)
                                upward or downward crossing of a level by a quantity
    approach_to_steady_state(fraction)
                                distance from steady sliding below a fraction of the largest
                                distance so far. The event is reported at the end of each such step
                                in the last segment of loading, unless normal stress still changes
                                or steady sliding is unstable.

Each requested event may end the motion. The available quantities are the attributes of a
``MotionPoint``. The attribute ``apparent_friction`` is the friction coefficient that a rig
measures. Extrema are available for ``log_slip_rate``, ``spring_stress`` and ``apparent_friction``.

In addition to the requested events, the table lists the start of the motion, each change of regime,
the beginning of each segment of loading, the end of the motion, and the end of the step in which
the last requested sample was recorded. An event at the transition between two regimes or segments
is reported at the beginning of the later regime or segment. If a motion cannot continue, it raises
``MotionStopped`` with the reason.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

from rsfstudy._deprecation import (
    renamed_keywords,
    renamed_members,
    renamed_names,
    renamed_value,
)
from rsfstudy.slider import MotionPoint


class EventKind(StrEnum):
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


@renamed_members
class EventSpecification(NamedTuple):
    """Event specification; whether the motion ends there; and whether whoever asks can wait for it,
    and for the beginning, until something else has happened: an engine may then tell several events
    at once.
    """

    kind: EventKind
    quantity: str = ""
    level: float = 0.0
    terminal: bool = False
    may_defer: bool = False


@renamed_keywords
def maximum(
    quantity: str, *, terminal: bool = False, may_defer: bool = False
) -> EventSpecification:
    """A maximum of ``log_slip_rate``, ``spring_stress`` or ``apparent_friction``."""
    return _specify_quantity_event(
        EventKind.MAXIMUM, quantity, terminal=terminal, may_defer=may_defer
    )


@renamed_keywords
def minimum(
    quantity: str, *, terminal: bool = False, may_defer: bool = False
) -> EventSpecification:
    """A minimum of ``log_slip_rate``, ``spring_stress`` or ``apparent_friction``."""
    return _specify_quantity_event(
        EventKind.MINIMUM, quantity, terminal=terminal, may_defer=may_defer
    )


@renamed_keywords
def rise(
    quantity: str, level: float, *, terminal: bool = False, may_defer: bool = False
) -> EventSpecification:
    """A quantity on its way up, at a level."""
    return _specify_quantity_event(
        EventKind.RISE, quantity, level, terminal=terminal, may_defer=may_defer
    )


@renamed_keywords
def fall(
    quantity: str, level: float, *, terminal: bool = False, may_defer: bool = False
) -> EventSpecification:
    """A quantity on its way down, at a level."""
    return _specify_quantity_event(
        EventKind.FALL, quantity, level, terminal=terminal, may_defer=may_defer
    )


def _specify_quantity_event(
    kind: EventKind, quantity: str, level: float = 0.0, *, terminal: bool, may_defer: bool
) -> EventSpecification:
    """Return an event specification. The quantity may have its former name."""
    return EventSpecification(
        kind, renamed_value(MotionPoint, quantity), level, terminal, may_defer
    )


@renamed_keywords
def approach_to_steady_state(fraction: float, *, terminal: bool = False) -> EventSpecification:
    """Return the specification of an event for motions that approach steady sliding.

    The event occurs if the distance from steady sliding falls below a fraction of the largest
    distance so far. The distance is measured in ln V and in each state divided by b. Unknowns
    listed in the attribute ``excluded_from_distance`` of a part are ignored.
    """
    return EventSpecification(EventKind.SETTLED, level=fraction, terminal=terminal)


@renamed_members
class Event(NamedTuple):
    """One row of the table.

    Attributes
    ----------
    kind : EventKind
    specification : EventSpecification or None
        What was asked for, if it was.
    time, slip : float
        Since the start, in D_c/V_* and D_c; NaN in a motion without clock.
    point : Point
        What the slider does then.
    regime : str
        The equations in use.
    evaluation_count : int
        Right-hand sides spent so far.
    clock : float
        Clock of those equations, since they have been in use: length along the path, or slip of a
        rigid slider.
    """

    kind: EventKind
    specification: EventSpecification | None
    time: float
    slip: float
    point: MotionPoint
    regime: str
    evaluation_count: int
    clock: float


if not TYPE_CHECKING:
    __getattr__ = renamed_names(__name__)
