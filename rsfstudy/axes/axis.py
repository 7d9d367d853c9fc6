"""One dimension of a lattice: a plain list of values, or points of several fields, that are
labelled or numbered.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rsfstudy._deprecation import renamed_keywords, renamed_members, warn_renamed
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import format_value, is_sequence_of_axis_values
from rsfstudy.quantities import is_variable_name
from rsfstudy.slider import normalise_field_value

AxisRow = Mapping[str, Any]


@renamed_keywords
@renamed_members
@guard_methods
@dataclass(frozen=True, init=False)
class Axis:
    """One dimension of a lattice.

    Parameters
    ----------
    dimension : str
        Name of the dimension; for a plain axis the field it varies, of the scene or of the measure
        (of the scene where both have one of that name).
    values : sequence, mapping of str to mapping, or mapping of str to sequence
        The values of that field, where a class stands for a part of the user's own; or, for a
        zipped axis, a label for each point and the fields set there, as in
        ``{"constant": {"normal_stress": "constant"}, ...}``, or the rig there; or, for points that
        are numbered from 0, the values of each field: see `samples` and `cases`.
    units : mapping of str to str, optional
        Units of the fields that are in units, in a study of a rig: see `Rig.axis`.
    sampling_info : mapping, optional
        How the points were drawn, as plain data.

    Raises
    ------
    InvalidValue
        For an axis that is empty, repeats a value or holds a non-finite one. Numbered points may be
        alike: draws are.
    """

    dimension: str
    rows: tuple[AxisRow, ...]
    labels: tuple[str, ...] | None
    units: Mapping[str, str]
    sampling_info: Mapping[str, Any]

    def __init__(
        self,
        dimension: str,
        values: Sequence[Any] | np.ndarray | Mapping[str, Any],
        units: Mapping[str, str] | None = None,
        sampling_info: Mapping[str, Any] | None = None,
    ) -> None:
        if not is_variable_name(dimension):
            rule = "must be named by a Python identifier, its accents composed (NFC)"
            raise InvalidValue("axis", dimension, rule)
        labels: tuple[str, ...] | None = None
        if (
            isinstance(values, Mapping)
            and values
            and all(map(is_sequence_of_axis_values, values.values()))
        ):
            rows = _rows_from_columns(dimension, values)
        elif isinstance(values, Mapping):
            labels, rows = tuple(values), _rows_from_points(dimension, values)
        else:
            listed = [values] if isinstance(values, str) else values
            if not is_sequence_of_axis_values(listed):
                raise InvalidValue(dimension, values, "must be a list of values")
            rows = tuple({dimension: to_plain_value(dimension, value)} for value in listed)
            if any(row[dimension] is None for row in rows):
                raise InvalidValue(dimension, None, "must be a value on an axis")
        beside = ({} if mapping is None else mapping for mapping in (units, sampling_info))
        held = (dimension, rows, labels, *beside)
        for name, value in zip(self.__dataclass_fields__, held, strict=True):
            object.__setattr__(self, name, value)
        self._check_values()

    @classmethod
    def samples(
        cls,
        distribution: Mapping[str, Any],
        n: int,
        seed: int = 0,
        *,
        method: str = "sobol",
        covariance: Any = None,
        fields: Mapping[str, str | Callable[[Mapping[str, np.ndarray]], Any]] | None = None,
        units: Mapping[str, str] | None = None,
        dimension: str = "sample",
    ) -> Axis:
        """Samples of several fields at once, as one dimension.

        Parameters
        ----------
        distribution : mapping of str to distribution
            What is drawn, of `scipy.stats`, as in ``{"ln_a": norm(math.log(0.01), 0.1)}``; or an
            estimate, of which `covariance` has the variance.
        n : int
            How many; a power of two where the method needs one. With one seed, the first n of 2 n
            samples are those of before (not of a Latin hypercube): a run that goes on computes the
            others alone.
        seed : int
        method : {"sobol", "latin_hypercube", "random", "saltelli"}
            Scrambled Sobol points, a Latin hypercube, or independent samples. By "saltelli" n Sobol
            points of twice the dimensions make ``n (d + 2)`` samples of d quantities, from which
            the reduction `SobolIndices` tells what matters.
        covariance : array_like, optional
            Of what is drawn, in its order. Estimates are normal with these variances; of
            distributions, which have variances of their own, it correlates the normal scores.
        fields : mapping of str to str or function, optional
            The fields that are set, each by the name of what is drawn, or a function of all that is
            drawn: ``{"a": lambda d: np.exp(d["ln_a"])}``. By default all that is drawn.
        units : mapping of str to str, optional
            Units of fields, in a study of a rig; SI units by default.
        dimension : str

        Raises
        ------
        InvalidValue
            For an impossible number, correlation or distribution; and where Sobol indices are asked
            for of quantities that depend on each other.
        """
        from rsfstudy.axes import axis_samples  # loads scipy.stats

        drawn, how = axis_samples.draw_samples(distribution, n, seed, method, covariance)
        return cls(dimension, axis_samples.compute_field_values(drawn, fields), units, how)

    @classmethod
    def cases(
        cls,
        table: Any,
        *,
        fields: Mapping[str, str | Callable[[Mapping[str, np.ndarray]], Any]] | None = None,
        units: Mapping[str, str] | None = None,
        dimension: str = "case",
    ) -> Axis:
        """The rows of a table, as one dimension.

        Parameters
        ----------
        table : mapping of str to sequence, DataFrame or Dataset
            Columns by their names, or what `rsfstudy.read_table` read. Units that it states count:
            those of a CSV file, of the attribute ``units`` of a variable, or of that of a
            DataFrame, which maps columns to them; and of names such as ``slip_distance (um)``.
        fields, units, dimension
            As in `samples`.
        """
        from rsfstudy.axes import axis_samples

        columns, stated = axis_samples.read_table_columns_and_units(table)
        made = axis_samples.compute_field_values(columns, fields)
        kept = {n: text for n, text in stated.items() if made.get(n) is columns[n]}
        return cls(dimension, made, kept | dict(units or {}))

    def _check_values(self) -> None:
        if not self.rows:
            raise InvalidValue("axis", self.dimension, "has no values")
        if not isinstance(self.units, Mapping) or not set(self.units) <= set(self.fields):
            rule = "must map fields of the axis to their units"
            raise InvalidValue("units", self.units, rule, choices=self.fields)
        for name, text in self.units.items():
            check_storable_text(name, text)
        for number, row in enumerate(self.rows):
            for name, value in row.items():
                if not isinstance(value, float | str | bool | None):
                    raise InvalidValue(name, value, "must be a number, a flag or a text")
                if isinstance(value, str):
                    check_storable_text(name, value)
                if isinstance(value, float) and not math.isfinite(value):
                    if self.has_numbered_points:
                        wrong = InvalidValue(name, value, "must be finite")
                        raise wrong.with_location(f"{self.dimension} {number}")
                    raise InvalidValue(self.dimension, value, "must be finite")
        if self.has_numbered_points:
            return  # of equal ones one is computed
        seen: set[frozenset[tuple[str, Any]]] = set()
        for row in self.rows:
            key = frozenset(row.items())
            if key in seen:
                value = row.get(self.dimension, dict(row))
                raise InvalidValue(self.dimension, value, "stands twice on its axis")
            seen.add(key)

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Fields of the scene or of the measure that vary along the axis."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row))

    @property
    def has_numbered_points(self) -> bool:
        """True if its points are numbered: samples, or cases."""
        return self.labels is None and self.dimension not in self.rows[0]

    @property
    def is_single_field(self) -> bool:
        """True if its points are values of the field that it is named by."""
        return self.labels is None and not self.has_numbered_points

    def with_rows(
        self,
        rows: Sequence[AxisRow],
        units: Mapping[str, str],
        sampling_info: Mapping[str, Any] | None = None,
    ) -> Axis:
        """An axis of this kind with other fields set at its points."""
        return Axis(self.dimension, self._values_for_constructor(rows), units, sampling_info)

    def _values_for_constructor(self, rows: Sequence[AxisRow]) -> Any:
        """What an axis of this kind with these rows is declared by."""
        if self.labels is not None:
            return {label: dict(row) for label, row in zip(self.labels, rows, strict=True)}
        if self.has_numbered_points:
            return rows_to_field_columns(rows)
        return [row.get(self.dimension) for row in rows]

    def __len__(self) -> int:
        return len(self.rows)

    def describe(self) -> dict[str, Any]:
        """The axis as plain data."""
        beside = {"units": dict(self.units), "drawn": dict(self.sampling_info)}
        stated = {name: about for name, about in beside.items() if about}
        return {
            "dimension": self.dimension,
            "values": self._values_for_constructor(self.rows),
            **stated,
        }

    @property
    def point_names(self) -> list[str]:
        """What its points are called: labels, numbers, or values with their units."""
        if self.has_numbered_points:
            return list(map(str, range(len(self))))
        units = self.units.get(self.dimension, "")
        values = (f"{format_value(row.get(self.dimension))} {units}".strip() for row in self.rows)
        return list(self.labels or values)


def classify_rows_by_fields(axis_rows: Sequence[AxisRow]) -> np.ndarray:
    """The kind of each row of an axis, counted from 0 in the order of the first of each. Rows are
    of one kind if they set the same fields, to the same texts and flags, and of numbers to 0 or to
    any others: then scenes with them are made of the same parts.
    """
    known: dict[tuple[Any, ...], int] = {}
    return np.array(
        [known.setdefault(_fields_and_texts_of_row(row), len(known)) for row in axis_rows]
    )


def _fields_and_texts_of_row(axis_row: AxisRow) -> tuple[Any, ...]:
    return tuple(
        (name, type(value), bool(value) if isinstance(value, float) else value)
        for name, value in axis_row.items()
    )


def fields_of_axis_point(axis_point: Any) -> Any:
    """Return the fields of a rig, or of another object with fields for an axis.

    Any other point is returned as it is.
    """
    if hasattr(axis_point, "axis_fields"):
        return axis_point.axis_fields
    if hasattr(axis_point, "on_axis"):
        warn_renamed("on_axis", "axis_fields", type(axis_point).__name__)
        return axis_point.on_axis
    return axis_point


def _rows_from_points(dimension: str, labelled_points: Mapping[str, Any]) -> tuple[AxisRow, ...]:
    """The rows of a zipped axis: for each label the fields set there."""
    rows = {label: fields_of_axis_point(point) for label, point in labelled_points.items()}
    for label, row in rows.items():
        check_storable_text(dimension, label)
        if not label:
            raise InvalidValue(dimension, label, "must be a text that labels a point")
        if not isinstance(row, Mapping) or not row:
            raise InvalidValue(dimension, row, f"must be the fields set at {label!r}")
    return tuple({n: to_plain_value(n, v) for n, v in row.items()} for row in rows.values())


def _rows_from_columns(
    dimension: str, values_by_field: Mapping[str, Sequence[Any]]
) -> tuple[AxisRow, ...]:
    """The rows of an axis whose points are numbered: at each, a value of each field."""
    lengths = {name: len(column) for name, column in values_by_field.items()}
    for name, length in lengths.items():
        if not is_variable_name(name) or name == dimension:
            rule = f"must be named as a field is, and not as the axis, {dimension!r}"
            raise InvalidValue("column", name, rule)
        if length != max(lengths.values()):
            raise InvalidValue("columns", lengths, "must be of one length")
    made = [
        [to_plain_value(name, value) for value in column]
        for name, column in values_by_field.items()
    ]
    return tuple(dict(zip(values_by_field, row, strict=True)) for row in zip(*made, strict=True))


def rows_to_field_columns(rows: Sequence[AxisRow]) -> dict[str, list[Any]]:
    """Values of each field at points that all set the same fields."""
    return {name: [row[name] for row in rows] for name in rows[0]}


def check_storable_text(argument_name: str, text: object) -> None:
    """A text that a file can hold."""
    if not isinstance(text, str) or "\0" in text:
        raise InvalidValue(argument_name, text, "must be a text")
    try:
        text.encode()
    except UnicodeError as error:
        raise InvalidValue(argument_name, text, "must be a text that UTF-8 can hold") from error


def to_plain_value(field_name: str, value: Any) -> Any:
    """A value of a field as Python's own number, flag or text: whole numbers as float, a part of
    the user's own by its name.
    """
    value = normalise_field_value(field_name, value)
    if isinstance(value, np.ndarray) and value.ndim:
        raise InvalidValue(field_name, value.tolist(), "must be one number, flag or text")
    value = value.item() if isinstance(value, np.generic | np.ndarray) else value
    if not isinstance(value, int) or isinstance(value, bool):
        return value
    return float(value) if abs(value) < 2**1023 else math.inf
