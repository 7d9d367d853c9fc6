"""Tests of the choices of the record view, of their code, and of the thinning to pixels."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from study_runs import call_main

import rsfstudy
from rsfstudy.errors import InvalidValue
from rsfstudy.explorer.fit_choices import FitChoices, format_fit_command
from rsfstudy.explorer.pixel_thinning import thin_curve_to_pixels
from rsfstudy.explorer.scene_settings import format_python_call, format_values_as_python_code

STEP = Path(__file__).parent.parent / "studies" / "pages" / "step.csv"


@pytest.fixture(scope="module")
def record():
    """Return a record with steps at 100 s and 140 s."""
    return rsfstudy.read_record(STEP, normal_stress="20 MPa")


def test_thinning_keeps_each_spike_of_a_long_curve():
    rows = 300_000
    x = np.arange(rows) * 1e-3
    y = np.zeros(rows)
    spikes = np.array([17, 123_456, 299_999])
    y[spikes] = 1.0, -2.0, 3.0
    thin_x, thin_y = thin_curve_to_pixels(x, y, (x[0], x[-1]), 500)
    assert len(thin_x) == len(thin_y) <= 1000
    assert (thin_y.min(), thin_y.max()) == (-2.0, 3.0)
    pixel = (x[-1] - x[0]) / 500
    for row in spikes:
        assert np.abs(thin_x[thin_y == y[row]] - x[row]).min() <= pixel


def test_thinning_returns_all_rows_of_a_short_range():
    x = np.linspace(0.0, 10.0, 100_001)
    y = np.sin(x)
    thin_x, thin_y = thin_curve_to_pixels(x, y, (5.0, 5.01), 500)
    assert thin_x[0] < 5.0
    assert thin_x[-1] > 5.01
    assert len(thin_x) < 110
    np.testing.assert_array_equal(thin_y, np.sin(thin_x))


def test_thinning_of_a_rising_and_of_a_falling_curve_is_monotonic():
    x = np.linspace(0.0, 1.0, 50_000)
    for sign in (1.0, -1.0):
        _x, y = thin_curve_to_pixels(x, sign * x, (0.0, 1.0), 200)
        assert (sign * np.diff(y) > 0.0).all()


def test_thinning_accepts_displacement_that_moves_back():
    x = np.linspace(0.0, 1000.0, 20_000) + np.random.default_rng(0).normal(0.0, 0.5, 20_000)
    y = np.arange(20_000.0)
    thin_x, thin_y = thin_curve_to_pixels(x, y, (x.min(), x.max()), 300)
    assert len(thin_x) <= 600
    assert (thin_y[0], thin_y[-1]) == (0.0, 19_999.0)
    assert (np.diff(thin_y) > 0.0).all()


def test_arguments_contain_only_what_the_user_chose(record):
    steps = record.loading_steps
    assert FitChoices().build_fit_arguments(steps) == {"laws": ["slip", "slowness"]}
    choices = FitChoices(
        normal_stress="20 MPa", begin=20.0, excluded=(140.0,), stiffness="2e-3 1/um", after="60 um"
    )
    assert choices.build_read_record_arguments() == {"normal_stress": "20 MPa"}
    assert choices.build_window_limit_arguments() == {"begin": "20 s"}
    assert choices.build_fit_arguments(steps) == {
        "laws": ["slip", "slowness"],
        "steps": [1],
        "stiffness": "2e-3 1/um",
        "after": "60 um",
    }


def test_free_parameters_are_those_of_the_laws():
    one = FitChoices(laws=("slip",), trend_degree=0, more_free=("stiffness",))
    assert one.build_fit_arguments(())["free"] == [
        "a",
        "b",
        "slip_distance",
        "mu_star",
        "stiffness",
    ]
    both = FitChoices(laws=("slip", "two_slip_states"), trend_degree=2)
    assert {"b", "b1", "slip_distance_2", "trend2"} <= {*both.build_fit_arguments(())["free"]}
    assert "free" not in FitChoices(laws=("two_slip_states",)).build_fit_arguments(())


def test_an_excluded_step_is_found_again_in_another_window(record):
    choices = FitChoices(excluded=(140.0,), begin=110.0)
    window = choices.extract_fit_window(record)
    assert [round(step.start) for step in window.loading_steps] == [140]
    assert choices.find_excluded_step_numbers(window.loading_steps) == [1]
    earlier = FitChoices(excluded=(140.0,), end=135.0)
    window = earlier.extract_fit_window(record)
    assert [round(step.start) for step in window.loading_steps] == [100]
    assert earlier.find_excluded_step_numbers(window.loading_steps) == []


def test_choices_without_law_or_step_or_with_wrong_columns_are_rejected(record):
    with pytest.raises(InvalidValue, match="at least one law"):
        FitChoices(laws=()).build_fit_arguments(record.loading_steps)
    with pytest.raises(InvalidValue, match="Include a step"):
        FitChoices(excluded=(100.0, 140.0)).build_fit_arguments(record.loading_steps)
    with pytest.raises(InvalidValue, match="NAME=HEADING"):
        FitChoices(columns="time").build_read_record_arguments()
    with pytest.raises(InvalidValue, match="not a choice of this view"):
        FitChoices.from_widget_state({"stifness": "2e-3 1/um"})


def test_a_state_survives_json():
    choices = FitChoices(excluded=(140.0,), laws=("slip",), end=3.5, more_free=("step_time",))
    assert FitChoices.from_widget_state(json.loads(json.dumps(choices.__dict__))) == choices


def test_the_code_of_lists_and_mappings_is_python():
    keywords = {"columns": {"time": 't "raw" (s)'}, "together": True, "steps": [1, 2], "name": "µ"}
    received = {}
    text = format_python_call("read", format_values_as_python_code(keywords), "source")
    exec(text, {"read": lambda _source, **given: received.update(given), "source": None})
    assert received == keywords


def test_the_command_line_makes_the_same_fit(record, tmp_path, monkeypatch):
    columns = "time=Time (s), displacement=LP displacement (um), shear_stress=Shear stress (MPa)"
    choices = FitChoices(
        columns=columns, normal_stress="20 MPa", begin=60.0, excluded=(140.0,),
        laws=("slowness",), stiffness="0.04 MPa/um", trend_degree=0, after="60 um", noise="ar1",
    )  # fmt: skip
    window = choices.extract_fit_window(record)
    fitting = choices.build_fit_arguments(window.loading_steps)
    command = format_fit_command(
        str(STEP),
        choices.build_read_record_arguments() | choices.build_window_limit_arguments() | fitting,
    )
    monkeypatch.chdir(tmp_path)
    ran = call_main(*shlex.split(command)[1:], "--json")
    assert ran.returncode == 0, ran.stderr
    values = json.loads(ran.stdout)["fits"][0]["parameters"]
    calls = []
    fits = rsfstudy.fit(
        window, progress=lambda done, total, _remaining: calls.append((done, total)), **fitting
    )
    assert {each["name"]: each["value"] for each in values} == {
        each["name"]: fits[each["name"]].item() for each in values
    }
    assert "trend1" not in fits
    assert (calls[0], calls[-1]) == ((0, 1), (1, 1))
