"""Tests of valid scenes.

The module ``test_wordings`` tests the errors of invalid scenes.
"""

import dataclasses
import inspect
import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import rsfstudy
from rsfstudy import Axis, Scene
from rsfstudy.slider import field_name_hints, laws
from rsfstudy.slider.part_registry import SCENE_FIELD_NAMES
from rsfstudy.slider.parts import number


def test_a_field_of_a_users_own_may_bear_any_name():
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Renamed(laws.BUILT_IN_LAW_CLASS_BY_NAME["slip"]):
        kappa: float = number(1.0, "$\\kappa$", "1", "a number of its own")

        name = "renamed"

    assert Scene(law=Renamed, kappa=2.0).kappa == 2.0


def test_every_synonym_leads_to_a_field_or_law_that_is_there():
    for name, remedy in field_name_hints._HINT_BY_WRONG_FIELD_NAME.items():
        assert name not in SCENE_FIELD_NAMES
        if remedy.startswith("Write "):
            assert re.match(r"Write (\w+)", remedy)[1] in SCENE_FIELD_NAMES
    assert set(field_name_hints._LAW_NAME_BY_ALIAS.values()) <= set(laws.BUILT_IN_LAW_CLASS_BY_NAME)


def test_a_scene_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Scene().a = 0.01


def test_table_1_is_the_default():
    scene = Scene()
    assert (scene.a, scene.mu_star, scene.phi, scene.alpha) == (0.0145, 0.76, 60.0, 0.56)
    assert (scene.period, scene.reference_rate) == (5.0, 1.17e-8)
    # T V_*/(2 pi D_c) for the values of Table 1.
    assert scene.inertial_time == pytest.approx(9.31e-9, rel=1e-3)


def test_load_point_is_held_after_a_displacement_step_unless_said_otherwise():
    assert Scene().load_velocity == 1.0
    assert Scene(displacement_step=1.0).load_velocity == 0.0
    assert Scene(displacement_step=1.0, load_velocity_ratio=3.0).load_velocity == 3.0


def test_effects_are_those_the_scene_calls_for():
    assert Scene(normal_stress="constant").effects == ()
    worn, wet = Scene(alpha=0.0, stress_dependence=1.0), Scene(alpha=0.0, fluid="dilatant")
    assert worn.effects == ("stress_dependence", "inclined_driving")
    assert wet.effects == ("inclined_driving", "dilatancy")
    assert Scene(inertia=True).effects == ("inclined_driving", "linker_dieterich", "inertia")


@given(
    a=st.floats(1e-4, 0.1),
    b_over_a=st.floats(1.01, 21.0),
    mu_star=st.floats(0.1, 1.0),
    alpha=st.floats(0.0, 1.2),
    tilt=st.floats(0.01, 0.99),
)
def test_stiffness_is_positive_for_every_scene(a, b_over_a, mu_star, alpha, tilt):
    lowest = math.degrees(math.atan(mu_star))
    scene = Scene(
        a=a, b_over_a=b_over_a, mu_star=mu_star, alpha=alpha, phi=lowest + tilt * (90.0 - lowest)
    )
    assert 0.0 < scene.stiffness < math.inf


@pytest.mark.parametrize("called", ["aging", "ageing", "Aging", "Dieterich", "dieterich_ruina"])
def test_laws_by_the_names_others_give_them(called):
    assert Scene(law=called) == Scene(law="slowness")
    assert Axis("law", ["Ruina", called]).rows == ({"law": "slip"}, {"law": "slowness"})


def test_tab_completion_offers_what_users_call_and_nothing_else():
    assert dir(rsfstudy) == sorted(rsfstudy.__all__)
    assert all(callable(getattr(rsfstudy, name)) for name in dir(rsfstudy))
    offered = dir(Scene(normal_stress="constant", stiffness=0.02))
    assert {"a", "law", "stiffness", "stiffness_ratio", "b", "parts", "with_"} <= set(offered)
    assert not {
        "alpha",
        "phi",
        "friction_law_functions",
        "combination",
        "_layout",
        "__init__",
    } & set(offered)
    assert {"alpha", "phi"} <= set(dir(Scene()))


def test_the_signature_of_a_scene_names_its_fields():
    stated = inspect.signature(Scene).parameters
    assert tuple(stated) == (*SCENE_FIELD_NAMES, "dynamics", "loading")
    assert stated["law"].default == "slip"
    assert stated["a"].default == Scene().a


@pytest.mark.parametrize(
    "changes",
    [
        {"stiffness_ratio": 0.5}, {"load_velocity_ratio": 3.0}, {"displacement_step": 1.0},
        {"a": 0.012}, {"b_over_a": 3.0}, {"mu_star": 0.7}, {"phi": 70.0}, {"alpha": 0.3},
        {"stiffness_ratio": 0.5, "b_over_a": 3.0},
    ],
    ids=str,
)  # fmt: skip
def test_copies_share_a_critical_stiffness_only_where_friction_is_the_same(changes):
    scene = Scene(normal_stress="variable", stiffness_ratio=0.8)
    assert scene.critical_stiffness > 0.0
    copy = scene.with_(**changes)
    anew = Scene(**{"normal_stress": "variable", "stiffness_ratio": 0.8, **changes})
    assert copy.critical_stiffness == anew.critical_stiffness
    assert copy.stiffness == anew.stiffness
