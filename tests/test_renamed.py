"""Tests of former names of functions, classes, members and keywords.

Former names work, with a deprecation warning.
"""

import importlib
import inspect
import operator
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

import rsfstudy
from rsfstudy import Scene
from rsfstudy._deprecation import (
    NEW_NAME_BY_OWNER_AND_FORMER_NAME,
    accept_former_keyword_names,
    add_former_member_names,
    copy_former_overrides_to_new_names,
    translate_former_member_name,
)
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.fitting.record import Record
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion import array_layout
from rsfstudy.motion.integration_events import maximum
from rsfstudy.motion.python_backend import PythonMotionState
from rsfstudy.quantities import Output
from rsfstudy.reductions import Reduction
from rsfstudy.slider.laws import LawBase
from rsfstudy.slider.parts import Part
from rsfstudy.slider.scene_base import SceneBase
from rsfstudy.status import Status

NAMES = [
    (place, former)
    for place, table in NEW_NAME_BY_OWNER_AND_FORMER_NAME.items()
    for former in table
]
#: Members that only some kinds of parts have.
OF_SOME_SLOTS = {
    "steady_states",
    "state_relaxation_function",
    "auxiliary_rates",
    "auxiliary_steady_states",
}


def find_owner(place: str) -> object:
    """Return the module, class or function of a place."""
    module, _, qualname = place.partition(":")
    owner: object = importlib.import_module(module)
    for name in filter(None, qualname.removesuffix("()").split(".")):
        owner = getattr(owner, name)
    return owner


def member_names(kind: type) -> set[str]:
    """Return the names of the members and instance fields of a class."""
    names = {*dir(kind), *(name for base in kind.__mro__ for name in inspect.get_annotations(base))}
    names |= set(dir(Scene)) if kind is SceneBase else set()
    names |= set(array_layout.MOTION_STATE_DTYPE.names) if kind is PythonMotionState else set()
    return names | (OF_SOME_SLOTS if kind is Part else set())


@pytest.mark.parametrize(("place", "former"), NAMES)
def test_former_names_lead_to_new_names(place, former):
    new, owner = NEW_NAME_BY_OWNER_AND_FORMER_NAME[place][former], find_owner(place)
    if place.endswith("()"):
        function = owner.__init__ if isinstance(owner, type) else owner
        assert function.__code__.co_filename.endswith("_deprecation.py")
        assert new in inspect.signature(function).parameters
    elif not isinstance(owner, type):
        with pytest.warns(DeprecationWarning, match=f"{former!r} of .* is now called {new!r}"):
            found = getattr(owner, former)
        assert found == operator.attrgetter(new)(owner)
    else:
        assert new in member_names(owner)
        assert former in vars(owner) or "__getattr__" in vars(owner)


def test_tables_are_used():
    """Access to a former name of an instance raises a warning."""
    scene = Scene(load_velocity_ratio=2.0)
    with pytest.warns(DeprecationWarning, match="'is_disturbed' of SceneBase is now"):
        assert scene.is_disturbed == scene.is_perturbed
    with pytest.warns(DeprecationWarning, match="'states' of SlipLaw is now"):
        assert scene.parts.law.states == 1
    with pytest.raises(AttributeError, match="no field or attribute 'nothing'"):
        scene.nothing  # noqa: B018
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        importlib.import_module("rsfstudy.slider.parts").nothing  # noqa: B018
    with pytest.warns(DeprecationWarning, match="'reading' of MotionPoint is now"):
        assert maximum("reading").quantity == "apparent_friction"
    with pytest.warns(DeprecationWarning, match="of maximum\\(\\) is now") as caught:
        assert maximum(of="spring_stress", waits=True) == maximum(
            "spring_stress", may_report_later=True
        )
    assert {warning.filename for warning in caught} == {__file__}
    with pytest.warns(DeprecationWarning, match="'stated' of Record\\(\\) is now"):
        assert (
            Record(
                {"time": TIMES, "displacement": TIMES, "friction": TIMES}, stated=()
            ).specified_steps
            == ()
        )
    state = PythonMotionState(step_length=1.0)
    with pytest.warns(DeprecationWarning, match="'taken' of PythonMotionState is now"):
        state.taken = 2.0
    with pytest.warns(DeprecationWarning, match="'taken' of PythonMotionState is now"):
        assert state.taken == state.step_length == 2.0


TIMES = np.arange(3.0)
OUTPUTS = (Output("x", "$x$", "1", "a number"),)


