"""Tests of the widgets of a scene and of the runner of computations, without a browser."""

import threading
import time
from dataclasses import dataclass
from typing import ClassVar

import panel as pn
import pytest

import rsfstudy
from rsfstudy.explorer.background_jobs import BackgroundJobRunner
from rsfstudy.explorer.number_widgets import SliderRange
from rsfstudy.explorer.scene_controls import SceneControls
from rsfstudy.explorer.scene_presets import SETTINGS_BY_PRESET_LABEL
from rsfstudy.explorer.scene_settings import README_RIG_QUANTITIES, SceneSettings
from rsfstudy.slider import SceneFields

#: Settings with which every part can be combined.
SETTINGS = SceneSettings({"law": "slip", "normal_stress": "imposed"})
RIG_SETTINGS = SceneSettings({"law": "slip", "normal_stress": "imposed"}, README_RIG_QUANTITIES)
SLOTS = {slot.name: slot for slot in SceneFields.PART_SLOTS}


def choose(controls, slot, name):
    """Select a part in the menu of a slot."""
    cards = {card.title.partition(":")[0]: card for card in controls.column.objects[1:]}
    cards[slot.replace("_", " ").capitalize()].objects[0].value = name


def scene_of(controls):
    settings = controls.settings
    return settings.build_scene(settings.build_rig())


@pytest.mark.parametrize("settings", [SETTINGS, RIG_SETTINGS], ids=["dimensionless", "rig"])
@pytest.mark.parametrize("slot", SLOTS)
def test_every_part_can_be_chosen_and_left(slot, settings):
    calls = []
    controls = SceneControls(settings, lambda: calls.append(controls.settings))
    first = settings.scene.get(slot, SLOTS[slot].default_part_name)
    for part in [name for name in SLOTS[slot].built_in_parts if name != first] + [first]:
        if part == "thermal":
            choose(controls, "temperature", "shear_heating")
        calls.clear()
        choose(controls, slot, part)
        assert calls == [controls.settings]
        assert getattr(scene_of(controls).parts, slot).name == part


@pytest.mark.parametrize("settings", [SETTINGS, RIG_SETTINGS], ids=["dimensionless", "rig"])
def test_a_protocol_can_be_chosen_and_left(settings):
    controls = SceneControls(settings, lambda: None)
    for _ in range(2):  # the second time, the scene has had a protocol
        choose(controls, "loading", "protocol")
        assert len(scene_of(controls).parts.loading.segments) == 3
        choose(controls, "loading", "slide_hold_slide")
        assert scene_of(controls).parts.loading.hold_time == pytest.approx(100.0)
    choose(controls, "loading", "step")
    assert controls.settings == settings


@pytest.mark.parametrize("label", SETTINGS_BY_PRESET_LABEL)
def test_presets_survive_state_and_units(label):
    preset = SETTINGS_BY_PRESET_LABEL[label]
    assert SceneSettings.from_widget_state(preset.as_widget_state()) == preset
    scene = preset.build_scene(preset.build_rig())
    assert SceneSettings.from_scene(scene).build_scene(None) == scene
    if preset.rig:
        again = SceneSettings.from_scene(scene, preset.build_rig())
        values = again.build_scene(again.build_rig()).as_dict()
        known = scene.as_dict()
        assert values.keys() == known.keys()
        for name, value in known.items():
            expected = pytest.approx(value, rel=1e-11) if isinstance(value, float) else value
            assert values[name] == expected, name


