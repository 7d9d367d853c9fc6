"""Tests of the results view in Chromium, and of the numbers that it draws."""

import json
import re
import shlex
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from playwright.sync_api import expect

import rsfstudy
from rsfstudy import Accuracy, Axis, Scene, Study
from rsfstudy.errors import DataError, InvalidValue
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
from rsfstudy.measures import CriticalStep, VelocityStep
from rsfstudy.status import Status

#: Time in ms after which a page that does not show an expected setting fails the test.
PATIENCE = 60_000
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


def wait_for_points(page, values):
    """Wait until a plot of a page has given values, and return its points."""
    expected = [value for value in np.ravel(values).tolist() if np.isfinite(value)]
    find = f"""expected => ({READ_SOURCES})("error").find(points => {{
      const shown = points.y.filter(Number.isFinite)
      return shown.length == expected.length && expected.every((v, i) => v == shown[i])
    }})"""
    page.wait_for_function(find, arg=expected)
    return page.evaluate(find, expected)


def code_of(page, label):
    """Return the text of a box in the tab "Code"."""
    return page.get_by_label(label, exact=True).input_value()


def run_code(page):
    """Run the Python code of a page but save no figure, and return its variables."""
    found, code = {}, code_of(page, "Python")
    exec(code.replace('figure.savefig("figure.pdf")', ""), found)
    return found


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
    moving = scene.with_(load_velocity_ratio=outcome.values[f"{VARIABLE}_unstable"])
    motion = rsfstudy.simulate(moving, rtol=1e-4)
    curves = [source["y"] for source in page.evaluate(READ_SOURCES, "y")]
    for name in ("friction_coefficient", "log10_slip_rate"):
        assert motion[name].values[thin_curve(motion[name].values)].tolist() in curves
    found = run_code(page)
    np.testing.assert_array_equal(found["motion"]["slip"], motion["slip"])
    wait_for_setting(page, "cell", 13)


def test_a_click_on_a_map_shows_a_cell_that_failed(server, open_page, results):
    page = open_page(address(server, kind="map", points={"law": 1}))
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


def test_downloads_and_commands_give_the_numbers_of_the_plot(server, open_page, results, tmp_path):
    page = open_page(address(server, second="law", points={"stiffness_ratio": 1}))
    shown = wait_for_points(page, results[VARIABLE].sel(stiffness_ratio=1.2))
    found = run_code(page)
    np.testing.assert_array_equal(found["part"][VARIABLE].values.ravel(), np.float64(shown["y"]))
    command = code_of(page, "Command line").splitlines()[0]
    assert command.startswith("rsfstudy export ")
    run = [sys.executable, "-m", "rsfstudy.cli.command_line", *shlex.split(command)[1:]]
    subprocess.run(run, check=True, cwd=tmp_path)
    exported = pd.read_csv(tmp_path / "table.csv")
    selected = exported[exported.filter(like="stiffness_ratio").iloc[:, 0] == 1.2]
    column = selected.filter(regex=rf"^{VARIABLE} \(").iloc[:, 0]
    np.testing.assert_array_equal(column, np.float64(shown["y"]))
    page.get_by_text("Download", exact=True).click()
    files = {}
    for label in ("Figure (PDF)", "Figure (SVG)", "Figure (PNG)", "Table (CSV)", "Data (NetCDF)"):
        with page.expect_download() as download:
            page.get_by_text(label, exact=True).click()
        files[label] = tmp_path / download.value.suggested_filename
        download.value.save_as(files[label])
    pdf, svg, png, csv, nc = files.values()
    assert pdf.read_bytes().startswith(b"%PDF-")
    assert "<svg" in svg.read_text()
    assert png.read_bytes().startswith(b"\x89PNG")
    table = pd.read_csv(csv)
    np.testing.assert_array_equal(table[VARIABLE], np.float64(shown["y"]))
    assert table["status"].tolist() == ["ok"] * 6 + ["work_budget_spent"] * 2
    assert (table["stiffness_ratio"] == 1.2).all()
    with xr.open_dataset(nc) as part:
        np.testing.assert_array_equal(part[VARIABLE].values.ravel(), np.float64(shown["y"]))


def test_a_broken_file_shows_a_message(explore, open_page, file, tmp_path):
    broken = tmp_path / "broken.nc"
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 255
    broken.write_bytes(content)
    page = open_page(explore(str(broken)).url)
    page.get_by_text("is damaged, or was edited").wait_for()
    assert "Traceback" not in page.content()


# ---- without a browser ---------------------------------------------------------------------------


