"""Functions that create axes with physical units for studies of a rig.

`make_axis_with_units` is the main function.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from rsfstudy.axes import Axis, AxisPointFieldValues
from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import is_sequence_of_axis_values
from rsfstudy.quantities import is_valid_variable_name
from rsfstudy.rig.number_ranges import expand_range
from rsfstudy.rig.rig_quantities import (
    AXIS_NAME_BY_RIG_QUANTITY,
    RATIO_FIELD_BY_DIMENSIONAL_NAME,
    RIG_QUANTITIES,
    RIG_QUANTITY_BY_AXIS_NAME,
    SI_UNIT_BY_DIMENSIONLESS_UNIT,
    find_si_units_of_scene_field,
    is_stiffness_in_friction_per_length,
)
from rsfstudy.rig.units import (
    compute_conversion_factor,
    convert_to_si_as_fraction,
    split_number_and_units,
)


def make_axis_with_units(dimension: str, values: Any, units: str | Mapping[str, str] = "") -> Axis:
    """Create an axis with physical units.

    The first value determines the units of the axis. If the field has no units, the function
    creates an ordinary axis.

    Parameters
    ----------
    dimension : str
        Name of a rig quantity or of a scene field.
    values : sequence of quantity, str, or mapping
        Values of the axis. A string is a range with units, ``first:last:count`` or
        ``first:last:count:log``. A mapping assigns either a rig or the values of several fields to
        each label. The values of a mapping are converted to SI units. A mapping may also be a
        table, as in `Axis.cases`.
    units : str, or mapping of str to str, optional
        Units of plain numbers, or of the columns of a table. By default, plain numbers are in SI
        units.

    Returns
    -------
    Axis
        Axis with units.

    Raises
    ------
    InvalidValue
        If a value is not a quantity, if its units are incompatible, or if a rig quantity is not
        positive.

    Notes
    -----
    Two kinds of quantities have other names on axes than in rigs and scenes. An axis of the rig's
    normal stress is named ``sigma_star``. An axis of velocities with units is named without the
    suffix ``_ratio``.
    """
    if not is_valid_variable_name(dimension):
        # The constructor raises an error that explains the rule for names.
        return Axis(dimension, values)
    if hasattr(values, "keys"):
        if isinstance(values, Mapping) and any(
            isinstance(Axis.get_fields_of_point(point), Mapping) for point in values.values()
        ):
            return convert_axis_values_to_axis_units(Axis(dimension, values))
        units_by_name: Any = units or None
        return convert_axis_values_to_axis_units(
            Axis.cases(values, units=units_by_name, dimension=dimension)
        )
    assert isinstance(units, str)
    if isinstance(values, str) and ":" in values:
        values = expand_range(dimension, values, values)
    listed = [values] if isinstance(values, str) else values
    if not is_sequence_of_axis_values(listed) or not len(listed):
        return Axis(dimension, values)
    return _create_single_field_axis([{dimension: value} for value in listed], {dimension: units})


def convert_axis_values_to_axis_units(axis: Axis) -> Axis:
    """Convert the values of an axis to the units of the axis.

    Parameters
    ----------
    axis : Axis
        Axis of a study of a rig. If the axis has no units for a field, plain numbers are in SI
        units.

    Returns
    -------
    Axis
        Axis with floats in the units of the axis.
    """
    if axis.varies_single_field:
        return _create_single_field_axis(axis.rows, axis.units)
    rows, units = _convert_axis_rows_to_common_units(
        axis.rows, axis.units, first_value_sets_units=axis.has_numbered_points
    )
    return axis.with_rows(rows, units, axis.sampling_info)


def _create_single_field_axis(
    axis_rows: Sequence[AxisPointFieldValues], units: Mapping[str, str]
) -> Axis:
    """Create an axis with units for a single field."""
    found, units_by_name = _convert_axis_rows_to_common_units(
        axis_rows, units, first_value_sets_units=True
    )
    (name,) = found[0]
    return Axis(name, [row[name] for row in found], units_by_name)


def _convert_axis_rows_to_common_units(
    axis_rows: Sequence[AxisPointFieldValues],
    units: Mapping[str, str],
    *,
    first_value_sets_units: bool,
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Convert the rows of an axis to numbers and return their units.

    The function replaces field names by the corresponding axis names. The units of a field are, in
    order of priority, the units of the axis, the units of the first value of the column, or SI
    units.
    """
    found: list[dict[str, Any]] = [{} for _row in axis_rows]
    units_by_name: dict[str, str] = {}
    quantities: dict[str, list[tuple[dict[str, Any], Any]]] = {}
    for row, new in zip(axis_rows, found, strict=True):
        for given, value in row.items():
            example = axis_rows[0][given] if first_value_sets_units else value
            name, si = find_axis_name_and_si_units(given, example)
            new[name if si else given] = value
            if si:
                quantities.setdefault(name, []).append((new, value))
                ours = _parse_units_of_value(value) if first_value_sets_units else ""
                units_by_name.setdefault(name, units.get(given) or ours or si)
            elif units.get(given):
                compute_factor_to_si(given, units[given])  # This call always raises an error.
    for name, held in quantities.items():
        numbers = convert_values_to_units(
            name, [value for _row, value in held], units_by_name[name]
        )
        for (row, _value), number in zip(held, numbers, strict=True):
            row[name] = number
    return found, units_by_name


