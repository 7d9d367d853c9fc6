"""Functions that estimate the critical step size and the numerical error of the estimate.

The function ``find_critical_step_size_by_critical_path`` computes the boundary from the critical
path. The function ``find_critical_step_size_by_limit_cycle`` computes the step size at which a
limit cycle touches the instability norm.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from rsfstudy.critical_steps.critical_path import CriticalPath
from rsfstudy.critical_steps.loading_step_families import (
    LOOSE_INTEGRATION_TOLERANCE,
    LoadingStepFamily,
)
from rsfstudy.critical_steps.slow_manifold_accuracy import estimate_slow_manifold_relative_error
from rsfstudy.critical_steps.stability_after_step import compute_stability_margin
from rsfstudy.motion import Integrator

#: Minimum error estimate of a critical step, divided by the requested relative accuracy. The
#: minimum is necessary because two integrations of a path may have the same error by chance.
_MIN_ESTIMATED_ERROR_OVER_RTOL = 0.004

#: Maximum number of integrations of a path with successively smaller local tolerances.
_MAX_LOCAL_TOLERANCES_TRIED_PER_PATH = 5


@dataclass(frozen=True)
class CriticalStepSizeEstimate:
    """Estimate of the boundary between stable and unstable step sizes, before verification.

    Parameters
    ----------
    step_size : float
        Size of the step. See ``LoadingStepFamily``.
    relative_error : float
        Relative error of the step size.
    uses_forward_integration : bool, default: False
        True if the boundary was computed from motions that are integrated forwards in time.
    limit_cycle_touches_instability_norm : bool, default: False
        True if a limit cycle touches the instability norm at the boundary.
    """

    step_size: float
    relative_error: float
    uses_forward_integration: bool = False
    limit_cycle_touches_instability_norm: bool = False


def find_critical_step_size_by_critical_path(
    step_family: LoadingStepFamily, integrator: Integrator
) -> CriticalStepSizeEstimate | None:
    """Find the critical step size from the critical path.

    The boundary is rejected if smaller steps may be unstable. Smaller steps may be unstable if
    steady sliding is unstable after a smaller step, or if the next peak of ln V exceeds the
    instability norm.

    Parameters
    ----------
    step_family : LoadingStepFamily
        Family of steps in which to search for the boundary.
    integrator : Integrator
        Integrator with the requested accuracy.

    Returns
    -------
    CriticalStepSizeEstimate or None
        The boundary, or None if there is no critical path or if smaller steps may be unstable.
    """
    boundary = _find_critical_step_size_with_error(
        step_family, step_family.iterate_step_sizes_by_critical_path, integrator
    )
    if boundary is None or not step_family.motions_after_smaller_steps_decay(boundary.step_size):
        return None
    # If all orbits are closed at the critical stiffness, a motion never returns to a higher peak.
    if step_family.scene.parts.law.has_closed_orbits_at_critical_stiffness:
        return boundary
    scene = step_family.build_scene_with_step(boundary.step_size)
    if scene.log_load_velocity == -math.inf:
        return boundary
    return (
        None
        if CriticalPath.from_scene(scene, integrator).next_peak_exceeds_instability_norm(
            LOOSE_INTEGRATION_TOLERANCE
        )
        else boundary
    )


def find_critical_step_size_by_limit_cycle(
    step_family: LoadingStepFamily, integrator: Integrator
) -> CriticalStepSizeEstimate | None:
    """Find the step size at which a limit cycle touches the instability norm.

    The function searches for a boundary only if steady sliding is less stable after larger steps
    and unstable after the largest step.

    Parameters
    ----------
    step_family : LoadingStepFamily
        Family of steps in which to search for the boundary.
    integrator : Integrator
        Integrator with the requested accuracy.

    Returns
    -------
    CriticalStepSizeEstimate or None
        The boundary, or None if there is no such limit cycle.
    """
    small, large = (
        compute_stability_margin(step_family.build_scene_with_step(size))
        for size in (step_family.min_size, step_family.max_size)
    )
    if large >= 0.0 or small - large < integrator.result_tolerance(10.0):
        return None
    boundary = _find_critical_step_size_with_error(
        step_family, step_family.iterate_step_sizes_by_limit_cycle, integrator
    )
    # A limit cycle attracts nearby motions weakly, so the errors of two runs may be similar.
    error = 5.0 * boundary.relative_error if boundary else math.nan
    return boundary and replace(
        boundary, relative_error=error, limit_cycle_touches_instability_norm=True
    )


def _find_critical_step_size_with_error(
    step_family: LoadingStepFamily,
    iterate_step_sizes_by_tolerance: Callable[[Iterable[float], Integrator], Iterator[float]],
    integrator: Integrator,
) -> CriticalStepSizeEstimate | None:
    """Find a boundary, and estimate its error from runs with several tolerances.

    The path is integrated with decreasing tolerances until the difference between two runs is
    within the requested accuracy. More than one tolerance is necessary, because a path has so few
    integration steps that a single underestimated local error may dominate the result. The result
    is None if the search finds no boundary between the smallest and the largest step size.
    """
    boundary = None
    of_path = (
        estimate_slow_manifold_relative_error(step_family.scene)
        if step_family.scene.has_mass
        else 0.0
    )
    for size, refined in itertools.pairwise(
        iterate_step_sizes_by_tolerance(
            _iterate_decreasing_local_tolerances(integrator), integrator
        )
    ):
        if not step_family.min_size <= size <= step_family.max_size:
            break
        error = integrator.estimate_error(size, refined, _MIN_ESTIMATED_ERROR_OVER_RTOL) / size
        boundary = CriticalStepSizeEstimate(size, error + of_path)
        if error <= step_family.compute_step_size_tolerance(size, integrator.result_tolerance()):
            break
    return boundary


def _iterate_decreasing_local_tolerances(integrator: Integrator) -> Iterator[float]:
    """Yield local tolerances that decrease by a factor of ten."""
    for _ in range(_MAX_LOCAL_TOLERANCES_TRIED_PER_PATH):
        if integrator.local_tolerance > Integrator.MIN_LOCAL_ERROR_TOLERANCE:
            yield integrator.local_tolerance
        integrator = integrator.refined()
