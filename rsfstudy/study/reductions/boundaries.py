"""Boundaries: where a lattice changes from no to yes, and where a smooth number reaches a level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from rsfstudy.error_boundary import guard_methods
from rsfstudy.quantities import Quantity
from rsfstudy.study.reductions._level_crossing import (
    MIN_SAMPLES_OF_CURVE,
    CrossingStatus,
    find_crossing,
)
from rsfstudy.study.reductions.base import (
    DerivativesByVariable,
    Reduction,
    UnitFieldsBySuffix,
    dimension_of_coordinate,
    refused_result_mask,
)

#: Change of ln(value) by which derivatives of an interpolant are taken.
_LOG_STEP_OF_DERIVATIVES = 1e-6


@guard_methods
@dataclass(frozen=True)
class Boundary(Reduction):
    """Boundary between the points of a coordinate whose cells say no and those that say yes.

    Nothing is interpolated: cells that answer yes or no bracket the boundary, and no more. A cell
    nearer to the level than its numerical error does not say which.

    Parameters
    ----------
    name : str
        Name of the boundary, the middle of its bracket; ``<name>_stable`` and ``<name>_unstable``
        (the ends of the bracket), ``<name>_error`` (half its width) and ``<name>_crossings`` (how
        often the answer changes: the boundary is a number only where it changes once) come with it.
    of : str
        Variable that is above `level` where the answer is yes (unstable).
    on : str
        Coordinate along one dimension.
    level : float
        What separates no from yes.
    """

    on: str = ""
    level: float = 0.5
    kind: ClassVar[str] = "boundary"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {"": ("on",)}

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Bracket the boundary along the dimension of `on`, for each point of the others.

        Failed cells refuse their row; cells that answered without a number, or without saying yes
        or no, are left out.

        Raises
        ------
        InvalidValue
            Where `on` is no coordinate along one dimension.
        """
        dimension = dimension_of_coordinate(dataset, self.on)
        values = dataset[self.of].where(~refused_result_mask(dataset, self.of, dimension))
        if f"{self.of}_error" in dataset:
            values = values.where(~(abs(values - self.level) <= dataset[f"{self.of}_error"]))
        stable, unstable, crossings = self.bracket(values)
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

    def bracket(self, values: xr.DataArray) -> tuple[xr.DataArray, ...]:
        """The cells that say no and yes next to the first change of the answer along `on`, and how
        often it changes; NaN where no cell says so.
        """
        dimension = dimension_of_coordinate(values, self.on)
        edges: tuple[xr.DataArray, ...] = xr.apply_ufunc(
            self._bracket_along_coordinate,
            values,
            values[self.on].astype(float),
            input_core_dims=[[dimension], [dimension]],
            output_core_dims=[[], [], []],
            vectorize=True,
        )
        return edges

    def _bracket_along_coordinate(
        self, values: np.ndarray, coordinate: np.ndarray
    ) -> tuple[float, float, float]:
        """Ends of the bracket next to the first change of the answer, and the number of changes."""
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