def test_user_defined_parts_have_widgets():
    from rsfstudy.parts import number
    from rsfstudy.slider.laws.slowness import SlownessLaw

    @dataclass(frozen=True, kw_only=True)
    class ExplorerLaw(SlownessLaw):
        name: ClassVar[str] = "explorer_law"
        healing_power: float = number(2.0, "$h$", "1", "power of healing")

    scene = rsfstudy.Scene(law=ExplorerLaw, healing_power=3.0)
    settings = SceneSettings.from_scene(scene)
    assert settings.build_scene(None) == scene
    controls = SceneControls(settings, lambda: None)
    rows = [row for card in controls.column.objects[1:] for row in card.objects]
    sliders = {row.objects[0].label: row for row in rows if isinstance(row, pn.Row)}
    sliders["healing_power"].objects[1].value = 4.0
    assert scene_of(controls) == scene.with_(healing_power=4.0)
    assert "law=ExplorerLaw" in settings.format_equivalent_python_code()


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"scenes": {}}, "scenes.*is unknown"),
        ({"scene": 3}, "must be an object"),
        ({"protocol": ["a"]}, "must be a text"),
    ],
)
def test_a_wrong_state_is_refused(state, message):
    with pytest.raises(rsfstudy.errors.InvalidValue, match=message):
        SceneSettings.from_widget_state(state)


def test_a_notebook_gets_a_panel_object():
    page = rsfstudy.explore(rsfstudy.Scene(law="slowness", load_velocity_ratio=3.0))
    assert "panel" in type(page).__module__
    with pytest.raises(rsfstudy.errors.InvalidValue, match="neither|is not a scene"):
        rsfstudy.explore(3.0)
    with pytest.raises(rsfstudy.errors.InvalidValue, match="is not JSON"):
        rsfstudy.explore(state="{")


@pytest.mark.parametrize(
    ("limits", "value"),
    [
        (SliderRange.choose_for_field(0.01, 0.01, "must be greater than 0", ""), 0.0123),
        (SliderRange.choose_for_field(0.0, 100.0, "must be 0 or greater", "D_c/V_*"), 7.0),
        (SliderRange.choose_for_field(0.0, 1.0, "", "D_c"), -0.5),
        (SliderRange.choose_for_field(2.0, 2.0, "", ""), 1.4),
        (SliderRange.choose_for_field(0.5, 0.5, "must lie between 0 and 1", ""), 0.25),
    ],
)
def test_a_slider_covers_its_range(limits, value):
    assert limits.low < value < limits.high
    assert limits.convert_position_to_value(
        limits.convert_value_to_position(value)
    ) == pytest.approx(value, rel=1e-3)
    assert limits.convert_position_to_value(0.0) == pytest.approx(limits.low, rel=1e-3)
    assert limits.convert_position_to_value(1.0) == pytest.approx(limits.high, rel=1e-3)
    assert (limits.convert_value_to_position(-1e9), limits.convert_value_to_position(1e9)) == (
        0.0,
        1.0,
    )


def wait_until(condition):
    """Wait until a condition holds."""
    for _ in range(3000):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("the computation has not ended")


def test_the_last_of_several_jobs_delivers():
    """A job that waits is replaced, and the result of an outdated job is discarded."""
    jobs, results, may_end = BackgroundJobRunner(lambda messages: None), [], threading.Event()

    def compute(number):
        may_end.wait(30)
        return number

    for number in range(3):
        jobs.start(lambda _report, n=number: compute(n), results.append, results.append)
    may_end.set()
    wait_until(lambda: not jobs.is_running)
    assert results == [2]


def test_a_cancelled_job_ends_and_delivers_nothing():
    jobs, results, started = BackgroundJobRunner(lambda messages: None), [], threading.Event()

    def compute(report):
        started.set()
        while True:
            report(0.5, "half")

    jobs.start(compute, results.append, results.append, progress_label="long")
    started.wait(30)
    jobs.cancel_all()
    wait_until(lambda: not jobs.is_running)
    assert (results, jobs.indicator.visible) == ([], False)


def test_errors_of_a_job_reach_the_page():
    jobs, failures, error = BackgroundJobRunner(lambda messages: None), [], ValueError("wrong")

    def compute(_report):
        raise error

    jobs.start(compute, failures.append, failures.append)
    wait_until(lambda: not jobs.is_running and failures)
    assert failures == [error]
