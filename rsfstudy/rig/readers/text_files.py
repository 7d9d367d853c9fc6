"""Reader of text files with one row of numbers per line."""

from __future__ import annotations

import csv
import io
import math
import re
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.formatting import format_count_with_noun
from rsfstudy.rig.readers.tables_from_files_or_objects import LazyTable, TableSource
from rsfstudy.rig.readers.text_layout import (
    COMMENT_LINE_PREFIXES,
    WHITESPACE_DELIMITER,
    TextLayout,
    detect_text_layout,
    is_line_without_data,
)
from rsfstudy.rig.table_columns import EXAMPLE_OF_TABLE_HEADER, Column
from rsfstudy.rig.units import parse_number

#: Characters of tables that pandas can parse.
_CHARACTERS_OF_PLAIN_NUMERIC_TABLES = b"0123456789+-eE \t\r\n"
#: Number of bytes at the beginning of a file that are used to detect the layout. The last line is
#: always used completely.
_MIN_BYTES_FOR_LAYOUT_DETECTION = 2**18
#: Largest fraction of control characters in a text file.
_MAX_FRACTION_OF_CONTROL_CHARACTERS = 0.01
_CONTROL_CHARACTER_PATTERN = re.compile(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f]")
#: Byte order marks of UTF-16. If a UTF-16 file has no byte order mark, the encoding depends on
#: whether the zero bytes are at even or odd positions.
_UTF_16_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff")
_UTF_16_ENCODINGS = ("utf-16-be", "utf-16-le")
#: Options of pandas that convert decimal numbers to the nearest floating-point numbers. Newer
#: versions of pandas use the same conversion by default.
_DOES_PANDAS_PARSE_FLOATS_EXACTLY = (*map(int, pd.__version__.split(".")[:2]),) >= (3, 1)
_EXACT_FLOAT_PARSING_OPTIONS: dict[str, Any] = (
    {} if _DOES_PANDAS_PARSE_FLOATS_EXACTLY else {"float_precision": "round_trip"}
)


class _TextFileRows(NamedTuple):
    """Rows of a text file, as numbers or as strings.

    Parameters
    ----------
    numeric_values : ndarray or None
        Numbers of all fields, as an array of shape (rows, columns), or None if a field is not a
        finite number.
    field_texts : list of list of str
        Fields of each row as strings. This list is used if ``numeric_values`` is None.
    line_numbers : ndarray of int
        Line number of each row.
    """

    numeric_values: np.ndarray | None
    field_texts: list[list[str]]
    line_numbers: np.ndarray


def is_text_file(source: TableSource) -> bool:
    """Return True if the first bytes of a file are text.

    Parameters
    ----------
    source : TableSource
        File.

    Returns
    -------
    bool
        True if the file is a text file.
    """
    if not source.is_file:
        return False
    head = source.first_bytes_of_file
    if head.startswith(_UTF_16_BYTE_ORDER_MARKS) or _find_utf_16_encoding(head):
        return True
    controls = len(_CONTROL_CHARACTER_PATTERN.findall(head))
    return b"\0" not in head and controls <= _MAX_FRACTION_OF_CONTROL_CHARACTERS * len(head)


