"""Entry point of the command line, which prints error messages and sets the exit status."""

from __future__ import annotations

import io
import logging
import os
import shlex
import signal
import sys
import warnings

import click

from rsfstudy.cli.command_group import CommandGroup
from rsfstudy.cli.command_results import EXIT_STATUS_FAILED, EXIT_STATUS_OK
from rsfstudy.errors import (
    IncompleteWarning,
    Interrupted,
    InvalidValue,
    RsfStudyError,
    SignalInterrupt,
    escape_control_characters,
    shorten_text,
)
from rsfstudy.exception_conversion import format_exception

EXIT_STATUS_WRONG_USAGE = 2
#: Signals that interrupt a command in the same way as Ctrl-C.
_SIGNALS_THAT_END_COMMAND = (signal.SIGTERM, signal.SIGHUP)


@click.group(
    cls=CommandGroup,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
    epilog="Getting started: run rsfstudy list, then rsfstudy show NAME, then rsfstudy run NAME. "
    "Use --help after a command for its options.",
)
@click.version_option(package_name="rsfstudy")
def cli() -> None:
    """Parameter studies of a spring-slider with rate- and state-dependent friction."""


def main() -> None:
    """Run the command line and exit with the status of the command.

    If an error ends the command, the function prints a message without a traceback. If the
    environment variable ``RSFSTUDY_TRACEBACK`` is set, the function prints the traceback of an
    unexpected exception.
    """
    warnings.filterwarnings("always", category=UserWarning, module="rsfstudy")
    warnings.filterwarnings("ignore", category=IncompleteWarning)  # commands print it themselves
    warnings.showwarning = lambda message, *_place: _print_warning(message)
    logging.getLogger("matplotlib").addHandler(_MATPLOTLIB_LOG_HANDLER)
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
    """Format the message for an exception that the command did not handle."""
    if isinstance(error, OSError) and error.strerror:
        place = f" ({shorten_text(error.filename)})" if error.filename else ""
        remedy = "Check that the directory exists, is writable, and has free space."
        return f"{error.strerror}{place}. {remedy}"
    if isinstance(error, MemoryError):
        return "not enough memory. Reduce the number of values or their size."
    return (
        f"{format_exception(error)}. A file may be damaged or not writable. "
        "Set RSFSTUDY_TRACEBACK=1 to see the traceback."
    )


def _raise_signal_interrupt(signal_number: int, _frame: object) -> None:
    """Raise an interrupt when a signal arrives, and ignore later signals.

    For example, the Unix command ``timeout`` sends two signals, and the second signal must not
    interrupt the cleanup after the first signal.
    """
    for other in _SIGNALS_THAT_END_COMMAND:
        signal.signal(other, signal.SIG_IGN)
    raise SignalInterrupt(signal_number)


class _WarnOnceHandler(logging.Handler):
    """Log handler that prints each log message as a warning, but only once.

    The handler is needed because Matplotlib repeats the same message for each text label in a
    figure.
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


_MATPLOTLIB_LOG_HANDLER = _WarnOnceHandler(logging.WARNING)


def _print_warning(message: Warning | str) -> None:
    # The console is not used here, because the warning would overwrite a progress bar.
    """Print a warning to standard error."""
    print(escape_control_characters(shorten_text(f"warning: {message}", 5000)), file=sys.stderr)


def _print_error(text: str) -> None:
    """Print an error message to standard error."""
    from rsfstudy.cli.console_output import stderr_console

    stderr_console.print(text)


if __name__ == "__main__":
    main()
