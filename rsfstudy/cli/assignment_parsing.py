"""Functions that parse ``AXIS=VALUES`` assignments on the command line.

The functions convert the values of ``--set``, ``--cell``, ``--columns`` and the rig options to
Python values.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from rsfstudy import Rig, Study, history, read_protocol
from rsfstudy.errors import InvalidValue
from rsfstudy.rig import expand_range, has_time_column, parse_number
from rsfstudy.slider import UserLoading

_BOOLEAN_BY_WORD = {"true": True, "yes": True, "false": False, "no": False}


def parse_overrides(study: Study, assignments: tuple[str, ...]) -> dict[str, Any]:
    """Parse the values of ``--set`` for a study.

    Parameters
    ----------
    study : Study
        Study whose axis labels are recognised in the values.
    assignments : tuple of str
        Values of the option ``--set``.

    Returns
    -------
    dict
        Value or list of values of each axis or field. If the value of the field ``loading`` is the
        path of a CSV file, the value is replaced by the loading in this file.

    Raises
    ------
    InvalidValue
        If an assignment is malformed or a name is set twice.
    """
    texts = {p for axis in study.axes for p in axis.point_names if axis.labels or "," in p}
    found = _parse_assignments_rejecting_duplicates(
        assignments, lambda text: parse_axis_assignment(text, texts)
    )
    if "loading" in found:
        given, rig = found["loading"], study.rig
        several = isinstance(given, list)
        found["loading"] = (
            [read_loading_if_csv_path(v, rig) for v in given]
            if several
            else read_loading_if_csv_path(given, rig)
        )
    return found


def parse_scene_field_assignments(assignments: tuple[str, ...]) -> dict[str, Any]:
    """Parse the values of ``--set`` for a single scene.

    Parameters
    ----------
    assignments : tuple of str
        Values of the option ``--set``, in the form ``FIELD=VALUE``.

    Returns
    -------
    dict
        Values by field name.

    Raises
    ------
    InvalidValue
        If an assignment is malformed or a field is set twice.
    """
    rule = "must have the form FIELD=VALUE, for example law=slowness"
    given = _parse_assignments_rejecting_duplicates(
        assignments, lambda text: split_assignment("--set", text, rule)
    )
    return {name: parse_boolean_number_or_text(text) for name, text in given.items()}


def _parse_assignments_rejecting_duplicates(
    assignments: tuple[str, ...], parse_assignment: Callable[[str], tuple[str, Any]]
) -> dict[str, Any]:
    """Parse assignments, and raise an error if a name is set twice."""
    found: dict[str, Any] = {}
    for text in assignments:
        name, given = parse_assignment(text)
        if name in found:
            rule = f"must not set {name} more than once"
            raise InvalidValue("--set", text, rule, remedy="Remove one of the values.")
        found[name] = given
    return found


def read_loading_if_csv_path(loading_or_path: Any, rig: Rig | None) -> Any:
    """If a value is the path of a CSV file, read the loading from this file.

    Parameters
    ----------
    loading_or_path : object
        Value of the field ``loading``.
    rig : Rig or None
        Rig that converts the values in the file to dimensionless values.

    Returns
    -------
    object
        Loading, if the value is the path of a CSV file. The loading has the name of the file. Any
        other value is returned unchanged.
    """
    path = Path(str(loading_or_path))
    return read_loading_file(path, rig) if path.suffix.lower() == ".csv" else loading_or_path


def read_loading_file(path: Path, rig: Rig | None) -> UserLoading:
    """Read a loading from a table.

    Parameters
    ----------
    path : Path
        File. A table with a column of times is a record of the load point. Any other table is a
        protocol.
    rig : Rig or None
        Rig that converts the values in the file to dimensionless values.

    Returns
    -------
    UserLoading
        Loading with the name of the file.
    """
    read = history if has_time_column(path) else read_protocol
    return read(path, rig, name=path.stem)


def build_rig_from_options(text_by_option_name: Mapping[str, str]) -> Rig:
    """Create a rig from command line options.

    Parameters
    ----------
    text_by_option_name : mapping of str to str
        Option values by option name. Options that do not belong to the rig are ignored.

    Returns
    -------
    Rig
        Rig with the specified quantities.

    Raises
    ------
    InvalidValue
        If a required quantity is missing.
    """
    stated = {
        name: parse_number_or_text(text)
        for name, text in text_by_option_name.items()
        if name in Rig.QUANTITIES
    }
    for field in fields(Rig):
        if field.default is MISSING and field.name not in stated:
            needed = "a normal stress, a slip distance and a reference velocity"
            option = f"--{field.name.replace('_', '-')}"
            raise InvalidValue(option, None, "is required", remedy=f"Every rig requires {needed}.")
    return Rig(**stated)


def parse_cell_coordinate(text: str) -> tuple[str, str]:
    """Split an ``AXIS=VALUE`` argument of the option ``--cell``.

    Parameters
    ----------
    text : str
        Argument of the option.

    Returns
    -------
    tuple of str
        Name of the axis and value. The value is not converted to a number.

    Raises
    ------
    InvalidValue
        If the argument has no equals sign.
    """
    name, equals, value = text.partition("=")
    if not equals:
        raise InvalidValue("--cell", text, "must have the form AXIS=VALUE, for example b_over_a=2")
    return name, value


def split_assignment(option_name: str, text: str, expected_form: str) -> tuple[str, str]:
    """Split an assignment at the first equals sign.

    Parameters
    ----------
    option_name : str
        Name of the option, for the error message.
    text : str
        Assignment such as ``law=slowness``.
    expected_form : str
        Description of the expected form, for the error message.

    Returns
    -------
    tuple of str
        Name and value without surrounding spaces.

    Raises
    ------
    InvalidValue
        If the name, the equals sign or the value is missing.
    """
    name, equals, given = (part.strip() for part in text.partition("="))
    if not (name and equals and given):
        raise InvalidValue(option_name, text, expected_form)
    return name, given


def parse_column_assignments(text: str | None) -> dict[str, str] | None:
    """Parse the option ``--columns``.

    Parameters
    ----------
    text : str or None
        Comma-separated assignments such as ``time=t (s),friction=mu``.

    Returns
    -------
    dict of str to str or None
        Column headings by quantity. The function returns None if the option was not used or is
        empty.

    Raises
    ------
    InvalidValue
        If an assignment is malformed.
    """
    rule = "must have the form NAME=HEADING, for example 'time=t (s),friction=mu'"
    parts = (part for part in (text or "").split(",") if part.strip())
    return dict(split_assignment("--columns", part.strip(), rule) for part in parts) or None


def parse_axis_assignment(text: str, axis_labels: Collection[str]) -> tuple[str, Any]:
    """Parse an assignment of values to an axis.

    Parameters
    ----------
    text : str
        Assignment ``AXIS=VALUES``. The values are a label, a single value, a comma-separated list,
        a range ``start:stop:count``, or a logarithmic range ``start:stop:count:log``.
    axis_labels : collection of str
        Labels of the axes. The function does not split a known label, because labels may contain
        commas.

    Returns
    -------
    tuple
        Name of the axis, and a value or a list of values.

    Raises
    ------
    InvalidValue
        If the assignment is malformed or a value in the list is missing.
    """
    name, values = split_assignment(
        "--set", text, "must have the form AXIS=VALUES, for example b_over_a=2,3,4"
    )
    if values in axis_labels:
        return name, [values]
    for label in sorted(axis_labels, key=len, reverse=True):
        values = values.replace(label, label.replace(",", "\0"))
    parts = [part.strip().replace("\0", ",") for part in values.split(",")]
    if not all(parts):
        remedy = "Write a value between the commas, or remove one comma."
        raise InvalidValue(f"--set {text!r}", ..., "contains an empty value", remedy=remedy)
    if len(parts) > 1:
        return name, [parse_boolean_number_or_text(part) for part in parts]
    return name, expand_range(
        "--set", text, values
    ) if ":" in values else parse_boolean_number_or_text(values)


def parse_boolean_number_or_text(text: str) -> Any:
    """Convert a string to a Boolean or a number if possible.

    Parameters
    ----------
    text : str
        String such as ``yes``, ``false``, ``0.01`` or ``slip``.

    Returns
    -------
    bool, float or str
        Converted value. Any other string is returned unchanged.
    """
    return (
        _BOOLEAN_BY_WORD[text.lower()]
        if text.lower() in _BOOLEAN_BY_WORD
        else parse_number_or_text(text)
    )


def parse_number_or_text(text: str) -> float | str:
    """Convert a string to a number if possible.

    Parameters
    ----------
    text : str
        String such as ``0.01`` or ``10 um``.

    Returns
    -------
    float or str
        Number. Any other string is returned unchanged.
    """
    read = parse_number(text)
    return text if read is None else read
