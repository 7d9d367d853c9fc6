"""Where critical paths end, are none, or do not decide."""

import math

import pytest

from rsfstudy import Scene
from rsfstudy.boundaries.rate_steps import RateSteps
from rsfstudy.boundaries.touching import touching_point
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import Kind, maximum, rise
from rsfstudy.motion.stepping import Meter
from rsfstudy.status import Status


def test_where_normal_stress_all_but_follows_shear_stress_there_is_a_critical_path():
    """It begins at more friction lost than any motion at another angle loses; motions alone would
    take ten times the work for a hundred times the error.
    """
    scene = Scene(phi=math.degrees(math.atan(0.76)) + 0.01)
    spring, _psi = touching_point(scene.with_(load_velocity_ratio=1.005))
    assert spring < -0.9 * scene.mu_star
    found = CriticalStep()(scene, Accuracy())
    assert found.status is Status.OK
    assert found.rhs_evaluations < 60_000
    above_one = found.values["critical_velocity_ratio"] - 1.0
    assert found.values["critical_velocity_ratio_error"] < 1e-7 * above_one


@pytest.mark.parametrize("damping", [0.0, 1e-6])
def test_where_orbits_grow_the_second_peak_decides(damping):
    """By this law a motion that touches the norm goes beyond it when it comes back: a smaller step
    is critical than that of the path which touches it first.
    """
    scene = Scene(law="perrin_rice_zheng", normal_stress="constant", radiation_damping=damping,
                  b_over_a=2.415818468303777, stiffness_ratio=1.4180369576585439)  # fmt: skip
    found = CriticalStep()(scene, Accuracy(1e-6))
    assert found.status is Status.OK
    critical = found.values["critical_velocity_ratio"]
    (touching,) = RateSteps(scene, 1).sizes_on_path([1e-9], Meter(100_000))
    assert critical < (1.0 - 5e-4) * math.exp(touching)
    norm = rise("log_rate", scene.log_norm_rate, ends=True)
    for step, reaches in ((critical * (1.0 - 1e-5), False), (critical * (1.0 + 1e-5), True)):
        peaks = []
        stepped = scene.with_(load_velocity_ratio=step)
        for event in follow(stepped, Accuracy(1e-9), Meter(100_000), (maximum("log_rate"), norm)):
            if event.kind in (Kind.MAXIMUM, Kind.RISE):
                peaks.append((event.kind, event.point.log_rate))
            if len(peaks) == 4:
                break
        assert peaks[0][0] is Kind.MAXIMUM
        assert any(kind is Kind.RISE for kind, _rate in peaks) is reaches
        assert reaches or peaks[3][1] < peaks[2][1] < peaks[1][1]


def test_a_boundary_at_the_end_of_the_paths_is_as_accurate_as_its_error():
    """Beyond it there is no path to follow, and a verdict has no slope."""
    fields = {"law": "composite", "alpha": 0.0, "mu_star": 0.785, "phi": 38.5, "b_over_a": 1.67}
    scene, measure = (
        Scene(**fields, stiffness_ratio=1.43),
        CriticalStep("normal_stress_step", "down"),
    )
    one, tight = (measure(scene, Accuracy(rtol)).values for rtol in (1e-7, 1e-10))
    name = measure.headline
    apart = abs(one[name] - tight[name])
    assert apart <= one[f"{name}_error"] + tight[f"{name}_error"]
    assert one[f"{name}_error"] < 2e-7 * abs(one[name])
