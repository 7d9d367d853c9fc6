"""Functions that detect the delimiter, the header and the first row of a text file.

The detection compares the fields of the first lines. A line that contains mostly numbers is a row
of the table. The header is the last line of text that precedes the first row and has the same
number of fields as the rows.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rsfstudy.errors import InvalidValue
from rsfstudy.rig.readers.tables_from_files_or_objects import append_units_to_headings
from rsfstudy.rig.units import find_si_factor_and_exponents, parse_number

#: Delimiter of files in which one or more blanks separate the columns.
WHITESPACE_DELIMITER = " "
#: First characters of comment lines.
COMMENT_LINE_PREFIXES = ("#", "%")
#: Maximum number of lines that are compared to detect the layout.
_MAX_LINES_FOR_LAYOUT_DETECTION = 1000
#: Maximum number of characters of a number in the compared lines.
_MAX_NUMBER_TEXT_LENGTH = 50
_DELIMITER_DECLARATION_PATTERN = re.compile(r'"?sep=(.)"?', re.IGNORECASE)
_DECIMAL_COMMA_PATTERN = re.compile(r"[-+]?[0-9]*,[0-9]+(?:[eE][-+]?[0-9]+)?")
_HORIZONTAL_RULE_PATTERN = re.compile(r"[-=_+|* \t]{3,}")
#: Names of units that often occur below headings, although rsfstudy cannot convert them.
_UNCONVERTIBLE_UNIT_NAMES = frozenset(
    ("", "-", ".", "1", "none", "v", "mv", "bit", "bits", "counts", "degc", "°c", "c", "hz", "nr")
)


class TextLayout(NamedTuple):
    """Layout of a text file.

    Parameters
    ----------
    delimiter : str
        Delimiter of the columns, or `WHITESPACE_DELIMITER`.
    headings : list of str
        Headings of the columns, with units. If the file has no header, the headings are the numbers
        of the columns, counted from 1. The list is empty if the file contains no text.
    header_line_number : int
        Number of the line with the headings, counted from 1, or 0 if the file has no header.
    first_line_number_after_header : int
        Number of the first line after the header, counted from 1.
    """

    delimiter: str
    headings: list[str]
    header_line_number: int
    first_line_number_after_header: int


def is_line_without_data(line: str) -> bool:
    """Return True if a line is blank, a comment, or a horizontal rule such as ``-----``.

    Parameters
    ----------
    line : str
        Line of a text file.

    Returns
    -------
    bool
        True if the line contains no data.
    """
    bare = line.strip()
    return (
        not bare
        or bare.startswith(COMMENT_LINE_PREFIXES)
        or bool(_HORIZONTAL_RULE_PATTERN.fullmatch(bare))
    )


def split_line_into_fields(line: str, delimiter: str) -> list[str]:
    """Split a line into fields.

    Parameters
    ----------
    line : str
        Line of a text file.
    delimiter : str
        Delimiter of the fields, or `WHITESPACE_DELIMITER`.

    Returns
    -------
    list of str
        Fields without surrounding blanks.
    """
    if delimiter == WHITESPACE_DELIMITER:
        return line.split()
    return [field.strip() for row in csv.reader([line], delimiter=delimiter) for field in row]


def detect_text_layout(lines: Sequence[str], decimal_separator: str) -> TextLayout:
    """Detect the layout of a text file from its first lines.

    Parameters
    ----------
    lines : sequence of str
        First lines of the file.
    decimal_separator : {".", ","}
        Decimal separator.

    Returns
    -------
    TextLayout
        Layout of the file.

    Raises
    ------
    InvalidValue
        If numbers have decimal commas and ``decimal_separator`` is a point.
    """
    lines = lines[:_MAX_LINES_FOR_LAYOUT_DETECTION]
    skipped, stated = _find_declared_delimiter(lines)
    candidates = [stated] if stated else ["\t", ";", WHITESPACE_DELIMITER, ","]
    for delimiter in candidates:
        if delimiter == decimal_separator:
            continue
        rows = [
            [] if is_line_without_data(line) else split_line_into_fields(line, delimiter)
            for line in lines[skipped:]
        ]
        sizes = Counter(len(row) for row in rows if _is_row_mostly_numbers(row, decimal_separator))
        if decimal_separator == "." and delimiter != ",":
            _raise_if_decimal_commas(rows, sizes)
        size = max(sizes, key=lambda n: (sizes[n], n), default=0)
        if size > 1 or (size == 1 and delimiter == candidates[-1]):
            first = next(
                n for n, row in enumerate(rows, skipped)
                if len(row) == size and _is_row_mostly_numbers(row, decimal_separator)
            )  # fmt: skip
            return _find_header_before_first_row(lines, skipped, first, delimiter, size)
    return _detect_layout_without_numbers(lines, skipped, stated)


def _find_declared_delimiter(lines: Sequence[str]) -> tuple[int, str]:
    """Return the number of lines before the table, and the declared delimiter.

    Spreadsheet programs declare the delimiter in a line such as ``sep=;``.
    """
    for number, line in enumerate(lines):
        if line.strip():
            match = _DELIMITER_DECLARATION_PATTERN.fullmatch(line.strip("\r\n"))
            return (number + 1, match[1]) if match else (0, "")
    return 0, ""


def _is_row_mostly_numbers(fields: Sequence[str], decimal_separator: str) -> bool:
    """Return True if more than half of the non-empty fields are numbers."""
    texts = [text for text in fields if text]
    if decimal_separator == ",":
        texts = [text if "." in text else text.replace(",", ".", 1) for text in texts]
    return 2 * sum(map(_is_number, texts)) > len(texts)


def _is_number(text: str) -> bool:
    return len(text) < _MAX_NUMBER_TEXT_LENGTH and parse_number(text) is not None


def _raise_if_decimal_commas(
    rows: Sequence[Sequence[str]], row_count_by_length: Counter[int]
) -> None:
    """Raise ``InvalidValue`` if most rows consist of numbers with decimal commas."""
    commas = [
        row
        for row in rows
        if len(row) > 1
        and any(_DECIMAL_COMMA_PATTERN.fullmatch(text) for text in row)
        and all(not t or _DECIMAL_COMMA_PATTERN.fullmatch(t) or _is_number(t) for t in row)
    ]
    if len(commas) > sum(row_count_by_length.values()):
        number = next(text for text in commas[0] if "," in text)
        remedy = "Pass decimal=',' (--decimal ','), or write decimal points."
        raise InvalidValue("number", number, "has a decimal comma", remedy=remedy)


def _find_header_before_first_row(
    lines: Sequence[str], first_line: int, first_row: int, delimiter: str, column_count: int
) -> TextLayout:
    """Find the header before the first row of numbers.

    Line numbers in the arguments are counted from 0.
    """
    texts = [
        (number, fields)
        for number, line in enumerate(lines[:first_row])
        if number >= first_line
        and (fields := _split_line_into_headings(line, delimiter, column_count))
    ]
    whole = [(number, fields) for number, fields in texts if len(fields) == column_count]
    # A comment or a single word before the table is not a header.
    whole = whole or [
        (number, fields)
        for number, fields in texts
        if (len(fields) > 1 or fields[0].endswith((")", "]")))
        and not lines[number].lstrip().startswith(COMMENT_LINE_PREFIXES)
    ]
    if not whole:
        return TextLayout(delimiter, [str(n + 1) for n in range(column_count)], 0, first_row + 1)
    at, headings = whole[-1]
    body = at + 1
    if len(whole) > 1 and len(whole[-2][1]) == len(headings) and _look_like_units(headings):
        headings = append_units_to_headings(whole[-2][1], headings)
        at = whole[-2][0]
    return TextLayout(delimiter, headings, at + 1, body + 1)


def _split_line_into_headings(line: str, delimiter: str, column_count: int) -> list[str]:
    """Split a line of text into headings.

    If possible, the header is split into as many headings as there are fields in a row. The list is
    empty if the line contains no text, or if the line contains a number.
    """
    text = line.strip().lstrip("".join(COMMENT_LINE_PREFIXES)).strip()
    if not text or _HORIZONTAL_RULE_PATTERN.fullmatch(text):
        return []
    first: list[str] = []
    for fields in _iterate_possible_header_splits(text, delimiter):
        first = first or fields
        if len(fields) == column_count:
            first = fields
            break
    fields = first
    has_number = any(text != "1" and _is_number(text) for text in fields)
    return [] if has_number or not any(fields) else fields


def _iterate_possible_header_splits(text: str, delimiter: str) -> Iterator[list[str]]:
    """Yield the headings of a header, split at each of several delimiters."""
    if delimiter == WHITESPACE_DELIMITER:
        yield from _iterate_header_splits_at_blanks(text)
    for mark in (delimiter, "\t", ";", ","):
        if mark != WHITESPACE_DELIMITER:
            yield split_line_into_fields(text, mark)
    yield re.split(r"\s{2,}", text)
    if delimiter != WHITESPACE_DELIMITER:
        yield from _iterate_header_splits_at_blanks(text)


def _iterate_header_splits_at_blanks(text: str) -> Iterator[list[str]]:
    """Split a header in which blanks separate the headings and the units."""
    words = text.split()
    yield _append_bracketed_units_to_words(words)
    yield re.split(r"(?<=[)\]])\s+", text)
    if len({word.startswith(("(", "[")) for word in words}) == 1:
        yield words


def _append_bracketed_units_to_words(words: Sequence[str]) -> list[str]:
    """Join each word with the bracketed units that follow the word."""
    groups: list[list[str]] = []
    depth = 0
    for word in words:
        if groups and (depth > 0 or word.startswith(("(", "["))):
            groups[-1].append(word)
        else:
            groups.append([word])
        depth += word.count("(") - word.count(")")
    return [" ".join(group) for group in groups]


def _look_like_units(fields: Sequence[str]) -> bool:
    """Return True if all fields of a line look like units, and at least one unit is known."""
    bare = [text.strip(" ()[]") for text in fields]
    known = [find_si_factor_and_exponents(text) is not None for text in bare]
    return any(known) and all(
        found or text.lower() in _UNCONVERTIBLE_UNIT_NAMES
        for found, text in zip(known, bare, strict=True)
    )


def _detect_layout_without_numbers(
    lines: Sequence[str], first_line: int, declared_delimiter: str
) -> TextLayout:
    """Return the layout of a file without rows of numbers.

    The header is the first line that is not blank.
    """
    for number, line in enumerate(lines):
        text = line.strip().lstrip("".join(COMMENT_LINE_PREFIXES)).strip()
        if number >= first_line and text:
            delimiter = declared_delimiter or next(
                (mark for mark in "\t;," if mark in text),
                "," if {"(", "["} & {*text} else WHITESPACE_DELIMITER,
            )
            return TextLayout(
                delimiter, split_line_into_fields(text, delimiter), number + 1, number + 2
            )
    return TextLayout(",", [], 1, 1)
