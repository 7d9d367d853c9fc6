"""The regularised form of friction, in which slip reverses with shear stress."""

import math

import pytest
from in_time import InTime

from rsfstudy import Scene, simulate
from rsfstudy.errors import Incomplete
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.linear_stability import LinearStability
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider import stability
from rsfstudy.slider.equations import relation_of
from rsfstudy.status import Status

CONSTANT, VARIABLE = {"normal_stress": "constant"}, {"normal_stress": "variable"}
BACK = {"load_velocity_ratio": 1.0, "stiffness_ratio": 2.0}


@pytest.mark.parametrize("stress", [CONSTANT, VARIABLE])
def test_slip_goes_back_first(stress):
    """At the rate of the arcsinh form, under reversed stress; then forward. That the motion is that
    of time is for `test_in_time`.
    """
    scene = Scene(law="slowness", regularised=True, mu_star=0.6, **stress, **BACK)
    scene = scene.with_(displacement_step=-0.65 / scene.stiffness)
    ran, theirs = simulate(scene, duration=100.0), InTime(scene)
    assert ran.shear_stress[0] < 0.0 < ran.shear_stress[-1]
    began = theirs.both(0.0, theirs.start(), 0.0)[1].v
    assert began < 0.0
    assert ran.log10_slip_rate[0] == pytest.approx(math.log10(-began), rel=1e-12)


@pytest.mark.parametrize("stress", [CONSTANT, VARIABLE])
def test_slip_forward_is_what_it_is_without(stress):
    """The forms differ by exp(-2 mu/a); what is left is rounding."""
    plain = Scene(stiffness_ratio=1.5, **stress)
    both_ways = plain.with_(regularised=True)
    for friction in (-0.2, 0.0, 0.1):
        there, here = relation_of(both_ways)(friction), relation_of(plain)(friction)
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
    """Where stress is mirrored about zero, so is friction: same magnitude of slip rate."""
    scene = Scene(regularised=True, **CONSTANT)
    for above in (1e-6, 0.01, 0.3):
        there, slope, *_ = relation_of(scene)(above - scene.mu_star)
        mirrored, other_slope, *_ = relation_of(scene)(-above - scene.mu_star)
        assert mirrored == pytest.approx(there, rel=1e-12)
        assert other_slope == pytest.approx(-slope, rel=1e-12)
    # close to zero stress the fault is viscous: V = 2 V_* exp(-mu_*/a) tau/(a sigma)
    value = relation_of(scene)(1e-9 - scene.mu_star)[0]
    linear = math.log(2e-9 / scene.a) - scene.mu_star / scene.a
    assert value / scene.a == pytest.approx(linear, rel=1e-9)


def test_a_step_that_reverses_all_stress_ends_the_motion():
    step = {"displacement_step": -200.0, **CONSTANT}
    for scene in (Scene(**step, **BACK), Scene(regularised=True, **step)):
        with pytest.warns(Incomplete, match="shear_stress_reversed"):
            ran = simulate(scene)
        assert ran.attrs["status"] == "shear_stress_reversed"
        assert "the step takes shear stress to" in ran.attrs["message"]


@pytest.mark.parametrize("load", [1.0, 10.0, 100.0, 1e4])
@pytest.mark.parametrize("stress", [CONSTANT, {**VARIABLE, "alpha": 0.0}])
def test_steady_friction_stays_positive(stress, load):
    """``a arcsinh{exp[(mu_* + Theta_ss)/a] V/(2 V_*)}``, where mu_* + (a - b) ln V < 0 too."""
    scene = Scene(
        law="slip", b_over_a=2.0, mu_star=0.05, regularised=True, stiffness=0.01,
        load_velocity_ratio=load, **stress,
    )  # fmt: skip
    held = (scene.mu_star - scene.b * math.log(load)) / scene.a
    exact = scene.a * math.asinh(0.5 * load * math.exp(held))
    values = LinearStability()(scene, Accuracy()).values
    assert values["steady_friction"] == pytest.approx(exact, rel=1e-11)
    if stress == CONSTANT:
        # weakening of the arcsinh form: a factor tanh(mu_ss/a)
        weakens = (scene.b - scene.a) * math.tanh(exact / scene.a)
        assert stability.critical_stiffness(scene, math.log(load)) == pytest.approx(
            weakens, rel=1e-9
        )
