"""Yes or no: does a step trigger instability?"""

import math

import pytest

import rsfstudy
from rsfstudy import Scene
from rsfstudy.measures.triggered import Triggered
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.status import Status


def answer(**fields) -> tuple[float, float]:
    outcome = Triggered()(Scene(**fields), Accuracy())
    assert outcome.status is Status.OK
    return outcome.values["unstable"], outcome.values["unstable_error"]


@pytest.mark.parametrize("b_over_a", [2.0, 3.0, 5.0])
def test_either_side_of_the_closed_form(b_over_a):
    """V_0/V_* = 1 + a/(b-a) at constant normal stress and k = k_cr."""
    critical = 1.0 + 1.0 / (b_over_a - 1.0)
    fields = {"normal_stress": "constant", "b_over_a": b_over_a}
    assert answer(load_velocity_ratio=critical * 0.999, **fields) == (0.0, 0.0)
    assert answer(load_velocity_ratio=critical * 1.001, **fields) == (1.0, 0.0)


def test_displacement_steps_too():
    assert answer(displacement_step=0.9, normal_stress="constant")[0] == 0.0
    assert answer(displacement_step=1.1, normal_stress="constant")[0] == 1.0


def test_an_answer_the_tolerance_decides_says_so():
    """Within a loose tolerance of the boundary, a tighter and a looser one disagree somewhere;
    closer to critical stiffness than the tolerance, growth cannot be told from decay.
    """
    statuses = [
        Triggered()(Scene(load_velocity_ratio=1.66025 + 4e-6 * i), Accuracy(1e-3)).status
        for i in range(-20, 21)
    ]
    assert Status.UNVERIFIED in statuses
    assert statuses[0] is statuses[-1] is Status.OK
    near = Scene(normal_stress="constant", stiffness_ratio=1.0 - 1e-8, load_velocity_ratio=1.001)
    assert Triggered()(near, Accuracy()).status is Status.UNVERIFIED
    assert Triggered()(near.with_(stiffness_ratio=1.0), Accuracy()).status is Status.OK


def test_with_mass_a_jump_beyond_the_norm_counts():
    """The slider slows down from where the step takes it: ln V = 16.08, and the norm is 14.61."""
    scene = Scene(
        law="slowness", normal_stress="constant", a=0.0074952301383459955,
        b_over_a=3.409016633081082, mu_star=0.7388632364473089, period=0.11388174879575831,
        reference_rate=1.2408525574485156e-08, stiffness_ratio=1.5381593043991868,
        load_velocity_ratio=6.78099797865174, displacement_step=1.1 * 3.9440408014373607,
        inertia=True,
    )  # fmt: skip
    peak = float(rsfstudy.simulate(scene, duration=1.0).log10_slip_rate.max()) * math.log(10.0)
    assert peak > scene.log_norm_rate + 1.0
    for inertia in (True, False):
        outcome = Triggered()(scene.with_(inertia=inertia), Accuracy())
        assert (outcome.status, outcome.values["unstable"]) == (Status.OK, 1.0)
    smaller = scene.with_(displacement_step=0.9 * 3.944)
    assert Triggered()(smaller, Accuracy()).values["unstable"] == 0.0
