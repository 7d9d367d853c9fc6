"""Command line interface with all commands and their help texts.

The function that runs a command is imported when the command is called. The help texts and the list
of studies are therefore printed without delay.
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
#: Signals that interrupt a command in the same way as Ctrl-C.
_SIGNALS_THAT_END_COMMAND = (signal.SIGTERM, signal.SIGHUP)


class CommandGroupInDefinitionOrder(click.Group):
    """Command group that lists its commands in the order of definition."""

    command_class = options.LazilyLoadedCommand

    def list_commands(self, _context: click.Context) -> list[str]:
        """Return the names of the commands.

        Parameters
        ----------
        _context : click.Context
            Context of the command line, which is not used.

        Returns
        -------
        list of str
            Names in the order of definition.
        """
        return list(self.commands)

    def invoke(self, context: click.Context) -> Any:
        """Call a command, and convert Ctrl-C and signals to an error.

        Without the conversion, Click would print an empty line before its message.

        Parameters
        ----------
        context : click.Context
            Context of the command line.

        Returns
        -------
        object
            Return value of the command.

        Raises
        ------
        Interrupted
            If the user or a signal interrupts the command.
        """
        try:
            return super().invoke(context)
        except KeyboardInterrupt as error:
            raise Interrupted(str(error) or "interrupted") from error


@click.group(
    cls=CommandGroupInDefinitionOrder,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
    epilog="To begin with: rsfstudy list, then rsfstudy show NAME, then rsfstudy run NAME. "
    "Each command has a --help of its own.",
)
@click.version_option(package_name="rsfstudy")
def cli() -> None:
    """Parameter studies of a spring-slider with rate- and state-dependent friction."""


def main() -> None:
    """Run the command line and exit with the status of the command.

    Errors are printed as a single message without a traceback. If the environment variable
    ``RSFSTUDY_TRACEBACK`` is set, the traceback of an unexpected exception is printed.
    """
    warnings.filterwarnings("always", category=UserWarning, module="rsfstudy")
    warnings.filterwarnings("ignore", category=IncompleteWarning)  # commands print it themselves
    warnings.showwarning = lambda message, *_place: _print_warning(message)
    logging.getLogger("matplotlib").addHandler(_LOG_HANDLER)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # the encoding may lack characters
            stream.reconfigure(errors="backslashreplace")
    for number in _SIGNALS_THAT_END_COMMAND:
        if signal.getsignal(number) is signal.SIG_DFL:  # nohup ignores SIGHUP
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
    """Interrupt the command, and ignore all further signals.

    The program ``timeout`` sends two signals, and the second signal must not interrupt the cleanup.
    """
    for other in _SIGNALS_THAT_END_COMMAND:
        signal.signal(other, signal.SIG_IGN)
    raise SignalInterrupt(signal_number)


class _WarnOnceHandler(logging.Handler):
    """Log handler that prints each message of a library once, as a warning.

    Matplotlib logs the same message for each text label in a figure.
    """

    def __init__(self, level: int) -> None:
        """Create a handler that has not printed any messages yet."""
        super().__init__(level)
        self._printed: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print the message of a log record unless it has been printed before.

        Parameters
        ----------
        record : logging.LogRecord
            Log record.
        """
        text = record.getMessage()
        if text not in self._printed:
            self._printed.add(text)
            _print_warning(text)


_LOG_HANDLER = _WarnOnceHandler(logging.WARNING)


def _print_warning(message: Warning | str) -> None:
    # The console is not used here, because the warning would overwrite a progress bar.
    """Print a warning on the standard error."""
    print(escape_control_characters(shorten_text(f"warning: {message}", 5000)), file=sys.stderr)


def _print_error(text: str) -> None:
    """Print an error message on the standard error."""
    from rsfstudy.cli.console import stderr_console

    stderr_console.print(text)


@cli.command("list", cls=click.Command)
@click.pass_context
def list_studies(context: click.Context) -> None:
    """List the named studies with their titles."""
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
    """Show a study before a run, or summarise a results file.

    For the name or the file of a study, the command prints the axes, the fixed fields, the measure
    and the expected cost. The cost is the measured time if OUTPUT contains cells of an earlier run.
    For a results file, the command prints the results, their provenance, and a command that
    reproduces each failed cell.
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
    """Run a study and write its results and its figure.

    NAME is a named study or a Python file that declares a study. The command writes OUTPUT/NAME.nc
    and the figure OUTPUT/NAME.png, and prints the reductions and the claims. If a run was
    interrupted, the same command continues the run, because finished cells are kept.
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
    """Compare results with published values.

    NAME is a named study or a results file. The exit status is 1 if a verdict differs from the
    expected verdict, if a cell failed, or if no claim applies to the results.
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
    """Draw the figure of a results file or of a motion.

    NAME is a named study or a file with results or a motion. By default, the figure is written to
    the directory of the file. If the study defines its own figure, pass the Python file of the
    study with --study. The command executes this file.
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
    """Write an HTML page with all results in a directory.

    The page contains verdicts, figures, slopes, failed cells and the provenance of each file. The
    page is a single file that can be viewed in a browser or printed. The exit status is 1 if a
    results file cannot be read. In this case, the page shows the reason.
    """


@cli.command()
@click.argument("first")
@click.argument("second")
@options.output_option
def compare() -> None:
    """Compare two results files: declarations, versions and numbers.

    The results of two studies can be compared by name. Cells are matched by their coordinates. Two
    numbers agree if they differ by no more than the sum of both error estimates. The exit status is
    0 if all numbers and statuses agree. The exit status is 1 if a number or a status differs, or if
    the files have no cell in common.
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
    """Compute a results file again, and compare all numbers.

    The study is restored from the results file. The exit status is 1 if a number differs.
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
    """Export results or a motion to other programs.

    The command writes a CSV table, a MATLAB file, or both. The table has one row per cell of a
    study or per time of a motion.
    """


for one in command_line_scenes.SCENE_COMMANDS:
    cli.add_command(one)

if __name__ == "__main__":
    main()
