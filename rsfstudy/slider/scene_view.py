"""Protocol with the attributes of a scene that the parts and the equations read.

A scene consists of parts, so modules of parts cannot import the class ``Scene``, even for type
annotations, without an import cycle. They use this protocol instead. The types of the parts and of
the compiled functions are ``Any`` here for the same reason.
"""

from __future__ import annotations

from typing import Any, Protocol


class SceneView(Protocol):
    """Scene, as the parts and the equations see it. The attributes are those of ``Scene``."""

    @property
    def parts(self) -> Any: ...

    @property
    def mu_star(self) -> float: ...

    @property
    def under_steady_loading(self) -> SceneView: ...

    @property
    def cache(self) -> dict[tuple[Any, ...], Any]: ...

    @property
    def parameter_values(self) -> tuple[float, ...]: ...

    @property
    def friction_parameter_values(self) -> tuple[float, ...]: ...

    @property
    def equation_functions(self) -> Any: ...

    @property
    def dynamics(self) -> Any: ...

    @property
    def pressure_source(self) -> Any: ...

    @property
    def has_mass(self) -> bool: ...

    @property
    def state_count(self) -> int: ...

    @property
    def a(self) -> float: ...

    @property
    def b(self) -> float: ...

    @property
    def stiffness(self) -> float: ...

    @property
    def load_velocity(self) -> float: ...

    @property
    def log_load_velocity(self) -> float: ...

    @property
    def imposed_normal_stress(self) -> float: ...

    @property
    def inertial_time(self) -> float: ...

    @property
    def critical_stiffness(self) -> float: ...
