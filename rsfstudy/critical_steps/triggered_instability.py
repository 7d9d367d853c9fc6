"""Measure that tests whether the step of a scene triggers an instability."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rsfstudy.critical_steps.loading_checks import (
    build_norm_below_load_velocity_outcome,
    build_slow_instability_norm_warning,
    check_loading_is_single_step,
)
from rsfstudy.critical_steps.motion_after_step import motion_reaches_instability_norm
from rsfstudy.critical_steps.stability_after_step import is_neutrally_stable
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base import Measure, Outcome
from rsfstudy.motion import Integrator
from rsfstudy.quantities import Output
from rsfstudy.slider import Scene
from rsfstudy.status import Status


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Triggered(Measure):
    r"""Flag that is 1 if the step of a scene triggers an instability.

    The flag is 1 if the motion after the step reaches the instability norm of the scene, and 0 if
    the motion never reaches the norm. The motion is integrated until the value of the flag is
    certain. To find the smallest step that triggers an instability, use ``CriticalStep``.

    The status is ``unverified`` if the value of the flag changes when the tolerances are reduced
    tenfold. The status is also ``unverified`` if the stiffness is too close to the critical
    stiffness, that is, if the relative difference is less than ten times the requested accuracy.

    Notes
    -----
    The slip rate :math:`V` reaches the norm if :math:`V T/(2 \pi D_c)` equals ``instability_norm``,
    with the period :math:`T` of the scene. An instability norm of 5e-4 reproduces the results in
    section 4 of [1]_.

    References
    ----------
    .. [1] Effect of varying normal stress on stability and dynamic motion of a spring-slider system
       with rate- and state-dependent friction. Earthquake Science (2014).
       doi:10.1007/s11589-014-0098-4

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import Triggered
    >>> scene = Scene(normal_stress="constant", b_over_a=2.0)
    >>> for ratio in (1.5, 2.5):
    ...     stepped = scene.with_(load_velocity_ratio=ratio)
    ...     print(ratio, Triggered()(stepped, Accuracy(rtol=1e-4)).values["unstable"])
    1.5 0.0
    2.5 1.0
    """

    name: ClassVar[str] = "triggered"
    primary_output = "unstable"
    typical_rhs_evaluations = 800
    outputs = (
        Output("unstable", "", "1", "1 if the step triggers instability, otherwise 0", error=True),
    )
    needs_time: ClassVar[tuple[bool, ...]] = (False,)

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the flag from motions with two different tolerances.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status, results and message.
        """
        check_loading_is_single_step(scene)
        if max(0.0, scene.log_load_velocity) >= scene.log_slip_rate_at_instability:
            return build_norm_below_load_velocity_outcome(scene, scene.load_velocity)
        if not scene.is_perturbed:
            return Outcome(Status.OK, {"unstable": 0.0, "unstable_error": 0.0}, "there is no step")
        answer, again = (
            motion_reaches_instability_norm(scene, each)
            for each in (integrator, integrator.refined())
        )
        # If the stiffness is critical within the tolerance, growth and decay of perturbations are
        # indistinguishable.
        if answer != again or is_neutrally_stable(scene, integrator.result_tolerance(10.0)):
            return Outcome(
                Status.UNVERIFIED, message="the result depends on the tolerance. Use a smaller rtol"
            )
        values = {"unstable": float(answer), "unstable_error": 0.0}
        return Outcome(
            Status.OK, values, build_slow_instability_norm_warning(scene, scene.load_velocity)
        )