def read_text_file(source: TableSource) -> LazyTable:
    """Read a table from a text file.

    The columns may be separated by commas, semicolons, tabs or blanks.

    Parameters
    ----------
    source : TableSource
        Text file in UTF-8, UTF-16 or Windows-1252.

    Returns
    -------
    LazyTable
        Columns of the file.

    Raises
    ------
    DataError
        If the file cannot be decoded.
    InvalidValue
        If the file has no header, if rows differ in length, or if numbers have decimal commas and
        the decimal separator is a point.
    """
    name = str(source.path_or_object)
    data = _convert_to_utf_8(source.read_all_bytes(), name)
    end = data.find(b"\n", _MIN_BYTES_FOR_LAYOUT_DETECTION)
    try:
        lines = (data if end < 0 else data[:end]).decode().split("\n")
        layout = detect_text_layout([line.rstrip("\r") for line in lines], source.decimal_separator)
        rows = _read_numeric_rows_with_pandas(data, layout, source.decimal_separator)
        rows = _read_fields_line_by_line(data, layout) if rows is None else rows
    except InvalidValue as error:
        raise error.with_location(name) from error
    except csv.Error as error:
        raise DataError(f"{name}: cannot be read as CSV ({error})") from error
    has_headings = layout.header_line_number > 0
    location = f"{name}, line {layout.header_line_number}" if has_headings else name
    if not layout.headings:
        remedy = (
            "Add a first line with a heading for each column. In each heading, write the "
            f"units in parentheses after the name, for example {EXAMPLE_OF_TABLE_HEADER}."
        )
        raise InvalidValue("table", name, "has no header", remedy=remedy)

    def load(index: int, quantity_name: str) -> Column:
        column = Column(np.empty(0), "", index + 1, rows.line_numbers, name)
        if rows.numeric_values is not None:
            return column._replace(values=rows.numeric_values[:, index])
        convert = _FieldToNumberConverter(quantity_name, column, source.decimal_separator)
        values = [
            convert.convert_to_number(row[index], n) for n, row in enumerate(rows.field_texts)
        ]
        return column._replace(values=np.array(values, dtype=float))

    table = LazyTable(layout.headings, location, load, has_headings)
    _check_row_lengths(rows, layout, name)
    return table


def _find_utf_16_encoding(first_bytes: bytes) -> str:
    """Detect the encoding of UTF-16 text without a byte order mark."""
    pairs = len(first_bytes) // 2
    for encoding, zeros, others in zip(
        _UTF_16_ENCODINGS,
        (first_bytes[::2], first_bytes[1::2]),
        (first_bytes[1::2], first_bytes[::2]),
        strict=True,
    ):
        if pairs > 1 and zeros.count(0) > 0.9 * pairs and not others.count(0):
            return encoding
    return ""


def _convert_to_utf_8(file_bytes: bytes, file_name: str) -> bytes:
    """Convert text to UTF-8 with line feeds, without a byte order mark."""
    head = file_bytes[:_MIN_BYTES_FOR_LAYOUT_DETECTION]
    encoding = (
        "utf-16" if head.startswith(_UTF_16_BYTE_ORDER_MARKS) else _find_utf_16_encoding(head)
    )
    try:
        if encoding:
            file_bytes = file_bytes.decode(encoding).encode()
        elif not file_bytes.isascii():
            file_bytes = file_bytes.removeprefix(b"\xef\xbb\xbf")
            file_bytes.decode()
    except UnicodeDecodeError as error:
        if encoding:
            raise DataError(f"{file_name}: cannot be read as {encoding} ({error})") from error
        # Windows programs write the micro sign as the byte 0xb5.
        file_bytes = file_bytes.decode("cp1252", errors="replace").encode()
    return file_bytes if b"\n" in head or b"\r" not in head else file_bytes.replace(b"\r", b"\n")


def _read_numeric_rows_with_pandas(
    file_bytes: bytes, layout: TextLayout, decimal_separator: str
) -> _TextFileRows | None:
    """Read a table that contains only finite numbers and delimiters.

    If the table contains other characters, the function returns None, and the table must be read
    line by line.
    """
    start = _find_byte_offset_of_line(file_bytes, layout.first_line_number_after_header)
    delimiter = r"\s+" if layout.delimiter == WHITESPACE_DELIMITER else layout.delimiter
    allowed = (
        _CHARACTERS_OF_PLAIN_NUMERIC_TABLES + decimal_separator.encode() + layout.delimiter.encode()
    )
    body = file_bytes[start:].rstrip()
    if not body or body.translate(None, allowed):
        return None
    try:
        numbers = pd.read_csv(
            io.BytesIO(body),
            sep=delimiter,
            header=None,
            dtype=float,
            decimal=decimal_separator,
            **_EXACT_FLOAT_PARSING_OPTIONS,
        ).to_numpy()
    except (ValueError, pd.errors.ParserError):
        return None
    if numbers.shape[1] != len(layout.headings) or not np.isfinite(numbers).all():
        return None
    lines = layout.first_line_number_after_header + np.arange(body.count(b"\n") + 1)
    if len(lines) != len(numbers):
        filled = [n for n, line in enumerate(body.split(b"\n")) if line.strip()]
        lines = lines[filled]
    return _TextFileRows(numbers, [], lines) if len(lines) == len(numbers) else None


