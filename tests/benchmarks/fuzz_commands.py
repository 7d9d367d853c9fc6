"""Fuzzer of the command line.

Usage: ``python tests/benchmarks/fuzz_commands.py --seed N --count N``. The script generates random
command lines from all commands and options. It reads the commands from click, so new commands are
included. Values are valid, junk or hostile. Each command line runs in a forked process, whose
output goes to a pipe or to a terminal with 80 columns. The working directory is a new copy of a
directory with results, records, damaged files, directories, links and devices.

The script reports tracebacks, hangs, control characters, exit statuses other than 0 to 3, and
messages that only name a Python exception. ``--case SEED:INDEX`` runs one command line and prints
its output. The exit status is 1 if the script reported a problem.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import fcntl
import gc
import json
import os
import pty
import random
import re
import resource
import select
import shlex
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click

from rsfstudy.cli.command_line import cli

STUDIES = Path(__file__).parents[2] / "studies"
#: Columns of the terminal.
TERMINAL_WIDTH = 80
#: Largest memory and file size of a command, in bytes.
MEMORY_LIMIT, FILE_SIZE_LIMIT = 6 * 2**30, 2**28
#: Documented exit statuses.
EXIT_STATUSES = (0, 1, 2, 3)
#: Wall time limit relative to the CPU time limit, because other processes may use the machine.
PATIENCE = 15.0

# ---- values --------------------------------------------------------------------------------------

ESCAPE = "\x1b]0;title\x07\x1b[2J"
LONG_STRING = "x" * 300
NUMBERS = ("1", "2", "0.5", "1e-7", "3", "10", "60", "0.01", "1e-3")
ODD_NUMBERS = (
    "0", "-1", "-0", "nan", "inf", "-inf", "1e400", "1e308", "-1e308", "1e-320", "1e999999999",
    "9" * 400, "0x10", "1_000", "\u0663", "\u00bd", "1,5", "1.2.3", "1e", "+", "1d3", "1+1j",
    "1000000000000", "true", "None", "1 000", "--1", "1e-7x",
)  # fmt: skip
QUANTITIES = (
    "5 MPa", "10 um", "1 um/s", "0.05 MPa/um", "10 ms", "1e4 kg/m^2", "30 GPa", "2700 kg/m^3",
    "1.6e-3 /um", "100 s", "1e-6 m/s", "20 MPa", "10 min",
)  # fmt: skip
ODD_QUANTITIES = (
    "0 MPa", "-5 MPa", "5 mpa", "5MPa", "MPa", "5 MPa MPa", "5 kN", "1e400 Pa", "nan um", "5 degC",
    "1 um^999999999", "1 um^-2/s", "5 " + "M" * 5000, "5 Pa/0", "5 dB", "1 " + "m*" * 2000 + "m",
    "1e-320 s", "5 \u00b5m", "5 m\u00b2", "(5) MPa", "5 __import__('os')", "1 s" + ESCAPE,
    "1e308 GPa",
)  # fmt: skip
RANGES = (
    "1:2:3", "1:100:3:log", "2:1:2", "1:1:1", "1 s:2 s:2", "1:2:3 s",
    "1:2:1000000000000", "1:2:0", "1:2:-3", "1:2", "1:2:3:4:5", ":::", "0:1:3:log", "nan:1:2",
    "1:1e400:2", "-1e308:1e308:3", "1:2:2.5", "a:b:c", "1:2:3:lin", "1:2:" + "9" * 400,
)  # fmt: skip
HOSTILE = (
    "",
    " ",
    "\n",
    "\t",
    "-",
    "--",
    "-x",
    "--x",
    "---",
    "=",
    "==",
    ",",
    ",,",
    ":",
    ".",
    "..",
    "/",
    ESCAPE,
    f"a{ESCAPE}=1",
    "\x9b2J",
    "\x7f",
    "\r",
    "a\nb",
    "\u202e",
    "\u200b",
    "\ufeff",
    "\ue000",
    "\udcff",
    "\udc80.nc",
    "\U0001f600",
    "\u00e9",
    "e\u0301",
    "\u6469\u64e6",
    LONG_STRING,
    LONG_STRING + ".nc",
    LONG_STRING + ".py",
    "y" * 100_000,
    "a/" * 3000,
    "../" * 40,
    "%s%n",
    "{}",
    "{0.__class__}",
    "[bold]",
    "[/]",
    "$HOME",
    "`id`",
    "*",
    "?",
    "~",
    "~root",
    "\\",
    "'",
    '"',
    "None",
    "nan",
    "__class__",
    "os.system",
    "a.b",
    "1;2",
    "<b>",
    "(" * 2000,
    "[" * 2000,
)
READABLE = (
    "outputs/tiny.nc", "outputs/tiny.zarr", "other/tiny.nc", "motion.nc", "rig.nc", "fit.nc",
    "record.csv", "protocol.csv", "step.csv", "tiny.py", "own.toml", "mine.mplstyle",
    "referee/answers/01_velocity_step_slowness.csv", "referee/answers/09_stick_slip.csv",
    "referee/templates/02_velocity_step_slip.csv",
    "referee/problems/01_velocity_step_slowness.toml",
)  # fmt: skip
UNREADABLE = (
    "cut.nc", "flipped.nc", "text.nc", "empty.nc", "plain.nc", "hostile.nc", "empty.csv",
    "text.csv", "hostile.csv", "wide.csv", "binary.csv", "utf16.csv", "deep.toml", "text.toml",
    "bad.mplstyle", "raises.py", "syntax.py", "none.py", "folder", "folder.nc", "folder.csv",
    "folder.zarr",
    "folder.py", "folder.toml", "folder.mplstyle", "missing.nc", "missing.csv", "missing.py",
    "missing", "pipe", "pipe.nc", "pipe.csv", "pipe.toml", "pipe.py", "pipe.mplstyle", "loop.nc",
    "loop.csv", "dangling.nc", "dangling.png", "device.nc", "device.csv", "/dev/null", "/dev/zero",
    "/proc/self/mem", "/proc/self/environ", "/etc/passwd", "/", ".", "..", "tiny.py/under",
    "picture.png",
    "outputs/tiny.cells.sqlite", "broken.zarr",
)  # fmt: skip
OUTPUT_PATHS = (
    "new",
    "new/deep",
    "outputs",
    "out.png",
    "new/out.pdf",
    "out.svg",
    "out.html",
    "out.nc",
    "out",
    "folder",
    "folder.png",
    "picture.png",
    "tiny.py",
    "tiny.py/under",
    "motion.nc",
    "motion.png",
    "pipe",
    "pipe.png",
    "pipe.html",
    "device.png",
    "device.html",
    "dangling.png",
    "loop.png",
    "fit.nc",
    "fit.png",
    "outputs/tiny.nc",
    ".",
    "..",
    "",
    "-",
    "~",
    f"{LONG_STRING}.png",
    LONG_STRING,
    ".png",
    "a.b.png",
    "x\n.png",
    f"{ESCAPE}.png",
    "\udcff.png",
    "out.PNG",
    "out.html/",
    "/",
    "/proc/x/y",
)
FIELD_VALUES = (
    "slip", "slowness", "ageing", "constant", "variable", "imposed", "true", "false", "2", "1.5",
    "0.01", "0.56", "60", "1,2", "constant,variable", "5 MPa", "10 s", "protocol.csv", "record.csv",
    "empty.csv", "device.csv", "missing.csv", "folder.csv", "pipe.csv",
)  # fmt: skip
COLUMNS = (
    "time=t (s),displacement=lp (um),friction=mu", "time=time (s)", "friction=friction",
    "displacement=lp (um) * 0.1 + 5", "time=", "=t", "time", "time=t (furlong)", "time=t,time=t",
    "x=y", ",", "time=t (s", "displacement=lp * 1e400", "displacement=lp * nan + " + "9" * 400,
)  # fmt: skip
#: Files that are damaged before each command that names them, with their originals.
DAMAGED_FILES = {
    "damaged_results.nc": "outputs/tiny.nc", "damaged_motion.nc": "rig.nc",
    "damaged_fit.nc": "fit.nc",
    "damaged_record.csv": "short.csv", "damaged_protocol.csv": "protocol.csv",
    "damaged_answer.csv": "referee/answers/01_velocity_step_slowness.csv",
    "damaged_problem.toml": "own.toml", "damaged_study.py": "tiny.py",
    "damaged_sheet.mplstyle": "mine.mplstyle",
}  # fmt: skip
#: A file that commands read although no argument names it.
JOURNAL_FILE = "outputs/tiny.cells.sqlite"
#: Values of options and arguments by name. Other values follow from the type.
VALUES_BY_PARAMETER: dict[str, tuple[str, ...]] = {
    "name": ("tiny.py", "tiny", "own.py", "linear_stability", "outputs/tiny.nc", "motion.nc"),
    "first": ("outputs/tiny.nc", "other/tiny.nc", "tiny"),
    "second": ("outputs/tiny.nc", "other/tiny.nc", "tiny.py"),
    "file": ("outputs/tiny.nc", "motion.nc", "fit.nc", "rig.nc", "outputs/tiny.zarr"),
    "files": ("referee/answers/01_velocity_step_slowness.csv", "short.csv", "record.csv"),
    "records": ("step.csv", "record.csv", "short.csv"),
    "record": ("step.csv", "record.csv", "rig.nc"),
    "directory": ("outputs", "new", "folder"),
    "claims": ("C1", "C6", "c6"),
    "place": ("case=constant", "load_velocity_ratio=2", "case=none", "b_over_a=2"),
    "study": ("tiny.py", "own.py"),
    "variable": ("critical_stiffness", "growth_rate", "status", "case", "slope"),
    "style": ("mine.mplstyle", "ggplot", "default", "bad.mplstyle", "os.path", "matplotlib.pyplot"),
    "units": ("MPa", "um", "s", "kPa", "mm", "min"),
    "problem": ("1", "2", "24", "0", "99", "own.toml", "deep.toml", "text.toml"),
    "columns": COLUMNS,
    "laws": ("slip", "slowness", "slip,slowness", "slip,,", "family"),
    "free": ("a,b", "a,b,slip_distance,mu_star", "stiffness", "alpha", "a,a", "none"),
    "steps": ("1", "2", "1,2", "3", "0", "1,1", "x"),
    "noise": ("white", "ar", "ar1", "ar2", "ar999999999999", "ar-1", "arx", "pink"),
    "scheduler": ("tcp://127.0.0.1:1", "127.0.0.1:1", "x", "tcp://", "/", "http://x:y:z"),
    "digits": ("6", "1", "12", "nan", "13"),
    "budget": ("2000", "1", "100"),
    "posterior": ("0", "1", "-1"),
    "windows": ("1", "2"),
    "duration": ("1", "10 s", "0", "-1", "1e300"),
    "time_limit": ("10", "0", "-1", "nan", "inf", "1e400"),
    "rtol": ("1e-4", "1e-5", "1e-12", "0.1", "nan"),
}  # fmt: skip
#: Work limits that are added to a command line that does not set them.
WORK_LIMITS = {"budget": ("--budget", "2000"), "posterior": (), "serial": ("--serial",)}
#: Named studies whose cells are fast with a budget of a few hundred evaluations.
CHEAP_STUDIES = (
    "rate_step_boundary", "linear_stability", "rigid_response", "dilatancy", "two_states",
    "laws_zeta", "slide_hold_slide", "velocity_steps", "effects", "injection", "rig_recurrence",
)  # fmt: skip
#: Excluded flags, because they compute all named studies.
EXCLUDED_FLAGS = {("run", "every")}


def field_names() -> tuple[str, ...]:
    """Return names that ``--set`` accepts, and a few unknown names."""
    from rsfstudy.slider import part_registry

    return (
        *part_registry.collect_scene_field_defaults(),
        "case",
        "sample",
        "stiffnes",
        "B_over_a",
        "rtol",
        "numbers",
    )


def draw_value(command: str, param: click.Parameter, chance: random.Random) -> str:
    """Draw a value of an option or argument.

    The value is valid with a probability of at least 0.5.
    """
    kind, name, drawn = param.type, str(param.name), chance.random()
    if drawn < 0.06:
        return mutate_string(chance.choice(HOSTILE), chance)
    if drawn < 0.12 and isinstance(param, click.Argument):
        return chance.choice(tuple(DAMAGED_FILES))
    if name == "settings":
        return draw_setting(chance)
    if (command, name) == ("run", "name") and drawn < 0.4:
        return chance.choice(CHEAP_STUDIES)
    if name in VALUES_BY_PARAMETER and drawn < 0.8:
        return chance.choice(VALUES_BY_PARAMETER[name])
    if isinstance(kind, click.Choice) and drawn < 0.8:
        return str(chance.choice(list(kind.choices)))
    if isinstance(kind, click.types.IntParamType | click.types.FloatParamType):
        return chance.choice(NUMBERS if drawn < 0.5 else ODD_NUMBERS)
    if name in ("output", "figure") and drawn < 0.9:
        return chance.choice(OUTPUT_PATHS)
    if isinstance(kind, click.Path) or name in VALUES_BY_PARAMETER:
        return chance.choice(
            READABLE if drawn < 0.7 else (*UNREADABLE, *DAMAGED_FILES, *DAMAGED_FILES)
        )
    pools = (QUANTITIES, QUANTITIES, ODD_QUANTITIES, ODD_NUMBERS, NUMBERS, UNREADABLE)
    return chance.choice(chance.choice(pools))


def draw_setting(chance: random.Random) -> str:
    """Draw a value of ``--set``."""
    name = chance.choice((*field_names(), *("load_velocity_ratio", "case", "law", "loading") * 6))
    pools = (FIELD_VALUES, FIELD_VALUES, NUMBERS, ODD_NUMBERS, QUANTITIES, ODD_QUANTITIES, RANGES)
    values = [chance.choice(chance.choice(pools)) for _ in range(chance.choice((1, 1, 1, 2, 3)))]
    return chance.choice(("{}={}",) * 12 + ("{}", "{}={}=1", "{} = {}")).format(
        name, ",".join(values)
    )


def mutate_string(text: str, chance: random.Random) -> str:
    """Change one character of a string with a certain probability."""
    if chance.random() < 0.7 or not text or len(text) > 2000:
        return text
    place = chance.randrange(len(text))
    return (
        text[:place] + chance.choice(("", "\x1b", "=", ",", " ", "\u0663", "-")) + text[place + 1 :]
    )


class Line(NamedTuple):
    """Command line, and True if its output goes to a terminal."""

    words: tuple[str, ...]
    terminal: bool


def draw_line(seed: int, index: int) -> Line:
    """Draw the command line of a seed and an index."""
    chance = random.Random(f"{seed}:{index}")
    names = sorted(cli.commands)
    if chance.random() < 0.02:
        words = [chance.choice((*HOSTILE, *names, "--version", "--help")) for _ in range(2)]
    else:
        words = _command_line(chance.choice(names), chance)
    # Arguments of a process cannot contain NUL.
    return Line(tuple(word.replace("\0", "") for word in words), chance.random() < 0.4)


def _command_line(name: str, chance: random.Random) -> list[str]:
    command, words, given = cli.commands[name], list[str](), set[str]()
    params = list(command.params)
    chance.shuffle(params)
    few = chance.choice((0.1, 0.2, 0.4))
    for param in params:
        if (name, param.name) in EXCLUDED_FLAGS:
            continue
        if isinstance(param, click.Argument):
            words += _arguments(name, param, chance)
        elif chance.random() < (few if param.name not in WORK_LIMITS else 0.15):
            given.add(str(param.name))
            words += _option(name, param, chance)
    limits = [
        word
        for param in params
        if param.name not in given and not {"scheduler", "workers"} & given
        for word in WORK_LIMITS.get(str(param.name), ())
    ]
    if chance.random() < 0.06 and words:
        place = chance.randrange(len(words))
        words[place] = mutate_string(chance.choice((words[place], *HOSTILE)), chance)
    if chance.random() < 0.03:
        words.append(chance.choice((*HOSTILE, "--help", "--no-such-option", "-h")))
    return [name, *limits, *words]


def _arguments(name: str, param: click.Argument, chance: random.Random) -> list[str]:
    count = chance.choice((0, 1, 1, 1, 1, 1, 2, 3)) if param.nargs == -1 else param.nargs
    count = 0 if chance.random() < 0.04 else count
    values = [draw_value(name, param, chance) for _ in range(count)]
    if name == "run" and {*values} & {*CHEAP_STUDIES}:
        values += ["--budget", "100", "--set", chance.choice(("law=slip", "mu_star=0.6", "a=0.01"))]
    return values


def _option(name: str, param: click.Parameter, chance: random.Random) -> list[str]:
    spelling = chance.choice(param.opts)
    if getattr(param, "is_flag", False):
        return [spelling]
    words = []
    for _ in range(chance.choice((1, 1, 2)) if param.multiple else 1):
        values = [draw_value(name, param, chance) for _ in range(max(1, param.nargs))]
        if len(values) == 1 and chance.random() < 0.3:
            words.append(f"{spelling}={values[0]}")
        else:
            words += [spelling, *values]
    return words


# ---- files ---------------------------------------------------------------------------------------

TINY_STUDY_SOURCE = """
from rsfstudy import Axis, Scene, Study
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.reductions import LinearFit

