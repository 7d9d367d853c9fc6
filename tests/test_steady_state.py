"""Steady sliding and its critical stiffness: identities, and the growth of the assembled
equations.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsfstudy import Scene
from rsfstudy.slider import steady_state
from rsfstudy.slider.equations import quasi_static, strength_of


@given(st.floats(-30, 12), st.floats(45, 85), st.floats(0, 1))
def test_eq_7_is_eq_8(log_rate, phi, alpha):
    """The explicit function of V (eq. 8) against the definition (eq. 7) with sigma_ss from the
    stresses.
    """
    a, b, mu, cot = 0.0145, 0.029, 0.76, 1.0 / math.tan(math.radians(phi))
    mu_ss = mu - (b - a) * log_rate
    if mu_ss * cot > 0.999:
        return
    eq_8 = (b - a) * (1 - mu * cot) / ((1 - mu_ss * cot) * (1 - (mu_ss - alpha) * cot))
    ours = steady_state.critical_stiffness(log_rate, mu, a, b, cot, alpha)
    assert ours == pytest.approx(eq_8, rel=1e-12)


@given(st.floats(-30, 12), st.floats(50, 85))
def test_steady_stresses_satisfy_the_inclined_geometry(log_rate, phi):
    mu, cot = 0.76, 1.0 / math.tan(math.radians(phi))
    mu_ss = steady_state.steady_friction(log_rate, mu, 0.0145, 0.029)
    if mu_ss * cot > 0.99:
        return
    ratio = steady_state.steady_normal_stress(mu_ss, mu, cot)
    shear = steady_state.steady_shear_stress(mu_ss, mu, cot)
    assert ratio == pytest.approx(1.0 + cot * shear, rel=1e-11)
    assert mu + shear == pytest.approx(mu_ss * ratio, rel=1e-11)


def test_no_steady_state_below_the_lowest_rate():
    scene = Scene()
    lowest = steady_state.lowest_log_rate(scene.mu_star, scene.a, scene.b, scene.cot_phi)
    for away, exists in ((1e-6, True), (-1e-6, False)):
        mu_ss = steady_state.steady_friction(lowest + away, scene.mu_star, scene.a, scene.b)
        assert (
            math.isfinite(steady_state.steady_normal_stress(mu_ss, scene.mu_star, scene.cot_phi))
            is exists
        )
    assert steady_state.lowest_log_rate(0.76, 0.01, 0.02, 0.0) == -math.inf


def growth_rate(scene: Scene) -> float:
    """Real part of the leading eigenvalue of the assembled equations around their steady state."""
    load = scene.log_load_rate
    mu_ss = steady_state.steady_friction(load, scene.mu_star, scene.a, scene.b)
    spring = steady_state.steady_shear_stress(mu_ss, scene.mu_star, scene.cot_phi)
    steady = np.array([spring, strength_of(scene)(spring)[0] - scene.a * load])
    system = quasi_static(scene, clock=False)
    # rounding and truncation balance at a step of 1e-5 of the scale a
    h = 1e-5 * scene.a
    columns = []
    for unit in np.eye(2):
        ahead, behind = system.rate(0.0, steady + h * unit), system.rate(0.0, steady - h * unit)
        columns.append((np.array(ahead) - np.array(behind)) / (2 * h))
    assert np.abs(system.rate(0.0, steady.tolist())).max() < 1e-14
    return float(np.linalg.eigvals(np.array(columns).T).real.max())


@pytest.mark.parametrize("law", ["slip", "slowness"])
@pytest.mark.parametrize(
    "effects", [{"normal_stress": "constant"}, {"alpha": 0.0}, {"alpha": 0.56}, {"alpha": 0.9}]
)
@pytest.mark.parametrize("log_rate", [-3.0, 0.0, 5.0])
def test_growth_of_the_assembled_equations_vanishes_at_critical_stiffness(law, effects, log_rate):
    """Perturbations grow at k_cr (1 - 1e-3) and decay at k_cr (1 + 1e-3): algebra and code vouch
    for each other.
    """
    scene = Scene(law=law, load_velocity_ratio=math.exp(log_rate), **effects)
    here = steady_state.critical_stiffness(
        log_rate, scene.mu_star, scene.a, scene.b, scene.cot_phi, scene.alpha or 0.0
    )
    ratio = here / scene.critical_stiffness
    below = growth_rate(scene.with_(stiffness_ratio=ratio * (1 - 1e-3)))
    above = growth_rate(scene.with_(stiffness_ratio=ratio * (1 + 1e-3)))
    assert above < 0.0 < below
    # the real part passes zero linearly
    assert above == pytest.approx(-below, rel=0.02)