def _find_byte_offset_of_line(file_bytes: bytes, line_number: int) -> int:
    """Return the position of the first byte of a line."""
    start = 0
    for _line in range(line_number - 1):
        start = file_bytes.find(b"\n", start) + 1
        if not start:
            return len(file_bytes)
    return start


def _read_fields_line_by_line(file_bytes: bytes, layout: TextLayout) -> _TextFileRows:
    """Read the fields of each row, and skip blank lines and comments."""
    body = file_bytes[
        _find_byte_offset_of_line(file_bytes, layout.first_line_number_after_header) :
    ].decode()
    first = layout.first_line_number_after_header
    found: list[list[str]] = []
    numbers: list[int] = []
    if layout.delimiter == WHITESPACE_DELIMITER:
        for number, line in enumerate(body.split("\n"), first):
            if not is_line_without_data(line):
                found.append(line.split())
                numbers.append(number)
        return _TextFileRows(None, found, np.array(numbers, dtype=int))
    reader = csv.reader(io.StringIO(body, newline=""), delimiter=layout.delimiter)
    for row in reader:
        is_comment = row and row[0].lstrip().startswith(COMMENT_LINE_PREFIXES)
        if any(row) and not is_comment and not (len(row) == 1 and is_line_without_data(row[0])):
            found.append(row)
            numbers.append(first - 1 + reader.line_num)
    return _TextFileRows(None, found, np.array(numbers, dtype=int))


def _check_row_lengths(rows: _TextFileRows, layout: TextLayout, file_name: str) -> None:
    """Raise ``InvalidValue`` if a row has more or fewer fields than the header.

    Empty fields at the end of a row are ignored.
    """
    size = len(layout.headings)
    for number, row in zip(rows.line_numbers, rows.field_texts, strict=False):
        while len(row) > size and not row[-1].strip():
            row.pop()
        if len(row) != size:
            rule = f"has {format_count_with_noun(len(row), 'field')}, but the header has {size}"
            remedy = (
                "If the comma is a decimal separator, pass --decimal ',' (in Python, decimal=',')."
                if len(row) > size
                else ""
            )
            wrong = InvalidValue("line", layout.delimiter.join(row), rule, remedy=remedy)
            raise wrong.with_location(f"{file_name}, line {number}")


class _FieldToNumberConverter(NamedTuple):
    """Converter that parses the fields of a column as numbers.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity for error messages.
    column : Column
        Column that provides the location of a field for error messages.
    decimal_separator : {".", ","}
        Decimal separator.
    """

    quantity_name: str
    column: Column
    decimal_separator: str

    def convert_to_number(self, field_text: str, row_index: int) -> float:
        """Convert a field to a number.

        Parameters
        ----------
        field_text : str
            Field. An empty field is converted to NaN.
        row_index : int
            Index of the row.

        Returns
        -------
        float
            Number.

        Raises
        ------
        InvalidValue
            If the field is not a finite number.
        """
        if not field_text.strip():
            return math.nan
        pointed = (
            field_text.replace(",", ".", 1)
            if self.decimal_separator == "," and "." not in field_text
            else field_text
        )
        found = parse_number(pointed)
        if found is None:
            remedy = (
                "Use only the digits 0 to 9, a decimal point and an exponent, for example 1.5e-3. "
                "Write the units in the header."
            )
            if "," in field_text:
                remedy = "Use a decimal point, or pass decimal=',' (--decimal ',')."
            wrong = InvalidValue(self.quantity_name, field_text, "is not a number", remedy=remedy)
            raise wrong.with_location(self.column.format_location_of_row(row_index))
        if not math.isfinite(found):
            raise InvalidValue(
                self.quantity_name, field_text.strip(), "must be finite"
            ).with_location(self.column.format_location_of_row(row_index))
        return found
