"""Tests of calls of the Python interface with wrong arguments.

The error message contains the argument, the rule and the remedy for every public function,
constructor and method.
"""

import inspect
import pickle
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from study_runs import study_of

import rsfstudy
from rsfstudy import Axis, Figure, Panel, Rig, Scene, Segment, measures, reductions
from rsfstudy.argument_checks import MAX_ITEMS_OF_LIST_ARGUMENT, describe_type, matches_annotation
from rsfstudy.errors import CallError, DataError, IncompleteWarning, InvalidValue, RsfStudyError
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.measures import Measure
from rsfstudy.quantities import HtmlText
from rsfstudy.reductions import ClosedFormRatio, LinearFit, PowerLaw, Range
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.responses.velocity_step import VelocityStep

ROOT = Path(__file__).resolve().parents[1]

RIG = Rig(normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s")
ENDLESS = range(10**12)
STEP = ROOT / "studies/pages/step.csv"
#: An array with a dimension that the reductions below do not expect.
ARRAY = xr.DataArray([1.0, 2.0], dims="x")


@pytest.fixture(scope="module")
def record():
    """Create a record of ten rows at constant velocity."""
    time = np.arange(10.0)
    return rsfstudy.read_record({"time": time, "displacement": time, "friction": np.ones(10)})


@pytest.fixture(scope="module")
def dataset():
    """Create results with two cells."""
    study = study_of("pair", LinearStability(), Axis("b_over_a", [2.0, 3.0]))
    return rsfstudy.run(study, output=None, workers=0, progress=False)


def public_classes() -> list[type]:
    """Return the public classes, and the classes of returned objects."""
    found = {getattr(rsfstudy, name) for name in rsfstudy.__all__}
    found |= {getattr(reductions, name) for name in reductions.__all__}
    exported = (getattr(measures, name) for name in measures.__all__)
    found |= {m for m in exported if inspect.isclass(m) and issubclass(m, Measure)}
    record = rsfstudy.read_record({"time": [0.0, 1.0], "displacement": [0, 1], "friction": [1, 1]})
    loadings = [rsfstudy.protocol([{"velocity": 2.0}])]
    loadings.append(rsfstudy.history({"time": [0.0, 1.0], "velocity": [1.0, 2.0]}))
    found |= {type(thing) for thing in (record, *loadings)}
    shipped = [c for c in found if inspect.isclass(c) and c.__module__.startswith("rsfstudy")]
    return sorted(shipped, key=lambda kind: kind.__qualname__)


# ---- what is within the boundary -----------------------------------------------------------------
@pytest.mark.parametrize("kind", public_classes(), ids=lambda kind: kind.__qualname__)
def test_constructors_and_methods_are_within_the_boundary(kind):
    for name, member in vars(kind).items():
        method = getattr(member, "__func__", member)
        if inspect.isfunction(method) and not name.startswith("_"):
            assert isinstance(member, staticmethod) or hasattr(method, "__wrapped__"), name
    with pytest.raises(RsfStudyError):
        kind(**{"\x1b[31m": 1})


def test_functions_are_within_the_boundary():
    for name in rsfstudy.__all__:
        if inspect.isfunction(function := getattr(rsfstudy, name)) and name != "simulate":
            with pytest.raises(CallError, match=rf"{name}\(\) .* Parameters:"):
                function(*[None] * 40)


def test_a_guarded_object_can_be_pickled(record):
    for thing in (record, RIG, Segment(1.0), Range("z", of="x"), Axis("a", [0.1])):
        assert pickle.loads(pickle.dumps(thing)) == thing


def test_calls_from_inside_rsfstudy_keep_the_original_exception():
    inner = raise_only_rsfstudy_errors(lambda: {}["a"])
    with pytest.raises(InvalidValue, match="failed for these arguments"):
        inner()
    caller = {"__name__": "rsfstudy.somewhere", "inner": inner}
    exec("def call(): return inner()", caller)
    with pytest.raises(KeyError):
        caller["call"]()


# ---- errors of signatures ------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda d: d.rsf.plot(varible="zeta"), "'varible'. Did you mean 'variable'. Parameters:"),
        (lambda d: d.rsf.to_si(x=1), r"to_si\(\) .*'x'. Parameters: dataset, normal_stress"),
        (lambda d: LinearFit("z", of="x", onn="y"), "'onn'.* Did you mean 'on'"),
        (lambda d: Segment(1.0, duratoin=2.0), "'duratoin'.* Parameters: load_velocity"),
        (lambda d: RIG.axis(units=5), r"axis\(\) .*'dimension'. Parameters: dimension"),
        (lambda d: rsfstudy.recompute_cell("x", {}, studdy=1), "Did you mean 'study'"),
        (lambda d: rsfstudy.check(d, **{"\x1b[31m": 1}), r"'\\x1b\[31m'"),
    ],
)
def test_a_call_that_does_not_fit_lists_the_parameters(call, message, dataset):
    with pytest.raises(CallError, match=message) as error:
        call(dataset)
    assert isinstance(error.value, TypeError)
    assert str(error.value).isprintable()


