"""Tests of radiation damping: force balance, limits and critical stiffness."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider.equations import build_equations_between_ruptures
from rsfstudy.slider.friction import build_friction_relation


@given(
    spring_stress=st.floats(-0.7, 1.0),
    psi=st.floats(-1.0, 1.0),
    log_damping=st.floats(-30.0, 2.0),
    alpha=st.floats(0.0, 1.0),
    constant=st.booleans(),
)
@example(spring_stress=1.0, psi=0.0, log_damping=0.0, alpha=0.0, constant=False)
def test_friction_and_radiation_balance_the_spring(
    spring_stress, psi, log_damping, alpha, constant
):
    damping = math.exp(log_damping)
    scene = Scene(normal_stress="constant") if constant else Scene(alpha=alpha)
    scene, strength = scene.with_(radiation_damping=damping), build_friction_relation(scene)
    point = build_equations_between_ruptures(scene, with_time=False).evaluate_motion_point(
        (spring_stress, psi)
    )
    x, friction = point.log_slip_rate, point.frictional_stress
    # Rounding errors of the stresses, and of x times the derivative of the radiated stress.
    radiated = damping * math.expm1(x)
    scale = 1.0 + abs(spring_stress) + abs(psi) + (1.0 + abs(x)) * abs(radiated)
    assert spring_stress - radiated == pytest.approx(friction, abs=1e-14 * scale)
    assert strength(friction)[0] == pytest.approx(scene.a * x + psi, abs=1e-13 * scale)


@pytest.mark.parametrize("law", ["slip", "slowness"])
@pytest.mark.parametrize("of", ["load_velocity_ratio", "displacement_step"])
def test_at_zero_strength_it_is_the_effect_absent(law, of):
    scene = Scene(law=law)
    critical = CriticalStep(of=of)
    absent, faint = (
        critical(scene.with_(radiation_damping=damping), Accuracy()).values[critical.primary_output]
        for damping in (0.0, 1e-17)
    )
    assert faint == pytest.approx(absent, rel=1e-8)
