"""Tests of simulated motions as labelled datasets."""

import math

import numpy as np
import pytest
from motion_helpers import cot_phi

import rsfstudy
from rsfstudy import Scene
from rsfstudy.errors import IncompleteWarning, InvalidValue, NoResultWarning
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES


def test_steady_sliding_stays_steady():
    """Without a step, slip equals load point displacement."""
    with pytest.warns(NoResultWarning, match=r"the scene has no step.*load_velocity_ratio"):
        motion = rsfstudy.simulate(Scene(), duration=20.0)
    np.testing.assert_allclose(motion.slip, motion.time, atol=1e-12)
    np.testing.assert_allclose(motion.log10_slip_rate, 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.shear_stress, 0.76, atol=1e-12)
    np.testing.assert_allclose(motion.normal_stress_ratio, 1.0, atol=1e-12)
    assert float(motion.time[-1]) == pytest.approx(20.0, rel=1e-12)


@pytest.mark.parametrize("inertia", [False, True])
def test_a_stable_step_ends_in_the_new_steady_state(inertia):
    """The final stresses agree with the steady state at V_0.

    The steady state follows from steady friction and the inclined geometry.
    """
    scene = Scene(load_velocity_ratio=1.5, stiffness_ratio=2.0, inertia=inertia)
    motion = rsfstudy.simulate(scene, duration=300.0, rtol=1e-9)
    mu_ss = scene.mu_star - (scene.b - scene.a) * math.log(1.5)
    sigma = (1 - scene.mu_star * cot_phi(scene)) / (1 - mu_ss * cot_phi(scene))
    end = motion.isel(time=-1)
    assert float(end.log10_slip_rate) == pytest.approx(math.log10(1.5), abs=1e-8)
    assert float(end.normal_stress_ratio) == pytest.approx(sigma, abs=1e-9)
    assert float(end.shear_stress) == pytest.approx(mu_ss * sigma, abs=1e-9)
    assert float(end.state_variable) == pytest.approx(-scene.b * math.log(1.5), abs=1e-9)


def test_time_is_an_index_though_stress_jumps():
    """Times increase strictly even if spring stress jumps.

    The load point is held, displaced by 0.5 D_c at time 2, and moves on.
    """
    segments = [{"velocity": 0.0, "duration": 2.0}, {"velocity": 1.0, "duration": 1.0, "step": 0.5}]
    scene = Scene(stiffness=0.1, normal_stress="constant", loading=rsfstudy.protocol(segments))
    motion = rsfstudy.simulate(scene, rtol=1e-5)
    assert (np.diff(motion.time) > 0.0).all()
    before, after = motion.shear_stress.sel(time=slice(2.0, 2.0 + 1e-9)).values[:2]
    assert after - before == pytest.approx(0.1 * 0.5, rel=1e-9)
    halfway = motion.interp(time=1.5)
    assert float(halfway.load_point_displacement) == pytest.approx(0.0, abs=1e-12)
    in_si = rsfstudy.to_si(motion, normal_stress=7e6, slip_distance=3e-5)
    assert (np.diff(in_si.time) > 0.0).all()
    nearest = in_si.sel(time=2.0 / scene.reference_rate, method="nearest")
    assert float(nearest.shear_stress) == pytest.approx(7e6 * before)


def test_a_motion_that_cannot_go_on_says_why_and_keeps_what_it_has():
    with pytest.warns(IncompleteWarning, match=r"after .* of 1000 D_c/V_\*: work_budget_spent \("):
        cut = rsfstudy.simulate(Scene(load_velocity_ratio=1.2), duration=1e3, budget=500)
    assert cut.attrs["status"] == "work_budget_spent"
    assert cut.sizes["time"] > 10
    assert cut.attrs["message"].endswith("--budget 2000 (in Python, budget=2000)")
    with pytest.raises(InvalidValue, match=r"pass rtol=\.\.\., budget=\.\.\. or engine="):
        rsfstudy.simulate(Scene(load_velocity_ratio=1.2), accuracy=Accuracy(budget=2000))
    with pytest.warns(
        IncompleteWarning, match="after 0 of 50 .*: normal_stress_lost .*normal stress vanishes"
    ):
        opened = rsfstudy.simulate(Scene(displacement_step=-110.0))
    assert opened.attrs["status"] == "normal_stress_lost"
    assert opened.sizes["time"] == 0


#: A hold followed by a pulse of 10^40 V_*, which comes to rest without ending the motion.
PULSE = {"law": "slowness", "normal_stress": "constant", "b_over_a": 1.5, "hold_time": 100.0}


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_beyond_the_norm_without_mass_or_damping_it_is_no_physics(engine):
    """The time at which the norm is exceeded is reported in all units.

    Without inertia and damping, the motion is not physical beyond 5e-4 over T V_*/(2 pi
    D_c).
    """
    with pytest.warns(
        NoResultWarning, match="exceeds the instability norm after .*without inertia or"
    ):
        motion = rsfstudy.simulate(Scene(**PULSE), duration=150.0, engine=engine)
    assert motion.attrs["status"] == "ok"
    since = float(motion.instability_time)
    norm = math.log10(5e-4 / (5.0 * 1.17e-8 / (2.0 * math.pi)))
    # The slip rate grows by a factor of 10 within about 1e-6 D_c/V_*, and the recording is
    # denser.
    assert since == pytest.approx(114.540722, abs=1e-4)
    rate = motion.log10_slip_rate
    assert float(rate.where(motion.time < since).max()) < norm
    assert float(rate.where(motion.time >= since).dropna("time")[0]) >= norm - 1e-9
    assert f"after {since:.9g} D_c/V_* without" in motion.attrs["beyond_instability_norm"]
    in_si = motion.rsf.to_si(normal_stress=1e6, slip_distance=1e-5)
    assert in_si.instability_time.attrs["units"] == "s"
    assert float(in_si.instability_time) == pytest.approx(since / 1.17e-8, rel=1e-12)


@pytest.mark.parametrize(
    "fields",
    [
        {"inertia": True},
        {"radiation_damping": 1e-5},
        # With this period, the load velocity exceeds the norm, and the pulse is 40 V_0.
        {"reference_rate": 0.1, "stiffness_ratio": 1.4},
    ],
)
def test_there_is_physics_beyond_the_norm_with_mass_or_damping(fields):
    """With inertia or damping, no warning is given beyond the norm.

    No warning is given either if the load velocity itself exceeds the norm.
    """
    motion = rsfstudy.simulate(Scene(**PULSE, **fields), duration=150.0, engine=COMPILED)
    assert float(motion.log10_slip_rate.max()) > 0.5
    assert "instability_time" not in motion
    assert "beyond_instability_norm" not in motion.attrs


def test_a_motion_that_begins_beyond_the_norm_says_so():
    """A motion that starts beyond the norm causes a warning.

    If the load velocity exceeds the norm, only slip rates a million times faster cause a
    warning.
    """
    # ln V jumps by K d/a = 15, and decreases again because K > b.
    jump = Scene(**PULSE | {"hold_time": 0.0}, displacement_step=3.0, stiffness_ratio=10.0)
    with pytest.warns(NoResultWarning, match="after 0 D_c"):
        rsfstudy.simulate(jump, duration=1.0, rtol=1e-3)
    with pytest.warns(NoResultWarning, match="after 114"):
        motion = rsfstudy.simulate(Scene(**PULSE, reference_rate=0.1), duration=150.0)
    at = motion.sel(time=float(motion.instability_time), method="nearest")
    # The sampling intervals are a few tenths of a decade.
    assert float(at.log10_slip_rate) == pytest.approx(6.0, abs=0.5)