# ---- arguments of another type -------------------------------------------------------------------
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: r.window("5 s", "9 s"), "'start' must be a number"),
        (lambda r: r.with_steps([(1, 2)]), r"'step' must consist of the beginning, .*got \(1, 2\)"),
        (lambda r: r.with_steps(7), "'steps' must be a list"),
        (
            lambda r: rsfstudy.fit("rec.csv"),
            "'record' must be a Record .got 'rec.csv'.. .*read_record",
        ),
        (
            lambda r: rsfstudy.fit(r, laws="slip", stiffness=1e-3),
            r"'laws' must be a list.*'slip'.*\['slip'\]",
        ),
        (lambda r: RIG.axis("slip_distance", ["1 um"], units=5), "'units' must be a mapping"),
        (lambda r: RIG.in_units("x"), "'dataset' must be an xarray.Dataset"),
        (lambda r: Scene().with_segment(None), "segment must be a rsfstudy.Segment"),
        (
            lambda r: rsfstudy.protocol([{"velocity": 2.0}]).describe_load_point_reversal(9),
            "index = 9 is out of",
        ),
        (lambda r: Figure(panels=int), "'panels' must be a list"),
        (lambda r: Panel(x=5), "'x' must be a string or a function"),
        (lambda r: Panel(hue="law"), "'hue' must be a list"),
        (lambda r: Panel(log="z"), "'log' must contain only x and y"),
        (lambda r: Segment("a"), "load_velocity must be a number"),
        (
            lambda r: ClosedFormRatio("z", of="x", form=np.ones(3)),
            "'form' must be a string .got array",
        ),
        (lambda r: LinearFit("z", of=None, on="x"), "'of' must be a string"),
        (
            lambda r: reductions.apply_reductions(r, ()),
            "'dataset' must be an xarray.Dataset .got <Record",
        ),
        (lambda r: rsfstudy.run("a" * 300), "study 'aaa.*at most 255 bytes"),
        (
            lambda r: rsfstudy.history({"time": [0, 1], "velocity": "="}),
            "'velocity' must be a list of numbers .got '='",
        ),
        (lambda r: study_of("s", LinearStability(), Axis("a", [0.1])).scene(-1), "number = -1 is"),
        (
            lambda r: rsfstudy.read_record({"time": np.datetime64("2020")}),
            "'time' must have one dim",
        ),
        (lambda r: rsfstudy.Accuracy().with_rtol(np.timedelta64(1)), "'rtol' must be a number"),
        (
            lambda r: Rig(normal_stress=None, slip_distance=1e-5, reference_velocity=1e-6),
            "normal_stress is required",
        ),
        (
            lambda r: rsfstudy.simulate(
                Scene(stiffness_ratio=5e-324, load_velocity_ratio=2.0), duration=0.1
            ),
            "stiffness_ratio = 5e-324 is so small",
        ),
        (lambda r: Scene(a=np.timedelta64(1, "s")), "'a' must be a number"),
        (
            lambda r: Axis("a", [0.1]).with_rows(np, {}),
            "'rows' must be a list.*got <module 'numpy'",
        ),
        (lambda r: Figure(panels=np.ndarray), "'panels' must be a list .got <class"),
        (lambda r: rsfstudy.read_table(STEP, {"time": 5}), "column must be a heading, or"),
        (
            lambda r: rsfstudy.read_table(STEP, {"time": []}),
            r"column must be a heading, or",
        ),
        (lambda r: rsfstudy.read_table(STEP, {"time": ("a", "s", "x")}), "must be a heading, or"),
        (
            lambda r: rsfstudy.read_table(STEP, xr.Dataset({"time": 1.0})),
            "column must be a heading.*got <DataArray",
        ),
        (
            lambda r: reductions.Mean("z", of="x").compute_value_and_stderr(ARRAY),
            "sample_values has no dimension 'sample' .got <DataArray>.. Ch",
        ),
        (lambda r: PowerLaw("z", of="x", on="y").centre_values(ARRAY, "y"), "has no dimension 'y'"),
        (
            lambda r: reductions.Difference("z", of="x", along="y").get_status_of_used_cells(ARRAY),
            "no dimension 'y'",
        ),
        (
            lambda r: rsfstudy.run("rate_step_boundary", alpha=[{}], output=None, workers=0),
            "'alpha' must be a number, a string",
        ),
    ],
)
def test_the_argument_is_named(call, message, record):
    with pytest.raises(InvalidValue, match=message) as error:
        call(record)
    assert "failed for these arguments" not in str(error.value)


