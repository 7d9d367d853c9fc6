"""What is typed as AXIS=VALUES or AXIS=VALUE, for ``--set`` and ``--cell``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from rsfstudy import Rig, Study, history, read_protocol, read_table
from rsfstudy.errors import InvalidValue
from rsfstudy.rig import RIG_QUANTITIES, expand_range, parse_number
from rsfstudy.slider import UserLoading

_FLAG_VALUE_BY_WORD = {"true": True, "yes": True, "false": False, "no": False}


def parse_overrides(study: Study, settings: tuple[str, ...]) -> dict[str, Any]:
    """Values of axes and fields of a study that ``--set`` states."""
    texts = {p for axis in study.axes for p in axis.point_names if axis.labels or "," in p}
    found = _parse_each_assignment(settings, lambda text: parse_axis_assignment(text, texts))
    if "loading" in found:
        given, rig = found["loading"], study.rig
        several = isinstance(given, list)
        found["loading"] = (
            [parse_loading_file(v, rig) for v in given]
            if several
            else parse_loading_file(given, rig)
        )
    return found


def parse_fields(settings: tuple[str, ...]) -> dict[str, Any]:
    """Fields of a scene that ``--set`` states."""
    rule = "must read FIELD=VALUE, as in law=slowness"
    given = _parse_each_assignment(settings, lambda text: split_assignment("--set", text, rule))
    return {name: parse_flag_number_or_text(text) for name, text in given.items()}


def _parse_each_assignment(
    settings: tuple[str, ...], parse_assignment: Callable[[str], tuple[str, Any]]
) -> dict[str, Any]:
    """What each of the settings states, no name twice."""
    found: dict[str, Any] = {}
    for text in settings:
        name, given = parse_assignment(text)
        if name in found:
            raise InvalidValue("--set", text, f"sets {name} twice")
        found[name] = given
    return found


def parse_loading_file(file_path: Any, rig: Rig | None) -> Any:
    """A value of `loading`: what a CSV file tells, which goes by the name of the file."""
    path = Path(str(file_path))
    return read_loading_file(path, rig) if path.suffix.lower() == ".csv" else file_path


def read_loading_file(path: Path, rig: Rig | None) -> UserLoading:
    """The loading that a table tells: a record where it has the column ``time``, else a
    protocol.
    """
    read = history if "time" in read_table(path) else read_protocol
    return read(path, rig, name=path.stem)


def parse_rig(option_texts: Mapping[str, str]) -> Rig:
    """The rig that options state."""
    stated = {
        name: parse_number_or_text(text)
        for name, text in option_texts.items()
        if name in RIG_QUANTITIES
    }
    for field in fields(Rig):
        if field.default is MISSING and field.name not in stated:
            remedy = "A rig is stated by these three at least."
            option = f"--{field.name.replace('_', '-')}"
            raise InvalidValue(option, None, "must be stated", remedy=remedy)
    return Rig(**stated)


def parse_cell_coordinate(text: str) -> tuple[str, str]:
    """One ``AXIS=VALUE``, the value as it is."""
    name, equals, value = text.partition("=")
    if not equals:
        raise InvalidValue("--cell", text, "must read AXIS=VALUE, as in b_over_a=2")
    return name, value


def split_assignment(option_name: str, text: str, rule: str) -> tuple[str, str]:
    """Both sides of a text that reads NAME=VALUE; the rule names what it must read."""
    name, equals, given = (part.strip() for part in text.partition("="))
    if not (name and equals and given):
        raise InvalidValue(option_name, text, rule)
    return name, given


def parse_column_assignments(text: str | None) -> dict[str, str] | None:
    """Which heading stands above which quantity, of ``time=t (s),friction=mu``."""
    rule = "must read NAME=HEADING, as in 'time=t (s),friction=mu'"
    parts = (part for part in (text or "").split(",") if part.strip())
    return dict(split_assignment("--columns", part.strip(), rule) for part in parts) or None


def parse_axis_assignment(text: str, known_labels: Collection[str]) -> tuple[str, Any]:
    """One ``AXIS=VALUES``: a label, a single value, a comma list, start:stop:count, or
    start:stop:count:log. Labels may hold commas.
    """
    name, values = split_assignment("--set", text, "must read AXIS=VALUES, as in b_over_a=2,3,4")
    if values in known_labels:
        return name, [values]
    for label in sorted(known_labels, key=len, reverse=True):
        values = values.replace(label, label.replace(",", "\0"))
    parts = [part.strip().replace("\0", ",") for part in values.split(",")]
    if not all(parts):
        raise InvalidValue("--set", text, "leaves a value out")
    if len(parts) > 1:
        return name, [parse_flag_number_or_text(part) for part in parts]
    return name, expand_range(
        "--set", text, values
    ) if ":" in values else parse_flag_number_or_text(values)


def parse_flag_number_or_text(text: str) -> Any:
    """A flag, a number, or else a text."""
    return (
        _FLAG_VALUE_BY_WORD[text.lower()]
        if text.lower() in _FLAG_VALUE_BY_WORD
        else parse_number_or_text(text)
    )


def parse_number_or_text(text: str) -> float | str:
    """The number that a text is, or else the text."""
    read = parse_number(text)
    return text if read is None else read
