"""Limit cycles of stick-slip at a constant load point velocity.

The package contains the measure ``LimitCycle`` and the algorithms that the measure uses: the
detection of cycles along a motion, the return map, and the search for a periodic orbit. The measure
``EventStatistics`` describes the events of motions that do not repeat. The package never computes
the response to a single step, and never reads or writes a file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.limit_cycles.event_statistics import EventStatistics
    from rsfstudy.limit_cycles.limit_cycle import (
        LimitCycle,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "limit_cycles.event_statistics": ("EventStatistics",),
            "limit_cycles.limit_cycle": ("LimitCycle",),
        },
    )

__all__ = [
    "EventStatistics",
    "LimitCycle",
]
