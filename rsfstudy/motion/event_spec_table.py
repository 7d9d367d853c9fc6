"""Table of event specifications that the event loop reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from rsfstudy.motion import array_layout
from rsfstudy.motion.integration_events import EventKind, EventSpecification
from rsfstudy.motion.integration_step_events import BEFORE_JUMP, NO_EVENT, find_jump_side_of_event
from rsfstudy.slider import FloatTuple, MotionPoint

_CODE_BY_EVENT_KIND = {
    kind: array_layout.__dict__[kind.name]
    for kind in EventKind
    if kind.name in array_layout.__dict__
}
#: Array column of each attribute of ``MotionPoint``. The empty name is mapped to the first column.
_POINT_COLUMN_BY_QUANTITY = {
    name: column for column, name in enumerate(MotionPoint._fields[:-1])
} | {"": 0}
#: Kinds of events that are reported without a request. The negative event codes are indices from
#: the end of this list.
_KINDS_AND_SPECS_OF_AUTOMATIC_EVENTS = [
    (k, None)
    for k in (
        EventKind.SEGMENT_START,
        EventKind.ALL_SAMPLES_RECORDED,
        EventKind.END,
        EventKind.REGIME_CHANGE,
        EventKind.START,
    )
]


def find_events_at_stress_jump(
    point_before: MotionPoint,
    parameters_before: FloatTuple,
    point_after: MotionPoint,
    parameters_after: FloatTuple,
    event_specs: Sequence[EventSpecification],
) -> Iterator[tuple[EventSpecification, MotionPoint]]:
    """Yield the requested events that occur at a jump between two points.

    Parameters
    ----------
    point_before, point_after : MotionPoint
        Points immediately before and after the jump.
    parameters_before, parameters_after : tuple of float
        Parameters of the scene before and after the jump.
    event_specs : sequence of EventSpecification
        Requested events.

    Yields
    ------
    specification : EventSpecification
        Specification of the event.
    point : MotionPoint
        Point at which the event is reported, either ``point_before`` or ``point_after``.
    """
    last, first = (
        pack_point_into_array(point_before).tolist(),
        pack_point_into_array(point_after).tolist(),
    )
    table = (
        pack_event_specifications_into_table(tuple(event_specs))[0]
        .reshape(-1, len(array_layout.EVENT_SPECIFICATION_COLUMNS))
        .tolist()
    )
    for spec, row in zip(event_specs, table, strict=True):
        where = find_jump_side_of_event(row, last, parameters_before, first, parameters_after)
        if where != NO_EVENT:
            yield spec, point_before if where == BEFORE_JUMP else point_after


@lru_cache(maxsize=256)
def pack_event_specifications_into_table(
    event_specs: tuple[EventSpecification, ...],
) -> tuple[np.ndarray, list[tuple[EventKind, EventSpecification | None]]]:
    """Convert event specifications to the table of the event loop.

    Parameters
    ----------
    event_specs : tuple of EventSpecification
        Requested events.

    Returns
    -------
    table : ndarray of shape (specifications * 7,)
        Rows of the table. The columns are ``array_layout.EVENT_SPECIFICATION_COLUMNS``.
    events_by_code : list of (EventKind, EventSpecification or None)
        Event kind and event specification for each event code of the loop.
    """
    meanings = [
        *((spec.kind, spec) for spec in event_specs),
        *_KINDS_AND_SPECS_OF_AUTOMATIC_EVENTS,
    ]
    asked = np.zeros((len(event_specs), len(array_layout.EVENT_SPECIFICATION_COLUMNS)))
    for row, spec in zip(asked, event_specs, strict=True):
        row[array_layout.SPEC_KIND], row[array_layout.SPEC_QUANTITY] = (
            _CODE_BY_EVENT_KIND[spec.kind],
            _POINT_COLUMN_BY_QUANTITY[spec.quantity],
        )
        row[array_layout.SPEC_LEVEL], row[array_layout.SPEC_TERMINAL] = spec.level, spec.terminal
        row[array_layout.SPEC_MAY_REPORT_LATER] = spec.may_report_later
    return asked.ravel(), meanings


def pack_point_into_array(point: MotionPoint) -> np.ndarray:
    """Convert a ``MotionPoint`` to an array with the columns of the event loop.

    Parameters
    ----------
    point : MotionPoint
        Point of the motion.

    Returns
    -------
    ndarray of shape (FIRST_STATE + states,)
        Columns of the point.
    """
    return np.array((*point[:-1], *point.psis))
