"""Protocol that declares the scene attributes that parts and equations read.

The module of the class ``Scene`` imports the modules of the parts. If a part imported ``Scene``,
even for type annotations, the imports would form a cycle. Modules of parts therefore use the
protocol ``SceneView``. For the same reason, the protocol declares the parts and the compiled
functions as ``Any``.
"""

from __future__ import annotations

from typing import Any, Protocol


class SceneView(Protocol):
    """Protocol that declares the scene attributes that parts and equations use.

    The attributes have the same meaning as the attributes of ``Scene``.
    """

    @property
    def parts(self) -> Any:
        """Parts of the scene, with one part per slot."""

    @property
    def mu_star(self) -> float:
        """Friction coefficient at the reference velocity."""

    @property
    def steadily_loaded_scene(self) -> SceneView:
        """Scene in which the load point moves at a constant velocity."""

    @property
    def result_cache(self) -> dict[tuple[Any, ...], Any]:
        """Cached results of the functions that are decorated with ``cached_per_scene``."""

    @property
    def parameter_values(self) -> tuple[float, ...]:
        """Parameter tuple ``p`` of the equations."""

    @property
    def friction_parameter_values(self) -> tuple[float, ...]:
        """Parameter tuple ``p`` in which the values for the spring and the load point are NaN."""

    @property
    def friction_law_functions(self) -> Any:
        """Functions that define the friction of the scene."""

    @property
    def dynamics(self) -> Any:
        """Dynamics of the slider."""

    @property
    def stress_imposing_part(self) -> Any:
        """Part whose unknowns impose stress: the noise or the loading."""

    @property
    def changes_normal_stress(self) -> bool:
        """True if the loading or the noise changes normal stress."""

    @property
    def part_changing_effective_stress(self) -> Any:
        """Part with auxiliary unknowns: the fluid, the loading or a combination of both."""

    @property
    def has_mass(self) -> bool:
        """True if the slider has inertia."""

    @property
    def state_count(self) -> int:
        """Number of states, including the auxiliary unknowns."""

    @property
    def a(self) -> float:
        """Parameter of the direct effect."""

    @property
    def b(self) -> float:
        """Parameter of the evolution effect."""

    @property
    def stiffness(self) -> float:
        """Stiffness in units of sigma_*/D_c."""

    @property
    def load_velocity(self) -> float:
        """Load point velocity in units of V_*."""

    @property
    def log_load_velocity(self) -> float:
        """Natural logarithm of the load point velocity in units of V_*."""

    @property
    def imposed_normal_stress(self) -> float:
        """Imposed change in normal stress in units of sigma_*."""

    @property
    def inertial_time(self) -> float:
        """Inertial time T/(2 pi) in units of D_c/V_*."""

    @property
    def critical_stiffness(self) -> float:
        """Quasi-static critical stiffness at V_*, in units of sigma_*/D_c."""