def test_members_that_subclasses_define_by_their_former_names():
    told = "is now called|takes scene, accuracy and meter"
    with pytest.warns(DeprecationWarning, match=told) as caught:  # noqa: PT031

        @dataclass(frozen=True)
        class Older(Measure):
            name: ClassVar[str] = "older"
            outputs, typical_work = OUTPUTS, 1
            headline: str = "x"
            factor: float = 2.0

            def find(self, scene, accuracy, meter):
                return Outcome(Status.OK, {"x": self.factor})

        class Oldest(Older):
            def find(self, scene, accuracy, meter):
                found = super().find(scene, accuracy, meter).values["x"]
                return Outcome(Status.OK, {"x": found + 1.0})

    assert {warning.filename for warning in caught} == {__file__}
    measure = Oldest(factor=3.0)
    measure.check()
    assert (measure.primary_output, replace(measure, headline="y").primary_output) == ("x", "y")
    assert measure(Scene(), rsfstudy.Accuracy()).values == {"x": 4.0}
    with pytest.warns(DeprecationWarning, match="'charged' of Oldest is now"):
        charged = measure.charged
    assert charged == measure.run_nested


def test_former_members_of_built_in_classes_are_found_through_super():
    told = "'find' of Doubled is now called 'compute'|accuracy and meter"
    with pytest.warns(DeprecationWarning, match=told):

        class Doubled(CriticalStep):
            def find(self, scene, accuracy, meter):
                outcome = super().find(scene, accuracy, meter)
                name = self.primary_output
                return replace(outcome, values={name: 2.0 * outcome.values[name]})

    measure, scene = Doubled(of="displacement_step"), Scene(stiffness_ratio=1.5)
    accuracy = rsfstudy.Accuracy()
    name = measure.primary_output
    with pytest.warns(DeprecationWarning, match=told):
        twice = measure(scene, accuracy).values[name]
    assert twice == 2.0 * CriticalStep(of="displacement_step")(scene, accuracy).values[name]


def test_new_names_win_and_other_fields_keep_theirs():
    class Both(LawBase):
        name, states, state_count = "both", 7, 2

    assert (Both.state_count, Both.states) == (2, 7)

    @dataclass(frozen=True, kw_only=True)
    class Field(LawBase):
        name = "field"
        states: float = 0.5

    assert (Field.state_count, Field().states) == (LawBase.state_count, 0.5)


def test_helpers_leave_other_names_alone(monkeypatch):
    kind = type("Kind", (SimpleNamespace,), {"__module__": "somewhere", "new": 3})
    tables = {"somewhere:Kind": {"old": "new"}, "somewhere:Kind()": {"old": "new"}}
    monkeypatch.setattr("rsfstudy._deprecation.NEW_NAME_BY_OWNER_AND_FORMER_NAME", tables)
    accept_former_keyword_names(add_former_member_names(kind))
    with pytest.warns(DeprecationWarning, match="'old' of Kind is now called 'new'"):
        assert kind.old == 3
    with pytest.warns(DeprecationWarning, match=r"'old' of Kind\(\) is now called 'new'"):
        assert kind(old=5).new == 5
    assert translate_former_member_name(kind, "other") == "other"
    copy_former_overrides_to_new_names(kind)


def test_former_keywords_are_passed_on_under_the_new_names():
    scales = {"slip_distance": "10 um", "reference_velocity": "1 um/s"}
    rig = rsfstudy.Rig(normal_stress="5 MPa", **scales)
    axis = rig.axis("slip_distance", ["10 um", "20 um"])
    parts = {"base": rig.scene(), "axes": [axis], "measure": CriticalStep()}
    with pytest.warns(DeprecationWarning, match=r"'laboratory' of Study\(\) .* 'rig'"):
        study = rsfstudy.Study(name="s", title="S", laboratory=rig, **parts)
    assert study.rig == rig
    with pytest.warns(DeprecationWarning, match="'laboratory'"):
        assert replace(study, laboratory=None, axes=[rsfstudy.Axis("a", [0.01])]).rig is None
    with pytest.warns(DeprecationWarning, match=r"Panel\(\)") as warned:
        panel = rsfstudy.Panel(x="phi", by=["law"], each=["case"])
    assert (panel.hue, panel.facet, len(warned)) == (["law"], ["case"], 2)


def test_points_of_an_axis_may_have_fields_under_the_former_name():
    point = SimpleNamespace(on_axis={"a": 0.01})
    with pytest.warns(DeprecationWarning, match="'on_axis' of SimpleNamespace"):
        assert rsfstudy.Axis("case", {"soft": point}).rows == ({"a": 0.01},)


def test_reductions_may_define_former_names():
    with pytest.warns(
        DeprecationWarning, match="'measured_in' of Doubled .* 'fields_determining_result_units'"
    ):

        @dataclass(frozen=True)
        class Doubled(Reduction):
            measured_in: ClassVar = {"": ("of",)}

            def __call__(self, dataset):
                return self.results("twice the value", {"": 2.0 * dataset[self.of]})

    assert Doubled("twice", "critical_stiffness").fields_determining_result_units == {"": ("of",)}
