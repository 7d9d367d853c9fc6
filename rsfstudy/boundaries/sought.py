"""The steps among which a critical one is sought: of load point velocity, of load point
displacement, or of normal stress.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import ClassVar

from scipy.optimize import brentq

from rsfstudy.boundaries.swing import orbits_may_close, stability_margin, swing
from rsfstudy.boundaries.touching import cycle_misfit, displacement_on_path, rate_step_misfit
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.regimes import on_slow_manifold
from rsfstudy.motion.stepping import Halt, Meter
from rsfstudy.slider import steady
from rsfstudy.slider.closed_forms import effective_friction
from rsfstudy.slider.equations import log_rate_at, resting_of
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Smallest step the search tries, and slowest load point velocity over V_* it goes down to.
SMALLEST_STEP = 1e-3
SLOWEST_LOAD = 1e-20
_LOOSE = 1e-5
#: Distance in log size over which the slope of the misfit is taken.
_NEAR = 3e-3
_MOST_CORRECTIONS = 8
#: Longest stride, and end, of the search for a sign change in logit(size/largest).
_LONGEST_STRIDE, _HIGHEST = 0.7, 4.0
#: Strides without a critical path on either side after which shooting is given up.
_GIVE_UP = 3
#: How much farther in ln V a displacement step may jump where mass delays the rise of slip rate.
_RISE_OF_MASS = 5.0
#: b/a - 1 that is guessed from at least: some laws weaken without it.
_LEAST_WEAKENING = 1e-6
#: Spring stress over sigma_* that no displacement step goes beyond.
_LARGEST_STRESS = 1e6
#: Part of the accuracy asked for to which what mass delays goes unseen.
_UNSEEN = 0.01
#: |ln(sigma/sigma_*)| that no step of normal stress goes beyond.
_LARGEST_CHANGE = math.log(1e3)
#: Part of the largest step to which it is found.
_CLOSE_ENOUGH = 1e-6
#: Effective friction over mu_* that is guessed from at least: the state may take all of it.
_LEAST_FRICTION = 0.1


class Steps:
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
    smallest, largest : float
        Sizes the search covers; there is none to search where the loading alone reaches the norm.
    """

    #: Name of the critical value in results.
    quantity: ClassVar[str]
    #: What else is told of a critical step.
    beside: ClassVar[tuple[str, ...]] = ()
    #: Whether the largest step takes the slip rate to the norm by itself, at once.
    jumps_to_norm = False

    def __init__(self, scene: Scene, sign: int) -> None:
        self.scene, self.sign = scene, sign
        self.smallest = SMALLEST_STEP
        self.largest = self._largest() * (1.0 - 1e-9)

    def scene_at(self, size: float) -> Scene:
        """The scene with a step of this size."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def value(self, size: float) -> float:
        """The number a user knows the step by."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def error(self, size: float, relative_error: float) -> float:
        """Error of `value` where the size has this relative error."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def values_beside(self, size: float) -> dict[str, float]:
        """The numbers named in `beside`, for a critical step of this size (NaN where there is
        none).
        """
        return {}

    def sizes_on_path(self, tolerances: Sequence[float], meter: Meter) -> list[float] | None:
        """Size of the step that starts the critical path, by each local tolerance; None where there
        is no such path.
        """
        raise TypeError(f"{type(self).__name__} steps nothing")

    def sizes_of_cycle(self, tolerances: Sequence[float], meter: Meter) -> list[float] | None:
        """Size of the step after which the motion ends in a limit cycle that touches the norm, by
        each local tolerance; None where there is none.
        """
        return None

    def mass_delays(self, size: float, rtol: float) -> bool:
        """Whether the critical size is not that of the critical path's start, because slip rate
        takes time to rise to that after the step.
        """
        return False

    def blur(self, size: float, rtol: float) -> float:
        """Relative error of a size that motions find where sliding is neutral after the step, which
        they take it for a little on either side.
        """
        return 0.0

    def _largest(self) -> float:
        raise TypeError(f"{type(self).__name__} steps nothing")


class ShotSteps(Steps):
    """Steps after which the critical path is another for each size, so that the right one is shot
    for: those that change what friction balances, or what moves the spring.
    """

    def sizes_on_path(self, tolerances: Sequence[float], meter: Meter) -> list[float] | None:
        """Shoot: find the step whose critical path comes from the state before it.

        A loose root and its slope come first; from there the tighter tolerances take one to three
        paths each. With several states there are no such paths.
        """
        if self.scene.states > 1:
            return None
        loose = self._loose_root(meter)
        if loose is None:
            return None
        return _refined(
            *loose,
            tolerances,
            lambda size, tolerance: rate_step_misfit(self.scene_at(size), tolerance, meter),
        )

    def sizes_of_cycle(self, tolerances: Sequence[float], meter: Meter) -> list[float] | None:
        """Find the step whose limit cycle touches the norm, from one orbit each: the smallest after
        which that orbit stops shrinking.
        """

        def misfit(log_size: float, tolerance: float = _LOOSE) -> float:
            higher = cycle_misfit(self.scene_at(math.exp(log_size)), tolerance, meter)
            return math.nan if higher is None else higher

        stride = math.log(1.5)
        smaller, larger = math.log(self.smallest), math.log(self.smallest) + stride
        before = misfit(smaller)
        while larger <= math.log(self.largest):
            now = misfit(larger)
            if before < 0.0 <= now:
                found = _root(misfit, smaller, larger)
                return found and _refined(
                    *found, tolerances, lambda size, tolerance: misfit(math.log(size), tolerance)
                )
            smaller, larger, before = larger, larger + stride, now
        return None

    def _loose_root(self, meter: Meter) -> tuple[float, float] | None:
        """Log size at which the loosely integrated misfit vanishes, and the slope of the misfit
        there.
        """

        def misfit(log_size: float) -> float:
            scene = self.scene_at(math.exp(log_size))
            state = rate_step_misfit(scene, _LOOSE, meter)
            return self._verdict(scene, meter) if state is None else state

        bracket = self._bracket(misfit)
        return None if bracket is None else _root(misfit, *bracket)

    def _bracket(self, misfit: Callable[[float], float]) -> tuple[float, float] | None:
        """Two neighbouring log sizes between which the misfit changes sign, sought outwards from a
        guess.

        A misfit of NaN (no critical path) has no sign. The search runs in logit(size/largest),
        which resolves both ends of the range.
        """

        def log_size(position: float) -> float:
            return math.log(self.largest) - math.log1p(math.exp(-position))

        def position(size: float) -> float:
            share = min(max(size, self.smallest) / self.largest, 0.5)
            return math.log(share / (1.0 - share))

        lowest, highest = position(self.smallest), _HIGHEST
        left = right = position(self._guess())
        at_left = at_right = misfit(log_size(left))
        stride, missing = 0.2, 0
        while (left > lowest or right < highest) and missing < _GIVE_UP:
            if right < highest:
                further = min(right + stride, highest)
                value = misfit(log_size(further))
                if at_right * value <= 0.0:
                    return log_size(right), log_size(further)
                right, at_right = further, value
            if left > lowest:
                further = max(left - stride, lowest)
                value = misfit(log_size(further))
                if at_left * value <= 0.0:
                    return log_size(further), log_size(left)
                left, at_left = further, value
            missing = missing + 1 if math.isnan(at_left) and math.isnan(at_right) else 0
            stride = min(1.5 * stride, _LONGEST_STRIDE)
        return None

    def _guess(self) -> float:
        """A size to search from."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def _verdict(self, scene: Scene, meter: Meter) -> float:
        """Sign of the misfit where there is no critical path: positive where the step is stable,
        NaN where that cannot be told.
        """
        return math.nan


