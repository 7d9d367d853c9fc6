"""Tests of the results view in Chromium: plots, cells, code, downloads and messages."""

import json
import re
import shlex
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from explorer_pages import PATIENCE, download_files, text_of
from playwright.sync_api import expect
from study_runs import call_main

import rsfstudy
from rsfstudy.explorer.curve_and_map_data import choose_drawn_point_indices

VARIABLE = "critical_velocity_ratio"
#: Script that returns the data sources with a given column. The document in the browser keeps the
#: sources of previous figures for a while.
READ_SOURCES = """name => [...window.Bokeh?.documents[0]?.all_models ?? []]
  .filter(model => model.type == "ColumnDataSource" && name in model.data)
  .map(model => Object.fromEntries(
    Object.entries(model.data).map(([key, column]) => [key, Array.from(column)])))"""
#: Script that returns the position of a point of the figure with a data source on the page.
LOCATE = """([name, x, y]) => {
  for (const figure of [...window.Bokeh.documents[0].all_models].reverse())
    if (figure.type == "Figure" && figure.renderers.some(r => name in r.data_source.data)) {
      const view = window.Bokeh.index.find_one(figure)
      const box = view.canvas.el.getBoundingClientRect()
      return [box.x + view.frame.x_scale.compute(x), box.y + view.frame.y_scale.compute(y)]
    }
}"""


def wait_for_points(page, values):
    """Wait until a plot of a page has given values, and return its points."""
    expected = [value for value in np.ravel(values).tolist() if np.isfinite(value)]
    find = f"""expected => ({READ_SOURCES})("error").find(points => {{
      const shown = points.y.filter(Number.isFinite)
      return shown.length == expected.length && expected.every((v, i) => v == shown[i])
    }})"""
    page.wait_for_function(find, arg=expected)
    return page.evaluate(find, expected)


def run_code(page):
    """Run the Python code of a page but save no figure, and return its variables."""
    found, code = {}, text_of(page, "Python")
    exec(code.replace('figure.savefig("figure.pdf")', ""), found)
    return found


def wait_for_setting(page, name, value):
    """Wait until the tab "Code" contains a setting."""
    setting = re.compile(re.escape(f'"{name}":{json.dumps(value)}'))
    expect(page.get_by_label("State", exact=True)).to_have_value(setting, timeout=PATIENCE)


@pytest.fixture(scope="module")
def shared_page(server, results, open_page):
    """Return a page. The file of the server exists before the page is opened."""
    server.results_file.write_bytes(Path(results.encoding["source"]).read_bytes())
    return open_page(server.results)


@pytest.fixture
def open_state(server, shared_page):
    """Return a function that opens the view with a state."""

    def open_with(**state):
        shared_page.goto(f"{server.results.partition('?')[0]}?state={quote(json.dumps(state))}")
        return shared_page

    return open_with


def test_widgets_change_the_plot(shared_page, results):
    page = shared_page
    values = results[VARIABLE]
    first = wait_for_points(page, values.sel(stiffness_ratio=1.1))
    np.testing.assert_array_equal(
        [e for e in first["error"] if np.isfinite(e)],
        [e for e in results[f"{VARIABLE}_error"].sel(stiffness_ratio=1.1).values.ravel() if e == e],
    )
    assert first["status"] == ["ok"] * 6 + ["work budget spent"] * 2
    (marks,) = [s for s in page.evaluate(READ_SOURCES, "status") if "error" not in s]
    assert (marks["status"], marks["x"]) == (["work budget spent"] * 2, [3.0, 4.0])
    page.get_by_role("slider").first.focus()
    page.keyboard.press("ArrowRight")
    wait_for_points(page, values.sel(stiffness_ratio=1.2))
    page.get_by_label("Colour", exact=True).select_option("stiffness_ratio")
    wait_for_points(page, values.sel(law="slip"))
    page.get_by_label("law", exact=True).first.select_option("slowness")
    wait_for_points(page, values.sel(law="slowness"))
    page.get_by_label("x", exact=True).select_option("a_over_b_minus_a")
    wait_for_setting(page, "x", "a_over_b_minus_a")
    inverse = results["a_over_b_minus_a"].values
    assert any(s["x"][:4] == inverse.tolist() for s in page.evaluate(READ_SOURCES, "error"))
    page.get_by_label("Facets", exact=True).select_option("law")
    wait_for_setting(page, "facet", "law")
    page.get_by_label("Variable", exact=True).select_option("rhs_evaluations")
    for law in ("slip", "slowness"):
        wait_for_points(page, results["rhs_evaluations"].sel(law=law))
    wait_for_setting(page, "variable", "rhs_evaluations")


