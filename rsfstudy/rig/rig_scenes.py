"""Functions and classes that build the scenes for all lattice cells of a rig study.

`RigAxesToScenesConverter` converts axes with physical units to dimensionless scene fields.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rsfstudy.axes import Axis, AxisPointFieldValues
from rsfstudy.errors import InvalidValue
from rsfstudy.rig.axes_with_units import compute_factor_to_si, make_axis_with_units
from rsfstudy.rig.dataset_unit_scales import DIMENSIONLESS_PREFIX, compute_unit_scales_of_rig
from rsfstudy.rig.rig import Rig, convert_to_instability_norm
from rsfstudy.rig.rig_quantities import (
    AXIS_NAME_BY_RIG_QUANTITY,
    DISPLAY_UNIT_BY_SI_UNIT,
    RATIO_FIELD_BY_DIMENSIONAL_NAME,
    REQUIRED_RIG_QUANTITIES,
    RIG_QUANTITY_BY_AXIS_NAME,
    SCENE_QUANTITY_BY_FIELD_NAME,
    SI_UNIT_BY_DIMENSIONLESS_UNIT,
    check_rig_quantities_are_consistent,
    convert_to_si_and_warn_if_unusual,
    derive_scene_fields_from_rig,
    is_dimensionless_field_with_scale,
    is_stiffness_in_friction_per_length,
)
from rsfstudy.rig.units import multiply_by_exact_fraction
from rsfstudy.slider import Scene


@dataclass(frozen=True)
class RigAxesToScenesConverter:
    """Converter that translates axes with physical units to dimensionless scene fields.

    If an axis varies a scale such as the slip distance, fields of the base scene keep their SI
    values. The dimensionless values of these fields vary along the axis. In contrast, fields that
    are ratios keep their dimensionless values.

    Parameters
    ----------
    rig : Rig
        Rig with the quantities that are the same in all lattice cells.
    base_scene : Scene
        Base scene, created by `Rig.scene`.
    axes : sequence of Axis
        Axes of the study.

    Raises
    ------
    InvalidValue
        If the base scene does not belong to the rig. The error is also raised if an axis value is a
        rig that lacks a quantity of ``rig``.
    """

    rig: Rig
    base_scene: Scene
    axes: Sequence[Axis]

    def __post_init__(self) -> None:
        """Check that the base scene and the axes belong to the rig."""
        theirs = self.base_scene.as_dict()
        for name, value in self._derive_scene_fields(self.rig.as_dict()).items():
            if not isinstance(value, bool | str) and not _is_close_within_rounding(
                theirs.get(name), value
            ):
                rule = f"differs from the rig's value, {value:g}"
                remedy = "Create the base scene with rig.scene(...)."
                raise InvalidValue(name, theirs.get(name), rule, remedy=remedy)
        for along in self.axes:
            for row in along.rows:
                lacks = [name for name in self.rig.si_values_by_axis_name if name not in row]
                if lacks and not {
                    AXIS_NAME_BY_RIG_QUANTITY.get(name, name) for name in REQUIRED_RIG_QUANTITIES
                } & set(lacks):
                    rule = f"must contain {lacks[0]}, because the rig of the study contains it"
                    raise InvalidValue(
                        along.dimension, dict(row), rule, remedy="Pass it as an argument."
                    )

    def _derive_scene_fields(self, rig_values: Mapping[str, Any]) -> dict[str, Any]:
        """Compute scene fields from rig values, omitting heating if the scene is isothermal."""
        hot = self.base_scene.parts.temperature.name != "isothermal"
        return derive_scene_fields_from_rig(rig_values, with_shear_heating=hot)

    @property
    def units_by_axis_name(self) -> dict[str, str]:
        """Units of the quantities that vary along axes, keyed by axis name."""
        return {name: units for along in self.axes for name, units in along.units.items()}

    def compute_rig_quantities(self, axis_row: AxisPointFieldValues) -> dict[str, Any]:
        """Compute the rig quantities for one row of axis values.

        Parameters
        ----------
        axis_row : mapping of str to value or ndarray
            Axis values by field name. Arrays are evaluated elementwise.

        Returns
        -------
        dict of str to float or ndarray
            Quantities of the rig in SI units.

        Raises
        ------
        InvalidValue
            If the quantities contradict each other.
        """
        found, units = dict(self.rig.as_dict()), self.units_by_axis_name
        for name in RIG_QUANTITY_BY_AXIS_NAME:
            if name in units and axis_row.get(name) is not None:
                found[RIG_QUANTITY_BY_AXIS_NAME[name]] = multiply_by_exact_fraction(
                    axis_row[name], compute_factor_to_si(name, units[name])
                )
        in_friction = is_stiffness_in_friction_per_length(f"1 {units.get('stiffness', '')}")
        if axis_row.get("stiffness") is not None and in_friction:
            found["stiffness"] = found["stiffness"] * found["normal_stress"]
        check_rig_quantities_are_consistent(found)
        return found

    def compute_scene_fields(self, axis_row: AxisPointFieldValues) -> dict[str, Any]:
        """Compute the scene fields for one row of axis values.

        Parameters
        ----------
        axis_row : mapping of str to value or ndarray
            Axis values by field name. Arrays are evaluated elementwise.

        Returns
        -------
        dict of str to object
            Values of the scene fields that may differ from the base scene.
        """
        units, rig = self.units_by_axis_name, self.compute_rig_quantities(axis_row)
        here, found = compute_scale_factors_of_rig(rig), {}
        if set(RIG_QUANTITY_BY_AXIS_NAME) & set(units) & set(axis_row):
            found = self._rescale_base_fields_to_cell_scales(here) | self._derive_scene_fields(rig)
            if "period" in self.rig.as_dict() and not self.base_scene.has_mass:
                # The base scene ignores the inertia of the rig.
                found.pop("inertia", None)
        for name, value in axis_row.items():
            field = RATIO_FIELD_BY_DIMENSIONAL_NAME.get(name, name)
            if name not in units:
                found[name] = value
            elif name not in RIG_QUANTITY_BY_AXIS_NAME:
                scale = SCENE_QUANTITY_BY_FIELD_NAME[field].scale
                in_si = multiply_by_exact_fraction(value, compute_factor_to_si(name, units[name]))
                found[field] = in_si / (here[scale] if scale else 1.0)
        return found

    def _rescale_base_fields_to_cell_scales(
        self, scale_factors_of_cell: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the base scene fields that have the same SI value in all cells."""
        base = compute_scale_factors_of_rig(self.rig.as_dict())
        held = {
            name: value
            * (
                base[SCENE_QUANTITY_BY_FIELD_NAME[name].scale]
                / scale_factors_of_cell[SCENE_QUANTITY_BY_FIELD_NAME[name].scale]
            )
            for name, value in self.base_scene.as_dict().items()
            if is_dimensionless_field_with_scale(name) and isinstance(value, float) and value != 0.0
        }
        # The damping coefficient eta is fixed, and its stress is proportional to V_*.
        if "radiation_damping" in held:
            held["radiation_damping"] = held["radiation_damping"] * (
                scale_factors_of_cell["V_*"] / base["V_*"]
            )
        return held

    def compute_scale_and_scene_coordinates(self) -> dict[str, tuple[tuple[str, ...], np.ndarray]]:
        """Compute the dimensionless fields and scales of all lattice cells.

        Returns
        -------
        dict of str to (tuple of str, ndarray)
            Dimensions and values by field name. Each array has only the dimensions along which its
            values vary. If a field has the same name as an axis with units, the prefix
            ``dimensionless_`` is added to the name of the field.
        """
        # An axis with one point gets a second point to find out if the values depend on the axis.
        alone = {
            axis.dimension for axis in self.axes if len(axis) == 1 and axis.varies_single_field
        }
        along = [
            _add_second_point_to_axis(a) if a.dimension in alone else a
            for a in self.axes
            if a.units
        ]
        shape = tuple(len(axis) for axis in along)
        found: dict[str, np.ndarray] = {}
        for rows in group_axis_rows_by_field_names(along):
            numbers: dict[str, Any] = {}
            for place, axis in enumerate(along):
                shaped = [-1 if p == place else 1 for p in range(len(along))]
                for name, value in axis.rows[rows[place][0]].items():
                    if isinstance(value, float):
                        column = [axis.rows[n][name] for n in rows[place].tolist()]
                        numbers[name] = np.array(column).reshape(shaped)
            for name, values in self._compute_scales_and_scene_fields(numbers).items():
                whole = found.setdefault(name, np.full(shape, np.nan))
                whole[np.ix_(*rows)] = values
        squeezed = {
            name: _drop_constant_dimensions(along, values) for name, values in found.items()
        }
        return {
            name: (dims, values[tuple(slice(1 if d in alone else None) for d in dims)])
            for name, (dims, values) in squeezed.items()
        }

    def _compute_scales_and_scene_fields(self, axis_row: Mapping[str, Any]) -> dict[str, Any]:
        units, rig = self.units_by_axis_name, self.compute_rig_quantities(axis_row)
        scales_ = {
            AXIS_NAME_BY_RIG_QUANTITY.get(name, name): rig[name] for name in REQUIRED_RIG_QUANTITIES
        }
        found = {name: value for name, value in scales_.items() if name not in units}
        for name, value in self.compute_scene_fields(axis_row).items():
            if isinstance(value, bool | str) or (name in axis_row and name not in units):
                continue
            if name not in units:
                found[name] = value
            elif SCENE_QUANTITY_BY_FIELD_NAME[name].scale:
                found[DIMENSIONLESS_PREFIX + name] = value
        return found