class RateSteps(ShotSteps):
    """Steps of load point velocity; the size is |ln(V_0/V_*)|."""

    quantity = "critical_velocity_ratio"

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(load_velocity_ratio=self.value(size))

    def value(self, size: float) -> float:
        return math.exp(self.sign * size)

    def error(self, size: float, relative_error: float) -> float:
        return math.exp(self.sign * size) * size * relative_error

    def _guess(self) -> float:
        """Of the size of the closed forms for the slip law (Gu et al. 1984)."""
        weakening = max(self.scene.parts.law.b_over_a - 1.0, _LEAST_WEAKENING)
        return math.log1p(math.exp(self.scene.stiffness_ratio - 1.0) / weakening)

    def _verdict(self, scene: Scene, meter: Meter) -> float:
        """Far from the boundary an upward step still has a verdict."""
        if self.sign < 0:
            return math.nan
        return -1.0 if swing(scene, Accuracy(_LOOSE), meter).reached else 1.0

    def _largest(self) -> float:
        """Up: V_0 at the norm itself. Down: the slowest V_0 that has a steady state."""
        if self.sign > 0:
            return self.scene.log_norm_rate
        scene, slowest = self.scene, steady.slowest_steady(self.scene)
        return min(-math.log(SLOWEST_LOAD), -slowest) if scene.log_norm_rate > 0.0 else 0.0


