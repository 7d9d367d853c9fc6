"""Functions that build the coordinates of the lattice of a study.

Each field that varies along an axis becomes a coordinate of this axis. Each fixed scene field
becomes a scalar coordinate. ``LatticeCoordinatesBuilder`` reads the values of the fields from the
scenes of a few cells. ``CellPlan`` collects these scenes when it builds the scenes of all cells.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rsfstudy.axes import Axis, AxisPointFieldValues
from rsfstudy.quantities import Quantity
from rsfstudy.rig import DatasetUnits
from rsfstudy.slider import Scene
from rsfstudy.storage import stored_loadings
from rsfstudy.study import Study
from rsfstudy.vocabulary import FORMULAS_OF_DERIVED_COORDINATES, find_quantity


def build_dimension_coordinates(study: Study) -> dict[str, np.ndarray]:
    """Build the values of the dimension coordinates of a study.

    Parameters
    ----------
    study : Study
        Study that declares the lattice.

    Returns
    -------
    dict of str to ndarray
        Labels, numbers or field values of the points of each axis, by name of the dimension.
    """
    return {axis.dimension: _build_dimension_coordinate(axis) for axis in study.axes}


def _build_dimension_coordinate(axis: Axis) -> np.ndarray:
    """Return the labels, numbers or field values of the points of an axis."""
    if axis.labels is not None:
        return np.array(axis.labels, dtype=object)
    if axis.has_numbered_points:
        return np.arange(len(axis), dtype=np.int32)
    return _convert_to_storable_array([row.get(axis.dimension) for row in axis.rows])


class LatticeCoordinatesBuilder:
    """Builder that derives the lattice coordinates from the scenes of a few cells.

    The coordinates include the dimension coordinates and the scene fields. The coordinate of a
    field that varies along an axis has the dimension of this axis, and the coordinate of a fixed
    field is a scalar. The coordinates also include the tables of user-defined loadings, and the
    coordinates of array outputs of the measure.

    Parameters
    ----------
    study : Study
        Study that declares the lattice.

    Attributes
    ----------
    cell_numbers : frozenset of int
        Numbers of the cells from whose scenes the coordinates are built. Along each axis, these
        cells include every combination of parts.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        strides = np.cumprod([1, *study.shape[::-1]])[::-1][1:].tolist()
        #: List with one entry per axis. Each entry contains one cell number for each point of the
        #: axis.
        self._representative_cells: list[list[int]] = []
        for axis, stride in zip(study.axes, strides, strict=True):
            groups = axis.group_rows_by_scene_parts()
            _, firsts, places = np.unique(groups, return_index=True, return_inverse=True)
            self._representative_cells.append((firsts[places] * stride).tolist())
        self.cell_numbers = frozenset(n for cells in self._representative_cells for n in cells)

    def build_coordinates(self, scenes_by_cell_number: Mapping[int, Scene]) -> dict[Any, Any]:
        """Build the coordinates.

        Parameters
        ----------
        scenes_by_cell_number : mapping of int to Scene
            Scenes of the cells in ``cell_numbers``.

        Returns
        -------
        dict of str to tuple or xarray.Variable
            Coordinates by name, in a form that ``xarray.Dataset`` accepts.
        """
        study, own, coords = self.study, self.study.quantities_not_in_vocabulary, dict[Any, Any]()
        fields = {number: scene.as_dict() for number, scene in scenes_by_cell_number.items()}
        for axis, cells in zip(study.axes, self._representative_cells, strict=True):
            coords |= _build_coordinates_along_axis(
                study, axis, [fields[number] for number in cells]
            )
        for name, units in study.axis_field_units.items():
            of_axis = {key: v for key, v in coords[name][2].items() if key != "scale"}
            coords[name] = (*coords[name][:2], of_axis | {"units": units})
        scales = (
            study.axis_unit_converter.compute_scale_and_scene_coordinates()
            if study.axis_unit_converter
            else {}
        )
        for name, (dims, values) in scales.items():
            about = build_variable_attributes(
                name.removeprefix(DatasetUnits.DIMENSIONLESS_FIELD_NAME_PREFIX), own
            )
            coords[name] = (dims, values, about)
        stored = [scene.stored_fields() for scene in scenes_by_cell_number.values()]
        for name in study.all_scene_field_names:
            present = {scene.get(name) for scene in stored} - {None}
            if name not in {*coords, *study.measure.variables} and len(present) == 1:
                value = present.pop()
                about = build_variable_attributes(name, own, value)
                coords[name] = ((), _convert_to_storable_array([value])[0], about)
        coords |= dict(_compute_derived_coordinates(coords))
        for name, values in study.measure.output_coordinates.items():
            coords[name] = (name, np.asarray(values), build_variable_attributes(name, own))
        return coords | stored_loadings.build_loading_variables(study.user_parts.values())


