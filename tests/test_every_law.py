"""Every measure answers for every law, by both engines."""

import math

import pytest

from rsfstudy import Scene
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.linear_stability import LinearStability
from rsfstudy.measures.rigid_response import RigidResponse
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.slider import laws
from rsfstudy.status import Status

#: What is asked of a slider, and of which one.
QUESTIONS = {
    "rate step": (CriticalStep(), {"stiffness_ratio": 1.25}),
    "displacement step": (CriticalStep(of="displacement_step"), {"stiffness_ratio": 1.25}),
    "cycle": (LimitCycle(phases=2), {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0}),
    "response": (StepResponse(peaks=3), {"stiffness_ratio": 1.1, "load_velocity_ratio": 1.5}),
    "rigid": (RigidResponse(), {"load_velocity_ratio": 10.0}),
    "stability": (LinearStability(), {"load_velocity_ratio": 2.0}),
}
SLIDERS = [
    {"normal_stress": "constant"},
    {"normal_stress": "variable", "stress_dependence": 1.0, "radiation_damping": 1e-9},
    {"normal_stress": "variable", "inertia": True},
]
#: Each law; and those of two states where one strengthens.
LAWS = [{"law": law} for law in sorted(laws.PARTS)]
LAWS += [
    {"law": law, "a": 0.01, "b1_over_a": 1.4, "b2_over_a": -0.6, "length_ratio": 50.0}
    for law in ("two_slip_states", "two_slowness_states")
]
#: Without mass or damping, cycles of most laws run away in a rupture.
ENDS = (Status.OK, Status.SLIP_RATE_UNBOUNDED)
#: Each question of each law; every two of question, law and slider meet.
ASKED = [
    (question, law, SLIDERS[(row + column) % len(SLIDERS)])
    for row, question in enumerate(QUESTIONS)
    for column, law in enumerate(LAWS)
]


@pytest.mark.parametrize(("question", "law", "slider"), ASKED, ids=str)
def test_every_measure_answers_for_every_law(question, law, slider):
    measure, fields = QUESTIONS[question]
    scene = Scene(**law, **slider, **fields)
    # events of several states take their time
    engine = COMPILED if question == "cycle" and scene.states > 1 else SCIPY
    found = measure(scene, Accuracy(1e-4, engine=engine))
    quasi_static = slider is SLIDERS[0]
    assert found.status in (ENDS if question == "cycle" and quasi_static else ENDS[:1])
    if found.status is Status.OK:
        assert math.isfinite(found.values[measure.headline])


def test_normal_stress_that_is_lost_is_told_however_steep_the_law():
    """phi close to atan(mu_*): after a rupture next to no normal stress is left, and friction goes
    far in one step. Warnings are errors here.
    """
    fields = {"phi": 37.13, "mu_star": 0.664, "alpha": 0.59, "stress_dependence": 1.0}
    numbers = {"a": 0.022, "b_over_a": 1.58, "stiffness_ratio": 1.618, "load_velocity_ratio": 1.947}
    scene = Scene(law="perrin_rice_zheng", inertia=True, period=1.04, **fields, **numbers)
    assert StepResponse()(scene, Accuracy(1e-4)).status is Status.NORMAL_STRESS_LOST