def test_selections_resolve_contradictions(results):
    chosen = complete_selection(results, x="law", second="law", facet="law")
    assert (chosen.x, chosen.second) == ("law", "b_over_a")
    assert chosen.points == {"stiffness_ratio": 0}
    chosen = complete_selection(results, kind="map", facet="law")
    assert {chosen.x, chosen.second} == {"stiffness_ratio", "b_over_a"}
    assert (chosen.facet, chosen.points) == ("law", {})


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"variable": "missing"}, "critical_velocity_ratio"),
        ({"x": "missing"}, "does not exist in these results"),
        ({"points": {"law": 2}}, "law, which has 2 points"),
        ({"points": {"law": 0.5}}, "law, which has 2 points"),
        ({"points": 3}, "must map names"),
        ({"colour": "law"}, "variable, kind, x, second, facet, points"),
        ({"cell": 16}, "from 0 to 15"),
    ],
)
def test_an_invalid_state_is_refused(results, setting, message):
    with pytest.raises(InvalidValue, match=message):
        ResultsView(results).set_state(setting)


def test_curves_have_errors_statuses_and_cells(results):
    panel = complete_selection(results, second="law", points={"stiffness_ratio": 1})
    for law, curve in enumerate(curves_of_panel(results, panel)):
        part = results.isel(law=law, stiffness_ratio=1)
        assert curve.name == ["slip law", "slowness law"][law]
        assert curve.cells.tolist() == [8 * law + 4 + place for place in range(4)]
        np.testing.assert_array_equal(curve.y, part[VARIABLE])
        np.testing.assert_array_equal(curve.error, part[f"{VARIABLE}_error"])
        np.testing.assert_array_equal(curve.status, part["status"])


def test_a_map_finds_the_cell_at_a_position(results):
    chosen = complete_selection(results.isel(b_over_a=[2, 0, 3, 1]), kind="map", x="b_over_a")
    found = map_of_panel(results.isel(b_over_a=[2, 0, 3, 1]), chosen)
    assert found.x.tolist() == [1.5, 2.0, 3.0, 4.0]
    assert found.cell_at(1.6, 1.19) == 5  # the second point of the dataset is b/a = 1.5
    assert found.cell_at(9.0, 1.19) == -1
    image = sample_map(found, (1.25, 4.5), (1.05, 1.25), (2, 13))
    np.testing.assert_array_equal(image[:, [0, 3, 12]], found.values[:, [0, 1, 3]])


def test_a_cell_of_a_part_of_the_results_is_refused(results):
    with pytest.raises(DataError, match="law has 2 points in the declaration, and 1"):
        recompute(results.isel(law=[1]), 1, lambda *_progress: None)


def test_a_recorded_motion_is_shown():
    axes = [Axis("load_velocity_ratio", [2.0, 3.0])]
    measure = VelocityStep()
    scene = Scene(normal_stress="constant", stiffness_ratio=5.0)
    study = Study(name="steps", title="Steps", base=scene, axes=axes, measure=measure)
    steps = rsfstudy.run(study, workers=0, output=None, progress=False, rtol=1e-4)
    cell = recompute(steps, 1, lambda *_progress: None)
    np.testing.assert_array_equal(
        cell.motion["friction_coefficient"],
        steps["friction_coefficient"].isel({axes[0].dimension: 1}),
    )
    view = ResultsView(steps)
    view.set_state({"variable": "friction_coefficient", "x": "load_point_displacement"})
    assert view.python_code().startswith("import rsfstudy")
    (_first, second) = curves_of_panel(steps, view.selection)
    np.testing.assert_array_equal(second.x, steps["load_point_displacement"].values[1])
    assert len(view.figure().axes) == 1


def test_a_single_failed_cell_among_a_million_is_found():
    status = np.zeros((1000, 1000), dtype=np.int8)
    status[:500] = int(Status.STABLE_FOR_ALL_STEPS)
    status[123, 456] = int(Status.CELL_RAISED)
    marks = find_marks(status, np.arange(10**6).reshape(1000, 1000))
    failed = marks.status == int(Status.CELL_RAISED)
    assert marks.cells[failed].tolist() == [123_456]
    assert (marks.rows[failed].item(), marks.columns[failed].item()) == (123, 456)
    assert 0 < (~failed).sum() <= 2500


def test_a_long_curve_keeps_extremes_and_failed_cells():
    values, status = np.sin(np.arange(10**6)), np.zeros(10**6, dtype=np.int8)
    values[654_321], values[777_777], status[999_000] = 9.0, -9.0, int(Status.WORKER_LOST)
    kept = thin_curve(values, status)
    assert {0, 654_321, 777_777, 999_000, 999_999} <= {*kept.tolist()}
    assert kept.size <= 4000


@pytest.mark.parametrize(
    ("label", "text"),
    [
        (r"Stiffness, $k/k_{cr}(V_*)$", "Stiffness, k/k_cr(V_*)"),
        (r"$\Delta\delta_0/D_c$ = $10^{-8}$", "Δδ₀/D_c = 10⁻⁸"),
        (r"$\ln(V_0/V_*)$", "ln(V₀/V_*)"),
    ],
)
def test_labels_without_mathtext(label, text):
    assert to_plain_text(label) == text
