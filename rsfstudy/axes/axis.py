"""Axis of a study: one dimension along which one or several fields vary.

An axis contains either a list of values of one field, or a list of points that each set several
fields. The points of an axis have labels or are numbered from 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rsfstudy._deprecation import accept_former_keyword_names, add_former_member_names, warn_renamed
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.formatting import format_number_or_text, is_sequence_of_axis_values
from rsfstudy.quantities import describe_invalid_variable_name, is_valid_variable_name
from rsfstudy.slider import SceneFields

AxisPointFieldValues = Mapping[str, Any]


def get_fields_of_axis_point(axis_point: Any) -> Any:
    """Return the field values of an axis point that is given as a mapping or a rig.

    Parameters
    ----------
    axis_point : object
        Point of a zipped axis.

    Returns
    -------
    object
        Mapping of fields to values. An object without the attribute ``si_values_by_axis_name`` is
        returned unchanged.
    """
    if hasattr(axis_point, "si_values_by_axis_name"):
        return axis_point.si_values_by_axis_name
    if hasattr(axis_point, "on_axis"):
        warn_renamed("on_axis", "si_values_by_axis_name", type(axis_point).__name__)
        return axis_point.on_axis
    return axis_point


def check_storable_text(argument_name: str, text: object) -> None:
    """Check that a value is a string that can be stored in files.

    Parameters
    ----------
    argument_name : str
        Name of the argument for error messages.
    text : object
        Value to check.

    Raises
    ------
    InvalidValue
        If the value is not a string, contains a null character, or cannot be encoded as UTF-8.
    """
    if not isinstance(text, str):
        raise InvalidValue(argument_name, text, "must be a string")
    if "\0" in text:
        raise InvalidValue(argument_name, text, "must be a string without the null character")
    try:
        text.encode()
    except UnicodeError as error:
        raise InvalidValue(
            argument_name, text, "must be a string that can be encoded as UTF-8"
        ) from error


def to_plain_value(field_name: str, value: Any) -> Any:
    """Convert a field value to a float, a bool or a string.

    Parameters
    ----------
    field_name : str
        Name of the field.
    value : object
        Value to convert. Integers become floats. A user-defined part becomes its name.

    Returns
    -------
    object
        Value of a built-in type. Values that cannot be converted are returned unchanged, and the
        axis rejects the unconverted values.

    Raises
    ------
    InvalidValue
        If the value is an array with one or more dimensions, or an integer that is too large for a
        floating-point number.
    """
    value = SceneFields.replace_part_or_alias_by_part_name(field_name, value)
    if isinstance(value, np.ndarray) and value.ndim:
        raise InvalidValue(field_name, value.tolist(), "must be a single number, bool or string")
    value = value.item() if isinstance(value, np.generic | np.ndarray) else value
    if not isinstance(value, int) or isinstance(value, bool):
        return value
    if abs(value) >= 2**1023:
        raise InvalidValue(field_name, value, "is too large for a floating-point number")
    return float(value)


@accept_former_keyword_names
@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, init=False)
class Axis:
    """Axis of a study, along which one or several fields vary.

    Parameters
    ----------
    dimension : str
        Name of the dimension. If the axis varies a single field, the dimension has the name of the
        field. The field may belong to the scene or to the measure of the study. If both the scene
        and the measure have a field with this name, the axis varies the field of the scene.
    values : sequence, mapping of str to mapping, or mapping of str to sequence
        Values of a single field. The values may include classes of user-defined parts. For a zipped
        axis, pass a mapping from labels to the fields at each point, for example
        ``{"constant": {"normal_stress": "constant"}, ...}``, or a mapping from labels to rigs. For
        numbered points, pass a mapping from field names to lists of values. See also `samples` and
        `cases`.
    units : mapping of str to str, optional
        Units of the fields, for a study that is based on a `Rig`. See `Rig.axis`.
    sampling_info : mapping, optional
        Description of the sampling method and its arguments, as numbers and strings.

    Raises
    ------
    InvalidValue
        If the axis is empty, or if the axis contains repeated or non-finite values. Numbered points
        may occur more than once, because random samples may be equal.

    Examples
    --------
    >>> import rsfstudy
    >>> axis = rsfstudy.Axis("b_over_a", [1.2, 1.5, 2.0])
    >>> len(axis)
    3
    >>> zipped = rsfstudy.Axis(
    ...     "material",
    ...     {"granite": {"a": 0.008, "b_over_a": 1.5}, "gouge": {"a": 0.004, "b_over_a": 1.2}},
    ... )
    >>> zipped.fields
    ('a', 'b_over_a')
    >>> zipped.point_names
    ['granite', 'gouge']
    """

    get_fields_of_point = staticmethod(get_fields_of_axis_point)
    check_storable_text = staticmethod(check_storable_text)
    convert_to_plain_value = staticmethod(to_plain_value)

    dimension: str
    rows: tuple[AxisPointFieldValues, ...]
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
        """Create an axis from values or points."""
        if not is_valid_variable_name(dimension):
            rule, remedy = describe_invalid_variable_name(dimension)
            raise InvalidValue("axis name", dimension, rule, remedy=remedy)
        labels: tuple[str, ...] | None = None
        if (
            isinstance(values, Mapping)
            and values
            and all(map(is_sequence_of_axis_values, values.values()))
        ):
            rows = _build_rows_from_columns(dimension, values)
        elif isinstance(values, Mapping):
            labels, rows = tuple(values), _build_rows_from_points(dimension, values)
        else:
            listed = [values] if isinstance(values, str) else values
            if not is_sequence_of_axis_values(listed):
                raise InvalidValue(dimension, values, "must be a list of values")
            rows = tuple({dimension: to_plain_value(dimension, value)} for value in listed)
            if any(row[dimension] is None for row in rows):
                raise InvalidValue(dimension, None, "is not a valid axis value")
        beside = ({} if mapping is None else mapping for mapping in (units, sampling_info))
        held = (dimension, rows, labels, *beside)
        for name, value in zip(self.__dataclass_fields__, held, strict=True):
            object.__setattr__(self, name, value)
        self._check_field_values()

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
        """Sample several fields jointly along a single dimension.

        Parameters
        ----------
        distribution : mapping of str to distribution or float
            Frozen `scipy.stats` distribution of each sampled quantity, for example
            ``{"ln_a": norm(math.log(0.01), 0.1)}``. A float is the mean of a normal distribution,
            whose variance is a diagonal element of `covariance`.
        n : int
            Number of samples. The methods "sobol" and "saltelli" require a power of two. If you
            increase n and keep the seed, the existing samples do not change, so a larger study only
            computes the additional samples. However, if the method is "latin_hypercube", all
            samples change when n increases.
        seed : int, default: 0
            Seed of the random number generator.
        method : {"sobol", "latin_hypercube", "random", "saltelli"}
            Sampling method: scrambled Sobol points, a Latin hypercube, or independent random
            samples. The method "saltelli" draws n Sobol points in twice the number of dimensions
            and combines the coordinates of the points into ``n (d + 2)`` samples of d quantities.
            The reduction `SobolIndices` requires the method "saltelli". The default is "sobol".
        covariance : array_like, optional
            Covariance matrix of shape (d, d) in the order of `distribution`. Quantities given as
            mean values are normally distributed with this covariance. For quantities given as
            distributions, only the correlation is used, and the correlation applies to the normal
            scores of the samples.
        fields : mapping of str to str or callable, optional
            Fields that the axis sets. The value of each field is a sampled quantity, given by its
            name, or a function of all sampled quantities, for example
            ``{"a": lambda d: np.exp(d["ln_a"])}``. By default, each sampled quantity sets the field
            of the same name.
        units : mapping of str to str, optional
            Units of the fields, for a study that is based on a `Rig`. The default is SI units.
        dimension : str, default: "sample"
            Name of the dimension.

        Returns
        -------
        Axis
            Axis with numbered points.

        Raises
        ------
        InvalidValue
            If the number of samples, the covariance or a distribution is invalid, or if the method
            is "saltelli" and the quantities are correlated.

        Examples
        --------
        >>> from scipy.stats import norm, uniform
        >>> import rsfstudy
        >>> axis = rsfstudy.Axis.samples({"a": norm(0.01, 0.001), "b_over_a": uniform(1.2, 0.8)}, 8)
        >>> len(axis), axis.fields
        (8, ('a', 'b_over_a'))
        """
        # The import is local because it loads `scipy.stats`, which is slow.
        from rsfstudy.axes import axis_samples

        drawn, how = axis_samples.draw_samples(distribution, n, seed, method, covariance)
        return cls(
            dimension, axis_samples.compute_field_values_from_samples(drawn, fields), units, how
        )

    @classmethod
    def cases(
        cls,
        table: Any,
        *,
        fields: Mapping[str, str | Callable[[Mapping[str, np.ndarray]], Any]] | None = None,
        units: Mapping[str, str] | None = None,
        dimension: str = "case",
    ) -> Axis:
        """Create an axis whose points are the rows of a table.

        Parameters
        ----------
        table : mapping of str to sequence, DataFrame or Dataset
            Columns by name, or the output of `rsfstudy.read_table`. The units of a column are read
            from the CSV file, from the attribute ``units`` of a variable, or from the name of a
            column such as ``slip_distance (um)``. The attribute ``units`` of a data frame maps
            columns to units.
        fields : mapping of str to str or callable, optional
            Fields that the axis sets, in the format that `samples` accepts. By default, each column
            sets the field of the same name.
        units : mapping of str to str, optional
            Units of the fields, for a study that is based on a `Rig`. By default, the units of the
            table are used, or SI units if the table has no units. A field that a function computes
            has no units in the table.
        dimension : str, default: "case"
            Name of the dimension.

        Returns
        -------
        Axis
            Axis with numbered points.

        Raises
        ------
        InvalidValue
            If `table` does not consist of named columns, if the units of a column contradict each
            other, or if the draws of a fitted slip distance or stiffness have no units.

        Examples
        --------
        >>> import rsfstudy
        >>> axis = rsfstudy.Axis.cases({"a": [0.008, 0.01], "b_over_a": [1.5, 1.2]})
        >>> dict(axis.rows[1])
        {'a': 0.01, 'b_over_a': 1.2}
        """
        from rsfstudy.axes import axis_samples

        columns, stated = axis_samples.read_table_columns_and_units(table)
        made = axis_samples.compute_field_values_from_samples(columns, fields)
        columns_by_field = {name: name for name in columns} if fields is None else fields
        kept = {
            name: stated[column]
            for name, column in columns_by_field.items()
            if isinstance(column, str) and column in stated
        }
        known = kept | dict(units or {})
        axis_samples.check_fitted_draws_have_units(table, columns_by_field, known)
        return cls(dimension, made, known)

    def _check_field_values(self) -> None:
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
                    rule = "must contain only numbers, bools and strings"
                    raise InvalidValue(f"axis {name!r}", value, rule)
                if isinstance(value, str):
                    check_storable_text(name, value)
                if isinstance(value, float) and not math.isfinite(value):
                    if self.has_numbered_points:
                        wrong = InvalidValue(name, value, "must be finite")
                        raise wrong.with_location(f"{self.dimension} {number}")
                    raise InvalidValue(self.dimension, value, "must be finite")
        if self.has_numbered_points:
            return  # Equal points are allowed, because they are computed only once.
        seen: set[frozenset[tuple[str, Any]]] = set()
        for row in self.rows:
            key = frozenset(row.items())
            if key in seen:
                value = row.get(self.dimension, dict(row))
                raise InvalidValue(self.dimension, value, "occurs twice on its axis")
            seen.add(key)

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields that vary along the axis."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row))

    @property
    def has_numbered_points(self) -> bool:
        """True if the points are numbered, for example in axes of samples or cases."""
        return self.labels is None and self.dimension not in self.rows[0]

    @property
    def varies_single_field(self) -> bool:
        """True if the axis varies a single field and the dimension has the name of this field."""
        return self.labels is None and not self.has_numbered_points

    def with_rows(
        self,
        rows: Sequence[AxisPointFieldValues],
        units: Mapping[str, str],
        sampling_info: Mapping[str, Any] | None = None,
    ) -> Axis:
        """Create a copy of the axis with new field values at its points.

        Parameters
        ----------
        rows : sequence of mapping
            Field values at each point.
        units : mapping of str to str
            Units of the fields.
        sampling_info : mapping, optional
            Description of the sampling method.

        Returns
        -------
        Axis
            Axis with the same dimension and the same labels.
        """
        return Axis(
            self.dimension, self._convert_stored_rows_to_axis_values(rows), units, sampling_info
        )

    def _convert_stored_rows_to_axis_values(self, rows: Sequence[AxisPointFieldValues]) -> Any:
        """Convert the rows to the format that ``Axis`` accepts as ``values``."""
        if self.labels is not None:
            return {label: dict(row) for label, row in zip(self.labels, rows, strict=True)}
        if self.has_numbered_points:
            return convert_rows_to_field_columns(rows)
        return [row.get(self.dimension) for row in rows]

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.rows)

    def group_rows_by_scene_parts(self) -> np.ndarray:
        """Assign each row of the axis to a group of similar rows.

        All rows of a group set the same fields. Within a group, all values of a string or Boolean
        field are equal, and the values of a numeric field are either all zero or all nonzero.
        Scenes that are built from rows of the same group therefore have the same parts.

        Returns
        -------
        ndarray of int
            Group number of each row. Groups are numbered from 0 in the order of their first row.
        """
        known: dict[tuple[Any, ...], int] = {}
        return np.array(
            [known.setdefault(_build_grouping_key_of_row(row), len(known)) for row in self.rows]
        )

    def describe(self) -> dict[str, Any]:
        """Return a description of the axis as built-in Python types.

        Returns
        -------
        dict of str to object
            Dimension, values, and optionally units and the sampling method.
        """
        beside = {"units": dict(self.units), "drawn": dict(self.sampling_info)}
        stated = {name: about for name, about in beside.items() if about}
        return {
            "dimension": self.dimension,
            "values": self._convert_stored_rows_to_axis_values(self.rows),
            **stated,
        }

    @property
    def point_names(self) -> list[str]:
        """Name of each point: its label, its number, or its value with units."""
        if self.has_numbered_points:
            return list(map(str, range(len(self))))
        units = self.units.get(self.dimension, "")
        values = (
            f"{format_number_or_text(row.get(self.dimension))} {units}".strip() for row in self.rows
        )
        return list(self.labels or values)


def _build_grouping_key_of_row(axis_row: AxisPointFieldValues) -> tuple[Any, ...]:
    return tuple(
        (name, type(value), bool(value) if isinstance(value, float) else value)
        for name, value in axis_row.items()
    )


def _build_rows_from_points(
    dimension: str, labelled_points: Mapping[str, Any]
) -> tuple[AxisPointFieldValues, ...]:
    """Create the rows of a zipped axis from a mapping of labels to fields."""
    rows = {label: get_fields_of_axis_point(point) for label, point in labelled_points.items()}
    for label, row in rows.items():
        check_storable_text(dimension, label)
        if not label:
            raise InvalidValue(dimension, label, "must be a non-empty string")
        if not isinstance(row, Mapping) or not row:
            raise InvalidValue(
                dimension, row, f"must be a mapping of the fields at the point {label!r}"
            )
    return tuple({n: to_plain_value(n, v) for n, v in row.items()} for row in rows.values())


def _build_rows_from_columns(
    dimension: str, values_by_field: Mapping[str, Sequence[Any]]
) -> tuple[AxisPointFieldValues, ...]:
    """Create the rows of an axis with numbered points from lists of values."""
    lengths = {name: len(column) for name, column in values_by_field.items()}
    for name, length in lengths.items():
        if not is_valid_variable_name(name):
            raise InvalidValue("column", name, "is not the name of a field")
        if name == dimension:
            rule = "has the same name as the axis"
            remedy = "Rename the column or the axis."
            raise InvalidValue("column", name, rule, remedy=remedy)
        if length != max(lengths.values()):
            raise InvalidValue("the lengths of the columns", lengths, "must be equal")
    made = [
        [to_plain_value(name, value) for value in column]
        for name, column in values_by_field.items()
    ]
    return tuple(dict(zip(values_by_field, row, strict=True)) for row in zip(*made, strict=True))


def convert_rows_to_field_columns(rows: Sequence[AxisPointFieldValues]) -> dict[str, list[Any]]:
    """Convert rows that set the same fields to a list of values for each field.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of an axis.

    Returns
    -------
    dict of str to list
        Values of each field.
    """
    return {name: [row[name] for row in rows] for name in rows[0]}
