"""Tests of the width, style, header and text sizes of figures."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import test_figures as checks
import xarray as xr
from matplotlib.colors import to_hex
from matplotlib.image import imread
from matplotlib.text import Text
from rsfstudy.named_studies.accuracy_cost import INTEGRATORS
from study_runs import call_main, run

import rsfstudy
from rsfstudy import Axis, Scene, Study, plots
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import LinearStability
from rsfstudy.plots import corner_plots, fits
from rsfstudy.status import Status
from rsfstudy.storage import write_dataset

HOLDS = Path(__file__).parents[1] / "studies" / "pages" / "holds.csv"
MM = 25.4
RATES = Axis("load_velocity_ratio", np.geomspace(1e-4, 1e4, 9))
ANGLES = Axis("phi", [45.0, 60.0, 75.0])


def lattice(*axes, **fields):
    """Return critical stiffness over the given axes."""
    study = {"name": "mine", "title": "Critical stiffness", "base": Scene(alpha=0.56)}
    return run(Study(**study, axes=list(axes), measure=LinearStability(), **fields))


@pytest.fixture(scope="module")
def motion():
    return rsfstudy.simulate(Scene(hold_time=1.0), duration=1.0, rtol=1e-3)


@pytest.fixture(scope="module")
def holds():
    scene = Scene(normal_stress="constant", hold_time=1000, stiffness_ratio=10)
    motion = rsfstudy.simulate(scene, duration=1100.0)
    return motion.rsf.holds()


@pytest.fixture(scope="module")
def results():
    """Return results whose figure has two panels next to each other."""
    return lattice(RATES)


@pytest.fixture
def draw(request, motion, holds, results):
    """Return a function that draws the figure with the given appearance."""
    return {
        "motion": motion.rsf.plot,
        "study": results.rsf.plot,
        "map": lambda **about: lattice(ANGLES, RATES).rsf.plot(**about),
        "healing": lambda **about: rsfstudy.plot_healing(holds, **about),
        "record": lambda **about: rsfstudy.plot_record(rsfstudy.read_record(HOLDS), **about),
    }[request.param]


@pytest.mark.parametrize("draw", ["motion", "study", "map", "healing", "record"], indirect=True)
@pytest.mark.parametrize("width", ["85 mm", "18 cm", 0.12])
def test_figures_have_the_requested_width_and_style(draw, width):
    drawn = draw(width=width, style={"axes.facecolor": "#123456"})
    expected = {"85 mm": 85.0, "18 cm": 180.0, 0.12: 120.0}[width]
    assert drawn.get_figwidth() * MM == pytest.approx(expected)
    assert {to_hex(axes.get_facecolor()) for axes in drawn.axes} == {"#123456"}
    checks.assert_printable(drawn)
    for axes in drawn.axes:
        assert axes.get_window_extent().width / drawn.dpi * MM > 30.0 or not axes.get_xlabel()


def test_panels_are_below_each_other_in_a_narrow_figure(results):
    lefts = [
        {round(axes.get_position().x0, 2) for axes in results.rsf.plot(width=width).axes}
        for width in ("85 mm", "170 mm")
    ]
    assert [len(positions) for positions in lefts] == [1, 2]


@pytest.mark.parametrize(
    ("width", "message"),
    [
        (
            "20 mm",
            "'width' must be from 60 mm to 600 mm \\(got '20 mm'\\). For example, pass '85 mm'",
        ),
        (85, "must be from 60 mm to 600 mm"),
        ("3 s", "has units that are incompatible with m"),
        ("wide", "is not a quantity"),
    ],
)
def test_widths_are_checked(motion, width, message):
    with pytest.raises(InvalidValue, match=message):
        motion.rsf.plot(width=width)
    assert rsfstudy.plot_motion(motion).get_figwidth() * MM == pytest.approx(174.0, abs=0.1)


def test_commands_draw_figures_with_a_width_and_a_style(motion, results, tmp_path):
    (tmp_path / "mine.mplstyle").write_text("savefig.dpi: 50\n")
    for name, dataset in (("motion", motion), ("study", results)):
        write_dataset(dataset, tmp_path / f"{name}.nc")
        options = ["--width", "85 mm", "--style", tmp_path / "mine.mplstyle", "--no-header"]
        ran = call_main("plot", tmp_path / f"{name}.nc", *options)
        assert ran.returncode == 0, ran.stderr
        assert imread(tmp_path / f"{name}.png").shape[1] == int(85.0 / MM * 50)


@pytest.mark.parametrize(
    ("name", "option", "message"),
    [
        ("motion", ["--variable", "slip"], "applies only to results of a study"),
        ("study", ["--against", "time"], "applies only to a motion"),
        ("study", ["--width", "5 mm"], "must be from 60 mm to 600 mm"),
    ],
)
def test_options_without_effect_are_rejected(motion, results, name, option, message, tmp_path):
    write_dataset({"motion": motion, "study": results}[name], tmp_path / "file.nc")
    ran = call_main("plot", tmp_path / "file.nc", *option)
    assert ran.returncode == 2
    assert message in " ".join(ran.stderr.split())
    assert not list(tmp_path.glob("*.png"))


def test_the_style_of_verify_requires_a_figure():
    ran = call_main("verify", "missing.csv", "--width", "85 mm")
    assert (ran.returncode, "Add --figure FILE" in ran.stderr) == (2, True)


# ---- header -------------------------------------------------------------------------------------


def with_failures(dataset, count):
    """Return a copy of a dataset with failed cells."""
    status = dataset["status"].copy()
    status.values.flat[:count] = int(Status.INTEGRATION_FAILED)
    return dataset.assign(status=status)


def test_the_header_is_red_only_if_many_cells_failed():
    dataset = lattice(Axis("phi", np.linspace(40.0, 80.0, 20)), RATES)
    colours = {}
    for count in (1, 9):
        drawn = plots.draw_figure(with_failures(dataset, count))
        assert f"{count} cell" in drawn.get_suptitle()
        colours[count] = drawn.texts[0].get_color()
    assert colours == {1: "0.4", 9: "tab:red"}


def test_the_header_can_be_omitted(motion):
    dataset = with_failures(lattice(ANGLES, RATES), 3)
    assert plots.draw_figure(dataset).get_suptitle() != ""
    assert plots.draw_figure(dataset, header=False).get_suptitle() == ""
    assert motion.rsf.plot().get_suptitle() != ""
    assert motion.rsf.plot(header=False).get_suptitle() == ""


def test_a_long_header_does_not_flatten_the_panels():
    dataset = lattice(ANGLES, RATES)
    plain, long = (plots.draw_figure(with_failures(dataset, count)) for count in (0, 9))
    sizes = [drawn.axes[0].get_window_extent().height / drawn.dpi for drawn in (plain, long)]
    assert sizes[1] > 0.95 * sizes[0]


# ---- fits and samples ---------------------------------------------------------------------------


def fit_of_steps(steps):
    """Return the variables of a joint fit that the panels of records and correlations need."""
    names = ["a", "b", "slip_distance"]
    names += [f"{name}_{step}" for step in range(1, steps + 1) for name in ("mu_star", "trend1")]
    moved = np.linspace(0.0, 1000.0, 201)
    friction = np.where(moved < 400.0, 0.1, 0.6 + 1e-3 * np.sin(moved / 30.0))
    fitted = np.where((moved > 600.0) & (moved < 900.0), friction, np.nan)
    return xr.Dataset(
        {
            "record_displacement": ("row", moved),
            "record_friction": ("row", friction),
            "record_time": ("row", moved),
            "fitted_friction": (("law", "row"), fitted[None]),
            "fitted_friction_stderr": (("law", "row"), np.full((1, moved.size), 1e-4)),
            "correlation": (
                ("law", "parameter", "parameter2"),
                np.full((1, len(names), len(names)), -0.555),
            ),
        },
        coords={"law": ["perrin_rice_zheng"], "parameter": names},
    )


@pytest.mark.parametrize("steps", [1, 2, 5, 12])
def test_the_labels_of_correlations_do_not_collide(steps):
    with plots.style_context():
        drawn = plots.NotebookFigure(figsize=(3.4, 2.4), layout="constrained")
        axes = drawn.add_subplot()
        fits._draw_parameter_correlation_matrix(fit_of_steps(steps), axes)
        drawn.draw_without_rendering()
        labels = [*axes.get_xticklabels()], [*axes.get_yticklabels()], list(axes.texts)
    for group in labels:
        found = checks.boxes(drawn, group)
        assert found or group is labels[2]
        for (one, first), (other, second) in itertools.combinations(found, 2):
            assert not checks.overlap(first, second, 0.0), f"{one} touches {other}"
    assert all(text.get_fontsize() >= 6.0 for text in axes.texts)


def test_the_y_range_of_a_record_is_the_range_in_the_windows():
    """Friction of 0.1 outside the windows does not stretch the y axis."""
    axes = plots.NotebookFigure().add_subplot()
    fits._draw_record_with_fits(fit_of_steps(1), axes)
    low, high = axes.get_ylim()
    assert 0.598 < low < 0.599
    assert 0.601 < high < 0.602
    assert "Perrin-Rice-Zheng law" in axes.get_legend_handles_labels()[1]


def three_laws(status=(0, 0, 0)):
    """Return a fit of three laws. The last law has a second slip distance."""
    one = fit_of_steps(1).isel(parameter=[0, 1, 2, 3], parameter2=[0, 1, 2, 3])
    names = ["a", "b", "slip_distance", "slip_distance_2"]
    dataset = xr.concat([one] * 3, "law", data_vars="minimal", coords="minimal", compat="override")
    dataset = dataset.assign_coords(law=["slip", "slowness", "two_slip_states"], parameter=names)
    correlation = dataset["correlation"].values.copy()
    correlation[:2, 3] = correlation[:2, :, 3] = correlation[2, 1] = correlation[2, :, 1] = np.nan
    dataset["correlation"] = dataset["correlation"].dims, correlation
    for name in ("record_displacement", "record_friction", "record_time"):
        dataset[name] = dataset[name].expand_dims(law=dataset.law).copy()
    dataset["residual"] = dataset["whitened_residual"] = 1e-3 * dataset["fitted_friction"]
    dataset["status"] = "law", np.array(status)
    failed = dataset["status"] == Status.CELL_RAISED
    values = dataset.drop_vars("status")
    return values.where(~failed).assign(status=dataset["status"])


def test_correlations_of_all_laws_are_drawn():
    """Parameters that a law does not have are omitted, and the third law has its own panel."""
    dataset = three_laws()
    panels = fits.build_fit_panels(dataset)
    titles = [panel.title(dataset) for panel in panels[3:]]
    assert titles == [
        "Correlation: slip below, slowness above",
        "Correlation: slip law with two states",
    ]
    labels = []
    with plots.style_context():
        for panel in panels[3:]:
            panel.overlays[0](dataset, axes := plots.NotebookFigure().add_subplot())
            labels.append([text.get_text() for text in axes.get_yticklabels()])
    assert labels == [["$a$", "$b$", "$D_c$"], ["$a$", "$D_c$", "$D_{c2}$"]]


def test_a_law_that_is_not_identified_has_no_band():
    for status, bands in ((Status.NOT_IDENTIFIED, 2), (Status.OK, 3)):
        axes = plots.NotebookFigure().add_subplot()
        fits._draw_record_with_fits(three_laws((0, 0, int(status))), axes)
        assert len(axes.collections) == bands
        names = axes.get_legend_handles_labels()[1]
        assert any("if identified" in name for name in names) is (bands == 2)


@pytest.mark.parametrize("failed", [(0,), (0, 1), (2,), (0, 1, 2)])
def test_a_law_that_failed_does_not_spoil_the_figure(failed):
    """The record, windows and white noise are drawn with the first law that has values."""
    dataset = three_laws([int(Status.CELL_RAISED) if n in failed else 0 for n in range(3)])
    panels = fits.build_fit_panels(dataset)
    names = []
    with plots.style_context():
        for panel in panels:
            panel.overlays[0](dataset, axes := plots.NotebookFigure().add_subplot())
            names.append(axes.get_legend_handles_labels()[1])
    assert len(panels) == 4
    some = len(failed) < 3
    assert ("record" in names[0]) is ("fitted window" in names[0]) is some
    assert any(name.startswith("rows, ") for name in names[1]) is some
    assert ("white noise (95 %)" in names[2]) is some
    several = len(failed) == 1
    assert ("whitened residuals, same colours" in names[2]) is several


def test_samples_are_a_corner_plot():
    normal = np.random.default_rng(1).normal
    table = {"a": 0.01 + 1e-3 * normal(size=40), "b_over_a": 2.0 + 0.1 * normal(size=40)}
    dataset = lattice(Axis.cases(table, dimension="sample"))
    drawn = plots.draw_figure(dataset)
    places = [axes.get_subplotspec() for axes in drawn.axes]
    rows = [(place.rowspan.start, place.colspan.start) for place in places]
    assert rows == [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)]
    assert drawn.get_figwidth() == drawn.get_figheight()
    for axes, (row, column) in zip(drawn.axes, rows, strict=True):
        assert bool(axes.get_xlabel()) is (row == 2)
        assert bool(axes.get_ylabel()) is (column == 0 and row > 0)
        same_column = [other for other, at in zip(drawn.axes, rows, strict=True) if at[1] == column]
        assert {other.get_xlim() for other in same_column} == {axes.get_xlim()}
    checks.assert_printable(drawn)
    assert isinstance(corner_plots.build_corner_figure(dataset), corner_plots.CornerFigure)


@pytest.mark.parametrize(("count", "omitted"), [(4, ""), (6, ""), (7, "alpha")])
def test_a_corner_plot_shows_up_to_six_fields_and_names_the_others(count, omitted):
    uniform = np.random.default_rng(1).uniform
    ends = {"a": (0.008, 0.012), "b_over_a": (1.4, 1.7), "mu_star": (0.6, 0.7)}
    ends |= {"load_velocity_ratio": (1.0, 10.0), "phi": (45.0, 85.0)}
    ends |= {"radiation_damping": (1e-4, 1e-3), "alpha": (0.2, 0.5)}
    fields = list(ends)[:count]
    table = {name: uniform(*ends[name], size=40) for name in fields}
    dataset = lattice(Axis.cases(table, dimension="sample"), Axis("law", ["slip", "slowness"]))
    drawn = plots.draw_figure(dataset)
    assert len(drawn.axes) == (min(count, 6) + 1) * (min(count, 6) + 2) // 2
    notes = [text for axes in drawn.axes for text in axes.texts]
    assert [note.get_text() for note in notes] == ([f"Not shown: {omitted}"] if omitted else [])
    drawn.draw_without_rendering()
    for note in notes:  # The note is in the empty corner above the panels.
        box = note.get_window_extent()
        assert drawn.bbox.contains(box.x1, box.y1)
        assert not any(box.overlaps(axes.get_window_extent()) for axes in drawn.axes)
        note.remove()
    # One legend of the laws, and no overlapping tick labels in the narrow panels.
    assert [axes for axes in drawn.axes if axes.get_legend()] == []
    (legend,) = drawn.legends
    assert len(legend.get_texts()) == 2
    checks.assert_printable(drawn)


def test_a_field_of_a_corner_plot_is_drawn_once_with_its_symbol():
    normal = np.random.default_rng(1).normal
    table = {"a": 0.01 + 1e-3 * normal(size=40), "b_over_a": 2.0 + 0.1 * normal(size=40)}
    dataset = lattice(Axis.cases(table, dimension="sample"))
    assert corner_plots.build_corner_figure(dataset, "a").columns == 2
    lengths = xr.Dataset(
        {"slip_distance": ((), 12.0, {"long_name": "characteristic slip distance", "units": "um"})}
    )
    assert corner_plots._format_short_axis_label(lengths, "slip_distance") == r"$D_c$ ($\mu$m)"


def test_the_figure_of_overlapping_windows():
    """Each law has one strong residual curve, and pale curves where windows overlap."""
    x = np.arange(200.0)
    windows = np.array([(x < 120), (x > 60)])
    values = np.where(windows, 0.1 * np.sin(x), np.nan)[None]
    dataset = xr.Dataset(
        {
            "record_time": (("law", "step", "row"), np.tile(x, (1, 2, 1))),
            "record_displacement": (("law", "step", "row"), np.tile(x, (1, 2, 1))),
            "record_friction": (("law", "step", "row"), np.tile(0.6 + 0 * x, (1, 2, 1))),
            "residual": (("law", "step", "row"), values),
            "fitted_friction": (("law", "step", "row"), 0.6 + values),
            "fitted_friction_stderr": (("law", "step", "row"), 0.0 * values + 1e-4),
        },
        {"law": ["slip"], "step": [1, 2]},
    )
    axes = plots.NotebookFigure().add_subplot()
    fits._draw_residuals(dataset, axes)
    curves = [line for line in axes.lines if line.get_label() == "slip law"]
    assert curves[1].get_xdata().min() > curves[0].get_xdata().max()
    assert "overlap of windows" in axes.get_legend_handles_labels()[1]
    assert fits._format_loading_step_title(dataset) == "Step 1 (of 2)"
    assert fits._format_correlation_title(dataset) == "Correlation, step 1: slip law"
    fits._draw_record_with_fits(dataset, record := plots.NotebookFigure().add_subplot())
    low, high = record.get_xlim()
    assert -10.0 < low < 0.0 < 199.0 < high < 210.0
    assert record.get_ylim()[0] > 0.4  # The legend entry of the bands is not a curve.


def test_posterior_draws_are_a_corner_plot():
    attrs = {"long_name": "characteristic slip distance", "symbol": "$D_c$", "units": "um"}
    dataset = xr.Dataset(
        {
            "posterior": (("draw", "parameter"), np.random.default_rng(1).normal(size=(30, 2))),
            "a": ((), 0.01, {"long_name": "direct effect parameter", "symbol": "$a$"}),
            "slip_distance": ((), 12.0, attrs),
        },
        {"parameter": ["a", "slip_distance"], "draw": np.arange(30)},
    )
    figure, drawn = corner_plots.build_posterior_corner_figure(dataset)
    assert figure.subplot_positions == [0, 2, 3]
    assert figure.panels[1].y_label == r"$D_c$ ($\mu$m)"
    assert np.array_equal(drawn.slip_distance, dataset.posterior[:, 1])
    dataset["posterior"][:, 1] = np.nan
    assert corner_plots.build_posterior_corner_figure(dataset)[0].columns == 1
    dataset["posterior"][:] = np.nan
    with pytest.raises(InvalidValue, match=r"has no draws in this fit.*message"):
        corner_plots.build_posterior_corner_figure(dataset)


def test_integrators_have_distinct_colours():
    with plots.style_context():
        colours = [plots.cycle_style(number)["color"] for number in range(len(INTEGRATORS))]
    assert len(set(colours)) == len(INTEGRATORS)


def test_no_text_is_smaller_than_six_points(motion):
    many = Axis("case", {f"a long name of case {n}": {"phi": 45.0 + n} for n in range(30)})
    for drawn in (plots.draw_figure(lattice(many)), motion.rsf.plot(width="85 mm")):
        drawn.draw_without_rendering()
        sizes = [text.get_fontsize() for text in drawn.findobj(Text) if text.get_text()]
        assert min(sizes) >= 6.0
