"""Protocols from CSV files, whose header names what each column holds and its units."""

from __future__ import annotations

import csv
import re
from collections import Counter
from pathlib import Path

from rsfstudy.doors import check_file, door
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.units import number
from rsfstudy.slider.protocol import KEYS, Protocol, protocol

#: Units of the slider, which need no laboratory.
_OF_SLIDER = {
    "velocity": "V_*", "duration": "D_c/V_*", "distance": "D_c", "step": "D_c",
    "normal_stress": "sigma_*",
}  # fmt: skip
_HEADER = re.compile(r"(\w+)\s*[\[(]([^\[\]()]*)[\])]")
_EXAMPLE = "velocity (um/s), distance (um)"


@door
def read_protocol(
    path: str | Path, laboratory: Laboratory | None = None, name: str = "protocol"
) -> Protocol:
    """A loading history from a CSV file.

    Its first line names the columns and their units, as in ``velocity (um/s), duration (s)``: a
    velocity, and the duration or the distance of each segment (a field may be empty), and perhaps a
    sudden ``step`` at its beginning, or the ``normal_stress`` during it. Units of the slider
    (``V_*``, ``D_c``, ``D_c/V_*``, ``sigma_*``) need no laboratory.

    Parameters
    ----------
    path : str or Path
    laboratory : Laboratory, optional
        The rig whose units are used.
    name : str
        What the protocol is called in results.

    Raises
    ------
    DataError
        Where there is no such file of text.
    InvalidValue
        For a header without units, or a field that is no number, with its line and column.
    """
    check_file("protocol", path)
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            rows = [(n, row) for n, row in enumerate(csv.reader(file), start=1) if any(row)]
    except (OSError, UnicodeError, csv.Error) as error:
        raise DataError(f"{path}: cannot be read as CSV ({error})") from error
    if not rows:
        remedy = f"Its first line reads, for instance, {_EXAMPLE}."
        raise InvalidValue("protocol", str(path), "has no header", remedy=remedy)
    columns = [_column(text) for text in rows[0][1]]
    for key, count in Counter(key for key, _units in columns).items():
        if count > 1:
            raise InvalidValue("column", key, "stands twice in the header")
    segments = [_segment(row, columns, f"{path}, line {n}") for n, row in rows[1:]]
    of_slider = all(_OF_SLIDER[key] == units for key, units in columns)
    if of_slider:
        plain = [{key: float(text) for key, (text, _units) in s.items()} for s in segments]
        return protocol(plain, name)
    if laboratory is None:
        remedy = "Give a laboratory, or the units of the slider: V_*, D_c, D_c/V_*."
        units = ", ".join(units for _key, units in columns)
        raise InvalidValue("units", units, "need the scales of a rig", remedy=remedy)
    stated = [
        {key: f"{text} {units}" for key, (text, units) in segment.items()} for segment in segments
    ]
    return laboratory.protocol(stated, name)


def _column(text: str) -> tuple[str, str]:
    """Key and units of a column."""
    match = _HEADER.fullmatch(text.strip())
    if not match:
        remedy = f"Write the header as in {_EXAMPLE}."
        raise InvalidValue("header", text, "names no column with its units", remedy=remedy)
    if match[1] not in KEYS:
        raise InvalidValue("column", match[1], "is unknown", choices=KEYS)
    return match[1], match[2].strip()


def _segment(
    row: list[str], columns: list[tuple[str, str]], place: str
) -> dict[str, tuple[str, str]]:
    """The fields of a line that are not empty, with their units."""
    if len(row) != len(columns):
        rule = f"has {len(row)} fields, and the header {len(columns)}"
        raise InvalidValue("line", ",".join(row), rule).at(place)
    segment = {}
    for column, (text, (key, units)) in enumerate(zip(row, columns, strict=True), start=1):
        if not text.strip():
            continue
        if number(text) is None:
            wrong = InvalidValue(key, text, "is no number", remedy="Units stand in the header.")
            raise wrong.at(f"{place}, column {column}")
        segment[key] = text.strip(), units
    return segment
