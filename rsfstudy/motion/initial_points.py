"""Starting points of motions: of the first, and after each jump of the loading.

When motions change between their regimes is for `regime_switching` to say.
"""

from __future__ import annotations

import math

from scipy.optimize import newton

from rsfstudy.motion import regime_switching
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.parts import Segment
from rsfstudy.slider import (
    MotionPoint,
    Numbers,
    Scene,
    compute_steady_states,
    effective_normal_stress_at,
    equations_between_ruptures,
    frictional_stress_after_jump,
)
from rsfstudy.status import Status

_UNEVALUATED_FIELDS = (math.nan,) * len(MotionPoint._fields[5:-1])


def initial_point(scene: Scene) -> MotionPoint:
    """The beginning of a motion the instant after the step of a scene (see `unevaluated_point`),
    which moves the spring and imposed normal stress: with mass, slip rate follows within the
    inertial time. Before it the slider slides steadily at V_*, or as its stated stress and state
    have it.

    Raises
    ------
    MotionStopped
        Where the step leaves no friction of forward slip to integrate.
    """
    check_start_has_friction(scene)
    psis, log_slip_rate = compute_steady_states(scene, 0.0, 0.0), 0.0
    if scene.starts_unsteady:
        psis, log_slip_rate = _find_specified_initial_states(scene, psis)
    psis = _replace_loading_unknowns(scene, psis)
    stress = scene.parts.slider.initial_stress + scene.spring_stress_step
    stepped = point_without_derived_values(scene, stress, psis)
    return point_with_slip_rate(scene, stepped, log_slip_rate) if scene.has_mass else stepped


def point_before_start(scene: Scene) -> MotionPoint:
    """The point of a motion before its first step."""
    before = scene.with_segment(Segment(1.0))
    psis = compute_steady_states(before, 0.0, 0.0)
    if scene.starts_unsteady:
        psis = _find_specified_initial_states(scene, psis)[0]
    return slow_manifold_point(before, scene.parts.slider.initial_stress, psis)


def point_without_derived_values(
    scene: Scene,
    spring_stress: float,
    states: Numbers,
    log_slip_rate: float = math.nan,
    frictional_stress: float = math.nan,
) -> MotionPoint:
    """A point that holds what a motion begins with: spring stress, states and, with mass, ln(V/V_*)
    and frictional stress. All else is NaN, and told with the first event.
    """
    psi = scene.equation_functions.friction_functions.state_sum(states)
    known = log_slip_rate, math.nan, spring_stress, frictional_stress, psi
    return MotionPoint._make((*known, *_UNEVALUATED_FIELDS, states))


def restart_point(scene: Scene, spring_stress: float, states: Numbers) -> MotionPoint:
    """The point at which a motion may begin again with this spring stress and these states, which
    is on the slow manifold.

    Raises
    ------
    MotionStopped
        If the spring stress is incompatible with friction of forward slip.
    """
    x, friction, _shift = scene.equation_functions.force_balance_function(
        spring_stress, states, scene.parameter_values
    )
    point = point_without_derived_values(scene, spring_stress, states, x, friction)
    check_start_has_friction(scene, point)
    return point


def _replace_loading_unknowns(scene: Scene, states: Numbers) -> Numbers:
    """States with those of the loading, behind those of the law, as it begins with them; without
    those of a loading that has ended.
    """
    begun, of_law = scene.parts.loading.initial_unknowns(scene), scene.parts.law.state_count
    return (*states[:of_law], *begun, *states[of_law + len(begun) : scene.state_count])


def _find_specified_initial_states(scene: Scene, steady_states: Numbers) -> tuple[Numbers, float]:
    """States freed of stress, and ln(V/V_*), of the stress and state that a scene begins with: Psi
    is sought with which the state variable is the one stated.
    """
    before = scene.with_segment(Segment(1.0))
    others = steady_states[1 : before.state_count]

    def begun(psi: float) -> MotionPoint:
        return slow_manifold_point(before, scene.initial_stress, (psi, *others))

    def missing(psi: float) -> float:
        return scene.initial_state - begun(psi).state

    psi = float(newton(missing, scene.initial_state, tol=1e-15))
    return (psi, *steady_states[1:]), begun(psi).log_slip_rate


def point_after_loading_jump(scene: Scene, point: MotionPoint) -> MotionPoint:
    """A point of a motion the instant after a step of the load point or of imposed normal stress,
    or where an oscillation begins or ends: states stay, and with mass slip rate does.

    Raises
    ------
    MotionStopped
        As `starting` does.
    """
    psis = _replace_loading_unknowns(scene, point.psis)
    after = point._replace(spring_stress=point.spring_stress + scene.spring_stress_step, psis=psis)
    check_start_has_friction(scene, after)
    return point_with_slip_rate(scene, after, point.log_slip_rate) if scene.has_mass else after


def point_with_slip_rate(scene: Scene, point: MotionPoint, log_slip_rate: float) -> MotionPoint:
    """A point with another ln(V/V_*), and the frictional stress that goes with it."""
    excess = scene.a * log_slip_rate + point.psi
    friction = frictional_stress_after_jump(scene, excess, point.psis)
    if friction is None:
        raise MotionStopped(Status.NORMAL_STRESS_LOST, "the step takes normal stress away")
    return point._replace(log_slip_rate=log_slip_rate, frictional_stress=friction)


def slow_manifold_point(scene: Scene, spring_stress: float, states: Numbers) -> MotionPoint:
    """The point with this spring stress and these states, where mass hardly acts."""
    return equations_between_ruptures(scene, with_time=False).evaluate_point(
        (spring_stress, *states)
    )


def check_start_has_friction(scene: Scene, start_point: MotionPoint | None = None) -> None:
    """Refuse a displacement step that leaves no friction of forward slip to integrate; it is that
    of the beginning, or leads to a point.
    """
    slider = scene.parts.slider
    begins = slider.initial_stress + scene.spring_stress_step
    spring_stress = begins if start_point is None else start_point.spring_stress
    lost = spring_stress <= scene.parts.normal_stress.min_frictional_stress(scene)
    if lost or (
        start_point
        and effective_normal_stress_at(scene, spring_stress, start_point.psis)
        <= regime_switching.MIN_NORMAL_STRESS
    ):
        raise MotionStopped(Status.NORMAL_STRESS_LOST, "the step takes normal stress away")
    if slider.mu_star + spring_stress > 0.0:
        return
    steps = start_point is None or scene.spring_stress_step
    now = "the step takes shear stress to" if steps else "shear stress has gone to"
    text = f"{now} {slider.mu_star + spring_stress:.3g} sigma_*"
    if not scene.parts.law.regularised:
        raise MotionStopped(
            Status.SHEAR_STRESS_REVERSED, f"{text}; slip may reverse where regularised=True"
        )
    if scene.load_velocity == 0.0:
        text = f"{text}, where slip backwards dies out under a load point at rest"
        raise MotionStopped(Status.SHEAR_STRESS_REVERSED, text)
