"""A boundary among steps by the critical path that starts it, or by the limit cycle that touches
the norm, with its numerical error.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from rsfstudy.critical_steps.critical_path import CriticalPath
from rsfstudy.critical_steps.forward_motion import stability_margin
from rsfstudy.critical_steps.shooting import LOOSE_TOLERANCE, StepFamily
from rsfstudy.critical_steps.slow_manifold import slow_manifold_error
from rsfstudy.motion import MIN_LOCAL_TOLERANCE, Accuracy, WorkMeter, estimate_error

#: Part of the accuracy asked for to which the errors of two paths may agree by chance.
_COINCIDENCE_FLOOR = 0.004

#: Most local tolerances by which a path is followed.
_MAX_PATHS = 5


@dataclass(frozen=True)
class StepBoundary:
    """A boundary in step size with its numerical error, both before verification.

    Attributes
    ----------
    size, relative_error : float
        Size of the step (see `Steps`), and its error over that.
    from_motions, from_cycle : bool
        Whether motions have found it, or whether a limit cycle is what touches the norm.
    """

    size: float
    relative_error: float
    from_motions: bool = False
    from_cycle: bool = False


def find_by_critical_path(
    steps: StepFamily, accuracy: Accuracy, meter: WorkMeter
) -> StepBoundary | None:
    """Boundary from the critical path, unless smaller steps may be unstable, at once or when the
    motion comes back; None where there is no such path.
    """
    boundary = _find_boundary(steps, steps.find_path_sizes, accuracy, meter)
    if boundary is None or not steps.smaller_steps_decay(boundary.size):
        return None
    # by laws whose orbits close at critical stiffness no motion goes beyond where it comes back
    if steps.scene.parts.law.has_closed_orbits:
        return boundary
    scene = steps.scene_at(boundary.size)
    if scene.log_load_velocity == -math.inf:
        return boundary
    return (
        None
        if CriticalPath.of_scene(scene, meter.engine).exceeds_norm_on_return(LOOSE_TOLERANCE, meter)
        else boundary
    )


def find_by_touching_cycle(
    steps: StepFamily, accuracy: Accuracy, meter: WorkMeter
) -> StepBoundary | None:
    """Boundary where the motion ends in a limit cycle that touches the norm: where larger steps
    make steady sliding less stable, and the largest unstable.
    """
    small, large = (
        stability_margin(steps.scene_at(size)) for size in (steps.min_size, steps.max_size)
    )
    if large >= 0.0 or small - large < 10.0 * accuracy.rtol:
        return None
    boundary = _find_boundary(steps, steps.find_cycle_sizes, accuracy, meter)
    # a cycle attracts little: the two errors may have much in common
    error = 5.0 * boundary.relative_error if boundary else math.nan
    return boundary and replace(boundary, relative_error=error, from_cycle=True)


def _find_boundary(
    steps: StepFamily,
    find_sizes: Callable[[Iterable[float], WorkMeter], Iterator[float]],
    accuracy: Accuracy,
    meter: WorkMeter,
) -> StepBoundary | None:
    """A boundary with the error that a second, smaller tolerance tells, and a third where that is
    more than asked for: a path takes so few steps that one whose error is taken for too small
    decides. None where there is none within the steps of the search.
    """
    boundary = None
    of_path = slow_manifold_error(steps.scene) if steps.scene.has_mass else 0.0
    for size, refined in itertools.pairwise(find_sizes(_decreasing_tolerances(accuracy), meter)):
        if not steps.min_size <= size <= steps.max_size:
            break
        error = estimate_error(size, refined, _COINCIDENCE_FLOOR * accuracy.rtol) / size
        boundary = StepBoundary(size, error + of_path)
        if error <= steps.size_tolerance(size, accuracy.rtol):
            break
    return boundary


def _decreasing_tolerances(accuracy: Accuracy) -> Iterator[float]:
    """Local tolerances of paths, one a tenth of the other."""
    for _ in range(_MAX_PATHS):
        if accuracy.local_tolerance > MIN_LOCAL_TOLERANCE:
            yield accuracy.local_tolerance
        accuracy = accuracy.refined()
