"""Tests of laws with two states.

The references are closed forms, laws with a single state, and growth rates.
"""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from rsfstudy import Scene, simulate
from rsfstudy.critical_steps import motion_after_step, stability_after_step
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.critical_steps.triggered_instability import Triggered
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.motion.integrator import Integrator
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.responses.rigid_response import RigidResponse
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.slider import laws, stability
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import number
from rsfstudy.status import Status

LAWS = {"slip": "two_slip_states", "slowness": "two_slowness_states"}
CONSTANT = {"normal_stress": "constant"}
CASES = [(law, stress) for law in LAWS for stress in (CONSTANT, {})]
STRENGTHENING = {"a": 0.01, "b1_over_a": 1.4, "b2_over_a": -0.6, "length_ratio": 50.0}


def closed_form(first: float, second: float, over: float) -> float:
    """Return the critical k L_1/(a sigma) at constant normal stress.

    The argument ``over`` is L_1/L_2. The result is the Routh-Hurwitz criterion of a cubic
    equation (Gu et al. 1984).
    """
    half = first - 1.0 + over * (2.0 * first + (second - 1.0) * (2.0 + over))
    product = over * (1.0 + over) * (first + second - 1.0) * (1.0 + over - first - second * over)
    return (half + math.sqrt(half**2 + 4.0 * product)) / (2.0 + 2.0 * over)


@pytest.mark.parametrize("law", LAWS.values())
@pytest.mark.parametrize(
    ("first", "second", "over"),
    [(1.0, 0.84, 0.048), (1.4, -0.6, 0.02), (0.5, 3.0, 7.0), (-2.0, 4.0, 1.5), (0.002, 1.4, 0.3)],
)
def test_critical_stiffness_is_the_closed_form(law, first, second, over):
    scene = Scene(law=law, b1_over_a=first, b2_over_a=second, length_ratio=1.0 / over, **CONSTANT)
    assert scene.critical_stiffness / scene.a == pytest.approx(
        closed_form(first, second, over), rel=1e-11
    )
    found = LinearStability()(scene, Accuracy())
    assert found.status is Status.OK
    # The growth rate is computed from differences on the scale of a.
    assert found.values["critical_stiffness_error"] < 1e-5 * scene.critical_stiffness


@pytest.mark.parametrize(("law", "of_two"), LAWS.items())
@pytest.mark.parametrize("second", [1e-4, 1e-7])
def test_a_state_that_hardly_acts_is_one_that_is_not_there(law, of_two, second):
    """A very small b_2 changes the growth rate by about b_2/a."""
    one = Scene(law=law, b_over_a=1.5, stiffness=1e-3, **CONSTANT)
    parts = {"b1_over_a": 1.5, "b2_over_a": second, "length_ratio": 3.0}
    two = Scene(law=of_two, stiffness=1e-3, **parts, **CONSTANT)
    growth, again = (stability.compute_linear_growth_rates(scene, 0.0)[0] for scene in (one, two))
    assert again == pytest.approx(growth, rel=3.0 * second)


def both(law: str, **fields) -> tuple[Scene, Scene]:
    """Return a scene with one state, and a scene with two equal lengths."""
    one = Scene(law=law, b_over_a=2.0, **fields)
    return one, Scene(law=LAWS[law], b1_over_a=0.6, b2_over_a=1.4, length_ratio=1.0, **fields)


def agree(measure, one: Scene, two: Scene, rtol: float = 1e-7) -> None:
    """Assert that two scenes agree within the sum of their error estimates."""
    found, again = (measure(scene, Accuracy(rtol, 2_000_000)) for scene in (one, two))
    assert again.status is found.status is Status.OK
    for name in (n for n in found.values if f"{n}_error" in found.values):
        allowed = found.values[f"{name}_error"] + again.values[f"{name}_error"]
        allowed += 1e-14 * abs(found.values[name])
        assert again.values[name] == pytest.approx(found.values[name], abs=allowed), name