class DisplacementSteps(Steps):
    """Steps of load point displacement; the size is |d| in D_c. The load point is then held, unless
    the scene moves it.
    """

    quantity = "critical_displacement"
    beside = ("slip_rate_after_step", "slip_rate_after_closed_form_step")

    def __init__(self, scene: Scene, sign: int) -> None:
        if scene.load_velocity_ratio is None:
            scene = scene.with_(load_velocity_ratio=0.0)
        super().__init__(scene, sign)

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(displacement_step=self.value(size))

    def value(self, size: float) -> float:
        return self.sign * size

    def error(self, size: float, relative_error: float) -> float:
        return size * relative_error

    def mass_delays(self, size: float, rtol: float) -> bool:
        """The slider falls behind on the same path, but for what the load point moves meanwhile,
        and for half of b times that slip, which the state misses because slip rate is lower.
        """
        scene = self.scene_at(size)
        if not scene.has_mass:
            return False
        behind, rate = _falls_behind(scene)
        missed = 0.5 * scene.a * scene.parts.law.size_over_a / scene.stiffness
        return behind * (scene.load_velocity / rate + missed) > _UNSEEN * rtol * size

    def values_beside(self, size: float) -> dict[str, float]:
        """Slip rates just after the critical step, and after one of D_c a/(b-a) (eq. 13)."""

        def after(step: float) -> float:
            return math.exp(log_rate_at(self.scene, self.scene.stiffness * step, 0.0))

        weakening = self.scene.parts.law.b_over_a - 1.0
        closed_form = after(self.sign / weakening) if weakening > 0.0 else math.nan
        critical = math.nan if math.isnan(size) else after(self.value(size))
        return dict(zip(self.beside, (critical, closed_form), strict=True))

    def sizes_on_path(self, tolerances: Sequence[float], meter: Meter) -> list[float] | None:
        """One integration each: a displacement step starts wherever the critical path has Psi =
        0.
        """
        sizes = []
        for tolerance in tolerances:
            step = displacement_on_path(self.scene, tolerance, meter, self.sign)
            if step is None:
                return None
            sizes.append(abs(step))
        return sizes

    def _largest(self) -> float:
        """Up: the step that itself takes the slip rate to the norm, and somewhat farther with mass,
        because slip rate rises to that while stress relaxes. Down: the step that ends shear stress.
        """
        scene = self.scene
        if max(0.0, scene.log_load_rate) >= scene.log_norm_rate:
            return 0.0
        if self.sign < 0:
            weakest = scene.parts.normal_stress.weakest(scene)
            return min(scene.mu_star, -weakest) / scene.stiffness
        farther = _RISE_OF_MASS if scene.has_mass else 0.0
        friction = steady.stress_after_jump(scene, scene.a * (scene.log_norm_rate + farther))
        if friction is None:
            return _LARGEST_STRESS / scene.stiffness
        self.jumps_to_norm = True
        return (friction + scene.dynamics.radiated(scene.log_norm_rate)) / scene.stiffness


