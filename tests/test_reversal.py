"""Tests of the regularised form of friction, for which slip may reverse."""

import math

import numpy as np
import pytest

from rsfstudy import Scene, history, protocol, simulate
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import IncompleteWarning
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES
from rsfstudy.motion.integration_events import EventKind, maximum, minimum
from rsfstudy.motion.integrator import Integrator
from rsfstudy.responses._motion_quantities import choose_friction_quantity_for_events
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.slider import stability
from rsfstudy.slider.friction import build_friction_relation
from rsfstudy.status import Status

CONSTANT, VARIABLE = {"normal_stress": "constant"}, {"normal_stress": "variable"}


@pytest.mark.parametrize("stress", [CONSTANT, VARIABLE])
def test_slip_forward_is_what_it_is_without(stress):
    """For forward slip, the regularised form has a negligible effect.

    The forms differ by exp(-2 mu/a), so the tolerance is the rounding error.
    """
    plain = Scene(stiffness_ratio=1.5, **stress)
    both_ways = plain.with_(regularised=True)
    for friction in (-0.2, 0.0, 0.1):
        there, here = (
            build_friction_relation(both_ways)(friction),
            build_friction_relation(plain)(friction),
        )
        assert there == pytest.approx(here, rel=1e-13, abs=1e-15)
    assert both_ways.critical_stiffness == pytest.approx(plain.critical_stiffness, rel=1e-9)
    step, other = (CriticalStep()(scene, Accuracy(1e-6)) for scene in (plain, both_ways))
    assert step.status is other.status is Status.OK
    allowed = (
        step.values["critical_velocity_ratio_error"] + other.values["critical_velocity_ratio_error"]
    )
    assert other.values["critical_velocity_ratio"] == pytest.approx(
        step.values["critical_velocity_ratio"], abs=allowed
    )


def test_friction_is_odd_in_slip_rate():
    """Friction is an odd function of slip rate."""
    scene = Scene(regularised=True, **CONSTANT)
    for above in (1e-6, 0.01, 0.3):
        there, slope, *_ = build_friction_relation(scene)(above - scene.mu_star)
        mirrored, other_slope, *_ = build_friction_relation(scene)(-above - scene.mu_star)
        assert mirrored == pytest.approx(there, rel=1e-12)
        assert other_slope == pytest.approx(-slope, rel=1e-12)
    # Near zero stress, the fault is viscous: V = 2 V_* exp(-mu_*/a) tau/(a sigma).
    value = build_friction_relation(scene)(1e-9 - scene.mu_star)[0]
    linear = math.log(2e-9 / scene.a) - scene.mu_star / scene.a
    assert value / scene.a == pytest.approx(linear, rel=1e-9)


@pytest.mark.parametrize("load", [1.0, 10.0, 100.0, 1e4])
@pytest.mark.parametrize("stress", [CONSTANT, {**VARIABLE, "alpha": 0.0}])
def test_steady_friction_stays_positive(stress, load):
    """Steady friction is ``a arcsinh{exp[(mu_* + Theta_ss)/a] V/(2 V_*)}``.

    Steady friction is positive even if mu_* + (a - b) ln V is negative.
    """
    scene = Scene(
        law="slip", b_over_a=2.0, mu_star=0.05, regularised=True, stiffness=0.01,
        load_velocity_ratio=load, **stress,
    )  # fmt: skip
    held = (scene.mu_star - scene.b * math.log(load)) / scene.a
    exact = scene.a * math.asinh(0.5 * load * math.exp(held))
    values = LinearStability()(scene, Accuracy()).values
    assert values["steady_friction"] == pytest.approx(exact, rel=1e-11)
    if stress == CONSTANT:
        # The weakening of the arcsinh form contains a factor of tanh(mu_ss/a).
        weakens = (scene.b - scene.a) * math.tanh(exact / scene.a)
        assert stability.compute_critical_stiffness(scene, math.log(load)) == pytest.approx(
            weakens, rel=1e-9
        )


#: Friction without state evolution, for which slip reverses within a few D_c.
TURNS = {"law": "slip", "a": 0.01, "b_over_a": 0.0, "mu_star": 0.1, "stiffness": 0.02}


