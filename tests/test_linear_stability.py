"""Linear stability: algebra and assembled equations vouch for each other."""

import math

import pytest

from rsfstudy import Scene
from rsfstudy.measures.linear_stability import LinearStability, growth, jacobian
from rsfstudy.measures.rigid_response import RigidResponse
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider.equations import by_displacement
from rsfstudy.status import Status


def test_without_steady_state_there_is_no_critical_stiffness():
    outcome = LinearStability()(Scene(phi=40.0, load_velocity_ratio=1e-4), Accuracy())
    assert outcome.status is Status.NO_STEADY_STATE
    assert outcome.values["steady_friction"] > math.tan(math.radians(40.0))
    faster = LinearStability()(Scene(phi=40.0, load_velocity_ratio=1.0), Accuracy())
    assert faster.status is Status.OK


def test_where_mass_leaves_no_stable_stiffness():
    scene = Scene(inertia=True, period=1e8)
    assert LinearStability()(scene, Accuracy()).status is Status.OK
    faster = LinearStability()(scene.with_(load_velocity_ratio=100.0), Accuracy())
    assert faster.status is Status.UNSTABLE_AT_ANY_STIFFNESS
    assert "direct effect" in faster.message


@pytest.mark.parametrize("off", [-1e-3, -1e-8, 1e-8, 1e-3])
@pytest.mark.parametrize("effects", [{"normal_stress": "constant"}, {"alpha": 0.56}])
def test_growth_close_to_critical_stiffness(off, effects):
    """At K = K_cr (1 + d), a p**2 + (E K - (b-a)) p + D K = 0 per time D_c/V_*: twice the growth
    rate is -(b-a) d/a, and a half of that per slip and load point displacement.
    """
    scene = Scene(stiffness_ratio=1.0 + off, **effects)
    expected = -0.25 * (scene.b_over_a - 1.0) * off
    # central differences are right to 6e-10 of rates of order one
    grows = growth(jacobian(by_displacement(scene), (0.0, 0.0)))
    assert grows == pytest.approx(expected, rel=1e-5, abs=1e-9)
    assert grows * off < 0.0


@pytest.mark.parametrize("measure", [LinearStability(), RigidResponse(points=3)])
@pytest.mark.parametrize("fields", [{"law": "slip"}, {"law": "two_slip_states"}])
def test_a_held_load_point_is_refused_by_status(measure, fields):
    for stress in ("constant", "variable"):
        found = measure(Scene(displacement_step=0.3, normal_stress=stress, **fields), Accuracy())
        assert found.status is Status.NO_STEADY_STATE
        assert "the load point is held" in found.message
