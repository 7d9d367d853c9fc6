"""Tests of progress reports: lines in a log file, or a bar in a terminal."""

import io
import itertools

import pytest
from study_runs import call_main

import rsfstudy
from rsfstudy.api import progress
from rsfstudy.cli import figure_files
from rsfstudy.execution import worker_pool

RUN = ("run", "rate_step_boundary", "--serial", "--set", "case=constant normal stress")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def told(stream: io.StringIO, monkeypatch, done: list[int], show: bool = True) -> str:
    monkeypatch.setattr("sys.stderr", stream)
    with progress.show_progress("holds", show) as update:
        for count in done:
            update(count, done[-1], None)
    return stream.getvalue()


@pytest.fixture
def clock(monkeypatch):
    """Return a function that simulates a clock with constant increments."""

    def goes(by):
        monkeypatch.setattr(progress.time, "monotonic", itertools.count(0.0, by).__next__)

    return goes


@pytest.mark.parametrize(("by", "lines"), [(0.005, 1), (0.11, 10), (5.0, 10)])
def test_lines_are_few(by, lines, monkeypatch, clock):
    """A short run prints its last line, and a long run at most ten lines."""
    clock(by)
    said = told(io.StringIO(), monkeypatch, [0, *range(1001), 1000]).splitlines()
    assert len(said) == lines
    assert said[-1].startswith("holds: 1,000 of 1,000 cells")


def test_a_terminal_gets_a_bar(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    said = told(Terminal(), monkeypatch, [0, 5, 10])
    assert "\x1b[" in said
    assert "10/10" in said


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_cells_of_an_earlier_run_are_counted(stream, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    said = told(stream(), monkeypatch, [3, 5, 10])
    assert said.count("holds: 3 of 10 cells were stored by an earlier run") == 1
    assert "stored" not in told(stream(), monkeypatch, [0, 5, 10])


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_quiet_is_quiet(stream, monkeypatch):
    assert told(stream, monkeypatch, [0, 10], show=False) == ""


def test_the_command_tells_it_on_the_standard_error(tmp_path):
    ran = call_main(*RUN, "--set", "b_over_a=2,3", "--output", tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert "rate_step_boundary: 2 of 2 cells after" in ran.stderr
    assert "cells after" not in ran.stdout


def test_the_command_counts_the_cells_of_an_earlier_run(tmp_path):
    """The number is printed when the run resumes, and next to the count of evaluations."""
    once = call_main(*RUN, "--set", "b_over_a=2,3", "--output", tmp_path)
    assert "earlier run" not in once.stdout + once.stderr
    again = call_main(*RUN, "--set", "b_over_a=2,3,4", "--output", tmp_path)
    line = "2 of 3 cells were stored by an earlier run"
    assert f"rate_step_boundary: {line}\n" in again.stderr
    assert f"{line}, and the evaluations include these cells\n" in again.stdout


@pytest.mark.parametrize("place", ["the figure", "the workers"])
def test_an_interrupt_at_the_end_names_the_complete_file(place, tmp_path, monkeypatch):
    """The interrupt arrives after the results were written."""

    def interrupt(*_args, **_options):
        raise KeyboardInterrupt

    if place == "the figure":
        monkeypatch.setattr(figure_files, "draw_and_save_figure", interrupt)
    else:
        monkeypatch.setattr(worker_pool.WorkerPool, "__exit__", interrupt)
    ran = call_main(*RUN, "--set", "b_over_a=2", "--output", tmp_path)
    file = tmp_path / "rate_step_boundary.nc"
    assert ran.returncode == 1
    words = f"interrupted after the results were written. {file} is complete"
    assert words in " ".join(ran.stderr.split())
    assert rsfstudy.open(file).attrs["completeness"] == "complete"
    assert not (tmp_path / "rate_step_boundary.partial.nc").exists()