def unloaded(time, back):
    """Return the shear stress for a load point that moves back.

    The motion starts from steady sliding at V_* and has no state evolution. The equation
    ``dtau/dt = -K [r + 2 exp(-mu_*/a) sinh(tau/a)]`` is a Riccati equation of exp(tau/a).
    """
    a, weak = TURNS["a"], 2.0 * math.exp(-TURNS["mu_star"] / TURNS["a"])
    root = math.hypot(back, weak)
    rests, other = weak / (back + root), -(back + root) / weak
    start = math.exp(math.asinh(1.0 / weak))
    ratio = (start - rests) / (start - other) * np.exp(-TURNS["stiffness"] / a * root * time)
    return a * np.log((rests - ratio * other) / (1.0 - ratio))


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("of", ["displacement", "velocity", "protocol"])
def test_a_load_point_that_moves_back_unloads_and_reverses(of, engine):
    """The stress agrees with the closed form while slip reverses.

    The loading is a record or a protocol.
    """
    time, rate = np.linspace(0.5, 20.0, 40), 1.5
    sampled = {"displacement": [0.0, -45.0], "velocity": [-rate, -rate]}
    back = protocol([{"velocity": -rate}])
    if of != "protocol":
        back = history({"time": [0.0, 30.0], of: sampled[of]})
    scene = Scene(**TURNS, **CONSTANT, regularised=True, loading=back)
    ran = simulate(scene, times=time, rtol=1e-9, engine=engine)
    # The measured error of 1e-11 is the accuracy of ln V times a.
    assert ran.shear_stress.values == pytest.approx(unloaded(time, rate), abs=1e-10)
    assert ran.load_point_displacement.values == pytest.approx(-rate * time, abs=1e-9)
    assert ran.log10_slip_rate[-1] == pytest.approx(math.log10(rate), abs=1e-5)
    assert ran.slip[-1] < -15.0


@pytest.mark.parametrize("law", ["slowness", "slip"])
def test_slip_back_is_a_mirror_of_slip_forward(law):
    """Backward slip mirrors forward slip, including a velocity step.

    While the direction changes, the fault is locked and the spring unloads linearly.
    """
    fields = {"law": law, "a": 0.01, "b_over_a": 1.4, "stiffness": 0.02, **CONSTANT}
    on = Scene(**fields, loading=protocol([{"velocity": 3.0}]))
    times = np.linspace(0.5, 12.0, 24)
    known = simulate(on, times=times, rtol=1e-8, engine=COMPILED).shear_stress
    back = [{"velocity": -1.0, "duration": 120.0}, {"velocity": -3.0}]
    scene = Scene(**fields, regularised=True, loading=protocol(back))
    ran = simulate(scene, times=[20.0, 50.0, *(120.0 + times)], rtol=1e-8, engine=COMPILED)
    assert float(ran.shear_stress[0] - ran.shear_stress[1]) == pytest.approx(0.6, abs=1e-9)
    np.testing.assert_allclose(-ran.shear_stress[2:], known, atol=1e-7)


def test_stress_turns_first_where_slip_back_is_as_fast_as_the_load_point():
    fields = {"law": "slowness", "a": 0.01, "b_over_a": 1.4, "stiffness": 0.02, **CONSTANT}
    scene = Scene(**fields, regularised=True, loading=protocol([{"velocity": -1.0}]))
    of = choose_friction_quantity_for_events(scene)[0]
    watches = [minimum(of, terminal=True), maximum(of, terminal=True)]
    *_before, turn = Integrator(Accuracy(1e-6, 10**5)).follow(scene, watches, until=100.0)
    assert turn.kind is EventKind.MINIMUM
    assert turn.point.log_slip_rate == pytest.approx(0.0, abs=1e-6)
    assert turn.point.spring_stress < -2.0 * scene.mu_star


def test_a_motion_that_slips_back_says_so():
    hold = protocol([{"velocity": -1.0, "duration": 100.0}, {"velocity": 0.0}])
    scene = Scene(**CONSTANT, stiffness=0.02, regularised=True, loading=hold)
    with pytest.warns(IncompleteWarning, match="the shear stress has changed to -"):
        assert simulate(scene).attrs["status"] == "shear_stress_reversed"
