"""Tests of steady sliding and its stability.

The references are closed forms, the geometry, and growth rates of the assembled equations.
"""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from motion_helpers import cot_phi

from rsfstudy import Scene
from rsfstudy.responses.perturbation_growth import compute_jacobian, compute_max_growth_rate
from rsfstudy.slider import closed_forms, laws, stability, steady_state
from rsfstudy.slider.equations import build_equations_against_displacement
from rsfstudy.slider.friction import compute_effective_normal_stress
from rsfstudy.slider.laws.composite import compute_lambert_w

#: Laws with a single b, whose steady friction is mu_* + (a - b) ln(V/V_*).
WITH_ONE_B = {
    name: law for name, law in laws.BUILT_IN_LAW_CLASS_BY_NAME.items() if issubclass(law, laws.Law)
}
PLAIN = sorted(name for name, law in WITH_ONE_B.items() if law.steady_states is None)
LAWS = st.sampled_from(PLAIN)
RATES, ANGLES, ALPHAS = st.floats(-30, 12), st.floats(50, 85), st.floats(0, 1)


def eq_7(scene: Scene, log_slip_rate: float) -> float:
    """Return ``(b - a) sigma_ss / [1 - cot(phi) (mu_ss - alpha)]``.

    The normal stress sigma_ss is computed in closed form.
    """
    cot = cot_phi(scene)
    mu_ss = scene.mu_star - (scene.b - scene.a) * log_slip_rate
    assume(mu_ss * cot < 0.99)
    sigma_ss = (1.0 - scene.mu_star * cot) / (1.0 - mu_ss * cot)
    return (scene.b - scene.a) * sigma_ss / (1.0 - cot * (mu_ss - (scene.alpha or 0.0)))


@given(RATES, ANGLES, ALPHAS, LAWS)
def test_critical_stiffness_is_eq_7_and_eq_8(log_slip_rate, phi, alpha, law):
    scene = Scene(law=law, phi=phi, alpha=alpha)
    closed = eq_7(scene, log_slip_rate)
    explicit = closed_forms.compute_critical_stiffness(
        log_slip_rate, scene.mu_star, scene.a, scene.b, cot_phi(scene), alpha
    )
    assert explicit == pytest.approx(closed, rel=1e-12)
    # Digits are lost if normal stress grows or vanishes, and in the arguments of the law.
    ours = stability.compute_critical_stiffness(scene, log_slip_rate)
    assert ours == pytest.approx(closed, rel=1e-12 * (1.0 + abs(log_slip_rate)))


@pytest.mark.parametrize("law", PLAIN)
def test_constant_normal_stress_has_b_minus_a(law):
    scene = Scene(law=law, normal_stress="constant")
    for log_slip_rate in (-20.0, 0.0, 5.0):
        critical = stability.compute_critical_stiffness(scene, log_slip_rate)
        assert critical == pytest.approx(scene.b - scene.a, rel=1e-12)


@given(st.floats(-6, -0.2), st.floats(-3, 3), ANGLES, ALPHAS, LAWS)
def test_the_rise_by_mass_is_that_of_the_cubic(log_norm, log_slip_rate, phi, alpha, law):
    """The effect of inertia agrees with the cubic equation.

    The equation E M p**3 + (D M + a sigma) p**2 + [E K - (b-a) sigma] p + D K = 0 with M =
    K w**2 has imaginary roots at K = K_cr/(1 - q) with q = K_cr D w**2/(a sigma).
    """
    rate = math.exp(log_slip_rate)
    period = 2.0 * math.pi * 10.0**log_norm / (rate * 1.17e-8)
    scene = Scene(law=law, phi=phi, alpha=alpha, inertia=True, period=period)
    cot, mu_ss = cot_phi(scene), scene.mu_star - (scene.b - scene.a) * log_slip_rate
    sigma = (1.0 - scene.mu_star * cot) / (1.0 - mu_ss * cot)
    q = (
        eq_7(scene, log_slip_rate)
        * (1.0 - mu_ss * cot)
        * 10.0 ** (2.0 * log_norm)
        / (scene.a * sigma)
    )
    ours = stability.compute_critical_stiffness(scene, log_slip_rate)
    if q < 0.99:
        assert ours == pytest.approx(eq_7(scene, log_slip_rate) / (1.0 - q), rel=1e-11 / (1.0 - q))
    elif q > 1.01:
        assert ours == math.inf


