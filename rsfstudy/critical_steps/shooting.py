"""Base of the kinds of steps among which a critical one is sought, and of those shot for."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from itertools import accumulate, pairwise, repeat, takewhile
from typing import ClassVar

import numpy as np
from scipy.optimize import brentq

from rsfstudy.critical_steps.critical_path import CriticalPath
from rsfstudy.critical_steps.forward_motion import is_linearly_stable
from rsfstudy.motion import WorkMeter
from rsfstudy.slider import Scene, log_slip_rate_at

#: Smallest step the search tries, and the part of the largest that it is at most.
MIN_STEP_SIZE, _MIN_SIZE_FRACTION = 1e-3, 0.1
#: How much farther in ln V a step may jump where mass delays the rise of slip rate.
INERTIAL_LOG_RATE_MARGIN = 5.0
#: Part of the accuracy asked for to which what mass delays goes unseen.
INERTIA_TOLERANCE_FRACTION = 0.01
#: Sizes that are looked at where stability may come and go between them.
_STABILITY_TEST_COUNT = 24
#: Local tolerance of the first root.
LOOSE_TOLERANCE = 1e-5
#: Distances in log size over which the slope of the misfit is taken; what corrects a loose root by
#: more leads nowhere.
_MIN_SLOPE_DISTANCE, _MAX_SLOPE_DISTANCE = 1e-3, 0.05
_MAX_CORRECTIONS = 8
#: Longest stride, and end, of the search for a sign change in logit(size/largest).
_MAX_STRIDE, _MAX_POSITION = 0.7, 4.0
#: Strides without a critical path on either side after which shooting is given up.
_MAX_FAILURES = 3


class StepFamily:
    """Steps of one kind and direction on one scene, by size: a positive number that grows with the
    step.

    Parameters
    ----------
    scene : Scene
        The scene the steps are imposed on.
    sign : {1, -1}
        Upward or downward.

    Attributes
    ----------
    min_size, max_size : float
        Sizes the search covers; there is none to search where the loading alone reaches the norm.
    """

    #: Name of the critical value in results.
    quantity: ClassVar[str]
    #: What else is told of a critical step.
    extra_outputs: ClassVar[tuple[str, ...]] = ()
    #: Whether the largest step takes the slip rate to the norm by itself, at once.
    largest_step_reaches_norm = False

    def __init__(self, scene: Scene, sign: int) -> None:
        self.scene, self.sign = scene, sign
        self.max_size = self._compute_max_size() * (1.0 - 1e-9)
        self.min_size = min(MIN_STEP_SIZE, _MIN_SIZE_FRACTION * self.max_size)

    def scene_at(self, size: float) -> Scene:
        """The scene with a step of this size."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def step_value(self, size: float) -> float:
        """The number a user knows the step by."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def value_error(self, size: float, relative_error: float) -> float:
        """Error of `value` where the size has this relative error."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def size_tolerance(self, size: float, rtol: float) -> float:
        """Relative error of a size at which `value`, less what it is without a step, has this one;
        no more than that: ``rtol |value(size) - value(0)|/(d value/d ln size)``.
        """
        change = abs(self.step_value(size) - self.step_value(0.0))
        return min(rtol, rtol * change / self.value_error(size, 1.0))

    def extra_values(self, size: float) -> dict[str, float]:
        """The numbers named in `beside`, for a critical step of this size (NaN where there is
        none).
        """
        return {}

    def find_path_sizes(self, tolerances: Iterable[float], meter: WorkMeter) -> Iterator[float]:
        """Size of the step that starts the critical path, by one local tolerance after the other,
        each found when it is asked for; none where there is no such path.
        """
        raise TypeError(f"{type(self).__name__} steps nothing")

    def find_cycle_sizes(self, tolerances: Iterable[float], meter: WorkMeter) -> Iterator[float]:
        """Size of the step after which the motion ends in a limit cycle that touches the norm, by
        one local tolerance after the other; none where there is no such step.
        """
        return iter(())

    def inertia_shifts_size(self, size: float, rtol: float) -> bool:
        """True if the critical size is not that of the critical path's start, because slip rate
        takes time to rise to that after the step.
        """
        return False

    def neutral_size_error(self, size: float, rtol: float) -> float:
        """Relative error of a size that motions find where sliding is neutral after the step, which
        they take it for a little on either side.
        """
        return 0.0

    def smaller_steps_decay(self, size: float) -> bool:
        """True if steady sliding is linearly stable after every smaller step.

        Where it is not, smaller steps grow, and a critical path says nothing about them. Critical
        stiffness falls with the load point velocity, so the ends of the range decide, unless the
        law has a slip rate of its own: then it may rise between them.
        """
        sizes = [self.min_size, size]
        if self.scene.parts.law.steady_states is not None:
            sizes = np.geomspace(self.min_size, size, _STABILITY_TEST_COUNT).tolist()
        return all(is_linearly_stable(self.scene_at(each)) for each in sizes)

    def _compute_max_size(self) -> float:
        raise TypeError(f"{type(self).__name__} steps nothing")