@pytest.mark.parametrize(("law", "stress"), CASES)
def test_two_of_one_length_are_one(law, stress):
    soft = {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, **stress}
    stiff = {"stiffness_ratio": 1.5, "load_velocity_ratio": 2.0, **stress}
    agree(LinearStability(), *both(law, **stiff))
    agree(LimitCycle(phases=2), *both(law, inertia=True, **soft), rtol=1e-6)
    agree(StepResponse(peaks=2, phases=2), *both(law, **stiff), rtol=1e-6)
    agree(RigidResponse(points=5), *both(law, **stiff))
    # A single state has a critical path, and two states use the general method.
    for of in ("load_velocity_ratio", "displacement_step"):
        agree(CriticalStep(of=of), *both(law, stiffness_ratio=1.3, **stress), 1e-4)
    agree(Triggered(), *both(law, stiffness_ratio=1.3, load_velocity_ratio=30.0, **stress), 1e-4)


@pytest.mark.parametrize("law", LAWS.values())
@pytest.mark.parametrize("effect", [{}, {"stress_dependence": 2.0, **CONSTANT}])
def test_what_stress_takes_is_shared_within_bounds(law, effect):
    """The shares of two states are below 1 and continuous.

    The shares and the critical stiffness are continuous at b_1 + b_2 = 0.
    """
    critical = []
    for second in (-1.5 + 1e-9, -1.5, -1.5 - 1e-9):
        scene = Scene(
            law=law, b1_over_a=1.5, b2_over_a=second, length_ratio=60.0, stiffness=0.01, **effect
        )
        shares = scene.parts.law.parameter_values(scene)[2:4]
        assert shares == pytest.approx((0.5, 0.5), abs=1e-9)
        critical.append(scene.critical_stiffness)
    assert critical[0] == pytest.approx(critical[1], rel=1e-6)
    assert critical[2] == pytest.approx(critical[1], rel=1e-6)


def test_b_follows_from_its_parts():
    scene = Scene(law="two_slip_states", b1_over_a=0.9, b2_over_a=0.4)
    assert scene.b == pytest.approx(1.3 * scene.a, rel=1e-15)
    assert scene.with_(b2_over_a=-0.4, stiffness=0.001).b == pytest.approx(0.5 * scene.a, rel=1e-15)
    assert Scene(law="two_slip_states", stiffness=0.01, b2_over_a=0.0).b == scene.a
    assert scene.with_(law="slip").b == 2.0 * scene.a


#: A scene that is unstable between two stiffnesses, with a ratio of 0.66.
WINDOW = {"b1_over_a": 1.136, "b2_over_a": -0.5, "length_ratio": 10.0, **CONSTANT}


@pytest.mark.parametrize("mass", [{}, {"inertia": True}, {"radiation_damping": 1e-9}])
def test_growth_confirms_a_threshold_close_to_another(mass):
    scene = Scene(law="two_slip_states", stiffness=0.01, **WINDOW, **mass)
    first, second = stability.compute_all_critical_stiffnesses(scene, 0.0)
    assert 0.5 * second < first < second
    assert second == pytest.approx(scene.critical_stiffness, rel=1e-4)
    for stiffness, grows in ((0.9 * first, False), (1.1 * first, True), (1.1 * second, False)):
        rates = stability.compute_linear_growth_rates(scene.with_(stiffness=stiffness), 0.0)
        assert bool(rates[0].real > 0.0) is grows
    found = LinearStability()(scene, Accuracy())
    assert found.status is Status.OK
    assert found.values["critical_stiffness_error"] < 1e-6 * second


