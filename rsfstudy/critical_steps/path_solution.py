"""Boundary between stable and unstable steps, with its numerical error.

The function ``find_by_critical_path`` computes the boundary from the critical path. The function
``find_by_touching_cycle`` computes the boundary at which a limit cycle touches the norm.
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

#: Error that two paths may share by chance, as a fraction of the requested relative accuracy.
_COINCIDENCE_FLOOR = 0.004

#: Largest number of local tolerances with which a path is integrated.
_MAX_PATHS = 5


@dataclass(frozen=True)
class StepBoundary:
    """Boundary in step size before verification, with its numerical error.

    Parameters
    ----------
    size : float
        Size of the step. See ``StepFamily``.
    relative_error : float
        Relative error of the size.
    from_motions : bool, default: False
        True if the boundary follows from forward motions.
    from_cycle : bool, default: False
        True if a limit cycle touches the norm at the boundary.
    """

    size: float
    relative_error: float
    from_motions: bool = False
    from_cycle: bool = False


def find_by_critical_path(
    steps: StepFamily, accuracy: Accuracy, meter: WorkMeter
) -> StepBoundary | None:
    """Find the boundary that corresponds to the critical path.

    The boundary is rejected if smaller steps may be unstable. Smaller steps may be unstable if
    steady sliding is unstable, or if the next peak of the motion exceeds the norm.

    Parameters
    ----------
    steps : StepFamily
        Steps among which the boundary is sought.
    accuracy : Accuracy
        Requested accuracy.
    meter : WorkMeter
        Counter of right-hand-side evaluations.

    Returns
    -------
    StepBoundary or None
        The boundary, or None if there is no critical path or if smaller steps may be unstable.
    """
    boundary = _find_boundary(steps, steps.find_path_sizes, accuracy, meter)
    if boundary is None or not steps.smaller_steps_decay(boundary.size):
        return None
    # If all orbits are closed at the critical stiffness, a motion never returns to a higher peak.
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
    """Find the boundary at which a limit cycle touches the norm.

    A limit cycle can touch the norm if larger steps make steady sliding less stable, and if steady
    sliding is unstable after the largest step.

    Parameters
    ----------
    steps : StepFamily
        Steps among which the boundary is sought.
    accuracy : Accuracy
        Requested accuracy.
    meter : WorkMeter
        Counter of right-hand-side evaluations.

    Returns
    -------
    StepBoundary or None
        The boundary, or None if there is no such limit cycle.
    """
    small, large = (
        stability_margin(steps.scene_at(size)) for size in (steps.min_size, steps.max_size)
    )
    if large >= 0.0 or small - large < 10.0 * accuracy.rtol:
        return None
    boundary = _find_boundary(steps, steps.find_cycle_sizes, accuracy, meter)
    # A limit cycle attracts nearby motions weakly, so the errors of two runs may be similar.
    error = 5.0 * boundary.relative_error if boundary else math.nan
    return boundary and replace(boundary, relative_error=error, from_cycle=True)


def _find_boundary(
    steps: StepFamily,
    find_sizes: Callable[[Iterable[float], WorkMeter], Iterator[float]],
    accuracy: Accuracy,
    meter: WorkMeter,
) -> StepBoundary | None:
    """Find a boundary, and estimate its error from several tolerances.

    The path is integrated with decreasing tolerances until the difference between two runs is
    within the requested accuracy. A path has so few steps that a single underestimated local error
    may dominate the result. The result is None if the search finds no size between the smallest and
    the largest step.
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
    """Yield local tolerances, each a tenth of the previous tolerance."""
    for _ in range(_MAX_PATHS):
        if accuracy.local_tolerance > MIN_LOCAL_TOLERANCE:
            yield accuracy.local_tolerance
        accuracy = accuracy.refined()
