"""Tests of stress-dependent state evolution (Nagata et al. 2012).

The stress dependence can be combined with any law.
"""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_helpers import cot_phi
from test_steady import PLAIN, WITH_ONE_B

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.responses.rigid_response import RigidResponse
from rsfstudy.slider import stability
from rsfstudy.slider.friction import build_friction_relation
from rsfstudy.status import Status

CONSTANT = {"normal_stress": "constant"}
SHEAR, C = st.floats(-0.5, 2.0), st.floats(0.01, 5.0)


# ---- the friction relation -----------------------------------------------------------------------


@given(SHEAR, C)
def test_at_constant_normal_stress_the_state_loses_c_times_the_change_of_friction(g, c):
    value, slope, shift, shift_slope = build_friction_relation(
        Scene(stress_dependence=c, **CONSTANT)
    )(g)
    assert (value, slope) == pytest.approx(((1.0 + c) * g, 1.0 + c), rel=1e-15)
    assert (shift, shift_slope) == (c * g, c)


@given(SHEAR, C, st.floats(50.0, 87.0))
def test_it_is_the_integral_of_c_dtau_over_sigma(g, c, phi):
    """The shift is c/cot ln(1 + cot g), in addition to the effect of alpha."""
    with_, without = (
        build_friction_relation(Scene(stress_dependence=x, phi=phi, alpha=0.3))(g) for x in (c, 0.0)
    )
    cot = cot_phi(Scene(phi=phi))
    extra = [one - other for one, other in zip(with_, without, strict=True)]
    shift, slope = c / cot * math.log1p(cot * g), c / (1.0 + cot * g)
    assert extra == pytest.approx([shift, slope, shift, slope], rel=1e-12, abs=1e-13)


@given(SHEAR, st.floats(1e-15, 1e-3))
def test_no_digits_are_lost_where_normal_stress_hardly_varies(g, tilt):
    """The shift is accurate for phi close to 90 degrees.

    The reference is the series c g (1 - cot g/2 + (cot g)**2/3), whose error is the cube of
    cot g.
    """
    scene = Scene(stress_dependence=1.0, alpha=0.0, phi=90.0 - math.degrees(tilt))
    shift, small = build_friction_relation(scene)(g)[2], cot_phi(scene) * g
    series = g * (1.0 - small / 2.0 + small**2 / 3.0)
    assert shift == pytest.approx(series, rel=1e-15 + abs(small) ** 3)


# ---- steady sliding and its stability ------------------------------------------------------------


@pytest.mark.parametrize("law", sorted(WITH_ONE_B))
@pytest.mark.parametrize("c", [0.5, 2.0])
def test_critical_stiffness_is_that_over_one_plus_c(law, c):
    """The critical stiffness is divided by 1 + c at constant normal stress."""
    scene = Scene(law=law, **CONSTANT)
    for log_slip_rate in (-5.0, 0.0, 2.0):
        ours = stability.compute_critical_stiffness(scene.with_(stress_dependence=c), log_slip_rate)
        usual = stability.compute_critical_stiffness(scene, log_slip_rate)
        assert ours == pytest.approx(usual / (1.0 + c), rel=1e-11)


@given(C, st.floats(50, 85), st.floats(0, 1), st.floats(-5, 5), st.sampled_from(PLAIN))
def test_critical_stiffness_with_variable_normal_stress(c, phi, alpha, log_slip_rate, law):
    """The critical stiffness is a generalisation of eq. 7.

    The closed form is (b - a) sigma_ss/[1 + c - cot(phi) (mu_ss - alpha)].
    """
    scene = Scene(law=law, stress_dependence=c, phi=phi, alpha=alpha)
    cot, mu_ss = cot_phi(scene), scene.mu_star - (scene.b - scene.a) * log_slip_rate
    sigma = (1.0 - scene.mu_star * cot) / (1.0 - mu_ss * cot)
    exact = (scene.b - scene.a) * sigma / (1.0 + c - cot * (mu_ss - alpha))
    assert stability.compute_critical_stiffness(scene, log_slip_rate) == pytest.approx(
        exact, rel=1e-11
    )


def equivalent(scene: Scene) -> Scene:
    """Return the equivalent scene without stress dependence.

    At constant normal stress, the parameters are a/(1 + c), b - a c/(1 + c) and (1 + c)
    D_c. The change of D_c also changes the units of slip and time, and the norm.
    """
    c = scene.stress_dependence
    a, b, longer = scene.a / (1.0 + c), scene.b - scene.a * c / (1.0 + c), 1.0 + c
    return scene.with_(
        stress_dependence=0.0,
        a=a,
        b_over_a=b / a,
        stiffness=longer * scene.stiffness,
        reference_rate=scene.reference_rate / longer,
        instability_norm=scene.instability_norm / longer,
    )


@pytest.mark.parametrize("law", PLAIN)
@pytest.mark.parametrize("c", [0.3, 2.0])
@pytest.mark.parametrize("ratio", [0.7, 1.4])
def test_small_steps_look_like_another_slider_without_it(law, c, ratio):
    """Growth rates equal the rates of the equivalent scene over 1 + c."""
    scene = Scene(law=law, stress_dependence=c, stiffness_ratio=ratio, **CONSTANT)
    ours, theirs = (
        stability.compute_linear_growth_rates(one, 0.0) for one in (scene, equivalent(scene))
    )
    assert (1.0 + c) * ours == pytest.approx(theirs, rel=1e-10)


def test_by_the_slip_law_all_motions_are_those_of_that_slider():
    """For the linear slip law, all motions agree with the equivalent scene.

    The test compares critical steps and limit cycles with inertia.
    """
    scene = Scene(stress_dependence=1.5, stiffness_ratio=1.3, **CONSTANT)
    other, accuracy = equivalent(scene), Accuracy(1e-8)
    for of, longer in (("load_velocity_ratio", 1.0), ("displacement_step", 2.5)):
        ours, theirs = (CriticalStep(of=of)(one, accuracy) for one in (scene, other))
        name = CriticalStep(of=of).primary_output
        assert ours.status is theirs.status is Status.OK
        assert ours.values[name] == pytest.approx(longer * theirs.values[name], rel=1e-7)
    slipping = scene.with_(stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True)
    ours, theirs = (
        LimitCycle(phases=2)(one, Accuracy(1e-7)) for one in (slipping, equivalent(slipping))
    )
    for name, longer in (("recurrence_interval", 2.5), ("static_stress_drop", 1.0)):
        assert ours.values[name] == pytest.approx(longer * theirs.values[name], rel=1e-6)


# ---- measures ------------------------------------------------------------------------------------


def test_closed_forms_that_do_not_hold_with_it_are_not_told():
    scene = Scene(stress_dependence=1.0, load_velocity_ratio=2.0, **CONSTANT)
    assert math.isnan(RigidResponse()(scene, Accuracy()).values["closed_form_misfit"])
    stability = LinearStability()(scene, Accuracy()).values
    assert math.isnan(stability["critical_stiffness_explicit"])
    growth = stability["critical_stiffness_from_growth"]
    assert growth == pytest.approx(stability["critical_stiffness"], rel=1e-8)


def test_critical_stiffness_itself_is_left_open():
    """The critical step at k = k_cr is not verified.

    Orbits need not be closed there, so neither growth nor decay can be shown.
    """
    for law in ("slip", "slowness"):
        scene = Scene(law=law, stress_dependence=1.0, **CONSTANT)
        assert CriticalStep()(scene, Accuracy(1e-5)).status is Status.UNVERIFIED