def _is_close_within_rounding(other_value: Any, value: Any) -> bool:
    # The user may have computed the value by hand, so the two values may differ by rounding errors.
    return isinstance(other_value, float) and math.isclose(other_value, value, rel_tol=1e-9)


def convert_scene_and_axes_to_rig_units(
    rig: Rig, base_scene: Scene, axes: Sequence[Axis]
) -> tuple[Scene, list[Axis], dict[str, float]]:
    """Convert a dimensionless scene and its axes to physical units.

    Parameters
    ----------
    rig : Rig
        Rig that determines the scales.
    base_scene : Scene
        Dimensionless scene.
    axes : sequence of Axis
        Dimensionless axes.

    Returns
    -------
    base_scene : Scene
        Scene with the fields that the rig determines.
    axes : list of Axis
        Axes with physical units.
    sizes : dict of str to float
        Factor by which the axis values of each field were multiplied in the conversion.
    """
    sizes_of = compute_scale_factors_of_rig(rig.as_dict())
    converted: list[Axis] = []
    every: dict[str, float] = {}
    for along in axes:
        scales = {
            n: SCENE_QUANTITY_BY_FIELD_NAME[n].scale
            for n in along.fields
            if is_dimensionless_field_with_scale(n)
        }
        units = {
            n: DISPLAY_UNIT_BY_SI_UNIT.get(
                SI_UNIT_BY_DIMENSIONLESS_UNIT[scale], SI_UNIT_BY_DIMENSIONLESS_UNIT[scale]
            )
            for n, scale in scales.items()
        }
        sizes = {
            n: multiply_by_exact_fraction(sizes_of[s], 1 / compute_factor_to_si(n, units[n]))
            for n, s in scales.items()
        }
        every |= sizes
        rows = [
            {n: v * sizes[n] if n in sizes and v is not None else v for n, v in row.items()}
            for row in along.rows
        ]
        converted.append(along.with_rows(rows, units, along.sampling_info))
    changes = derive_scene_fields_from_rig(rig.as_dict())
    # The inertia and the radiation damping of the rig replace the values of the dimensionless
    # scene.
    if {"inertia", "radiation_damping"} & set(changes):
        changes = {"inertia": False, "radiation_damping": 0.0, **changes}
    return base_scene.with_(**changes), converted, every


