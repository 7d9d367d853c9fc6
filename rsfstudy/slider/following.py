"""What follows from the parts of a scene and the numbers that every slider has."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import dynamics, fluid, laws, loading, normal_stress
from rsfstudy.slider.shown import Shown


class Parts(NamedTuple):
    """What fills the slots of a scene."""

    law: laws.LawOfStates
    normal_stress: normal_stress.NormalStress
    fluid: fluid.Fluid
    dynamics: dynamics.Dynamics
    loading: loading.Loading


class Following(Shown):
    """A scene, as far as it follows from its parts and numbers."""

    parts: Parts
    if TYPE_CHECKING:
        a: float
        mu_star: float
        period: float
        reference_rate: float
        instability_norm: float
        initial_stress: float
        initial_state: float

        def __getattr__(self, name: str) -> Any: ...

    @property
    def dynamics(self) -> dynamics.Dynamics:
        """What balances the spring besides friction."""
        return self.parts.dynamics

    @property
    def pressing(self) -> fluid.Fluid | loading.Loading:
        """What has the unknowns of which the last takes from normal stress, if any has."""
        return self.parts.loading if self.parts.loading.unknowns else self.parts.fluid

    @property
    def has_mass(self) -> bool:
        """Whether mass acts in ruptures."""
        return self.parts.dynamics.rupture_rate is not None

    @property
    def states(self) -> int:
        """How many states there are: those of the law, and the unknowns of the fluid, or of a
        loading that goes on changing normal stress.
        """
        return self.parts.law.states + len(self.pressing.unknowns)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that act in this scene."""
        return tuple(effect for part in self.parts for effect in part.effects)

    @property
    def b(self) -> float:
        """Evolution effect parameter, of all states together."""
        return float(self.a * self.parts.law.b_over_a)

    @property
    def stiffness(self) -> float:
        """K = k D_c/sigma_*."""
        given = self.__dict__["stiffness"]
        return float(given) if given is not None else self._relative_stiffness

    @cached_property
    def _relative_stiffness(self) -> float:
        ratio = self.__dict__["stiffness_ratio"]
        if not 0.0 < self.critical_stiffness < math.inf:
            rule = f"is of a critical stiffness at V_* that is {self.critical_stiffness:g}"
            raise InvalidValue("stiffness_ratio", ratio, rule, remedy="Give stiffness itself.")
        return float(ratio * self.critical_stiffness)

    @property
    def stiffness_ratio(self) -> float:
        """k/k_cr(V_*); infinite without rate weakening, where no spring is soft enough. One below 1
        need not be unstable with several states, which may be so between two stiffnesses only.
        """
        given = self.__dict__["stiffness_ratio"]
        if given is not None:
            return float(given)
        return self.stiffness / self.critical_stiffness if self.critical_stiffness else math.inf

    @cached_property
    def load_velocity(self) -> float:
        """V_0/V_* after the last step."""
        return self.parts.loading.segments[-1].load_velocity

    @cached_property
    def log_load_rate(self) -> float:
        """ln(V_0/V_*), and -inf for a load point at rest."""
        return math.log(self.load_velocity) if self.load_velocity > 0.0 else -math.inf

    @cached_property
    def imposed_normal_stress(self) -> float:
        """By how much imposed normal stress exceeds sigma_* after the last step, over sigma_*."""
        return self.parts.loading.segments[-1].normal_stress

    @property
    def spring_stress_step(self) -> float:
        """Change of spring stress over sigma_* by the first displacement step, K d."""
        return self.stiffness * self.parts.loading.segments[0].displacement

    @property
    def is_disturbed(self) -> bool:
        """Whether it does anything but slide on steadily at V_*."""
        return self.begins_elsewhere or self.parts.loading.is_a_step

    @property
    def begins_elsewhere(self) -> bool:
        """Whether it begins with other stress or state than those of steady sliding at V_*."""
        return bool(self.initial_stress or self.initial_state)

    @cached_property
    def inertial_time(self) -> float:
        """Time scale of inertia in units of D_c/V_*: T V_*/(2 pi D_c).

        Slip rate in V_* times this number is what the instability norm is compared with.
        """
        return self.period * self.reference_rate / (2.0 * math.pi)

    @property
    def log_norm_rate(self) -> float:
        """ln(V/V_*) at which the instability norm is reached."""
        return math.log(self.instability_norm / self.inertial_time)
