"""The command line: how each command is spelt, and what its help says. What a command needs is
loaded when it is called, so that help and the list of studies answer at once.
"""

from __future__ import annotations

import contextlib
import io
import os
import shlex
import signal
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from rsfstudy.cli import command_line_fit, command_line_referee, command_line_simulate, options
from rsfstudy.declare import names
from rsfstudy.defaults import FORMATS, OUTPUT
from rsfstudy.doors import in_words
from rsfstudy.errors import (
    Incomplete,
    Interrupted,
    InvalidValue,
    RsfStudyError,
    Signalled,
    brief,
    spelt,
)

OK, FAILED, WRONG_USAGE = 0, 1, 2
#: Signals that end a command as Ctrl-C does.
_ENDING = (signal.SIGTERM, signal.SIGHUP)


class InOrder(click.Group):
    """A group whose help names commands in the order of this file."""

    def list_commands(self, _context: click.Context) -> list[str]:
        """Names of the commands."""
        return list(self.commands)

    def invoke(self, context: click.Context) -> Any:
        """Call a command; Ctrl-C and signals end it with one line, without a blank one before."""
        try:
            return super().invoke(context)
        except KeyboardInterrupt as error:
            raise Interrupted(str(error) or "interrupted") from error


@click.group(
    cls=InOrder,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
    epilog="To begin with: rsfstudy list, then rsfstudy show NAME, then rsfstudy run NAME. "
    "Each command has a --help of its own.",
)
@click.version_option(package_name="rsfstudy")
def cli() -> None:
    """Parameter studies of a spring-slider with rate- and state-dependent friction."""


def main() -> None:
    """Entry point: errors end in one message and an exit status, not in a traceback, unless the
    environment has RSFSTUDY_TRACEBACK.
    """
    warnings.filterwarnings("always", category=UserWarning, module="rsfstudy")
    warnings.filterwarnings("ignore", category=Incomplete)  # commands print it themselves
    warnings.showwarning = lambda message, *_place: _warn(message)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # which may be unable to say what a file says
            stream.reconfigure(errors="backslashreplace")
    try:
        with _signals_raise():
            sys.exit(cli(standalone_mode=False) or OK)
    except click.ClickException as error:
        error.message = brief(error.message)  # type: ignore[misc]
        error.show()
        sys.exit(WRONG_USAGE)
    except (click.Abort, KeyboardInterrupt):
        _say("interrupted")
        sys.exit(FAILED)
    except RsfStudyError as error:
        _say(f"error: {error}")
        of_ours = WRONG_USAGE if isinstance(error, InvalidValue) else FAILED
        sys.exit(error.exit_status if isinstance(error, Interrupted) else of_ours)
    except Exception as error:
        if os.environ.get("RSFSTUDY_TRACEBACK"):
            raise
        words = brief(shlex.join(sys.argv[1:]))
        _say(
            f"error: rsfstudy {words}: {in_words(error)}. Look at what it names: a file may be "
            "damaged, or no place to write to. RSFSTUDY_TRACEBACK=1 shows where it arose."
        )
        sys.exit(FAILED)


@contextlib.contextmanager
def _signals_raise() -> Iterator[None]:
    """Have `Signalled` raised by the first signal that would end the process, which then ends in
    its own time whatever follows: `timeout` sends two. A signal that is ignored, as by nohup, stays
    so.
    """
    ending = [number for number in _ENDING if signal.getsignal(number) is signal.SIG_DFL]
    arrived: list[int] = []

    def end(number: int, _frame: object) -> None:
        arrived.append(number)
        if len(arrived) == 1:
            raise Signalled(number)

    for number in ending:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in () if arrived else ending:
            signal.signal(number, signal.SIG_DFL)


def _warn(message: Warning | str) -> None:
    # not by the console, which knows nothing of a progress bar and would write over it
    print(spelt(brief(f"warning: {message}", 5000)), file=sys.stderr)


def _say(text: str) -> None:
    from rsfstudy.cli.console import stderr

    stderr.print(text)


@cli.command("list")
@click.pass_context
def list_studies(context: click.Context) -> None:
    """Name the studies."""
    text = context.make_formatter()
    text.write_dl(list(names.titles().items()))
    text.write_paragraph()
    text.write_text("rsfstudy show NAME tells what one consists of, rsfstudy run NAME computes it.")
    click.echo(text.getvalue().rstrip())


