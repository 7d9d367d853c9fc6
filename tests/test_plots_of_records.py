"""Tests of the figure and the text that show a record before it is fitted."""

from pathlib import Path

import numpy as np
import pytest
from study_runs import call_main

import rsfstudy
from rsfstudy.errors import InvalidValue

PAGES = Path(__file__).parents[1] / "studies" / "pages"


@pytest.fixture(scope="module")
def step():
    return rsfstudy.read_record(PAGES / "step.csv", normal_stress="20 MPa")


@pytest.fixture(scope="module")
def holds():
    return rsfstudy.read_record(PAGES / "holds.csv")


def list_step_positions(axes):
    return [line.get_xdata()[0] for line in axes.lines if line.get_label() == "step"]


def test_the_text_of_a_record_is_short(step, holds):
    assert repr(step) == (
        "<Record 'step': 600 rows from 0 to 439 s; time (s), displacement (um), friction, "
        "normal_stress (Pa); 2 steps>"
    )
    assert str(holds).startswith("<Record 'holds': 2,050 rows from 0 to 1799.8 s; time (s)")
    shorter = rsfstudy.read_record(PAGES / "holds.csv", begin="100 s", filter="mean 1 s")
    assert "from 100.6 to 1799.2 s" in repr(shorter)
    assert "mean 1 s" in repr(shorter)


@pytest.mark.parametrize("against", ["time", "displacement"])
def test_the_figure_shows_the_columns_and_the_steps(step, against):
    figure = rsfstudy.plot_record(step, against=against)
    friction, other = figure.axes  # The constant normal stress has no panel.
    x, y = friction.lines[0].get_data()
    np.testing.assert_array_equal(x, step.columns[against])
    np.testing.assert_array_equal(y, step.columns["friction"])
    second = {"time": "displacement", "displacement": "time"}[against]
    np.testing.assert_array_equal(other.lines[0].get_ydata(), step.columns[second])
    starts = [loading_step.start for loading_step in step.loading_steps]
    expected = np.interp(starts, step.time, step.columns[against])
    for axes in figure.axes:
        assert list_step_positions(axes) == pytest.approx(expected)
    assert [text.get_text() for text in friction.texts[-2:]] == ["1", "2"]


def test_holds_are_shaded(holds):
    table = holds.holds()
    axes = rsfstudy.plot_record(holds).axes[0]
    spans = sorted(
        (patch.get_x(), patch.get_x() + patch.get_width())
        for patch in axes.patches
        if patch.get_label() == "hold"
    )
    assert len(spans) == table.sizes["hold"] == 5
    middle = (table["begins"] + 0.5 * table["duration"]).values
    assert all(start < at < end for (start, end), at in zip(spans, middle, strict=True))


def test_a_varying_normal_stress_has_a_panel(step):
    columns = {**step.columns, "normal_stress": 2e7 + 1e4 * np.arange(len(step))}
    figure = rsfstudy.plot_record(rsfstudy.fitting.Record(columns))
    assert figure.axes[2].lines[0].get_ydata()[:2] == pytest.approx([20.0, 20.01])


def test_the_command_plots_a_record(tmp_path):
    file = tmp_path / "my.step.csv"
    file.write_bytes((PAGES / "step.csv").read_bytes())
    ran = call_main("plot", file, "--normal-stress", "20 MPa", "--figure", "svg")
    assert ran.returncode == 0, ran.stderr
    assert "</svg>" in (tmp_path / "my.step.svg").read_text()
    ran = call_main("plot", file)
    assert "no column for normal stress" in ran.stderr
    ran = call_main("plot", "stability_map", "--normal-stress", "20 MPa")
    assert ran.returncode == 2
    assert "--normal-stress can only be used with a record" in ran.stderr


def test_other_functions_name_the_function_for_records(step):
    with pytest.raises(InvalidValue, match=r"<Record 'step': 600 rows.*plot_record\(record\)"):
        rsfstudy.plot(step)
    with pytest.raises(InvalidValue, match="must be a record"):
        rsfstudy.plot_record(step.to_dataset())
    with pytest.raises(InvalidValue, match="Choices: time, displacement"):
        rsfstudy.plot_record(step, against="slip")


def test_the_time_axis_of_a_protocol_does_not_mention_a_single_step():
    rig = rsfstudy.Rig(
        normal_stress="20 MPa", stiffness="0.04 MPa/um", slip_distance="12 um",
        reference_velocity="1 um/s",
    )  # fmt: skip
    step = rig.scene(a=0.01, b=0.013, normal_stress="constant", load_velocity="10 um/s")
    velocities = ["1 um/s", "10 um/s", "1 um/s"]
    loading = rig.protocol([{"velocity": v, "duration": "1 s"} for v in velocities])
    protocol = rig.scene(a=0.01, b=0.013, normal_stress="constant", loading=loading)
    labels = [
        rsfstudy.simulate(scene, duration=rig.dimensionless("3 s"))
        .rsf.plot(against="time").axes[1].get_xlabel()
        for scene in (step, protocol)
    ]  # fmt: skip
    assert labels == ["Time since the step ($D_c/V_*$)", "Time ($D_c/V_*$)"]