def _build_coordinates_along_axis(
    study: Study, axis: Axis, scene_fields_of_points: list[dict[str, Any]]
) -> dict[str, Any]:
    """Build the dimension coordinate of an axis, and the coordinates of its fields."""
    coords: dict[str, Any] = {}
    if axis.labels is not None or axis.has_numbered_points:
        words = axis.dimension.replace("_", " ")
        about = {"long_name": words}
        if axis.labels is None:
            about = {"units": "1", "long_name": f"number of the {words}"}
            about |= {"drawn": json.dumps(axis.sampling_info)} if axis.sampling_info else {}
        coords[axis.dimension] = (axis.dimension, _build_dimension_coordinate(axis), about)
    # The coordinate contains the values of the axis, even if the scenes of the first cells do not
    # use these values.
    points: list[AxisPointFieldValues] = [
        {**study.measure.scalar_field_values, **fields, **row}
        for fields, row in zip(scene_fields_of_points, axis.rows, strict=True)
    ]
    for name in axis.fields:
        varied = [point.get(name) for point in points]
        about = build_variable_attributes(
            name, study.quantities_not_in_vocabulary, _find_first_value_not_none(varied)
        )
        coords[name] = (axis.dimension, _convert_to_storable_array(varied), about)
    return coords


def _compute_derived_coordinates(coordinates: Mapping[Any, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the coordinates that are computed from other coordinates."""
    for name, (source, formula) in FORMULAS_OF_DERIVED_COORDINATES.items():
        if source in coordinates:
            dims, values, _attrs = coordinates[source]
            derived = [formula(value) for value in np.ravel(values).tolist()]
            yield (
                name,
                (dims, np.reshape(derived, np.shape(values)), build_variable_attributes(name, {})),
            )


def _convert_to_storable_array(values: list[Any]) -> np.ndarray:
    """Convert the values of a field to an array that NetCDF can store.

    Strings are stored as an object array, and Boolean values as int8. All other values are stored
    as floats, and None is stored as NaN.
    """
    if isinstance(_find_first_value_not_none(values), str):
        return np.array([value or "" for value in values], dtype=object)
    if isinstance(_find_first_value_not_none(values), bool) and None not in values:
        return np.array(values, dtype=np.int8)
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def _find_first_value_not_none(values: list[Any]) -> Any:
    """Return the first value that is not None. If all values are None, return None."""
    return next((value for value in values if value is not None), None)


def build_variable_attributes(
    variable_name: str, study_quantities: Mapping[str, Quantity], example_value: Any = None
) -> dict[str, Any]:
    """Build the attributes of a variable.

    Parameters
    ----------
    variable_name : str
        Name of the variable.
    study_quantities : mapping of str to Quantity
        Quantities that the study defines in addition to the quantities in the vocabulary.
    example_value : object, optional
        Value of the variable at one point. The type of this value determines whether the variable
        has units or flags.

    Returns
    -------
    dict of str to object
        Attributes by name.
    """
    about = find_quantity(variable_name, study_quantities)
    attrs: dict[str, Any] = {"long_name": about.long_name}
    if variable_name in study_quantities and about.symbol:
        attrs["symbol"] = about.symbol  # Symbols that a study defines are not in the vocabulary.
    if about.units and not isinstance(example_value, str | bool):
        attrs["units"] = about.units
    if about.scale:
        attrs["scale"] = about.scale
    attrs |= about.flag_attributes
    if isinstance(example_value, bool):
        attrs |= {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "false true"}
    return attrs
