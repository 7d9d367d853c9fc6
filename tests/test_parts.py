"""A part is one file: what a law of another kind takes, and that everything follows from it."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from rsfstudy.named_studies._triggers import Triggers

from rsfstudy import Scene
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.linear_stability import LinearStability
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider import registry, stability, steady
from rsfstudy.slider.equations import evolution_of
from rsfstudy.slider.fluid.dilatant import Dilatant
from rsfstudy.slider.normal_stress.variable import Variable
from rsfstudy.slider.places import DYNAMICS, FLUID, LAW, NORMAL_STRESS, A
from rsfstudy.status import Status


def test_orbits_of_another_law_need_not_close_at_critical_stiffness():
    """By the laws of the paper they do; by others they may grow, so that a boundary has to leave
    open what happens there.
    """
    critical = {"normal_stress": "constant", "load_velocity_ratio": 1.05}
    grown = {}
    for law in ("perrin_rice_zheng", "slowness", "slip"):
        outcome = StepResponse(peaks=3)(Scene(law=law, **critical), Accuracy(1e-8))
        peaks = outcome.values["peak_log10_slip_rate"]
        grown[law] = peaks[2] - peaks[0]
    assert grown["perrin_rice_zheng"] > 5e-5
    assert max(abs(grown["slowness"]), abs(grown["slip"])) < 1e-6
    of_law = CriticalStep()(Scene(law="perrin_rice_zheng", normal_stress="constant"), Accuracy())
    assert of_law.status is Status.UNVERIFIED


def test_the_faster_a_state_falls_above_steady_sliding_the_smaller_the_critical_step():
    """Per slip as -b sinh z, -b z and -b (1 - exp(-z)), z = Theta/b + ln V: in this order."""
    prz, slip, slowness = (
        CriticalStep()(Scene(law=law, stiffness_ratio=1.1), Accuracy(1e-5)).values[
            "critical_velocity_ratio"
        ]
        for law in ("perrin_rice_zheng", "slip", "slowness")
    )
    assert prz < slip
    assert math.isnan(slowness) or slip < slowness


def test_slopes_of_a_law_at_steady_sliding():
    """Of order eight: 1e-14 where the law is smooth over a twentieth of ln V."""
    for law in ("slip", "slowness", "perrin_rice_zheng"):
        scene = Scene(law=law)
        for log_slip_rate in (-5.0, 0.0, 3.0):
            assert evolution_of(scene)(log_slip_rate, -scene.b * log_slip_rate) == pytest.approx(
                0, abs=1e-15
            )
            slopes = stability.slopes_of_law(scene, steady.steady_sliding(scene, log_slip_rate))
            assert np.ravel(slopes[0]) == pytest.approx(-scene.b, rel=1e-12)
            assert np.ravel(slopes[1]) == pytest.approx(1.0, rel=1e-12)
            assert np.ravel(slopes[2]) == pytest.approx(-1.0, rel=1e-12)


def test_numbers_stand_where_their_parts_look_for_them():
    scene = Scene(
        alpha=0.3,
        phi=70.0,
        inertia=True,
        stiffness=0.02,
        load_velocity_ratio=2.0,
        normal_stress_step=0.1,
    )
    p = scene.numbers
    of_law = scene.a, scene.b, scene.mu_star
    assert p[A:NORMAL_STRESS] == (*of_law, 0.02, 2.0, math.log(2.0), 0.0, 0.1)
    cot_phi = 1.0 / math.tan(math.radians(70.0))
    of_mass = scene.inertial_time, math.log(scene.inertial_time)
    assert p[DYNAMICS : DYNAMICS + 2] == of_mass
    assert p[NORMAL_STRESS : NORMAL_STRESS + 2] == (0.3, cot_phi)
    assert p[LAW:] == (scene.b,)
    assert all(math.isnan(p[place]) for place in range(FLUID, DYNAMICS))


def test_a_part_owns_its_fields():
    """Each is described once, by the part."""
    described = {quantity.name for quantity in registry.QUANTITIES}
    assert described == set(registry.FIELDS)
    assert Scene(inertia=True, radiation_damping=0.0).inertia is True
    assert Scene(normal_stress="constant", alpha=None).alpha is None


def half_as_strong(friction, ratio, change, p):
    return 0.5 * p[NORMAL_STRESS] * math.log(ratio), 0.5 * p[NORMAL_STRESS] * change / ratio


@dataclass(frozen=True, kw_only=True)
class HalfEffect(Variable):
    name = "half_effect"
    state_effect = staticmethod(half_as_strong)


@dataclass(frozen=True, kw_only=True)
class LeakyFault(Dilatant):
    name = "leaky"
    auxiliary_rates = staticmethod(Dilatant.auxiliary_rates)


def test_a_part_with_equations_of_its_own_inherits_no_conclusions():
    """What follows from the equations of another: d sigma/d tau and alpha, by which published
    formulas and the friction of Coulomb stress go, or a bound of pore pressure.
    """
    own, half = Scene(normal_stress=HalfEffect, alpha=0.4), Scene(alpha=0.2)
    assert own.critical_stiffness == pytest.approx(half.critical_stiffness, rel=1e-12)
    assert half.parts.normal_stress.coupling[1] == 0.2
    assert own.parts.normal_stress.coupling is None
    assert own.parts.normal_stress.weakest(own) == -math.inf
    told = LinearStability()(own, Accuracy()).values
    assert told["critical_stiffness"] == pytest.approx(half.critical_stiffness, rel=1e-9)
    assert math.isnan(told["critical_stiffness_explicit"])
    assert Triggers()(own, Accuracy()).status is Status.NOT_APPLICABLE
    assert LeakyFault().highest_pressure(0.0, (0.0, 0.0)) == math.inf
    assert Dilatant().highest_pressure(0.0, (0.0, 0.0)) < math.inf
