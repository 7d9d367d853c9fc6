"""Tests of the effects of normal stress: derivatives, limits and cost."""

import itertools
import math
import types

import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_helpers import cot_phi
from rsfstudy.named_studies import effects

from rsfstudy import Scene
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider.equations import (
    build_equations_against_displacement,
    build_equations_against_inertial_time,
    build_equations_at_imposed_slip_rate,
    build_equations_between_ruptures,
    build_equations_in_rupture,
    build_equations_without_mass,
    compute_quasi_static_log_slip_rate,
)
from rsfstudy.slider.friction import build_friction_relation

shear = st.floats(-0.5, 0.5)


@given(shear, st.floats(50.0, 87.0), st.floats(0.1, 0.9))
def test_strength_is_shear_over_normal_stress(g, phi, mu_star):
    """The relation equals tau/sigma - mu_* from the stresses."""
    scene = Scene(phi=phi, mu_star=mu_star, alpha=0.0)
    ratio = 1.0 + cot_phi(scene) * g
    exact = (mu_star + g) / ratio - mu_star
    assert build_friction_relation(scene)(g)[0] == pytest.approx(exact, abs=4e-15 / ratio)


@given(shear, st.floats(0.0, 1.2), st.floats(50.0, 89.0))
def test_slopes_are_derivatives(g, alpha, phi):
    relation, h = build_friction_relation(Scene(alpha=alpha, phi=phi)), 1e-6
    ahead, behind, here = relation(g + h), relation(g - h), relation(g)
    for value in (0, 2):
        numeric = (ahead[value] - behind[value]) / (2 * h)
        # The error of central differences is h**2 f'''/6, plus a rounding error of 1e-16/h.
        assert here[value + 1] == pytest.approx(numeric, rel=1e-7, abs=1e-9)


@given(shear, st.floats(0.01, 1.0), st.floats(50.0, 87.0))
def test_the_shift_is_the_integral_of_the_linker_dieterich_term(g, alpha, phi):
    """The shift is the integral of dTheta = -alpha dsigma/sigma (eq. 2)."""
    scene = Scene(alpha=alpha, phi=phi)
    cot = cot_phi(scene)
    _value, _slope, shift, slope = build_friction_relation(scene)(g)
    assert -shift == pytest.approx(-alpha * math.log(1.0 + cot * g), abs=1e-14)
    assert slope == pytest.approx(alpha * cot / (1.0 + cot * g), rel=1e-14)


def eq_13(scene: Scene, displacement: float) -> float:
    """Return the slip rate after a displacement step by corrected eq. 13.

    The closing bracket of the published equation is misplaced.
    """
    jump = scene.stiffness * displacement
    ratio = 1.0 + cot_phi(scene) * jump
    state = -(scene.alpha or 0.0) * math.log(ratio)
    driving = (1.0 - cot_phi(scene) * (scene.mu_star + state)) * jump / scene.a - state / scene.a
    return math.exp(driving / ratio)


@given(st.floats(-3.0, 5.0), st.floats(0.0, 1.0), st.floats(45.0, 85.0))
def test_jump_of_slip_rate_is_eq_13(displacement, alpha, phi):
    scene = Scene(alpha=alpha, phi=phi, displacement_step=displacement)
    ours = math.exp(compute_quasi_static_log_slip_rate(scene, scene.spring_stress_step, 0.0))
    assert ours == pytest.approx(eq_13(scene, displacement), rel=1e-12)


@given(shear)
def test_alpha_to_zero_is_the_effect_absent(g):
    absent, vanishing = (
        build_friction_relation(Scene(alpha=0.0)),
        build_friction_relation(Scene(alpha=1e-12)),
    )
    for ours, theirs in zip(vanishing(g), absent(g), strict=True):
        assert ours == pytest.approx(theirs, abs=3e-12)


@given(shear)
def test_phi_to_90_degrees_is_constant_normal_stress(g):
    absent = build_friction_relation(Scene(normal_stress="constant"))
    vanishing = build_friction_relation(Scene(phi=90.0 - 1e-10))
    for ours, theirs in zip(vanishing(g), absent(g), strict=True):
        assert ours == pytest.approx(theirs, abs=1e-11)  # cot(phi) = 1.7e-12


