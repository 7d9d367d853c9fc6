"""Tests of parts that require quantities which a scene may not provide."""

import math
import re
from dataclasses import dataclass

import pytest

from rsfstudy import Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.slider.fluid.dilatant import DilatantFluid
from rsfstudy.slider.laws import Law
from rsfstudy.slider.parameter_layout import LAW, MU_STAR, A
from rsfstudy.slider.quantities_required_by_parts import (
    QUANTITIES_A_PART_MAY_NEED,
    find_quantities_known_to_part,
)


def evolution(log_slip_rate, state, p):
    """Return the slip law with an additional decrease by frictional work."""
    work = (p[MU_STAR] + p[A] * log_slip_rate + state) * math.exp(log_slip_rate)
    return -(state + p[LAW] * log_slip_rate) - 1e-4 * (work - p[MU_STAR] * math.exp(log_slip_rate))


def steady_states(log_slip_rate, shift, p):
    """Return the zero of ``evolution``, which is linear in the state."""
    heated = 1e-4 * math.exp(log_slip_rate)
    rest = -log_slip_rate * (p[LAW] + heated * p[A]) / (1.0 + heated)
    return (shift + rest,)


@dataclass(frozen=True, kw_only=True)
class Heated(Law):
    name = "heated_by_work"
    needs = frozenset({"shear_stress"})
    evolution = staticmethod(evolution)
    steady_states = staticmethod(steady_states)


@dataclass(frozen=True, kw_only=True)
class Undeclared(Heated):
    name = "heated_undeclared"
    needs = frozenset({"friction_coefficient", "slip_rate", "state"})


CONSTANT = {"normal_stress": "constant"}


@pytest.mark.parametrize(
    ("fields", "cause", "remedy"),
    [
        ({}, "normal_stress='variable'", "Set normal_stress='constant'"),
        ({"normal_stress": "imposed"}, "normal_stress='imposed'", "Set normal_stress='constant'"),
        ({**CONSTANT, "fluid": "dilatant"}, "fluid='dilatant'", "Set fluid='drained'"),
        ({**CONSTANT, "regularised": True}, "regularised=True", "Set regularised=False"),
        ({"normal_stress": "imposed", "normal_stress_step": 0.1}, "the loading 'step'", "remove"),
    ],
)
def test_a_scene_refuses_a_law_whose_stress_it_does_not_provide(fields, cause, remedy):
    with pytest.raises(InvalidValue) as refused:
        Scene(law=Heated, **fields)
    text = str(refused.value)
    assert text.startswith("law = 'heated_by_work' requires shear_stress, but")
    assert cause in text
    assert remedy in text
    if not fields.get("regularised"):
        assert "The available quantities are friction_coefficient, " in text
        assert Scene(law=Undeclared, **fields).law == "heated_undeclared"


@pytest.mark.parametrize("fields", [{}, {"inertia": True}, {"velocity_oscillation": 0.1}])
def test_constant_normal_stress_provides_shear_stress(fields):
    scene = Scene(law=Heated, **CONSTANT, **fields)
    assert "shear_stress" in find_quantities_known_to_part(scene, scene.parts.law)
    with pytest.raises(InvalidValue, match="normal_stress='variable'"):
        scene.with_(normal_stress="variable")


@dataclass(frozen=True, kw_only=True)
class HeatedPores(DilatantFluid):
    name = "heated_pores"
    needs = ("shear_stress",)
    auxiliary_rates = staticmethod(DilatantFluid.auxiliary_rates)


def test_no_scene_provides_shear_stress_to_a_fluid():
    with pytest.raises(InvalidValue, match="in any scene. The available quantities are"):
        Scene(fluid=HeatedPores, **CONSTANT)


@pytest.mark.parametrize(
    ("given", "said"),
    [({"shear stress"}, "Did you mean 'shear_stress'"), ("state", "Write {'state'}.")],
)
def test_needs_is_a_set_of_known_names(given, said):
    @dataclass(frozen=True, kw_only=True)
    class Wrong(Heated):
        name = "wrong_needs"
        needs = given

    with pytest.raises(InvalidValue, match=re.escape(said)):
        Scene(law=Wrong, **CONSTANT)


def test_dynamics_receive_every_quantity():
    scene = Scene(normal_stress="variable", fluid="dilatant")
    assert find_quantities_known_to_part(scene, scene.parts.dynamics) == frozenset(
        QUANTITIES_A_PART_MAY_NEED
    )
