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
from rsfstudy.status import Status

CONSTANT = {"normal_stress": "constant"}
CUT_OFFS = ("composite", "cut_off")


# ---- critical stiffness --------------------------------------------------------------------------


def composite(scene: Scene, log_rate: float) -> float:
    """(1 + w)(b - a) + b w V/V_c, w exp(w) = exp(-V/V_c)."""
    relative = math.exp(log_rate) / scene.cutoff_velocity_ratio
    w = lambert_w(math.exp(-relative))
    return (1.0 + w) * (scene.b - scene.a) + scene.b * w * relative


def cut_off(scene: Scene, log_rate: float) -> float:
    """b/(1 + V/V_c) - a."""
    return scene.b / (1.0 + math.exp(log_rate) / scene.cutoff_velocity_ratio) - scene.a


@given(st.floats(-12, 12), st.floats(-4, 12), st.floats(1.05, 4.0))
def test_critical_stiffness_of_cut_offs(log_rate, log_cutoff, b_over_a):
    """Slopes of the law are differences of order eight; those of exp(-V/V_c), whose ninth
    derivative reaches 1e4, are exact to 1e-9 or so.
    """
    for law, formula in (("composite", composite), ("cut_off", cut_off)):
        cutoff = math.exp(log_cutoff)
        scene = Scene(law=law, cutoff_velocity_ratio=cutoff, b_over_a=b_over_a, stiffness=1.0,
                      **CONSTANT)  # fmt: skip
        ours = stability.critical_stiffness(scene, log_rate)
        exact = max(formula(scene, log_rate), 0.0)
        assert ours == pytest.approx(exact, abs=1e-8 * scene.b)


def test_published_critical_stiffnesses():
    """Of the composite law where V is far below V_c, and at V_c; of the cut-off where it vanishes,
    V = V_c (b - a)/a.
    """
    scene = Scene(law="composite", b_over_a=1.5, cutoff_velocity_ratio=1e15, **CONSTANT)
    weakening = scene.b - scene.a
    assert scene.critical_stiffness / weakening == pytest.approx(1.5671433, abs=6e-8)
    scene = scene.with_(cutoff_velocity_ratio=1.0)
    assert scene.critical_stiffness / weakening == pytest.approx(2.1138582, abs=6e-8)
    scene = Scene(law="cut_off", b_over_a=1.5, cutoff_velocity_ratio=8.0, **CONSTANT)
    for log_rate, weakens in ((math.log(3.99), True), (math.log(4.01), False)):
        assert (stability.critical_stiffness(scene, log_rate) > 0.0) is weakens


def test_no_steady_sliding_below_the_slowest_by_laws_with_a_rate_of_their_own():
    for law in CUT_OFFS:
        scene = Scene(law=law)
        slowest = steady.slowest_steady(scene)
        assert steady.steady_sliding(scene, slowest + 1e-6) is not None
        assert steady.steady_sliding(scene, slowest - 1e-6) is None
        assert steady.slowest_steady(scene.with_(**CONSTANT)) == -math.inf


# ---- critical displacement steps -----------------------------------------------------------------


def power(exponent: float, ratio: float) -> float:
    product = exponent * ratio
    return -math.log1p(-product) / product if product else 1.0


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.5])
@pytest.mark.parametrize(
    ("fields", "exact"),
    [
        ({"law": "slip"}, lambda ratio: 1.0),
        ({"law": "perrin_rice_zheng"}, lambda ratio: math.asinh(ratio) / ratio),
        ({"law": "family", "law_exponent": 0.25}, lambda ratio: power(0.25, ratio)),
        ({"law": "family", "law_exponent": 0.5}, lambda ratio: power(0.5, ratio)),
    ],
    ids=["slip", "perrin_rice_zheng", "family 0.25", "family 0.5"],
)
def test_critical_displacement_steps(fields, exact, ratio):
    """Load point held: steps of u*/r a/(b - a) D_c, h(u*) = -r = -k/k_cr. A finite norm lowers
    them, the more the slower the state falls: by 1e-3 at eps = 1/2, r = 1.5, below 1e-6 elsewhere.
    """
    scene = Scene(stiffness_ratio=ratio, instability_norm=1e12, **CONSTANT, **fields)
    found = CriticalStep(of="displacement_step")(scene, Accuracy(1e-7))
    assert found.status is Status.OK
    slow = fields.get("law_exponent", 0.0) * ratio > 0.5
    assert found.values["critical_displacement"] == pytest.approx(
        exact(ratio), rel=1e-3 if slow else 2e-6
    )


def test_there_is_none_for_every_norm_where_the_law_is_too_slow():
    """eps k >= k_cr: critical steps grow with the logarithm of the norm."""
    steps = []
    for norm in (1e4, 1e8, 1e12):
        scene = Scene(law="family", law_exponent=0.5, stiffness_ratio=2.5, instability_norm=norm,
                      **CONSTANT)  # fmt: skip
        found = CriticalStep(of="displacement_step")(scene, Accuracy(1e-6))
        steps.append(found.values["critical_displacement"])
    assert steps[2] - steps[1] == pytest.approx(steps[1] - steps[0], rel=0.01)
    assert steps[1] - steps[0] > 0.1 * steps[0]


def test_published_critical_displacement_steps():
    assert math.asinh(1.0) == pytest.approx(0.8813736, abs=6e-8)
    assert power(0.5, 1.0) == pytest.approx(1.3862944, abs=6e-8)


def test_only_a_jump_reaches_the_norm_where_the_spring_unloads_faster_than_the_state_falls():
    """K > b/eps: slip slows down from the step on."""
    for norm in (1e4, 1e8):
        scene = Scene(law="family", law_exponent=0.5, stiffness_ratio=4.5, instability_norm=norm,
                      **CONSTANT)  # fmt: skip
        found = CriticalStep(of="displacement_step")(scene, Accuracy(1e-6))
        assert "jump of slip rate at the step itself" in found.message
        at_once = scene.a * scene.log_norm_rate / scene.stiffness
        assert found.values["critical_displacement"] == pytest.approx(at_once, rel=1e-8)


# ---- critical load point velocity steps ----------------------------------------------------------


@pytest.mark.parametrize("exponent", [0.0, 0.25, 0.5])
@pytest.mark.parametrize("b_over_a", [2.0, 5.0])
def test_critical_velocity_steps_of_the_family_at_critical_stiffness(exponent, b_over_a):
    """V_0/V_* = 1 + a/[(1 - eps)(b-a)]: in q = exp(-eps u) and y = V_0/V the orbits are those of a
    Lotka-Volterra system, and the line from V_* through its saddle (1 - eps, 0) is one of them.
    """
    scene = Scene(law="family", law_exponent=exponent, b_over_a=b_over_a, instability_norm=1e12,
                  **CONSTANT)  # fmt: skip
    found = CriticalStep()(scene, Accuracy(1e-6)).values
    exact = 1.0 + 1.0 / ((1.0 - exponent) * (b_over_a - 1.0))
    error = found["critical_velocity_ratio_error"]
    assert error < 3e-6 * exact
    assert found["critical_velocity_ratio"] == pytest.approx(exact, abs=error)


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
