"""Families of steps, and the shooting method that finds critical steps.

The base class ``LoadingStepFamily`` describes all steps of one type and direction, ordered by size.
The class ``LoadingStepFamilySolvedByShooting`` adds the shooting method. The module
``loading_step_types`` contains the concrete classes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from itertools import accumulate, pairwise, repeat, takewhile
from typing import ClassVar

import numpy as np
from scipy.optimize import brentq

from rsfstudy.critical_steps.critical_path import CriticalPath
from rsfstudy.critical_steps.stability_after_step import is_linearly_stable
from rsfstudy.motion import Integrator
from rsfstudy.slider import Scene

#: Two constants: the smallest step size of the search, and the largest ratio of the smallest step
#: size to the largest step size.
MIN_STEP_SIZE, _MIN_SIZE_FRACTION = 1e-3, 0.1
#: Increase of the largest step, in units of ln V, if inertia delays the rise of slip rate.
LOG_RATE_ADDED_TO_MAX_STEP_FOR_INERTIA = 5.0
#: The effect of inertia on the critical step size is neglected if the effect is less than this
#: fraction of the requested accuracy.
MAX_NEGLECTED_INERTIA_EFFECT_OVER_RTOL = 0.01
#: Number of step sizes at which stability is tested, if stability may change repeatedly with size.
_COUNT_OF_STEP_SIZES_TESTED_FOR_STABILITY = 24
#: Local tolerance of the integrations for the approximate root of the misfit.
LOOSE_INTEGRATION_TOLERANCE = 1e-5
#: Smallest and largest difference of ln(step size) over which the slope of the misfit is computed.
#: If a correction of the approximate root exceeds the largest difference of ln(step size), the
#: refinement of the root ends.
_MIN_SLOPE_DISTANCE, _MAX_SLOPE_DISTANCE = 1e-3, 0.05
_MAX_SECANT_ITERATIONS = 8
#: Largest increment and upper limit of logit(step size/largest step size) in the search for a sign
#: change in the misfit.
_MAX_STRIDE, _MAX_POSITION = 0.7, 4.0
#: Number of successive step sizes without a critical path after which the search is abandoned.
_MAX_SIZE_COUNT_WITHOUT_CRITICAL_PATH = 3


class LoadingStepFamily:
    """Base class of step families. A family contains steps of one type and direction.

    The step size is a positive number that increases with the magnitude of the step.

    Parameters
    ----------
    scene : Scene
        Scene on which the steps are imposed.
    sign : {1, -1}
        Direction of the steps, 1 for upward and -1 for downward.

    Attributes
    ----------
    min_size : float
        Smallest step size of the search.
    max_size : float
        Largest step size of the search. If the loading itself reaches the norm, there are no step
        sizes to search, and ``max_size`` is not greater than ``min_size``.
    """

    #: Name of the scene field that contains the step.
    stepped_field_name: ClassVar[str]
    #: Name of the critical step in the results.
    critical_output_name: ClassVar[str]
    #: Names of additional results for the critical step.
    extra_output_names: ClassVar[tuple[str, ...]] = ()
    #: True if the largest step immediately raises the slip rate to the instability norm.
    largest_step_immediately_reaches_norm = False

    def __init__(self, scene: Scene, sign: int) -> None:
        self.scene, self.sign = scene, sign
        self._scenes_by_step_size: dict[float, Scene] = {}
        self.max_size = self._compute_max_step_size() * (1.0 - 1e-9)
        self.min_size = min(MIN_STEP_SIZE, _MIN_SIZE_FRACTION * self.max_size)

    def build_scene_with_step(self, step_size: float) -> Scene:
        """Return the scene with a step of a given size.

        Parameters
        ----------
        step_size : float
            Size of the step.

        Returns
        -------
        Scene
            Scene with the step. Repeated calls for the same size return the same scene.
        """
        scene = self._scenes_by_step_size.get(step_size)
        if scene is None:
            value = self.step_size_to_field_value(step_size)
            scene = self.scene.with_(**{self.stepped_field_name: value})
            self._scenes_by_step_size[step_size] = scene
        return scene

    def step_size_to_field_value(self, step_size: float) -> float:
        """Return the value of the scene field for a step of a given size.

        Parameters
        ----------
        step_size : float
            Size of the step.

        Returns
        -------
        float
            Value of the field.
        """
        raise TypeError(f"{type(self).__name__} does not define this method")

    def compute_field_value_error(self, step_size: float, step_size_relative_error: float) -> float:
        """Return the error in the step value caused by an error in the step size.

        Parameters
        ----------
        step_size : float
            Size of the step.
        step_size_relative_error : float
            Relative error of the step size.

        Returns
        -------
        float
            Absolute error of ``step_size_to_field_value(step_size)``.
        """
        raise TypeError(f"{type(self).__name__} does not define this method")

    def compute_step_size_tolerance(self, step_size: float, field_value_tolerance: float) -> float:
        r"""Convert a tolerance of the step value to a tolerance of the step size.

        If the relative error of the step size is within the returned tolerance, the relative error
        of the change in the step value is within ``field_value_tolerance``. The size tolerance is
        at most ``field_value_tolerance``.

        Parameters
        ----------
        step_size : float
            Size of the step.
        field_value_tolerance : float
            Relative tolerance of the change in the step value.

        Returns
        -------
        float
            Relative tolerance of the step size.

        Notes
        -----
        With the step value :math:`v(s)` for the size :math:`s` and the tolerance
        :math:`\epsilon` of the step value, the tolerance of the size is

        .. math:: \epsilon\,\frac{|v(s) - v(0)|}{dv/d\ln s}.
        """
        change = abs(self.step_size_to_field_value(step_size) - self.step_size_to_field_value(0.0))
        error = self.compute_field_value_error(step_size, 1.0)
        return min(field_value_tolerance, field_value_tolerance * change / error)

    def compute_extra_output_values(self, step_size: float) -> dict[str, float]:
        """Return the additional results for a critical step.

        Parameters
        ----------
        step_size : float
            Size of the critical step, or NaN if there is no critical step.

        Returns
        -------
        dict of str to float
            Values of the results in ``extra_output_names``.
        """
        return {}

    def iterate_step_sizes_by_critical_path(
        self, local_tolerances: Iterable[float], integrator: Integrator
    ) -> Iterator[float]:
        """Yield estimates of the step size at which the critical path starts.

        Parameters
        ----------
        local_tolerances : iterable of float
            Local tolerances, in decreasing order.
        integrator : Integrator
            Integrator that counts right-hand-side evaluations.

        Yields
        ------
        float
            Step size for the next tolerance. The iterator ends early if there is no critical path.
        """
        raise TypeError(f"{type(self).__name__} does not define this method")

    def iterate_step_sizes_by_limit_cycle(
        self, local_tolerances: Iterable[float], integrator: Integrator
    ) -> Iterator[float]:
        """Yield step sizes at which a limit cycle touches the instability norm.

        Parameters
        ----------
        local_tolerances : iterable of float
            Local tolerances, in decreasing order.
        integrator : Integrator
            Integrator that counts right-hand-side evaluations.

        Returns
        -------
        iterator of float
            Step size for each tolerance. The iterator is empty if no limit cycle touches the norm.
        """
        return iter(())

    def inertia_shifts_critical_step_size(self, step_size: float, tolerance: float) -> bool:
        """Return True if inertia changes the critical step size significantly.

        If the scene has inertia, the motion after the step reaches the critical path only after a
        delay.

        Parameters
        ----------
        step_size : float
            Step size at which the critical path starts.
        tolerance : float
            Requested relative accuracy of the step size.

        Returns
        -------
        bool
            True if the difference between the start of the critical path and the critical step
            exceeds the requested accuracy.
        """
        return False

    def estimate_error_near_neutral_stability(self, step_size: float, tolerance: float) -> float:
        """Return the error of the step size close to neutral stability.

        Close to neutral stability, motions that are integrated forwards in time do not reveal
        whether oscillations grow or decay.

        Parameters
        ----------
        step_size : float
            Size of the step.
        tolerance : float
            Relative accuracy of the forward motions.

        Returns
        -------
        float
            Additional relative error of the step size.
        """
        return 0.0

    def motions_after_smaller_steps_decay(self, step_size: float) -> bool:
        """Return True if steady sliding is stable after every smaller step.

        If steady sliding is unstable after a smaller step, small oscillations grow, and the smaller
        step may be critical. The critical stiffness reaches its maximum at one end of the range of
        step sizes, so a test at the smallest and at the largest step is sufficient. If the friction
        law has a characteristic slip rate, more step sizes are tested.

        Parameters
        ----------
        step_size : float
            Size of the largest step.

        Returns
        -------
        bool
            True if all tested steps are linearly stable.
        """
        sizes = [self.min_size, step_size]
        if self.scene.parts.law.steady_states is not None:
            sizes = np.geomspace(
                self.min_size, step_size, _COUNT_OF_STEP_SIZES_TESTED_FOR_STABILITY
            ).tolist()
        return all(is_linearly_stable(self.build_scene_with_step(each)) for each in sizes)

    def _compute_max_step_size(self) -> float:
        raise TypeError(f"{type(self).__name__} does not define this method")


def compute_slip_lag_due_to_inertia(scene: Scene) -> tuple[float, float]:
    r"""Compute the slip by which inertia delays the slider after a step.

    Parameters
    ----------
    scene : Scene
        Scene with the step.

    Returns
    -------
    lag : float
        Upper bound :math:`(K/a) w^2` of the slip by which inertia delays the slider, in units of
        D_c, with :math:`w = V T/(2 \pi D_c)` immediately after the step.
    rate : float
        Slip rate immediately after the step without inertia, in units of V_*.
    """
    rate = math.exp(scene.compute_quasi_static_log_slip_rate(scene.spring_stress_step, 0.0))
    return scene.stiffness / scene.a * (scene.inertial_time * rate) ** 2, rate


class LoadingStepFamilySolvedByShooting(LoadingStepFamily):
    """Base class of steps whose critical path depends on the step size.

    The critical path depends on the step size if the step changes friction or the load point
    velocity. The critical step size is computed by a shooting method.

    Parameters
    ----------
    scene : Scene
        Scene on which the steps are imposed.
    sign : {1, -1}
        Direction of the steps, 1 for upward and -1 for downward.

    Attributes
    ----------
    sign_of_triggering_steps : int
        Direction of the steps (1 or -1) for which a positive misfit means that the step is too
        small to trigger an instability.
    """

    sign_of_triggering_steps: ClassVar[int]

    def compute_field_value_error(self, step_size: float, step_size_relative_error: float) -> float:
        """Return the error of a step value that is the exponential of the step size.

        See ``LoadingStepFamily.compute_field_value_error``.
        """
        return math.exp(self.sign * step_size) * step_size * step_size_relative_error

    def iterate_step_sizes_by_critical_path(
        self, local_tolerances: Iterable[float], integrator: Integrator
    ) -> Iterator[float]:
        """Yield estimates of the step size at which the critical path starts.

        If the step is critical, the state at the start of the critical path is the state before the
        step. An approximate root of the misfit, and the slope of the misfit at the root, are
        computed first with a loose tolerance. One to three paths are then integrated for each
        smaller tolerance. If the scene has several states, there are no critical paths. See
        ``LoadingStepFamily.iterate_step_sizes_by_critical_path``.
        """
        path_at = self.build_critical_path_factory(integrator)
        loose = (
            self._find_misfit_root_at_loose_tolerance(path_at, integrator)
            if self.scene.state_count == 1
            else None
        )
        if loose is not None:
            yield from _refine_misfit_root(
                *loose,
                local_tolerances,
                lambda size, tolerance: path_at(size).compute_state_misfit_at_path_start(tolerance),
            )

    def build_critical_path_factory(
        self, integrator: Integrator
    ) -> Callable[[float], CriticalPath]:
        """Return a function that computes the critical path after a step.

        Parameters
        ----------
        integrator : Integrator
            Integrator of the paths.

        Returns
        -------
        callable
            Function ``size -> CriticalPath``.
        """
        return lambda size: CriticalPath.from_scene(self.build_scene_with_step(size), integrator)

    def iterate_step_sizes_by_limit_cycle(
        self, local_tolerances: Iterable[float], integrator: Integrator
    ) -> Iterator[float]:
        """Yield step sizes at which a limit cycle touches the instability norm.

        The method searches for the smallest step after which an orbit that touches the instability
        norm does not shrink. The computation of each misfit requires the integration of one orbit.
        See ``LoadingStepFamily.iterate_step_sizes_by_limit_cycle``.
        """
        found, path_at = dict[float, float](), self.build_critical_path_factory(integrator)

        @cache
        def misfit(log_size: float, tolerance: float = LOOSE_INTEGRATION_TOLERANCE) -> float:
            higher = path_at(math.exp(log_size)).compute_next_peak_height_above_norm(tolerance)
            if higher is None:
                return math.nan
            found[log_size] = higher
            return higher

        sizes = accumulate(repeat(math.log(1.5)), initial=math.log(self.min_size))
        pairs = pairwise(takewhile(lambda log_size: log_size <= math.log(self.max_size), sizes))
        bracket = next((pair for pair in pairs if misfit(pair[0]) < 0.0 <= misfit(pair[1])), None)
        root = _find_misfit_root(misfit, found, *bracket) if bracket else None
        if root is not None:
            yield from _refine_misfit_root(
                *root, local_tolerances, lambda size, tolerance: misfit(math.log(size), tolerance)
            )

    def _find_misfit_root_at_loose_tolerance(
        self, build_critical_path: Callable[[float], CriticalPath], integrator: Integrator
    ) -> tuple[float, float] | None:
        """Return the log step size at which the misfit is zero, and the slope of the misfit.

        The misfit is computed with a loose tolerance. The result is None if there is no root.
        """
        found = dict[float, float]()

        @cache
        def misfit(log_size: float) -> float:
            size = math.exp(log_size)
            state = build_critical_path(size).compute_state_misfit_at_path_start(
                LOOSE_INTEGRATION_TOLERANCE
            )
            if state is None:
                return self._find_misfit_sign_from_motion(
                    self.build_scene_with_step(size), integrator
                )
            found[log_size] = state
            return state

        bracket = self._bracket_misfit_root(misfit)
        return None if bracket is None else _find_misfit_root(misfit, found, *bracket)

    def _bracket_misfit_root(
        self, misfit_function: Callable[[float], float]
    ) -> tuple[float, float] | None:
        """Return two values of ln(step size) between which the misfit changes sign.

        The search starts at a guess, and first proceeds in the direction that the sign of the
        misfit indicates. The misfit is NaN, and has no sign, if there is no critical path. The
        independent variable of the search is logit(step size/largest step size), which resolves
        both ends of the range of step sizes. The result is None if the search finds no sign change.
        """

        def log_size(position: float) -> float:
            return math.log(self.max_size) - math.log1p(math.exp(-position))

        def position(size: float) -> float:
            fraction = min(max(size, self.min_size) / self.max_size, 0.5)
            return math.log(fraction / (1.0 - fraction))

        lowest, guess = position(self.min_size), position(self._guess_critical_step_size())

        def outwards(*ways: int) -> tuple[float, float] | None:
            ends = dict.fromkeys(ways, (guess, misfit_function(log_size(guess))))
            last = {1: _MAX_POSITION, -1: lowest}
            stride, failures = 0.2, 0
            while failures < _MAX_SIZE_COUNT_WITHOUT_CRITICAL_PATH and any(
                ends[way][0] != last[way] for way in ways
            ):
                for way, (at, value) in ends.items():
                    further = min(max(at + way * stride, lowest), _MAX_POSITION)
                    beyond = misfit_function(log_size(further))
                    if further != at and value * beyond <= 0.0:
                        return log_size(min(at, further)), log_size(max(at, further))
                    ends[way] = further, beyond
                failures = failures + 1 if all(math.isnan(x) for _at, x in ends.values()) else 0
                stride = min(1.5 * stride, _MAX_STRIDE)
            return None

        way = self._choose_search_direction(misfit_function(log_size(guess)))
        return outwards(way) or outwards(-way) if way else outwards(1, -1)

    def _choose_search_direction(self, misfit_at_guess: float) -> int:
        """Return the direction in which the critical step size is expected.

        The result is 1 for larger sizes, -1 for smaller sizes, and 0 if the misfit does not
        indicate a direction.
        """
        if self.sign != self.sign_of_triggering_steps or math.isnan(misfit_at_guess):
            return 0
        return int(math.copysign(1.0, misfit_at_guess))

    def _guess_critical_step_size(self) -> float:
        """Return the step size at which the search starts."""
        raise TypeError(f"{type(self).__name__} does not define this method")

    def _find_misfit_sign_from_motion(self, scene: Scene, integrator: Integrator) -> float:
        """Return the sign of the misfit if there is no critical path.

        The sign is positive if the motion after the step is stable. The result is NaN if the sign
        is unknown.
        """
        return math.nan


def _find_misfit_root(
    misfit_function: Callable[[float], float], known_misfits: Mapping[float, float], *bracket: float
) -> tuple[float, float] | None:
    """Find the log step size at which a misfit is zero, and the slope of the misfit.

    If there is no critical path, only the sign of the misfit is known. The root and the slope are
    computed from misfits whose magnitude is known. The result is None if too few misfits have a
    known magnitude.
    """
    try:
        brentq(misfit_function, *bracket, xtol=1e-4)
    except ValueError:
        # The misfit is NaN somewhere in the bracket.
        return None
    if not known_misfits:
        return None
    root = min(known_misfits, key=lambda log_size: abs(known_misfits[log_size]))

    def others() -> list[float]:
        return [
            log_size
            for log_size in known_misfits
            if _MIN_SLOPE_DISTANCE <= abs(log_size - root) <= _MAX_SLOPE_DISTANCE
        ]

    for beside in (root + 2.0 * _MIN_SLOPE_DISTANCE, root - 2.0 * _MIN_SLOPE_DISTANCE):
        if not others():
            misfit_function(beside)
    other = min(others(), key=lambda log_size: abs(log_size - root), default=None)
    return (
        None
        if other is None
        else (root, (known_misfits[root] - known_misfits[other]) / (root - other))
    )


def _refine_misfit_root(
    log_step_size: float,
    misfit_slope: float,
    local_tolerances: Iterable[float],
    misfit_function: Callable[[float, float], float | None],
) -> Iterator[float]:
    """Yield step sizes at which a misfit is zero, for decreasing local tolerances.

    The secant method starts at an approximate root, with the slope of the misfit with respect to
    the log step size. For each local tolerance, the iteration ends when the residual is less than
    thirty times the tolerance. The iterator ends early if the secant method does not converge.
    """
    if not math.isfinite(misfit_slope) or misfit_slope == 0.0:
        return
    for tolerance in local_tolerances:
        previous: tuple[float, float] | None = None
        for _ in range(_MAX_SECANT_ITERATIONS):
            # The error of V_0 is the error of its logarithm times V_0.
            value = misfit_function(
                math.exp(log_step_size), tolerance / max(1.0, math.exp(log_step_size))
            )
            if value is None or not math.isfinite(value):
                return
            if previous is not None and value != previous[1]:
                misfit_slope = (value - previous[1]) / (log_step_size - previous[0])
            previous = log_step_size, value
            log_step_size -= value / misfit_slope
            if abs(value) > _MAX_SLOPE_DISTANCE * abs(misfit_slope):
                return
            if min(abs(value), abs(value / misfit_slope)) < 30.0 * tolerance:
                break
        else:
            return
        yield math.exp(log_step_size)
