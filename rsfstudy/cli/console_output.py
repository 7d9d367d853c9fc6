"""Consoles that print plain text to standard output and standard error."""

from __future__ import annotations

from typing import Any

from rich.console import Console, ConsoleDimensions
from rich.text import Text

from rsfstudy.errors import RunError, escape_control_characters, shorten_text

#: Maximum number of characters of a printed string. The limit is needed because strings in files
#: can have any length.
_MAX_LENGTH_OF_PRINTED_STRING = 5000
#: Bounds of the console width. The bounds are needed because the environment variable ``COLUMNS``
#: can have any value.
_MIN_WIDTH, _MAX_WIDTH = 16, 1000
#: Width of lines in files and pipes.
_WIDTH_OF_REDIRECTED_OUTPUT = 100


class LiteralTextConsole(Console):
    """Console that prints text literally, including square brackets.

    Control characters could change the state of the terminal. The console therefore prints control
    characters as visible escape sequences.
    """

    @property
    def size(self) -> ConsoleDimensions:
        """Size of the terminal, with the width limited to a fixed range.

        The environment variable ``COLUMNS`` overrides the width of the terminal. If the output is
        redirected and ``COLUMNS`` is not set, the width is 100 characters.
        """
        found = super().size
        if not self.is_terminal and not self._environ.get("COLUMNS", "").isdigit():
            return ConsoleDimensions(_WIDTH_OF_REDIRECTED_OUTPUT, found.height)
        return ConsoleDimensions(min(max(found.width, _MIN_WIDTH), _MAX_WIDTH), found.height)

    @size.setter
    def size(self, size: tuple[int, int]) -> None:
        self._width, self._height = size

    def render_str(self, text: str, **options: Any) -> Text:
        """Convert a string to printable text.

        Long strings are shortened, and control characters are escaped.

        Parameters
        ----------
        text : str
            String to print.
        **options : Any
            Options of ``rich.console.Console.render_str``.

        Returns
        -------
        rich.text.Text
            Printable text.
        """
        return super().render_str(make_text_printable(text), **options)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print objects to the console.

        Parameters
        ----------
        *objects : Any
            Objects to print.
        **options : Any
            Options of ``rich.console.Console.print``.

        Raises
        ------
        RunError
            If the output cannot be written, for example because the disk is full.
        """
        try:
            super().print(*objects, **options)
        except OSError as error:
            raise RunError(f"cannot print: {error.strerror}.") from error


def make_text_printable(text: str) -> str:
    """Shorten a string if it is long, and escape its control characters.

    Parameters
    ----------
    text : str
        Text to print.

    Returns
    -------
    str
        String of at most about 5,000 characters, in which control characters are replaced by
        visible escape sequences.
    """
    return escape_control_characters(shorten_text(text, _MAX_LENGTH_OF_PRINTED_STRING))


stdout_console = LiteralTextConsole(markup=False, emoji=False, highlight=False)
stderr_console = LiteralTextConsole(stderr=True, markup=False, emoji=False, highlight=False)
