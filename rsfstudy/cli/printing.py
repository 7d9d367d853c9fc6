"""Printing of lines and tables.

The console modules are imported only when a function of this module is called.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rsfstudy.reporting import SummaryTableOrSentence


def print_line(text: str, style: str = "", soft_wrap: bool = False) -> None:
    """Print text to the standard output.

    Parameters
    ----------
    text : str
        Text to print.
    style : str, optional
        Style, such as "bold" or "red".
    soft_wrap : bool, default: False
        If True, long lines are not wrapped. Pass True for lines that contain a path or a command,
        so that users can copy the path or the command.
    """
    from rsfstudy.cli.console_output import stdout_console

    stdout_console.print(text, style=style or None, soft_wrap=soft_wrap)


def print_on_stderr(text: str) -> None:
    """Print text to the standard error.

    Parameters
    ----------
    text : str
        Text to print.
    """
    from rsfstudy.cli.console_output import stderr_console

    stderr_console.print(text)


def print_tables_and_sentences(tables_and_sentences: Iterable[SummaryTableOrSentence]) -> None:
    """Print tables, lists of headings and values, and sentences.

    Parameters
    ----------
    tables_and_sentences : iterable of (TextTable, mapping of str to str, or str)
        Items to print. Empty tables and empty mappings are not printed.
    """
    from rsfstudy.cli.table_layout import print_table_or_sentence

    for piece in tables_and_sentences:
        print_table_or_sentence(piece)
