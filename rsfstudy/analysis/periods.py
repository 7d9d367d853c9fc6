"""Motions event by event: after how many events they repeat themselves, if ever."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rsfstudy.analysis.cycles import Cycle, cycles
from rsfstudy.analysis.return_map import Orbit, ReturnMap, section
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Meter
from rsfstudy.slider.scene import Scene

#: Most events of a period that is looked for.
LONGEST = 16
#: Accuracy at which cycles are closed, where no better one is asked for: differences lose digits.
_FINE = 1e-7
#: Events after which a motion is first looked at.
_FIRST_LOOK = 8
#: Size of a multiplier from which a cycle repels beyond doubt, and how far off its like an event is
#: that repeats none, over how far ln V swings.
_REPELS, _OFF = 1.01, 0.02


@dataclass(frozen=True)
class Course:
    """State of a motion in its course.

    Attributes
    ----------
    seen : list of Cycle
        Its events.
    orbit : Orbit or None
        The cycle it ends in; none, where it has not found one.
    open : bool
        Whether it may still find one, as far as its events tell.
    """

    seen: list[Cycle]
    orbit: Orbit | None
    open: bool


def course(
    scene: Scene, accuracy: Accuracy, meter: Meter, events: int, *, to_its_end: bool = False
) -> Course | None:
    """Follow a motion until it comes to a cycle that attracts, for so many events at most; or `to
    its end` in any case. None where it settles to steady sliding.
    """
    seen, orbit, repels = list[Cycle](), None, False
    fine = replace(accuracy, rtol=min(accuracy.rtol, _FINE))
    by, look = ReturnMap(scene, fine, meter), min(_FIRST_LOOK, events)
    for cycle in cycles(scene, accuracy, meter, None):
        if cycle is None:
            return None
        seen.append(cycle)
        if len(seen) == look and not orbit:
            look = min(2 * look, events)
            period, off = recurrence(scene, seen)
            found = None
            if off < _OFF:
                found = by.orbit(section(cycle.end), period, cycle.swing)
            repels = off >= _OFF or (found is not None and abs(found.multipliers[0]) > _REPELS)
            orbit = found if found is not None and found.attracts else None
        if len(seen) == events or (orbit and not to_its_end):
            break
    return Course(seen, orbit, open=not repels or _on_its_way(seen))


def _on_its_way(seen: Sequence[Cycle]) -> bool:
    """True if events are too few to say anything of them, or still grow or shrink all the time."""
    growth = np.diff([cycle.swing for cycle in seen[len(seen) // 2 :]])
    return len(seen) < _FIRST_LOOK or bool((growth > 0.0).all() or (growth < 0.0).all())


def recurrence(scene: Scene, seen: Sequence[Cycle]) -> tuple[int, float]:
    """After how many events a motion comes closest to where it was, in all of the later half of its
    events; and how far it is off then, over a times how far ln V swings (infinitely, where there
    are too few events to say).
    """
    if len(seen) < 4:
        return 1, math.inf
    states = np.array([cycle.end.psis for cycle in seen])
    latest, scale = states[len(states) // 2 :], scene.a * seen[-1].swing
    longest = min(LONGEST, len(latest) // 2)
    off = np.array(
        [np.abs(latest[count:] - latest[:-count]).max() for count in range(1, longest + 1)]
    )
    period = int(np.argmax(off <= 2.0 * off.min())) + 1
    return period, float(off[period - 1]) / scale
