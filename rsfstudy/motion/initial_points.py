"""Functions that compute the point at which a motion starts or resumes after a loading jump.

The event loop chooses the regime of an initial point. The module ``regime_switching`` contains the
criteria for this choice.
"""

from __future__ import annotations

import math

from scipy.optimize import newton

from rsfstudy.motion import regime_switching
from rsfstudy.motion.overflow_reports import convert_overflow_to_motion_stopped
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.parts import Segment
from rsfstudy.slider import FloatTuple, MotionPoint, Scene
from rsfstudy.status import Status

_NAN_FOR_UNEVALUATED_POINT_FIELDS = (math.nan,) * len(MotionPoint._fields[5:-1])


@convert_overflow_to_motion_stopped
def compute_initial_point(scene: Scene) -> MotionPoint:
    """Return the initial point of a motion, immediately after the loading step.

    Before the loading step, the slider slides steadily at the slip rate V_*, or has the initial
    stress and state that the scene specifies. The loading step changes the spring stress and the
    imposed normal stress. If the scene has inertia, the loading step does not change the slip rate
    immediately. Instead, the slip rate adjusts to the loading step within the inertial time.

    Parameters
    ----------
    scene : Scene
        Scene with the parameters of its first loading segment.

    Returns
    -------
    MotionPoint
        Initial point. Only the fields set by ``build_point_without_derived_values`` contain values.
        All other fields are NaN.

    Raises
    ------
    MotionStopped
        If normal stress vanishes or shear stress changes sign in the loading step.
    """
    check_forward_slip_is_possible_at_start(scene)
    psis, log_slip_rate = scene.compute_steady_states(0.0, 0.0), 0.0
    if scene.starts_unsteady:
        psis, log_slip_rate = _find_specified_initial_states(scene, psis)
    psis = _reset_loading_unknowns(scene, psis)
    stress = scene.parts.slider_parameters.initial_stress + scene.spring_stress_step
    stepped = build_point_without_derived_values(scene, stress, psis)
    return (
        compute_point_with_slip_rate(scene, stepped, log_slip_rate) if scene.has_mass else stepped
    )


def compute_point_before_start(scene: Scene) -> MotionPoint:
    """Return the point of a motion before its first loading step.

    Parameters
    ----------
    scene : Scene
        Scene with the parameters of its first loading segment.

    Returns
    -------
    MotionPoint
        Point on the slow manifold.
    """
    before = scene.with_segment(Segment(1.0))
    psis = before.compute_steady_states(0.0, 0.0)
    if scene.starts_unsteady:
        psis = _find_specified_initial_states(scene, psis)[0]
    return before.compute_slow_manifold_point(scene.parts.slider_parameters.initial_stress, psis)


def build_point_without_derived_values(
    scene: Scene,
    spring_stress: float,
    states: FloatTuple,
    log_slip_rate: float = math.nan,
    frictional_stress: float = math.nan,
) -> MotionPoint:
    r"""Return a point that contains only the initial values of a motion.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    spring_stress : float
        Spring stress :math:`f`, in sigma_*.
    states : tuple of float
        States of the friction law, followed by the unknowns of the loading and the fluid.
    log_slip_rate : float, default: nan
        Value of :math:`\ln(V/V_*)`. The value is only needed for motions with inertia.
    frictional_stress : float, default: nan
        Frictional stress :math:`g`, in sigma_*. The value is only needed for motions with inertia.

    Returns
    -------
    MotionPoint
        Point of the motion. Fields that are not arguments of this function are NaN. The first event
        of the motion contains the computed values of all fields.
    """
    psi = scene.friction_law_functions.state_sum(states)
    known = log_slip_rate, math.nan, spring_stress, frictional_stress, psi
    return MotionPoint._make((*known, *_NAN_FOR_UNEVALUATED_POINT_FIELDS, states))


@convert_overflow_to_motion_stopped
def compute_restart_point(scene: Scene, spring_stress: float, states: FloatTuple) -> MotionPoint:
    """Return a point on the slow manifold from which a motion can restart.

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
        Initial point. Only the fields set by ``build_point_without_derived_values`` contain values.
        All other fields are NaN.

    Raises
    ------
    MotionStopped
        If the spring stress is incompatible with forward slip.
    """
    balance = scene.equations_between_ruptures(with_time=False).force_balance_function
    assert balance is not None
    x, friction, _shift = balance(spring_stress, states, scene.parameter_values)
    point = build_point_without_derived_values(scene, spring_stress, states, x, friction)
    check_forward_slip_is_possible_at_start(scene, point)
    return point


