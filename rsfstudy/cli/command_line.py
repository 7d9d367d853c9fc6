"""The command line: how each command is spelt, and what its help says. What a command does is
loaded when it is called, so that help and the list of studies answer at once.
"""

from __future__ import annotations

import io
import logging
import os
import shlex
import signal
import sys
import warnings
from typing import Any

import click

from rsfstudy.cli import command_line_scenes, options
from rsfstudy.defaults import OUTPUT_DIRECTORY, RESULT_FORMATS
from rsfstudy.error_boundary import format_exception
from rsfstudy.errors import (
    IncompleteWarning,
    Interrupted,
    InvalidValue,
    RsfStudyError,
    SignalInterrupt,
    escape_control_characters,
    shorten_text,
)
from rsfstudy.study import study_titles

EXIT_STATUS_OK, EXIT_STATUS_FAILED, EXIT_STATUS_WRONG_USAGE = 0, 1, 2
#: Signals that end a command as Ctrl-C does.
_SIGNALS_THAT_END_COMMAND = (signal.SIGTERM, signal.SIGHUP)


class GroupInOrderOfDefinition(click.Group):
    """A group whose help names commands in the order of this file."""

    command_class = options.LazilyLoadedCommand

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
    cls=GroupInOrderOfDefinition,
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
    warnings.filterwarnings("ignore", category=IncompleteWarning)  # commands print it themselves
    warnings.showwarning = lambda message, *_place: _print_warning(message)
    logging.getLogger("matplotlib").addHandler(_LOG_HANDLER)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # which may be unable to say what a file says
            stream.reconfigure(errors="backslashreplace")
    for number in _SIGNALS_THAT_END_COMMAND:
        if signal.getsignal(number) is signal.SIG_DFL:  # and not ignored, as by nohup
            signal.signal(number, _raise_signal_interrupt)
    try:
        sys.exit(cli(standalone_mode=False) or EXIT_STATUS_OK)
    except click.ClickException as error:
        error.message = escape_control_characters(shorten_text(error.message))  # type: ignore[misc]
        error.show()
        sys.exit(EXIT_STATUS_WRONG_USAGE)
    except (click.Abort, KeyboardInterrupt):
        _print_error("interrupted")
        sys.exit(EXIT_STATUS_FAILED)
    except RsfStudyError as error:
        _print_error(f"error: {error}")
        of_ours = EXIT_STATUS_WRONG_USAGE if isinstance(error, InvalidValue) else EXIT_STATUS_FAILED
        sys.exit(error.exit_status if isinstance(error, Interrupted) else of_ours)
    except Exception as error:
        if os.environ.get("RSFSTUDY_TRACEBACK"):
            raise
        _print_error(
            f"error: rsfstudy {shorten_text(shlex.join(sys.argv[1:]))}: "
            f"{_describe_unexpected_error(error)}"
        )
        sys.exit(EXIT_STATUS_FAILED)


def _describe_unexpected_error(error: Exception) -> str:
    """Return a message for an exception that no command handles."""
    if isinstance(error, OSError) and error.strerror:
        place = f" ({shorten_text(error.filename)})" if error.filename else ""
        remedy = "Check that the place exists, may be written to, and is not full."
        return f"{error.strerror}{place}. {remedy}"
    if isinstance(error, MemoryError):
        return "there is not enough memory for it. Ask for fewer or smaller values."
    return (
        f"{format_exception(error)}. Look at what it names: a file may be damaged, or no place to "
        "write to. RSFSTUDY_TRACEBACK=1 shows where it arose."
    )


def _raise_signal_interrupt(signal_number: int, _frame: object) -> None:
    """End the command; it then takes its own time whatever follows: `timeout` sends two signals."""
    for other in _SIGNALS_THAT_END_COMMAND:
        signal.signal(other, signal.SIG_IGN)
    raise SignalInterrupt(signal_number)