@given(st.floats(-25, -4), st.floats(-3, 3), ANGLES, ALPHAS, LAWS)
def test_damping_lowers_it_as_the_quadratic_says(log_damping, log_slip_rate, phi, alpha, law):
    """The effect of damping agrees with the quadratic equation.

    The equation (a sigma + eta V E) p**2 + [E K + eta V D - (b-a) sigma] p + D K = 0 is
    neutral at K = K_cr - eta V D/E.
    """
    damping = math.exp(log_damping)
    scene = Scene(law=law, phi=phi, alpha=alpha, radiation_damping=damping)
    cot, mu_ss = cot_phi(scene), scene.mu_star - (scene.b - scene.a) * log_slip_rate
    share = (1.0 - mu_ss * cot) / (1.0 - mu_ss * cot + alpha * cot)
    undamped = eq_7(scene, log_slip_rate)
    damped = undamped - damping * math.exp(log_slip_rate) * share
    ours = stability.compute_critical_stiffness(scene, log_slip_rate)
    assert ours == pytest.approx(max(damped, 0.0), abs=1e-11 * undamped)


@given(RATES, ANGLES)
def test_steady_stresses_satisfy_the_inclined_geometry(log_slip_rate, phi):
    scene = Scene(phi=phi)
    mu_ss = scene.mu_star - (scene.b - scene.a) * log_slip_rate
    assume(mu_ss * cot_phi(scene) < 0.99)
    found = steady_state.compute_steady_sliding(scene, log_slip_rate)
    ratio = compute_effective_normal_stress(scene, found.frictional_stress)
    assert ratio == pytest.approx(1.0 + cot_phi(scene) * found.frictional_stress, rel=1e-13)
    assert scene.mu_star + found.frictional_stress == pytest.approx(mu_ss * ratio, rel=1e-11)


def test_no_steady_state_below_the_slowest_rate():
    scene = Scene()
    slowest = steady_state.find_min_steady_log_slip_rate(scene)
    mu_ss = scene.mu_star - (scene.b - scene.a) * slowest
    assert mu_ss * cot_phi(scene) == pytest.approx(1.0, rel=1e-9)
    assert steady_state.compute_steady_sliding(scene, slowest + 1e-6) is not None
    assert steady_state.compute_steady_sliding(scene, slowest - 1e-6) is None
    assert math.isnan(stability.compute_critical_stiffness(scene, slowest - 1.0))
    with pytest.raises(ValueError, match="steady sliding does not exist"):
        stability.compute_linear_growth_rates(scene, slowest - 1.0)
    assert steady_state.find_min_steady_log_slip_rate(Scene(normal_stress="constant")) == -math.inf


@pytest.mark.parametrize("period", [1e-3, 5.0, 1e4])
def test_a_small_mass_takes_no_digits_of_the_growth_rates(period):
    """Growth rates are unaffected by a small mass.

    The mass adds a single root, which is 1e9 to 1e24 times larger than the other roots.
    """
    scene = Scene(law="slip", fluid="dilatant", drainage=1e-3, dilatancy=1e-3, stiffness=0.003)
    heavy = stability.compute_linear_growth_rates(scene.with_(inertia=True, period=period), 0.0)
    assert heavy[-1].real < -1e9
    np.testing.assert_allclose(
        heavy[:-1].real, stability.compute_linear_growth_rates(scene, 0.0).real, rtol=1e-8
    )