@pytest.mark.parametrize(
    ("equations", "unknowns"),
    [
        (build_equations_at_imposed_slip_rate(Scene(normal_stress="constant"), 1.0), 1),
        (build_equations_at_imposed_slip_rate(Scene(), 1.0), 1),
        (build_equations_between_ruptures(Scene(normal_stress="constant"), with_time=False), 2),
        (build_equations_between_ruptures(Scene(alpha=0.0), with_time=False), 2),
        (build_equations_between_ruptures(Scene(), with_time=False), 2),
        (build_equations_between_ruptures(Scene(), with_time=True), 3),
        (build_equations_between_ruptures(Scene(radiation_damping=0.1), with_time=False), 2),
        (build_equations_between_ruptures(Scene(inertia=True), with_time=False), 2),
        (build_equations_in_rupture(Scene(inertia=True)), 3),
    ],
)
def test_number_of_unknowns(equations, unknowns):
    assert len(equations.unknown_names) == len(equations.unknown_scales) == unknowns
    assert len(equations.evaluate_rates([0.01] * unknowns)) == unknowns


def test_the_same_functions_serve_all_scenes_of_the_same_parts():
    """The functions contain no parameters of a scene.

    All parameters are arguments.
    """
    one, other = (
        build_equations_between_ruptures(
            Scene(a=a, phi=phi, load_velocity_ratio=load), with_time=False
        )
        for a, phi, load in ((0.01, 55.0, 2.0), (0.02, 70.0, 3.0))
    )
    assert one.rate_function is other.rate_function
    assert one.motion_point_function is other.motion_point_function
    assert one.parameters != other.parameters
    assert all(isinstance(number, float) for number in one.parameters)
    cells = (cell.cell_contents for cell in one.rate_function.__closure__ or ())
    assert all(isinstance(value, types.FunctionType | int) for value in cells)


@pytest.mark.parametrize(
    "parts",
    [
        {"law": "two_slowness_states", "inertia": True},
        {"fluid": "dilatant", "radiation_damping": 1e-6},
        {"normal_stress": "imposed", "oscillation_amplitude": 0.1, "law": "slowness"},
        {"velocity_oscillation": 0.1, "regularised": True},
        {"normal_stress": "constant", "stress_dependence": 0.5, "inertia": True},
    ],
)
def test_scenes_of_the_same_parts_share_all_functions(parts):
    """Equations of a new scene need no new functions, so nothing is compiled again."""
    one, other = (Scene(**parts, a=a, stiffness=0.01) for a in (0.01, 0.012))
    assert one.friction_law_functions == other.friction_law_functions
    builders = [
        lambda scene: build_equations_between_ruptures(scene, with_time=True),
        lambda scene: build_equations_without_mass(scene, with_time=False),
        lambda scene: build_equations_against_displacement(scene),
        lambda scene: build_equations_at_imposed_slip_rate(scene, 0.5),
    ]
    if one.has_mass:
        builders += [build_equations_in_rupture, build_equations_against_inertial_time]
    for build in builders:
        first, second = build(one), build(other)
        assert first.rate_function is second.rate_function
        assert first.motion_point_function is second.motion_point_function
        assert first.force_balance_function is second.force_balance_function


def test_trial_states_outside_of_the_physics_give_finite_rates():
    """Unphysical trial states produce finite rates without an exception."""
    scenes = Scene(), Scene(law="slowness"), Scene(normal_stress="constant")
    fluid = Scene(fluid="dilatant"), Scene(fluid="dilatant", displacement_step=1.0)
    for scene in (*scenes, *fluid):
        massive = scene.with_(inertia=True)
        for wild, psi in itertools.product((-1e6, -2.0, -1.7320508, 3.0, 1e6), (-50.0, 0.0, 50.0)):
            pores = [wild, psi][: scene.state_count - 1]
            for system in (
                build_equations_between_ruptures(s, with_time=True) for s in (scene, massive)
            ):
                assert all(map(math.isfinite, system.evaluate_rates([wild, psi, *pores, 0.0])))
            for x in (-1e4, 0.0, 1e4):
                assert all(
                    map(
                        math.isfinite,
                        build_equations_in_rupture(massive).evaluate_rates([wild, x, wild, *pores]),
                    )
                )


def test_what_a_right_hand_side_costs_is_relative_to_the_plainest_of_the_moment(monkeypatch):
    """The relative cost is independent of changes in machine speed.

    The simulated machine slows down steadily and is ten times slower in some turns.
    """
    slowness = {"quasi_static": 1.0, "slow_manifold": 4.0, "inertial": 3.0}
    turns = itertools.count()

    def seconds(equations, _state):
        turn = next(turns) // 3
        return (1.0 + turn) * (10.0 if turn % 4 == 0 else 1.0) * slowness[equations.regime_name]

    monkeypatch.setattr(effects, "_time_right_hand_side", seconds)
    found = effects.EffectCost()(Scene(inertia=True), Accuracy(1e-3)).values
    assert found["evaluation_cost"] == pytest.approx(4.0, rel=1e-12)
    assert found["evaluation_cost_in_rupture"] == pytest.approx(3.0, rel=1e-12)
