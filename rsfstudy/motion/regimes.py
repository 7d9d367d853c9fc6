"""The motion of a scene after its step: quasi-static where mass does not act, inertial only where
it does.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.stepping import Halt, Meter, Step, steps
from rsfstudy.slider.equations import (
    Equations,
    between_ruptures,
    in_rupture,
    resting_of,
    without_mass,
)
from rsfstudy.slider.forms import SLOWEST, Point
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.slots import LARGEST_EXPONENT
from rsfstudy.status import Status

#: Normal stress over sigma_* at which the fault counts as open, and as locked.
LOST, LOCKED = 1e-9, 1e6
#: ln(V/V_*) beyond which slip without mass counts as unbounded: 10^120 V_*.
UNBOUNDED = 120.0 * math.log(10.0)


def motion(
    scene: Scene,
    accuracy: Accuracy,
    meter: Meter,
    start: Point,
    *,
    clock: bool = False,
) -> Iterator[Step]:
    """Integrate a scene from a point, step by step, for as long as the caller asks.

    A scene without inertia is one quasi-static integration. With inertia, the slow manifold is
    followed up to `Accuracy.switch_norm`, the full equations above it; each stretch has a clock of
    its own that starts at zero, because a rupture is shorter than the spacing of floating-point
    numbers around the time at which it happens.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    meter : Meter
        Charged with the work, by regime.
    start : Point
        Where to start; see `starting` and `on_slow_manifold`.
    clock : bool
        Carry time along in the quasi-static stretches (the inertial clock is time).

    Yields
    ------
    Step

    Raises
    ------
    Halt
        With `normal_stress_lost`, `shear_stress_reversed`, `locked` or `slip_rate_unbounded` where
        the equations end, or as `steps` does.
    """
    if not scene.has_mass:
        equations, state = without_mass(scene, clock=clock), _unknowns(start, clock)
        yield from _guarded(scene, steps(equations, state, accuracy.solver, meter))
        return
    slow, fast = between_ruptures(scene, clock=clock), in_rupture(scene)
    handover = _Handover(scene, slow, accuracy)
    point = handover.slow_point(start)
    rises = handover.slip_of_rise(start, point) > accuracy.landing
    slow_start = max(handover.weight_of_mass(point), handover.weight_of_rate(start)) < 1.0
    if slow_start and not rises:
        point = yield from _climb(scene, slow, point, handover, accuracy, meter, clock)
    else:
        point = start
    while True:
        point = yield from _rupture(scene, fast, point, handover, accuracy, meter)
        point = yield from _climb(scene, slow, point, handover, accuracy, meter, clock)


def starting(scene: Scene) -> Point:
    """Steady sliding at V_* the instant after the step of a scene, which moves the spring alone:
    slip rate and friction follow within the inertial time.

    Raises
    ------
    Halt
        Where the step leaves no friction of forward slip to integrate.
    """
    check_start(scene)
    stepped = on_slow_manifold(scene, scene.spring_stress_step, resting_of(scene, 0.0, 0.0))
    if not scene.has_mass:
        return stepped
    return stepped._replace(log_rate=0.0, friction=0.0)


def on_slow_manifold(scene: Scene, spring: float, psis: Numbers) -> Point:
    """The point with this spring stress and these states, where mass hardly acts."""
    return between_ruptures(scene, clock=False).at((spring, *psis))


@dataclass(frozen=True)
class _Handover:
    """When to change between the slow manifold and the full equations."""

    scene: Scene
    slow: Equations
    accuracy: Accuracy

    @property
    def switch_norm(self) -> float:
        """Slip rate norm at which to leave the slow manifold, which is a series in (K/a) w**2."""
        softness = min(1.0, self.scene.stiffness / self.scene.a)
        return self.accuracy.switch_norm / math.sqrt(softness)

    def slow_point(self, point: Point) -> Point:
        """The point of the slow manifold with the same spring stress and states."""
        state = (point.spring, *point.psis)
        below: Point = self.slow.point(state, (0.0,) * len(state), self.slow.p)
        return below

    def weight_of_mass(self, point: Point) -> float:
        """How much mass matters: 1 where the slow manifold has to be left."""
        correction = abs(point.spring - point.friction) / self.scene.a
        return max(self.weight_of_rate(point), correction / self.accuracy.switch_correction)

    def weight_of_rate(self, point: Point) -> float:
        """The same by slip rate alone."""
        return self._norm(point) / self.switch_norm

    def slip_of_rise(self, start: Point, point: Point) -> float:
        """Slip in D_c, times the change of ln V, while slip rate rises to a point after a step;
        left out, the state would miss the evolution of that slip.
        """
        rise = abs(point.log_rate - start.log_rate)
        norm = max(self._norm(point), self._norm(start))
        return self.scene.stiffness / self.scene.a * norm**2 * rise

    def _norm(self, point: Point) -> float:
        return self.scene.inertial_time * math.exp(min(point.log_rate, LARGEST_EXPONENT))

    def landed(self, point: Point) -> bool:
        """Whether the full equations have done their work.

        The slip rate still has to go from ln V = x to the slow manifold's x_s, over a slip of about
        (K/2a) w**2 min(1, |x - x_s|) D_c at the faster of the two; the state may change that much
        unnoticed. And the slow manifold must not hand straight back.
        """
        below = self.slow_point(point)
        if point.growth > 0.0 and point.log_rate > below.log_rate + 1.0:
            return False
        norm = max(self._norm(point), self._norm(below))
        distance = min(1.0, abs(point.log_rate - below.log_rate))
        remaining = 0.5 * self.scene.stiffness / self.scene.a * norm**2 * distance
        settled = max(norm / self.switch_norm, self.weight_of_mass(below)) < 0.5
        return settled and remaining < self.accuracy.landing


def mass_acts(scene: Scene, accuracy: Accuracy) -> bool:
    """Whether mass matters up to the instability norm, beyond what the slow manifold holds of
    it.
    """
    return scene.has_mass and error_of_slow_manifold(scene) > 0.1 * accuracy.rtol


def error_of_slow_manifold(scene: Scene) -> float:
    """Relative error of a boundary computed on the slow manifold up to the norm w of a scene:
    ``3 [(K/a) w**2]**2``.

    Mass moves a boundary in proportion to (K/a) w**2, by up to 0.8 of it where the norm is a slip
    rate of a few V_*; the slow manifold leaves up to 0.9 of its square (the tests measure it).
    """
    return 3.0 * (scene.stiffness / scene.a * scene.instability_norm**2) ** 2


def check_start(scene: Scene, start: Point | None = None) -> None:
    """Refuse a displacement step that leaves no friction of forward slip to integrate; it starts
    from steady sliding at V_*, or leads to a point.
    """
    spring = scene.spring_stress_step if start is None else start.spring
    if spring <= scene.parts.normal_stress.weakest(scene):
        raise Halt(Status.NORMAL_STRESS_LOST, "the step takes normal stress away")
    if scene.mu_star + spring <= 0.0:
        raise Halt(
            Status.SHEAR_STRESS_REVERSED,
            f"the step takes shear stress to {scene.mu_star + spring:.3g} sigma_*",
        )


def _unknowns(start: Point, clock: bool) -> Numbers:
    return (start.spring, *start.psis, 0.0) if clock else (start.spring, *start.psis)


def _climb(
    scene: Scene,
    slow: Equations,
    start: Point,
    handover: _Handover,
    accuracy: Accuracy,
    meter: Meter,
    clock: bool,
) -> Generator[Step, None, Point]:
    """The slow manifold, until slip is fast enough for mass to act; returns the last point."""

    def excess(point: Point) -> float:
        return handover.weight_of_mass(point) - 1.0

    state = _unknowns(start, clock)
    for step in _guarded(scene, steps(slow, state, accuracy.solver, meter)):
        if excess(step.after) >= 0.0 > excess(step.before):
            step = step.until(step.locate(excess))
            yield step
            return step.after
        yield step
    raise AssertionError("steps() never ends by itself")


def _rupture(
    scene: Scene,
    fast: Equations,
    start: Point,
    handover: _Handover,
    accuracy: Accuracy,
    meter: Meter,
) -> Generator[Step, None, Point]:
    """The full equations, until mass no longer matters; returns the last point."""
    state = (start.spring, start.log_rate, start.friction, *start.psis[1:])
    for step in _guarded(scene, steps(fast, state, accuracy.solver, meter)):
        yield step
        if handover.landed(step.after):
            return step.after
    raise AssertionError("steps() never ends by itself")


def _guarded(scene: Scene, moving: Iterator[Step]) -> Iterator[Step]:
    """Pass steps on until normal stress vanishes, or normal stress or slip rate grow without bound.

    Shear stress may reverse in the overshoot of a rupture; the equations go through that unharmed.
    """
    for step in moving:
        ratio = step.after.normal_stress
        if ratio <= LOST:
            raise Halt(Status.NORMAL_STRESS_LOST, "normal stress vanished during the motion")
        if ratio >= LOCKED:
            raise Halt(Status.LOCKED, f"normal stress grew to {ratio:.3g} sigma_* and goes on")
        if step.after.log_rate <= SLOWEST and scene.load_velocity == 0.0:
            raise Halt(Status.SLIP_STOPPED, "the slip rate fell below 10^-290 V_*")
        if step.after.log_rate >= UNBOUNDED:
            raise Halt(Status.SLIP_RATE_UNBOUNDED, "slip rate grew beyond 10^120 V_* without mass")
        yield step
