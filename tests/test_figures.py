"""Tests of figures of named studies and of any lattice, in any style.

The figures must meet the requirements of a journal.
"""

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text
from study_runs import call_main, named_results, run

import rsfstudy
from rsfstudy import Axis, Scene, Study, plots
from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue
from rsfstudy.plots import _style, _text_formatting
from rsfstudy.quantities import Quantity
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.storage import dataset_files
from rsfstudy.study import named_study_index
from rsfstudy.vocabulary import find_quantity

MM = 25.4
#: Permitted apparent overlap in inches. Text extents use the height of the tallest letters,
#: rounded up to pixels of 0.01 inches, and the extents of formulas depend on the version of
#: Matplotlib.
SLACK = 0.015


@pytest.fixture(scope="module", params=named_study_index.list_study_names())
def figure(request, tmp_path_factory):
    """Draw the figure of each reduced named study."""
    dataset, _path = named_results(request.param, tmp_path_factory)
    return plots.draw_figure(dataset)


def boxes(figure, artists):
    """Return the artists with nonzero extents, and the extents in inches."""
    found = [(artist, artist.get_window_extent()) for artist in artists]
    dpi = figure.dpi
    return [(a, np.array(box.extents) / dpi) for a, box in found if box.width and box.height]


def overlap(first, second, slack=SLACK):
    """Return True if two extents overlap by more than a tolerance."""
    low, high = np.maximum(first[:2], second[:2]), np.minimum(first[2:], second[2:])
    return bool((high - low > slack).all())


def texts(figure):
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def written(figure):
    """Return the titles, panel letters, axis labels and legends."""
    around = [figure.legends]
    for axes in figure.axes:
        # The selection contains panel letters and titles (left, centre and right), but no tick
        # labels.
        titles = [child for child in axes.get_children() if isinstance(child, Text)]
        around.append([t for t in titles if t not in axes.texts and t.get_text()])
        around.append([axes.xaxis.label, axes.yaxis.label])
        around.append(filter(None, [axes.get_legend()]))
    return list(itertools.chain(*around))


def assert_printable(figure):
    """Assert that all elements lie inside the figure and do not overlap."""
    width, height = figure.get_size_inches()
    left, low, right, high = figure.get_tightbbox().extents
    assert left > -SLACK, "sticks out on the left"
    assert low > -SLACK, "sticks out below"
    assert right < width + SLACK, "sticks out on the right"
    assert high < height + SLACK, "sticks out above"
    for axes in figure.axes:
        inside = np.array(axes.get_window_extent().extents) / figure.dpi
        for text, box in boxes(figure, axes.texts):
            assert (box[:2] > inside[:2] - SLACK).all(), f"{text} leaves its axes"
            assert (box[2:] < inside[2:] + SLACK).all(), f"{text} leaves its axes"
    for (one, first), (other, second) in itertools.combinations(boxes(figure, written(figure)), 2):
        assert not overlap(first, second), f"{one} touches {other}"
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes)]
    for (_legend, box), axes in itertools.product(
        boxes(figure, filter(None, legends)), figure.axes
    ):
        data = np.array(axes.get_window_extent().extents) / figure.dpi
        assert not overlap(box, data), f"a legend covers {axes.get_title()}"


def is_seen(artist):
    """Return True if an artist has visible elements."""
    line = artist.lines[0] if isinstance(artist, ErrorbarContainer) else artist
    if isinstance(line, Line2D):
        return bool(np.isfinite(np.asarray(line.get_xydata(), dtype=float)).all(axis=1).any())
    return not hasattr(line, "get_paths") or len(line.get_paths()) > 0


def test_nothing_sticks_out_or_covers_anything_else(figure):
    """Elements do not overlap, and all axes have labels."""
    assert_printable(figure)
    for axes in figure.axes:
        assert axes.get_xlabel() or axes.get_label() == "<colorbar>"
        assert axes.get_ylabel()


