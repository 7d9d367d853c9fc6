"""Tests of elasticities and of their error estimates."""

import math
from dataclasses import dataclass
from typing import ClassVar

import pytest

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.measure_base.elasticities import Elasticities
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.quantities import Output
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.rig.rig_quantities import derive_scene_fields_from_rig
from rsfstudy.status import Status

#: A scene whose boundaries have closed forms, nearly independent of the instability norm.
SCENE = Scene(law="slip", normal_stress="constant", b_over_a=3.0)
COMPILED = Accuracy(engine="compiled")


def told(measure, scene=SCENE, accuracy=COMPILED):
    found = measure(scene, accuracy)
    assert found.status is Status.OK, found.message
    pairs = zip(found.values["elasticity"], found.values["elasticity_error"], strict=True)
    return dict(zip(measure.parameters, pairs, strict=True)), found


@pytest.mark.parametrize(
    ("measure", "exact"),
    [
        # D_c a/(b - a) = D_c/(r - 1) with r = b/a
        (CriticalStep("displacement_step"), {"b_over_a": -1.5, "a": 0.0, "mu_star": 0.0}),
        # 1 + a/(b - a) = r/(r - 1)
        (CriticalStep(), {"b_over_a": -0.5, "a": 0.0, "instability_norm": 0.0}),
        # (b - a) sigma/D_c
        (LinearStability(), {"b_over_a": 1.5, "a": 1.0, "mu_star": 0.0, "period": 0.0}),
    ],
)
def test_closed_forms(measure, exact):
    """Elasticities agree with closed forms within their error estimates.

    The estimates are below 1e-5, because errors of 1e-9 of the measure lead to errors of
    1e-6.
    """
    found, outcome = told(Elasticities(measure))
    for name, value in exact.items():
        elasticity, error = found[name]
        assert abs(elasticity - value) <= error <= 1e-5
    lacking = {name for name, (elasticity, _error) in found.items() if math.isnan(elasticity)}
    assert {"alpha", "phi", "displacement_step", "stiffness"} - set(
        measure.solved_fields
    ) <= lacking
    assert (
        outcome.values[measure.primary_output]
        == measure(SCENE, COMPILED).values[measure.primary_output]
    )


def test_at_the_critical_stiffness_there_is_one_side():
    """The elasticity at the critical stiffness is a one-sided difference.

    Below the critical stiffness, every step triggers instability. The error estimate covers
    the deviation from a second-order difference.
    """
    found, _outcome = told(Elasticities(CriticalStep(), parameters=("stiffness_ratio",)))
    elasticity, error = found["stiffness_ratio"]
    at = [
        CriticalStep()(SCENE.with_(stiffness_ratio=math.exp(n * 0.004)), COMPILED) for n in range(3)
    ]
    y = [math.log(outcome.values["critical_velocity_ratio"]) for outcome in at]
    assert elasticity == pytest.approx((4.0 * y[1] - 3.0 * y[0] - y[2]) / 0.008, abs=error)
    assert 1e-4 < error < 0.01


CONSTANT = {"normal_stress": "constant", "law": "slowness"}
SCENES = [
    (CriticalStep("displacement_step"), Scene(**CONSTANT, b_over_a=1.5, stiffness_ratio=1.3)),
    (CriticalStep(), Scene(law="slip", alpha=0.3, phi=45.0, b_over_a=1.5, stiffness_ratio=1.02)),
    (LimitCycle(phases=2), Scene(**CONSTANT, b_over_a=1.5, stiffness_ratio=0.8, inertia=True)),
    (LimitCycle(phases=2), Scene(**CONSTANT, b_over_a=1.2, stiffness_ratio=0.95, inertia=True)),
]


@pytest.mark.parametrize(("measure", "scene"), SCENES)
def test_errors_are_told_without_closed_forms_too(measure, scene):
    """The error estimates cover the errors for each field.

    The fields include the stiffness of a cycle near the critical stiffness. The reference
    uses steps that are ten times shorter, and a tolerance smaller by 10^-4.
    """
    of = Elasticities(measure)
    finer = Accuracy(rtol=1e-9, engine="compiled", budget=50_000_000)
    looser = Accuracy(rtol=1e-5, engine="compiled")
    loose, tight = (told(of, scene, accuracy)[0] for accuracy in (looser, finer))
    known = {name for name, (elasticity, _error) in loose.items() if not math.isnan(elasticity)}
    assert {"a", "b_over_a", "mu_star", "stiffness_ratio"} <= known
    for name in known:
        assert abs(loose[name][0] - tight[name][0]) <= loose[name][1] + tight[name][1]
        assert loose[name][1] < 0.02