study = Study(
    name="tiny", title="A tiny lattice", base=Scene(),
    axes=[
        Axis("case", {"constant": {"normal_stress": "constant"}, "variable": {"alpha": 0.3}}),
        Axis("load_velocity_ratio", [1.0, 2.0, 4.0]),
    ],
    measure=LinearStability(),
    reductions=[LinearFit(name="slope", of="critical_stiffness", on="log_load_velocity_ratio")],
)
"""
USER_STUDY_SOURCE = TINY_STUDY_SOURCE.replace('"tiny"', '"own"')
USER_PROBLEM_SOURCE = """
title = "Velocity step"
law = "slowness"
quantities = ["friction"]
times = [0.1, 0.2]
[parameters]
a = 0.01
b = 0.014
D_c = "20 um"
normal_stress = "5 MPa"
stiffness = "0.003 MPa/um"
V_star = "1 um/s"
[[loading]]
velocity = "10 um/s"
"""
RIG_ARGUMENTS = [
    "--normal-stress",
    "5 MPa",
    "--slip-distance",
    "10 um",
    "--reference-velocity",
    "1 um/s",
]
FIT_COMMAND = [
    "fit",
    "step.csv",
    "--normal-stress",
    "20 MPa",
    "--stiffness",
    "0.04 MPa/um",
    "--step",
    "1",
]
#: Commands that create results. The fit also compiles code before processes are forked.
SETUP_COMMANDS = (
    ["run", "tiny.py", "--serial", "--quiet"],
    ["run", "tiny.py", "--serial", "--quiet", "--format", "zarr"],
    [
        "run",
        "tiny.py",
        "--serial",
        "--quiet",
        "--output",
        "other",
        "--set",
        "load_velocity_ratio=1,3",
    ],
    ["simulate", "--set", "load_velocity_ratio=1.1", "--duration", "2"],
    [
        "simulate",
        *RIG_ARGUMENTS,
        "--set",
        "load_velocity_ratio=1.1",
        "--duration",
        "1 s",
        "--output",
        "rig.png",
    ],
    FIT_COMMAND,
    ["problems", "referee"],
)


def write_input_files(place: Path) -> None:
    """Write files of all kinds to the working directory ``place``."""
    texts = {
        "tiny.py": TINY_STUDY_SOURCE,
        "own.py": USER_STUDY_SOURCE,
        "own.toml": USER_PROBLEM_SOURCE,
        "none.py": "x = 1\n",
        "raises.py": "raise RuntimeError('\\x1b[2J')\n",
        "syntax.py": "study = (\n",
        "mine.mplstyle": "font.size: 9\nfigure.dpi: 40\nsavefig.dpi: 40\n",
        "bad.mplstyle": "font.sise: 9\n",
        "text.nc": "no NetCDF\n",
        "empty.nc": "",
        "empty.csv": "",
        "text.csv": "no,table\nhere\n",
        "hostile.csv": f"time (s),\x1b[2J (um),friction{ESCAPE}\n0,0,0.6\n1,1,0.6\n",
        "wide.csv": ",".join(f"x{n} (s)" for n in range(5000)) + "\n",
        "text.toml": "no toml\n",
        "deep.toml": "a = " + "[" * 5000 + "]" * 5000 + "\n",
        "utf16.csv": "time (s),displacement (um)\n0,1\n",
    }
    for name, text in texts.items():
        Path(name).write_text(text, encoding="utf-16" if name == "utf16.csv" else "utf-8")
    for name in ("record.csv", "protocol.csv", "step.csv"):
        shutil.copyfile(STUDIES / "pages" / name, name)
    rows = (STUDIES / "pages" / "step.csv").read_text().splitlines(keepends=True)
    Path("short.csv").write_text("".join(rows[:160]))
    Path("binary.csv").write_bytes(bytes(range(256)) * 8)
    for words in SETUP_COMMANDS:
        _in_process(words)
    data = Path("outputs/tiny.nc").read_bytes()
    Path("cut.nc").write_bytes(data[: len(data) // 2])
    Path("flipped.nc").write_bytes(data[:3000] + b"\xff" * 64 + data[3064:])
    shutil.copyfile("outputs/tiny.png", "picture.png")
    _write_foreign_files()
    for ending in ("", ".nc", ".csv", ".zarr", ".py", ".toml", ".mplstyle", ".png"):
        Path(f"folder{ending}").mkdir()
    Path("broken.zarr").mkdir()
    Path("broken.zarr/zarr.json").write_text("{")
    for ending in ("", ".nc", ".csv", ".toml", ".py", ".mplstyle", ".png", ".html"):
        os.mkfifo(f"pipe{ending}")
    for ending in (".nc", ".csv", ".png", ".html"):
        if ending != ".html":
            os.symlink(f"loop{ending}", f"loop{ending}")
            os.symlink("nowhere/at/all", f"dangling{ending}")
        # The root user could replace the device to which a link points.
        os.symlink("/dev/null", f"device{ending}") if os.getuid() else os.mknod(
            f"device{ending}", 0o020666, os.makedev(1, 3)
        )
    assert place.samefile(".")


def damage_files(words: Sequence[str], chance: random.Random) -> None:
    """Damage the files named by a command line, and sometimes the journal."""
    for target, source in (*DAMAGED_FILES.items(), (JOURNAL_FILE, JOURNAL_FILE)):
        named = any(target in word for word in words)
        if named or (target == JOURNAL_FILE and chance.random() < 0.1):
            data = bytearray(Path(source).read_bytes())
            for _ in range(chance.choice((1, 1, 2, 5, 50))):
                _damage_once(data, chance)
            Path(target).write_bytes(data)


def _damage_once(data: bytearray, chance: random.Random) -> None:
    """Overwrite, delete or repeat a range of bytes in place."""
    place = chance.randrange(len(data) + 1)
    other = place + chance.choice((1, 1, 4, 64, 1000))
    kind = chance.randrange(5)
    if kind == 0:
        data[place:other] = bytes(chance.randrange(256) for _ in data[place:other])
    elif kind == 1:
        odd = (b"\x00", b"-", b"e999", b",,", b'"', b"nan", b"\x1b[2J", b"\xff", b"\n", b"\xd9\xa3")
        data[place : place + 1] = chance.choice(odd)
    elif kind == 2:
        del data[place:other]
    elif kind == 3:
        data[place:place] = data[place:other]
    elif chance.random() < 0.3:
        del data[place:]


def _write_foreign_files() -> None:
    """Write a NetCDF file of another program, and altered results."""
    import xarray as xr

    xr.Dataset({"x": ("t", [1.0, 2.0])}).to_netcdf("plain.nc")
    with xr.open_dataset("outputs/tiny.nc") as dataset:
        altered = dataset.load()
    altered["critical_stiffness"].attrs |= {"units": ESCAPE, "long_name": ESCAPE}
    altered.attrs["title"] = ESCAPE
    altered.to_netcdf("hostile.nc")


def _in_process(words: Sequence[str]) -> None:
    from rsfstudy.cli import command_line

    sys.argv = ["rsfstudy", *words]
    with contextlib.suppress(SystemExit):
        command_line.main()


# ---- processes -----------------------------------------------------------------------------------


class Answer(NamedTuple):
    """Exit status, output and CPU time in s of a command line.

    A negative exit status is the number of a signal.
    """

    status: int
    output: str
    seconds: float
    hangs: bool = False


class Server:
    """Process that imports the commands once and forks for each command line.

    Parameters
    ----------
    terminal : bool
        If True, the output of the commands goes to a terminal, otherwise to a pipe.
    home : Path
        Directory for the files that the commands use.
    limit : float
        CPU time in s after which a command is reported as a hang.
    """

    def __init__(self, terminal: bool, home: Path, limit: float) -> None:
        self.limit, self._pending = limit, b""
        self._read, write = pty.openpty() if terminal else os.pipe()
        if terminal:
            fcntl.ioctl(write, termios.TIOCSWINSZ, struct.pack("HHHH", 24, TERMINAL_WIDTH, 0, 0))
        self._link, theirs = socket.socketpair()
        self._process = os.fork()
        if not self._process:
            with contextlib.suppress(BaseException):
                self._link.close()
                _serve(theirs, write, home, limit)
            os._exit(1)
        theirs.close()
        os.close(write) if not terminal else None  # A terminal without a writer reports an error.
        os.set_blocking(self._read, False)
        self._receive(60.0 * limit)  # Wait until the process is ready.

    def _receive(self, seconds: float) -> tuple[dict[str, Any] | None, bytes]:
        """Return the next message, and the output in the meantime.

        The message is None if the time limit is reached.
        """
        end, output = time.monotonic() + seconds, b""
        while b"\n" not in self._pending:
            if (left := end - time.monotonic()) <= 0.0:
                return None, output
            ready, _, _ = select.select([self._read, self._link], [], [], left)
            if self._read in ready:
                output += self._drain()
            if self._link in ready:
                received = self._link.recv(2**16)
                assert received, "the process that runs commands has ended"
                self._pending += received
        message, _, self._pending = self._pending.partition(b"\n")
        return json.loads(message), output + self._drain()

    def _drain(self) -> bytes:
        output = b""
        with contextlib.suppress(BlockingIOError, OSError):
            while chunk := os.read(self._read, 2**20):
                output += chunk
        return output

    def run(self, words: Sequence[str], place: Path) -> Answer:
        """Run a command line in the directory ``place``."""
        self._link.sendall(json.dumps([words, str(place)]).encode() + b"\n")
        began, _output = self._receive(60.0 * self.limit)
        assert began is not None
        message, output = self._receive(PATIENCE * self.limit)
        hangs = message is None
        with contextlib.suppress(ProcessLookupError):
            os.killpg(began["process"], signal.SIGKILL)
        if message is None:
            message, more = self._receive(60.0 * self.limit)
            output += more
            assert message is not None
        hangs |= message["status"] == -signal.SIGXCPU
        text = output.decode("utf-8", "replace")
        return Answer(message["status"], text, message["seconds"], hangs)

    def close(self) -> None:
        """Kill the process and close the connection."""
        os.kill(self._process, signal.SIGKILL)
        os.waitpid(self._process, 0)
        self._link.close()
        os.close(self._read)


def _serve(link: socket.socket, output: int, home: Path, limit: float) -> None:
    """Import the commands, then fork for each command line received."""
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDONLY)
    for number, stream in enumerate((nothing, output, output)):
        os.dup2(stream, number)
    # The standard streams of Python still refer to the old descriptors.
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", closefd=False, buffering=1)  # noqa: SIM115
    os.environ |= {"MPLBACKEND": "agg", "TERM": "xterm-256color"}
    for name in ("COLUMNS", "LINES", "RSFSTUDY_TRACEBACK", "NO_COLOR", "FORCE_COLOR"):
        os.environ.pop(name, None)
    files = home / "files"
    if not files.exists():
        files.mkdir(parents=True)
        os.chdir(files)
        write_input_files(files)
    else:
        os.chdir(tempfile.mkdtemp(dir=home))
        for name in ("tiny.py", "step.csv"):
            shutil.copyfile(files / name, name)
        _in_process(FIT_COMMAND)
    sys.stdout.flush()
    gc.collect()
    gc.freeze()  # Freeze the objects, so that forked processes share memory.
    link.sendall(b"{}\n")
    for line in link.makefile():
        words, place = json.loads(line)
        began, process = os.times(), os.fork()
        if not process:
            _run(words, place, limit)
        link.sendall(json.dumps({"process": process}).encode() + b"\n")
        _process, status = os.waitpid(process, 0)
        now = os.times()
        spent = now.children_user + now.children_system
        spent -= began.children_user + began.children_system
        status = os.waitstatus_to_exitcode(status)
        link.sendall(json.dumps({"status": status, "seconds": spent}).encode() + b"\n")


def _run(words: Sequence[str], place: str, limit: float) -> None:
    """Run a command line in this process, and end the process."""
    status = 70
    try:
        os.setsid()
        os.chdir(place)
        for kind, most in (
            (resource.RLIMIT_CPU, int(limit)),
            (resource.RLIMIT_AS, MEMORY_LIMIT),
            (resource.RLIMIT_FSIZE, FILE_SIZE_LIMIT),
            (resource.RLIMIT_CORE, 0),
        ):
            resource.setrlimit(kind, (most, most))
        from rsfstudy.cli import command_line

        sys.argv = ["rsfstudy", *words]
        try:
            command_line.main()
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        except BaseException:
            sys.excepthook(*sys.exc_info())
            status = 1
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
    finally:
        os._exit(status)


# ---- reports -------------------------------------------------------------------------------------

#: Escape sequences of Rich for colours, progress bars and the cursor.
_RICH_ESCAPES = re.compile(r"\x1b\[(?:[0-9;]*m|\?25[lh]|2K|1A)")
_EXCEPTION = re.compile(r"(?<!raises )\b(?:[A-Z]\w*(?:Error|Exception|Halt)|Exception)\b(?::|\))")
_CATCH_ALL_MESSAGES = (
    "failed for these arguments (",
    "cannot be had of this dataset",
    "A file may be damaged or not writable",
)


def faults(line: Line, answer: Answer) -> Iterator[str]:
    """Yield the kinds of problems in an answer."""
    text = answer.output
    if answer.hangs:
        yield "hang"
    elif answer.status not in EXIT_STATUSES:
        yield f"status {answer.status}"
    if "Traceback (most recent call last)" in text:
        yield "traceback"
    allowed = "\n"
    if line.terminal:
        text, allowed = _RICH_ESCAPES.sub("", text), "\r\n"
    odd = {c for c in text if not c.isprintable() and c not in allowed and c != "\ufffd"}
    if odd:
        yield "control " + " ".join(sorted(map(ascii, odd)))
    said = " ".join(text.split())
    if any(words in said for words in _CATCH_ALL_MESSAGES):
        yield "catch-all"
    elif found := _EXCEPTION.search(said):
        yield f"raw {found[0]}"


def fuzz(seed: int, indices: Sequence[int], limit: float, show: bool) -> int:
    """Run command lines, and print a report of each problem.

    The return value is the number of reports.
    """
    reports, kinds, statuses = 0, collections.Counter[str](), collections.Counter[int]()
    slowest, total, began = list[tuple[float, int]](), 0.0, time.monotonic()
    with tempfile.TemporaryDirectory(prefix="fuzz_commands_") as home:
        servers = {kind: Server(kind, Path(home), limit) for kind in (False, True)}
        for index in indices:
            line, place = draw_line(seed, index), Path(home, "here")
            subprocess.run(["cp", "-a", str(Path(home, "files")), str(place)], check=True)
            with contextlib.chdir(place):
                damage_files(line.words, random.Random(f"damage {seed}:{index}"))
            answer = servers[line.terminal].run(line.words, place)
            shutil.rmtree(place)
            statuses[answer.status] += 1
            total += answer.seconds
            slowest = sorted([*slowest, (answer.seconds, index)])[-5:]
            wrong = list(faults(line, answer))
            kinds.update(wrong)
            if len(indices) > 1 and index % 50 == 49:
                spent = f"{total:.0f} s of CPU in {time.monotonic() - began:.0f} s"
                print(f"{index + 1} lines, {spent}", file=sys.stderr, flush=True)
            reports += bool(wrong)
            if wrong or show:
                where = "terminal" if line.terminal else "pipe"
                text = answer.output if show else answer.output[-1500:]
                words = shlex.join(
                    word if len(word) < 500 else f"{word[:100]}..." for word in line.words
                )
                print(f"--- {seed}:{index} ({where}, status {answer.status}): {', '.join(wrong)}")
                print(
                    f"rsfstudy {words!a}\n{ascii(text) if wrong and not show else text}", flush=True
                )
        for server in servers.values():
            server.close()
    print(f"seed {seed}: {len(indices)} lines, {reports} reported")
    print(f"kinds {dict(kinds)}; statuses {dict(sorted(statuses.items()))}")
    print("slowest (CPU s): " + ", ".join(f"{seed}:{i} {s:.1f}" for s, i in reversed(slowest)))
    return reports


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--limit", type=float, default=20.0, help="CPU seconds per command line")
    parser.add_argument("--case", metavar="SEED:INDEX", help="run this line only, and print it")
    asked = parser.parse_args()
    if asked.case:
        of_seed, of_index = map(int, asked.case.split(":"))
        found = fuzz(of_seed, [of_index], asked.limit, show=True)
    else:
        found = fuzz(asked.seed, range(asked.count), asked.limit, show=False)
    sys.exit(1 if found else 0)