def test_a_figure_says_where_its_results_are_partial(tmp_path):
    dataset = run().assign_attrs(completeness="partial: 1 of 2 cells")
    assert (
        plots.draw_figure(dataset).get_suptitle() == "[partial: 1 of 2 cells]"
    )  # The title appears once for all panels.
    plots.save_figure(dataset, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000


def test_it_fits_a_journal(figure):
    """A figure is one or two columns wide, and fits on a page."""
    width, height = figure.get_size_inches() * MM
    assert min(abs(width - 84.0), abs(width - 174.0)) < 0.1
    assert height < 235.0


def test_legends_name_what_is_drawn(figure):
    drawn = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            drawn[label.replace("\n", " ")] = drawn.get(label, False) or is_seen(handle)
    for legend in filter(None, [*figure.legends, *(axes.get_legend() for axes in figure.axes)]):
        named = [text.get_text().replace("\n", " ") for text in legend.get_texts()]
        assert len(set(named)) == len(named)
        for name in named:
            assert drawn.get(name), f"nothing is drawn of {name!r}"


def test_symbols_are_written_as_symbols(figure):
    """Texts contain no underscores and no names of Greek letters.

    Matplotlib can parse all formulas.
    """
    parser = MathTextParser("path")
    for text in texts(figure):
        if "$" in text:
            parser.parse(text)
        words = re.sub(r"\$[^$]*\$", "", text)
        assert "_" not in words, text
        assert not re.search(r"\b(alpha|phi|sigma|mu|tau|zeta|theta)\b", words), text


def test_panels_have_letters(figure):
    letters = [axes.get_title(loc="left").strip() for axes in figure.axes]
    letters = [letter for letter in letters if letter]
    panels = [axes for axes in figure.axes if axes.get_subplotspec() and axes.get_xlabel()]
    expected = [f"({chr(ord('a') + number)})" for number in range(len(panels))]
    assert letters == (expected if len(panels) > 1 else [])


def test_numbers_along_axes_do_not_touch(figure):
    for axes, which in itertools.product(figure.axes, ("x", "y")):
        axis = getattr(axes, f"{which}axis")
        low, high = sorted(axis.get_view_interval())
        ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
        shown = [t.label1 for t in ticks if low <= t.get_loc() <= high and t.label1.get_visible()]
        found = boxes(figure, [label for label in shown if label.get_text()])
        for (one, first), (other, second) in itertools.combinations(found, 2):
            assert not overlap(first, second), f"{one} touches {other}"


def test_narrowed_studies_repeat_no_panel(tmp_path_factory):
    """Selections of a study have one panel per remaining point."""
    laws, _path = named_results("displacement_boundary", tmp_path_factory)
    assert len(plots.draw_figure(laws).axes) == 5
    assert len(plots.draw_figure(laws.isel(law=[0])).axes) == 3
    assert len(plots.draw_figure(laws.isel(law=0, load=0)).axes) == 2
    slip, _path = named_results("bounded_slip", tmp_path_factory)
    assert len(plots.draw_figure(slip).axes) == 5
    assert len(plots.draw_figure(slip.isel(inertia=[0])).axes) == 3
    zeta, _path = named_results("rate_step_boundary", tmp_path_factory)
    (axes,) = plots.draw_figure(zeta.isel(b_over_a=0)).axes
    points = [line for line in axes.lines if line.get_linestyle() == "None"]
    assert len(points) == zeta.sizes["case"]


# ---- study by study -----------------------------------------------------------------------------


def test_where_no_line_fits_the_figure_says_so(tmp_path_factory):
    """The legend names curves without a fit, and no line is drawn.

    The stress drops of the slowness law at 50 degrees are curved.
    """
    dataset, _path = named_results("stress_drop", tmp_path_factory)
    for axes in plots.draw_figure(dataset).axes[1:4:2]:
        labels = set(axes.get_legend_handles_labels()[1])
        curved = [label for label in labels if "no linear fit" in label]
        assert [label.split(":")[0] for label in curved] == [r"$\phi$ = 50"]
        fitted = [line for line in axes.lines if line.get_linestyle() != "None"]
        assert len(fitted) == len(labels) - len(curved)


# ---- any lattice --------------------------------------------------------------------------------


def lattice(*axes, **fields):
    """Return critical stiffness over the given axes."""
    return run(
        Study(
            name="mine",
            title="Critical stiffness k_cr of my own, with $k_{cr} D_c/\\sigma_*$ in a long title",
            base=Scene(alpha=0.56),
            axes=list(axes),
            measure=LinearStability(),
            **fields,
        )
    )


RATES = Axis("load_velocity_ratio", np.geomspace(1e-4, 1e4, 9))
ANGLES = Axis("phi", [38.0, 45.0, 60.0, 75.0])
AWKWARD = {
    "alpha = 0.25, my_own": {"alpha": 0.25},
    "k_cr at V_*": {"alpha": 0.56},
    "costs $5": {"alpha": 0.4},
}


@pytest.mark.parametrize(
    "axes",
    [
        [RATES],
        [Axis("phi", [60.0])],
        [Axis("phi", [50.0, 60.12345678901234]), RATES],
        [Axis("case", AWKWARD), Axis("law", ["slip", "slowness"])],
        [Axis("case", AWKWARD), RATES],
        [ANGLES, RATES],
        [Axis("law", ["slip", "slowness"]), ANGLES, RATES],
        [Axis("alpha", np.linspace(0.0, 0.5, 9)), Axis("phi", [50.0, 60.0])],
        [Axis("alpha", np.linspace(0.0, 0.5, 40)), Axis("law", ["slip", "slowness"])],
    ],
    ids=lambda axes: ", ".join(axis.dimension for axis in axes),
)
def test_any_lattice_is_printable(axes):
    drawn = plots.draw_figure(lattice(*axes))
    assert_printable(drawn)
    for test in (test_it_fits_a_journal, test_legends_name_what_is_drawn):
        test(drawn)
    test_symbols_are_written_as_symbols(drawn)


def test_curves_that_lie_on_each_other_are_one():
    """Identical curves are drawn once.

    The angle is not applicable at constant normal stress.
    """
    stress = Axis("normal_stress", ["constant", "variable"])
    axes = plots.draw_figure(lattice(stress, Axis("phi", [50.0, 60.0]), RATES)).axes[0]
    assert axes.get_legend_handles_labels()[1] == [
        "constant normal stress",
        r"variable normal stress, $\phi$ = 50°",
        r"variable normal stress, $\phi$ = 60°",
    ]


def test_two_axes_of_numbers_are_a_map_with_statuses_that_are_no_number():
    dataset = lattice(ANGLES, RATES)
    drawn = plots.draw_figure(dataset)
    assert drawn.axes[0].get_xscale() == "log"
    assert texts(drawn).count("no steady state") == 1
    (unknown,) = (c for c in drawn.axes[0].collections if c.get_label() == "no steady state")
    assert unknown.get_hatch()
    widths = [np.ptp(np.log10(path.vertices[:, 0])) for path in unknown.get_paths()]
    assert sum(widths) == pytest.approx(int(dataset.critical_stiffness.isnull().sum()))


def test_any_variable_on_request():
    dataset = lattice(ANGLES, RATES)
    drawn = rsfstudy.plot(dataset, "steady_friction")
    assert any("friction coefficient" in text.replace("\n", " ") for text in texts(drawn))
    with pytest.raises(InvalidValue, match="variable 'friction' is not a numeric variable"):
        rsfstudy.plot(dataset, "friction")
    with pytest.raises(InvalidValue, match="variable 'message'"):
        rsfstudy.plot(dataset, "message")


# ---- style and files ----------------------------------------------------------------------------


def test_a_style_of_the_users_own(tmp_path):
    dataset = lattice(RATES)
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_text("figure.figsize: 3.5, 2.6\naxes.prop_cycle: cycler('color', ['123456'])\n")
    ours, theirs = plots.draw_figure(dataset), rsfstudy.plot(dataset, style=sheet)
    assert theirs.get_size_inches()[0] == pytest.approx(7.0 + 6.0 / MM)
    assert theirs.axes[0].lines[0].get_color() in ("#123456", "123456")
    assert ours.axes[0].lines[0].get_color() != theirs.axes[0].lines[0].get_color()
    larger = rsfstudy.plot(dataset, style=[sheet, {"font.size": 11.0, "xtick.labelsize": 11.0}])
    assert larger.axes[0].xaxis.get_ticklabels()[0].get_size() == 11.0
    with pytest.raises(InvalidValue, match="style = 'nothing' is neither a style sheet"):
        rsfstudy.plot(dataset, style="nothing")


@pytest.mark.parametrize(
    ("style", "message"),
    [
        ("rsfstudy.plots", "is neither a style sheet"),
        ("https://example.org/sheet.mplstyle", "cannot be read: No such file"),
        ("plain.txt", "is neither a style sheet"),
        (Path("plain.txt"), "is neither a style sheet"),
        (5, "is neither a style sheet"),
        ({"font.sise": 9}, "'font.sise' is not a setting of matplotlib. Did you mean 'font.size'"),
        ({"font.size": "large-ish"}, "'large-ish' is not a valid value of font.size: Could not"),
        ("unknown.mplstyle", "unknown.mplstyle, line 2: style = 'font.sise' is not a setting"),
        ("text.mplstyle", "text.mplstyle, line 1: style = 'root' is not"),
        ("latin.mplstyle", "cannot be read: the file is not encoded in UTF-8"),
        (["ggplot", "folder.mplstyle"], "is a directory"),
    ],
)
def test_styles_are_checked_and_never_imported(style, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("plain.txt").write_text("font.size: 9\n")
    Path("unknown.mplstyle").write_text("font.size: 9  # points\nfont.sise: 9\n")
    Path("text.mplstyle").write_text("root:x\n")
    Path("latin.mplstyle").write_bytes(b"font.family: \xe9\n")
    Path("folder.mplstyle").mkdir()
    with pytest.raises(InvalidValue, match=re.escape(message)), plots.style_context(style):
        pass
    if isinstance(style, str):
        ran = call_main("plot", "missing.nc", "--style", style)
        assert (ran.returncode, ran.stdout) == (2, "")
        assert len(ran.stderr) < 2000


@pytest.mark.parametrize(
    "settings",
    [
        {"axes.prop_cycle": "cycler('color', [])"},
        {"font.size": math.nan},
        {"savefig.dpi": 1e9},
        {"figure.figsize": (1e6, 1e6)},
    ],
)
def test_a_style_in_which_nothing_can_be_drawn_is_named(settings, tmp_path):
    message = r"^'style' cannot be used to draw a figure: .* Draw the figure without"
    with pytest.raises(InvalidValue, match=message):
        plots.save_figure(lattice(RATES), tmp_path / "figure.png", style=settings)
    assert not list(tmp_path.iterdir())


def test_a_variable_is_drawn_if_the_study_declares_the_figure_of_fits():
    """A requested variable takes precedence over the declared figure."""
    dataset = lattice(RATES, plot="fits")
    drawn = rsfstudy.plot(dataset, variable="critical_stiffness")
    assert len(drawn.axes[0].lines) == 1


def test_a_font_that_is_missing_is_named_once(tmp_path, monkeypatch):
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_text("font.family: No Such Font\n")
    file = tmp_path / "lattice.nc"
    dataset_files.write_dataset(lattice(RATES), file)
    ran = call_main("plot", file, "--style", sheet)
    said = " ".join(ran.stderr.split())
    assert (ran.returncode, said.count("Font family 'No Such Font' not found")) == (0, 1)


def test_style_sheets_are_read_as_matplotlib_reads_them():
    import matplotlib

    sheets = [
        *Path(matplotlib.get_data_path(), "stylelib").glob("*.mplstyle"),
        _style.DEFAULT_STYLE_SHEET_PATH,
    ]
    for sheet in sheets:
        theirs = matplotlib.rc_params_from_file(sheet, use_default_template=False)
        with plots.style_context([{"font.size": 5.0}, sheet]):
            assert {name: matplotlib.rcParams[name] for name in theirs} == dict(theirs)


def test_ours_is_left_alone():
    """Drawing does not change the global style."""
    import matplotlib

    before = dict(matplotlib.rcParams)
    plots.draw_figure(lattice(RATES))
    assert dict(matplotlib.rcParams) == before


def test_a_notebook_shows_a_figure():
    assert rsfstudy.plot(lattice(RATES))._repr_png_().startswith(b"\x89PNG")


BEGINS = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    path = tmp_path_factory.mktemp("results") / "mine.nc"
    dataset_files.write_dataset(lattice(ANGLES, RATES), path)
    return path


@pytest.mark.parametrize("form", Defaults.FIGURE_FORMATS)
def test_plot_writes_the_file_it_is_told_to(form, results, tmp_path):
    target = tmp_path / "deep" / f"fig.{form}"
    ran = call_main("plot", results, "--output", target)
    assert ran.returncode == 0, ran.stderr
    assert target.read_bytes().startswith(BEGINS[form])
    assert [file.name for file in results.parent.iterdir()] == ["mine.nc"]
    again = tmp_path / f"again.{form}"
    assert call_main("plot", results, "--output", again).returncode == 0
    assert again.read_bytes() == target.read_bytes()


def test_plot_takes_a_directory_a_format_a_style_and_a_variable(results, tmp_path):
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_text("savefig.dpi: 50\n")
    options = ["--output", tmp_path, "--variable", "steady_friction", "--style", sheet]
    assert call_main("plot", results, *options).returncode == 0
    assert imread(tmp_path / "mine.steady_friction.png").shape[1] == int(84.0 / MM * 50)
    assert call_main("plot", results, "--figure", "svg", "--output", tmp_path).returncode == 0
    assert (tmp_path / "mine.svg").exists()


# ---- words and numbers --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("alpha = 0.56", r"$\alpha$ = 0.56"),
        ("slowness at 1.5 k_cr", r"slowness at 1.5 $k_{cr}$"),
        ("load point moving at V_*", "load point moving at $V_*$"),
        ("phi = atan(mu_*) + 0.01", r"$\phi$ = atan($\mu_*$) + 0.01"),
        ("peak at 10^87 V_*", "peak at $10^{87}$ $V_*$"),
        ("T = 1e-6 s", "T = $10^{-6}$ s"),
        ("my_own case", "my own case"),
        (r"$k_{cr}$ stays", r"$k_{cr}$ stays"),
        ("costs $5", r"costs \$5"),
    ],
)
def test_words(text, written):
    assert _text_formatting.convert_symbols_to_mathtext(text) == written


