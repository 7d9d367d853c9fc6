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
from rsfstudy.plots._map import contours


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
