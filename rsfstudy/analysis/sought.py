"""Base of the kinds of steps among which a critical one is sought."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import ClassVar

import numpy as np

from rsfstudy.analysis.swing import settles
from rsfstudy.motion.meter import Meter
from rsfstudy.slider.equations import log_slip_rate_at
from rsfstudy.slider.scene import Scene

#: Smallest step the search tries, and the part of the largest that it is at most.
SMALLEST_STEP, _SMALLEST_PART = 1e-3, 0.1
#: How much farther in ln V a step may jump where mass delays the rise of slip rate.
RISE_OF_MASS = 5.0
#: Part of the accuracy asked for to which what mass delays goes unseen.
UNSEEN = 0.01
#: Sizes that are looked at where stability may come and go between them.
_SIZES_BETWEEN = 24


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
        self.largest = self._largest() * (1.0 - 1e-9)
        self.smallest = min(SMALLEST_STEP, _SMALLEST_PART * self.largest)

    def scene_at(self, size: float) -> Scene:
        """The scene with a step of this size."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def value(self, size: float) -> float:
        """The number a user knows the step by."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def error(self, size: float, relative_error: float) -> float:
        """Error of `value` where the size has this relative error."""
        raise TypeError(f"{type(self).__name__} steps nothing")

    def allowed(self, size: float, rtol: float) -> float:
        """Relative error of a size at which `value`, less what it is without a step, has this one;
        no more than that.
        """
        change = abs(self.value(size) - self.value(0.0))
        return min(rtol, rtol * change / self.error(size, 1.0))

    def values_beside(self, size: float) -> dict[str, float]:
        """The numbers named in `beside`, for a critical step of this size (NaN where there is
        none).
        """
        return {}

    def sizes_on_path(self, tolerances: Iterable[float], meter: Meter) -> Iterator[float]:
        """Size of the step that starts the critical path, by one local tolerance after the other,
        each found when it is asked for; none where there is no such path.
        """
        raise TypeError(f"{type(self).__name__} steps nothing")

    def sizes_of_cycle(self, tolerances: Iterable[float], meter: Meter) -> Iterator[float]:
        """Size of the step after which the motion ends in a limit cycle that touches the norm, by
        one local tolerance after the other; none where there is no such step.
        """
        return iter(())

    def mass_delays(self, size: float, rtol: float) -> bool:
        """True if the critical size is not that of the critical path's start, because slip rate
        takes time to rise to that after the step.
        """
        return False

    def blur(self, size: float, rtol: float) -> float:
        """Relative error of a size that motions find where sliding is neutral after the step, which
        they take it for a little on either side.
        """
        return 0.0

    def smaller_ones_decay(self, size: float) -> bool:
        """True if steady sliding is linearly stable after every smaller step.

        Where it is not, smaller steps grow, and a critical path says nothing about them. Critical
        stiffness falls with the load point velocity, so the ends of the range decide, unless the
        law has a slip rate of its own: then it may rise between them.
        """
        sizes = [self.smallest, size]
        if self.scene.parts.law.steady_states is not None:
            sizes = np.geomspace(self.smallest, size, _SIZES_BETWEEN).tolist()
        return all(settles(self.scene_at(each)) for each in sizes)

    def _largest(self) -> float:
        raise TypeError(f"{type(self).__name__} steps nothing")


def falls_behind(scene: Scene) -> tuple[float, float]:
    """Slip by which a slider with mass falls behind one without after a step, and the slip rate it
    rises to: less than (K/a) w**2 of slip, w being the norm just after the step.
    """
    rate = math.exp(log_slip_rate_at(scene, scene.spring_stress_step, 0.0))
    return scene.stiffness / scene.a * (scene.inertial_time * rate) ** 2, rate
