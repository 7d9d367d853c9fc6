"""A boundary among steps by the critical path that starts it, or by the limit cycle that touches
the norm, with its numerical error.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from rsfstudy.analysis.after_step import stability_margin
from rsfstudy.analysis.critical_path import CriticalPath
from rsfstudy.analysis.search_of_steps import LOOSE, Steps
from rsfstudy.motion.accuracy import Accuracy, error_between
from rsfstudy.motion.handover import error_of_slow_manifold
from rsfstudy.motion.meter import TIGHTEST, Meter

#: Part of the accuracy asked for to which the errors of two paths may agree by chance.
_BY_CHANCE = 0.004

#: Most local tolerances by which a path is followed.
_MOST_PATHS = 5


@dataclass(frozen=True)
class Boundary:
    """A boundary in step size with its numerical error, both before verification.

    Attributes
    ----------
    size, relative_error : float
        Size of the step (see `Steps`), and its error over that.
    by_motions, of_cycle : bool
        Whether motions have found it, or whether a limit cycle is what touches the norm.
    """

    size: float
    relative_error: float
    by_motions: bool = False
    of_cycle: bool = False


def from_critical_path(steps: Steps, accuracy: Accuracy, meter: Meter) -> Boundary | None:
    """Boundary from the critical path, unless smaller steps may be unstable, at once or when the
    motion comes back; None where there is no such path.
    """
    boundary = _boundary(steps, steps.sizes_on_path, accuracy, meter)
    if boundary is None or not steps.smaller_ones_decay(boundary.size):
        return None
    # by laws whose orbits close at critical stiffness no motion goes beyond where it comes back
    if steps.scene.parts.law.orbits_close:
        return boundary
    scene = steps.scene_at(boundary.size)
    if scene.log_load_rate == -math.inf:
        return boundary
    return None if CriticalPath.of(scene, meter.engine).goes_beyond(LOOSE, meter) else boundary


def from_touching_cycle(steps: Steps, accuracy: Accuracy, meter: Meter) -> Boundary | None:
    """Boundary where the motion ends in a limit cycle that touches the norm: where larger steps
    make steady sliding less stable, and the largest unstable.
    """
    small, large = (
        stability_margin(steps.scene_at(size)) for size in (steps.smallest, steps.largest)
    )
    if large >= 0.0 or small - large < 10.0 * accuracy.rtol:
        return None
    boundary = _boundary(steps, steps.sizes_of_cycle, accuracy, meter)
    # a cycle attracts little: the two errors may have much in common
    error = 5.0 * boundary.relative_error if boundary else math.nan
    return boundary and replace(boundary, relative_error=error, of_cycle=True)


def _boundary(
    steps: Steps,
    sizes_by: Callable[[Iterable[float], Meter], Iterator[float]],
    accuracy: Accuracy,
    meter: Meter,
) -> Boundary | None:
    """A boundary with the error that a second, smaller tolerance tells, and a third where that is
    more than asked for: a path takes so few steps that one whose error is taken for too small
    decides. None where there is none within the steps of the search.
    """
    boundary = None
    of_path = error_of_slow_manifold(steps.scene) if steps.scene.has_mass else 0.0
    for size, refined in itertools.pairwise(sizes_by(_tolerances(accuracy), meter)):
        if not steps.smallest <= size <= steps.largest:
            break
        error = error_between(size, refined, _BY_CHANCE * accuracy.rtol) / size
        boundary = Boundary(size, error + of_path)
        if error <= steps.allowed(size, accuracy.rtol):
            break
    return boundary


def _tolerances(accuracy: Accuracy) -> Iterator[float]:
    """Local tolerances of paths, one a tenth of the other."""
    for _ in range(_MOST_PATHS):
        if accuracy.solver > TIGHTEST:
            yield accuracy.solver
        accuracy = accuracy.refined()
