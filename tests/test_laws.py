"""State evolution laws: contract over every law found, and closed forms of the two of the paper."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsfstudy import Scene
from rsfstudy.motion.stepping import Meter, steps
from rsfstudy.slider import laws
from rsfstudy.slider.assembly import functions
from rsfstudy.slider.equations import evolution_of, rigid


@pytest.mark.parametrize("law", sorted(laws.PARTS))
def test_every_law_rests_on_the_steady_state_line(law):
    """Theta = -b ln V is where every law is at rest, and either side of it returns."""
    evolution = evolution_of(Scene(law=law))
    for log_rate in (-30.0, 0.0, 12.0):
        steady = -0.029 * log_rate
        assert evolution(log_rate, steady) == pytest.approx(0.0, abs=1e-15)
        assert evolution(log_rate, steady + 1e-3) < 0.0 < evolution(log_rate, steady - 1e-3)


@given(st.floats(-20, 20), st.floats(-1e-6, 1e-6), st.floats(1e-3, 0.1))
def test_laws_agree_close_to_the_steady_state(log_rate, away, b):
    """Both linearise to -(Theta + b ln V); the difference is of second order, away**2/(2 b)."""
    state = -b * log_rate + away
    allowed = away**2 / b + 1e-15
    slip, slowness = (
        evolution_of(Scene(law=law, a=0.5 * b))(log_rate, state) for law in ("slip", "slowness")
    )
    assert slip == pytest.approx(slowness, abs=allowed)


def state_after(law: str, log_rate: float, slipped: float) -> float:
    """State variable of a rigid slider at constant normal stress, integrated over slip."""
    scene = Scene(law=law, normal_stress="constant")
    for step in steps(rigid(scene, log_rate), [scene.a * log_rate], 1e-12, Meter(10**6)):
        if step.end >= slipped:
            point = step.point_at(slipped)
            return point.imbalance - scene.b * log_rate
    raise AssertionError


@pytest.mark.parametrize("log_rate", [math.log(200.0), math.log(10.0), -math.log(1e4)])
@pytest.mark.parametrize("slipped", [0.1, 1.0, 3.5])
def test_slip_law_decays_exponentially_with_slip(log_rate, slipped):
    b = Scene().b
    exact = -b * log_rate * -math.expm1(-slipped)
    # local tolerance 1e-12 of a scale of a, over tens of steps
    assert state_after("slip", log_rate, slipped) == pytest.approx(exact, abs=1e-11)


@pytest.mark.parametrize("log_rate", [math.log(200.0), math.log(10.0), -math.log(1e4)])
@pytest.mark.parametrize("slipped", [0.1, 1.0, 3.5])
def test_slowness_law_at_constant_rate_is_eq_16(log_rate, slipped):
    """theta = D_c/V + (D_c/V_* - D_c/V) exp(-slip/D_c)."""
    b, rate = Scene().b, math.exp(log_rate)
    exact = b * math.log(1.0 / rate + (1.0 - 1.0 / rate) * math.exp(-slipped))
    assert state_after("slowness", log_rate, slipped) == pytest.approx(exact, abs=1e-11)


def test_slowness_law_needs_3p5_slip_distances_to_lose_1_minus_1_over_e():
    """C5: at V = 200 V_* the stress drop reaches 1 - 1/e of its total after 3.4978 D_c."""
    log_rate = math.log(200.0)
    total = Scene().b * log_rate
    left = total + state_after("slowness", log_rate, 3.4978)
    assert left / total == pytest.approx(math.exp(-1.0), abs=1e-5)  # slip is given to 4 decimals


@given(st.floats(-3000.0, 30.0), st.floats(-60.0, 60.0), st.floats(-20.0, 5.0))
def test_evolution_goes_over_to_that_of_stationary_contact(log_rate, log_theta, log_load):
    """Slowness law, in time: b (V_*/theta - V)/(V + V_0) per unit of slip and load point
    displacement, whatever the slip rate; slip law: none without slip.
    """
    b, slip_rate, load = 0.03, math.exp(log_rate), math.exp(log_load)
    exact = b * (math.exp(-log_theta) - slip_rate) / (slip_rate + load)
    rounding = b * 1e-13 * (math.exp(-log_theta) + slip_rate) / (slip_rate + load)

    def evolving(law: str) -> float:
        scene = Scene(law=law, a=0.5 * b, load_velocity_ratio=load)
        return functions(scene)["evolving"](log_rate, (b * log_theta,), 0.0, scene.numbers)[0]

    # exp(-100) of the slip rate is taken too much where slip is slower than that
    assert evolving("slowness") == pytest.approx(exact, abs=100.0 * rounding + 1e-40)
    share = slip_rate / (slip_rate + load)
    slipping = -share * b * (log_theta + log_rate)
    assert evolving("slip") == pytest.approx(slipping, rel=1e-12, abs=1e-40)