def convert_values_to_units(quantity_name: str, values: Sequence[Any], units: str) -> list[float]:
    """Convert the values of a quantity to the requested units.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity, as it is used on axes with units.
    values : sequence of quantity
        Values to convert. Plain numbers are already in the requested units.
    units : str
        Units of the result.

    Returns
    -------
    list of float
        Values in the requested units.

    Raises
    ------
    InvalidValue
        If a value is not a quantity, if its units are incompatible, or if a rig quantity is not
        positive.
    """
    scale, found = compute_factor_to_si(quantity_name, units), []
    kind = (
        "1/m"
        if quantity_name == "stiffness" and is_stiffness_in_friction_per_length(f"1 {units}")
        else _find_si_units_of_axis_value(quantity_name, "1")
    )
    for value in values:
        number, written = (
            split_number_and_units(value)
            if isinstance(value, str)
            else (Axis.convert_to_plain_value(quantity_name, value), units)
        )
        if isinstance(number, float) and written == units:
            found.append(number)
        else:
            found.append(float(convert_to_si_as_fraction(quantity_name, value, str(kind)) / scale))
    wrong = [
        value
        for number, value in zip(found, values, strict=True)
        if not _is_positive_if_required(quantity_name, number)
    ]
    if wrong:
        of = f", but {len(wrong)} of {len(found)} values are not" if len(found) > 1 else ""
        raise InvalidValue(quantity_name, wrong[0], f"must be positive{of}")
    return found


def _is_positive_if_required(quantity_name: str, number: Any) -> bool:
    """Return True if a quantity is positive or is not required to be positive."""
    return quantity_name not in RIG_QUANTITY_BY_AXIS_NAME or (
        isinstance(number, float) and number > 0.0
    )


def find_axis_name_and_si_units(field_name: str, value: Any) -> tuple[str, str | None]:
    """Return the axis name and the SI units of a quantity or field.

    Parameters
    ----------
    field_name : str
        Name of a rig quantity or of a scene field.
    value : object
        Value of the quantity or field.

    Returns
    -------
    field_name : str
        Name of the axis for the quantity or field.
    units : str or None
        SI units, or None if the value has no units.
    """
    field_name = _find_axis_name_of_field(field_name, value)
    return field_name, _find_si_units_of_axis_value(field_name, value)


def _find_axis_name_of_field(field_name: str, value: Any) -> str:
    """Return the name of the axis that varies a rig quantity or scene field."""
    quantity = not isinstance(value, str) or split_number_and_units(value)[0] is not None
    if field_name in AXIS_NAME_BY_RIG_QUANTITY and quantity:
        return AXIS_NAME_BY_RIG_QUANTITY[field_name]
    if not is_valid_variable_name(field_name):
        return field_name  # The scene raises an error later.
    short = field_name.removesuffix("_ratio")
    return (
        short
        if RATIO_FIELD_BY_DIMENSIONAL_NAME.get(short) == field_name
        and find_si_units_of_scene_field(field_name, value)
        else field_name
    )


def _find_si_units_of_axis_value(field_name: str, value: Any) -> str | None:
    """Return the SI units of an axis value, or None if it has no units."""
    if value is None or isinstance(value, bool):
        return None
    if field_name in RIG_QUANTITY_BY_AXIS_NAME:
        return RIG_QUANTITIES[RIG_QUANTITY_BY_AXIS_NAME[field_name]].si_units
    if field_name in RATIO_FIELD_BY_DIMENSIONAL_NAME:
        return SI_UNIT_BY_DIMENSIONLESS_UNIT["V_*"]
    return find_si_units_of_scene_field(field_name, value)


def _parse_units_of_value(value: Any) -> str:
    return split_number_and_units(value)[1] if isinstance(value, str) else ""


def compute_factor_to_si(quantity_name: str, units: str) -> Fraction:
    """Compute the factor that converts a unit to SI units.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity, as it is used on axes with units.
    units : str
        Units to convert from. A stiffness may be in units of friction divided by displacement,
        which are converted to 1/m.

    Returns
    -------
    Fraction
        Value of one unit in SI units.

    Raises
    ------
    InvalidValue
        If the quantity has no units, or if the units are unknown or incompatible.
    """
    if quantity_name == "stiffness" and is_stiffness_in_friction_per_length(f"1 {units}"):
        return compute_conversion_factor(quantity_name, units, "1/m")
    si = _find_si_units_of_axis_value(quantity_name, f"1 {units}")
    if si is None:
        raise InvalidValue(quantity_name, units, "are not units of a rig quantity")
    return compute_conversion_factor(quantity_name, units, si)
