"""Figures of laws, of dilatant cycles and of motions: comparable, and printable as all others."""

import numpy as np
import pytest
import test_figures as checks
import xarray as xr
from matplotlib.figure import Figure
from running import named_results

import rsfstudy
from rsfstudy import Scene, plots
from rsfstudy.plots import _text
from rsfstudy.plots.maps import contours


def test_laws_stand_at_one_height_under_constant_and_variable_normal_stress(tmp_path_factory):
    dataset, _path = named_results("laws", tmp_path_factory)
    constant, variable = plots.figure(dataset).axes
    assert constant.get_ylim() == variable.get_ylim()
    assert "closed form" in constant.get_legend_handles_labels()[1]


def test_what_happens_around_a_rupture_is_seen(tmp_path_factory):
    """A tenth of D_c/V_* before and after it takes most of the panel; cycles last a hundred."""
    dataset, _path = named_results("dilatant_cycles", tmp_path_factory)
    for axes in plots.figure(dataset).axes[2:]:
        near = axes.transAxes.inverted().transform(axes.transData.transform([(-0.1, 0), (0.1, 0)]))
        assert np.ptp(near[:, 0]) > 0.6
        rates = np.concatenate([line.get_ydata() for line in axes.lines])
        low, high = axes.get_ylim()
        assert low < rates.min() < rates.max() < high


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


def test_errors_too_small_to_show_are_left_out():
    assert _text.with_error(1.33333334, 8e-9, 4) == "$1.3333$"
    assert _text.with_error(0.857, 0.007, 4) == r"$0.857 \pm 0.007$"
    assert _text.with_error(0.857, 0.00006, 4) == r"$0.85700 \pm 0.00006$"


@pytest.mark.parametrize(("points", "drawn"), [(5, 0), (6, 2)])
def test_lines_of_equal_value_need_points_enough(points, drawn):
    """Their labels have an outline, so that they can be read on any colour."""
    at = np.arange(float(points))
    values = xr.DataArray(at[:, None] + at, coords={"y": at, "x": at}, dims=("y", "x"))
    axes = Figure().add_subplot()
    contours(axes, values, [2.0, 4.0])
    assert len(axes.texts) == drawn
    assert all(text.get_path_effects() for text in axes.texts)


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
