"""Tests of the parts of a scene, and of properties that follow from them."""

import inspect
import math
import re
from dataclasses import dataclass

import pytest
from rsfstudy.named_studies._critical_triggers import Triggers

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.slider import part_registry
from rsfstudy.slider.fluid.dilatant import DilatantFluid
from rsfstudy.slider.normal_stress.variable import VariableNormalStress
from rsfstudy.slider.parameter_layout import NORMAL_STRESS
from rsfstudy.status import Status


def test_orbits_of_another_law_need_not_close_at_critical_stiffness():
    """Orbits at the critical stiffness need not be closed for every law.

    Orbits are closed for the laws of the paper, but orbits of other laws may grow.
    Therefore, the boundary at the critical stiffness is not verified for other laws.
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


def test_a_part_owns_its_fields():
    """Each field is described once, by its part."""
    described = {quantity.name for quantity in part_registry.SCENE_FIELD_QUANTITIES}
    assert described == set(part_registry.SCENE_FIELD_NAMES)
    assert Scene(inertia=True, radiation_damping=0.0).inertia is True
    assert Scene(normal_stress="constant", alpha=None).alpha is None


def half_as_strong(friction, ratio, change, p):
    return 0.5 * p[NORMAL_STRESS] * math.log(ratio), 0.5 * p[NORMAL_STRESS] * change / ratio


def test_every_part_states_its_equation():
    """The docstring of each part, or of its functions, contains an equation.

    The reference page of names shows the equations.
    """
    for part in part_registry.PART_CLASS_BY_FIELD_NAME.values():
        functions = (one.__func__ for one in vars(part).values() if isinstance(one, staticmethod))
        stated = " ".join(inspect.getdoc(one) or "" for one in (part, *functions))
        assert part.name == "slider" or re.search(r"\.\. math::\n\n +[^\n]+", stated), part


@dataclass(frozen=True, kw_only=True)
class HalfEffect(VariableNormalStress):
    name = "half_effect"
    state_effect = staticmethod(half_as_strong)


@dataclass(frozen=True, kw_only=True)
class LeakyFault(DilatantFluid):
    name = "leaky"
    auxiliary_rates = staticmethod(DilatantFluid.auxiliary_rates)


def test_a_part_with_equations_of_its_own_inherits_no_conclusions():
    """User-defined equations do not inherit properties of other equations.

    Examples of such properties are d sigma/d tau and alpha, which published formulas and
    the Coulomb stress use, and a bound of pore pressure.
    """
    own, half = Scene(normal_stress=HalfEffect, alpha=0.4), Scene(alpha=0.2)
    assert own.critical_stiffness == pytest.approx(half.critical_stiffness, rel=1e-12)
    assert half.parts.normal_stress.coupling[1] == 0.2
    assert own.parts.normal_stress.coupling is None
    assert own.parts.normal_stress.compute_frictional_stress_lower_bound(own) == -math.inf
    told = LinearStability()(own, Accuracy()).values
    assert told["critical_stiffness"] == pytest.approx(half.critical_stiffness, rel=1e-9)
    assert math.isnan(told["critical_stiffness_explicit"])
    assert Triggers()(own, Accuracy()).status is Status.NOT_APPLICABLE
    assert LeakyFault().compute_pore_pressure_upper_bound(0.0, (0.0, 0.0)) == math.inf
    assert DilatantFluid().compute_pore_pressure_upper_bound(0.0, (0.0, 0.0)) < math.inf
