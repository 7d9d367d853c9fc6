"""Equations of motion of one scene, in the form that integrators use.

`equations_between_ruptures` and `equations_in_rupture` are the main functions. Both functions
return `Equations` with the names and scales of the unknowns, the rates and the parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.motion_point import MotionPoint
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_functions import (
    MotionRegimeFunctions,
    SceneFunctions,
    build_scene_functions,
)
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.temperature_functions import steady_temperature_rise

#: Names of two regimes of motion: ruptures with inertia, and the sliding of a rigid slider.
RUPTURE_REGIME, RIGID_REGIME = "inertial", "rigid"


@add_former_member_names
class Equations(NamedTuple):
    r"""Autonomous system of ordinary differential equations for a scene.

    The derivatives of the unknowns do not depend explicitly on the independent variable.

    Parameters
    ----------
    regime : str
        Name of the regime.
    unknown_names : tuple of str
        Names of the unknowns.
    unknown_scales : tuple of float
        Scale of each unknown. A change of an unknown by its scale affects the motion as much as a
        change of :math:`\ln V` by 1.
    rate_function : callable
        Function ``rate(state, p) -> tuple`` that returns the derivatives of the unknowns.
    point_function : callable
        Function ``point(state, derivatives, p) -> MotionPoint``.
    parameters : tuple of float
        Parameters ``p`` of the scene.
    state_count : int, default: 1
        Number of states of the scene.
    force_balance_function : callable, optional
        Function ``force_balance_function(spring, psis, p)`` that returns :math:`\ln(V/V_*)`, the
        frictional stress and the decrease of the state due to stress. The attribute is None in the
        equations for ruptures and for rigid sliders.
    """

    regime: str
    unknown_names: tuple[str, ...]
    unknown_scales: tuple[float, ...]
    rate_function: Function
    point_function: Function
    parameters: Numbers
    state_count: int = 1
    force_balance_function: Function | None = None

    def evaluate_rates(self, unknown_values: Numbers) -> Numbers:
        """Evaluate the derivatives of the unknowns.

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
        """True for a rigid slider, for which slip is the independent variable."""
        return self.regime == RIGID_REGIME

    def evaluate_point(self, unknown_values: Numbers) -> MotionPoint:
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
        return self.point_function(
            unknown_values, self.rate_function(unknown_values, self.parameters), self.parameters
        )


@cached_per_scene
def equations_between_ruptures(scene: SceneView, *, with_time: bool) -> Equations:
    """Return the equations of a scene between ruptures.

    Between ruptures, the effect of inertia is small or zero. The unknowns are the spring stress f
    and the states.

    Parameters
    ----------
    scene : Scene
        Scene to integrate.
    with_time : bool
        Whether to append time to the unknowns.

    Returns
    -------
    Equations
        Equations with path length as the independent variable.
    """
    return _build_slow_equations(
        scene, scene.equation_functions, scene.dynamics.regime, with_time=with_time
    )


@cached_per_scene
def equations_without_mass(scene: SceneView, *, with_time: bool) -> Equations:
    """Return the equations of a scene without inertia.

    Parameters
    ----------
    scene : Scene
        Scene to integrate. The function ignores the inertia of the scene.
    with_time : bool
        Whether to append time to the unknowns.

    Returns
    -------
    Equations
        Quasi-static equations with path length as the independent variable.
    """
    if scene.dynamics.build_rupture_rate_function is None:
        return equations_between_ruptures(scene, with_time=with_time)
    return _build_slow_equations(
        scene, build_scene_functions(scene, QuasiStatic()), QuasiStatic.regime, with_time=with_time
    )


