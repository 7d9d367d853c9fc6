"""Functions that write code and draw figures to reproduce a selection of results."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

import xarray as xr

from rsfstudy.explorer.cell_recomputation import RecomputedCell
from rsfstudy.explorer.curve_and_map_data import (
    find_error_variable_name,
    list_plotted_variable_names,
)
from rsfstudy.explorer.plot_selections import MAP, PlotSelection
from rsfstudy.plots import Figure, draw_figure
from rsfstudy.study import Figure as DeclaredFigure
from rsfstudy.study import Panel

#: Line of the code of results that were not read from a file.
_CODE_COMMENT_FOR_RESULTS_IN_MEMORY = (
    "# results is the dataset that you passed to rsfstudy.explore."
)


def draw_figure_of_selection(dataset: xr.Dataset, selection: PlotSelection) -> Figure:
    """Draw the figure of a selection with the functions of ``rsfstudy``.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, in the units of the plot.
    selection : PlotSelection
        Selection to draw.

    Returns
    -------
    matplotlib.figure.Figure
        Figure.
    """
    if selection.kind == MAP:
        part = dataset.isel(dict(selection.point_index_by_dimension)).transpose(
            ..., selection.second_dimension, selection.x
        )
        return draw_figure(part, variable=selection.variable)
    panel = Panel(**_build_panel_arguments(dataset, selection))
    return draw_figure(dataset, DeclaredFigure([panel]))


def _build_panel_arguments(dataset: xr.Dataset, selection: PlotSelection) -> dict[str, Any]:
    """Return the arguments of ``rsfstudy.Panel`` for the curves of a selection."""
    options: dict[str, Any] = {"x": selection.x, "y": selection.variable}
    options |= {"hue": [selection.second_dimension]} if selection.second_dimension else {}
    options |= {"facet": [selection.facet]} if selection.facet else {}
    options |= (
        {"isel": dict(selection.point_index_by_dimension)}
        if selection.point_index_by_dimension
        else {}
    )
    error = find_error_variable_name(dataset, selection.variable)
    return options | ({"error_bars": error} if error else {}) | {"log": None}


def format_selection_as_python_code(
    dataset: xr.Dataset,
    selection: PlotSelection,
    results_path: str,
    recomputed_cell: RecomputedCell | None,
    cell_coordinates: Mapping[str, Any] | None,
) -> str:
    """Return Python code that prints the selected numbers and plots them.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, in the units of the plot.
    selection : PlotSelection
        Selection to reproduce.
    results_path : str
        Path of the results. If the string is empty, the results were not read from a file.
    recomputed_cell : RecomputedCell or None
        Cell that was computed again.
    cell_coordinates : mapping of str to object, or None
        Coordinates of this cell.

    Returns
    -------
    str
        Python code.
    """
    lines = ["import rsfstudy", ""]
    lines += (
        [f"results = rsfstudy.open({results_path!r})"]
        if results_path
        else [_CODE_COMMENT_FOR_RESULTS_IN_MEMORY]
    )
    shown = "results"
    if "sigma_star" in dataset.variables:
        shown = "shown"
        lines.append("shown = results.rsf.in_units()  # in MPa, um and s")
    points, names = (
        dict(selection.point_index_by_dimension),
        list_plotted_variable_names(dataset, selection),
    )
    lines.append(f"part = {shown}[{names!r}]{f'.isel({points!r})' if points else ''}")
    lines += ["print(part.to_dataframe())", ""]
    if selection.kind == MAP:
        plane = f"transpose(..., {selection.second_dimension!r}, {selection.x!r})"
        selected = f"{shown}.isel({points!r})" if points else shown
        lines.append(f"figure = rsfstudy.plot({selected}.{plane}, {selection.variable!r})")
    else:
        options = ", ".join(
            f"{n}={v!r}" for n, v in _build_panel_arguments(dataset, selection).items()
        )
        lines.append(f"panel = rsfstudy.Panel({options})")
        lines.append(f"figure = rsfstudy.plot({shown}, user_figure=rsfstudy.Figure([panel]))")
    lines.append('figure.savefig("figure.pdf")')
    if recomputed_cell is not None:
        lines += ["", f"scene, outcome = rsfstudy.recompute_cell(results, {cell_coordinates!r})"]
        lines += ["print(outcome.status.label, outcome.values)", recomputed_cell.motion_python_code]
    return "\n".join(lines) + "\n"


def format_selection_as_shell_commands(
    selection: PlotSelection,
    results_path: str,
    widget_state_json: str,
    cell_coordinates: Mapping[str, Any] | None,
) -> str:
    """Write commands that reproduce a selection.

    Parameters
    ----------
    selection : PlotSelection
        Selection to reproduce.
    results_path : str
        Path of the results. If the string is empty, the results were not read from a file.
    widget_state_json : str
        Settings of the view as JSON.
    cell_coordinates : mapping of str to object, or None
        Coordinates of the chosen cell.

    Returns
    -------
    str
        Commands for a shell, or a comment if the results were not read from a file.
    """
    if not results_path:
        return "# The results were not read from a file. Save them with rsfstudy.run first.\n"
    commands = [
        ["rsfstudy", "export", results_path, "--csv", "--output", "table.csv"],
        [
            "rsfstudy",
            "plot",
            results_path,
            "--variable",
            selection.variable,
            "--output",
            "figure.pdf",
        ],
        ["rsfstudy", "explore", results_path, "--state", widget_state_json],
    ]
    if cell_coordinates is not None:
        cells = [word for n, v in cell_coordinates.items() for word in ("--cell", f"{n}={v}")]
        commands.append(["rsfstudy", "rerun", results_path, *cells])
    return "".join(f"{shlex.join(command)}\n" for command in commands)
