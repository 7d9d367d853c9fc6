"""Layout of printed tables for terminals of any width.

Each column is at least as wide as the longest number, name or word in the column. If the table is
wider than the terminal, each row is printed as a list of headings and values.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from rich import box
from rich import table as rich_table
from rich.cells import cell_len
from rich.padding import Padding
from rich.text import Text

from rsfstudy.cli.console_output import make_text_printable, stdout_console
from rsfstudy.reporting import SummaryTableOrSentence, TextTable

#: Number of characters between two columns, and minimum width of a column that contains prose.
_CHARACTERS_BETWEEN_COLUMNS, _MIN_WIDTH_OF_PROSE_COLUMN = 2, 20


def print_table_or_sentence(table_or_sentence: SummaryTableOrSentence) -> None:
    """Print a table, a list of headings and values, or a sentence.

    Parameters
    ----------
    table_or_sentence : TextTable, mapping of str to str, or str
        Text to print. Empty tables and empty mappings are not printed.
    """
    if isinstance(table_or_sentence, str):
        stdout_console.print(table_or_sentence)
    elif isinstance(table_or_sentence, TextTable):
        _print_table(table_or_sentence)
    elif table_or_sentence:
        row = _make_row_printable(table_or_sentence)
        _print_row_as_list(row, set(row), "")


def _print_table(table: TextTable) -> None:
    """Print a table unless it has no rows."""
    if not table.rows:
        return
    if table.caption:
        stdout_console.print(table.caption)
    rows, prose = (
        [_make_row_printable(row) for row in table.rows],
        set(map(make_text_printable, table.wrappable_columns)),
    )
    heads, columns = list(rows[0]), list(zip(*(row.values() for row in rows), strict=True))
    least = [
        _compute_min_column_width(h, c, h in prose) for h, c in zip(heads, columns, strict=True)
    ]
    most = [max(map(cell_len, (h, *c))) for h, c in zip(heads, columns, strict=True)]
    room = stdout_console.width - _CHARACTERS_BETWEEN_COLUMNS * (len(heads) - 1)
    if sum(least) > room:
        for row, style in zip(rows, table.last_column_colours or [""] * len(rows), strict=True):
            _print_row_as_list(row, prose, style)
        return
    printed = rich_table.Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, 1, 0, 0))
    printed.pad_edge = False
    widths = _distribute_column_widths(least, most, room)
    for head, column, width in zip(heads, columns, widths, strict=True):
        side = "right" if all(map(_is_number_or_dash, column)) else "left"
        printed.add_column(Text(head), width=width, justify=side)  # type: ignore[arg-type]
    for row, style in zip(rows, table.last_column_colours or [""] * len(rows), strict=True):
        *texts, last = row.values()
        printed.add_row(*map(Text, texts), Text(last, style=style))
    stdout_console.print(printed)
    stdout_console.print()


def _make_row_printable(row: Mapping[str, str]) -> dict[str, str]:
    """Return a row with control characters replaced by visible escape sequences."""
    return {make_text_printable(head): make_text_printable(text) for head, text in row.items()}


def _print_row_as_list(row: Mapping[str, str], prose_columns: Collection[str], style: str) -> None:
    """Print a row as a list of headings and values.

    If a value does not fit next to its heading, all values are printed below their headings.
    """
    wide = max(map(cell_len, row))
    room = stdout_console.width - wide - _CHARACTERS_BETWEEN_COLUMNS
    beside = all(
        _compute_longest_unbreakable_length(text, head in prose_columns) <= room
        for head, text in row.items()
    )
    lines = rich_table.Table.grid(padding=(0, _CHARACTERS_BETWEEN_COLUMNS, 0, 0))
    for number, (head, text) in enumerate(row.items(), start=1):
        value = Text(text, style=style if number == len(row) else "", overflow="fold")
        if beside:
            lines.add_row(Text(head), value)
        else:
            lines.add_row(Text(head))
            lines.add_row(Padding(value, (0, 0, 0, _CHARACTERS_BETWEEN_COLUMNS)))
    stdout_console.print(lines)
    stdout_console.print()


def _compute_longest_unbreakable_length(text: str, is_prose: bool) -> int:
    """Return the length of the longest unbreakable piece of a string.

    Prose can be split between words. A number or a name cannot be split.
    """
    return max(map(cell_len, text.split() if is_prose else [text]), default=0)


def _compute_min_column_width(heading: str, cell_texts: Sequence[str], is_prose: bool) -> int:
    """Return the minimum width of a column.

    Headings may be split between words.
    """
    needed = max(_compute_longest_unbreakable_length(text, is_prose) for text in cell_texts)
    if is_prose:
        needed = max(needed, min(_MIN_WIDTH_OF_PROSE_COLUMN, max(map(cell_len, cell_texts))))
    return max(needed, _compute_longest_unbreakable_length(heading, is_prose=True))


def _distribute_column_widths(
    min_widths: Sequence[int], max_widths: Sequence[int], total_width: int
) -> list[int]:
    """Distribute the available width among columns.

    Each column receives its minimum width. The remaining characters are assigned one by one to the
    narrowest column that has not reached its maximum width.
    """
    widths = list(min_widths)
    for _ in range(total_width - sum(min_widths)):
        wanting = [n for n, width in enumerate(widths) if width < max_widths[n]]
        if wanting:
            widths[min(wanting, key=widths.__getitem__)] += 1
    return widths


def _is_number_or_dash(text: str) -> bool:
    """Return True if a string is empty, a dash, or a number."""
    try:
        float(text.strip("<> ").replace(",", ""))
    except ValueError:
        return text in ("", "-")
    return True
