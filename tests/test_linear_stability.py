"""Linear stability: algebra and assembled equations vouch for each other."""

import math

import numpy as np
import pytest
from conftest import cot_phi

from rsfstudy import Scene
from rsfstudy.measures.linear_stability import LinearStability, growth, jacobian
from rsfstudy.measures.rigid_response import RigidResponse
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider.equations import by_displacement, by_inertial_time, relation_of
from rsfstudy.status import Status


def test_without_steady_state_there_is_no_critical_stiffness():
    outcome = LinearStability()(Scene(phi=40.0, load_velocity_ratio=1e-4), Accuracy())
    assert outcome.status is Status.NO_STEADY_STATE
    assert outcome.values["steady_friction"] > math.tan(math.radians(40.0))
    faster = LinearStability()(Scene(phi=40.0, load_velocity_ratio=1.0), Accuracy())
    assert faster.status is Status.OK


@pytest.mark.parametrize("effects", [{"normal_stress": "constant"}, {"alpha": 0.56}])
def test_mass_shifts_the_threshold(effects):
    """At T = 1e8 s double precision sees K = K_cr (1 + D q), q = K eps**2/a, D = 1 - mu_*
    cot(phi).
    """
    scene = Scene(inertia=True, period=1e8, **effects)
    steadiness = 1.0 - scene.mu_star * cot_phi(scene)

    def growth(ratio: float) -> float:
        system = by_inertial_time(scene.with_(stiffness_ratio=ratio))
        columns = []
        for unit, scale in zip(np.eye(3), system.scales, strict=True):
            step = 1e-5 * scale * unit
            ahead, behind = system.rates(step), system.rates(-step)
            columns.append((np.array(ahead) - np.array(behind)) / (2e-5 * scale))
        values = np.linalg.eigvals(np.array(columns).T)
        return float(values[np.argsort(np.abs(values))][:2].real.max())

    low, high = 1.0, 1.2
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if growth(middle) > 0.0 else (low, middle)
    shift = steadiness * low * scene.critical_stiffness * scene.inertial_time**2 / scene.a
    assert shift > 0.005
    assert low == pytest.approx(1.0 + shift, rel=1e-6)
    assert relation_of(scene)(0.0)[0] == 0.0


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
