"""Tests of triggers with separate statuses, and of strongly damped sliders."""

from __future__ import annotations

import pytest
from rsfstudy.named_studies._critical_triggers import TRIGGERS, Triggers

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.critical_steps.monotone_slip_rate_rise_check import (
    build_events_testing_monotone_rise,
    is_slip_rate_rise_monotone,
)
from rsfstudy.critical_steps.triggered_instability import Triggered
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES
from rsfstudy.motion.integration_events import EventKind, approach_to_steady_state, maximum
from rsfstudy.motion.integrator import Integrator
from rsfstudy.status import Status

#: A slider whose radiation damping balances the spring. An integration until V reaches V_0 would
#: need 4,000,000 evaluations with steps of D_c.
DAMPED = {
    "law": "slip",
    "a": 0.0127,
    "b_over_a": 1.98,
    "mu_star": 0.68,
    "stiffness_ratio": 0.263,
    "normal_stress": "imposed",
    "alpha": 0.3,
}


@pytest.mark.parametrize("damping", [8e-5, 4e-4, 1e-3])
@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_velocity_steps_of_a_damped_slider_are_cheap(law, damping):
    scene = Scene(**{**DAMPED, "law": law}, radiation_damping=damping)
    outcome = CriticalStep()(scene, Accuracy(1e-6, 250_000, engine=COMPILED))
    assert outcome.status is Status.STABLE_FOR_ALL_STEPS, outcome.message


@pytest.mark.parametrize("normal_stress", ["constant", "imposed", "variable"])
@pytest.mark.parametrize("law", ["slip", "slowness", "perrin_rice_zheng"])
@pytest.mark.parametrize("ratio", [0.3, 1.5])
def test_what_is_said_to_rise_to_the_load_point_does(law, normal_stress, ratio):
    """A slip rate that rises monotonically has no maximum.

    The motion is integrated until the distance from steady sliding is 0.001.
    """
    effect = {} if normal_stress == "constant" else {"alpha": 0.4}
    slope = {"phi": 70.0} if normal_stress == "variable" else {}
    damped = {"radiation_damping": 1e-3, "load_velocity_ratio": 2e3, "stiffness_ratio": ratio}
    scene = Scene(law=law, b_over_a=1.7, normal_stress=normal_stress, **effect, **slope, **damped)
    integrator = Integrator(Accuracy(1e-7, 10**6, engine=COMPILED))
    levels = build_events_testing_monotone_rise(scene)
    told = [False]
    for event in integrator.follow(
        scene, [maximum("log_slip_rate"), approach_to_steady_state(1e-3), *levels]
    ):
        if event.specification in levels and not told[-1]:
            told.append(is_slip_rate_rise_monotone(scene, event.point))
        assert not (event.kind is EventKind.MAXIMUM and told[-1])
        assert event.point.log_slip_rate <= scene.log_load_velocity or not told[-1]
        if event.kind is EventKind.SETTLED:
            break
    assert told[-1]
    # The final slip rate is close to the load velocity.
    assert event.point.log_slip_rate > scene.log_load_velocity - 0.1


def test_a_slider_that_waves_do_not_hold_back_is_not_asked():
    for fields in ({}, {"inertia": True}, {"law": "two_slip_states", "radiation_damping": 1e-3}):
        assert build_events_testing_monotone_rise(Scene(**fields, load_velocity_ratio=1e3)) == []


def test_oscillations_do_not_rise_to_the_load_point():
    """Near the critical stiffness, the slip rate exceeds the load velocity."""
    scene = Scene(stiffness_ratio=1.1, load_velocity_ratio=1.1, radiation_damping=1e-12)
    start = next(Integrator(Accuracy(1e-6, 10**5)).follow(scene))
    assert start.point.log_slip_rate < scene.log_load_velocity
    assert not is_slip_rate_rise_monotone(scene, start.point)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_each_trigger_keeps_its_own_answer(engine):
    """Results of other triggers are kept if one exhausts the budget.

    The velocity step exhausts the budget in this test.
    """
    scene = Scene(**{**DAMPED, "stiffness_ratio": 1.5}, radiation_damping=1e-9)
    accuracy = Accuracy(1e-6, engine=engine)
    costs = [trigger(scene, accuracy).rhs_evaluations for trigger in TRIGGERS]
    assert max(costs[:2]) < 0.9 * costs[2]
    budget = int(0.95 * costs[2])
    outcome = Triggers()(scene, Accuracy(1e-6, budget, engine=engine))
    found = outcome.values
    assert outcome.status is Status.WORK_BUDGET_SPENT
    assert (
        f"load_velocity_ratio: the budget of {budget} right-hand side evaluations"
        in outcome.message
    )
    assert outcome.message.endswith(f"budget={4 * budget})")
    ends = [found[f"critical_{of}_status"] for of in ("normal_stress_step", "displacement")]
    assert ends == [Status.OK, Status.OK]
    assert found["critical_velocity_ratio_status"] == Status.WORK_BUDGET_SPENT
    alone = CriticalStep(of="displacement_step")(scene, accuracy)
    assert found["critical_displacement"] == alone.values["critical_displacement"]
    assert found["coulomb_ratio"] == pytest.approx(1.0, abs=0.1)
    assert sum(costs[:2]) + budget <= outcome.rhs_evaluations < 1.1 * sum(costs)


def answer(**fields) -> tuple[float, float]:
    outcome = Triggered()(Scene(**fields), Accuracy())
    assert outcome.status is Status.OK
    return outcome.values["unstable"], outcome.values["unstable_error"]


@pytest.mark.parametrize("b_over_a", [2.0, 3.0, 5.0])
def test_either_side_of_the_closed_form(b_over_a):
    """The critical step is 1 + a/(b-a) at constant normal stress.

    The stiffness is k = k_cr.
    """
    critical = 1.0 + 1.0 / (b_over_a - 1.0)
    fields = {"normal_stress": "constant", "b_over_a": b_over_a}
    assert answer(load_velocity_ratio=critical * 0.999, **fields) == (0.0, 0.0)
    assert answer(load_velocity_ratio=critical * 1.001, **fields) == (1.0, 0.0)


def test_displacement_steps_too():
    assert answer(displacement_step=0.9, normal_stress="constant")[0] == 0.0
    assert answer(displacement_step=1.1, normal_stress="constant")[0] == 1.0


def test_an_answer_the_tolerance_decides_says_so():
    """A result that depends on the tolerance is not verified.

    Near the boundary, runs with different tolerances disagree. Near the critical stiffness,
    growth cannot be distinguished from decay.
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
