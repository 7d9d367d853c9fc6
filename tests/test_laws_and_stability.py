"""What follows from each law for stability: critical stiffness, critical steps, and the growth of
small oscillations, against closed forms.
"""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsfstudy import Scene
from rsfstudy.measures.critical_step import KINDS, CriticalStep
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Meter
from rsfstudy.slider import stability, steady
from rsfstudy.slider.laws.composite import lambert_w

CONSTANT = {"normal_stress": "constant"}
CUT_OFFS = ("composite", "cut_off")


# ---- critical stiffness --------------------------------------------------------------------------


def composite(scene: Scene, log_slip_rate: float) -> float:
    """(1 + w)(b - a) + b w V/V_c, w exp(w) = exp(-V/V_c)."""
    relative = math.exp(log_slip_rate) / scene.cutoff_velocity_ratio
    w = lambert_w(math.exp(-relative))
    return (1.0 + w) * (scene.b - scene.a) + scene.b * w * relative


def cut_off(scene: Scene, log_slip_rate: float) -> float:
    """b/(1 + V/V_c) - a."""
    return scene.b / (1.0 + math.exp(log_slip_rate) / scene.cutoff_velocity_ratio) - scene.a


@given(st.floats(-12, 12), st.floats(-4, 12), st.floats(1.05, 4.0))
def test_critical_stiffness_of_cut_offs(log_slip_rate, log_cutoff, b_over_a):
    """Slopes of the law are differences of order eight; those of exp(-V/V_c), whose ninth
    derivative reaches 1e4, are exact to 1e-9 or so.
    """
    for law, formula in (("composite", composite), ("cut_off", cut_off)):
        cutoff = math.exp(log_cutoff)
        scene = Scene(law=law, cutoff_velocity_ratio=cutoff, b_over_a=b_over_a, stiffness=1.0,
                      **CONSTANT)  # fmt: skip
        ours = stability.critical_stiffness(scene, log_slip_rate)
        exact = max(formula(scene, log_slip_rate), 0.0)
        assert ours == pytest.approx(exact, abs=1e-8 * scene.b)


def test_no_steady_sliding_below_the_slowest_by_laws_with_a_rate_of_their_own():
    for law in CUT_OFFS:
        scene = Scene(law=law)
        slowest = steady.slowest_steady(scene)
        assert steady.steady_sliding(scene, slowest + 1e-6) is not None
        assert steady.steady_sliding(scene, slowest - 1e-6) is None
        assert steady.slowest_steady(scene.with_(**CONSTANT)) == -math.inf


# ---- critical displacement steps -----------------------------------------------------------------


# ---- critical load point velocity steps ----------------------------------------------------------


def test_steps_up_to_a_rate_at_which_sliding_is_less_stable():
    """Composite law: k_cr rises to 1.8 of that at V_* as V comes to V_c. Above both of its ends and
    below its top, stiffness is critical to steps in between, as following motions from small steps
    to large ones finds too.
    """
    scene = Scene(law="composite", b_over_a=1.2, stiffness_ratio=1.2, **CONSTANT)
    tops = [stability.critical_stiffness(scene, x) for x in (0.0, math.log(100.0), math.log(1e5))]
    assert tops[0] < scene.stiffness < tops[1]
    assert tops[2] < scene.stiffness
    measure, accuracy = CriticalStep(), Accuracy(1e-5)
    found = measure(scene, accuracy).values["critical_velocity_ratio"]
    steps_ = KINDS["load_velocity_ratio"](scene, 1)
    surveyed = measure._surveyed(steps_, accuracy, Meter(10**6)).values["critical_velocity_ratio"]
    assert found == pytest.approx(surveyed, rel=3e-5)
