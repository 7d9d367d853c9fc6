"""Functions that tabulate the primary output of a study and summarise the study."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from rsfstudy.formatting import format_abbreviated_list, format_number_or_text
from rsfstudy.reporting.cell_tables import format_status_counts
from rsfstudy.reporting.reduction_tables import list_names_of_slope_reductions
from rsfstudy.reporting.text_tables import (
    MAX_ROWS_IN_THINNED_TABLE,
    TextTable,
    TextTableColumn,
    build_table_along_dimensions,
    format_axis_name,
    format_number_or_dash,
    format_units,
)
from rsfstudy.rig import DatasetUnits
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset

#: Maximum number of cells in a table that shows all cells.
_MAX_ROWS_WITHOUT_THINNING = 36
#: Maximum number of fields per point of a numbered axis. If there are more fields, a table shows
#: only a selection of the cells.
_MAX_FIELD_COLUMNS_WITHOUT_THINNING = 4


def build_primary_output_table(dataset: xr.Dataset) -> TextTable:
    """Build a table of the primary output of a study.

    Each row of the table contains the coordinates, the value and the error estimate of one cell. If
    some cells have no value, the table also contains the status of each cell. If the lattice has
    many cells, the table contains only a selection of the cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    TextTable
        Table of the primary output. The table is empty if the study has no primary output.
    """
    name = StoredDataset(dataset).primary_output_name
    if name is None:
        return TextTable([])
    dataset = DatasetUnits(dataset).convert_to_display_units()
    name = name if name in dataset else DatasetUnits.convert_to_dimensional_variable_name(name)
    dims = dataset["status"].dims
    drawn = [n for n in _find_fields_along_numbered_axes(dataset) if n in dataset.coords]
    columns = [
        TextTableColumn(format_axis_name(dataset[n]), n, format_number_or_text) for n in drawn
    ]
    columns.append(TextTableColumn(name, name, format_number_or_dash, "value"))
    if f"{name}_error" in dataset:
        short = partial(format_number_or_dash, format_specification=".1e")
        columns.append(TextTableColumn("numerical error", f"{name}_error", short, "error"))
    size, fewer = dataset["status"].size, 1 + len(drawn) // _MAX_FIELD_COLUMNS_WITHOUT_THINNING
    most = (
        size if size <= _MAX_ROWS_WITHOUT_THINNING // fewer else MAX_ROWS_IN_THINNED_TABLE // fewer
    )
    at = select_thinned_points({str(d): dataset.sizes[d] for d in dims}, most)
    few = dataset[[*(column.variable_name for column in columns), "status"]].isel(at).load()
    if (few["status"] != int(Status.OK)).any():
        columns.append(
            TextTableColumn("status", "status", Status.labels_by_code().__getitem__, "status")
        )
    units, shown = format_units(dataset[name]), few["status"].size
    caption = str(dataset[name].attrs.get("long_name", name)) + f", in {units}" * (units != "1")
    if shown < size:
        full = dataset.sizes
        every = [f"{n} of {full[d]} {d}" for d, n in few.sizes.items() if n < full[d]]
        which = f"{shown} of {size:,} cells, {', '.join(every)}, from first to last"
        caption += f" ({which}; to write all cells, use rsfstudy export --csv)"
    table = build_table_along_dimensions(few, dims, columns, caption)
    about = {"name": name, "units": units}
    rows = [{**about, **row} for row in table.unformatted_rows]
    return replace(table, unformatted_rows=rows)


def _find_fields_along_numbered_axes(dataset: xr.Dataset) -> list[str]:
    """Return the fields that vary along numbered axes, such as samples."""
    axes = [axis.values for axis in StoredDataset(dataset).study_declaration.axes]
    columns = [
        v for v in axes if isinstance(v, Mapping) and isinstance(next(iter(v.values())), list)
    ]
    return [name for column in columns for name in column]


def select_thinned_points(
    dimension_sizes: Mapping[str, int], max_cells: int
) -> dict[str, np.ndarray]:
    """Select points of each dimension so that the number of cells is limited.

    Along each dimension with at least two selected points, the selection includes the first and the
    last point.

    Parameters
    ----------
    dimension_sizes : mapping of str to int
        Size of each dimension.
    max_cells : int
        Maximum number of selected cells. The longest dimensions are thinned first.

    Returns
    -------
    dict of str to numpy.ndarray
        Indices of the selected points of each dimension.
    """
    kept = {dimension: min(size, max_cells) for dimension, size in dimension_sizes.items()}
    while math.prod(kept.values()) > max_cells:
        kept[max(kept, key=kept.__getitem__)] -= 1
    return {
        dimension: np.unique(np.linspace(0, size - 1, kept[dimension]).round().astype(int))
        for dimension, size in dimension_sizes.items()
    }


def summarise_study_as_text_lines(dataset: xr.Dataset) -> list[str]:
    """Summarise the results of a study in a few lines of text.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    list of str
        Lines of text: the range of the primary output, one line per slope, and the number of cells
        with each status.
    """
    lines, converted = [], DatasetUnits(dataset).convert_to_display_units()
    if (name := StoredDataset(dataset).primary_output_name) is not None:
        values = converted[
            name if name in converted else DatasetUnits.convert_to_dimensional_variable_name(name)
        ]
        told, units = np.unique(values.values[np.isfinite(values.values)]), format_units(values)
        ends = " to ".join(map(format_number_or_text, dict.fromkeys((*told[:1], *told[-1:]))))
        text = f"{ends}{f' {units}' * (units != '1')}" if ends else "no values"
        lines.append(f"{values.name}: {text}")
    for slope in list_names_of_slope_reductions(converted):
        slopes, units = converted[slope].values.ravel().tolist(), format_units(converted[slope])
        lines.append(
            f"{slope}: {format_abbreviated_list(slopes, ', ')}{f' {units}' * (units != '1')}"
        )
    return [*lines, format_status_counts(dataset)]
