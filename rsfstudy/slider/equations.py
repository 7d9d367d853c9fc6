"""Equations of one scene as an integrator takes them: unknowns, scales, rates and points."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from rsfstudy._deprecation import renamed_members
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.motion_point import MotionPoint
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.scene_caching import cached_per_scene
from rsfstudy.slider.scene_functions import RegimeFunctions, SceneFunctions, build_scene_functions
from rsfstudy.slider.scene_view import SceneView

#: The regime of the full equations of a scene with mass, and that of a rigid slider.
RUPTURE_REGIME, RIGID_REGIME = "inertial", "rigid"


@renamed_members
class Equations(NamedTuple):
    """A system of ordinary differential equations in its own clock, on which it does not depend.

    Attributes
    ----------
    regime : str
        Name of the form.
    unknown_names : tuple of str
        Names of the unknowns.
    unknown_scales : tuple of float
        The change of each unknown that weighs as much as a change of 1 in ln V.
    rate_function : callable
        ``rate(state, p) -> tuple``: derivatives of the unknowns.
    point_function : callable
        ``point(state, derivatives, p) -> MotionPoint``.
    parameters : tuple of float
        The numbers of the scene.
    state_count : int
        How many states the scene has.
    force_balance_function : callable or None
        ``force_balance_function(spring, psis, p)``: ln(V/V_*), frictional stress and the state lost
        to stress; between ruptures only.
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
        """Derivatives of the unknowns."""
        return self.rate_function(unknown_values, self.parameters)

    @property
    def is_rigid(self) -> bool:
        """True if slip is the clock."""
        return self.regime == RIGID_REGIME

    def evaluate_point(self, unknown_values: Numbers) -> MotionPoint:
        """The point of the motion at a state."""
        return self.point_function(
            unknown_values, self.rate_function(unknown_values, self.parameters), self.parameters
        )


@cached_per_scene
def equations_between_ruptures(scene: SceneView, *, with_time: bool) -> Equations:
    """The form of a scene where mass, if it has any, hardly acts: unknowns f and Psi (or the states
    of a law that has several), and time as a passenger where a `clock` is wanted.
    """
    return _build_slow_equations(
        scene, scene.equation_functions, scene.dynamics.regime, with_time=with_time
    )


@cached_per_scene
def equations_without_mass(scene: SceneView, *, with_time: bool) -> Equations:
    """The form between ruptures with mass left out altogether."""
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
    regime_functions: RegimeFunctions,
    unknown_names: tuple[str, ...],
    unknown_scales: Numbers,
    *,
    with_time: bool,
) -> tuple[tuple[str, ...], Numbers, Function]:
    """Unknowns, scales and rate of a form; with time, of its clock, as a passenger."""
    if not with_time:
        return unknown_names, unknown_scales, regime_functions.rates_along_path
    return (
        (*unknown_names, "time"),
        (*unknown_scales, 1.0),
        regime_functions.rates_along_path_with_time,
    )


def _state_names(scene: SceneView) -> tuple[str, ...]:
    """Names of the states."""
    count = scene.parts.law.state_count
    of_law = ["psi"] if count == 1 else [f"psi_{i + 1}" for i in range(count)]
    return (*of_law, *(unknown.name for unknown in scene.pressure_source.unknowns))


@cached_per_scene
def equations_in_rupture(scene: SceneView, *, with_time: bool = False) -> Equations:
    """The full equations of a scene with mass: f, ln(V/V_*) and g, and the states but the first;
    and inertial time, in T/(2 pi), as a passenger where a `clock` is wanted.
    """
    a, form, others = scene.a, _require_rupture_functions(scene), _state_names(scene)[1:]
    unknowns = ("spring_stress", "log_slip_rate", "friction", *others)
    scales, p = (a, 1.0, a, *[a] * len(others)), scene.parameter_values
    unknowns, scales, rate = _append_time_if_requested(form, unknowns, scales, with_time=with_time)
    return Equations(
        RUPTURE_REGIME, unknowns, scales, rate, form.point_function, p, scene.state_count
    )


def _require_rupture_functions(scene: SceneView) -> RegimeFunctions:
    full = scene.equation_functions.functions_in_rupture
    if full is None:
        raise TypeError(f"{scene.dynamics.name} has no equations of ruptures")
    return full


def equations_against_displacement(scene: SceneView) -> Equations:
    """The form between ruptures against slip plus load point displacement: differences of its rates
    are linear in departures farther from steady sliding than those along the path.
    """
    along = equations_between_ruptures(scene, with_time=False)
    return along._replace(
        rate_function=scene.equation_functions.functions_between_ruptures.rates_against_clock
    )


def equations_against_inertial_time(scene: SceneView) -> Equations:
    """The full equations in inertial time T/(2 pi)."""
    return equations_in_rupture(scene)._replace(
        rate_function=_require_rupture_functions(scene).rates_against_clock
    )


def equations_at_imposed_slip_rate(scene: SceneView, log_slip_rate: float) -> Equations:
    """A rigid slider at prescribed ln(V/V_*), against slip: g, and the states but the first."""
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
    """The friction relation of a scene: g -> (strength, slope, shift, slope of the shift); at the
    pore pressure of steady sliding, unless states are given.
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
    """Effective normal stress over sigma_* under a deviation of frictional stress, at steady
    sliding unless states are given.
    """
    at = states or (0.0,) * scene.state_count
    stress = scene.equation_functions.friction_functions.effective_normal_stress(
        frictional_stress, at, scene.friction_parameter_values
    )
    return 1.0 + float(stress[0])


def quasi_static_log_slip_rate(scene: SceneView, spring_stress: float, state_sum: float) -> float:
    """ln(V/V_*) for a spring stress and state (the sum, of several) where mass does not act, and
    there is no pore pressure.
    """
    forms = (
        build_scene_functions(scene, QuasiStatic()) if scene.has_mass else scene.equation_functions
    )
    psis = (state_sum, *(0.0,) * (scene.state_count - 1))
    return float(forms.force_balance_function(spring_stress, psis, scene.parameter_values)[0])


def build_state_evolution_function(scene: SceneView) -> Callable[[float, Numbers, float], Numbers]:
    """The law of a scene: (ln(V/V_*), Psi, shift) -> change of each state per unit slip."""
    evolutions, p = (
        scene.equation_functions.friction_functions.evolutions,
        scene.friction_parameter_values,
    )
    return lambda log_slip_rate, psis, shift: evolutions(log_slip_rate, psis, shift, 1.0, p)


def compute_steady_states(scene: SceneView, log_slip_rate: float, state_shift: float) -> Numbers:
    """The states of steady sliding at ln(V/V_*), of which stress has taken `shift`."""
    p = scene.friction_parameter_values
    return scene.equation_functions.friction_functions.steady_states(log_slip_rate, state_shift, p)
