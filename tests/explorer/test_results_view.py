"""Tests of the selections, the numbers and the cells of the results view, without a browser."""

import numpy as np
import pytest

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.explorer.cell_recomputation import recompute_cell_and_motion
from rsfstudy.explorer.curve_and_map_data import (
    choose_drawn_point_indices,
    convert_mathtext_to_unicode,
    extract_curves_of_panel,
    extract_map_of_panel,
    find_cells_to_mark_with_status,
    sample_map_at_pixels,
)
from rsfstudy.explorer.plot_selections import complete_plot_selection
from rsfstudy.explorer.results_view import ResultsView
from rsfstudy.measures import VelocityStep
from rsfstudy.status import Status

VARIABLE = "critical_velocity_ratio"


def test_selections_resolve_contradictions(results):
    chosen = complete_plot_selection(results, x="law", second_dimension="law", facet="law")
    assert (chosen.x, chosen.second_dimension) == ("law", "b_over_a")
    assert chosen.point_index_by_dimension == {"stiffness_ratio": 0}
    chosen = complete_plot_selection(results, kind="map", facet="law")
    assert {chosen.x, chosen.second_dimension} == {"stiffness_ratio", "b_over_a"}
    assert (chosen.facet, chosen.point_index_by_dimension) == ("law", {})


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"variable": "missing"}, "critical_velocity_ratio"),
        ({"x": "missing"}, "does not exist in these results"),
        ({"points": {"law": 2}}, "law, which has 2 points"),
        ({"points": {"law": 0.5}}, "law, which has 2 points"),
        ({"points": 3}, "must map names"),
        ({"colour": "law"}, "variable, kind, x, second_dimension, facet, points"),
        ({"cell": 16}, "from 0 to 15"),
    ],
)
def test_an_invalid_state_is_refused(results, setting, message):
    with pytest.raises(InvalidValue, match=message):
        ResultsView(results).set_widget_state(setting)


def test_curves_have_errors_statuses_and_cells(results):
    panel = complete_plot_selection(results, second_dimension="law", points={"stiffness_ratio": 1})
    for law, curve in enumerate(extract_curves_of_panel(results, panel)):
        part = results.isel(law=law, stiffness_ratio=1)
        assert curve.label == ["slip law", "slowness law"][law]
        assert curve.cell_numbers.tolist() == [8 * law + 4 + place for place in range(4)]
        np.testing.assert_array_equal(curve.y, part[VARIABLE])
        np.testing.assert_array_equal(curve.y_error, part[f"{VARIABLE}_error"])
        np.testing.assert_array_equal(curve.status_codes, part["status"])


def test_a_map_finds_the_cell_at_a_position(results):
    chosen = complete_plot_selection(results.isel(b_over_a=[2, 0, 3, 1]), kind="map", x="b_over_a")
    found = extract_map_of_panel(results.isel(b_over_a=[2, 0, 3, 1]), chosen)
    assert found.x.tolist() == [1.5, 2.0, 3.0, 4.0]
    assert found.find_cell_number_at(1.6, 1.19) == 5  # the second point of the dataset is b/a = 1.5
    assert found.find_cell_number_at(9.0, 1.19) == -1
    image = sample_map_at_pixels(found, (1.25, 4.5), (1.05, 1.25), (2, 13))
    np.testing.assert_array_equal(image[:, [0, 3, 12]], found.cell_values[:, [0, 1, 3]])


def test_a_cell_of_a_part_of_the_results_is_refused(results):
    with pytest.raises(DataError, match="law has 2 points in the declaration, but 1"):
        recompute_cell_and_motion(results.isel(law=[1]), 1, lambda *_progress: None)


def test_a_recorded_motion_is_shown():
    axes = [Axis("load_velocity_ratio", [2.0, 3.0])]
    measure = VelocityStep()
    scene = Scene(normal_stress="constant", stiffness_ratio=5.0)
    study = Study(name="steps", title="Steps", base=scene, axes=axes, measure=measure)
    steps = rsfstudy.run(study, workers=0, output=None, progress=False, rtol=1e-4)
    cell = recompute_cell_and_motion(steps, 1, lambda *_progress: None)
    np.testing.assert_array_equal(
        cell.motion["friction_coefficient"],
        steps["friction_coefficient"].isel({axes[0].dimension: 1}),
    )
    view = ResultsView(steps)
    view.set_widget_state({"variable": "friction_coefficient", "x": "load_point_displacement"})
    assert view.format_equivalent_python_code().startswith("import rsfstudy")
    (_first, second) = extract_curves_of_panel(steps, view.selection)
    np.testing.assert_array_equal(second.x, steps["load_point_displacement"].values[1])
    assert len(view.draw_figure_for_download().axes) == 1


def test_a_single_failed_cell_among_a_million_is_found():
    status = np.zeros((1000, 1000), dtype=np.int8)
    status[:500] = int(Status.STABLE_FOR_ALL_STEPS)
    status[123, 456] = int(Status.CELL_RAISED)
    marks = find_cells_to_mark_with_status(status, np.arange(10**6).reshape(1000, 1000))
    failed = marks.status_codes == int(Status.CELL_RAISED)
    assert marks.cell_numbers[failed].tolist() == [123_456]
    assert (marks.row_indices[failed].item(), marks.column_indices[failed].item()) == (123, 456)
    assert 0 < (~failed).sum() <= 2500


def test_a_long_curve_keeps_extremes_and_failed_cells():
    values, status = np.sin(np.arange(10**6)), np.zeros(10**6, dtype=np.int8)
    values[654_321], values[777_777], status[999_000] = 9.0, -9.0, int(Status.WORKER_LOST)
    kept = choose_drawn_point_indices(values, status)
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
    assert convert_mathtext_to_unicode(label) == text
