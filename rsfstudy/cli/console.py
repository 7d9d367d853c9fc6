"""Consoles of the commands: plain text, on the standard output or the standard error."""

from __future__ import annotations

from typing import Any

from rich.console import Console, ConsoleDimensions
from rich.text import Text

from rsfstudy.errors import RunError, escape_control_characters, shorten_text

#: Most characters of a text that is printed: what a file says may be without end.
_MAX_PRINTED_CHARACTERS = 5000
#: Bounds of the width: the environment may state any.
_MIN_WIDTH, _MAX_WIDTH = 16, 1000


class PlainConsole(Console):
    """A console that prints any text literally, brackets included; only control characters, which
    would steer the terminal, are spelt out.
    """

    @property
    def size(self) -> ConsoleDimensions:
        """Terminal size, with the width limited to a fixed range.

        The environment variable COLUMNS overrides the width of the terminal.
        """
        found = super().size
        return ConsoleDimensions(min(max(found.width, _MIN_WIDTH), _MAX_WIDTH), found.height)

    @size.setter
    def size(self, size: tuple[int, int]) -> None:
        self._width, self._height = size

    def render_str(self, text: str, **options: Any) -> Text:
        """Text with control characters spelt out, and without its middle where it is endless."""
        return super().render_str(make_text_printable(text), **options)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print; the output may go to a file on a full disk, which is a `RunError`."""
        try:
            super().print(*objects, **options)
        except OSError as error:
            raise RunError(f"cannot print: {error.strerror}.") from error


def make_text_printable(text: str) -> str:
    """Text with control characters spelt out, and without its middle where it is endless."""
    return escape_control_characters(shorten_text(text, _MAX_PRINTED_CHARACTERS))


stdout_console = PlainConsole(markup=False, emoji=False, highlight=False)
stderr_console = PlainConsole(stderr=True, markup=False, emoji=False, highlight=False)