class _WarnOnceHandler(logging.Handler):
    """Log handler that prints each message of a library once, as a warning.

    Matplotlib logs the same message for each text of a figure.
    """

    def __init__(self, level: int) -> None:
        super().__init__(level)
        self._printed: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print the message of a log record unless it has been printed before."""
        text = record.getMessage()
        if text not in self._printed:
            self._printed.add(text)
            _print_warning(text)


_LOG_HANDLER = _WarnOnceHandler(logging.WARNING)


def _print_warning(message: Warning | str) -> None:
    # not by the console, which knows nothing of a progress bar and would write over it
    print(escape_control_characters(shorten_text(f"warning: {message}", 5000)), file=sys.stderr)


def _print_error(text: str) -> None:
    from rsfstudy.cli.console import stderr_console

    stderr_console.print(text)


@cli.command("list", cls=click.Command)
@click.pass_context
def list_studies(context: click.Context) -> None:
    """Name the studies."""
    text = context.make_formatter()
    text.write_dl(list(study_titles().items()))
    text.write_paragraph()
    text.write_text("rsfstudy show NAME tells what one consists of, rsfstudy run NAME computes it.")
    click.echo(text.getvalue().rstrip())


@cli.command()
@click.argument("name")
@options.set_values_option
@options.rtol_option
@options.output_option
@options.study_file_option
@options.rig_options
def show() -> None:
    """Show a study before it is run, or what is in a results file.

    Of a study, by its NAME or file: what varies, what is fixed and measured, and what it costs, as
    long as its cells took last where they are kept in OUTPUT. Of a results file: its numbers, where
    they come from, and how to reproduce each cell that failed.
    """


@cli.command()
@options.study_name_or_all_argument
@options.set_values_option
@options.output_option
@options.rtol_option
@options.engine_option
@options.budget_option
@options.worker_options
@click.option("--fresh", is_flag=True, help="Compute every cell anew.")
@click.option("--keep-going", is_flag=True, help="Go on where the first cells all fail.")
@click.option("--despite-failures", is_flag=True, help="Reduce what there is where cells failed.")
@click.option(
    "--format",
    type=click.Choice(RESULT_FORMATS),
    default=RESULT_FORMATS[0],
    help="One NetCDF file, or a Zarr store written in pieces, which never replaces another.",
)
@options.figure_options
@options.rig_options
def run() -> None:
    """Run a study: results, figure, slopes and claims.

    Of a study, by its NAME or file: OUTPUT/NAME.nc, its figure OUTPUT/NAME.png, its reductions and
    its claims. Cells that are finished already are kept: the same command goes on where it ended.
    """


@cli.command()
@options.study_name_or_all_argument
@options.output_option
@click.option(
    "--claim",
    "claims",
    multiple=True,
    metavar="ID",
    help="Only this claim, as in C6, which must then apply to the results.",
)
def check() -> None:
    """Hold results against published values.

    Those of a named study, or of a results file. Fails where a verdict is not the one expected, a
    cell failed, or no claim applies.
    """


@cli.command()
@options.study_name_or_all_argument
@options.make_output_option(
    "Directory of the results and of the figure, or the figure itself, such as fig.pdf.  "
    "[default: outputs, and beside a FILE]"
)
@options.figure_options
@click.option("--variable", metavar="NAME", help="Draw this variable: maps, or lines.")
@options.study_file_option
@options.abscissa_option
def plot() -> None:
    """Draw the figure of results, or a motion, beside them.

    Of a named study's results, or of a file, that of a motion too. A figure of your own is taken
    from the file that --study names, which is run.
    """


@cli.command()
@click.argument("directory", default=OUTPUT_DIRECTORY, type=options.FilePath())
@click.option(
    "--output",
    type=options.FilePath(dir_okay=False),
    metavar="FILE",
    help="The page.  [default: DIRECTORY/report.html]",
)
def report() -> None:
    """Write one page of HTML of all results in a directory.

    With verdicts, figures, slopes, failed cells, and where each file comes from, for a browser or a
    printer; it needs no other file. Fails where a file cannot be read, which the page tells.
    """


@cli.command()
@click.argument("first")
@click.argument("second")
@options.output_option
def compare() -> None:
    """Compare two results files: declarations, versions and numbers.

    The results of two studies can be compared by name. Cells are matched by their coordinates.
    Two numbers agree if they differ by no more than the sum of both error estimates. The exit
    status is 0 if all numbers and statuses agree, and 1 if a number or a status differs or if the
    files have no cell in common.
    """


@cli.command()
@click.argument("file", type=options.FilePath())
@click.option(
    "--cell",
    "place",
    multiple=True,
    metavar="AXIS=VALUE",
    help="Only this cell, in this process, failing as it fails.",
)
@options.study_file_option
@options.make_output_option(
    "Directory to keep the new results in; nothing is written without it.", file_okay=False
)
@options.worker_options
def rerun() -> None:
    """Compute a results file anew, and compare every number.

    It is computed from what the file says of itself. Fails where a number is not the same.
    """


@cli.command()
@click.argument("file", type=options.FilePath())
@click.option("--csv", is_flag=True, help="Without what never changes.")
@click.option("--mat", is_flag=True, help="For MATLAB: every variable.")
@click.option("--units", nargs=3, metavar="STRESS LENGTH TIME", help="Of a rig, as in MPa um s.")
@click.option(
    "--output",
    type=options.FilePath(dir_okay=False),
    help="The file to write; .csv and .mat take the place of its ending.  [default: beside FILE]",
)
def export() -> None:
    """Write results, or a motion, for other programs.

    As a table of CSV, a row a cell or a time, as a file of MATLAB, or both.
    """


for one in command_line_scenes.SCENE_COMMANDS:
    cli.add_command(one)

if __name__ == "__main__":
    main()
