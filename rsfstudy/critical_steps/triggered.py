"""True if the step of a scene triggers instability: yes or no."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rsfstudy.critical_steps.forward_motion import is_neutral, reaches_norm
from rsfstudy.critical_steps.loading_checks import (
    check_single_step,
    norm_below_loading_outcome,
    slow_norm_warning,
)
from rsfstudy.error_boundary import guard_methods
from rsfstudy.measure_base import Measure, Outcome
from rsfstudy.motion import Accuracy, WorkMeter
from rsfstudy.quantities import Output
from rsfstudy.slider import Scene
from rsfstudy.status import Status


@guard_methods
@dataclass(frozen=True)
class Triggered(Measure):
    """1 where the motion after the step reaches the instability norm of the scene, a slip rate over
    2 pi D_c/T, and 0 where it never does.

    The motion is followed until it has reached the norm, or it is certain that it will not. The
    measure `critical_step` seeks the smallest step that does. `unverified` where ten times smaller
    tolerances give the other answer, or where stiffness is critical to within ten times the
    accuracy.

    References
    ----------
    Section 4 of doi:10.1007/s11589-014-0098-4, whose numbers come out with a norm of 5e-4.
    """

    name: ClassVar[str] = "triggered"
    primary_output = "unstable"
    typical_work = 800
    outputs = (Output("unstable", "", "1", "whether the step triggers instability", error=True),)
    needs_time: ClassVar[tuple[bool, ...]] = (False,)

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """The answer, from motions followed at two tolerances until each is certain."""
        check_single_step(scene)
        if max(0.0, scene.log_load_velocity) >= scene.log_instability_rate:
            return norm_below_loading_outcome(scene, scene.load_velocity)
        if not scene.is_perturbed:
            return Outcome(Status.OK, {"unstable": 0.0, "unstable_error": 0.0}, "there is no step")
        accuracies = accuracy, accuracy.refined()
        answer, again = (reaches_norm(scene, asked, meter) for asked in accuracies)
        # closer to critical stiffness than the tolerance, growth and decay cannot be told apart
        if answer != again or is_neutral(scene, 10.0 * accuracy.rtol):
            return Outcome(
                Status.UNVERIFIED, message="the tolerance decides: ask for a smaller rtol"
            )
        values = {"unstable": float(answer), "unstable_error": 0.0}
        return Outcome(Status.OK, values, slow_norm_warning(scene, scene.load_velocity))