@pytest.mark.parametrize("off", [-1e-3, -1e-8, 1e-8, 1e-3])
@pytest.mark.parametrize("effects", [{"normal_stress": "constant"}, {"alpha": 0.56}])
def test_growth_close_to_critical_stiffness(off, effects):
    """The growth rate near the critical stiffness agrees with its expansion.

    At K = K_cr (1 + d), the roots of a p**2 + (E K - (b-a)) p + D K = 0 per D_c/V_* have a
    real part of -(b-a) d/(2 a). The rate per slip and load point displacement is half of
    this value.
    """
    scene = Scene(stiffness_ratio=1.0 + off, **effects)
    expected = -0.25 * (scene.b_over_a - 1.0) * off
    # Central differences have an error of 6e-10 for rates of order one.
    grows = compute_max_growth_rate(
        compute_jacobian(build_equations_against_displacement(scene), (0.0, 0.0))
    )
    assert grows == pytest.approx(expected, rel=1e-5, abs=1e-9)
    assert grows * off < 0.0


# ---- laws with a rate of their own ---------------------------------------------------------------
CONSTANT = {"normal_stress": "constant"}
CUT_OFFS = ("composite", "cut_off")


def composite(scene: Scene, log_slip_rate: float) -> float:
    """Return (1 + w)(b - a) + b w V/V_c with w exp(w) = exp(-V/V_c)."""
    relative = math.exp(log_slip_rate) / scene.cutoff_velocity_ratio
    w = compute_lambert_w(math.exp(-relative))
    return (1.0 + w) * (scene.b - scene.a) + scene.b * w * relative


def cut_off(scene: Scene, log_slip_rate: float) -> float:
    """Return b/(1 + V/V_c) - a."""
    return scene.b / (1.0 + math.exp(log_slip_rate) / scene.cutoff_velocity_ratio) - scene.a


@given(st.floats(-12, 12), st.floats(-4, 12), st.floats(1.05, 4.0))
def test_critical_stiffness_of_cut_offs(log_slip_rate, log_cutoff, b_over_a):
    """The critical stiffness of laws with a cut-off agrees to 1e-8 b.

    The slopes of the law are differences of order eight. The ninth derivative of
    exp(-V/V_c) reaches 1e4, so the slopes have an error of about 1e-9.
    """
    for law, formula in (("composite", composite), ("cut_off", cut_off)):
        cutoff = math.exp(log_cutoff)
        scene = Scene(law=law, cutoff_velocity_ratio=cutoff, b_over_a=b_over_a, stiffness=1.0,
                      **CONSTANT)  # fmt: skip
        ours = stability.compute_critical_stiffness(scene, log_slip_rate)
        exact = max(formula(scene, log_slip_rate), 0.0)
        assert ours == pytest.approx(exact, abs=1e-8 * scene.b)


def test_no_steady_sliding_below_the_slowest_by_laws_with_a_rate_of_their_own():
    for law in CUT_OFFS:
        scene = Scene(law=law)
        slowest = steady_state.find_min_steady_log_slip_rate(scene)
        assert steady_state.compute_steady_sliding(scene, slowest + 1e-6) is not None
        assert steady_state.compute_steady_sliding(scene, slowest - 1e-6) is None
        assert steady_state.find_min_steady_log_slip_rate(scene.with_(**CONSTANT)) == -math.inf


@pytest.mark.parametrize("excess", [-0.02, -0.055, -0.1])
def test_stress_keeps_its_sign_however_weak_a_regularised_fault_becomes(excess):
    """The stress solves ``mu_* + excess = a ln(2 sinh(mu/a))``.

    The root is positive for positive and negative strengths.
    """
    scene = Scene(regularised=True, mu_star=0.05, normal_stress="constant")
    mu = scene.a * math.asinh(0.5 * math.exp((scene.mu_star + excess) / scene.a))
    assert steady_state.compute_frictional_stress_from_strength(
        scene, excess
    ) + scene.mu_star == pytest.approx(mu, rel=1e-9)
