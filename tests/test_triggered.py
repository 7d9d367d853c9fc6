"""Yes or no: does a step trigger instability?"""

import pytest

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
