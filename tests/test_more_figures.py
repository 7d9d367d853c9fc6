"""Figures of laws, of dilatant cycles and of motions: comparable, and printable as all others."""

import numpy as np
import test_figures as checks
import xarray as xr
from matplotlib.figure import Figure
from running import named_results, run

import rsfstudy
from rsfstudy import Axis, Panel, Scene, Study, plots
from rsfstudy.declare import catalogue
from rsfstudy.measures.linear_stability import LinearStability
from rsfstudy.plots import _text
from rsfstudy.plots.maps import contours


def test_the_picture_of_a_motion_is_printable():
    drawn = rsfstudy.picture(rsfstudy.simulate(Scene(hold_time=1.0), duration=1.0, rtol=1e-3))
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
    """Names along y move the panel, and its title with it; each curve has a name."""
    dataset, _path = named_results("accuracy_cost", tmp_path_factory)
    drawn = plots.figure(dataset, variable="status")
    checks.assert_printable(drawn)
    (axes,) = drawn.axes
    assert axes.get_title().count("\n") > 1
    assert len(axes.get_legend_handles_labels()[1]) == len(axes.lines)


def test_an_added_axis_lays_out_what_a_panel_shows_one_point_of():
    """The panel is at the first law; of two laws it is drawn twice, with the curves of each."""
    study = catalogue.load("rate_step_boundary")
    narrow = {"b_over_a": [1.5, 2.0, 3.0], "case": ["constant normal stress"]}
    dataset = run(study.with_(**narrow, law=["slip", "slowness"]), rtol=1e-3)
    slip, slowness = plots.figure(dataset).axes
    assert slip.get_title().endswith("slip law")
    assert slowness.get_title().endswith("slowness law")
    assert max(slowness.lines[0].get_ydata()) > 2.0 * max(slip.lines[0].get_ydata())


def stiffnesses() -> xr.Dataset:
    """Critical stiffness at two angles, of two values of b/a that have names."""
    points = {"strong": {"b_over_a": 2.0}, "weak": {"b_over_a": 1.5}}
    axes = [Axis("phi", [50.0, 60.0]), Axis("weakening", points)]
    return run(Study(name="n", title="t", base=Scene(), axes=axes, measure=LinearStability()))


def test_names_along_y_are_written_from_the_top_down():
    panel = Panel(x="critical_stiffness", y="weakening", by=["phi"])
    (axes,) = plots.figure(stiffnesses(), plots.Declared([panel])).axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["strong", "weak"]
    assert axes.yaxis_inverted()
    assert [line.get_linestyle() for line in axes.lines] == ["None", "None"]


def test_nothing_is_drawn_where_nothing_came_out():
    """Neither a number nor a cell that is fine: there is no panel."""
    dataset = stiffnesses()
    failed = dataset["phi"] == 50.0
    dataset["critical_stiffness"] = dataset["critical_stiffness"].where(~failed)
    panels = plots.Declared([Panel(x="weakening", y="critical_stiffness", each=["phi"])])
    assert len(plots.figure(dataset, panels).axes) == 2
    dataset["status"] = dataset["status"].where(~failed, np.int8(20))
    assert len(plots.figure(dataset, panels).axes) == 1


def test_errors_too_small_to_show_are_left_out():
    assert _text.with_error(1.33333334, 8e-9, 4) == "$1.3333$"
    assert _text.with_error(0.857, 0.007, 4) == r"$0.857 \pm 0.007$"
    assert _text.with_error(0.857, 0.00006, 4) == r"$0.85700 \pm 0.00006$"


def labelled(at, *coordinates: np.ndarray) -> list[str]:
    """Labels of the lines at 1, 2 and 3 of values over x and y."""
    axes = Figure().subplots()
    axes.set(xlim=coordinates[0][[0, -1]], ylim=coordinates[1][[0, -1]])
    values = at(*np.meshgrid(*coordinates))
    points = dict(zip(("x", "y"), coordinates, strict=True))
    contours(axes, xr.DataArray(values, points, ("y", "x")), [1.0, 2.0, 3.0])
    return sorted(text.get_text() for text in axes.texts)


def test_each_level_is_labelled_once_and_only_where_there_is_room():
    plane = np.linspace(0.0, 4.0, 30), np.linspace(0.0, 4.0, 30)
    assert labelled(lambda x, y: x, *plane) == ["1", "2", "3"]
    # at x = 1, 1.01 and 1.02: a label of one would hide the others
    assert labelled(lambda x, y: 1.0 + 100.0 * (x - 1.0), *plane) == []
    # two lines of each level, at either side of y = 2
    assert labelled(lambda x, y: np.abs(y - 2.0) * 2.0, *plane) == ["1", "2", "3"]
    # a single cell
    assert labelled(lambda x, y: 4.0 * (np.hypot(x - 2.0, y - 2.0) < 0.1), *plane) == []
