"""Helper functions that follow the motion of a scene."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence

from rsfstudy import Scene
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.integration_events import (
    Event,
    EventKind,
    EventSpecification,
    approach_to_steady_state,
    fall,
    maximum,
    rise,
)
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.work_meter import MotionStopped

#: Event at the end of each step: a slider is always closer to steady sliding than twice its
#: largest distance so far.
STEP_END_EVENT = approach_to_steady_state(2.0)


def follow_until(
    scene: Scene,
    rtol: float,
    until: Callable[[Event], bool],
    budget: int = 2_000_000,
    watches: Sequence[EventSpecification] = (),
) -> Integrator:
    """Integrate a scene until the callback ``until`` returns True.

    The callback receives the start of the motion, the beginning of each regime, the end of
    each step, and the events requested with ``watches``. The function returns the
    integrator.
    """
    integrator = Integrator(Accuracy(rtol, budget))
    for event in integrator.follow(scene, (*watches, STEP_END_EVENT), with_time=True):
        if until(event):
            return integrator
    raise AssertionError("a motion without a time limit cannot end")


def reaches_instability_norm(scene: Scene, rtol: float = 1e-8, peaks: float = math.inf) -> bool:
    """Return True if the slip rate of a scene reaches the instability norm.

    The motion is integrated without early termination, up to a maximum number of ``peaks``
    of the slip rate.
    """
    norm, count = scene.log_slip_rate_at_instability, 0
    watches = (
        maximum("log_slip_rate"),
        rise("log_slip_rate", norm, terminal=True),
        fall("spring_stress", -scene.mu_star, terminal=True),
    )
    integrator = Integrator(Accuracy(rtol, 200_000, engine=COMPILED))
    with contextlib.suppress(MotionStopped):  # Slip may die out, or decay for ever.
        for event in integrator.follow(scene, watches):
            # The slip rate may exceed the norm and fall below it again within one step.
            if event.kind is EventKind.RISE or event.point.log_slip_rate >= norm:
                return True
            count += event.kind is EventKind.MAXIMUM
            if count == peaks:
                break
    return False


def cot_phi(scene: Scene) -> float:
    """Return the cotangent of phi, or 0 at constant normal stress."""
    return 0.0 if scene.phi is None else 1.0 / math.tan(math.radians(scene.phi))
