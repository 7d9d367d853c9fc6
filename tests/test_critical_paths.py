"""Where critical paths end, are none, or do not decide."""

import math

import pytest
from conftest import cot_phi, reaches_the_norm

from rsfstudy import Scene
from rsfstudy.analysis.critical_path import CriticalPath
from rsfstudy.analysis.kinds_of_steps import RateSteps
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.events import Kind, maximum, rise
from rsfstudy.motion.meter import Meter
from rsfstudy.status import Status

RATE, DISPLACEMENT, FALL = "load_velocity_ratio", "displacement_step", "normal_stress_step"
CONSTANT, VARIABLE = {"normal_stress": "constant"}, {"alpha": 0.4, "phi": 55.0}


def test_where_normal_stress_all_but_follows_shear_stress_there_is_a_critical_path():
    """It begins at more friction lost than any motion at another angle loses; motions alone would
    take ten times the work for a hundred times the error.
    """
    scene = Scene(phi=math.degrees(math.atan(0.76)) + 0.01)
    spring_stress, _psi = CriticalPath.of(scene.with_(load_velocity_ratio=1.005)).tangency
    assert spring_stress < -0.9 * scene.mu_star
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
    scene = Scene(law="perrin_rice_zheng", **CONSTANT, radiation_damping=damping,
                  b_over_a=2.415818468303777, stiffness_ratio=1.4180369576585439)  # fmt: skip
    found = CriticalStep()(scene, Accuracy(1e-6))
    assert found.status is Status.OK
    critical = found.values["critical_velocity_ratio"]
    (touching,) = RateSteps(scene, 1).sizes_on_path([1e-9], Meter(100_000))
    assert critical < (1.0 - 5e-4) * math.exp(touching)
    norm = rise("log_slip_rate", scene.log_norm_rate, ends=True)
    for step, reaches in ((critical * (1.0 - 1e-5), False), (critical * (1.0 + 1e-5), True)):
        peaks = []
        stepped = scene.with_(load_velocity_ratio=step)
        for event in follow(
            stepped, Accuracy(1e-9), Meter(100_000), (maximum("log_slip_rate"), norm)
        ):
            if event.kind in (Kind.MAXIMUM, Kind.RISE):
                peaks.append((event.kind, event.point.log_slip_rate))
            if len(peaks) == 4:
                break
        assert peaks[0][0] is Kind.MAXIMUM
        assert any(kind is Kind.RISE for kind, _rate in peaks) is reaches
        assert reaches or peaks[3][1] < peaks[2][1] < peaks[1][1]


def test_a_fall_of_normal_stress_leaves_sigma_3_positive():
    """Beyond, friction falls faster with slip than stress does, and any motion comes to run away:
    here what is left between is stable.
    """
    scene = Scene(law="slowness", b_over_a=2.87, stiffness_ratio=2.41, phi=44.45, alpha=0.445)
    found = CriticalStep(of=FALL, direction="down")(scene, Accuracy(1e-4))
    assert found.status is Status.STABLE_FOR_ALL_STEPS
    largest = found.values["critical_normal_stress_step_stable"]
    assert 1.0 + largest == pytest.approx(scene.mu_star * cot_phi(scene), rel=1e-6)


ASKED = [
    *((of, way, stress) for of in (RATE, DISPLACEMENT) for way in ("up", "down")
      for stress in (CONSTANT, VARIABLE)),
    (FALL, "down", VARIABLE),
]  # fmt: skip


@pytest.mark.parametrize("law", ["slip", "slowness", "family", "perrin_rice_zheng", "composite"])
@pytest.mark.parametrize(("of", "direction", "stress"), ASKED)
def test_motions_on_each_side_go_as_told(law, of, direction, stress):
    """A little below the critical step none of many peaks reaches the norm, a little above one
    does: followed forward, without any of what tells a critical step that earlier. Where every step
    is stable, the largest is.
    """
    measure = CriticalStep(of=of, direction=direction)
    scene = Scene(law=law, b_over_a=2.4, stiffness_ratio=1.4, **stress)
    outcome = measure(scene, Accuracy(1e-6, engine=COMPILED))
    held = {} if of == RATE else {"load_velocity_ratio": 0.0}
    if outcome.status is Status.STABLE_FOR_ALL_STEPS:
        largest = outcome.values[f"{measure.headline}_stable"]
        assert not reaches_the_norm(scene.with_(**{of: largest}, **held), 1e-10, 10)
        return
    assert outcome.status is Status.OK
    critical = outcome.values[measure.headline]
    for share, reaches in ((1.0 - 1e-5, False), (1.0 + 1e-5, True)):
        step = critical**share if of == RATE else critical * share
        assert reaches_the_norm(scene.with_(**{of: step}, **held), 1e-10, 100) is reaches