@pytest.mark.parametrize(("count", "columns"), [(5, 4), (7, 3), (4, 2), (3, 5)])
def test_a_legend_is_read_line_by_line(count, columns):
    figure = Figure(figsize=(12.0, 3.0))
    axes = figure.add_subplot()
    for number in range(count):
        axes.plot([0.0, 1.0], [number, number], label=f"{number} MPa/mm")
    _style.add_legend(axes, columns)
    figure.draw_without_rendering()
    placed = [(text.get_window_extent(), text) for text in axes.get_legend().get_texts()]
    read = sorted(placed, key=lambda one: (-round(one[0].y0), one[0].x0))
    assert [text.get_text() for _box, text in read] == [f"{n} MPa/mm" for n in range(count)]


@pytest.mark.parametrize("units", ["s", "MPa um-1"])
def test_units_stay_with_the_last_word(units):
    about = Quantity("recurrence", "", units, "recurrence interval of stick-slip")
    for width in range(8, 60):
        last = _text_formatting.format_quantity_axis_label(about, width).split("\n")[-1]
        assert re.match(r"(?!\().*\(.*\)$", last)


@pytest.mark.parametrize(
    ("name", "width", "label"),
    [
        ("b_over_a", 60, "Ratio of evolution effect to direct effect, $b/a$"),
        ("b_over_a", 40, "$b/a$"),
        ("critical_velocity_ratio", 60, "Critical load point velocity, $V_0/V_*$"),
        ("critical_velocity_ratio", 30, "Critical velocity, $V_0/V_*$"),
        ("critical_displacement", 20, "Critical\ndisplacement, $\\Delta\\delta_0/D_c$"),
    ],
)
def test_a_label_that_does_not_fit_on_one_line_is_shortened(name, width, label):
    """Labels without a shorter form are wrapped."""
    assert _text_formatting.format_quantity_axis_label(find_quantity(name), width) == label
