"""The command line: how `problems` and `verify` are spelt, which check other codes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from rsfstudy.cli import options


@click.command()
@click.argument("directory", metavar="DIR", type=click.Path(path_type=Path))
def problems(directory: Path) -> int:
    """Write the problems of the referee into a new directory.

    Each problem with its answer, a table to be filled, and an example in plain SciPy.
    """
    from rsfstudy.cli import commands_referee

    return commands_referee.problems(directory)


@click.command()
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@click.option(
    "--problem",
    metavar="N|TOML",
    help="Number of the problem, or a file that states another.  [default: what FILE begins with]",
)
@click.option(
    "--columns",
    metavar="MAP",
    help="What its columns are, as in 'time=t (s), friction=mu, slip_rate=v (um/s)'.  [default: as "
    "its header says]",
)
@click.option(
    "--digits", type=click.FloatRange(1.0, 12.0), default=6.0, help="Digits that make a pass."
)
@options.image("--figure", None, "Draw where they agree, into this .png, .pdf or .svg.")
def verify(**given: Any) -> int:
    """Hold answers of another code against those that are known.

    Says of each quantity how many digits agree, from where on they part, and what would explain
    it; and of all files one line to quote. Exit status 1 where a problem is not passed.
    """
    from rsfstudy.cli import commands_referee

    return commands_referee.verify(**given)
