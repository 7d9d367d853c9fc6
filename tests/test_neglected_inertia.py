"""Tests of the error due to inertia that both runs of a measure neglect."""

import math

import numpy as np
import pytest

from rsfstudy import Scene
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integration_events import maximum
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.neglected_inertia_error import estimate_neglected_inertia_error
from rsfstudy.motion.recording import REGIME_COLUMN, MotionRecorder
from rsfstudy.responses._motion_quantities import compute_log_slip_rate_slope_along_path
from rsfstudy.responses.healing import Healing
from rsfstudy.responses.velocity_step import VelocityStep
from rsfstudy.slider.equations import RUPTURE_REGIME
from rsfstudy.status import Status

INERTIA = {"inertia": True, "reference_rate": 1e-3}
#: Holds and a step whose runs stay on the slow manifold, or leave it late.
CASES = [
    (
        Healing(phases=2),
        1e-5,
        Scene(
            law="slip", normal_stress="constant", a=0.01023, b_over_a=1.13316, mu_star=0.66,
            stiffness_ratio=13.46, hold_time=1.41584, load_velocity_ratio=8.22991,
            period=41.77, **INERTIA,
        ),
    ),
    (
        Healing(phases=2),
        1e-7,
        Scene(
            law="slip", normal_stress="constant", a=0.0068, b_over_a=1.4568, mu_star=0.78,
            stiffness_ratio=45.22, hold_time=9168.0, load_velocity_ratio=1.01327,
            period=34.05, **INERTIA,
        ),
    ),
    (
        VelocityStep(phases=2),
        1e-5,
        Scene(
            law="perrin_rice_zheng", normal_stress="variable", a=0.00864, b_over_a=2.8021,
            mu_star=0.8106, stiffness_ratio=31.4966, phi=56.646, alpha=0.5531,
            load_velocity_ratio=4.63637, period=5.3072, **INERTIA,
        ),
    ),
]  # fmt: skip


def read(measure, scene, rtol):
    outcome = measure(scene, Accuracy(rtol, engine="compiled", budget=10_000_000))
    assert outcome.status is Status.OK, outcome.message
    return outcome.values


@pytest.mark.parametrize(("measure", "rtol", "scene"), CASES)
def test_errors_cover_what_both_runs_neglect(measure, rtol, scene):
    """The error estimates cover the error relative to a tighter run.

    A tolerance that is a thousand times smaller leaves the slow manifold earlier.
    """
    found, exact = read(measure, scene, rtol), read(measure, scene, 1e-3 * rtol)
    for name in measure.names_of_outputs_with_error:
        error = abs(found[name] - exact[name])
        assert error <= found[f"{name}_error"] + exact[f"{name}_error"], name


def recorded(scene, rtol):
    recording, accuracy = MotionRecorder(), Accuracy(rtol, 10_000_000, engine="compiled")
    list(Integrator(accuracy).follow(scene, with_time=True,
                recording=recording, until=12.0))  # fmt: skip
    return recording, recording.as_table(scene)


def test_a_scene_without_inertia_neglects_none():
    scene = Scene(law="slip", stiffness_ratio=2.0, load_velocity_ratio=3.0)
    recording, rows = recorded(scene, 1e-6)
    slow = recording.get_or_add_regime_index(scene.dynamics.regime_name)
    assert not estimate_neglected_inertia_error(scene, rows, slow, 0.0).any()


def test_estimate_goes_with_the_accuracy():
    """The estimate is proportional to rtol.

    The error of the slow manifold is of third order in its thresholds, which are
    proportional to the cube root of rtol. A motion that always uses the full equations
    neglects nothing.
    """
    scene, found = CASES[2][2], []
    for rtol in (1e-4, 1e-5, 1e-6, 1e-8):
        recording, rows = recorded(scene, rtol)
        slow = recording.get_or_add_regime_index(scene.dynamics.regime_name)
        estimate = estimate_neglected_inertia_error(scene, rows, slow, 0.0)
        assert (np.diff(estimate) >= 0.0).all()
        found.append(estimate[-1] / rtol)
        assert (estimate[-1] > 0.0) == bool((rows[:, REGIME_COLUMN] == slow).any())
    assert 0.1 < max(found) < 100.0


def test_growth_at_a_peak_has_one_unit_in_both_regimes():
    """The growth rate at a peak has the same unit in both regimes.

    Depending on rtol, the peak is on the slow manifold or in the full equations.
    """
    scene, growths = CASES[0][2], {}
    for rtol in (1e-5, 1e-8):
        wanted = maximum("spring_stress", terminal=True)
        integrator = Integrator(Accuracy(rtol, 10_000_000, engine="compiled"))
        events = list(integrator.follow(scene, [wanted]))
        peak = next(event for event in events if event.specification == wanted)
        growths[peak.regime] = compute_log_slip_rate_slope_along_path(scene, peak, 8.22991)
    assert set(growths) == {RUPTURE_REGIME, scene.dynamics.regime_name}
    first, second = growths.values()
    assert math.isclose(first, second, rel_tol=1e-2)
