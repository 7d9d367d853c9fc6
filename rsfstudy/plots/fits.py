"""Figure that shows fits to laboratory records.

The first panels show the records with the fitted curves. For the first record, further panels show
the residuals, the autocorrelation of the residuals, and the correlations of the parameters.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib import colormaps, rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rsfstudy.fitting import PARAMETERS, split_window_number
from rsfstudy.plots._axis_formatting import MIN_FONT_SIZE, describe_point
from rsfstudy.plots._style import add_grey_legend_entry, cycle_style
from rsfstudy.status import Status
from rsfstudy.study import Panel

#: Maximum lag of the autocorrelation, minimum number of rows that remain after a long record is
#: thinned, and maximum number of panels that show a record.
_MAX_AUTOCORRELATION_LAGS, _MAX_DRAWN_RECORD_ROWS, _MAX_RECORD_PANELS = 40, 20_000, 4
#: Largest margin beyond the ends of the record as a fraction of the total extent of the windows.
_MAX_RECORD_MARGIN_OVER_WINDOW_EXTENT = 0.02
#: Margin on both sides of the fitted windows as a fraction of the total extent of the windows, and
#: width of the moving average of residuals as a fraction of a window.
_MARGIN_FRACTION_BESIDE_WINDOWS, _RESIDUAL_AVERAGING_FRACTION_OF_WINDOW = 0.15, 0.02
#: Maximum number of parameters of a correlation matrix whose cells contain numbers. A colour bar
#: replaces the numbers in larger matrices.
_MAX_PARAMETERS_WITH_CORRELATION_TEXT = 8
#: Margin above and below the visible curves as a fraction of their range.
_Y_MARGIN_OVER_CURVE_RANGE = 0.05
#: Half width of the confidence band of the fitted curve, in standard errors.
_CONFIDENCE_BAND_HALF_WIDTH_IN_STDERRS = 2.0
_LINE_STYLE_OF_RECORD_ROWS: dict[str, Any] = {
    "color": "0.7",
    "markersize": 1.5,
    "linestyle": "none",
    "marker": ".",
    "zorder": 1,
}
_DISPLACEMENT_LABEL = r"Load point displacement ($\mu$m)"


def build_fit_panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """Build the panels of a figure that shows fits to laboratory records.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of ``rsfstudy.fit``. The required variables are ``record_displacement``,
        ``record_friction``, ``record_time``, ``fitted_friction``, ``fitted_friction_stderr``,
        ``residual`` and ``whitened_residual`` along ``row``, and ``correlation`` with the
        coordinate ``parameter``. The dimension ``law`` is required, and the dimensions ``record``,
        ``step`` and ``part`` are optional.

    Returns
    -------
    tuple of Panel
        One panel per record, for at most four records, followed by panels for the first record:
        residuals, autocorrelation, and one panel of correlations for each pair of laws.
    """
    records = dataset.sizes.get("record", 1)
    part, record = ([d] if d in dataset.dims else [] for d in ("part", "record"))
    named = Panel(title=partial(_format_record_title, records), x_label=_DISPLACEMENT_LABEL)
    of_record = [
        replace(
            named,
            isel=dict.fromkeys(part, 0) | dict.fromkeys(record, number),
            overlays=[_draw_record_with_fits],
            y_label="Friction coefficient",
        )
        for number in range(min(records, _MAX_RECORD_PANELS))
    ]
    first = replace(named, isel=of_record[0].isel)
    pairs = _pair_laws_with_correlations(dataset.isel(first.isel))
    return (
        *of_record,
        replace(first, overlays=[_draw_residuals], y_label="Residual friction"),
        replace(
            first,
            overlays=[_draw_autocorrelation_of_residuals],
            title=_format_loading_step_title,
            x_label="Lag (rows)",
            y_label="Autocorrelation of residuals",
        ),
        *(
            Panel(
                isel=first.isel,
                overlays=[partial(_draw_parameter_correlation_matrix, law_numbers=pair)],
                title=partial(_format_correlation_title, law_numbers=pair),
            )
            for pair in pairs
        ),
    )


def _format_record_title(record_count: int, dataset: xr.Dataset) -> str:
    """Return the name of the record, or an empty string if there is only one record."""
    if record_count == 1:
        return ""
    return (
        f"{dataset['record'].item()}{f' (of {record_count})' * (record_count > _MAX_RECORD_PANELS)}"
    )


def _format_loading_step_title(dataset: xr.Dataset) -> str:
    """Return the title of the first step, or an empty string if there is no dimension ``step``."""
    if "step" not in dataset.dims:
        return ""
    return f"Step {dataset['step'].values[0]:g}{_format_step_count_in_parentheses(dataset)}"


def _format_step_count_in_parentheses(dataset: xr.Dataset) -> str:
    """Return the number of steps in parentheses, or an empty string for a single step."""
    return f" (of {dataset.sizes['step']})" if dataset.sizes.get("step", 1) > 1 else ""


def _iterate_fits_and_law_descriptions(
    dataset: xr.Dataset, *, only_first_step: bool = False
) -> Iterator[tuple[xr.Dataset, str, int]]:
    """Iterate over the fits of a record.

    Each item contains the results of a fit, the description of the friction law, and the index of
    the friction law. If ``only_first_step`` is True, only the fits to the first step are included.
    """
    steps = range(1 if only_first_step else dataset.sizes.get("step", 1))
    for number in range(dataset.sizes["law"]):
        for step in steps:
            one = dataset.isel(
                {d: n for d, n in (("law", number), ("step", step)) if d in dataset.dims}
            )
            yield one, describe_point(one, "law"), number


def _extract_thinned_columns_of_fit(
    fit: xr.Dataset, column_names: Sequence[str]
) -> list[np.ndarray]:
    """Return selected columns of a fit, without the rows that contain missing values.

    If the columns have many rows, some rows are omitted at regular intervals.
    """
    columns = np.array([fit[name].values for name in column_names])
    columns = columns[:, np.isfinite(columns).all(axis=0)]
    return list(columns[:, :: max(1, columns.shape[1] // _MAX_DRAWN_RECORD_ROWS)])


def _iterate_columns_of_fit_windows(
    fit: xr.Dataset, column_names: Sequence[str]
) -> Iterator[list[np.ndarray]]:
    """Iterate over the windows of a fit.

    Each item is a list of arrays, one array per column. A window is a sequence of consecutive rows
    that contain values and have increasing times.
    """
    rows = np.flatnonzero(fit[column_names[-1]].notnull().values)
    late = np.diff(fit["record_time"].values[rows]) > 0.0
    for part in np.split(rows, np.flatnonzero((np.diff(rows) > 1) | ~late) + 1):
        if len(part):
            yield _extract_thinned_columns_of_fit(fit.isel(row=part), column_names)


def _draw_record_with_fits(dataset: xr.Dataset, axes: Axes) -> None:
    """Draw a record with the fitted curves and their confidence bands.

    If the record does not constrain a parameter, the confidence band is not drawn, because it would
    cover the panel.
    """
    windows: list[float] = []
    all_have_bands = True
    record = [np.zeros(0)]
    first_law = -1
    for one, name, law in _iterate_fits_and_law_descriptions(dataset):
        if not record[0].size:
            record = _extract_thinned_columns_of_fit(
                one, ("record_displacement", "record_friction")
            )
            if not record[0].size:
                continue  # A fit that failed has no rows.
            axes.plot(*record, label="record", **_LINE_STYLE_OF_RECORD_ROWS)
            first_law = law
        has_band = _is_identified(one)
        all_have_bands = all_have_bands and has_band
        names = "record_displacement", "fitted_friction", "fitted_friction_stderr"
        style = cycle_style(law) | {"marker": "", "label": name, "linewidth": 1.2, "zorder": 3}
        for x, y, error in _iterate_columns_of_fit_windows(one, names):
            if law == first_law:
                axes.axvspan(x[0], x[-1], color="0.94", lw=0, zorder=0, label="fitted window")
            windows += [x[0], x[-1]]
            if has_band:
                band = {"color": style["color"], "alpha": 0.3, "lw": 0, "zorder": 2}
                half = _CONFIDENCE_BAND_HALF_WIDTH_IN_STDERRS * error
                axes.fill_between(x, y - half, y + half, **band)
            axes.plot(x, y, **style)
    if windows:
        beside = _MARGIN_FRACTION_BESIDE_WINDOWS * (max(windows) - min(windows))
        # The axis does not extend far beyond the ends of the record.
        pad = _MAX_RECORD_MARGIN_OVER_WINDOW_EXTENT * (max(windows) - min(windows))
        axes.set_xlim(
            max(min(windows) - beside, float(np.min(record[0])) - pad),
            min(max(windows) + beside, float(np.max(record[0])) + pad),
        )
        _set_y_limits_to_visible_lines(axes)
    said = rf"$\pm${_CONFIDENCE_BAND_HALF_WIDTH_IN_STDERRS:g} standard errors"
    if not all_have_bands:
        said += ", if identified"
    patch = {"linewidth": 5.0, "alpha": 0.3}
    if dataset.sizes["law"] == 1:
        patch["color"] = cycle_style(0)["color"]
    else:  # The bands have the colours of the laws, so the legend entry is grey.
        said += " (bands)"
    add_grey_legend_entry(axes, said, patch)


def _is_identified(fit: xr.Dataset) -> bool:
    """Return True unless the status of a fit is ``not_identified``."""
    return "status" not in fit or int(fit["status"]) != Status.NOT_IDENTIFIED


def _set_y_limits_to_visible_lines(axes: Axes) -> None:
    """Set the y limits to the range of the curves and records inside the x limits."""
    left, right = axes.get_xlim()
    visible = []
    for line in axes.lines:
        x, y = np.asarray(line.get_data(), dtype=float)
        visible.append(y[(x >= left) & (x <= right) & np.isfinite(y)])
    values = np.concatenate(visible)
    margin = _Y_MARGIN_OVER_CURVE_RANGE * (float(np.ptp(values)) or 1.0)
    axes.set_ylim(values.min() - margin, values.max() + margin)


def _draw_residuals(dataset: xr.Dataset, axes: Axes) -> None:
    """Draw the residuals of the fits, and the moving averages of the residuals.

    If the window of a step overlaps the window of an earlier step, the moving average in the
    overlap is drawn in a pale colour.
    """
    previous_end, end, overlap = dict[int, float](), dict[int, float](), False
    first_law = None
    axes.axhline(0.0, color="0.5", lw=0.8, zorder=2)
    for one, name, law in _iterate_fits_and_law_descriptions(dataset):
        style = cycle_style(law) | {"label": name, "marker": "", "linewidth": 1.0, "zorder": 3}
        previous_end[law] = end.get(law, -math.inf)
        for x, y in _iterate_columns_of_fit_windows(one, ("record_displacement", "residual")):
            first_law = law if first_law is None else first_law
            if law == first_law:
                axes.plot(x, y, label=f"rows, {name}", **_LINE_STYLE_OF_RECORD_ROWS)
            count = max(1, round(_RESIDUAL_AVERAGING_FRACTION_OF_WINDOW * len(x)))
            mean = np.ones(count) / count
            x_mean, y_mean = np.convolve(x, mean, "valid"), np.convolve(y, mean, "valid")
            first = int(np.count_nonzero(x_mean <= previous_end[law]))
            axes.plot(x_mean[first:], y_mean[first:], **style)
            if first:
                axes.plot(x_mean[:first], y_mean[:first], **style | {"alpha": 0.35, "label": None})
            end[law] = max(x[-1], end.get(law, -math.inf))
            overlap = overlap or first > 0
    if overlap:
        add_grey_legend_entry(axes, "overlap of windows", {"alpha": 0.35})


def _draw_autocorrelation_of_residuals(dataset: xr.Dataset, axes: Axes) -> None:
    """Draw the autocorrelation of residuals and of whitened residuals."""
    axes.axhline(0.0, color="0.5", lw=0.8)
    curve_count = 0
    for one, name, law in _iterate_fits_and_law_descriptions(dataset, only_first_step=True):
        left, whitened = _extract_thinned_columns_of_fit(one, ("residual", "whitened_residual"))
        if len(left) <= _MAX_AUTOCORRELATION_LAGS:
            continue
        style = cycle_style(law) | {"marker": ""}
        axes.plot(_compute_autocorrelation(left), **style | {"label": name})
        axes.plot(_compute_autocorrelation(whitened), **style | {"linestyle": ":"})
        bound = 2.0 / len(left) ** 0.5
        if not curve_count:
            axes.axhspan(-bound, bound, color="0.9", lw=0, zorder=0, label="white noise (95 %)")
        curve_count += 1
    text = "whitened residuals" + ", same colours" * (curve_count > 1)
    add_grey_legend_entry(axes, text, {"linestyle": ":"})


def _compute_autocorrelation(residuals: np.ndarray) -> np.ndarray:
    """Compute the autocorrelation at all lags up to the maximum lag."""
    seen = residuals - residuals.mean()
    size = float(seen @ seen) or 1.0
    return np.array(
        [1.0, *(seen[lag:] @ seen[:-lag] / size for lag in range(1, _MAX_AUTOCORRELATION_LAGS + 1))]
    )


def _pair_laws_with_correlations(dataset: xr.Dataset) -> list[tuple[int, ...]]:
    """Return a list with the indices of the friction laws for each correlation panel.

    Each panel shows two laws, or one law if the number of laws is odd. Laws without correlations in
    the first step are omitted.
    """
    known = [
        law
        for one, _name, law in _iterate_fits_and_law_descriptions(dataset, only_first_step=True)
        if one["correlation"].notnull().any()
    ]
    return [tuple(known[n : n + 2]) for n in range(0, len(known), 2)] or [(0,)]


def _format_correlation_title(dataset: xr.Dataset, law_numbers: Sequence[int] = (0,)) -> str:
    """Return the title of a correlation panel, with the first step and the names of the laws."""
    step = f", step {dataset['step'].values[0]:g}" if "step" in dataset.dims else ""
    laws = [describe_point(dataset.isel(law=n), "law") for n in law_numbers]
    if len(laws) == 1:
        return f"Correlation{step}: {laws[0]}"
    first, second = (law.removesuffix(" law") for law in laws)
    return f"Correlation{step}: {first} below, {second} above"


def _format_parameter_symbol(parameter_name: str) -> str:
    """Return the symbol of a parameter, with the window number if the name contains a number."""
    plain, number = split_window_number(parameter_name)
    symbol = PARAMETERS[plain].symbol
    return f"{symbol[:-1]}^{{({number})}}$" if number else symbol


def _draw_parameter_correlation_matrix(
    dataset: xr.Dataset, axes: Axes, law_numbers: Sequence[int] = (0,)
) -> None:
    """Draw the correlation matrix of the parameters of one or two friction laws.

    The lower triangle of the matrix shows the fit of the first friction law, and the upper triangle
    shows the fit of the second friction law. A parameter is omitted if neither of the two fits
    contains correlations for this parameter.
    """
    fits = [one for one, *_ in _iterate_fits_and_law_descriptions(dataset, only_first_step=True)]
    lower, upper = (fits[law_numbers[n]]["correlation"].values for n in (0, -1))
    known = (np.isfinite(lower) | np.isfinite(upper)).any(axis=0)
    known |= not known.any()
    values = (np.tril(lower) + np.triu(upper, 1))[np.ix_(known, known)]
    names = [_format_parameter_symbol(str(name)) for name in dataset["parameter"].values[known]]
    colours = colormaps["RdBu_r"].with_extremes(bad="0.85")
    image = axes.imshow(values, vmin=-1.0, vmax=1.0, cmap=colours, aspect="auto")
    axes.grid(visible=False)
    _label_rows_and_columns_of_matrix(axes, names)
    if len(names) <= _MAX_PARAMETERS_WITH_CORRELATION_TEXT:
        _write_correlation_coefficients(axes, values)
    else:
        bar = cast(Figure, axes.figure).colorbar(image, ax=axes, pad=0.02)
        bar.set_label("Correlation coefficient")


def _label_rows_and_columns_of_matrix(axes: Axes, parameter_symbols: Sequence[str]) -> None:
    """Label the rows and columns of a correlation matrix without overlapping labels."""
    # A line of text is about 1.6 times as high as its letters.
    line = 1.6 * rcParams["xtick.labelsize"] / 72.0
    width, height = (
        side * length
        for side, length in zip(
            cast(Figure, axes.figure).get_size_inches(),
            (axes.get_position().width, axes.get_position().height),
            strict=True,
        )
    )
    for axis, length in ((axes.xaxis, width), (axes.yaxis, height)):
        some = slice(None, None, max(1, math.ceil(len(parameter_symbols) * line / length)))
        axis.set_ticks(range(len(parameter_symbols))[some], parameter_symbols[some])
    if len(parameter_symbols) > _MAX_PARAMETERS_WITH_CORRELATION_TEXT:
        axes.tick_params(axis="x", labelrotation=90.0)
    axes.tick_params(length=0)


def _write_correlation_coefficients(axes: Axes, correlation_matrix: np.ndarray) -> None:
    """Write the correlation coefficients into the cells of the matrix."""
    for (row, column), value in np.ndenumerate(correlation_matrix):
        shade = "white" if abs(value) > 0.6 else "black"
        text = f"{value:.2f}".replace("0.", ".") if row != column else ""
        if np.isfinite(value):
            size = max(MIN_FONT_SIZE, min(7.0, 50.0 / len(correlation_matrix)))
            axes.text(column, row, text, ha="center", va="center", color=shade, fontsize=size)
