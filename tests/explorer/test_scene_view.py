"""Tests of the scene view in Chromium, and of the settings of a scene."""

import json
import os
import subprocess
import sys
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from playwright.sync_api import expect

import rsfstudy
from rsfstudy.explorer.scene_presets import PRESETS
from rsfstudy.explorer.scene_settings import SceneSettings

PATIENCE = 60_000  # ms
#: Script that returns a column of the motion from the plots of a page.
READ_COLUMN = """name => {
  for (const model of window.Bokeh?.documents[0]?.all_models ?? [])
    if (model.type == "ColumnDataSource" && "fault" in model.data)
      return Array.from(model.data[name])
}"""
DRAWN = "() => " + READ_COLUMN.replace("name =>", "(name =>") + ")('friction')?.length > 1"
FIRST = "README: velocity steps and a hold"


@pytest.fixture(scope="module")
def shared_page(server, open_page):
    shown = open_page(server.url, permissions=["clipboard-read", "clipboard-write"])
    shown.wait_for_function(DRAWN)
    return shown


@pytest.fixture
def page(shared_page):
    """Return a page that shows the first preset."""
    choose_preset(shared_page, "README: velocity step")
    choose_preset(shared_page, FIRST)
    return shared_page


def choose_preset(page, label):
    """Choose a preset, and wait until the page shows the motion of the preset."""
    page.get_by_label("Preset").select_option(label)
    text = json.dumps(PRESETS[label].as_state(), separators=(",", ":"))
    expect(page.get_by_label("State", exact=True)).to_have_value(text, timeout=PATIENCE)


def slider(page, name):
    """Return the handle of the slider of a field."""
    return page.locator(f'.bk-input-group:has(.bk-slider-title:text-is("{name}: ")) .noUi-handle')


def text_of(page, label):
    """Return the text of a box in the tab "Code"."""
    return page.get_by_label(label, exact=True).input_value()


def settings_of(page):
    return SceneSettings.from_state(json.loads(text_of(page, "State")))


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


def test_the_page_shows_the_rig_of_the_readme(page):
    assert page.url.partition("?")[0].count("token") == 0
    assert_page_shows(page, next(iter(PRESETS.values())))


def test_a_slider_changes_the_curve(page):
    before = settings_of(page)
    slider(page, "b_over_a").focus()
    wait_for_change(page, lambda: page.keyboard.press("ArrowRight"))
    after = settings_of(page)
    assert after.scene["b_over_a"] > before.scene["b_over_a"]
    assert after == before.with_field("b_over_a", after.scene["b_over_a"])
    assert_page_shows(page, after)


def test_two_tabs_are_independent(page):
    other = page.context.new_page()
    other.goto(page.url)
    other.wait_for_function(DRAWN)
    first = settings_of(page)
    choose_preset(other, "README: velocity step")
    slider(page, "a").focus()
    wait_for_change(page, lambda: page.keyboard.press("ArrowLeft"))
    assert settings_of(page) == first.with_field("a", settings_of(page).scene["a"])
    assert_page_shows(other, PRESETS["README: velocity step"])


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
    page.get_by_text("a = -3.0: must be greater than 0").wait_for()
    assert "Traceback" not in page.content()
    assert page.evaluate(READ_COLUMN, "friction") == []


def test_downloads_open_again(page, tmp_path):
    page.get_by_text("Download", exact=True).click()
    files = {}
    for label in ("Figure (PDF)", "Figure (SVG)", "Figure (PNG)", "Table (CSV)", "Data (NetCDF)"):
        with page.expect_download() as download:
            page.get_by_text(label, exact=True).click()
        files[label[-5:-1]] = tmp_path / download.value.suggested_filename
        download.value.save_as(files[label[-5:-1]])
    pdf, svg, png, csv, nc = files.values()
    assert [path.name for path in files.values()] == [
        "motion.pdf", "motion.svg", "motion.png", "motion.csv", "motion.nc"
    ]  # fmt: skip
    assert pdf.read_bytes().startswith(b"%PDF-")
    assert "<svg" in svg.read_text()
    assert png.read_bytes().startswith(b"\x89PNG")
    table, motion = pd.read_csv(csv), xr.open_dataset(nc).load()
    assert len(rsfstudy.plot_motion(motion).axes) == 3
    np.testing.assert_allclose(table["friction_coefficient"], motion["friction_coefficient"])
    assert motion["slip_rate"].attrs["units"] == "um s-1"
    drawn = np.array(page.evaluate(READ_COLUMN, "friction"), float)
    np.testing.assert_allclose(drawn, motion["friction_coefficient"])


def test_the_code_reproduces_the_numbers(page, tmp_path):
    numbers = page.get_by_text("peak friction:").inner_text()
    motions = []
    python, shell = text_of(page, "Python"), text_of(page, "Command line")
    paths = {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    for number, command in enumerate(([sys.executable, "-c", python], ["bash", "-euc", shell])):
        directory = tmp_path / str(number)
        directory.mkdir()
        ran = subprocess.run(
            command, cwd=directory, capture_output=True, text=True, env=os.environ | paths,
            check=True,
        )  # fmt: skip
        assert (directory / "motion.png").read_bytes().startswith(b"\x89PNG")
        motions.append(xr.open_dataset(directory / "motion.nc").load())
        if not number:
            ratio, peak = (line.split()[-1] for line in ran.stdout.splitlines())
            assert f"peak friction: {peak} " in numbers
            assert page.get_by_text(f"k/k_cr = {ratio}:").is_visible()
    xr.testing.assert_equal(*motions)


def test_a_bookmark_restores_the_view(page):
    choose_preset(page, "Fig. 9: stick-slip, slip law")
    text = parse_qs(urlsplit(page.url).query)["state"][0]
    assert text == text_of(page, "State")
    other = page.context.new_page()
    other.goto(page.url)
    other.wait_for_function(DRAWN)
    assert settings_of(other) == settings_of(page)
    assert_page_shows(other, settings_of(page))


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
    page.wait_for_timeout(300)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    plots = page.locator(".bk-Figure").all()
    assert len(plots) == 4
    assert len({round(each.bounding_box()["x"]) for each in plots}) == columns
