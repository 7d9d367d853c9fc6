"""Tests of the growth rates of LinearStability, and of the stress that sets normal stress."""

import math

import numpy as np
import pytest

import rsfstudy
from rsfstudy import Accuracy, Scene
from rsfstudy.execution.cell_plan import compute_cell_key
from rsfstudy.measures import LinearStability, Status


@pytest.mark.parametrize(
    "dynamics", [{"radiation_damping": 1e-3}, {"inertia": True, "period": 1e6}]
)
def test_frictional_stress_sets_the_normal_stress(dynamics):
    """The normal stress follows the frictional stress, and not the spring stress."""
    scene = Scene(b_over_a=1.5, stiffness_ratio=0.8, load_velocity_ratio=2, phi=60, **dynamics)
    motion = rsfstudy.simulate(scene, duration=60)
    cot_phi = 1 / math.tan(math.radians(60))
    misfits = [
        float(abs(motion.normal_stress_ratio - 1 - cot_phi * (stress - scene.mu_star)).max())
        for stress in (motion.frictional_stress, motion.shear_stress)
    ]
    assert misfits[0] < 1e-12
    assert misfits[1] > 1e-3


def test_growth_rate_is_a_root_of_the_characteristic_polynomial():
    """The rate scales with the load point velocity, for one state at constant normal stress."""
    scene = Scene(
        normal_stress="constant", a=0.01, b_over_a=1.5, stiffness=0.004, load_velocity_ratio=3
    )
    values = LinearStability(growth_rate=True)(scene, Accuracy()).values
    root = 3 * max(np.roots([0.01, 0.004 - 0.005, 0.004]), key=lambda p: p.imag)
    assert values["growth_rate"] == pytest.approx(root.real, rel=1e-9)
    assert values["angular_frequency"] == pytest.approx(root.imag, rel=1e-9)
    assert values["growth_rate_error"] < 1e-6


def test_growth_rate_is_valid_without_a_critical_stiffness():
    scene = Scene(normal_stress="constant", b_over_a=0.8, stiffness=0.01)
    outcome = LinearStability(growth_rate=True)(scene, Accuracy())
    assert outcome.status is Status.OK
    assert outcome.values["growth_rate"] < 0
    assert "stable_at_any_stiffness" in outcome.message


def test_the_description_without_growth_rates_is_unchanged():
    assert LinearStability().describe() == {"name": "linear_stability"}
    assert LinearStability(growth_rate=True).describe()["growth_rate"] is True


def test_the_new_field_is_in_descriptions_and_cell_keys_only_if_it_is_set():
    """Declarations and cell keys without growth rates are the same as before the field existed."""
    plain, with_growth = LinearStability(), LinearStability(growth_rate=True)
    assert plain.describe() == {"name": "linear_stability"}
    assert with_growth.describe() == {"name": "linear_stability", "growth_rate": True}
    assert LinearStability.fields_from_description(plain.describe(), "") == {"growth_rate": False}
    assert LinearStability.fields_from_description(with_growth.describe(), "") == {}
    assert compute_cell_key(Scene(), plain) != compute_cell_key(Scene(), with_growth)