def replace_rig_quantity(
    rig: Rig, base_scene: Scene, quantity_name: str, value: Any
) -> tuple[Rig, Scene]:
    """Replace the value of one rig quantity, and return the new rig and the new scene.

    Parameters
    ----------
    rig : Rig
        Rig of the scene.
    base_scene : Scene
        Scene of the rig.
    quantity_name : str
        Name of the quantity, as it is used on axes with units.
    value : object
        Value of the quantity, in any form that is accepted for axes with units.

    Returns
    -------
    rig : Rig
        Rig with the new value.
    scene : Scene
        Scene with the new value.
    """
    if quantity_name == "instability_norm":
        return rig, base_scene.with_(
            instability_norm=convert_to_instability_norm(rig, value, base_scene)
        )
    axis = make_axis_with_units(quantity_name, [value])
    changed = base_scene.with_(
        **RigAxesToScenesConverter(rig, base_scene, [axis]).compute_scene_fields(axis.rows[0])
    )
    if quantity_name in RIG_QUANTITY_BY_AXIS_NAME:
        quantity = RIG_QUANTITY_BY_AXIS_NAME[quantity_name]
        rig = replace(
            rig,
            **{quantity: convert_to_si_and_warn_if_unusual(quantity, value, rig.normal_stress)},
        )
    return rig, changed


def compute_scale_factors_of_rig(rig_values: Mapping[str, Any]) -> dict[str, Any]:
    """Compute the SI values of the dimensionless units of a rig.

    Parameters
    ----------
    rig_values : mapping of str to float or ndarray
        Quantities of the rig in SI units.

    Returns
    -------
    dict of str to float or ndarray
        SI value of each dimensionless unit.
    """
    return {name: scale.factor for name, scale in compute_unit_scales_of_rig(rig_values).items()}


def _add_second_point_to_axis(axis: Axis) -> Axis:
    """Add a second point to an axis that has a single point."""
    (row,) = axis.rows
    near = {
        name: 1.01 * value if isinstance(value, float) else value for name, value in row.items()
    }
    return axis.with_rows([row, near], axis.units)


def _drop_constant_dimensions(
    axes: Sequence[Axis], values: np.ndarray
) -> tuple[tuple[str, ...], np.ndarray]:
    """Remove the dimensions along which an array is constant."""
    kept: list[str] = []
    for place, axis in reversed(list(enumerate(axes))):
        first = values.take([0], axis=place)
        if np.array_equal(np.broadcast_to(first, values.shape), values, equal_nan=True):
            values = values.take(0, axis=place)
        else:
            kept.insert(0, axis.dimension)
    return tuple(kept), values


def group_axis_rows_by_field_names(axes: Sequence[Axis]) -> Iterator[tuple[np.ndarray, ...]]:
    """Iterate over groups of axis points that set the same scene fields.

    Parameters
    ----------
    axes : sequence of Axis
        Axes to group.

    Yields
    ------
    tuple of ndarray of int
        Indices of the points on each axis, for one combination of groups.
    """
    every = [axis.group_rows_by_scene_parts() for axis in axes]
    for kind in np.ndindex(*(int(of.max()) + 1 for of in every)):
        yield tuple(np.flatnonzero(of == n) for of, n in zip(every, kind, strict=True))