def extrapolated(measure, scene, name, steps=(0.004, 0.002, 0.001)):
    """Compute an elasticity by Richardson extrapolation.

    The central differences are computed with rtol = 1e-11.
    """
    accuracy = Accuracy(1e-11, engine="compiled", budget=20_000_000)

    def level(by):
        changed = scene.with_(**{name: getattr(scene, name) * math.exp(by)})
        return math.log(abs(measure(changed, accuracy).values[measure.primary_output]))

    first, second, third = ((level(h) - level(-h)) / (2.0 * h) for h in steps)
    rough, fine = second + (second - first) / 3.0, third + (third - second) / 3.0
    return fine + (fine - rough) / 15.0


SHARP = {"normal_stress": "constant", "a": 0.01}
#: Scenes near b = a, where the truncation error exceeds the estimate from the curvature.
NEAR_NEUTRAL = [
    (
        CriticalStep("displacement_step"),
        Scene(law="perrin_rice_zheng", **SHARP, b_over_a=1.18, stiffness=1.42 * 0.18 * 0.01),
    ),
    (
        CriticalStep("displacement_step"),
        Scene(law="slowness", **SHARP, b_over_a=1.07, stiffness=1.6 * 0.07 * 0.01),
    ),
    (CriticalStep(), Scene(law="slip", **SHARP, b_over_a=1.1, stiffness=1.3 * 0.1 * 0.01)),
]


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
@pytest.mark.parametrize(("measure", "scene"), NEAR_NEUTRAL)
def test_error_covers_the_truncation_near_b_equal_to_a(measure, scene, rtol):
    """The error estimate covers the truncation error.

    The reference is accurate to 1e-7 of the elasticity by ``b_over_a``, which grows like 1/(b
    - a).
    """
    accuracy = Accuracy(rtol, engine="compiled")
    ((elasticity, error),) = told(Elasticities(measure, ("b_over_a",)), scene, accuracy)[0].values()
    exact = extrapolated(measure, scene, "b_over_a")
    assert abs(elasticity - exact) <= error + 1e-7 * abs(exact)
    assert error < 20.0 * rtol ** (2.0 / 3.0) * abs(exact)


@dataclass(frozen=True)
class Known(Measure):
    """Measure y = a^2 exp(-mu_star)/(b/a - 1) with a given error."""

    error: float = 0.0
    name: ClassVar[str] = "known"
    primary_output = "y"
    typical_rhs_evaluations = 1
    outputs = (Output("y", "", "1", "known", error=True),)
    asked: ClassVar[list[Scene]] = []

    def compute(self, scene, integrator):
        self.asked.append(scene)
        if scene.mu_star > 0.9:
            return Outcome(Status.WORK_BUDGET_SPENT, message="too far")
        if scene.mu_star < 0.1:
            return Outcome(Status.NO_LIMIT_CYCLE)
        y = scene.a**2 * math.exp(-scene.mu_star) / (scene.b_over_a - 1.0)
        made = y * (1.0 + self.error * math.sin(1e9 * y))
        return Outcome(Status.OK, {"y": made, "y_error": self.error * y})


