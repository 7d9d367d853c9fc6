"""Data for the curves and maps that show a selection of results.

The functions return arrays, and never draw a plot.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from rsfstudy.explorer.plot_selections import PlotSelection, find_dimension_along_x
from rsfstudy.plots import are_log_spaced, compute_cell_edges, describe_point
from rsfstudy.status import Status

#: Maximum number of panels, of curves in a panel, and of points of a curve.
MAX_PANELS, MAX_CURVES, MAX_POINTS = 12, 40, 4000
#: Number of blocks along each axis in which the statuses of many cells are shown.
_MAX_STATUS_MARK_BLOCKS_PER_AXIS = 50


@dataclass(frozen=True)
class CurveData:
    """Numbers of one curve.

    Parameters
    ----------
    label : str
        Point of the curve on the colour dimension. The string is empty for a single curve.
    index_on_colour_dimension : int
        Index of this point.
    x, y, y_error : ndarray
        Coordinates, values and error estimates. If the variable has no error estimate, ``y_error``
        contains NaN.
    status_codes : ndarray of int
        Status codes of the cells. The code is ``Status.OK`` if a point belongs to no cell.
    cell_numbers : ndarray of int
        Numbers of the cells in row-major order, or -1 if a point belongs to no cell.
    """

    label: str
    index_on_colour_dimension: int
    x: np.ndarray
    y: np.ndarray
    y_error: np.ndarray
    status_codes: np.ndarray
    cell_numbers: np.ndarray


@dataclass(frozen=True)
class MapData:
    """Numbers of one map.

    Parameters
    ----------
    x, y : ndarray
        Coordinates of the cells along both axes, in increasing order.
    cell_values, status_codes : ndarray, shape (y, x)
        Values and status codes of the cells.
    cell_numbers : ndarray of int, shape (y, x)
        Numbers of the cells in row-major order, or -1 if a point belongs to no cell.
    """

    x: np.ndarray
    y: np.ndarray
    cell_values: np.ndarray
    status_codes: np.ndarray
    cell_numbers: np.ndarray

    def find_cell_number_at(self, x: float, y: float) -> int:
        """Return the number of the cell at a position, or -1 outside the map."""
        at = []
        for points, value in ((self.y, y), (self.x, x)):
            edges = compute_cell_edges(points, are_log_spaced(points))
            at.append(int(np.searchsorted(edges, value, side="right")) - 1)
            if not edges[0] <= value <= edges[-1]:
                return -1
        return int(self.cell_numbers[min(at[0], self.y.size - 1), min(at[1], self.x.size - 1)])


def find_error_variable_name(dataset: xr.Dataset, variable_name: str) -> str:
    """Return the name of the error estimate of a variable, or an empty string."""
    names = (f"{variable_name}_stderr", f"{variable_name}_error")
    return next(
        (n for n in names if n in dataset and dataset[n].dims == dataset[variable_name].dims), ""
    )


def list_plotted_variable_names(dataset: xr.Dataset, selection: PlotSelection) -> list[str]:
    """Return the names of the variables displayed by a selection.

    The list contains the plotted variable, its error estimate, the variable on the x axis, the
    status and the message.
    """
    names = [selection.variable, find_error_variable_name(dataset, selection.variable), selection.x]
    if has_one_value_per_cell(dataset, selection.variable):
        names += ["status", "message"]
    return [n for n in dict.fromkeys(names) if n in dataset.data_vars]


def has_one_value_per_cell(dataset: xr.Dataset, variable_name: str) -> bool:
    """Return True if a variable has exactly one value per cell."""
    return {*dataset["status"].dims} <= {*dataset[variable_name].dims}


def iterate_panel_selections(
    dataset: xr.Dataset, selection: PlotSelection
) -> Iterator[PlotSelection]:
    """Yield one selection per panel, each at a different point of the facet dimension.

    At most 12 evenly spaced points of the facet dimension are used.
    """
    if not selection.facet:
        yield selection
        return
    for place in choose_evenly_spaced_indices(dataset.sizes[selection.facet], MAX_PANELS):
        points = {**selection.point_index_by_dimension, selection.facet: int(place)}
        yield PlotSelection(
            selection.variable, selection.kind, selection.x, selection.second_dimension, "", points
        )


def choose_evenly_spaced_indices(size: int, max_count: int) -> np.ndarray:
    """Return indices at regular intervals, including the first and the last index."""
    return np.unique(np.linspace(0, size - 1, min(size, max_count)).round().astype(int))


def describe_selected_points(dataset: xr.Dataset, point_indices: Mapping[str, int]) -> str:
    """Describe the selected points of several dimensions as a mathtext label."""
    varied = [d for d in point_indices if dataset.sizes[d] > 1]
    return ", ".join(
        describe_point(dataset.coords.to_dataset().isel({d: point_indices[d]}), d) for d in varied
    )


def _extract_panel_arrays(
    dataset: xr.Dataset, panel: PlotSelection, dimensions: Sequence[str]
) -> tuple[np.ndarray, ...]:
    """Return the values, errors, statuses and cell numbers shown in a panel."""
    lattice, error = dataset["status"], find_error_variable_name(dataset, panel.variable)
    status, cells = xr.DataArray(int(Status.OK)), xr.DataArray(-1)
    if has_one_value_per_cell(dataset, panel.variable):
        status = lattice.isel(
            {d: i for d, i in panel.point_index_by_dimension.items() if d in lattice.dims}
        )
        cells, stride = xr.DataArray(0), 1
        for name in map(str, reversed(lattice.dims)):
            place: Any = xr.DataArray(np.arange(lattice.sizes[name]), dims=name)
            cells = cells + stride * (
                place if name in dimensions else panel.point_index_by_dimension[name]
            )
            stride *= lattice.sizes[name]
    values = (
        dataset[panel.variable]
        .isel(panel.point_index_by_dimension)
        .transpose(*dimensions)
        .drop_vars(dimensions, errors="ignore")
    )
    errors = dataset[error].isel(panel.point_index_by_dimension) if error else xr.DataArray(np.nan)
    rest = [
        one.drop_vars(list(one.coords)).broadcast_like(values).transpose(*dimensions)
        for one in (errors, status, cells)
    ]
    return values.values.astype(float), *(one.values for one in rest)


def extract_curves_of_panel(dataset: xr.Dataset, panel: PlotSelection) -> list[CurveData]:
    """Return the curves of a single panel.

    If a panel has more than 40 curves, only a regularly spaced subset of the curves is returned. A
    curve with more than 4,000 points is thinned: of each group of neighbouring points, the lowest
    point, the highest point and the first failed cell are kept.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    panel : PlotSelection
        Selection with the kind ``"lines"``.

    Returns
    -------
    list of CurveData
        One curve per selected point of the colour dimension.
    """
    along, second = find_dimension_along_x(dataset, panel.variable, panel.x), panel.second_dimension
    dims = ([second] if second else []) + [along]
    arrays = [a.reshape(-1, a.shape[-1]) for a in _extract_panel_arrays(dataset, panel, dims)]
    x = _broadcast_x_values(dataset, panel, along, arrays[0].shape)
    found = []
    for number in choose_evenly_spaced_indices(len(arrays[0]), MAX_CURVES):
        values, errors, status, cells = (a[number] for a in arrays)
        name = (
            convert_mathtext_to_unicode(describe_selected_points(dataset, {second: int(number)}))
            if second
            else ""
        )
        kept = choose_drawn_point_indices(values, status)
        rows = (x[number], values, errors, status, cells)
        found.append(CurveData(name, int(number), *(row[kept] for row in rows)))
    return found


def _broadcast_x_values(
    dataset: xr.Dataset, panel: PlotSelection, x_dimension: str, shape: tuple[int, ...]
) -> np.ndarray:
    """Return the x values of all curves. If the values are names, return their indices."""
    values = dataset[panel.x] if panel.x in dataset.variables else dataset[x_dimension]
    if values.dtype.kind not in "iuf":
        return np.broadcast_to(np.arange(shape[-1], dtype=float), shape)
    at = {d: i for d, i in panel.point_index_by_dimension.items() if d in values.dims}
    dims = [d for d in (panel.second_dimension, x_dimension) if d in values.dims]
    return np.broadcast_to(values.isel(at).transpose(*dims).values.astype(float), shape)


def choose_drawn_point_indices(
    values: np.ndarray, status_codes: np.ndarray | None = None
) -> np.ndarray:
    """Return the indices of the curve points that are drawn.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Values of the curve.
    status_codes : ndarray of int, shape (n,), optional
        Status codes of the points.

    Returns
    -------
    ndarray of int
        All indices if there are at most 4,000 points. Otherwise the first and the last index, and
        the lowest point, the highest point and the first failed cell of each group of neighbouring
        points.
    """
    if values.size <= MAX_POINTS:
        return np.arange(values.size)
    starts = np.linspace(0, values.size, MAX_POINTS // 4, endpoint=False).astype(int)
    low, high = np.nan_to_num(values, nan=np.inf), np.nan_to_num(values, nan=-np.inf)
    kept = [0, values.size - 1]
    for start, end in zip(starts, [*starts[1:], values.size], strict=True):
        kept += [start + int(low[start:end].argmin()), start + int(high[start:end].argmax())]
        if status_codes is not None:
            kept.append(start + int((status_codes[start:end] != int(Status.OK)).argmax()))
    return np.unique(kept)


def extract_map_of_panel(dataset: xr.Dataset, panel: PlotSelection) -> MapData:
    """Return the map of a single panel.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    panel : PlotSelection
        Selection with the kind ``"map"``.

    Returns
    -------
    MapData
        Values and statuses, with increasing coordinates.
    """
    dims = (panel.second_dimension, panel.x)
    y, x = (dataset[d].values.astype(float) for d in dims)
    order = np.ix_(np.argsort(y), np.argsort(x))
    values, _errors, status, cells = (a[order] for a in _extract_panel_arrays(dataset, panel, dims))
    return MapData(np.sort(x), np.sort(y), values, status, cells)


def sample_map_at_pixels(
    map_data: MapData,
    x_range: tuple[float, float],
    y_range: tuple[float, float],
    pixel_shape: tuple[int, int],
) -> np.ndarray:
    """Sample the values of a map at the pixels of an image.

    Parameters
    ----------
    map_data : MapData
        Map to sample.
    x_range, y_range : tuple of (float, float)
        Limits of the image. If the points of an axis are spaced logarithmically, the pixels are
        spaced logarithmically.
    pixel_shape : tuple of (int, int)
        Number of pixels along y and along x.

    Returns
    -------
    ndarray
        Values at the pixels.
    """
    places = []
    limits = (y_range, x_range)
    for points, (low, high), count in zip(
        (map_data.y, map_data.x), limits, pixel_shape, strict=True
    ):
        edges, is_log = compute_cell_edges(points, log := are_log_spaced(points)), log
        low, high = (np.log(low), np.log(high)) if is_log else (low, high)
        pixels = low + (high - low) * (np.arange(count) + 0.5) / count
        pixels = np.exp(pixels) if is_log else pixels
        places.append(np.clip(np.searchsorted(edges, pixels, "right") - 1, 0, points.size - 1))
    return map_data.cell_values[np.ix_(*places)]


class CellStatusMarks(NamedTuple):
    """Cells whose status is not "ok".

    Parameters
    ----------
    row_indices, column_indices : ndarray of int
        Index of the curve and index along the curve, or indices of a map along y and x.
    status_codes, cell_numbers : ndarray of int
        Status codes and cell numbers.
    """

    row_indices: np.ndarray
    column_indices: np.ndarray
    status_codes: np.ndarray
    cell_numbers: np.ndarray


def find_cells_to_mark_with_status(
    status_codes: np.ndarray, cell_numbers: np.ndarray
) -> CellStatusMarks:
    """Find the cells whose status is not "ok".

    If there are more than 2,500 such cells, the array is divided into 50 by 50 blocks, and one cell
    of each status is kept in each block. A single failed cell among a million cells is therefore
    always found.

    Parameters
    ----------
    status_codes, cell_numbers : ndarray of int, shape (rows, columns)
        Status codes and cell numbers.

    Returns
    -------
    CellStatusMarks
        Cells in row-major order.
    """
    rows, columns = np.nonzero(status_codes != int(Status.OK))
    codes = status_codes[rows, columns]
    if rows.size > _MAX_STATUS_MARK_BLOCKS_PER_AXIS**2:
        blocks = [
            at * _MAX_STATUS_MARK_BLOCKS_PER_AXIS // size
            for at, size in zip((rows, columns), status_codes.shape, strict=True)
        ]
        keys = np.ravel_multi_index(
            (*blocks, codes),
            (_MAX_STATUS_MARK_BLOCKS_PER_AXIS, _MAX_STATUS_MARK_BLOCKS_PER_AXIS, len(Status)),
        )
        kept = np.unique(keys, return_index=True)[1]
        rows, columns, codes = rows[kept], columns[kept], codes[kept]
    return CellStatusMarks(rows, columns, codes, cell_numbers[rows, columns])


def format_status_name(status_code: int) -> str:
    """Return the name of a status with spaces instead of underscores."""
    return Status.labels_by_code()[status_code].replace("_", " ")


def convert_mathtext_to_unicode(mathtext: str) -> str:
    """Convert a label in mathtext to Unicode characters, for legends and widgets."""
    text = mathtext.replace("\n", " ").replace(r"\,", " ").replace("$", "")
    text = re.sub(
        r"\\([A-Za-z]+) ?", lambda found: _convert_symbol_name_to_character(found[1]), text
    )
    for mark, digits in ((r"\^", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"), ("_", "₀₁₂₃₄₅₆₇₈₉₋")):
        small = str.maketrans("0123456789-", digits)
        text = re.sub(
            mark + r"\{?(-?\d+)\}?", partial(_convert_to_super_or_subscripts, small), text
        )
    return re.sub(r"[{}]", "", text).replace("\\ ", " ")


def _convert_to_super_or_subscripts(digit_table: dict[int, int], match: re.Match[str]) -> str:
    """Return the digits of a match as superscripts or subscripts."""
    return match[1].translate(digit_table)


def _convert_symbol_name_to_character(symbol_name: str) -> str:
    """Return the character of a symbol, or the name of an operator such as ``ln``."""
    entity = f"&{symbol_name};"
    character = html.unescape(entity)
    return symbol_name if character == entity else character
