"""Tests of figures of laws, dilatant cycles and motions."""

import numpy as np
import pytest
import test_figures as checks
import xarray as xr
from study_runs import named_results, run

import rsfstudy
from rsfstudy import Axis, Panel, Scene, Study, plots
from rsfstudy.errors import DataError
from rsfstudy.plots import _text_formatting, lines
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.rig.dataset_unit_scales import UnitScale, multiply_variables_by_unit_scales
from rsfstudy.status import Status
from rsfstudy.study import study_loader


def test_the_picture_of_a_motion_is_printable():
    drawn = rsfstudy.plot_motion(rsfstudy.simulate(Scene(hold_time=1.0), duration=1.0, rtol=1e-3))
    checks.assert_printable(drawn)
    for test in (
        checks.test_it_fits_a_journal,
        checks.test_legends_name_what_is_drawn,
        checks.test_symbols_are_written_as_symbols,
        checks.test_numbers_along_axes_do_not_touch,
    ):
        test(drawn)
    assert drawn._repr_png_().startswith(b"\x89PNG")


def test_a_title_is_broken_where_the_figure_would_cut_it(tmp_path_factory):
    """A long title is wrapped if labels along y narrow the panel.

    Each curve has a legend entry.
    """
    dataset, _path = named_results("accuracy_cost", tmp_path_factory)
    drawn = plots.draw_figure(dataset, variable="status")
    checks.assert_printable(drawn)
    (axes,) = drawn.axes
    assert axes.get_title().count("\n") > 1
    assert len(axes.get_legend_handles_labels()[1]) == len(axes.lines)


def test_an_added_axis_lays_out_what_a_panel_shows_one_point_of():
    """A panel of a single point is drawn once per point of an added axis."""
    study = study_loader.load_study("rate_step_boundary")
    narrow = {"b_over_a": [1.5, 2.0, 3.0], "case": ["constant normal stress"]}
    dataset = run(study.with_(**narrow, law=["slip", "slowness"]), rtol=1e-3)
    slip, slowness = plots.draw_figure(dataset).axes
    assert slip.get_title().endswith("slip law")
    assert slowness.get_title().endswith("slowness law")
    assert max(slowness.lines[0].get_ydata()) > 2.0 * max(slip.lines[0].get_ydata())


def stiffnesses() -> xr.Dataset:
    """Return critical stiffness for two angles and two labelled b/a."""
    points = {"strong": {"b_over_a": 2.0}, "weak": {"b_over_a": 1.5}}
    axes = [Axis("phi", [50.0, 60.0]), Axis("weakening", points)]
    return run(Study(name="n", title="t", base=Scene(), axes=axes, measure=LinearStability()))


def test_names_along_y_are_written_from_the_top_down():
    panel = Panel(x="critical_stiffness", y="weakening", hue=["phi"])
    (axes,) = plots.draw_figure(stiffnesses(), rsfstudy.Figure([panel])).axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["strong", "weak"]
    assert axes.yaxis_inverted()
    assert [line.get_linestyle() for line in axes.lines] == ["None", "None"]


def test_a_curve_along_two_axes_is_refused():
    panel = Panel(x="weakening", y="critical_stiffness")
    with pytest.raises(DataError, match=r"shape \(2,\) and shape \(2, 2\).*facet= or isel="):
        plots.draw_figure(stiffnesses(), rsfstudy.Figure([panel]))


def test_slip_rates_beyond_the_range_of_floats_are_refused():
    motion = rsfstudy.simulate(Scene(hold_time=1.0), duration=1.0, rtol=1e-3)
    motion["log10_slip_rate"] = motion["log10_slip_rate"] + 310.0
    with pytest.raises(DataError, match="log10_slip_rate = 310 must be at most 308"):
        rsfstudy.plot_motion(motion)


def test_nothing_is_drawn_where_nothing_came_out():
    """A panel without numbers is drawn only if its cells have not failed."""
    dataset = stiffnesses()
    failed = dataset["phi"] == 50.0
    dataset["critical_stiffness"] = dataset["critical_stiffness"].where(~failed)
    panels = rsfstudy.Figure([Panel(x="weakening", y="critical_stiffness", facet=["phi"])])
    assert len(plots.draw_figure(dataset, panels).axes) == 2
    dataset["status"] = dataset["status"].where(~failed, np.int8(20))
    assert len(plots.draw_figure(dataset, panels).axes) == 1


