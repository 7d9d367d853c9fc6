"""Starting points of motions: of the first, and after each jump of the loading.

When motions change between their regimes is for `regime_switching` to say.
"""

from __future__ import annotations

import math

from scipy.optimize import newton

from rsfstudy.motion import regime_switching
from rsfstudy.motion.meter import MotionStopped
from rsfstudy.parts import Segment
from rsfstudy.slider import (
    Numbers,
    Point,
    Scene,
    compute_steady_states,
    equations_between_ruptures,
    normal_stress_at,
    stress_after_jump,
)
from rsfstudy.status import Status

_UNEVALUATED_FIELDS = (math.nan,) * len(Point._fields[5:-1])


def initial_point(scene: Scene) -> Point:
    """The beginning of a motion the instant after the step of a scene (see `unevaluated_point`),
    which moves the spring and imposed normal stress: with mass, slip rate follows within the
    inertial time. Before it the slider slides steadily at V_*, or as its stated stress and state
    have it.

    Raises
    ------
    MotionStopped
        Where the step leaves no friction of forward slip to integrate.
    """
    check_start(scene)
    psis, log_slip_rate = compute_steady_states(scene, 0.0, 0.0), 0.0
    if scene.starts_unsteady:
        psis, log_slip_rate = _specified_initial_state(scene, psis)
    psis = _with_loading_states(scene, psis)
    stress = scene.parts.slider.initial_stress + scene.spring_stress_step
    stepped = unevaluated_point(scene, stress, psis)
    return with_slip_rate(scene, stepped, log_slip_rate) if scene.has_mass else stepped


def point_before_start(scene: Scene) -> Point:
    """The point of a motion before its first step."""
    before = scene.with_segment(Segment(1.0))
    psis = compute_steady_states(before, 0.0, 0.0)
    if scene.starts_unsteady:
        psis = _specified_initial_state(scene, psis)[0]
    return manifold_point(before, scene.parts.slider.initial_stress, psis)


def unevaluated_point(
    scene: Scene,
    spring_stress: float,
    psis: Numbers,
    log_slip_rate: float = math.nan,
    friction: float = math.nan,
) -> Point:
    """A point that holds what a motion begins with: spring stress, states and, with mass, ln(V/V_*)
    and frictional stress. All else is NaN, and told with the first event.
    """
    psi = scene.functions.friction.state_sum(psis)
    known = log_slip_rate, math.nan, spring_stress, friction, psi
    return Point._make((*known, *_UNEVALUATED_FIELDS, psis))


def restart_point(scene: Scene, spring_stress: float, psis: Numbers) -> Point:
    """The point at which a motion may begin again with this spring stress and these states, which
    is on the slow manifold.

    Raises
    ------
    MotionStopped
        If the spring stress is incompatible with friction of forward slip.
    """
    x, friction, _shift = scene.functions.balance_function(spring_stress, psis, scene.numbers)
    point = unevaluated_point(scene, spring_stress, psis, x, friction)
    check_start(scene, point)
    return point


def _with_loading_states(scene: Scene, psis: Numbers) -> Numbers:
    """States with those of the loading, behind those of the law, as it begins with them; without
    those of a loading that has ended.
    """
    begun, of_law = scene.parts.loading.initial_unknowns(scene), scene.parts.law.state_count
    return (*psis[:of_law], *begun, *psis[of_law + len(begun) : scene.state_count])


def _specified_initial_state(scene: Scene, steady_states: Numbers) -> tuple[Numbers, float]:
    """States freed of stress, and ln(V/V_*), of the stress and state that a scene begins with: Psi
    is sought with which the state variable is the one stated.
    """
    before = scene.with_segment(Segment(1.0))
    others = steady_states[1 : before.state_count]

    def begun(psi: float) -> Point:
        return manifold_point(before, scene.initial_stress, (psi, *others))

    def missing(psi: float) -> float:
        return scene.initial_state - begun(psi).state

    psi = float(newton(missing, scene.initial_state, tol=1e-15))
    return (psi, *steady_states[1:]), begun(psi).log_slip_rate


def point_after_jump(scene: Scene, point: Point) -> Point:
    """A point of a motion the instant after a step of the load point or of imposed normal stress,
    or where an oscillation begins or ends: states stay, and with mass slip rate does.

    Raises
    ------
    MotionStopped
        As `starting` does.
    """
    psis = _with_loading_states(scene, point.psis)
    after = point._replace(spring_stress=point.spring_stress + scene.spring_stress_step, psis=psis)
    check_start(scene, after)
    return with_slip_rate(scene, after, point.log_slip_rate) if scene.has_mass else after


def with_slip_rate(scene: Scene, point: Point, log_slip_rate: float) -> Point:
    """A point with another ln(V/V_*), and the frictional stress that goes with it."""
    excess = scene.a * log_slip_rate + point.psi
    friction = stress_after_jump(scene, excess, point.psis)
    if friction is None:
        raise MotionStopped(Status.NORMAL_STRESS_LOST, "the step takes normal stress away")
    return point._replace(log_slip_rate=log_slip_rate, frictional_stress=friction)


def manifold_point(scene: Scene, spring_stress: float, psis: Numbers) -> Point:
    """The point with this spring stress and these states, where mass hardly acts."""
    return equations_between_ruptures(scene, clock=False).evaluate_point((spring_stress, *psis))


def check_start(scene: Scene, start: Point | None = None) -> None:
    """Refuse a displacement step that leaves no friction of forward slip to integrate; it is that
    of the beginning, or leads to a point.
    """
    slider = scene.parts.slider
    begins = slider.initial_stress + scene.spring_stress_step
    spring_stress = begins if start is None else start.spring_stress
    lost = spring_stress <= scene.parts.normal_stress.min_frictional_stress(scene)
    if lost or (
        start
        and normal_stress_at(scene, spring_stress, start.psis) <= regime_switching.MIN_NORMAL_STRESS
    ):
        raise MotionStopped(Status.NORMAL_STRESS_LOST, "the step takes normal stress away")
    if slider.mu_star + spring_stress > 0.0:
        return
    steps = start is None or scene.spring_stress_step
    now = "the step takes shear stress to" if steps else "shear stress has gone to"
    text = f"{now} {slider.mu_star + spring_stress:.3g} sigma_*"
    if not scene.parts.law.regularised:
        raise MotionStopped(
            Status.SHEAR_STRESS_REVERSED, f"{text}; slip may reverse where regularised=True"
        )
    if scene.load_velocity == 0.0:
        text = f"{text}, where slip backwards dies out under a load point at rest"
        raise MotionStopped(Status.SHEAR_STRESS_REVERSED, text)
