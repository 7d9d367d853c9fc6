"""Tests of the scene view in Chromium: curves, messages, code, downloads and bookmarks."""

import json
import subprocess
from urllib.parse import parse_qs, urlsplit

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from explorer_pages import PATIENCE, download_files, text_of
from playwright.sync_api import expect
from study_runs import call_main

import rsfstudy
from rsfstudy.explorer.scene_presets import SETTINGS_BY_PRESET_LABEL
from rsfstudy.explorer.scene_settings import SceneSettings

#: Script that returns a column of the motion from the plots of a page.
READ_COLUMN = """name => {
  for (const model of window.Bokeh?.documents[0]?.all_models ?? [])
    if (model.type == "ColumnDataSource" && "fault" in model.data)
      return Array.from(model.data[name])
}"""
DRAWN = "() => " + READ_COLUMN.replace("name =>", "(name =>") + ")('friction')?.length > 1"
FIRST, STEP = "README: velocity steps and a hold", "README: velocity step"


@pytest.fixture(scope="module")
def shared_page(server, open_page):
    shown = open_page(server.scene, permissions=["clipboard-read", "clipboard-write"])
    shown.wait_for_function(DRAWN)
    return shown


@pytest.fixture
def page(shared_page):
    """Return a page that shows a velocity step."""
    choose_preset(shared_page, STEP)
    return shared_page


def choose_preset(page, label):
    """Choose a preset, and wait until the page shows the motion of the preset."""
    text = json.dumps(SETTINGS_BY_PRESET_LABEL[label].as_widget_state(), separators=(",", ":"))
    if text_of(page, "State") != text:
        page.get_by_label("Preset").select_option(label)
    expect(page.get_by_label("State", exact=True)).to_have_value(text, timeout=PATIENCE)


def slider(page, name):
    """Return the handle of the slider of a field."""
    return page.locator(f'.bk-input-group:has(.bk-slider-title:text-is("{name}: ")) .noUi-handle')


def settings_of(page):
    return SceneSettings.from_widget_state(json.loads(text_of(page, "State")))


def read_motion(path):
    """Read a motion, and close its file."""
    with xr.open_dataset(path) as motion:
        return motion.load()


def run_commands(page):
    """Run the command line of a page, which may write a file before it calls ``rsfstudy``."""
    shell = "rsfstudy() { printf '%s\\n' \"$@\"; }\n" + text_of(page, "Command line")
    ran = subprocess.run(["bash", "-euc", shell], capture_output=True, text=True, check=True)
    called = call_main(*ran.stdout.splitlines())
    assert called.returncode == 0, called.stderr


def compute(settings):
    """Return the scene and the motion of settings."""
    rig = settings.build_rig()
    scene = settings.build_scene(rig)
    return scene, settings.simulate(scene, rig)


def assert_page_shows(page, settings):
    """Check the curves and the numbers of a page against a computation in this process."""
    scene, motion = compute(settings)
    drawn = np.array(page.evaluate(READ_COLUMN, "friction"), float)
    np.testing.assert_allclose(drawn, motion["friction_coefficient"], rtol=1e-12)
    assert page.get_by_text(f"k/k_cr = {scene.stiffness_ratio:.6g}:").is_visible()


def wait_for_change(page, action):
    """Call a function, and wait until the page shows the motion of other settings."""
    before = text_of(page, "State")
    action()
    box = page.get_by_label("State", exact=True)
    expect(box).not_to_have_value(before, timeout=PATIENCE)


def test_the_first_page_shows_the_rig_of_the_readme(shared_page):
    assert shared_page.url.partition("?")[0].count("token") == 0
    assert_page_shows(shared_page, next(iter(SETTINGS_BY_PRESET_LABEL.values())))


def test_a_slider_changes_the_curve(page):
    before = settings_of(page)
    slider(page, "b_over_a").focus()
    wait_for_change(page, lambda: page.keyboard.press("ArrowRight"))
    after = settings_of(page)
    assert after.scene["b_over_a"] > before.scene["b_over_a"]
    assert after == before.with_changed_field("b_over_a", after.scene["b_over_a"])
    assert_page_shows(page, after)


