"""Corner plots of samples and cases.

The function ``build_corner_figure`` builds a corner plot of the primary output and the sampled
fields: a triangle of scatter plots with histograms on its diagonal. If the study has further axes,
a different colour is used for each point along these axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from rsfstudy.errors import InvalidValue
from rsfstudy.plots._axis_formatting import (
    describe_point,
    has_numeric_points,
    is_numeric_variable,
    list_primary_and_varying_variables,
)
from rsfstudy.plots._figure_size import compute_figure_size_in_inches
from rsfstudy.plots._style import cycle_style
from rsfstudy.plots._text_formatting import find_quantity_symbol_or_name, format_units, wrap_text
from rsfstudy.storage import StoredDataset
from rsfstudy.study import DrawFunction, Figure, Panel, read_quantities_not_in_vocabulary
from rsfstudy.vocabulary import find_quantity

#: Maximum number of sampled fields in the corner plot. The measured variable is not counted.
_MAX_SCATTERED_FIELDS = 6
#: Maximum number of parameters in the corner plot of posterior draws.
_MAX_SCATTERED_PARAMETERS = 6
#: Maximum number of ticks per axis, and maximum number of columns of panels with this number of
#: ticks. If there are more columns, the panels are narrow.
_MAX_TICKS, _MAX_COLUMNS_OF_WIDE_PANELS = 3, 5
#: Position of the note about omitted quantities, in units of the size of the first panel. The note
#: is to the right of the panel, where a corner plot is empty.
_POSITION_OF_NOTE = 1.1, 1.0
#: Maximum number of characters per line of the note.
_MAX_NOTE_LINE_CHARACTERS = 60
#: Maximum number of columns of a figure that is as wide as one column of a journal page.
_MAX_PANEL_COLUMNS_OF_NARROW_FIGURE = 2
#: Style of the points in scatter plots. The points are rasterised in vector graphics, because there
#: may be 10^5 points.
_SCATTER_POINT_STYLE = {"marker": ".", "markeredgewidth": 0.0, "rasterized": True}
#: Diameters of the points in points (1/72 inch), and number of samples above which the smaller
#: diameter is used.
_LARGE_POINT, _SMALL_POINT, _MIN_SAMPLES_WITH_SMALL_POINTS = 4.5, 2.0, 500
#: Maximum number of bins of a histogram, and maximum number of characters per line of a label.
_MAX_BINS, _MAX_LABEL_LINE_CHARACTERS = 30, 17


class CornerFigure(Figure):
    """Figure whose panels form the lower triangle of a square grid.

    Parameters
    ----------
    panels : sequence of Panel
        Panels of the lower triangle and the diagonal, row by row.
    columns : int
        Number of rows and columns of the square.
    """

    @property
    def subplot_positions(self) -> list[int]:
        """Positions of the panels, counted row by row from 0."""
        return [row * self.columns + x for row in range(self.columns) for x in range(row + 1)]

    def compute_size_in_inches(self) -> tuple[float, float]:
        """Return the width and the height of the figure in inches."""
        width, height = compute_figure_size_in_inches(
            1 if self.columns <= _MAX_PANEL_COLUMNS_OF_NARROW_FIGURE else 2, 1
        )
        return width, width if self.columns > 1 else height

    def align_x_axes_and_hide_inner_labels(self, axes_of_panels: Sequence[Axes]) -> None:
        """Align the x axes in each column, and hide axis and tick labels between panels.

        Parameters
        ----------
        axes_of_panels : sequence of matplotlib.axes.Axes
            Axes of the panels, in the order of ``panels``.
        """
        for axes, place in zip(axes_of_panels, self.subplot_positions, strict=True):
            row, column = divmod(place, self.columns)
            if row < self.columns - 1:
                axes.set_xlabel("")
                axes.tick_params(labelbottom=False)
                axes.xaxis.get_offset_text().set_visible(False)
            if row == column and self.columns > 1:
                axes.set_ylabel("")
                axes.tick_params(left=False, labelleft=False)
                axes.grid(visible=False)
            elif column:
                axes.set_ylabel("")
                axes.tick_params(labelleft=False)
                axes.yaxis.get_offset_text().set_visible(False)
            bottom = axes_of_panels[
                self.subplot_positions.index((self.columns - 1) * self.columns + column)
            ]
            axes.set_xlim(bottom.get_xlim())
            if row == self.columns - 1 and self.columns > _MAX_COLUMNS_OF_WIDE_PANELS:
                # The label of a narrow panel is below the power of ten of the tick labels.
                axes.xaxis.labelpad += 1.2 * float(rcParams["font.size"])


def build_corner_figure(dataset: xr.Dataset, variable: str | None = None) -> CornerFigure | None:
    """Build the corner plot of a study with samples or cases.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, with the variable ``status`` and the attribute ``declaration``. The
        fields of a sampled axis are coordinates of the dataset.
    variable : str, optional
        Name of a measured variable. The default is the primary output.

    Returns
    -------
    CornerFigure or None
        Corner plot of the variable and at most six fields. A note lists the fields that are
        omitted. The result is None if the study has no axis with numbered points, such as samples
        or cases. The result is also None if the variable is not numeric, or does not vary
        along an axis with numbered points.
    """
    fields = _list_sampled_fields_by_dimension(dataset)
    if variable is not None and variable not in dataset:
        return None
    along = next((d for d in fields if variable is None or d in dataset[variable].dims), None)
    if along is None or (variable is not None and not is_numeric_variable(dataset[variable])):
        return None
    measured = [variable] if variable else list_primary_and_varying_variables(dataset)[:1]
    sampled = [
        name for name in fields[along] if name not in measured and has_numeric_points(dataset, name)
    ]
    # The last row shows the measured variable against each sampled field.
    names = sampled[:_MAX_SCATTERED_FIELDS] + measured
    if not names:
        return None
    return _build_triangle(dataset, along, names, sampled[_MAX_SCATTERED_FIELDS:])


def build_posterior_corner_figure(dataset: xr.Dataset) -> tuple[CornerFigure, xr.Dataset]:
    """Build the corner plot of the posterior draws of a fit.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of ``rsfstudy.fit`` with the variable ``posterior``.

    Returns
    -------
    figure : CornerFigure
        Corner plot of the first six parameters. A note lists the parameters that are omitted. Fits
        of several laws or steps have different colours.
    dataset : xarray.Dataset
        Dataset with one variable per parameter, which contains the draws of the parameter.

    Raises
    ------
    InvalidValue
        If the fit has no posterior draws.
    """
    known = dataset["posterior"].dropna("parameter", how="all")
    names = [str(n) for n in known["parameter"].values]
    if not names:
        remedy = "The variable message of the fit contains the reason."
        raise InvalidValue("variable", "posterior", "has no draws in this fit", remedy=remedy)
    draws = {n: dataset["posterior"].sel(parameter=n, drop=True) for n in names}
    drawn = dataset.assign({n: draws[n].assign_attrs(dataset[n].attrs) for n in names})
    shown, omitted = names[:_MAX_SCATTERED_PARAMETERS], names[_MAX_SCATTERED_PARAMETERS:]
    return _build_triangle(drawn, "draw", shown, omitted), drawn


def _build_triangle(
    dataset: xr.Dataset,
    sample_dimension: str,
    variable_names: Sequence[str],
    omitted_names: Sequence[str],
) -> CornerFigure:
    """Build the corner plot of several variables, and add a note that lists omitted variables."""
    panels = [
        _build_scatter_or_histogram_panel(
            dataset,
            sample_dimension,
            x,
            y,
            is_narrow=len(variable_names) > _MAX_COLUMNS_OF_WIDE_PANELS,
        )
        for number, y in enumerate(variable_names, start=1)
        for x in variable_names[:number]
    ]
    if omitted_names:
        note = partial(_write_note_on_omitted_variables, omitted_names)
        panels[0] = replace(panels[0], overlays=[*panels[0].overlays, note])
    return CornerFigure(panels, len(variable_names))


def _write_note_on_omitted_variables(
    variable_names: Sequence[str], _dataset: xr.Dataset, axes: Axes
) -> None:
    """Write the names of the omitted variables to the right of the first panel."""
    text = wrap_text(f"Not shown: {', '.join(variable_names)}", _MAX_NOTE_LINE_CHARACTERS)
    note = axes.text(*_POSITION_OF_NOTE, text, transform=axes.transAxes, va="top")
    note.set_in_layout(False)  # The layout would otherwise widen the first column.


def _list_sampled_fields_by_dimension(dataset: xr.Dataset) -> dict[str, list[str]]:
    """Return the field names of each dimension that has numbered points."""
    found: dict[str, list[str]] = {}
    for axis in (stored.build_axis() for stored in StoredDataset(dataset).study_declaration.axes):
        if axis.has_numbered_points and dataset.sizes.get(axis.dimension, 1) > 1:
            found[axis.dimension] = [name for name in axis.fields if name in dataset.coords]
    return found


def _build_scatter_or_histogram_panel(
    dataset: xr.Dataset,
    sample_dimension: str,
    x_variable: str,
    y_variable: str,
    *,
    is_narrow: bool,
) -> Panel:
    """Build the panel for a pair of quantities.

    The panel is a histogram if both quantities are identical, and a scatter plot otherwise.
    """
    by = dict.fromkeys(
        str(d)
        for name in (x_variable, y_variable)
        for d in dataset[name].dims
        if d != sample_dimension
    )
    has_long_labels = is_narrow or x_variable.endswith("_error")
    few_ticks = partial(_limit_tick_count, _MAX_TICKS - has_long_labels)
    if x_variable == y_variable:
        marks: list[DrawFunction] = [partial(draw_histogram, x_variable, list(by)), few_ticks]
        return Panel(
            overlays=marks,
            x_label=_format_short_axis_label(dataset, x_variable),
            y_label="Number",
            title="",
        )
    many = dataset.sizes[sample_dimension] >= _MIN_SAMPLES_WITH_SMALL_POINTS
    return Panel(
        x=x_variable,
        y=y_variable,
        hue=list(by),
        markers_only=True,
        style=_SCATTER_POINT_STYLE | {"markersize": _SMALL_POINT if many else _LARGE_POINT},
        overlays=[few_ticks],
        title="",
        x_label=_format_short_axis_label(dataset, x_variable),
        y_label=_format_short_axis_label(dataset, y_variable),
    )


def _format_short_axis_label(dataset: xr.Dataset, variable_name: str) -> str:
    """Return an axis label with a symbol and units, broken into short lines.

    The lines of the label are short because the panels are small, and because matplotlib writes the
    power of ten of the tick labels next to the first line.
    """
    about = find_quantity(
        variable_name.removesuffix("_error"), read_quantities_not_in_vocabulary(dataset)
    )
    units = "" if about.units in ("", "1") or about.scale else f" ({format_units(about.units)})"
    text = wrap_text(f"{find_quantity_symbol_or_name(about)}{units}", _MAX_LABEL_LINE_CHARACTERS)
    return f"error of\n{text}" if variable_name.endswith("_error") else text


def _limit_tick_count(max_x_tick_count: int, _dataset: xr.Dataset, axes: Axes) -> None:
    """Limit the number of ticks so that the tick labels do not overlap.

    Error estimates have long tick labels, so the x axis has fewer ticks for error estimates. The x
    axis also has fewer ticks if the panels are narrow.
    """
    axes.xaxis.set_major_locator(MaxNLocator(max_x_tick_count))
    axes.yaxis.set_major_locator(MaxNLocator(_MAX_TICKS))


def draw_histogram(
    variable_name: str, colour_dimensions: Sequence[str], dataset: xr.Dataset, axes: Axes
) -> None:
    """Draw a histogram of a variable for each combination of points along other axes.

    Parameters
    ----------
    variable_name : str
        Name of the variable.
    colour_dimensions : sequence of str
        Dimensions of the lattice. Each combination of their points has a separate histogram.
    dataset : xarray.Dataset
        Dataset with the variable and with coordinates for the dimensions ``colour_dimensions``.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    values = dataset[variable_name]
    known = values.values[np.isfinite(values.values)]
    edges = np.histogram_bin_edges(known, min(_MAX_BINS, max(5, round(known.size**0.5))))
    for number, at in enumerate(np.ndindex(*(values.sizes[d] for d in colour_dimensions))):
        part = values.isel(dict(zip(colour_dimensions, at, strict=True)))
        text = ", ".join(describe_point(part, d) for d in colour_dimensions) or None
        style = {"color": cycle_style(number)["color"], "alpha": 0.5, "label": text}
        axes.hist(part.values[np.isfinite(part.values)], list(edges), **style)
