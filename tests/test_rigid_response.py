"""Tests of the response of a rigid slider to a velocity step.

The tests cover closed forms at constant normal stress, and the effect of variable normal
stress.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from rsfstudy import Scene
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.responses.rigid_response import RigidResponse
from rsfstudy.slider.equations import compute_quasi_static_log_slip_rate
from rsfstudy.status import Status


def response(rate: float, **fields) -> dict:
    outcome = RigidResponse()(Scene(load_velocity_ratio=rate, **fields), Accuracy())
    assert outcome.status is Status.OK, outcome.message
    return dict(outcome.values)


SLIP = RigidResponse().output_coordinates["slip"]
CONSTANT = {"normal_stress": "constant"}


@pytest.mark.parametrize("rate", [1e-4, 0.1, 10.0, 200.0, 1e4])
@pytest.mark.parametrize("law", ["slowness", "slip"])
def test_stress_at_constant_normal_stress_is_eqs_17(law, rate):
    """The stress agrees with eqs. 17a and 17b.

    Relative to mu_* sigma + a sigma ln V, the stress is -b ln V + b ln[1 + (V - 1)
    exp(-slip)] for the slowness law and -b ln V [1 - exp(-slip)] for the slip law.
    """
    scene = Scene()
    left = math.log(rate) * np.exp(-SLIP)
    left = left if law == "slip" else np.log1p((rate - 1.0) * np.exp(-SLIP))
    exact = scene.mu_star + (scene.a - scene.b) * math.log(rate) + scene.b * left
    found = response(rate, law=law, **CONSTANT)
    np.testing.assert_allclose(found["shear_stress"], exact, atol=1e-9 * scene.a * 20)
    np.testing.assert_allclose(found["state_variable"], scene.b * (left - math.log(rate)),
                               atol=1e-9 * scene.a * 20)  # fmt: skip


@pytest.mark.parametrize("rate", [1e-4, 0.1, 10.0, 1e4])
def test_slip_law_at_constant_normal_stress_decays_over_one_slip_distance(rate):
    """The evolution of the slip law falls to 1/e after D_c (eq. 17b)."""
    found = response(rate, law="slip", **CONSTANT)
    assert found["evolution_distance"] == pytest.approx(1.0, abs=1e-7)
    assert found["evolution_distance_error"] < 1e-6
    assert found["direct_stress_change"] == pytest.approx(Scene().a * math.log(rate), rel=1e-12)


def test_small_steps_of_the_slowness_law_are_eq_17b():
    found = response(1.0 + 1e-4, law="slowness", **CONSTANT)
    # ln(1 + x) = x for x < 1e-4.
    assert found["evolution_distance"] == pytest.approx(1.0, abs=1e-4)


def test_slip_of_3p5_of_the_paper():
    found = response(200.0, law="slowness", **CONSTANT)
    assert found["evolution_distance"] == pytest.approx(3.4978, abs=5e-5)


@pytest.mark.parametrize("law", ["slip", "slowness"])
@pytest.mark.parametrize("rate", [1e-3, 1e3])
def test_ends_of_a_response_are_the_direct_effect_and_the_steady_state(law, rate):
    scene = Scene(law=law, load_velocity_ratio=rate)
    found = response(rate, law=law)
    direct = found["direct_stress_change"]
    assert compute_quasi_static_log_slip_rate(scene, direct, 0.0) == pytest.approx(
        math.log(rate), rel=1e-12
    )
    assert found["shear_stress"][0] == pytest.approx(scene.mu_star + direct, rel=1e-14)
    mu_ss = scene.mu_star - (scene.b - scene.a) * math.log(rate)
    far = RigidResponse(slip=60.0)(scene, Accuracy()).values
    last = far["shear_stress"][-1] / far["normal_stress_ratio"][-1]
    assert last == pytest.approx(mu_ss, abs=1e-6)


def test_variable_normal_stress_makes_up_and_down_steps_unequal():
    assert response(1e-3, **CONSTANT)["direct_asymmetry"] == pytest.approx(0.0, abs=1e-12)
    assert response(1e-3, **CONSTANT)["evolution_asymmetry"] == pytest.approx(0.0, abs=1e-12)
    # For downward steps, the direct effect is smaller and the evolution is larger.
    assert response(1e-3)["direct_asymmetry"] < -0.05
    assert response(1e-3)["evolution_asymmetry"] > 0.05


@pytest.mark.parametrize("rate", [1e-16, 1e-8, 1e8])
def test_the_closed_form_keeps_its_digits(rate):
    assert response(rate, law="slowness", **CONSTANT)["closed_form_misfit"] < 1e-8


@pytest.mark.parametrize("step", [0.5, -0.4])
@pytest.mark.parametrize("law", ["two_slip_states", "two_slowness_states"])
def test_two_states_each_lose_their_share_to_a_step_of_normal_stress(law, step):
    """The evolution distance follows from the closed forms of both states.

    Each state starts at b_i ln V minus its share of alpha ln r. The evolution distance ends
    at 1/e of the sum.
    """
    b, lengths = np.array([0.01, 0.008]), np.array([1.0, 10.0])
    begins = b * math.log(10.0) - b / b.sum() * 0.5 * math.log1p(step)

    def left(slip: float) -> float:
        decay = np.exp(-slip / lengths)
        if law == "two_slip_states":
            return float((begins * decay).sum())
        return float((b * np.log1p(np.expm1(begins / b) * decay)).sum())

    exact = brentq(lambda slip: left(slip) - left(0.0) / math.e, 0.0, 30.0, xtol=1e-12)
    found = response(10.0, law=law, normal_stress="imposed", alpha=0.5, a=0.01, b1_over_a=1.0,
                     b2_over_a=0.8, length_ratio=10.0, mu_star=0.6, stiffness_ratio=2.0,
                     normal_stress_step=step)  # fmt: skip
    assert found["evolution_distance"] == pytest.approx(exact, rel=1e-6)
    assert abs(found["evolution_distance"] - exact) <= found["evolution_distance_error"]


@pytest.mark.parametrize("step", [0.5, -0.3])
@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_the_closed_form_is_times_the_normal_stress_after_the_step(law, step):
    found = response(10.0, law=law, normal_stress="imposed", alpha=0.0, normal_stress_step=step)
    assert found["closed_form_misfit"] < 1e-7