def test_a_bookmark_opens_an_independent_tab(page):
    assert parse_qs(urlsplit(page.url).query)["state"][0] == text_of(page, "State")
    other = page.context.new_page()
    other.goto(page.url)
    other.wait_for_function(DRAWN)
    first = settings_of(page)
    assert settings_of(other) == first
    slider(page, "a").focus()
    wait_for_change(page, lambda: page.keyboard.press("ArrowLeft"))
    assert settings_of(page) == first.with_changed_field("a", settings_of(page).scene["a"])
    assert_page_shows(other, first)
    other.close()


def test_fields_follow_the_parts(page):
    assert not slider(page, "law_exponent").is_visible()
    wait_for_change(page, lambda: page.get_by_label("law", exact=True).select_option("family"))
    slider(page, "law_exponent").wait_for()
    chosen = page.get_by_label("law", exact=True)
    wait_for_change(page, lambda: chosen.select_option("two_slip_states"))
    slider(page, "length_ratio").wait_for()
    assert not slider(page, "law_exponent").is_visible()
    assert not slider(page, "b_over_a").is_visible()


def test_an_error_shows_rule_and_remedy(page):
    row = page.locator('.bk-Row:has(.bk-slider-title:text-is("a: "))').last
    box = row.locator("input")
    box.fill("-3")
    box.press("Enter")
    page.get_by_text("'a' must be greater than 0").wait_for()
    assert "Traceback" not in page.content()
    assert page.evaluate(READ_COLUMN, "friction") == []


def test_downloads_and_code_give_the_numbers_shown(page, tmp_path, monkeypatch):
    drawn = np.array(page.evaluate(READ_COLUMN, "friction"), float)
    table, data = download_files(page, tmp_path)
    motion = read_motion(data)
    assert len(rsfstudy.plot_motion(motion).axes) == 3
    assert motion["slip_rate"].attrs["units"] == "um s-1"
    for values in (pd.read_csv(table), motion):
        np.testing.assert_allclose(values["friction_coefficient"], drawn)
    monkeypatch.chdir(tmp_path)
    exec(text_of(page, "Python"), {})
    assert np.ptp(plt.imread("motion.png")) > 0.5
    python = read_motion("motion.nc")
    np.testing.assert_array_equal(python["friction_coefficient"], drawn)
    run_commands(page)
    xr.testing.assert_equal(read_motion("motion.nc"), python)


def test_the_code_of_a_protocol_runs(page, tmp_path, monkeypatch, capsys):
    choose_preset(page, FIRST)
    monkeypatch.chdir(tmp_path)
    exec(text_of(page, "Python"), {})
    ratio, peak = (line.split()[-1] for line in capsys.readouterr().out.splitlines())
    assert f"peak friction: {peak} " in page.get_by_text("peak friction:").inner_text()
    assert page.get_by_text(f"k/k_cr = {ratio}:").is_visible()
    python = read_motion("motion.nc")
    run_commands(page)
    xr.testing.assert_equal(read_motion("motion.nc"), python)


def test_the_keyboard_reaches_all_widgets(page):
    reached = []
    page.get_by_text("Code", exact=True).click()
    page.get_by_label("Preset").focus()
    active = """() => {
      let element = document.activeElement
      while (element.shadowRoot?.activeElement) element = element.shadowRoot.activeElement
      return element.textContent || element.getAttribute("role") || element.type
    }"""
    while "Copy" not in reached and len(reached) < 1000:
        page.keyboard.press("Tab")
        reached.append(page.evaluate(active))
    assert {"dimensionless", "slider", "text", "checkbox", "Copy"} <= set(reached)
    page.get_by_role("button", name="Copy").first.focus()
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Copied").wait_for()
    assert page.evaluate("navigator.clipboard.readText()") == text_of(page, "Python")


@pytest.mark.parametrize(("width", "columns"), [(800, 1), (1280, 2)])
def test_the_page_fits_its_width(page, width, columns):
    page.set_viewport_size({"width": width, "height": 900})
    plots = page.locator(".bk-Figure")
    for number in range(1, 4):  # The plots move after the change of the width.
        column = number % columns
        page.wait_for_function(
            "([plot, first, isFirst]) => "
            "(plot.getBoundingClientRect().x == first.getBoundingClientRect().x) == isFirst",
            arg=[plots.nth(number).element_handle(), plots.first.element_handle(), not column],
        )
    assert plots.count() == 4
    assert page.evaluate("document.documentElement.scrollWidth") <= width
