"""Tests of the record view in a browser: window, steps, fit, code, downloads and messages."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shlex
from pathlib import Path
from urllib.parse import quote

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from study_runs import call_main

import rsfstudy
from rsfstudy.explorer.record_view import RecordView
from rsfstudy.reporting import format_with_error

STEP = str(Path(__file__).parents[2] / "studies" / "pages" / "step.csv")
READING = {"normal_stress": "20 MPa"}
FIT = {"laws": ["slowness"], "stiffness": "0.04 MPa/um"}
#: Table of the parameters, which is shown after a fit.
RESULT = "table:has-text('effective sample size')"
#: Page coordinates of the middle of a figure at a time in s.
PLACE = """([name, x]) => {
  const models = Bokeh.documents.map((document) => document.get_model_by_name(name))
  const view = models.map((model) => model && Bokeh.index.find_one_by_id(model.id)).find(Boolean)
  if (!view || !view.frame.bbox.width) return null  // The figure has not been drawn yet.
  const box = view.el.getBoundingClientRect()
  const frame = view.frame.bbox
  return [box.left + view.frame.x_scale.compute(x), box.top + frame.top + frame.height / 2]
}"""
#: Number of points, limits of time and highest friction of the curve in the browser.
CURVE = """() => {
  const models = Bokeh.documents.map((document) => document.get_model_by_name("friction"))
  const source = models.find(Boolean).renderers[0].data_source
  const [x, y] = ["x", "y"].map((name) => [...source.get_array(name)])
  return [x.length, x[0], x[x.length - 1], Math.max(...y)]
}"""


@pytest.fixture(scope="module")
def step_url(explore):
    """Return the address of the view of a record with two steps."""
    return explore(STEP).url


@pytest.fixture(scope="module")
def written(explore, tmp_path_factory):
    """Return a file that tests write, and the address of its view."""
    path = tmp_path_factory.mktemp("records") / "written.csv"
    path.touch()
    return path, explore(str(path)).url


@pytest.fixture
def open_step(open_page, step_url):
    """Return a function that opens the view of the record with some choices."""

    def open_with(**choices):
        state = json.dumps(READING | FIT | choices)
        page = open_page(f"{step_url}&state={quote(state)}")
        page.locator("canvas").first.wait_for()
        return page

    return open_with


def place(page, x, figure="friction"):
    return page.wait_for_function(PLACE, arg=[figure, x]).json_value()


def drag(page, begin, end):
    """Drag the mouse between two times in the figure of friction."""
    (left, height), (right, _height) = place(page, begin), place(page, end)
    page.mouse.move(left, height)
    page.mouse.down()
    page.mouse.move((left + right) / 2, height)
    page.mouse.move(right, height)
    page.mouse.up()


def code(page, label="Python"):
    return page.get_by_label(label, exact=True).input_value()


def wait_for_code(page, text, label="Python"):
    """Wait until the code contains a text."""
    box = page.get_by_label(label, exact=True)
    page.wait_for_function(
        "([box, text]) => box.value.includes(text)", arg=[box.element_handle(), text]
    )


def shown_cells(page):
    """Press Fit, and return the first table: cells of the first law by parameter."""
    page.get_by_role("button", name="Fit", exact=True).click()
    page.locator(RESULT).first.wait_for()
    rows = [re.split(r"\t", row) for row in page.locator(f"{RESULT} tr").all_inner_texts()]
    return {row[0].strip(): row[1].strip() for row in rows}


def expected_cells(fits):
    """Return the cells that a table of fits must show."""
    row = fits.rsf.fit_table().iloc[0]
    names = {"a": "a", "b": "b", "Dc (um)": "Dc", "mu_0": "mu_0"}
    cells = {head: format_with_error(row[n], row[f"{n}_stderr"]) for head, n in names.items()}
    return cells | {"AIC": f"{row['aic']:.1f}"}


def run_python(text):
    """Run the code of a view, and return its variables and its output."""
    variables, output = {}, io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(compile(text, "<code of the view>", "exec"), variables)
    return variables, output.getvalue()


def test_a_newcomer_gets_a_table_files_and_code(open_page, step_url, tmp_path):
    page = open_page(step_url)
    page.get_by_text("tells no normal stress").wait_for()
    page.get_by_label("Normal stress, if not in the file").fill("20 MPa")
    page.keyboard.press("Enter")
    page.locator("canvas").first.wait_for()
    page.get_by_role("button", name="Fit", exact=True).click()
    page.get_by_text("stiffness = None: is needed").wait_for()
    page.get_by_label("Stiffness", exact=True).fill("0.04 MPa/um")
    page.keyboard.press("Enter")
    page.get_by_label("2: 140 s").uncheck()
    wait_for_code(page, "steps=[1]")
    cells = shown_cells(page)

    variables, output = run_python(code(page))
    fits = variables["fit"]
    expected = expected_cells(fits)
    assert {name: cells[name] for name in expected} == expected
    assert page.get_by_text("slowness fits best").is_visible()
    assert "Dc" in output

    page.get_by_text("Download", exact=True).click()
    files = {}
    for label in ("Figure (PDF)", "Figure (SVG)", "Figure (PNG)", "Table (CSV)", "Data (NetCDF)"):
        with page.expect_download() as download:
            page.get_by_text(label).click()
        files[label] = tmp_path / download.value.suggested_filename
        download.value.save_as(files[label])
    assert files["Figure (PDF)"].read_bytes().startswith(b"%PDF")
    assert "<svg" in files["Figure (SVG)"].read_text()
    assert np.ptp(plt.imread(files["Figure (PNG)"])) > 0.5
    saved = pd.read_csv(files["Table (CSV)"])
    assert saved["Dc"].tolist() == pytest.approx(fits["slip_distance"].values.tolist(), rel=1e-12)
    with xr.open_dataset(files["Data (NetCDF)"]) as opened:
        xr.testing.assert_allclose(opened["covariance"], fits["covariance"], rtol=1e-12)


def test_a_dragged_window_changes_the_fit(open_step):
    page = open_step(after="60 um")
    drag(page, 40.0, 125.0)
    wait_for_code(page, "begin=")
    cells = shown_cells(page)
    begin, end = (float(found) for found in re.findall(r'="([\d.]+) s"', code(page)))
    assert (begin, end) == pytest.approx((40.0, 125.0), abs=1.5)
    record = rsfstudy.read_record(STEP, **READING, begin=begin, end=end)
    assert len(record.loading_steps) == 1
    expected = expected_cells(rsfstudy.fit(record, **FIT, after="60 um"))
    assert {name: cells[name] for name in expected} == expected
    whole = rsfstudy.fit(rsfstudy.read_record(STEP, **READING), **FIT, after="60 um", steps=[1])
    assert expected_cells(whole)["a"] != cells["a"]

    page.get_by_role("button", name="Whole record").click()
    page.locator(RESULT).first.wait_for(state="detached")  # The fit belongs to the other window.
    wait_for_code(page, "read_record(")
    assert "begin=" not in code(page)


def test_a_click_excludes_a_step_and_another_click_includes_it(open_step, tmp_path, monkeypatch):
    page = open_step(after="60 um")
    page.mouse.click(*place(page, 140.0))
    wait_for_code(page, "steps=[1]")
    assert not page.get_by_label("2: 140 s").is_checked()
    cells = shown_cells(page)
    monkeypatch.chdir(tmp_path)
    ran = call_main(*shlex.split(code(page, "Command line"))[1:])
    assert ran.returncode == 0, ran.stderr
    with xr.open_dataset("fit.nc") as fits:
        expected = expected_cells(fits)
    assert {name: cells[name] for name in expected} == expected
    page.mouse.click(*place(page, 100.0, "displacement"))
    page.get_by_text("must contain a step").wait_for()
    page.mouse.click(*place(page, 140.0))
    wait_for_code(page, "steps=[2]")
    assert "140" not in code(page, "State")


def test_a_state_restores_the_fit(open_step):
    page = open_step(excluded=[140.0], after="60 um", x="displacement", fitted=True)
    page.locator(RESULT).first.wait_for()
    state = json.loads(code(page, "State"))
    assert state["x"] == "displacement"
    assert page.get_by_label("1: 100 s").is_checked()
    assert "state=" in page.url
    address = page.url
    page.goto(address)
    page.locator(RESULT).first.wait_for()
    assert json.loads(code(page, "State")) == state


def test_a_slow_fit_is_cancelled(open_step):
    page = open_step(laws=["two_slip_states", "two_slowness_states"], together=True)
    page.get_by_role("button", name="Fit", exact=True).click()
    page.get_by_role("button", name="Cancel").click()
    page.get_by_role("button", name="Cancel").wait_for(state="hidden")
    assert page.locator(RESULT).count() == 0
    assert "fitted" not in code(page, "State")


def test_a_long_record_is_thinned_again_when_the_user_zooms(open_page, written):
    time = np.arange(60_000) * 0.01
    friction = np.full(60_000, 0.6)
    friction[31_234] = 0.7  # A spike of one row remains visible.
    path, url = written
    columns = {"Time (s)": time, "LP displacement (um)": time, "Friction": friction}
    pd.DataFrame(columns).to_csv(path, index=False)
    page = open_page(url)
    place(page, 300.0)  # Wait until the figure has been drawn.
    count, first, last, highest = page.evaluate(CURVE)
    assert count < 4000
    assert (first, last, highest) == (0.0, pytest.approx(time[-1]), 0.7)
    page.locator("[title*='Box Zoom' i]").first.click()
    drag(page, 300.0, 320.0)
    page.wait_for_function(f"() => ({CURVE})()[2] < 400.0")
    count, first, last, highest = page.evaluate(CURVE)
    assert count > 1000
    assert first == pytest.approx(300.0, abs=2.0)
    assert last == pytest.approx(320.0, abs=2.0)
    assert highest == 0.7


def test_a_broken_file_shows_the_message_of_the_reader(open_page, written):
    path, url = written
    path.write_text("Time (s),LP displacement (um),Friction\n0,0,0.6\n1,1,oops\n")
    with pytest.raises(rsfstudy.errors.InvalidValue) as raised:
        rsfstudy.read_record(path)
    page = open_page(url)
    page.get_by_text(str(raised.value)).wait_for()
    assert page.locator("canvas").first.is_hidden()


def test_the_code_of_a_record_in_memory_uses_the_record():
    record = rsfstudy.read_record(STEP, **READING)
    view = RecordView.restore(record, FIT | {"end": 130.0, "after": "60 um"})
    assert view.command_line().startswith("#")
    variables = {"record": record}
    exec(view.python_code(), variables)
    assert variables["record"].time[-1] == 130.0
    assert variables["fit"].sizes["law"] == 1


def test_a_record_of_slip_is_read_with_the_stiffness(tmp_path):
    record = rsfstudy.read_record(STEP, **READING)
    slip = record.columns["displacement"] - record.columns["friction"] / 2e-3
    path = tmp_path / "slip.csv"
    columns = {"Time (s)": record.time, "Slip (um)": slip, "Friction": record.columns["friction"]}
    pd.DataFrame(columns).to_csv(path, index=False)
    view = RecordView.restore(path, {"stiffness": "2e-3 1/um", "after": "60 um"})
    reading = view.python_code().partition("fit = ")[0]
    variables, _output = run_python(reading)
    moved = variables["record"].columns["displacement"]
    np.testing.assert_allclose(moved, record.columns["displacement"], atol=1e-9)
