"""Equations of motion of a scene, in the form that the integrators require.

`build_equations_between_ruptures` and `build_equations_in_rupture` are the main functions. Both
functions return `EquationsOfMotion` with the names and scales of the unknowns, the rates and the
parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.motion_point import MotionPoint
from rsfstudy.slider.motion_point_functions import (
    build_point_function_between_ruptures,
    build_point_function_in_rupture,
    build_point_function_of_rigid_slider,
)
from rsfstudy.slider.parts import FloatTuple, NumericFunction
from rsfstudy.slider.rate_functions import (
    build_rate_function_of_rigid_slider,
    build_rate_functions_between_ruptures,
    build_rate_functions_in_rupture,
)
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_view import SceneView

if TYPE_CHECKING:
    from rsfstudy.slider.dynamics import Dynamics

#: Names of two regimes of motion. In the first regime, a rupture is integrated with inertia. In the
#: second regime, the slider is rigid.
RUPTURE_REGIME, RIGID_REGIME = "inertial", "rigid"


@add_former_member_names
class EquationsOfMotion(NamedTuple):
    r"""Autonomous system of ordinary differential equations for a scene.

    The derivatives of the unknowns do not depend explicitly on the independent variable.

    Parameters
    ----------
    regime_name : str
        Name of the regime.
    unknown_names : tuple of str
        Names of the unknowns.
    unknown_scales : tuple of float
        Scale of each unknown. A change of an unknown by its scale affects the motion about as much
        as a change of :math:`\ln V` by 1.
    rate_function : callable
        Function ``rate(state, p) -> tuple`` that returns the derivatives of the unknowns.
    motion_point_function : callable
        Function ``point(state, derivatives, p) -> MotionPoint``.
    parameters : tuple of float
        Parameters ``p`` of the scene.
    state_count : int, default: 1
        Number of states of the scene.
    force_balance_function : callable, optional
        Function ``force_balance_function(spring, psis, p)`` that returns :math:`\ln(V/V_*)`, the
        frictional stress and the stress-induced decrease in the state. The value is None in the
        equations for ruptures and for rigid sliders.
    """

    regime_name: str
    unknown_names: tuple[str, ...]
    unknown_scales: tuple[float, ...]
    rate_function: NumericFunction
    motion_point_function: NumericFunction
    parameters: FloatTuple
    state_count: int = 1
    force_balance_function: NumericFunction | None = None

    def evaluate_rates(self, unknown_values: FloatTuple) -> FloatTuple:
        """Compute the derivatives of the unknowns.

        Parameters
        ----------
        unknown_values : tuple of float
            Values of the unknowns.

        Returns
        -------
        tuple of float
            Derivatives of the unknowns.
        """
        return self.rate_function(unknown_values, self.parameters)

    @property
    def is_rigid(self) -> bool:
        """True if the equations describe a rigid slider.

        The independent variable of a rigid slider is slip.
        """
        return self.regime_name == RIGID_REGIME

    def evaluate_motion_point(self, unknown_values: FloatTuple) -> MotionPoint:
        """Compute stress, slip rate and states from the values of the unknowns.

        Parameters
        ----------
        unknown_values : tuple of float
            Values of the unknowns.

        Returns
        -------
        MotionPoint
            Stress, slip rate and states of the motion.
        """
        return self.motion_point_function(
            unknown_values, self.rate_function(unknown_values, self.parameters), self.parameters
        )


@cached_per_scene
def build_equations_between_ruptures(scene: SceneView, *, with_time: bool) -> EquationsOfMotion:
    """Return the equations that describe the motion of a scene between ruptures.

    Between ruptures, inertia has a small effect or no effect on the motion. The unknowns are the
    spring stress f and the states.

    Parameters
    ----------
    scene : Scene
        Scene to integrate.
    with_time : bool
        If True, time is an additional unknown.

    Returns
    -------
    EquationsOfMotion
        Equations with path length as the independent variable.
    """
    return _build_equations_for_dynamics(scene, scene.dynamics, with_time=with_time)


@cached_per_scene
def build_equations_without_mass(scene: SceneView, *, with_time: bool) -> EquationsOfMotion:
    """Return the equations of a scene without inertia.

    Parameters
    ----------
    scene : Scene
        Scene to integrate. Any inertia of the scene is ignored.
    with_time : bool
        If True, time is an additional unknown.

    Returns
    -------
    EquationsOfMotion
        Quasi-static equations with path length as the independent variable.
    """
    if scene.dynamics.build_rate_function_for_ruptures is None:
        return build_equations_between_ruptures(scene, with_time=with_time)
    return _build_equations_for_dynamics(scene, QuasiStatic(), with_time=with_time)


def _build_equations_for_dynamics(
    scene: SceneView, dynamics: Dynamics, *, with_time: bool, against_path_length: bool = True
) -> EquationsOfMotion:
    """Build the equations between ruptures for the given dynamics."""
    friction = scene.friction_law_functions
    balance, growth = _build_cached_slip_rate_functions(
        friction, dynamics.build_slip_rate_functions
    )
    by_displacement, by_path, by_path_with_time = build_rate_functions_between_ruptures(
        friction, balance, allows_reversed_slip=scene.parts.law.regularised
    )
    unknowns = ("spring_stress", *_list_state_names(scene))
    scales = (scene.a,) * len(unknowns)
    if with_time:
        unknowns, scales = (*unknowns, "time"), (*scales, 1.0)
    return EquationsOfMotion(
        dynamics.regime_name,
        unknowns,
        scales,
        by_path_with_time if with_time else by_path if against_path_length else by_displacement,
        build_point_function_between_ruptures(friction, balance, growth),
        scene.parameter_values,
        friction.state_count,
        balance,
    )


@cache
def _build_cached_slip_rate_functions(
    friction_functions: FrictionFunctions,
    slip_rate_functions_builder: Callable[
        [FrictionFunctions], tuple[NumericFunction, NumericFunction]
    ],
) -> tuple[NumericFunction, NumericFunction]:
    """Build and cache the force balance and the derivative of ln V."""
    return slip_rate_functions_builder(friction_functions)


def _list_state_names(scene: SceneView) -> tuple[str, ...]:
    """Return the names of the states."""
    count = scene.parts.law.state_count
    of_law = ["psi"] if count == 1 else [f"psi_{i + 1}" for i in range(count)]
    heat = scene.parts.temperature.unknowns
    return (
        *of_law,
        *(unknown.name for unknown in (*heat, *scene.part_changing_effective_stress.unknowns)),
    )


@cached_per_scene
def build_equations_in_rupture(scene: SceneView, *, with_time: bool = False) -> EquationsOfMotion:
    r"""Return the equations of a scene with inertia.

    The unknowns are the spring stress f, the logarithm of the slip rate :math:`\ln(V/V_*)`, the
    frictional stress g and all states except the first.

    Parameters
    ----------
    scene : Scene
        Scene with inertia.
    with_time : bool, default: False
        If True, inertial time in units of :math:`T/(2 \pi)` is an additional unknown.

    Returns
    -------
    EquationsOfMotion
        Equations with path length as the independent variable.

    Raises
    ------
    TypeError
        If the scene has no inertia.
    """
    return _build_rupture_equations(scene, with_time=with_time)


def _build_rupture_equations(
    scene: SceneView, *, with_time: bool = False, against_path_length: bool = True
) -> EquationsOfMotion:
    """Build the rupture equations. Raise TypeError if the scene has no inertia."""
    a, friction, others = scene.a, scene.friction_law_functions, _list_state_names(scene)[1:]
    if scene.dynamics.build_rate_function_for_ruptures is None:
        raise TypeError(
            f"the dynamics {scene.dynamics.name!r} do not define equations for ruptures"
        )
    by_time, by_path, by_path_with_time = build_rate_functions_in_rupture(
        friction, scene.dynamics.build_rate_function_for_ruptures
    )
    unknowns = ("spring_stress", "log_slip_rate", "friction", *others)
    scales = (a, 1.0, a, *[a] * len(others))
    if with_time:
        unknowns, scales = (*unknowns, "time"), (*scales, 1.0)
    return EquationsOfMotion(
        RUPTURE_REGIME,
        unknowns,
        scales,
        by_path_with_time if with_time else by_path if against_path_length else by_time,
        build_point_function_in_rupture(friction),
        scene.parameter_values,
        friction.state_count,
    )


def build_equations_against_displacement(scene: SceneView) -> EquationsOfMotion:
    """Return the equations between ruptures as functions of displacement.

    The independent variable is the sum of slip and load point displacement. Close to steady
    sliding, the derivatives of the unknowns are nearly linear functions of the unknowns. This
    linear range is wider for derivatives with respect to displacement than for derivatives with
    respect to path length.

    Parameters
    ----------
    scene : Scene
        Scene to integrate.

    Returns
    -------
    EquationsOfMotion
        Equations with displacement as the independent variable.
    """
    return _build_equations_for_dynamics(
        scene, scene.dynamics, with_time=False, against_path_length=False
    )


def build_equations_against_inertial_time(scene: SceneView) -> EquationsOfMotion:
    r"""Return the equations with inertia and time as the independent variable.

    Parameters
    ----------
    scene : Scene
        Scene with inertia.

    Returns
    -------
    EquationsOfMotion
        Equations with time in units of :math:`T/(2 \pi)` as the independent variable.

    Raises
    ------
    TypeError
        If the scene has no inertia.
    """
    return _build_rupture_equations(scene, against_path_length=False)


def build_equations_at_imposed_slip_rate(
    scene: SceneView, log_slip_rate: float
) -> EquationsOfMotion:
    r"""Return the equations of a rigid slider at a prescribed slip rate.

    The unknowns are the frictional stress g and all states except the first. Slip is the
    independent variable.

    Parameters
    ----------
    scene : Scene
        Scene of the slider.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

    Returns
    -------
    EquationsOfMotion
        Equations whose last parameter is :math:`\ln(V/V_*)`.
    """
    friction, unknowns = scene.friction_law_functions, ("friction", *_list_state_names(scene)[1:])
    return EquationsOfMotion(
        RIGID_REGIME,
        unknowns,
        (scene.a,) * len(unknowns),
        build_rate_function_of_rigid_slider(friction),
        build_point_function_of_rigid_slider(friction),
        (*scene.parameter_values, log_slip_rate),
        friction.state_count,
    )


def compute_quasi_static_log_slip_rate(
    scene: SceneView, spring_stress: float, state_sum: float
) -> float:
    r"""Compute the slip rate from the spring stress and the state.

    The function ignores inertia and assumes that there is no pore pressure.

    Parameters
    ----------
    scene : Scene
        Scene that provides the friction parameters.
    spring_stress : float
        Deviation of the spring stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    state_sum : float
        State :math:`\Psi`, or the sum of the states of a law with several states.

    Returns
    -------
    float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    """
    psis = (state_sum, *(0.0,) * (scene.state_count - 1))
    balance = build_equations_without_mass(scene, with_time=False).force_balance_function
    assert balance is not None
    return float(balance(spring_stress, psis, scene.parameter_values)[0])


def compute_slow_manifold_point(
    scene: SceneView, spring_stress: float, states: FloatTuple
) -> MotionPoint:
    """Return the slow-manifold point for a given spring stress and given states.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    spring_stress : float
        Spring stress :math:`f`, in sigma_*.
    states : tuple of float
        States of the friction law, followed by the unknowns of the loading and the fluid.

    Returns
    -------
    MotionPoint
        Point in which all fields have values.
    """
    return build_equations_between_ruptures(scene, with_time=False).evaluate_motion_point(
        (spring_stress, *states)
    )