def test_a_click_shows_the_motion_of_a_cell(open_state, results):
    page = open_state(points={"stiffness_ratio": 1})
    cell = {"law": "slowness", "stiffness_ratio": 1.2, "b_over_a": 2.0}
    stored = results.sel(cell)
    wait_for_points(page, results[VARIABLE].sel(stiffness_ratio=1.2))
    page.mouse.click(*page.evaluate(LOCATE, ["error", 2.0, float(stored[VARIABLE])]))
    page.get_by_text("Computed again: ok").wait_for()
    scene, outcome = rsfstudy.recompute_cell(results, cell)
    assert outcome.values[VARIABLE] == float(stored[VARIABLE])
    text = page.locator("table").first.inner_text()
    assert f"{outcome.values[VARIABLE]:.9g}" in text
    assert f"{outcome.values[f'{VARIABLE}_error']:.9g}" in text
    moving = scene.with_(load_velocity_ratio=outcome.values[f"{VARIABLE}_unstable"])
    motion = rsfstudy.simulate(moving, rtol=1e-4)
    curves = [source["y"] for source in page.evaluate(READ_SOURCES, "y")]
    for name in ("friction_coefficient", "log10_slip_rate"):
        assert (
            motion[name].values[choose_drawn_point_indices(motion[name].values)].tolist() in curves
        )
    found = run_code(page)
    np.testing.assert_array_equal(found["motion"]["slip"], motion["slip"])
    wait_for_setting(page, "cell", 13)


def test_a_click_on_a_map_shows_a_cell_that_failed(open_state, results):
    page = open_state(kind="map", points={"law": 1})
    page.wait_for_function(f"() => ({READ_SOURCES})('image')[0]?.image.length")
    values = results[VARIABLE].sel(law="slowness")
    image = np.array(page.evaluate(READ_SOURCES, "image")[0]["image"][0], float)
    assert np.nanmax(image) == pytest.approx(float(values.max()), rel=1e-6)  # in float32
    (marks,) = page.evaluate(READ_SOURCES, "status")
    assert marks["status"] == ["work budget spent"] * 4
    assert list(zip(marks["x"], marks["y"], strict=True)) == [
        (3.0, 1.1), (4.0, 1.1), (3.0, 1.2), (4.0, 1.2)
    ]  # fmt: skip
    page.mouse.click(*page.evaluate(LOCATE, ["image", 3.9, 1.12]))
    page.get_by_text("Computed again: work budget spent").wait_for()
    page.get_by_text("law = slowness, stiffness_ratio = 1.1, b_over_a = 4").first.wait_for()
    page.get_by_text("The measure found no critical step.").wait_for()
    page.get_by_label("b_over_a", exact=True).last.select_option("1.5")
    page.get_by_role("button", name="Show the cell").press("Enter")
    page.get_by_text("Computed again: ok").wait_for()
    page.get_by_text("Figure of the study", exact=True).click()
    page.get_by_alt_text("figure of the study").wait_for()


def test_downloads_and_code_give_the_numbers(open_state, results, tmp_path, monkeypatch):
    page = open_state(second_dimension="law", points={"stiffness_ratio": 1})
    shown = wait_for_points(page, results[VARIABLE].sel(stiffness_ratio=1.2))
    found = run_code(page)
    np.testing.assert_array_equal(found["part"][VARIABLE].values.ravel(), np.float64(shown["y"]))
    command = text_of(page, "Command line").splitlines()[0]
    assert command.startswith("rsfstudy export ")
    monkeypatch.chdir(tmp_path)
    assert call_main(*shlex.split(command)[1:]).returncode == 0
    exported = pd.read_csv("table.csv")
    selected = exported[exported.filter(like="stiffness_ratio").iloc[:, 0] == 1.2]
    column = selected.filter(regex=rf"^{VARIABLE} \(").iloc[:, 0]
    np.testing.assert_array_equal(column, np.float64(shown["y"]))
    csv, nc = download_files(page, tmp_path)
    table = pd.read_csv(csv)
    np.testing.assert_array_equal(table[VARIABLE], np.float64(shown["y"]))
    assert table["status"].tolist() == ["ok"] * 6 + ["work_budget_spent"] * 2
    assert (table["stiffness_ratio"] == 1.2).all()
    with xr.open_dataset(nc) as part:
        np.testing.assert_array_equal(part[VARIABLE].values.ravel(), np.float64(shown["y"]))


def test_a_broken_file_shows_a_message(server, shared_page):
    content = bytearray(server.results_file.read_bytes())
    content[len(content) // 2] ^= 255
    server.results_file.write_bytes(content)
    shared_page.goto(server.results)
    shared_page.get_by_text("is damaged or was edited").wait_for()
    assert "Traceback" not in shared_page.content()
