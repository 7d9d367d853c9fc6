"""Tests of progress reports: lines in a log file, or a bar in a terminal."""

import io
import itertools

import pytest
from study_runs import call_main

from rsfstudy.api import progress

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


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_quiet_is_quiet(stream, monkeypatch):
    assert told(stream, monkeypatch, [0, 10], show=False) == ""


def test_the_command_tells_it_on_the_standard_error(tmp_path):
    ran = call_main(*RUN, "--set", "b_over_a=2,3", "--output", tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert "rate_step_boundary: 2 of 2 cells after" in ran.stderr
    assert "cells after" not in ran.stdout