def _reset_loading_unknowns(scene: Scene, states: FloatTuple) -> FloatTuple:
    """Replace the unknowns of the loading by their initial values.

    In the tuple of unknowns, the unknowns of the loading come after the states of the friction law
    and the temperature. Unknowns of the previous loading are removed.
    """
    begun, parts = scene.stress_imposing_part.initial_unknowns(scene), scene.parts
    kept = parts.law.state_count + len(parts.temperature.unknowns)
    return (*states[:kept], *begun, *states[kept + len(begun) : scene.state_count])


def _find_specified_initial_states(
    scene: Scene, steady_states: FloatTuple
) -> tuple[FloatTuple, float]:
    """Compute the states and ln(V/V_*) from the initial stress and state of the scene.

    The function solves for the value of Psi that gives the specified state variable.
    """
    before = scene.with_segment(Segment(1.0))
    others = steady_states[1 : before.state_count]

    def begun(psi: float) -> MotionPoint:
        return before.compute_slow_manifold_point(scene.initial_stress, (psi, *others))

    def missing(psi: float) -> float:
        return scene.initial_state - begun(psi).state

    psi = float(newton(missing, scene.initial_state, tol=1e-15))
    return (psi, *steady_states[1:]), begun(psi).log_slip_rate


@convert_overflow_to_motion_stopped
def compute_point_after_loading_jump(scene: Scene, point: MotionPoint) -> MotionPoint:
    """Return the point of a motion immediately after a jump in the loading.

    A jump in the loading is a step of the load point, a step of imposed normal stress, or the
    beginning or end of an oscillation. A jump in the loading does not change the states of the
    friction law. If the scene has inertia, a jump in the loading does not change the slip rate
    either.

    Parameters
    ----------
    scene : Scene
        Scene after the jump.
    point : MotionPoint
        Point before the jump.

    Returns
    -------
    MotionPoint
        Point after the jump.

    Raises
    ------
    MotionStopped
        If normal stress vanishes or shear stress changes sign in the jump.
    """
    psis = _reset_loading_unknowns(scene, point.psis)
    after = point._replace(spring_stress=point.spring_stress + scene.spring_stress_step, psis=psis)
    check_forward_slip_is_possible_at_start(scene, after)
    return (
        compute_point_with_slip_rate(scene, after, point.log_slip_rate) if scene.has_mass else after
    )


def compute_point_with_slip_rate(
    scene: Scene, point: MotionPoint, log_slip_rate: float
) -> MotionPoint:
    r"""Return a copy of a point with a new slip rate and the resulting friction.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    point : MotionPoint
        Point to change.
    log_slip_rate : float
        New value of :math:`\ln(V/V_*)`.

    Returns
    -------
    MotionPoint
        Point with the new slip rate and frictional stress.

    Raises
    ------
    MotionStopped
        If normal stress vanishes.
    """
    excess = scene.a * log_slip_rate + point.psi
    friction = scene.frictional_stress_from_strength(excess, point.psis)
    if friction is None:
        raise MotionStopped(Status.NORMAL_STRESS_LOST, "the normal stress vanishes at the step")
    return point._replace(log_slip_rate=log_slip_rate, frictional_stress=friction)


def check_forward_slip_is_possible_at_start(
    scene: Scene, start_point: MotionPoint | None = None
) -> None:
    """Raise MotionStopped if the loading step makes forward slip impossible.

    Parameters
    ----------
    scene : Scene
        Scene after the loading step.
    start_point : MotionPoint, optional
        Point after the step. By default, the loading step from the initial stress is checked.

    Raises
    ------
    MotionStopped
        If normal stress vanishes. The exception is also raised if shear stress changes sign, unless
        the friction law is regularised and the load point moves.
    """
    slider = scene.parts.slider_parameters
    begins = slider.initial_stress + scene.spring_stress_step
    spring_stress = begins if start_point is None else start_point.spring_stress
    lost = spring_stress <= scene.parts.normal_stress.compute_frictional_stress_lower_bound(scene)
    if lost or (
        start_point
        and scene.compute_effective_normal_stress(spring_stress, start_point.psis)
        <= regime_switching.MIN_NORMAL_STRESS
    ):
        raise MotionStopped(Status.NORMAL_STRESS_LOST, "the normal stress vanishes at the step")
    if slider.mu_star + spring_stress > 0.0:
        return
    steps = start_point is None or scene.spring_stress_step
    now = "the step changes the shear stress to" if steps else "the shear stress has changed to"
    text = f"{now} {slider.mu_star + spring_stress:.3g} sigma_*"
    if not scene.parts.law.regularised:
        raise MotionStopped(
            Status.SHEAR_STRESS_REVERSED, f"{text}. Reversed slip requires regularised=True"
        )
    if scene.load_velocity == 0.0:
        text = f"{text}, and reversed slip decays because the load point is at rest"
        raise MotionStopped(Status.SHEAR_STRESS_REVERSED, text)
