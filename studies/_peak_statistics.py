"""Statistics of the intervals between peaks of slip rate."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import ClassVar

from rsfstudy import Integrator, Scene
from rsfstudy.limit_cycles.event_statistics import EventStatistics, _SlipEvent
from rsfstudy.motion import maximum, minimum


@dataclass(frozen=True)
class PeakStatistics(EventStatistics):
    """Statistics of the intervals between peaks of slip rate.

    The docstring of ``EventStatistics`` describes the fields. In scenes without noise, each peak of
    the slip rate is an event. In scenes with noise, the slip rate has many peaks, so events are
    defined as in ``EventStatistics``. If long and short intervals alternate, the CV of the
    intervals between peaks differs from the CV of the intervals between maxima of spring stress,
    which ``EventStatistics`` uses.
    """

    name: ClassVar[str] = "peak_statistics"

    def _list_events_delimiting_cycles(
        self, scene: Scene, integrator: Integrator, cycle_count: int
    ) -> list[_SlipEvent]:
        """Return the events that delimit the intervals.

        See ``EventStatistics``.
        """
        if scene.parts.loading_noise.is_active:
            return super()._list_events_delimiting_cycles(scene, integrator, cycle_count)
        first = self.discarded_cycles
        return list(islice(_iterate_peaks(scene, integrator), first, first + cycle_count + 1))


def _iterate_peaks(scene: Scene, integrator: Integrator) -> Iterator[_SlipEvent]:
    """Yield the peaks of slip rate with their stress drops."""
    fastest, highest, lowest = (
        maximum("log_slip_rate"),
        maximum("spring_stress"),
        minimum("spring_stress"),
    )
    time, stress = math.nan, math.nan
    for event in integrator.follow(scene, (fastest, highest, lowest), with_time=True):
        if event.specification == fastest:
            time = event.time
        elif event.specification == highest:
            stress = event.point.spring_stress
        elif event.specification == lowest and not math.isnan(time):
            yield _SlipEvent(time, stress - event.point.spring_stress)