def _build_slow_equations(
    scene: SceneView, scene_functions: SceneFunctions, regime_name: str, *, with_time: bool
) -> Equations:
    unknowns, form = (
        ("spring_stress", *_state_names(scene)),
        scene_functions.functions_between_ruptures,
    )
    unknowns, scales, rate = _append_time_if_requested(
        form, unknowns, (scene.a,) * len(unknowns), with_time=with_time
    )
    p, states = scene.parameter_values, scene.state_count
    return Equations(
        regime_name,
        unknowns,
        scales,
        rate,
        form.point_function,
        p,
        states,
        scene_functions.force_balance_function,
    )


def _append_time_if_requested(
    regime_functions: MotionRegimeFunctions,
    unknown_names: tuple[str, ...],
    unknown_scales: Numbers,
    *,
    with_time: bool,
) -> tuple[tuple[str, ...], Numbers, Function]:
    """Return the unknowns, scales and rates. Append time if it is requested."""
    if not with_time:
        return unknown_names, unknown_scales, regime_functions.rates_along_path
    return (
        (*unknown_names, "time"),
        (*unknown_scales, 1.0),
        regime_functions.rates_along_path_with_time,
    )


def _state_names(scene: SceneView) -> tuple[str, ...]:
    """Return the names of the states."""
    count = scene.parts.law.state_count
    of_law = ["psi"] if count == 1 else [f"psi_{i + 1}" for i in range(count)]
    others = *scene.parts.temperature.unknowns, *scene.pressure_source.unknowns
    return (*of_law, *(unknown.name for unknown in others))


@cached_per_scene
def equations_in_rupture(scene: SceneView, *, with_time: bool = False) -> Equations:
    r"""Return the equations of a scene with inertia.

    The unknowns are the spring stress f, the log rate :math:`\ln(V/V_*)`, the frictional stress g
    and all states except the first.

    Parameters
    ----------
    scene : Scene
        Scene with inertia.
    with_time : bool, default: False
        Whether to append inertial time, in units of :math:`T/(2 \pi)`, to the unknowns.

    Returns
    -------
    Equations
        Equations with path length as the independent variable.

    Raises
    ------
    TypeError
        If the scene has no inertia.
    """
    a, form, others = scene.a, _get_required_rupture_functions(scene), _state_names(scene)[1:]
    unknowns = ("spring_stress", "log_slip_rate", "friction", *others)
    scales, p = (a, 1.0, a, *[a] * len(others)), scene.parameter_values
    unknowns, scales, rate = _append_time_if_requested(form, unknowns, scales, with_time=with_time)
    return Equations(
        RUPTURE_REGIME, unknowns, scales, rate, form.point_function, p, scene.state_count
    )


def _get_required_rupture_functions(scene: SceneView) -> MotionRegimeFunctions:
    full = scene.equation_functions.functions_in_rupture
    if full is None:
        raise TypeError(f"{scene.dynamics.name} has no equations of ruptures")
    return full


def build_equations_against_displacement(scene: SceneView) -> Equations:
    """Return the equations between ruptures as functions of displacement.

    The displacement is slip plus load point displacement. Close to steady sliding, the rates are
    nearly linear functions of the unknowns. The rates with respect to displacement remain linear
    over a wider range than the rates with respect to path length.

    Parameters
    ----------
    scene : Scene
        Scene to integrate.

    Returns
    -------
    Equations
        Equations with displacement as the independent variable.
    """
    along = equations_between_ruptures(scene, with_time=False)
    return along._replace(
        rate_function=scene.equation_functions.functions_between_ruptures.rates_against_clock
    )


def build_equations_against_inertial_time(scene: SceneView) -> Equations:
    r"""Return the equations of a scene with inertia as functions of time.

    Parameters
    ----------
    scene : Scene
        Scene with inertia.

    Returns
    -------
    Equations
        Equations with time in units of :math:`T/(2 \pi)` as the independent variable.

    Raises
    ------
    TypeError
        If the scene has no inertia.
    """
    return equations_in_rupture(scene)._replace(
        rate_function=_get_required_rupture_functions(scene).rates_against_clock
    )


