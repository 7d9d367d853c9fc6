"""Classes and functions that describe the events of a motion and specify the events to report.

The module ``integration_step_events`` detects and locates the events. The event table lists the
events in chronological order. For each event, the table contains the slip and the point of the
motion (slip rate, stresses and states). A measure can request the following events:

    maximum(quantity), minimum(quantity)
                                extremum of a quantity
    rise(quantity, level), fall(quantity, level)
                                upward or downward crossing of a level by a quantity
    approach_to_steady_state(fraction)
                                approach of the motion to steady sliding: the distance from steady
                                sliding falls below a fraction of its largest value so far. The
                                event is reported at the end of each integration step that meets
                                this condition. Only the last loading segment is checked. The event
                                is not reported if normal stress still changes or if steady sliding
                                is unstable.

A requested event ends the motion if it is specified with ``terminal=True``. The available
quantities are the attributes of a ``MotionPoint``. The attribute ``apparent_friction`` is the
friction coefficient that a rig measures. You can request extrema of ``log_slip_rate``,
``spring_stress`` and ``apparent_friction``.

In addition to the requested events, the table lists the start and the end of the motion, each
change of regime, the beginning of each loading segment, and the end of the step in which the last
requested sample was recorded. If an event occurs at the transition between two regimes or segments,
it is reported at the beginning of the later regime or segment. If the scene has inertia, a rupture
begins and ends with a change of regime (``EventKind.REGIME_CHANGE``), unless a loading segment
begins or ends at the same time. If a motion cannot continue, the integration raises
``MotionStopped`` with the reason.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

from rsfstudy._deprecation import (
    accept_former_keyword_names,
    add_former_member_names,
    build_getattr_for_former_names,
    translate_former_member_name,
)
from rsfstudy.slider import MotionPoint


class EventKind(StrEnum):
    """Kinds of events of a motion."""

    START = "start"
    MAXIMUM = "maximum"
    MINIMUM = "minimum"
    RISE = "rise"
    FALL = "fall"
    SETTLED = "settled"
    REGIME_CHANGE = "regime"
    SEGMENT_START = "segment"
    ALL_SAMPLES_RECORDED = "sampled"
    END = "end"

    # The hash function of enumerations is slow because it is written in Python.
    __hash__ = str.__hash__


@add_former_member_names
class EventSpecification(NamedTuple):
    """Specification of a requested event.

    The functions ``maximum``, ``minimum``, ``rise``, ``fall`` and ``approach_to_steady_state``
    create specifications.

    Parameters
    ----------
    kind : EventKind
        Kind of the event.
    quantity : str, default: ""
        Attribute of ``MotionPoint``. Settling events have no quantity.
    level : float, default: 0.0
        Level of a crossing. For a settling event, the level is the fraction that is passed to
        ``approach_to_steady_state``.
    terminal : bool, default: False
        If True, the motion ends at the event.
    may_report_later : bool, default: False
        If True, the engine may delay the reports of the event and of the start of the motion, and
        report several events together. This makes the integration faster.
    """

    kind: EventKind
    quantity: str = ""
    level: float = 0.0
    terminal: bool = False
    may_report_later: bool = False


@accept_former_keyword_names
def maximum(
    quantity: str, *, terminal: bool = False, may_report_later: bool = False
) -> EventSpecification:
    """Create an event specification for the maxima of a quantity.

    Parameters
    ----------
    quantity : {"log_slip_rate", "spring_stress", "apparent_friction"}
        Quantity whose maxima are located.
    terminal : bool, default: False
        If True, the motion ends at the first maximum.
    may_report_later : bool, default: False
        If True, the engine may delay the report of the event and report several events together.
        See ``EventSpecification``.

    Returns
    -------
    EventSpecification
        Specification of the event.
    """
    return _specify_quantity_event(
        EventKind.MAXIMUM, quantity, terminal=terminal, may_report_later=may_report_later
    )


@accept_former_keyword_names
def minimum(
    quantity: str, *, terminal: bool = False, may_report_later: bool = False
) -> EventSpecification:
    """Create an event specification for the minima of a quantity.

    Parameters
    ----------
    quantity : {"log_slip_rate", "spring_stress", "apparent_friction"}
        Quantity whose minima are located.
    terminal : bool, default: False
        If True, the motion ends at the first minimum.
    may_report_later : bool, default: False
        If True, the engine may delay the report of the event and report several events together.
        See ``EventSpecification``.

    Returns
    -------
    EventSpecification
        Specification of the event.
    """
    return _specify_quantity_event(
        EventKind.MINIMUM, quantity, terminal=terminal, may_report_later=may_report_later
    )


@accept_former_keyword_names
def rise(
    quantity: str, level: float, *, terminal: bool = False, may_report_later: bool = False
) -> EventSpecification:
    """Create an event specification for upward crossings of a level.

    Parameters
    ----------
    quantity : str
        Attribute of ``MotionPoint``.
    level : float
        Level of the crossing.
    terminal : bool, default: False
        If True, the motion ends at the first crossing.
    may_report_later : bool, default: False
        If True, the engine may delay the report of the event and report several events together.
        See ``EventSpecification``.

    Returns
    -------
    EventSpecification
        Specification of the event.
    """
    return _specify_quantity_event(
        EventKind.RISE, quantity, level, terminal=terminal, may_report_later=may_report_later
    )


@accept_former_keyword_names
def fall(
    quantity: str, level: float, *, terminal: bool = False, may_report_later: bool = False
) -> EventSpecification:
    """Create an event specification for downward crossings of a level.

    Parameters
    ----------
    quantity : str
        Attribute of ``MotionPoint``.
    level : float
        Level of the crossing.
    terminal : bool, default: False
        If True, the motion ends at the first crossing.
    may_report_later : bool, default: False
        If True, the engine may delay the report of the event and report several events together.
        See ``EventSpecification``.

    Returns
    -------
    EventSpecification
        Specification of the event.
    """
    return _specify_quantity_event(
        EventKind.FALL, quantity, level, terminal=terminal, may_report_later=may_report_later
    )


def _specify_quantity_event(
    kind: EventKind, quantity: str, level: float = 0.0, *, terminal: bool, may_report_later: bool
) -> EventSpecification:
    """Create an event specification. Former quantity names are also accepted."""
    if quantity not in MotionPoint._fields:
        quantity = translate_former_member_name(MotionPoint, quantity)
    return EventSpecification(kind, quantity, level, terminal, may_report_later)


@accept_former_keyword_names
def approach_to_steady_state(fraction: float, *, terminal: bool = False) -> EventSpecification:
    """Create an event specification for the approach to steady sliding.

    The event occurs when the distance between the motion and steady sliding falls below a given
    fraction of the largest distance so far. The distance is the larger of two values: the absolute
    difference in ln V, and the largest absolute difference in a state divided by the parameter b.
    The distance does not include unknowns that are listed in the attribute
    ``excluded_from_distance`` of a scene part.

    Parameters
    ----------
    fraction : float
        Fraction of the largest distance between the motion and steady sliding so far.
    terminal : bool, default: False
        If True, the motion ends at the event.

    Returns
    -------
    EventSpecification
        Specification of the event.
    """
    return EventSpecification(EventKind.SETTLED, level=fraction, terminal=terminal)


@add_former_member_names
class Event(NamedTuple):
    """Event of a motion.

    Parameters
    ----------
    kind : EventKind
        Kind of the event.
    specification : EventSpecification or None
        Specification of the event if it was requested, and otherwise None.
    time : float
        Time since the start of the motion, in D_c/V_*. The value is NaN if time is not an unknown
        of the motion.
    slip : float
        Slip since the start of the motion, in D_c. For most sliders, the slip is NaN if time is not
        an unknown.
    point : MotionPoint
        Point of the motion (slip rate, stresses, states and their derivatives) at the event.
    regime : str
        Name of the regime.
    evaluation_count : int
        Number of right-hand side evaluations so far.
    independent_variable : float
        Independent variable of the equations, measured from the start of the regime. The
        independent variable is the path length, or the slip of a rigid slider.
    """

    kind: EventKind
    specification: EventSpecification | None
    time: float
    slip: float
    point: MotionPoint
    regime: str
    evaluation_count: int
    independent_variable: float


if not TYPE_CHECKING:
    __getattr__ = build_getattr_for_former_names(__name__)
