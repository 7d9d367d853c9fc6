"""Where critical paths end, are none, or do not decide."""

import pytest
from conftest import cot_phi, reaches_the_norm

from rsfstudy import Scene
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED
from rsfstudy.status import Status

RATE, DISPLACEMENT, FALL = "load_velocity_ratio", "displacement_step", "normal_stress_step"
CONSTANT, VARIABLE = {"normal_stress": "constant"}, {"alpha": 0.4, "phi": 55.0}


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