def equations_at_imposed_slip_rate(scene: SceneView, log_slip_rate: float) -> Equations:
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
    Equations
        Equations whose last parameter is :math:`\ln(V/V_*)`.
    """
    forms, unknowns = scene.equation_functions, ("friction", *_state_names(scene)[1:])
    scales, p = (scene.a,) * len(unknowns), (*scene.parameter_values, log_slip_rate)
    return Equations(
        RIGID_REGIME,
        unknowns,
        scales,
        forms.rigid_rate_function,
        forms.rigid_point_function,
        p,
        scene.state_count,
    )


def build_friction_relation(
    scene: SceneView, states: Numbers = ()
) -> Callable[[float], tuple[float, float, float, float]]:
    """Return the friction relation of a scene as a function of stress.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters.
    states : tuple of float, optional
        States of the scene, from which the pore pressure is read. By default, the function uses the
        pore pressure of steady sliding.

    Returns
    -------
    callable
        Function ``g -> (strength, slope, shift, shift_slope)``.
    """
    strength, p = (
        scene.equation_functions.friction_functions.strength,
        scene.friction_parameter_values,
    )
    known = states or (0.0,) * scene.state_count
    return lambda friction: strength(friction, known, p)


def effective_normal_stress_at(
    scene: SceneView, frictional_stress: float, states: Numbers = ()
) -> float:
    r"""Compute the effective normal stress from the frictional stress.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters.
    frictional_stress : float
        Deviation of the frictional stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    states : tuple of float, optional
        States of the scene, from which the pore pressure is read. By default, the function uses the
        pore pressure of steady sliding.

    Returns
    -------
    float
        Effective normal stress in :math:`\sigma_*`.
    """
    at = states or (0.0,) * scene.state_count
    stress = scene.equation_functions.friction_functions.effective_normal_stress(
        frictional_stress, at, scene.friction_parameter_values
    )
    return 1.0 + float(stress[0])


def quasi_static_log_slip_rate(scene: SceneView, spring_stress: float, state_sum: float) -> float:
    r"""Compute the slip rate from the spring stress and the state.

    The function ignores inertia and assumes that there is no pore pressure.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters.
    spring_stress : float
        Deviation of the spring stress from :math:`\tau_*`, in units of :math:`\sigma_*`.
    state_sum : float
        State :math:`\Psi`, or the sum of the states of a law with several states.

    Returns
    -------
    float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    """
    forms = (
        build_scene_functions(scene, QuasiStatic()) if scene.has_mass else scene.equation_functions
    )
    psis = (state_sum, *(0.0,) * (scene.state_count - 1))
    return float(forms.force_balance_function(spring_stress, psis, scene.parameter_values)[0])


def build_state_evolution_function(scene: SceneView) -> Callable[[float, Numbers, float], Numbers]:
    """Return the state evolution of a scene as a function.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters.

    Returns
    -------
    callable
        Function ``(log_slip_rate, psis, shift)`` that returns the change of each state per slip
        distance of :math:`D_c`.
    """
    evolutions, p = (
        scene.equation_functions.friction_functions.evolutions,
        scene.friction_parameter_values,
    )
    return lambda log_slip_rate, psis, shift: evolutions(log_slip_rate, psis, shift, 1.0, p)


def compute_steady_states(scene: SceneView, log_slip_rate: float, state_shift: float) -> Numbers:
    r"""Compute the states of steady sliding at a slip rate.

    Parameters
    ----------
    scene : Scene
        Scene with friction parameters.
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    state_shift : float
        Decrease of the state variable due to stress.

    Returns
    -------
    tuple of float
        States :math:`\Psi_i`.
    """
    p, functions = scene.friction_parameter_values, scene.equation_functions.friction_functions
    states: Numbers = functions.steady_states(log_slip_rate, state_shift, p)
    if not scene.parts.temperature.unknowns:
        return states
    place = scene.parts.law.state_count
    rise = steady_temperature_rise(scene, log_slip_rate)
    return (*states[:place], rise, *states[place + 1 :])
