"""Reductions that find boundaries and level crossings.

A ``Boundary`` lies between two neighbouring cells whose values are on opposite sides of a
threshold. An ``Inverse`` interpolates a smooth variable to find the coordinate value at which the
variable reaches a level.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.quantities import Quantity
from rsfstudy.study.reductions._level_crossing import (
    MIN_SAMPLES_FOR_CROSSING_SEARCH,
    CrossingSearchStatus,
    find_unique_crossing,
)
from rsfstudy.study.reductions.base import (
    DerivativesAndCellCoordinates,
    FieldsDeterminingUnitsByResultSuffix,
    Reduction,
    depends_on_failed_cells,
    find_dimension_of_coordinate,
)

#: Change of ln(value) in the finite differences for the derivatives of an interpolant.
_LOG_STEP_FOR_FINITE_DIFFERENCES = 1e-6


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Boundary(Reduction):
    """Boundary between cells whose values lie below and above a threshold.

    The boundary is not interpolated: the reduction only finds the two neighbouring cells that
    enclose the boundary. A cell is ignored if the difference between its value and the threshold
    does not exceed the numerical error of the value.

    Parameters
    ----------
    name : str
        Name of the boundary, which is the midpoint between two neighbouring cells (the bracket).
        The ends of the bracket are ``<name>_stable`` (value at or below the threshold) and
        ``<name>_unstable`` (value above the threshold). Half the width of the bracket is
        ``<name>_error``. The number of crossings of the threshold along the coordinate is
        ``<name>_crossings``. The boundary is NaN unless there is exactly one crossing.
    of : str
        Name of the variable that is compared with the threshold. A value above the threshold means
        that the cell is unstable.
    on : str
        Name of a one-dimensional coordinate.
    level : float, default: 0.5
        Threshold.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Boundary
    >>> dataset = xr.Dataset(
    ...     {"unstable": ("b_over_a", [0.0, 0.0, 1.0]), "status": ("b_over_a", [0, 0, 0])},
    ...     coords={"b_over_a": [1.0, 2.0, 3.0]},
    ... )
    >>> edge = Boundary(name="edge", of="unstable", on="b_over_a")(dataset)
    >>> float(edge["edge"]), float(edge["edge_error"])
    (2.5, 0.5)
    """

    on: str = ""
    level: float = 0.5
    kind: ClassVar[str] = "boundary"
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {"": ("on",)}

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Find one boundary for each combination of points along the other dimensions.

        If a cell along the coordinate failed, the boundary is NaN. Cells without a value are
        ignored.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Boundary, ends of the bracket, error and number of crossings.

        Raises
        ------
        InvalidValue
            If ``on`` is not a one-dimensional numeric coordinate.
        """
        dimension = find_dimension_of_coordinate(dataset, self.on)
        values = dataset[self.of].where(~depends_on_failed_cells(dataset, self.of, dimension))
        if f"{self.of}_error" in dataset:
            values = values.where(~(abs(values - self.level) <= dataset[f"{self.of}_error"]))
        stable, unstable, crossings = self.bracket_threshold_crossing(values)
        once = crossings == 1
        note = f"between cells of {self.of} below and above {self.level:g} along {self.on}"
        found = {
            "": (0.5 * (stable + unstable)).where(once),
            "_error": (0.5 * abs(unstable - stable)).where(once),
            "_stable": stable,
            "_unstable": unstable,
            "_crossings": crossings,
        }
        return self.results(note, found)

    def bracket_threshold_crossing(self, values: xr.DataArray) -> tuple[xr.DataArray, ...]:
        """Bracket the first crossing of the threshold.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the variable, with the coordinate ``on``.

        Returns
        -------
        stable, unstable : xarray.DataArray
            Coordinates of the cells on either side of the first crossing. If there is no crossing,
            the coordinate of the last cell below the threshold or of the first cell above the
            threshold is returned, and the other coordinate is NaN.
        crossings : xarray.DataArray
            Number of crossings, or NaN if there are no values.
        """
        dimension = find_dimension_of_coordinate(values, self.on)
        edges: tuple[xr.DataArray, ...] = xr.apply_ufunc(
            self._bracket_boundary_along_coordinate,
            values,
            values[self.on].astype(float),
            input_core_dims=[[dimension], [dimension]],
            output_core_dims=[[], [], []],
            vectorize=True,
        )
        return edges

    def _bracket_boundary_along_coordinate(
        self, values: np.ndarray, coordinate: np.ndarray
    ) -> tuple[float, float, float]:
        """Bracket the first crossing of the threshold and count all crossings."""
        order = [i for i in np.argsort(coordinate) if not np.isnan(values[i])]
        if not order:
            return np.nan, np.nan, np.nan
        says_yes, at = values[order] > self.level, coordinate[order]
        changes = np.flatnonzero(says_yes[1:] != says_yes[:-1])
        if changes.size == 0:
            end = (np.nan, at[0]) if says_yes[0] else (at[-1], np.nan)
            return *end, 0.0
        first = changes[0]
        lower, upper = at[first], at[first + 1]
        ends = (upper, lower) if says_yes[first] else (lower, upper)
        return *ends, float(changes.size)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Inverse(Reduction):
    """Coordinate value at which a monotone variable reaches a level.

    The logarithm of the variable is interpolated as a function of the logarithm of the coordinate.

    Parameters
    ----------
    name : str
        Name of the result. Two more variables are returned. ``<name>_error`` is the sum of three
        contributions: the contribution of the uncertainty of the level, the contribution of the
        interpolation, and the contribution of the numerical errors of the cells. The contribution
        of the interpolation is the distance from the result to the farthest position at which a
        curve through the values may reach the level. ``<name>_status`` is ``ok`` or the reason why
        the result is NaN. ``out_of_reach`` means that the variable does not reach the level.
        ``not_unique`` means that the variable reaches the level several times. ``unresolved`` means
        that the variable may oscillate between the cells. ``too_few_points`` means that there are
        too few cells for an interpolation.
    of : str
        Name of the variable that reaches the level. The variable must be positive.
    on : str
        Name of a one-dimensional coordinate. The coordinate must be positive.
    levels : float, or mapping of str to float, default: 1.0
        A single level, or one level for each label of the dimension ``along``. Labels that are not
        in the mapping have no level.
    uncertainty : float, or mapping of str to float, default: 0.0
        Relative uncertainty of the level, given as a single number or as a mapping like ``levels``.
    along : str
        Name of the dimension with the labels in ``levels`` or ``uncertainty``. Required if
        ``levels`` or ``uncertainty`` is a mapping.

    Examples
    --------
    >>> import numpy as np
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Inverse
    >>> x = np.array([1.0, 2.0, 4.0, 8.0])
    >>> dataset = xr.Dataset(
    ...     {"drop": ("stiffness", 3.0 / x), "status": ("stiffness", [0, 0, 0, 0])},
    ...     coords={"stiffness": x},
    ... )
    >>> found = Inverse(name="stiffness_found", of="drop", on="stiffness", levels=1.0)(dataset)
    >>> round(float(found["stiffness_found"]), 6)
    3.0
    """

    on: str = ""
    levels: float | Mapping[str, float] = 1.0
    uncertainty: float | Mapping[str, float] = 0.0
    along: str = ""
    kind: ClassVar[str] = "inverse"
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {"": ("on",)}

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantity that describes the status variable ``<name>_status``."""
        flags = tuple(verdict.name.lower() for verdict in CrossingSearchStatus)
        text = f"status of {self.name.replace('_', ' ')}"
        return [Quantity(f"{self.name}_status", "", "1", text, flags=flags)]

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Find one coordinate value for each combination of points along the other dimensions.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Coordinate value, error and status. The dataset is empty if the dimension has fewer than
            four points.

        Raises
        ------
        InvalidValue
            If ``on`` is not a one-dimensional numeric coordinate.
        """
        dimension = find_dimension_of_coordinate(dataset, self.on)
        if dataset.sizes[dimension] < MIN_SAMPLES_FOR_CROSSING_SEARCH:
            return xr.Dataset()
        values = dataset[self.of].where(~depends_on_failed_cells(dataset, self.of, dimension))
        crossing, error, verdict = xr.apply_ufunc(
            _find_coordinate_at_level,
            values,
            dataset[self.on].astype(float),
            self._broadcast_value_to_labels(dataset, self.levels),
            self._broadcast_value_to_labels(dataset, self.uncertainty),
            input_core_dims=[[dimension], [dimension], [], []],
            output_core_dims=[[], [], []],
            vectorize=True,
        )
        note = f"{self.on} at which {self.of} reaches {self.levels}"
        missed = (
            "range of possible crossings of the curve through the cells, and uncertainty of "
            "the level"
        )
        return xr.Dataset(
            {
                self.name: crossing.assign_attrs(comment=note),
                f"{self.name}_error": error.assign_attrs(comment=missed),
                f"{self.name}_status": verdict.assign_attrs(comment=note),
            }
        )

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the crossing position.

        The interpolant is differentiated with respect to the value of each cell, and the derivative
        is divided by the slope of the interpolant at the crossing.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and the position of the cells, as described in
            `Reduction.derivatives`.
        """
        dimension = find_dimension_of_coordinate(dataset, self.on)
        by_cells = xr.apply_ufunc(
            _compute_crossing_position_derivatives,
            dataset[self.of],
            dataset[self.on].astype(float),
            self._broadcast_value_to_labels(dataset, self.levels),
            input_core_dims=[[dimension], [dimension], []],
            output_core_dims=[[dimension]],
            vectorize=True,
        )
        return [(by_cells, {})]

    def _broadcast_value_to_labels(
        self, dataset: xr.Dataset, value_or_values_by_label: float | Mapping[str, float]
    ) -> xr.DataArray:
        """Return the level, or the uncertainty of the level, for each label of the coordinate."""
        if not isinstance(value_or_values_by_label, Mapping):
            return xr.DataArray(float(value_or_values_by_label))
        labels = dataset[self.along]
        stated = [float(value_or_values_by_label.get(label, np.nan)) for label in labels.values]
        return xr.DataArray(stated, {self.along: labels}, self.along)


def _find_coordinate_at_level(
    values: np.ndarray, coordinate: np.ndarray, level: float, log_level_uncertainty: float
) -> tuple[float, float, float]:
    """Return the position, error and status of the level crossing of one curve."""
    x, y, _places = _take_logs_of_positive_samples(values, coordinate)
    if np.isnan(level) or level <= 0.0:
        return np.nan, np.nan, float(CrossingSearchStatus.OUT_OF_REACH)
    found = find_unique_crossing(x, y, np.log(level))
    if found.search_status is not CrossingSearchStatus.OK:
        return np.nan, np.nan, float(found.search_status)
    ends = [
        find_unique_crossing(x, y, np.log(level) + d).position
        for d in (-log_level_uncertainty, log_level_uncertainty)
    ]
    place, first, last = np.exp(
        [found.position, found.position_lower_bound, found.position_upper_bound]
    ).tolist()
    error = max(place - first, last - place)
    error += place * float(np.max(np.abs(found.position - np.array(ends))))
    return place, error, float(found.search_status)


def _compute_crossing_position_derivatives(
    values: np.ndarray, coordinate: np.ndarray, level: float
) -> np.ndarray:
    """Return the derivatives of the crossing position.

    All derivatives are 0 if the curve does not cross the level.
    """
    x, y, places = _take_logs_of_positive_samples(values, coordinate)
    slopes = np.zeros(values.size)
    if np.isnan(level) or level <= 0.0:
        return slopes
    fine = find_unique_crossing(x, y, np.log(level)).position
    if np.isnan(fine):
        return slopes
    # The values are changed one at a time. The interpolant is a smooth function of the values,
    # except at isolated kinks.
    moved = PchipInterpolator(x, y + _LOG_STEP_FOR_FINITE_DIFFERENCES * np.eye(x.size), axis=1)(
        fine
    )
    # If the slope is zero, the errors are unbounded.
    rise = float(PchipInterpolator(x, y)(fine, 1)) or np.nan
    slopes[places] = (
        (moved - np.log(level))
        / _LOG_STEP_FOR_FINITE_DIFFERENCES
        / rise
        * np.exp(fine)
        / values[places]
    )
    return slopes


def _take_logs_of_positive_samples(
    values: np.ndarray, coordinate: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the logarithms of the sorted coordinate and of the values.

    The third returned array contains the indices of the remaining points. Points are omitted if the
    coordinate or the value is not positive.
    """
    places = np.flatnonzero(np.isfinite(values) & (values > 0.0) & (coordinate > 0.0))
    places = places[np.argsort(coordinate[places])]
    return np.log(coordinate[places]), np.log(values[places]), places
