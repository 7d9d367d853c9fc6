"""One time for a motion whose regimes have times of their own."""

from __future__ import annotations

import math
from collections.abc import Iterator

from scipy.optimize import brentq

from rsfstudy.motion.stepping import Step, retaken
from rsfstudy.slider.equations import IN_RUPTURE
from rsfstudy.slider.scene import Scene

#: How often the clock at which a step is to end is looked for.
CORRECTIONS = 2


def timed(scene: Scene, moving: Iterator[Step]) -> Iterator[tuple[Step, float]]:
    """Steps of a motion, each with the time at which its regime began; NaN without a clock."""
    begin = latest = 0.0
    equations = None
    for step in moving:
        if step.equations is not equations:
            equations, begin = step.equations, latest
        yield step, begin
        latest = begin + elapsed(scene, step, step.end)


def elapsed(scene: Scene, step: Step, clock: float) -> float:
    """Time in D_c/V_* since the regime of a step began; NaN where nothing tells it."""
    if step.equations.unknowns[-1] != "time":
        return math.nan
    return float(step.state_at(clock)[-1]) * _unit(scene, step)


def _unit(scene: Scene, step: Step) -> float:
    """What the time that a step carries along is measured in, over D_c/V_*."""
    return scene.inertial_time if step.equations.regime == IN_RUPTURE else 1.0


def ended(scene: Scene, step: Step, time: float, tolerance: float) -> Step:
    """The part of a step that ends this long after its regime began; all of it at the most.

    Dense output tells the clock at which to end. Where stability limits steps it is far less
    accurate than their ends: the part is integrated anew, and again with what time it was missing.
    """
    clock = _moment_in(scene, step, time)
    for _ in range(CORRECTIONS):
        part = retaken(step, clock, tolerance)
        pace = step.equations.rates(tuple(part.state.tolist()))[-1] * _unit(scene, step)
        clock -= (elapsed(scene, part, clock) - time) / pace
    return part


def _moment_in(scene: Scene, step: Step, time: float) -> float:
    """Clock at which a step is this long after its regime began; its end at the latest."""
    if elapsed(scene, step, step.end) <= time:
        return step.end
    finest = 1e-15 * abs(step.end - step.start)
    clock = brentq(
        lambda c: elapsed(scene, step, c) - time, step.start, step.end, xtol=finest, rtol=1e-15
    )
    return float(clock)
