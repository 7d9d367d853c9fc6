"""Tests of the results view in Chromium, and of the numbers that it draws."""

import json
import re
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from playwright.sync_api import expect

import rsfstudy
from rsfstudy import Accuracy, Axis, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.explorer.result_arrays import (
    curves_of_panel,
    find_marks,
    map_of_panel,
    sample_map,
    thin_curve,
    to_plain_text,
)
from rsfstudy.explorer.result_cells import recompute
from rsfstudy.explorer.result_selections import complete_selection
from rsfstudy.explorer.results_view import ResultsView
from rsfstudy.measures import CriticalStep
from rsfstudy.status import Status

#: Time in ms after which a page that does not show an expected setting fails the test.
PATIENCE = 60_000
VARIABLE = "critical_velocity_ratio"
#: Script that returns the columns of the data source that contains a given column.
READ_SOURCE = """name => {
  for (const model of window.Bokeh?.documents[0]?.all_models ?? [])
    if (model.type == "ColumnDataSource" && name in model.data)
      return Object.fromEntries(
        Object.entries(model.data).map(([key, column]) => [key, Array.from(column)]))
}"""
COUNT_FIGURES = """() =>
  [...window.Bokeh.documents[0].all_models].filter(model => model.type == "Figure").length"""
#: Script that returns the position of a point of the figure with a data source on the page.
LOCATE = """([name, x, y]) => {
  for (const figure of window.Bokeh.documents[0].all_models)
    if (figure.type == "Figure" && figure.renderers.some(r => name in r.data_source.data)) {
      const view = window.Bokeh.index.find_one(figure)
      const box = view.canvas.el.getBoundingClientRect()
      return [box.x + view.frame.x_scale.compute(x), box.y + view.frame.y_scale.compute(y)]
    }
}"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Return the path of results with 12 answers and 4 failed cells."""
    study = Study(
        name="explored",
        title="Critical velocity step",
        base=Scene(a=0.01, normal_stress="variable", alpha=0.3),
        axes=[
            Axis("law", ["slip", "slowness"]),
            Axis("stiffness_ratio", [1.1, 1.2]),
            Axis("b_over_a", [1.5, 2.0, 3.0, 4.0]),
        ],
        measure=CriticalStep(),
        accuracy=Accuracy(1e-4, budget=2200),
    )
    place = tmp_path_factory.mktemp("results")
    with pytest.warns(rsfstudy.errors.IncompleteWarning):
        rsfstudy.run(study, workers=0, output=place, progress=False, keep_going=True)
    return place / "explored.nc"


@pytest.fixture(scope="module")
def results(file):
    return rsfstudy.open(file)


@pytest.fixture(scope="module")
def server(explore, file):
    return explore(str(file))


def read_points(page):
    """Return the points of the plot of a page."""
    return page.evaluate(READ_SOURCE, "error")


def wait_for_points(page, values):
    """Wait until the curves of a page have given values, and return the points."""
    expected = [value for value in np.ravel(values).tolist() if np.isfinite(value)]
    page.wait_for_function(
        f"""expected => {{
          const points = ({READ_SOURCE})("error")
          const shown = points?.y.filter(Number.isFinite) ?? []
          return shown.length == expected.length && expected.every((v, i) => v == shown[i])
        }}""",
        arg=expected,
    )
    return read_points(page)


def code_of(page, label):
    """Return the text of a box in the tab "Code"."""
    return page.get_by_label(label, exact=True).input_value()


def wait_for_setting(page, name, value):
    """Wait until the tab "Code" contains a setting."""
    setting = re.compile(re.escape(f'"{name}":{json.dumps(value)}'))
    expect(page.get_by_label("State", exact=True)).to_have_value(setting, timeout=PATIENCE)


def address(server, **state):
    """Return the first address of a view with a state."""
    query = f"&state={json.dumps(state)}" if state else ""
    return server.url + query


def test_widgets_change_the_plot(server, open_page, results):
    page = open_page(server.url)
    values = results[VARIABLE]
    first = wait_for_points(page, values.sel(stiffness_ratio=1.1))
    np.testing.assert_array_equal(
        [e for e in first["error"] if np.isfinite(e)],
        [e for e in results[f"{VARIABLE}_error"].sel(stiffness_ratio=1.1).values.ravel() if e == e],
    )
    marks = page.evaluate(READ_SOURCE, "status")
    assert "work budget spent" in first["status"], marks
    page.get_by_role("slider").first.focus()
    page.keyboard.press("ArrowRight")
    wait_for_points(page, values.sel(stiffness_ratio=1.2))
    page.get_by_label("Colour", exact=True).select_option("stiffness_ratio")
    wait_for_points(page, values.sel(law="slip"))
    page.get_by_label("law", exact=True).first.select_option("slowness")
    wait_for_points(page, values.sel(law="slowness"))
    page.get_by_label("x", exact=True).select_option("a_over_b_minus_a")
    page.wait_for_function(
        f"() => Math.abs(({READ_SOURCE})('error').x[0] - 2) < 1e-12"
    )  # a/(b - a) is 2 if b/a is 1.5
    page.get_by_label("Facets", exact=True).select_option("law")
    page.wait_for_function(f"() => ({COUNT_FIGURES})() == 2")
    page.get_by_label("Variable", exact=True).select_option("status")
    wait_for_setting(page, "variable", "status")
    wait_for_setting(page, "facet", "law")


def test_a_click_shows_the_motion_of_a_cell(server, open_page, results):
    page = open_page(address(server, points={"stiffness_ratio": 1}))
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
    code = code_of(page, "Python")
    found = {}
    exec(code.partition("scene, outcome")[0].partition("panel")[0], found)
    exec("scene, outcome" + code.partition("scene, outcome")[2], found)
    moving = scene.with_(load_velocity_ratio=outcome.values[f"{VARIABLE}_unstable"])
    expected = rsfstudy.simulate(moving, rtol=1e-4)
    np.testing.assert_array_equal(found["motion"]["slip"], expected["slip"])
    assert found["motion"].attrs["beyond_instability_norm"]