@guard_methods
@dataclass(frozen=True)
class Inverse(Reduction):
    """Coordinate value at which a monotone variable reaches a level.

    The variable is interpolated in logarithms of the variable and the coordinate.

    Parameters
    ----------
    name : str
        Name of the result. Two more variables are returned. ``<name>_error`` is the sum of three
        contributions: the uncertainty of the level, the distance to the farthest position at which
        a curve through the cells may reach the level, and the numerical errors of the cells.
        ``<name>_status`` is ``ok`` or gives the reason why the result is NaN. ``out_of_reach``
        means that the variable does not reach the level, and ``not_unique`` that the variable
        reaches the level several times. ``unresolved`` means that the variable may oscillate
        between the cells, and ``too_few_points`` that there are too few cells for an interpolation.
    of : str
        Variable that reaches the level. The variable must be positive.
    on : str
        One-dimensional coordinate. The coordinate must be positive.
    levels : float, or mapping of str to float
        A single level, or one level for each label of the dimension ``along``. Labels that are not
        in the mapping have no level.
    uncertainty : float, or mapping of str to float
        Relative uncertainty of the level, in the same form as ``levels``.
    along : str
        Dimension of the labels.
    """

    on: str = ""
    levels: float | Mapping[str, float] = 1.0
    uncertainty: float | Mapping[str, float] = 0.0
    along: str = ""
    kind: ClassVar[str] = "inverse"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {"": ("on",)}

    @property
    def quantities(self) -> Sequence[Quantity]:
        flags = tuple(verdict.name.lower() for verdict in CrossingStatus)
        text = f"status of {self.name.replace('_', ' ')}"
        return [Quantity(f"{self.name}_status", "", "1", text, flags=flags)]

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Interpolate along the dimension of the coordinate ``on``.

        Raises
        ------
        InvalidValue
            If ``on`` is not a one-dimensional coordinate.
        """
        dimension = dimension_of_coordinate(dataset, self.on)
        if dataset.sizes[dimension] < MIN_SAMPLES_OF_CURVE:
            return xr.Dataset()
        values = dataset[self.of].where(~refused_result_mask(dataset, self.of, dimension))
        crossing, error, verdict = xr.apply_ufunc(
            _invert_along_coordinate,
            values,
            dataset[self.on].astype(float),
            self._select_value_for_each_label(dataset, self.levels),
            self._select_value_for_each_label(dataset, self.uncertainty),
            input_core_dims=[[dimension], [dimension], [], []],
            output_core_dims=[[], [], []],
            vectorize=True,
        )
        note = f"{self.on} at which {self.of} reaches {self.levels}"
        missed = "places where a curve through the cells may be, and uncertainty of the level"
        return xr.Dataset(
            {
                self.name: crossing.assign_attrs(comment=note),
                f"{self.name}_error": error.assign_attrs(comment=missed),
                f"{self.name}_status": verdict.assign_attrs(comment=note),
            }
        )

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """Those of the interpolant by its points, over its slope."""
        dimension = dimension_of_coordinate(dataset, self.on)
        by_cells = xr.apply_ufunc(
            _crossing_position_derivatives,
            dataset[self.of],
            dataset[self.on].astype(float),
            self._select_value_for_each_label(dataset, self.levels),
            input_core_dims=[[dimension], [dimension], []],
            output_core_dims=[[dimension]],
            vectorize=True,
        )
        return [(by_cells, {})]

    def _select_value_for_each_label(
        self, dataset: xr.Dataset, values: float | Mapping[str, float]
    ) -> xr.DataArray:
        if not isinstance(values, Mapping):
            return xr.DataArray(float(values))
        labels = dataset[self.along]
        stated = [float(values.get(label, np.nan)) for label in labels.values]
        return xr.DataArray(stated, {self.along: labels}, self.along)


def _invert_along_coordinate(
    values: np.ndarray, coordinate: np.ndarray, level: float, uncertainty: float
) -> tuple[float, float, float]:
    x, y, _places = _log_coordinate_and_values(values, coordinate)
    if np.isnan(level) or level <= 0.0:
        return np.nan, np.nan, float(CrossingStatus.OUT_OF_REACH)
    found = find_crossing(x, y, np.log(level))
    if found.status is not CrossingStatus.OK:
        return np.nan, np.nan, float(found.status)
    ends = [find_crossing(x, y, np.log(level) + d).position for d in (-uncertainty, uncertainty)]
    place, first, last = np.exp([found.position, found.lower_bound, found.upper_bound]).tolist()
    error = max(place - first, last - place)
    error += place * float(np.max(np.abs(found.position - np.array(ends))))
    return place, error, float(found.status)


def _crossing_position_derivatives(
    values: np.ndarray, coordinate: np.ndarray, level: float
) -> np.ndarray:
    """Derivatives of the place where the level is reached by all values; 0 where there is none."""
    x, y, places = _log_coordinate_and_values(values, coordinate)
    slopes = np.zeros(values.size)
    if np.isnan(level) or level <= 0.0:
        return slopes
    fine = find_crossing(x, y, np.log(level)).position
    if np.isnan(fine):
        return slopes
    # each value moved in turn: the interpolant is smooth in them, but for kinks
    moved = PchipInterpolator(x, y + _LOG_STEP_OF_DERIVATIVES * np.eye(x.size), axis=1)(fine)
    rise = float(PchipInterpolator(x, y)(fine, 1)) or np.nan  # at a flat end errors have no bound
    slopes[places] = (
        (moved - np.log(level)) / _LOG_STEP_OF_DERIVATIVES / rise * np.exp(fine) / values[places]
    )
    return slopes


def _log_coordinate_and_values(
    values: np.ndarray, coordinate: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Logarithms of the coordinate, ascending, and of the values; and which points they are of."""
    places = np.flatnonzero(np.isfinite(values) & (values > 0.0) & (coordinate > 0.0))
    places = places[np.argsort(coordinate[places])]
    return np.log(coordinate[places]), np.log(values[places]), places