class NormalStressSteps(ShotSteps):
    """Steps of imposed normal stress; the size is |ln(1 + step/sigma_*)|. The load point is then
    held, unless the scene moves it.

    Friction after the step is that of other normal stress, and so is the critical path.
    """

    quantity = "critical_normal_stress_step"
    beside = ("slip_rate_after_step",)

    def __init__(self, scene: Scene, sign: int) -> None:
        held = 0.0 if scene.load_velocity_ratio is None else scene.load_velocity_ratio
        scene = scene.with_(load_velocity_ratio=held, normal_stress_step=0.0)
        # a slider whose normal stress nothing can change says so here
        scene.with_(normal_stress_step=sign * SMALLEST_STEP)
        super().__init__(scene, sign)
        # what such a step does to ln V is larger by mu_*/a
        self.smallest = SMALLEST_STEP * min(1.0, scene.a / scene.mu_star)

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(normal_stress_step=self.value(size))

    def value(self, size: float) -> float:
        return math.expm1(self.sign * size)

    def error(self, size: float, relative_error: float) -> float:
        return math.exp(self.sign * size) * size * relative_error

    def mass_delays(self, size: float, rtol: float) -> bool:
        """The slider falls behind while slip rate rises; by how much of the size is a matter of
        what slip rate the step leads to.
        """
        scene = self.scene_at(size)
        behind = _falls_behind(scene)[0] if scene.has_mass else 0.0
        missed = max(1.0, 0.5 * scene.parts.law.size_over_a) * behind
        return missed > _UNSEEN * rtol * size * scene.mu_star / scene.a

    def blur(self, size: float, rtol: float) -> float:
        """Critical stiffness goes with normal stress, and its logarithm with the size."""
        scene = self.scene_at(size)
        near = orbits_may_close(scene) and abs(stability_margin(scene)) < 10.0 * rtol
        return 2.0 * rtol / size if near else 0.0

    def values_beside(self, size: float) -> dict[str, float]:
        """Slip rate just after the critical step."""
        rate = math.nan if math.isnan(size) else math.exp(self._log_rate_after(size))
        return dict(zip(self.beside, (rate,), strict=True))

    def _guess(self) -> float:
        """A Coulomb stress change that takes the slip law to its threshold; a rise to where sliding
        comes to be unstable.
        """
        scene, law = self.scene, self.scene.parts.law
        if self.sign > 0 and 1.0 < scene.stiffness_ratio < math.inf:
            return math.log(scene.stiffness_ratio)
        _follows, alpha = scene.parts.normal_stress.coupling or (0.0, 0.0)
        friction = effective_friction(scene.mu_star, max(law.b_over_a, 1.0), alpha)
        friction = max(abs(friction), _LEAST_FRICTION * scene.mu_star)
        return scene.a * scene.stiffness_ratio / friction

    def _verdict(self, scene: Scene, meter: Meter) -> float:
        """Far from the boundary a fall still has a verdict, unless its motion cannot go on."""
        if self.sign > 0:
            return math.nan
        try:
            return -1.0 if swing(scene, Accuracy(_LOOSE), meter).reached else 1.0
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
            return math.nan

    def _largest(self) -> float:
        """The step that itself takes the slip rate to the norm, and somewhat farther with mass; a
        rise does so only where it takes more from the state than it gives to friction. Under a load
        point that moves, the last after which there is steady sliding.
        """
        scene = self.scene
        if max(0.0, scene.log_load_rate) >= scene.log_norm_rate:
            return 0.0
        level = scene.log_norm_rate + (_RISE_OF_MASS if scene.has_mass else 0.0)

        def excess(size: float) -> float:
            return self._log_rate_after(size) - level

        if excess(0.0) >= 0.0:
            return 0.0
        largest = _LARGEST_CHANGE
        if excess(largest) > 0.0:
            self.jumps_to_norm = True
            largest = float(brentq(excess, 0.0, largest, xtol=1e-15, rtol=1e-14))
        if self._may_slide(largest):
            return largest
        self.jumps_to_norm, smaller = False, 0.0
        while largest - smaller > _CLOSE_ENOUGH * largest:
            middle = 0.5 * (smaller + largest)
            smaller, largest = (middle, largest) if self._may_slide(middle) else (smaller, middle)
        return smaller

    def _may_slide(self, size: float) -> bool:
        """Whether sliding can be steady after a step, or needs not because the load point rests."""
        scene = self.scene_at(size)
        load = scene.log_load_rate
        return load == -math.inf or steady.steady_sliding(scene, load) is not None

    def _log_rate_after(self, size: float) -> float:
        """ln(V/V_*) just after a step, without mass."""
        scene = self.scene_at(size).without_mass()
        resting = resting_of(scene, 0.0, 0.0)
        return on_slow_manifold(scene, scene.spring_stress_step, resting).log_rate


def _falls_behind(scene: Scene) -> tuple[float, float]:
    """Slip by which a slider with mass falls behind one without after a step, and the slip rate it
    rises to: less than (K/a) w**2 of slip, w being the norm just after the step.
    """
    rate = math.exp(log_rate_at(scene, scene.spring_stress_step, 0.0))
    return scene.stiffness / scene.a * (scene.inertial_time * rate) ** 2, rate


def _root(misfit: Callable[[float], float], *bracket: float) -> tuple[float, float] | None:
    """Log size at which a misfit vanishes, and its slope there; None where it has no value on the
    way.
    """
    try:
        root = float(brentq(misfit, *bracket, xtol=1e-4))
    except ValueError:  # of NaN
        return None
    return root, (misfit(root + _NEAR) - misfit(root - _NEAR)) / (2.0 * _NEAR)


def _refined(
    log_size: float,
    slope: float,
    tolerances: Sequence[float],
    misfit: Callable[[float, float], float | None],
) -> list[float] | None:
    """Sizes at which a misfit vanishes, by each local tolerance, from a loose root and its slope,
    by the secant method; None where it leads nowhere.
    """
    if not math.isfinite(slope) or slope == 0.0:
        return None
    sizes = []
    for tolerance in tolerances:
        before: tuple[float, float] | None = None
        for _ in range(_MOST_CORRECTIONS):
            # the error of V_0 itself is that of its logarithm times V_0
            value = misfit(math.exp(log_size), tolerance / max(1.0, math.exp(log_size)))
            if value is None or not math.isfinite(value):
                return None
            if before is not None and value != before[1]:
                slope = (value - before[1]) / (log_size - before[0])
            before = log_size, value
            log_size -= value / slope
            if min(abs(value), abs(value / slope)) < 30.0 * tolerance:
                break
        else:
            return None
        sizes.append(math.exp(log_size))
    return sizes
