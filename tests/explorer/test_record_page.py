"""Tests of the record view in Chromium: window, steps, fit, code, downloads and messages."""

import contextlib
import io
import json
import re
import shlex
from urllib.parse import parse_qs, quote, urlsplit

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from explorer_pages import STEP, download_files, text_of
from study_runs import call_main

import rsfstudy
from rsfstudy.reporting import format_value_with_stderr

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
def shared_page(server, open_page):
    return open_page(server.step)


@pytest.fixture
def open_step(server, shared_page):
    """Return a function that opens the view of the record with some choices."""

    def open_with(**choices):
        origin = server.step.partition("?")[0]
        shared_page.goto(f"{origin}?state={quote(json.dumps(READING | FIT | choices))}")
        shared_page.locator("canvas").first.wait_for()
        return shared_page

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
    cells = {
        head: format_value_with_stderr(row[n], row[f"{n}_stderr"]) for head, n in names.items()
    }
    return cells | {"AIC": f"{row['aic']:.1f}"}


def run_python(text):
    """Run the code of a view, and return its variables and its output."""
    variables, output = {}, io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(compile(text, "<code of the view>", "exec"), variables)
    return variables, output.getvalue()


def test_a_newcomer_gets_a_table_files_and_code(shared_page, tmp_path):
    page = shared_page
    page.get_by_text("has no column for normal stress").wait_for()
    page.get_by_label("Normal stress, if not in the file").fill("20 MPa")
    page.keyboard.press("Enter")
    page.locator("canvas").first.wait_for()
    place(page, 100.0)  # Wait until the figure has been drawn.
    assert page.evaluate(CURVE)[0] == len(rsfstudy.read_record(STEP, **READING))
    page.get_by_role("button", name="Fit", exact=True).click()
    page.get_by_text("is required. Pass").wait_for()
    page.get_by_label("Stiffness", exact=True).fill("0.04 MPa/um")
    page.keyboard.press("Enter")
    page.get_by_label("2: 140 s").uncheck()
    wait_for_code(page, "steps=[1]")
    cells = shown_cells(page)

    variables, output = run_python(text_of(page, "Python"))
    fits = variables["fit"]
    expected = expected_cells(fits)
    assert {name: cells[name] for name in expected} == expected
    assert page.get_by_text("slowness fits best").is_visible()
    assert "Dc" in output
    table, data = download_files(page, tmp_path)
    saved = pd.read_csv(table)
    assert saved["Dc"].tolist() == pytest.approx(fits["slip_distance"].values.tolist(), rel=1e-12)
    with xr.open_dataset(data) as opened:
        xr.testing.assert_allclose(opened["covariance"], fits["covariance"], rtol=1e-12)


def test_the_mouse_selects_the_window_and_the_steps(open_step, tmp_path, monkeypatch):
    page = open_step(after="60 um")
    drag(page, 40.0, 125.0)
    wait_for_code(page, "begin=")
    cells = shown_cells(page)
    begin, end = (float(t) for t in re.findall(r'="([\d.]+) s"', text_of(page, "Python")))
    assert (begin, end) == pytest.approx((40.0, 125.0), abs=1.5)
    record = rsfstudy.read_record(STEP, **READING, begin=begin, end=end)
    assert len(record.loading_steps) == 1
    expected = expected_cells(rsfstudy.fit(record, **FIT, after="60 um"))
    assert {name: cells[name] for name in expected} == expected

    page.get_by_role("button", name="Whole record").click()
    page.locator(RESULT).first.wait_for(state="detached")  # The fit belongs to the other window.
    wait_for_code(page, "read_record(")
    assert "begin=" not in text_of(page, "Python")
    page.mouse.click(*place(page, 140.0))
    wait_for_code(page, "steps=[1]")
    assert not page.get_by_label("2: 140 s").is_checked()
    whole = shown_cells(page)
    assert whole["a"] != cells["a"]
    monkeypatch.chdir(tmp_path)
    ran = call_main(*shlex.split(text_of(page, "Command line"))[1:])
    assert ran.returncode == 0, ran.stderr
    with xr.open_dataset("fit.nc") as fits:
        expected = expected_cells(fits)
    assert {name: whole[name] for name in expected} == expected

    page.mouse.click(*place(page, 100.0, "displacement"))
    page.get_by_text("must contain a step").wait_for()
    page.mouse.click(*place(page, 140.0))
    wait_for_code(page, "steps=[2]")
    assert "140" not in text_of(page, "State")


def test_a_bookmark_restores_the_fit(open_step):
    page = open_step(excluded=[140.0], after="60 um", x="displacement", fitted=True)
    page.locator(RESULT).first.wait_for()
    state = json.loads(text_of(page, "State"))
    assert state["x"] == "displacement"
    assert page.get_by_label("1: 100 s").is_checked()
    assert json.loads(parse_qs(urlsplit(page.url).query)["state"][0]) == state


def test_a_slow_fit_is_cancelled(open_step):
    page = open_step(laws=["two_slip_states", "two_slowness_states"], together=True)
    page.get_by_role("button", name="Fit", exact=True).click()
    page.get_by_role("button", name="Cancel").click()
    page.get_by_role("button", name="Cancel").wait_for(state="hidden")
    assert page.locator(RESULT).count() == 0
    assert "fitted" not in text_of(page, "State")


def test_a_long_record_is_thinned_again_and_a_broken_record_shows_a_message(server, open_page):
    time = np.arange(60_000) * 0.01
    friction = np.full(60_000, 0.6)
    friction[31_234] = 0.7  # A spike of one row remains visible.
    columns = {"Time (s)": time, "LP displacement (um)": time, "Friction": friction}
    pd.DataFrame(columns).to_csv(server.record_file, index=False)
    page = open_page(server.record)
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

    server.record_file.write_text("Time (s),LP displacement (um),Friction\n0,0,0.6\n1,1,oops\n")
    with pytest.raises(rsfstudy.errors.InvalidValue) as raised:
        rsfstudy.read_record(server.record_file)
    page.reload()
    page.get_by_text(str(raised.value)).wait_for()
    assert page.locator("canvas").first.is_hidden()
