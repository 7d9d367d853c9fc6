"""Effects on normal stress: derivatives, limits, and what an absent effect costs."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsfstudy import Scene
from rsfstudy.measures import effect_cost
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider.effects import inclined_driving, inertia, linker_dieterich
from rsfstudy.slider.equations import (
    inertial,
    log_rate_at,
    quasi_static,
    rigid,
    slow_manifold,
    strength_of,
)

shear = st.floats(-0.5, 0.5)


@given(shear, st.floats(0.05, 1.2), st.floats(0.1, 0.9))
def test_friction_is_shear_over_normal_stress(g, cot_phi, mu_star):
    """tau/sigma - mu_* from the stresses themselves."""
    ratio = inclined_driving.normal_stress_ratio(g, cot_phi)
    assert ratio == pytest.approx(1.0 + cot_phi * g, rel=1e-15)
    value, _slope = inclined_driving.friction(g, ratio, mu_star, cot_phi)
    assert value == pytest.approx((mu_star + g) / ratio - mu_star, abs=4e-15 / ratio)


@given(shear, st.floats(0.0, 1.2), st.floats(50.0, 89.0))
def test_slope_of_strength_is_its_derivative(g, alpha, phi):
    strength = strength_of(Scene(alpha=alpha, phi=phi))
    h = 1e-6
    numeric = (strength(g + h)[0] - strength(g - h)[0]) / (2 * h)
    # central difference: h**2 f'''/6 plus rounding 1e-16/h
    assert strength(g)[1] == pytest.approx(numeric, rel=1e-7)


@given(shear, st.floats(0.01, 1.0), st.floats(0.05, 1.0))
def test_state_shift_is_the_integral_of_the_linker_dieterich_term(g, alpha, cot_phi):
    """dTheta = -alpha dsigma/sigma over a jump from sigma_* is eq. 2 of the paper."""
    ratio = inclined_driving.normal_stress_ratio(g, cot_phi)
    shift, slope = linker_dieterich.state_shift(ratio, alpha, cot_phi)
    assert -shift == pytest.approx(-alpha * math.log(1.0 + cot_phi * g), abs=1e-14)
    assert slope == pytest.approx(alpha * cot_phi / (1.0 + cot_phi * g), rel=1e-14)


def eq_13(scene: Scene, displacement: float) -> float:
    """Slip rate just after a displacement step, eq. 13 with its closing bracket in place."""
    jump = scene.stiffness * displacement
    ratio = 1.0 + scene.cot_phi * jump
    state = -(scene.alpha or 0.0) * math.log(ratio)
    driving = (1.0 - scene.cot_phi * (scene.mu_star + state)) * jump / scene.a - state / scene.a
    return math.exp(driving / ratio)


@given(st.floats(-3.0, 5.0), st.floats(0.0, 1.0), st.floats(45.0, 85.0))
def test_jump_of_slip_rate_is_eq_13(displacement, alpha, phi):
    scene = Scene(alpha=alpha, phi=phi, displacement_step=displacement)
    ours = math.exp(log_rate_at(scene, scene.spring_stress_step, 0.0))
    assert ours == pytest.approx(eq_13(scene, displacement), rel=1e-12)


def test_jump_of_the_paper_is_2p697():
    """C9: D_c/lambda, alpha = 0.56, k = k_cr."""
    scene = Scene(displacement_step=1.0)
    assert math.exp(log_rate_at(scene, scene.spring_stress_step, 0.0)) == pytest.approx(
        2.697, abs=6e-4
    )


@given(shear)
def test_alpha_to_zero_is_the_effect_absent(g):
    """Each effect at vanishing strength equals the effect absent."""
    absent, vanishing = strength_of(Scene(alpha=0.0)), strength_of(Scene(alpha=1e-12))
    for ours, theirs in zip(vanishing(g), absent(g), strict=True):
        assert ours == pytest.approx(theirs, abs=3e-12)


@given(shear)
def test_phi_to_90_degrees_is_constant_normal_stress(g):
    absent = strength_of(Scene(normal_stress="constant"))
    vanishing = strength_of(Scene(phi=90.0 - 1e-10))
    for ours, theirs in zip(vanishing(g), absent(g), strict=True):
        assert ours == pytest.approx(theirs, abs=1e-11)  # cot(phi) = 1.7e-12


@pytest.mark.parametrize(
    ("equations", "unknowns"),
    [
        (rigid(Scene(normal_stress="constant"), 1.0), 1),
        (rigid(Scene(), 1.0), 1),
        (quasi_static(Scene(normal_stress="constant"), clock=False), 2),
        (quasi_static(Scene(alpha=0.0), clock=False), 2),
        (quasi_static(Scene(), clock=False), 2),
        (quasi_static(Scene(), clock=True), 3),
        (slow_manifold(Scene(inertia=True), clock=False), 2),
        (inertial(Scene(inertia=True)), 3),
    ],
)
def test_number_of_unknowns(equations, unknowns):
    assert len(equations.unknowns) == len(equations.scales) == unknowns
    state = [0.01] * unknowns
    assert len(equations.rate(0.0, state)) == unknowns


def test_an_absent_effect_is_never_called(monkeypatch):
    def called(*_args):
        raise AssertionError("an effect that is not in the scene was called")

    for module, name in [
        (inclined_driving, "normal_stress_ratio"),
        (inclined_driving, "friction"),
        (linker_dieterich, "state_shift"),
        (inertia, "acceleration"),
        (inertia, "inertial_resistance"),
    ]:
        monkeypatch.setattr(module, name, called)
    system = quasi_static(Scene(normal_stress="constant"), clock=True)
    system.point([0.01, 0.0, 0.0], system.rate(0.0, [0.01, 0.0, 0.0]))
    with pytest.raises(AssertionError, match="not in the scene"):
        quasi_static(Scene(), clock=True).rate(0.0, [0.01, 0.0, 0.0])


def test_trial_states_outside_of_the_physics_give_finite_rates():
    """An integrator's trial steps may ask for anything; the answer is never NaN and never
    raises.
    """
    for scene in (Scene(), Scene(law="slowness"), Scene(normal_stress="constant")):
        for wild in (-1e6, -2.0, -1.7320508, 3.0, 1e6):
            for system in (quasi_static(scene, clock=True), slow_manifold(scene, clock=True)):
                for psi in (-50.0, 0.0, 50.0):
                    assert all(map(math.isfinite, system.rate(0.0, [wild, psi, 0.0])))
            for x in (-1e4, 0.0, 1e4):
                assert all(map(math.isfinite, inertial(scene).rate(0.0, [wild, x, wild])))


def test_what_a_right_hand_side_costs_is_relative_to_the_plainest_of_the_moment(monkeypatch):
    """On a machine that is slower every turn, and ten times slower in some."""
    slowness = {"quasi_static": 1.0, "slow_manifold": 4.0, "inertial": 3.0}
    turns = itertools.count()

    def seconds(equations, _state):
        turn = next(turns) // 3
        return (1.0 + turn) * (10.0 if turn % 4 == 0 else 1.0) * slowness[equations.regime]

    monkeypatch.setattr(effect_cost, "_seconds", seconds)
    found = effect_cost.EffectCost()(Scene(inertia=True), Accuracy(1e-3)).values
    assert found["evaluation_cost"] == pytest.approx(4.0, rel=1e-12)
    assert found["evaluation_cost_in_rupture"] == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize(
    "fields", [{"normal_stress": "constant"}, {"inertia": True}, {"radiation_damping": 1e-10}]
)
def test_every_form_of_the_equations_is_timed(fields):
    found = effect_cost.EffectCost()(Scene(**fields), Accuracy(1e-3)).values
    forms = ["", "_in_rupture"] if "inertia" in fields else [""]
    for form in forms:
        assert found[f"evaluation_cost{form}"] > 0.0
        assert found[f"time_per_evaluation{form}"] > 0.0
    assert ("evaluation_cost_in_rupture" in found) == ("inertia" in fields)
