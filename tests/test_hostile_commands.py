"""Tests of command lines with unusual paths, numbers and texts.

The tests also cover the fuzzer of command lines.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import sys
from pathlib import Path

import pytest
from fuzz_commands import STUDIES, Answer, Line, damage_files, draw_line, faults
from study_runs import call_main, run_command

from rsfstudy.cli import command_line
from rsfstudy.cli.command_line import cli
from rsfstudy.cli.console_output import LiteralTextConsole

LONG = "x" * 300
TOO_LONG = "must have at most 255 bytes in each part"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("export '' --csv", "file = '' is empty. Pass the path of"),
        ("export . --csv", ". is a directory"),
        ("export .. --csv", ".. is a directory"),
        ("export motion.nc --csv --output .", "'--output': File '.' is a directory"),
        ("export motion.nc --csv --output ''", "--output = '' is empty"),
        (f"export {LONG}.nc --csv", TOO_LONG),
        (f"simulate --output {LONG}.png", TOO_LONG),
        (f"simulate --protocol {LONG}.csv", TOO_LONG),
        (f"run stresses.py --output {LONG}", TOO_LONG),
        (f"fit {LONG}.csv", TOO_LONG),
        (
            f"verify 01.csv --problem {LONG}.toml",
            "cannot be used as the path of a file: File name too",
        ),
        ("report . --output ''", "--output = '' is empty"),
        ("report . --output .", "'--output': File '.' is a directory"),
        (f"report . --output {LONG}.html", TOO_LONG),
        ("problems ''", "is empty. Pass the path of a file or a directory"),
        (f"problems {LONG}", TOO_LONG),
        (f"run {LONG}", TOO_LONG),
        (f"show {LONG}", TOO_LONG),
        (f"show {LONG}.py", TOO_LONG),
        (f"check {LONG}", TOO_LONG),
        (f"compare {LONG}.nc motion.nc", TOO_LONG),
        ("fit /proc/self/mem", "/proc/self/mem: cannot be read: Input/output error"),
        ("rerun ''", "file = '' is empty"),
        ("plot motion.nc --output ''", "--output = '' is empty"),
    ],
)
def test_paths_are_refused_by_a_rule(words, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("motion.nc").touch()
    if "/proc" in words and not Path("/proc/self/mem").exists():
        pytest.skip("only Linux has a file that opens and cannot be read")
    status, said = run_command(shlex.split(words))
    assert message in said.replace(" x", "x")
    assert "Error:" not in said.replace("Error: Invalid", "").removeprefix("error:")
    assert status in (1, 2)
    assert os.listdir() == ["motion.nc"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            f"simulate --budget {10**30}",
            "'budget' must be a whole",
        ),
        (f"run rate_step_boundary --serial --budget {10**16}", "from 1 to 1,000,000,000,000,000"),
        (f"fit record.csv --step 1 --windows {10**12}", "'windows' must be a whole"),
        (f"fit record.csv --step 1 --posterior {10**12}", "'posterior' must be a"),
    ],
)
def test_numbers_are_bounded_before_memory_is_allocated(words, message, tmp_path, monkeypatch):
    step = STUDIES / "pages" / "step.csv"
    monkeypatch.chdir(tmp_path)
    Path("record.csv").write_bytes(step.read_bytes())
    options = ["--normal-stress", "20 MPa", "--stiffness", "0.04 MPa/um"] * ("fit" in words)
    status, said = run_command([*shlex.split(words), *options])
    assert (status, message in said) == (2, True), said
    assert os.listdir() == ["record.csv"]


@pytest.mark.parametrize(
    "words",
    [
        "simulate --output pipe.png",
        "fit record.csv --output data.png",
        "plot motion.nc --output pipe.png",
        "verify 01.csv --figure pipe.svg",
        "report . --output pipe.html",
    ],
)
def test_pipes_are_neither_read_nor_replaced(words, tmp_path, monkeypatch):
    """Commands reject pipes as output files without opening them."""
    monkeypatch.chdir(tmp_path)
    pipes = ("pipe.png", "pipe.svg", "pipe.html", "data.nc")
    for name in pipes:
        os.mkfifo(name)
    status, said = run_command(shlex.split(words))
    assert (
        status,
        "is a directory, a pipe or a device. Pass the path of a regular file." in said,
    ) == (2, True)
    assert all(Path(name).is_fifo() for name in pipes)


@pytest.mark.parametrize("words", [["--\x1b[2J"], ["list", "\x1b[2J"], ["show", "a", "\x9b2J"]])
def test_usage_errors_print_no_control_characters(words):
    ran = call_main(*words)
    assert ran.returncode == 2
    assert all(c.isprintable() or c == "\n" for c in ran.stderr)


def test_a_full_disk_is_named_whatever_prints(monkeypatch):
    """The error is also caught if Click itself prints the output."""
    said = io.StringIO()
    with open("/dev/full", "w") as full, monkeypatch.context() as patch:
        patch.setattr(sys, "argv", ["rsfstudy", "list"])
        patch.setattr(sys, "stderr", said)
        patch.setattr(sys, "stdout", full)
        with pytest.raises(SystemExit) as ended:
            command_line.main()
        patch.undo()
        with contextlib.suppress(OSError):
            full.flush()
    text = " ".join(said.getvalue().split())
    assert text.startswith("error: rsfstudy list: No space left on device. Check that")
    assert ended.value.code == 1


@pytest.mark.parametrize(
    ("columns", "width"), [("0", 16), ("1", 16), ("120", 120), ("9" * 11, 1000)]
)
def test_any_width_of_the_environment_is_bounded(columns, width):
    printed = LiteralTextConsole(file=io.StringIO(), _environ={"COLUMNS": columns})
    assert printed.width == width
    printed.print("a study")
    assert printed.file.getvalue() == "a study\n"


# ---- the fuzzer ----------------------------------------------------------------------------------


def test_the_fuzzer_uses_every_command_and_every_option():
    lines = [draw_line(1, index) for index in range(4000)]
    assert lines[:50] == [draw_line(1, index) for index in range(50)]
    for name, command in cli.commands.items():
        of_it = [line.words for line in lines if line.words and line.words[0] == name]
        words = {word.partition("=")[0] for words in of_it for word in words}
        for param in command.params:
            if param.param_type_name == "option" and (name, param.name) != ("run", "every"):
                assert {*param.opts} & words, (name, param.name)


@pytest.mark.parametrize(
    ("answer", "kinds"),
    [
        (Answer(0, "wrote x\n", 0.1), []),
        (Answer(2, "error: study 'x' is unknown.\n", 0.1), []),
        (Answer(2, "study.py raises RuntimeError: no\n", 0.1), []),
        (Answer(70, "", 0.1), ["status 70"]),
        (Answer(-9, "", 20.0, hangs=True), ["hang"]),
        (Answer(1, "Traceback (most recent call last):\n", 0.1), ["traceback"]),
        (Answer(0, "a\x1b[31mb", 0.1), ["control '\\x1b'"]),
        (Answer(2, "fit failed for these arguments (TypeError: x)", 0.1), ["catch-all"]),
        (Answer(2, "cannot be read (KeyError: 'x')", 0.1), ["raw KeyError:"]),
    ],
)
def test_the_fuzzer_reports_bad_answers(answer, kinds):
    assert list(faults(Line(("list",), terminal=False), answer)) == kinds


def test_colours_of_a_terminal_are_no_fault_and_other_escapes_are():
    line = Line(("list",), terminal=True)
    assert not list(faults(line, Answer(0, "\x1b[1;31mred\x1b[0m\r\n", 0.1)))
    assert list(faults(line, Answer(0, "\x1b]0;title\x07", 0.1)))


def test_files_are_damaged_only_where_a_line_names_them(tmp_path, monkeypatch):
    import random

    monkeypatch.chdir(tmp_path)
    Path("outputs").mkdir()
    for name in ("tiny.py", "outputs/tiny.cells.sqlite"):
        Path(name).write_bytes(bytes(range(256)))
    damage_files(["show", "damaged_study.py"], random.Random(2))
    assert Path("damaged_study.py").read_bytes() != Path("tiny.py").read_bytes()
    assert not re.search("damaged_record", " ".join(os.listdir()))
