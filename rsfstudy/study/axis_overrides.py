"""Functions that select axis points or replace the field values of an axis."""

from __future__ import annotations

import re
from collections.abc import Hashable, Sequence
from functools import partial
from typing import Any

from rsfstudy.axes import Axis, AxisPointFieldValues
from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import format_number_or_text, is_sequence_of_axis_values


def select_axis_points(axis: Axis, labels_or_numbers: Sequence[Any]) -> Axis:
    """Select axis points by label (zipped axes) or by number (numbered axes).

    Parameters
    ----------
    axis : Axis
        Zipped or numbered axis.
    labels_or_numbers : sequence of str or int
        Points to select.

    Returns
    -------
    Axis
        Axis with the selected points. The axis keeps the information about the sampling method only
        if the selection consists of the first ``n`` samples in order.

    Raises
    ------
    InvalidValue
        If a selected point does not exist on the axis.
    """
    rows: dict[Any, AxisPointFieldValues] = dict(
        zip(axis.labels or range(len(axis)), axis.rows, strict=True)
    )
    for point in labels_or_numbers:
        if point not in rows:
            rule, choices = f"does not exist on axis {axis.dimension!r}", axis.labels or ()
            if axis.has_numbered_points:
                rule += f". The points are numbered from 0 to {len(axis) - 1}"
            raise InvalidValue("point", point, rule, choices=choices)
    if axis.labels is not None:
        return Axis(axis.dimension, {label: rows[label] for label in labels_or_numbers}, axis.units)
    first = list(labels_or_numbers) == list(range(len(labels_or_numbers)))
    drawn = (
        {**axis.sampling_info, "n": len(labels_or_numbers)} if axis.sampling_info and first else {}
    )
    return axis.with_rows([rows[number] for number in labels_or_numbers], axis.units, drawn)


def replace_field_values(axis: Axis, field_name: str, new_values: Sequence[Any]) -> Axis:
    """Replace the values of one field of a zipped or numbered axis.

    Parameters
    ----------
    axis : Axis
        Axis that sets several fields at each point.
    field_name : str
        Name of the field to override. Points that do not set this field remain unchanged.
    new_values : sequence
        New values. A numbered axis accepts exactly one value.

    Returns
    -------
    Axis
        Axis with the new values. If the axis is zipped, the new axis has one point for each
        combination of a new value with the values of the other fields. A point that already exists
        keeps its label, and the label of a new point depends only on the field values of the new
        point. If the axis is numbered, the information about the sampling method is removed.

    Raises
    ------
    InvalidValue
        If a numbered axis receives several values, or if a value is not hashable.
    """
    if axis.has_numbered_points:
        if len(new_values) != 1:
            rule = (
                f"varies along the axis {axis.dimension}, so an override must be a single "
                "value for all points"
            )
            raise InvalidValue(field_name, new_values, rule, remedy="Pass a single value.")
        return axis.with_rows([{**row, field_name: new_values[0]} for row in axis.rows], axis.units)
    assert axis.labels is not None
    for value in new_values:
        if not isinstance(value, Hashable):
            rule = "must be a number, a string, True, False or a part"
            raise InvalidValue(
                field_name, value, rule, remedy=f"Write {field_name}=[first, second]."
            )
    existing = {
        _convert_row_to_hashable_key(row): label
        for label, row in zip(axis.labels, axis.rows, strict=True)
    }
    others = {
        _convert_row_to_hashable_key({**row, field_name: None})
        for row in axis.rows
        if field_name in row
    }
    points: dict[str, AxisPointFieldValues] = {}
    for label, row in zip(axis.labels, axis.rows, strict=True):
        if field_name not in row:
            points[label] = row
            continue
        for value in map(partial(Axis.convert_to_plain_value, field_name), new_values):
            changed = {**row, field_name: value}
            if changed in points.values():
                continue
            new = existing.get(_convert_row_to_hashable_key(changed), "")
            if not new:
                new = _relabel_overridden_point(
                    label,
                    field_name,
                    row[field_name],
                    value,
                    new_value_identifies_point=len(others) == 1,
                )
                while new in points or new in axis.labels:
                    new = f"{label}, {new}"
            points[new] = changed
    return Axis(axis.dimension, points, axis.units)


def _convert_row_to_hashable_key(axis_row: AxisPointFieldValues) -> frozenset[tuple[str, Any]]:
    """Convert the fields and values of a row to a hashable key."""
    return frozenset(axis_row.items())


def _relabel_overridden_point(
    label: str, field_name: str, old_value: Any, new_value: Any, *, new_value_identifies_point: bool
) -> str:
    """Return the label of a point after the value of one field has changed.

    If the label contains the old value, as in ``"imposed, alpha = 0.25"``, the new value replaces
    the old value in the label. If the label does not contain the old value, but the new value
    identifies the point (``new_value_identifies_point``), the label is replaced by the new value,
    as in ``"alpha = 0.3"``. In all other cases, text such as ``"alpha = 0.3"`` is appended to the
    label.
    """
    text = f"{field_name} = {_format_without_rounding(new_value)}"
    old_text = re.escape(_format_without_rounding(old_value))
    stated = rf"(?<!\w){re.escape(field_name)} = {old_text}(?![\w.])"
    replaced, count = re.subn(stated, lambda _found: text, label)
    if count:
        return replaced
    return text if new_value_identifies_point else f"{label}, {text}"


def _format_without_rounding(value: Any) -> str:
    """Format a value with six digits, or with all digits if six digits are not exact."""
    short_text = format_number_or_text(value)
    is_rounded = isinstance(value, float) and float(short_text) != value
    return repr(value) if is_rounded else short_text


def convert_field_values_to_plain_data(field_name: str, value_or_list: Any) -> Any:
    """Convert a field value, or a list of field values, to plain data.

    Parameters
    ----------
    field_name : str
        Name of the field.
    value_or_list : object
        Value or list of values.

    Returns
    -------
    object
        Plain value or list of plain values.
    """
    return (
        [Axis.convert_to_plain_value(field_name, each) for each in value_or_list]
        if is_sequence_of_axis_values(value_or_list)
        else Axis.convert_to_plain_value(field_name, value_or_list)
    )
