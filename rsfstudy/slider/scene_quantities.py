"""Quantities computed from the fields of a scene."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.fluid import Fluid
from rsfstudy.slider.fluid._boundary_pressure import FluidWithBoundaryPressure
from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.noise import Noise
from rsfstudy.slider.scene_base import SceneBase
from rsfstudy.slider.scene_caching import cached_attribute


@make_methods_raise_rsfstudy_errors
class SceneQuantities(SceneBase):
    """Base class of scenes, with properties that are computed from the fields.

    The critical stiffness is a property of the subclass `Scene`, because a scene has to be created
    to compute it.
    """

    if TYPE_CHECKING:

        @property
        def critical_stiffness(self) -> float:
            """Critical stiffness at V_*."""

    @cached_attribute
    def _loading_segments(self) -> tuple[Segment, ...]:
        """Segments of the loading."""
        return self.parts.loading.segments

    @property
    def dynamics(self) -> Dynamics:
        """Part that defines the dynamics."""
        return self.parts.dynamics

    @property
    def stress_imposing_part(self) -> Loading | Noise:
        """Part whose unknowns impose stress.

        If the noise changes normal stress, the property returns the noise. Otherwise, the property
        returns the loading.
        """
        return self.parts.loading_noise if self.parts.loading_noise.unknowns else self.parts.loading

    @property
    def changes_normal_stress(self) -> bool:
        """True if the loading or the noise changes normal stress."""
        return (
            self.parts.loading.changes_normal_stress
            or self.parts.loading_noise.changes_normal_stress
        )

    @cached_attribute
    def part_changing_effective_stress(self) -> Fluid | Loading | Noise | FluidWithBoundaryPressure:
        """Part whose unknowns change the effective normal stress.

        If the stress-imposing part (the loading or the noise) has no unknowns, the property returns
        the fluid. If only the stress-imposing part has unknowns, the property returns this part. If
        the fluid also has unknowns, the property returns a combination of both parts, in which the
        stress-imposing part imposes the pressure around the fault.
        """
        imposed, pores = self.stress_imposing_part, self.parts.fluid
        if not imposed.unknowns:
            return pores
        return FluidWithBoundaryPressure(imposed, pores) if pores.unknowns else imposed

    @property
    def has_mass(self) -> bool:
        """True if the equations of motion in ruptures include inertia."""
        return self.parts.dynamics.build_rate_function_for_ruptures is not None

    @cached_attribute
    def state_count(self) -> int:
        """Total number of states of the scene.

        The total includes the states of the law, the temperature if it changes, and the unknowns of
        the loading and of the fluid.
        """
        of_law, heat = self.parts.law.state_count, len(self.parts.temperature.unknowns)
        return of_law + heat + len(self.part_changing_effective_stress.unknowns)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the scene."""
        return tuple(effect for part in self.parts for effect in part.effects)

    @cached_attribute
    def a(self) -> float:
        """Direct effect parameter."""
        return self.parts.slider_parameters.a

    @cached_attribute
    def b(self) -> float:
        """Sum of the evolution effect parameters of all states of the law."""
        return float(self.parts.slider_parameters.a * self.parts.law.b_over_a)

    @property
    def stiffness(self) -> float:
        """Dimensionless stiffness K, in units of sigma_*/D_c."""
        given = self.parts.slider_parameters.stiffness
        return float(given) if given is not None else self._stiffness_from_ratio

    @cached_attribute
    def _stiffness_from_ratio(self) -> float:
        """Dimensionless stiffness, computed from the stiffness ratio."""
        ratio = self.parts.slider_parameters.stiffness_ratio
        assert ratio is not None  # The slider has either a stiffness or a stiffness ratio.
        if not 0.0 < self.critical_stiffness < math.inf:
            rule = (
                "cannot be used, because the critical stiffness at V_* is "
                f"{self.critical_stiffness:g}"
            )
            raise InvalidValue(
                "stiffness_ratio", ratio, rule, remedy="Pass stiffness instead of stiffness_ratio."
            )
        stiffness = float(ratio * self.critical_stiffness)
        if not stiffness > 0.0:
            rule = "is so small that the stiffness is rounded to 0"
            raise InvalidValue("stiffness_ratio", ratio, rule, remedy="Choose a larger ratio.")
        return stiffness

    @property
    def stiffness_ratio(self) -> float:
        """Ratio of the stiffness to the critical stiffness at V_*.

        The critical stiffness is ``Scene.critical_stiffness``, which does not include inertia or
        radiation damping. If the law is not rate weakening, steady sliding is stable at every
        stiffness, and the ratio is infinite. If the law has several states, steady sliding may be
        unstable only in a range of stiffness. In this case, a ratio below 1 does not imply that
        steady sliding is unstable.
        """
        given = self.parts.slider_parameters.stiffness_ratio
        if given is not None:
            return float(given)
        return self.stiffness / self.critical_stiffness if self.critical_stiffness else math.inf

    @cached_attribute
    def load_velocity(self) -> float:
        """Load point velocity after the last loading step, in V_*."""
        return self._loading_segments[-1].load_velocity

    @cached_attribute
    def log_load_velocity(self) -> float:
        """Natural logarithm of the magnitude of the load point velocity in units of V_*.

        The value is negative infinity if the load point does not move.
        """
        return math.log(abs(self.load_velocity)) if self.load_velocity else -math.inf

    @cached_attribute
    def imposed_normal_stress(self) -> float:
        """Change in imposed normal stress from the start to the last segment, in sigma_*."""
        return self._loading_segments[-1].normal_stress

    @property
    def spring_stress_step(self) -> float:
        r"""Change in spring stress due to the first displacement step.

        The change in spring stress is in units of :math:`\sigma_*`.
        """
        return self.stiffness * self._loading_segments[0].displacement

    @property
    def is_perturbed(self) -> bool:
        """True if the motion deviates from steady sliding at V_*."""
        loaded = self.parts.loading.perturbs_steady_sliding or self.parts.loading_noise.is_active
        return self.starts_unsteady or loaded

    @property
    def starts_unsteady(self) -> bool:
        """True if the initial stress or the initial state deviates from steady sliding at V_*."""
        return bool(
            self.parts.slider_parameters.initial_stress
            or self.parts.slider_parameters.initial_state
        )

    @cached_attribute
    def inertial_time(self) -> float:
        """Time scale of inertia, T/(2 pi), in units of D_c/V_*.

        A motion is considered unstable if the product of this time scale and :math:`V/V_*` reaches
        the instability norm.
        """
        slider = self.parts.slider_parameters
        return slider.period * slider.reference_rate / (2.0 * math.pi)

    @cached_attribute
    def log_slip_rate_at_instability(self) -> float:
        """Value of ln(V/V_*) at which a motion is considered unstable."""
        return math.log(self.parts.slider_parameters.instability_norm / self.inertial_time)
