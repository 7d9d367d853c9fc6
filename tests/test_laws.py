"""Tests of state evolution laws: common requirements, and closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rsfstudy.named_studies._normal_stress_transient import NormalStressTransient

from rsfstudy import Scene, simulate
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.critical_steps.monotone_slip_rate_rise_check import (
    build_single_state_evolution_function,
)
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integration_events import EventKind, approach_to_steady_state
from rsfstudy.motion.integrator import Integrator
from rsfstudy.responses.rigid_response import RigidResponse
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.slider import laws, steady_state
from rsfstudy.slider.friction import build_state_evolution_function, compute_steady_states
from rsfstudy.slider.integration_path_length import compute_velocity_ratios
from rsfstudy.slider.laws.composite import compute_lambert_w
from rsfstudy.status import Status

CONSTANT = {"normal_stress": "constant"}
CUT_OFFS = ("composite", "cut_off")


@pytest.mark.parametrize("law", sorted(laws.BUILT_IN_LAW_CLASS_BY_NAME))
def test_every_law_rests_where_it_says(law):
    """States are at rest in steady sliding and return after a perturbation.

    For most laws, the steady state is -b ln V. The tolerance is the rounding error of
    exponents of order ten, times b.
    """
    scene = Scene(law=law)
    evolutions = build_state_evolution_function(scene)
    for log_slip_rate in (-30.0, 0.0, 12.0):
        steady = compute_steady_states(scene, log_slip_rate, 0.0)
        if law not in (*CUT_OFFS, "flash_heating"):
            assert sum(steady) == pytest.approx(-scene.b * log_slip_rate, rel=1e-14)
        assert evolutions(log_slip_rate, steady, 0.0) == pytest.approx(
            [0.0] * len(steady), abs=1e-15
        )
        for i in range(len(steady)):
            for away in (1e-3, -1e-3):
                moved = tuple(psi + away * (i == j) for j, psi in enumerate(steady))
                assert evolutions(log_slip_rate, moved, 0.0)[i] * away < 0.0


@pytest.mark.parametrize("cutoff", [1e-3, 1.0, 1e3, 1e12])
@pytest.mark.parametrize("law", CUT_OFFS)
def test_friction_is_mu_star_at_the_reference_rate(law, cutoff):
    scene = Scene(law=law, cutoff_velocity_ratio=cutoff, stiffness=0.01)
    assert steady_state.compute_steady_friction_minus_reference(scene, 0.0) == pytest.approx(
        0.0, abs=1e-16
    )


@given(st.floats(-3000.0, 30.0), st.floats(-60.0, 60.0), st.floats(-20.0, 5.0))
def test_evolution_goes_over_to_that_of_stationary_contact(log_slip_rate, log_theta, log_load):
    """The evolution is accurate at any slip rate.

    For the slowness law, the rate is b (V_*/theta - V)/(V + V_0) per slip and load point
    displacement. For the slip law, the state does not evolve without slip.
    """
    b, slip_rate, load = 0.03, math.exp(log_slip_rate), math.exp(log_load)
    exact = b * (math.exp(-log_theta) - slip_rate) / (slip_rate + load)
    rounding = b * 1e-13 * (math.exp(-log_theta) + slip_rate) / (slip_rate + load)

    def evolving(law: str) -> float:
        scene = Scene(law=law, a=0.5 * b, load_velocity_ratio=load)
        x, _slower, share = compute_velocity_ratios(log_slip_rate, scene.parameter_values)
        return scene.friction_law_functions.state_evolutions(
            x, (b * log_theta,), 0.0, share, scene.parameter_values
        )[0]

    # If the slip rate is below exp(-100) of the load velocity, the rate contains an additional
    # share of exp(-100).
    assert evolving("slowness") == pytest.approx(exact, abs=100.0 * rounding + 1e-40)
    share = slip_rate / (slip_rate + load)
    slipping = -share * b * (log_theta + log_slip_rate)
    assert evolving("slip") == pytest.approx(slipping, rel=1e-12, abs=1e-40)


# ---- limits --------------------------------------------------------------------------------------


@given(st.floats(-60, 60), st.floats(-2, 2))
def test_the_ends_of_the_family_are_the_two_laws_of_the_paper(log_slip_rate, state):
    """The ends of the family are bitwise equal to the two laws."""
    for exponent, law in ((0.0, "slip"), (1.0, "slowness")):
        ours, theirs = Scene(law="family", law_exponent=exponent), Scene(law=law)
        assert build_single_state_evolution_function(ours)(
            log_slip_rate, state
        ) == build_single_state_evolution_function(theirs)(log_slip_rate, state)


@given(st.floats(-30, 30), st.floats(-20, 20))
def test_cut_offs_beyond_all_slip_leave_plainer_laws(log_slip_rate, log_theta):
    """Extreme cut-off velocities lead to the simpler laws.

    The composite law becomes the slip law for V_c = 0, and the cut-off law becomes the
    slowness law for infinite V_c. The rounding error of ln V is about 1e-14.
    """
    state = 0.029 * log_theta
    for law, cutoff, plain in (("composite", 1e-300, "slip"), ("cut_off", 1e300, "slowness")):
        ours = build_single_state_evolution_function(Scene(law=law, cutoff_velocity_ratio=cutoff))(
            log_slip_rate, state
        )
        theirs = build_single_state_evolution_function(Scene(law=plain))(log_slip_rate, state)
        assert ours == pytest.approx(theirs, rel=1e-13, abs=1e-15)


@given(st.floats(0.0, 1.0))
def test_lambert_w(value):
    w = compute_lambert_w(value)
    assert w * math.exp(w) == pytest.approx(value, rel=4e-16, abs=1e-320)


def test_steady_sliding_of_a_cut_off_keeps_its_digits_however_far_from_it():
    """The steady state is ln[(1 + r/V)/(1 + r)] with r = V_c/V_*.

    Near V_*, the steady state is -r/(1 + r) ln V.
    """
    for cutoff in (1e-6, 1.0, 1e6):
        scene = Scene(law="cut_off", cutoff_velocity_ratio=cutoff, stiffness=0.01)
        for log_slip_rate in (-900.0, -40.0, 40.0, 600.0):
            log_ratio = math.log(cutoff) - log_slip_rate
            exact = max(log_ratio, 0.0) + math.log1p(math.exp(-abs(log_ratio)))
            exact -= math.log1p(cutoff)
            ours = compute_steady_states(scene, log_slip_rate, 0.0)[0] / scene.b
            assert ours == pytest.approx(exact, rel=1e-12, abs=1e-12)
        share = cutoff / (1.0 + cutoff)
        tiny = compute_steady_states(scene, 1e-9, 0.0)[0] / scene.b
        # The second-order term is 1e-9 of the value.
        assert tiny == pytest.approx(-share * 1e-9, rel=1e-8)


# ---- a rigid slider, in closed form --------------------------------------------------------------


@pytest.mark.parametrize("rate", [1e-4, 0.1, 10.0, 1e4])
@pytest.mark.parametrize(
    "fields",
    [
        {"law": "perrin_rice_zheng"},
        {"law": "family", "law_exponent": 0.0},
        {"law": "family", "law_exponent": 0.3},
        {"law": "family", "law_exponent": 1.0},
        {"law": "cut_off", "cutoff_velocity_ratio": 30.0},
        {"law": "cut_off", "cutoff_velocity_ratio": 1e6},
    ],
    ids=str,
)
def test_a_rigid_slider_follows_the_closed_form(fields, rate):
    """The response agrees with the closed form to ten times the accuracy.

    The step is 9 in ln V, and the tolerance is relative to a.
    """
    scene = Scene(load_velocity_ratio=rate, **CONSTANT, **fields)
    found = RigidResponse()(scene, Accuracy(1e-9)).values
    assert found["closed_form_misfit"] < 1e-8 * scene.a
    assert found["shear_stress"][0] == pytest.approx(0.76 + scene.a * math.log(rate), rel=1e-14)


def test_steps_to_either_side_mirror_one_another_by_symmetric_laws_alone():
    scenes = (
        Scene(law=law, load_velocity_ratio=100.0, **CONSTANT)
        for law in laws.BUILT_IN_LAW_CLASS_BY_NAME
    )
    for scene in scenes:
        found = RigidResponse()(scene, Accuracy(1e-6)).values["evolution_distance"]
        inverse = scene.with_(load_velocity_ratio=0.01)
        other = RigidResponse()(inverse, Accuracy(1e-6)).values["evolution_distance"]
        symmetric = scene.law in ("slip", "flash_heating", "perrin_rice_zheng", "two_slip_states")
        assert (abs(found / other - 1.0) < 1e-5) is symmetric, scene.law


def test_the_composite_law_weakens_at_its_cut_off_without_b_above_a():
    scene = Scene(law="composite", b_over_a=0.95, cutoff_velocity_ratio=1.0)
    assert 0.0 < scene.critical_stiffness < 0.3 * scene.a
    assert CriticalStep()(scene, Accuracy(1e-4)).status.is_answer


@pytest.mark.parametrize("law", ["slip", "slowness", "family"])
@pytest.mark.parametrize("engine", ["scipy", "compiled"])
def test_without_b_a_step_is_relaxed_as_by_the_direct_effect_alone(law, engine):
    """Without state evolution, the relaxation has a closed form.

    The solution of ``a dx/dt = K (V_0 - exp(x))`` is ``1/V = 1/V_0 + (1 - 1/V_0) exp(-K V_0
    t/a)``. The tolerance is ten times rtol in ln V.
    """
    scene = Scene(
        law=law, b_over_a=0.0, normal_stress="constant", stiffness=0.02, load_velocity_ratio=3.0
    )
    times = np.linspace(0.0, 2.0, 9)
    motion = simulate(scene, times=times, rtol=1e-8, engine=engine)
    slowness = 1.0 / 3.0 + (1.0 - 1.0 / 3.0) * np.exp(-0.02 * 3.0 / scene.a * times)
    expected = scene.mu_star - scene.a * np.log(slowness)
    np.testing.assert_allclose(motion.shear_stress, expected, rtol=0.0, atol=1e-7 * scene.a)


@pytest.mark.parametrize("law", ["slip", "slowness", "composite", "cut_off", "perrin_rice_zheng"])
@given(b=st.floats(-3.0, 0.9).filter(lambda b: b == 0.0 or abs(b) > 1e-30))
@settings(max_examples=5, deadline=None)
def test_with_any_b_below_a_every_spring_slides_steadily_in_the_end(law, b):
    """Every slider with b < a ends in steady sliding.

    The friction is ``mu_* + (a - b) ln(V_0/V_*)`` for laws with this steady state. There is
    no limit cycle and no critical stiffness.
    """
    scene = Scene(
        law=law, b_over_a=b, normal_stress="constant", stiffness=0.02, load_velocity_ratio=3.0
    )
    accuracy = Accuracy(engine="compiled")
    assert scene.critical_stiffness == 0.0
    assert LimitCycle()(scene, accuracy).status is Status.NO_LIMIT_CYCLE
    end = steady_state.compute_steady_sliding(scene, scene.log_load_velocity)
    assert end is not None
    if law in ("slip", "slowness", "perrin_rice_zheng"):
        assert end.frictional_stress == pytest.approx(
            scene.a * (1.0 - b) * math.log(3.0), rel=1e-12
        )
    motion = Integrator(accuracy).follow(scene, [approach_to_steady_state(1e-6)])
    settled = next(event for event in motion if event.kind is EventKind.SETTLED)
    assert settled.point.spring_stress == pytest.approx(end.frictional_stress, abs=1e-5 * scene.a)


def test_b_of_zero_is_refused_where_stress_acts_on_the_state_by_alpha_over_b():
    with pytest.raises(InvalidValue, match=r"b_over_a = 0\.0.*alpha"):
        Scene(b_over_a=0.0, stiffness=0.02)
    assert Scene(b_over_a=0.0, alpha=0.0, stiffness=0.02).critical_stiffness == 0.0


def test_what_has_no_meaning_at_b_of_zero_or_next_to_it_is_answered_by_status():
    """Measures of the state evolution are not applicable without evolution."""
    plain = {"law": "slowness", "normal_stress": "constant", "stiffness": 0.02}
    accuracy = Accuracy(rtol=1e-6, engine="compiled")
    step = Scene(**plain, b_over_a=0.0, load_velocity_ratio=2.0)
    imposed = step.with_(normal_stress="imposed", alpha=0.0, load_velocity_ratio=1.0)
    for measure, scene in (
        (RigidResponse(), step),
        (RigidResponse(), step.with_(b_over_a=1e-17)),
        (StepResponse(), step),
        (NormalStressTransient(), imposed.with_(stiffness=5.0, normal_stress_step=0.02)),
    ):
        assert measure(scene, accuracy).status is Status.NOT_APPLICABLE


@pytest.mark.parametrize("b", [-3.0, -0.1, 0.5])
def test_strengthening_friction_with_radiation_is_stable_within_a_usual_budget(b):
    """The motion approaches the load velocity monotonically."""
    fields = {"law": "slowness", "normal_stress": "constant", "radiation_damping": 0.01}
    outcome = CriticalStep()(Scene(**fields, b_over_a=b, stiffness=0.02), Accuracy(1e-6))
    assert outcome.status is Status.STABLE_FOR_ALL_STEPS
