"""Tests of the stiffness, its ratio, and rate-strengthening sliders.

Rate-strengthening sliders have no critical stiffness.
"""

import math

import pytest

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.slider import stability, steady_state
from rsfstudy.status import Status

STRENGTHENING = {"b_over_a": 0.8, "stiffness": 0.05}


def test_stiffness_is_its_ratio_times_the_critical_one():
    relative = Scene(stiffness_ratio=1.2)
    absolute = Scene(stiffness=relative.stiffness)
    assert absolute.stiffness_ratio == pytest.approx(1.2, rel=1e-15)
    assert absolute.as_dict()["stiffness_ratio"] is None
    assert relative.as_dict()["stiffness"] is None
    assert absolute.parameter_values == relative.parameter_values
    first, second = (CriticalStep()(scene, Accuracy(1e-5)) for scene in (relative, absolute))
    assert first.values == pytest.approx(second.values, rel=1e-12)


def test_one_of_them_sets_the_spring():
    assert Scene().stiffness_ratio == 1.0
    soft = Scene().with_(stiffness=0.01)
    assert (soft.stiffness, soft.as_dict()["stiffness_ratio"]) == (0.01, None)
    assert soft.with_(a=0.02).stiffness == 0.01
    assert soft.with_(stiffness_ratio=1.5).as_dict()["stiffness"] is None


def test_without_rate_weakening_stiffness_is_given_by_itself():
    with pytest.raises(InvalidValue, match="must exceed 1.*Pass stiffness instead"):
        Scene(b_over_a=0.8)
    scene = Scene(**STRENGTHENING)
    assert scene.critical_stiffness == 0.0
    assert scene.stiffness_ratio == math.inf
    assert steady_state.find_min_steady_log_slip_rate(scene) == -math.inf


@pytest.mark.parametrize("law", ["slip", "slowness"])
@pytest.mark.parametrize("b_over_a", [0.5, 1.0])
@pytest.mark.parametrize("effects", [{"normal_stress": "constant"}, {}, {"inertia": True}])
def test_without_rate_weakening_nothing_grows(law, b_over_a, effects):
    scene = Scene(law=law, b_over_a=b_over_a, stiffness=0.05, load_velocity_ratio=3.0, **effects)
    assert stability.compute_linear_growth_rates(scene, scene.log_load_velocity)[0].real < 0.0
    found = LinearStability()(scene, Accuracy())
    assert found.status is Status.STABLE_AT_ANY_STIFFNESS
    assert LimitCycle(phases=2)(scene, Accuracy(1e-4)).status is Status.NO_LIMIT_CYCLE
    step = CriticalStep(direction="down")(scene, Accuracy(1e-4))
    assert step.status is Status.STABLE_FOR_ALL_STEPS


def test_a_soft_spring_overshoots_all_the_same():
    """A soft spring without rate weakening may exceed the norm.

    A fault that has healed at V_* weakens when a much faster load point drives it, and the
    spring releases stress. With very little weakening, every step stays below the norm.
    """
    soft = CriticalStep()(Scene(b_over_a=0.8, stiffness=0.01), Accuracy(1e-4))
    assert soft.status is Status.OK
    assert soft.values["critical_velocity_ratio"] > 100.0
    little = CriticalStep()(Scene(b_over_a=0.05, stiffness=0.01), Accuracy(1e-4))
    assert little.status is Status.STABLE_FOR_ALL_STEPS