def inertial_slip_lag(scene: Scene) -> tuple[float, float]:
    """Slip (D_c) by which a slider with mass falls behind one without after a step, and the slip
    rate (V_*) it rises to: less than (K/a) w**2 of slip, w = V T/(2 pi D_c) being the norm just
    after the step.
    """
    rate = math.exp(log_slip_rate_at(scene, scene.spring_stress_step, 0.0))
    return scene.stiffness / scene.a * (scene.inertial_time * rate) ** 2, rate


class ShootingSteps(StepFamily):
    """Steps after which the critical path is another for each size, so that the right one is shot
    for: those that change what friction balances, or what moves the spring.

    Attributes
    ----------
    trigger_sign : int
        Sign of the steps whose misfit is positive where they are too small to trigger.
    """

    trigger_sign: ClassVar[int]

    def value_error(self, size: float, relative_error: float) -> float:
        """As the size is a logarithm of what is stepped."""
        return math.exp(self.sign * size) * size * relative_error

    def find_path_sizes(self, tolerances: Iterable[float], meter: WorkMeter) -> Iterator[float]:
        """Shoot: find the step whose critical path comes from the state before it.

        A loose root and its slope come first; from there the tighter tolerances take one to three
        paths each. With several states there are no such paths.
        """
        path_at = self.path_factory(meter.engine)
        loose = self._loose_root(path_at, meter) if self.scene.state_count == 1 else None
        if loose is not None:
            yield from _refine_root(
                *loose,
                tolerances,
                lambda size, tolerance: path_at(size).start_misfit(tolerance, meter),
            )

    def path_factory(self, engine: str) -> Callable[[float], CriticalPath]:
        """Gives the critical path after a step of a size, which an engine follows."""
        return lambda size: CriticalPath.of_scene(self.scene_at(size), engine)

    def find_cycle_sizes(self, tolerances: Iterable[float], meter: WorkMeter) -> Iterator[float]:
        """Find the step whose limit cycle touches the norm, from one orbit each: the smallest after
        which that orbit stops shrinking.
        """
        found, path_at = dict[float, float](), self.path_factory(meter.engine)

        @cache
        def misfit(log_size: float, tolerance: float = LOOSE_TOLERANCE) -> float:
            higher = path_at(math.exp(log_size)).cycle_misfit(tolerance, meter)
            if higher is None:
                return math.nan
            found[log_size] = higher
            return higher

        sizes = accumulate(repeat(math.log(1.5)), initial=math.log(self.min_size))
        pairs = pairwise(takewhile(lambda log_size: log_size <= math.log(self.max_size), sizes))
        bracket = next((pair for pair in pairs if misfit(pair[0]) < 0.0 <= misfit(pair[1])), None)
        root = _find_misfit_root(misfit, found, *bracket) if bracket else None
        if root is not None:
            yield from _refine_root(
                *root, tolerances, lambda size, tolerance: misfit(math.log(size), tolerance)
            )

    def _loose_root(
        self, path_at: Callable[[float], CriticalPath], meter: WorkMeter
    ) -> tuple[float, float] | None:
        """Log size at which the loosely integrated misfit vanishes, and the slope of the misfit
        there.
        """
        found = dict[float, float]()

        @cache
        def misfit(log_size: float) -> float:
            size = math.exp(log_size)
            state = path_at(size).start_misfit(LOOSE_TOLERANCE, meter)
            if state is None:
                return self._misfit_without_path(self.scene_at(size), meter)
            found[log_size] = state
            return state

        bracket = self._bracket(misfit)
        return None if bracket is None else _find_misfit_root(misfit, found, *bracket)

    def _bracket(self, misfit: Callable[[float], float]) -> tuple[float, float] | None:
        """Two neighbouring log sizes between which the misfit changes sign, sought outwards from a
        guess: where its sign tells which way, that way first.

        A misfit of NaN (no critical path) has no sign. The search runs in logit(size/largest),
        which resolves both ends of the range.
        """

        def log_size(position: float) -> float:
            return math.log(self.max_size) - math.log1p(math.exp(-position))

        def position(size: float) -> float:
            fraction = min(max(size, self.min_size) / self.max_size, 0.5)
            return math.log(fraction / (1.0 - fraction))

        lowest, guess = position(self.min_size), position(self._guess_size())

        def outwards(*ways: int) -> tuple[float, float] | None:
            ends = dict.fromkeys(ways, (guess, misfit(log_size(guess))))
            last = {1: _MAX_POSITION, -1: lowest}
            stride, failures = 0.2, 0
            while failures < _MAX_FAILURES and any(ends[way][0] != last[way] for way in ways):
                for way, (at, value) in ends.items():
                    further = min(max(at + way * stride, lowest), _MAX_POSITION)
                    beyond = misfit(log_size(further))
                    if further != at and value * beyond <= 0.0:
                        return log_size(min(at, further)), log_size(max(at, further))
                    ends[way] = further, beyond
                failures = failures + 1 if all(math.isnan(x) for _at, x in ends.values()) else 0
                stride = min(1.5 * stride, _MAX_STRIDE)
            return None

        way = self._search_direction(misfit(log_size(guess)))
        return outwards(way) or outwards(-way) if way else outwards(1, -1)

    def _search_direction(self, misfit: float) -> int:
        """True if a misfit tells that the critical size is larger (1) or smaller (-1); 0 where it
        does not.
        """
        if self.sign != self.trigger_sign or math.isnan(misfit):
            return 0
        return int(math.copysign(1.0, misfit))

    def _guess_size(self) -> float:
        """A size to search from."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def _misfit_without_path(self, scene: Scene, meter: WorkMeter) -> float:
        """Sign of the misfit where there is no critical path: positive where the step is stable,
        NaN where that cannot be told.
        """
        return math.nan


def _find_misfit_root(
    misfit: Callable[[float], float], known_misfits: Mapping[float, float], *bracket: float
) -> tuple[float, float] | None:
    """Log size at which a misfit vanishes, and its slope there, from the misfits of paths that are
    found on the way: a mere verdict has no size. None where it has no value on the way.
    """
    try:
        brentq(misfit, *bracket, xtol=1e-4)
    except ValueError:  # of NaN
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
            misfit(beside)
    other = min(others(), key=lambda log_size: abs(log_size - root), default=None)
    return (
        None
        if other is None
        else (root, (known_misfits[root] - known_misfits[other]) / (root - other))
    )


def _refine_root(
    log_size: float,
    slope: float,
    tolerances: Iterable[float],
    misfit: Callable[[float, float], float | None],
) -> Iterator[float]:
    """Sizes at which a misfit vanishes, by one local tolerance after the other, from a loose root
    and its slope (per change of the logarithm of size), by the secant method: until what is left is
    below thirty local tolerances. None from where that leads nowhere.
    """
    if not math.isfinite(slope) or slope == 0.0:
        return
    for tolerance in tolerances:
        previous: tuple[float, float] | None = None
        for _ in range(_MAX_CORRECTIONS):
            # the error of V_0 itself is that of its logarithm times V_0
            value = misfit(math.exp(log_size), tolerance / max(1.0, math.exp(log_size)))
            if value is None or not math.isfinite(value):
                return
            if previous is not None and value != previous[1]:
                slope = (value - previous[1]) / (log_size - previous[0])
            previous = log_size, value
            log_size -= value / slope
            if abs(value) > _MAX_SLOPE_DISTANCE * abs(slope):
                return
            if min(abs(value), abs(value / slope)) < 30.0 * tolerance:
                break
        else:
            return
        yield math.exp(log_size)