@cli.command()
@click.argument("name")
@options.settings
@options.rtol
@options.output
@options.rig
def show(**given: Any) -> int:
    """Show a study before it is run, or what is in a results file.

    Of a study, by its NAME or file: what varies, what is fixed and measured, and what it costs, as
    long as its cells took last where they are kept in OUTPUT. Of a results file: its numbers, where
    they come from, and how to reproduce each cell that failed.
    """
    from rsfstudy.cli import commands

    return commands.show(**given)


@cli.command()
@click.argument("name", required=False)
@options.every
@options.settings
@options.output
@options.workers
@options.serial
@options.scheduler
@options.rtol
@options.engine
@options.budget
@options.time_limit
@click.option("--fresh", is_flag=True, help="Compute every cell anew.")
@click.option("--keep-going", is_flag=True, help="Go on where the first cells all fail.")
@click.option("--despite-failures", is_flag=True, help="Reduce what there is where cells failed.")
@click.option(
    "--format",
    type=click.Choice(FORMATS),
    default=FORMATS[0],
    help="One NetCDF file, or a Zarr store written in pieces, which never replaces another.",
)
@options.figure
@options.style
@options.quiet
@options.rig
def run(**given: Any) -> int:
    """Run a study: results, figure, slopes and claims.

    Of a study, by its NAME or file: OUTPUT/NAME.nc, its figure OUTPUT/NAME.png, its reductions and
    its claims. Cells that are finished already are kept: the same command goes on where it ended.
    """
    from rsfstudy.cli import commands

    return commands.run(**given)


@cli.command()
@click.argument("name", required=False)
@options.every
@options.output
def check(**given: Any) -> int:
    """Hold results against published values.

    Those of a named study, or of a results file. Fails where a verdict is not the one expected.
    """
    from rsfstudy.cli import commands

    return commands.check(**given)


@cli.command()
@click.argument("name", required=False)
@options.every
@options.drawn
@options.figure
@options.style
@click.option("--variable", metavar="NAME", help="Draw this variable: maps, or lines.")
@options.study
@options.against
def plot(**given: Any) -> int:
    """Draw the figure of results, or a motion, beside them.

    Of a named study's results, or of a file, that of a motion too. A figure of your own is taken
    from the file that --study names, which is run.
    """
    from rsfstudy.cli import commands

    return commands.plot(**given)


@cli.command()
@click.argument("directory", default=OUTPUT, type=click.Path(path_type=Path))
@click.option("--output", metavar="FILE", help="The page.  [default: DIRECTORY/report.html]")
def report(**given: Any) -> int:
    """Write one page of HTML of all results in a directory.

    With verdicts, figures, slopes, failed cells, and where each file comes from, for a browser or a
    printer; it needs no other file. Fails where a file cannot be read, which the page tells.
    """
    from rsfstudy.cli import commands

    return commands.report(**given)


@cli.command()
@click.argument("first")
@click.argument("second")
@options.output
def compare(**given: Any) -> int:
    """Compare two results files: declaration, versions, numbers.

    Or the results of two studies, by name. Cells are matched by their places on the axes, and
    numbers held against the sum of both error estimates. Exit status 0 where nothing differs beyond
    them, 1 where a number or a status does, or no cell is in both.
    """
    from rsfstudy.cli import commands

    return commands.compare(**given)


@cli.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--cell",
    "place",
    multiple=True,
    metavar="AXIS=VALUE",
    help="Only this cell, in this process, failing as it fails.",
)
@options.study
@click.option(
    "--output",
    type=click.Path(file_okay=False),
    callback=options.directory,
    help="Directory to keep the new results in; nothing is written without it.",
)
@options.workers
@options.serial
@options.scheduler
@options.time_limit
@options.quiet
def rerun(**given: Any) -> int:
    """Compute a results file anew, and compare every number.

    It is computed from what the file says of itself. Fails where a number is not the same.
    """
    from rsfstudy.cli import commands

    return commands.rerun(**given)


@cli.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--csv", is_flag=True, help="Without what never changes.")
@click.option("--mat", is_flag=True, help="For MATLAB: every variable.")
@click.option(
    "--output", type=click.Path(path_type=Path), help="The file to write.  [default: beside FILE]"
)
def export(**given: Any) -> int:
    """Write results, or a motion, for other programs.

    As a table of CSV, a row a cell or a time, as a file of MATLAB, or both.
    """
    from rsfstudy.cli import commands

    return commands.export(**given)


cli.add_command(command_line_simulate.simulate)
cli.add_command(command_line_fit.fit)
cli.add_command(command_line_referee.problems)
cli.add_command(command_line_referee.verify)

if __name__ == "__main__":
    main()