@pytest.mark.parametrize(
    "call",
    [
        lambda: rsfstudy.run("limit_cycles", dilatancy=ENDLESS),
        lambda: Figure(panels=ENDLESS),
        lambda: Axis("b_over_a", ENDLESS),
        lambda: Axis("b_over_a", np.broadcast_to(2.0, 10**10)),
        lambda: rsfstudy.protocol(ENDLESS),
        lambda: Axis("x", {"a": {"b_over_a": 2.0}, "b": {"b_over_a": ENDLESS}}),
        lambda: Axis.samples({"a": 0.01}, 2**40, covariance=[[1e-6]]),
    ],
)
def test_a_list_without_end_is_refused(call):
    with pytest.raises(InvalidValue, match=f"{MAX_ITEMS_OF_LIST_ARGUMENT:,}"):
        call()


def test_a_function_of_the_user_that_fails_is_named(dataset):
    def draw(dataset, axes):
        raise ZeroDivisionError("no")

    with pytest.raises(
        InvalidValue, match="user_figure = <function .*raised an error when it was called .*: no"
    ):
        rsfstudy.plot(dataset, user_figure=draw)


def test_what_a_dataset_lacks_is_named(dataset):
    with pytest.raises(DataError, match="has no 'status'") as error:
        dataset.drop_vars("status").rsf.failures()
    assert isinstance(error.value.__cause__, KeyError)


def test_a_name_of_a_study_leaves_room_for_endings():
    with pytest.raises(InvalidValue, match="at most 200 bytes"):
        study_of("a" * 201, LinearStability(), Axis("b_over_a", [2.0]))


# ---- annotations ---------------------------------------------------------------------------------
def test_numbers_and_lists_of_numpy_match():
    from collections.abc import Callable, Mapping, Sequence

    assert matches_annotation(np.float32(1), float)
    assert matches_annotation(np.int8(1), int)
    assert matches_annotation(np.ones(3), Sequence[float])
    assert matches_annotation([0, None], tuple[float | None, float | None])
    assert matches_annotation({"a": [1]}, Mapping[str, Sequence[int]])
    assert matches_annotation(len, Callable[[str], int])
    for value, annotation in [
        (True, float), (1.5, int), ("ab", Sequence[str]), (np.array(1.0), Sequence[float]),
        ([1.0], tuple[float, float]), ({1: 2}, Mapping[str, int]), (None, str | int), (int, int),
    ]:  # fmt: skip
        assert not matches_annotation(value, annotation), annotation
    assert not matches_annotation(xr.Dataset({"a": 1.0}), Mapping[str, object])


def test_constructors_convert_numpy_numbers():
    measure = VelocityStep(phases=np.int8(3), record=np.float32(2.5))
    assert measure.scalar_field_values == {"step_number": 1, "record": 2.5, "phases": 3}
    assert {type(value) for value in measure.scalar_field_values.values()} == {int, float}
    assert type(LinearFit("z", of="x", on="y", within=(0.0, 1.0)).within) is tuple
    assert type(Panel(markers_only=np.True_).markers_only) is bool


def test_types_are_described_in_words():
    from collections.abc import Sequence

    assert describe_type(str | None) == "a string or None"
    assert describe_type(Sequence[int]) == "a list in which each item is a whole number"
    assert describe_type(xr.Dataset) == "an xarray.Dataset"


# ---- control characters --------------------------------------------------------------------------
ESCAPE = "\x1b]0;x\x07\x1b[31m"


def test_headings_of_html_are_spelt_out():
    shown = HtmlText.format_table([f"zeta ({ESCAPE})"], [[ESCAPE]], ESCAPE)
    assert shown.isprintable()
    assert shown.count("x1b[31m") == 3


def test_warnings_are_spelt_out():
    assert str(IncompleteWarning(ESCAPE)).isprintable()


def test_headings_of_the_terminal_are_spelt_out(dataset, tmp_path, capsys):
    from rsfstudy.cli.table_layout import print_table_or_sentence
    from rsfstudy.reporting.text_tables import TextTable

    rows = [{f"zeta ({ESCAPE})": "1", "why": "x" * 60}]
    print_table_or_sentence(TextTable(rows, caption=ESCAPE, wrappable_columns={"why"}))
    print_table_or_sentence({ESCAPE: "1"})
    wide = {f"{n} {ESCAPE}": "y" * 30 for n in range(5)}
    print_table_or_sentence(TextTable([wide]))  # This table is too wide and is printed as a list.
    assert all(c.isprintable() or c == "\n" for c in capsys.readouterr().out)