@pytest.mark.parametrize("error", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_steps_know_the_error_of_the_number(error):
    """Every elasticity is within its error estimate.

    The estimate scales with the error to the power of two thirds. There are 4 n + 1
    measurements.
    """
    Known.asked.clear()
    found, _outcome = told(Elasticities(Known(error)), SCENE)
    numbers = sum(not math.isnan(elasticity) for elasticity, _error in found.values())
    assert len(Known.asked) == 4 * numbers + 1
    for name, exact in {"a": 2.0, "mu_star": -0.6, "b_over_a": -1.5, "period": 0.0}.items():
        elasticity, estimate = found[name]
        exact = -SCENE.mu_star if name == "mu_star" else exact
        assert abs(elasticity - exact) <= estimate
        # Rounding errors are a few times 2.2e-16 for y, and for its logarithm, which is about
        # 10.
        assert estimate <= 4.0 * max(error, 2e-14) ** (2.0 / 3.0)


@dataclass(frozen=True)
class Ending(Known):
    """Measure y = (1 - k/k_cr)^0.05 with a given error.

    The measure has no result for k >= k_cr.
    """

    def compute(self, scene, integrator):
        if scene.stiffness_ratio >= 1.0:
            return Outcome(Status.NO_LIMIT_CYCLE)
        y = (1.0 - scene.stiffness_ratio) ** 0.05
        made = y * (1.0 + self.error * math.sin(1e9 * y))
        return Outcome(Status.OK, {"y": made, "y_error": self.error * y})


@pytest.mark.parametrize("apart", [0.02, 0.005, 0.002, 0.0005])
@pytest.mark.parametrize("error", [1e-7, 1e-5])
def test_near_the_end_of_answers_errors_cover(apart, error):
    """The error estimate is valid near the end of the domain.

    Steps of (e/2)^(1/3), which are 0.004 and 0.017, reach beyond the end. A one-sided
    secant would have an error of more than 50 %.
    """
    measure = Elasticities(Ending(error), parameters=("stiffness_ratio",))
    ((elasticity, estimate),) = told(measure, SCENE.with_(stiffness_ratio=1.0 - apart))[0].values()
    exact = -0.05 * (1.0 - apart) / apart
    assert abs(elasticity - exact) <= estimate <= 0.5 * abs(exact)


def test_ends_without_elasticities():
    measure = Elasticities(Known())
    assert measure(SCENE.with_(mu_star=0.95), COMPILED).status is Status.WORK_BUDGET_SPENT
    beside = measure(SCENE.with_(mu_star=0.9), COMPILED)
    assert beside.status is Status.WORK_BUDGET_SPENT
    assert beside.message.startswith("at mu_star = 0.900")
    assert measure(SCENE.with_(mu_star=0.05), COMPILED).status is Status.NO_LIMIT_CYCLE
    # At the edge of the domain, one side remains.
    found, _outcome = told(measure, SCENE.with_(mu_star=0.1))
    elasticity, error = found["mu_star"]
    assert abs(elasticity + 0.1) <= error < 1e-4


def test_the_elasticities_that_uncertain_recurrence_states():
    """The elasticities published with the study agree with computed values.

    The elasticities refer to the interval in s of a rig with constant stiffness. The
    elasticities by a and b each keep the other parameter constant, and D_c also changes k
    D_c/sigma_*, V_*/D_c and the unit of time. The published values have three digits. The
    elasticities by rig quantities are also compared with differences between two rigs,
    whose truncation error is 1e-4 for steps of 1 %.
    """
    from rsfstudy.named_studies import uncertain_recurrence as stated

    names = ("a", "b_over_a", "stiffness", "reference_rate")
    measure = Elasticities(LimitCycle(phases=2), parameters=names)
    found, _outcome = told(measure, stated.base)
    a, ratio, stiffness, rate = (elasticity for elasticity, _error in found.values())
    by_rig = {
        "slip_distance": 1.0 + stiffness - rate,
        "normal_stress": -stiffness,
        "reference_velocity": rate - 1.0,
    }
    exact = {"a": a - ratio, "b": ratio, **by_rig}
    for name, value in stated.ELASTICITIES.items():
        assert value == pytest.approx(exact[name], rel=2e-3, abs=0.01)
    known = stated.rig.as_dict()
    for name, value in by_rig.items():
        ends = []
        for by in (-0.01, 0.01):
            rig = known | {name: known[name] * math.exp(by)}
            cycle = LimitCycle(phases=2)(
                stated.base.with_(**derive_scene_fields_from_rig(rig)), COMPILED
            )
            interval = cycle.values["recurrence_interval"] * rig["slip_distance"]
            ends.append(math.log(interval / rig["reference_velocity"]))
        assert (ends[1] - ends[0]) / 0.02 == pytest.approx(value, abs=1e-3)
    with pytest.raises(InvalidValue, match="elasticity with respect to D_c is "):
        Elasticities(LimitCycle(), parameters=("slip_distance",))