def test_failed_cells_of_lines_are_marked():
    """A cross marks the position of a failed cell without a value, but not of other cells."""
    axes = [Axis("phi", [50.0, 55.0, 60.0, 65.0, 70.0])]
    dataset = run(Study(name="n", title="", base=Scene(), axes=axes, measure=LinearStability()))
    statuses = Status.WORK_BUDGET_SPENT, Status.NO_STEADY_STATE, Status.PENDING
    dataset["critical_stiffness"].values[1:4] = np.nan
    dataset["status"].values[1:4] = statuses
    by_default = rsfstudy.Figure(lines.build_line_panels(dataset, "critical_stiffness"))
    for figure in (by_default, rsfstudy.Figure([Panel(x="phi", y="critical_stiffness")])):
        (axes_drawn,) = plots.draw_figure(dataset, figure).axes
        (crosses,) = [line for line in axes_drawn.lines if line.get_label() == "failed cell"]
        assert crosses.get_xdata().tolist() == [55.0]


def test_where_nothing_was_measured_the_statuses_are_drawn():
    dataset = stiffnesses()
    numbers = [n for n, values in dataset.data_vars.items() if values.dtype.kind == "f"]
    nothing = dataset.assign({n: dataset[n] * np.nan for n in numbers})
    nothing["status"] = dataset["status"].copy(data=np.full((2, 2), int(Status.NO_STEADY_STATE)))
    nothing["status"].attrs = dataset["status"].attrs
    (axes,) = plots.draw_figure(nothing).axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["no steady state"]


def test_a_legend_beside_a_scale_of_colours_leaves_the_panel_its_room():
    """The panel occupies more than 55 % of the figure width.

    A wide legend next to a colour bar could leave less than half of the width.
    """
    axes = [
        Axis("law", ["slip", "slowness"]),
        Axis("phi", np.linspace(50.0, 65.0, 8)),
        Axis("alpha", np.linspace(0.0, 0.5, 9)),
        Axis("normal_stress", ["constant", "variable", "imposed"]),
    ]
    dataset = run(Study(name="n", title="", base=Scene(), axes=axes, measure=LinearStability()))
    drawn = plots.draw_figure(
        dataset, rsfstudy.Figure(lines.build_line_panels(dataset, "critical_stiffness"))
    )
    assert drawn.axes[0].get_position().width > 0.55


def test_more_panels_than_can_be_read_are_lines_or_maps():
    """A figure with too many panels is replaced by lines or maps.

    The figure has seven panels, and the added axis has two points.
    """
    many = rsfstudy.Figure([Panel(x="weakening", y="critical_stiffness", hue=["phi"])] * 7)
    dataset = run(stiffnesses().rsf.study.with_(alpha=[0.2, 0.5]))
    assert len(plots.draw_figure(dataset.isel(alpha=[0]), many).axes) == 7
    assert len(plots.draw_figure(dataset, many).axes) < 7


def test_what_is_in_units_is_called_no_ratio():
    held = {"scale": "D_c", "units": "1", "long_name": "load point displacement"}
    ratio = xr.Dataset({"moved": ((), 2.0, {**held, "symbol": r"$\delta_0/D_c$"})})
    scales = {"D_c": UnitScale(10.0, "um"), "V_*": UnitScale(1.0, "um s-1")}
    moved = multiply_variables_by_unit_scales(ratio, scales)["moved"]
    assert moved.attrs == {"units": "um", "long_name": "load point displacement"}


def test_labels_of_errors_of_samples_are_short(tmp_path_factory):
    dataset, _path = named_results("uncertain_recurrence", tmp_path_factory)
    drawn = plots.draw_figure(dataset, variable="recurrence_interval_error")
    checks.assert_printable(drawn)
    assert drawn.axes[6].get_ylabel().startswith("error of\nrecurrence")


def test_errors_too_small_to_show_are_left_out():
    assert _text_formatting.format_value_with_error(1.33333334, 8e-9, 4) == "$1.3333$"
    assert _text_formatting.format_value_with_error(0.857, 0.007, 4) == r"$0.857 \pm 0.007$"
    assert _text_formatting.format_value_with_error(0.857, 0.00006, 4) == r"$0.85700 \pm 0.00006$"