@pytest.mark.parametrize(
    ("ratio", "margin"), [(0.2, 0.8), (0.6, 0.4), (0.8, -0.2), (0.99, -0.01), (1.2, 0.2)]
)
def test_below_a_window_of_instability_motions_settle(ratio, margin):
    scene = Scene(law="two_slip_states", stiffness_ratio=ratio, load_velocity_ratio=1.2, **WINDOW)
    assert stability_after_step.compute_stability_margin(scene) == pytest.approx(margin, rel=1e-9)
    assert stability_after_step.is_linearly_stable(scene) is (margin > 0.0)
    if ratio == 0.2:
        assert LimitCycle(phases=2)(scene, Accuracy(1e-4)).status is Status.NO_LIMIT_CYCLE
        small = motion_after_step.motion_reaches_instability_norm(
            scene, Integrator(Accuracy(1e-4, 2_000_000))
        )
        assert not small


# ---- three states --------------------------------------------------------------------------------


def evolutions(log_slip_rate, psis, shift, fraction, p):
    """Return the rates of three states with different lengths.

    Each state has a share of b.
    """
    b = p[LAW]
    return (
        -fraction * (psis[0] - 0.5 * shift + 0.5 * b * log_slip_rate),
        -fraction * p[LAW + 1] * (psis[1] - 0.2 * shift + 0.2 * b * log_slip_rate),
        -fraction * p[LAW + 2] * (psis[2] - 0.3 * shift + 0.3 * b * log_slip_rate),
    )


def steady_states(log_slip_rate, shift, p):
    at = shift - p[LAW] * log_slip_rate
    return 0.5 * at, 0.2 * at, 0.3 * at


@dataclass(frozen=True, kw_only=True)
class ThreeSlipStates(laws.Law):
    """The slip law with three states that share b."""

    second: float = number(1.0, "", "1", "first over second slip distance")
    third: float = number(1.0, "", "1", "first over third slip distance")

    name = "three_slip_states"
    state_count = 3
    evolutions = staticmethod(evolutions)
    steady_states = staticmethod(steady_states)

    def parameter_values(self, scene):
        return (*super().parameter_values(scene), self.second, self.third)


@pytest.mark.parametrize("engine", [SCIPY, COMPILED])
def test_two_of_three_lengths_alike_are_two(engine):
    """Three states with two equal lengths equal two states."""
    two = Scene(law="two_slip_states", b1_over_a=1.4, b2_over_a=0.6, length_ratio=4.0, **CONSTANT)
    three = Scene(law=ThreeSlipStates, b_over_a=2.0, second=1.0, third=0.25, **CONSTANT)
    assert three.critical_stiffness == pytest.approx(two.critical_stiffness, rel=1e-12)
    accuracy = Accuracy(1e-6, engine=engine)
    one, other = (
        LimitCycle(phases=2)(s.with_(stiffness_ratio=0.8, inertia=True, load_velocity_ratio=2.0),
                             accuracy).values["recurrence_interval"] for s in (two, three)
    )  # fmt: skip
    assert other == pytest.approx(one, rel=2e-6)
    assert np.isfinite(one)


@pytest.mark.parametrize("law", LAWS.values())
def test_a_motion_tells_each_state(law):
    """The dataset of a motion contains each state.

    The sum is the state variable to rounding error, because stress does not affect the
    states. The final values are -b_i ln(V_0/V_*), and after 40 D_c the slower state with a
    length of 2 D_c deviates by a fraction of exp(-20).
    """
    scene = Scene(
        law=law, b1_over_a=1.4, b2_over_a=-0.6, length_ratio=2.0, stiffness=1.0,
        load_velocity_ratio=math.e, **CONSTANT,
    )  # fmt: skip
    motion = simulate(scene, duration=40.0 / math.e, rtol=1e-8)
    together = motion["state_1"] + motion["state_2"]
    np.testing.assert_allclose(together, motion["state_variable"], atol=1e-14)
    ends = [float(motion[name][-1]) for name in ("state_1", "state_2")]
    assert ends == pytest.approx([-1.4 * scene.a, 0.6 * scene.a], rel=1e-7)
    assert "state_1" not in simulate(Scene(law="slip", load_velocity_ratio=2.0), duration=1.0)
