"""Tables on a terminal of any width. No number, name or heading is broken: where columns do not fit
beside each other, each row becomes a list of headings and values.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from rich import box
from rich import table as rich_table
from rich.cells import cell_len
from rich.padding import Padding
from rich.text import Text

from rsfstudy.cli.console import clean_text, console
from rsfstudy.reporting import SummaryPiece, Table

#: Characters between columns, and in which a column of sentences can be read.
_COLUMN_GAP, _MIN_PROSE_WIDTH = 2, 20


def print_piece(piece: SummaryPiece) -> None:
    """Print a table with its caption, what is what, or a sentence; nothing of what is empty."""
    if isinstance(piece, str):
        console.print(piece)
    elif isinstance(piece, Table):
        _print_table(piece)
    elif piece:
        row = _clean_row(piece)
        _print_row_as_list(row, set(row), "")


def _print_table(table: Table) -> None:
    """Print a table; none without rows."""
    if not table.rows:
        return
    if table.caption:
        console.print(table.caption)
    rows, prose = [_clean_row(row) for row in table.rows], set(map(clean_text, table.wrappable))
    heads, columns = list(rows[0]), list(zip(*(row.values() for row in rows), strict=True))
    least = [_min_column_width(h, c, h in prose) for h, c in zip(heads, columns, strict=True)]
    most = [max(map(cell_len, (h, *c))) for h, c in zip(heads, columns, strict=True)]
    room = console.width - _COLUMN_GAP * (len(heads) - 1)
    if sum(least) > room:
        for row, style in zip(rows, table.colours or [""] * len(rows), strict=True):
            _print_row_as_list(row, prose, style)
        return
    printed = rich_table.Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, 1, 0, 0))
    printed.pad_edge = False
    widths = _distribute_widths(least, most, room)
    for head, column, width in zip(heads, columns, widths, strict=True):
        side = "right" if all(map(_is_number, column)) else "left"
        printed.add_column(Text(head), width=width, justify=side)  # type: ignore[arg-type]
    for row, style in zip(rows, table.colours or [""] * len(rows), strict=True):
        *texts, last = row.values()
        printed.add_row(*map(Text, texts), Text(last, style=style))
    console.print(printed)
    console.print()


def _clean_row(row: Mapping[str, str]) -> dict[str, str]:
    """Return a row with control characters replaced by visible escape sequences."""
    return {clean_text(head): clean_text(text) for head, text in row.items()}


def _print_row_as_list(row: Mapping[str, str], prose: Collection[str], style: str) -> None:
    """Print a row as headings and values, these below those where they do not fit beside them."""
    wide = max(map(cell_len, row))
    room = console.width - wide - _COLUMN_GAP
    beside = all(_longest_unbreakable(text, head in prose) <= room for head, text in row.items())
    lines = rich_table.Table.grid(padding=(0, _COLUMN_GAP, 0, 0))
    for number, (head, text) in enumerate(row.items(), start=1):
        value = Text(text, style=style if number == len(row) else "", overflow="fold")
        if beside:
            lines.add_row(Text(head), value)
        else:
            lines.add_row(Text(head))
            lines.add_row(Padding(value, (0, 0, 0, _COLUMN_GAP)))
    console.print(lines)
    console.print()


def _longest_unbreakable(text: str, prose: bool) -> int:
    """Length of what must not be broken: a word of prose, else the text."""
    return max(map(cell_len, text.split() if prose else [text]), default=0)


def _min_column_width(head: str, column: Sequence[str], prose: bool) -> int:
    """Width that a column needs, whose heading may be broken between words."""
    needed = max(_longest_unbreakable(text, prose) for text in column)
    if prose:
        needed = max(needed, min(_MIN_PROSE_WIDTH, max(map(cell_len, column))))
    return max(needed, _longest_unbreakable(head, prose=True))


def _distribute_widths(least: Sequence[int], most: Sequence[int], room: int) -> list[int]:
    """Widths of columns: what each needs, and the rest to the narrowest that want more."""
    widths = list(least)
    for _ in range(room - sum(least)):
        wanting = [n for n, width in enumerate(widths) if width < most[n]]
        if wanting:
            widths[min(wanting, key=widths.__getitem__)] += 1
    return widths


def _is_number(text: str) -> bool:
    try:
        float(text.strip("<> ").replace(",", ""))
    except ValueError:
        return text in ("", "-")
    return True
