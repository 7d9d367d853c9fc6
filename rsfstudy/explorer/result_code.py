"""Code and figures that reproduce a selection of results."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

import xarray as xr

from rsfstudy.explorer.result_arrays import error_name, part_names
from rsfstudy.explorer.result_cells import RecomputedCell
from rsfstudy.explorer.result_selections import MAP, Selection
from rsfstudy.plots import Figure, draw_figure
from rsfstudy.study import Figure as DeclaredFigure
from rsfstudy.study import Panel

#: Line of the code of results that were not read from a file.
_RESULTS_WITHOUT_FILE = "# results is the dataset that you passed to rsfstudy.explore."


def draw_selection(dataset: xr.Dataset, selection: Selection) -> Figure:
    """Draw the figure of a selection with the functions of ``rsfstudy``.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, in the units of the plot.
    selection : Selection
        Selection to draw.

    Returns
    -------
    matplotlib.figure.Figure
        Figure.
    """
    if selection.kind == MAP:
        part = dataset.isel(dict(selection.points)).transpose(..., selection.second, selection.x)
        return draw_figure(part, variable=selection.variable)
    panel = Panel(**_panel_options(dataset, selection))
    return draw_figure(dataset, DeclaredFigure([panel]))


def _panel_options(dataset: xr.Dataset, selection: Selection) -> dict[str, Any]:
    """Return the arguments of ``rsfstudy.Panel`` for the curves of a selection."""
    options: dict[str, Any] = {"x": selection.x, "y": selection.variable}
    options |= {"hue": [selection.second]} if selection.second else {}
    options |= {"facet": [selection.facet]} if selection.facet else {}
    options |= {"isel": dict(selection.points)} if selection.points else {}
    error = error_name(dataset, selection.variable)
    return options | ({"error_bars": error} if error else {}) | {"log": None}


def write_python(
    dataset: xr.Dataset,
    selection: Selection,
    file: str,
    cell: RecomputedCell | None,
    cell_place: Mapping[str, Any] | None,
) -> str:
    """Write Python code that prints the numbers of a selection and draws its figure.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, in the units of the plot.
    selection : Selection
        Selection to reproduce.
    file : str
        Path of the results. If the string is empty, the results were not read from a file.
    cell : RecomputedCell or None
        Cell that was computed again.
    cell_place : mapping of str to object, or None
        Coordinates of this cell.

    Returns
    -------
    str
        Python code.
    """
    lines = ["import rsfstudy", ""]
    lines += [f"results = rsfstudy.open({file!r})"] if file else [_RESULTS_WITHOUT_FILE]
    shown = "results"
    if "sigma_star" in dataset.variables:
        shown = "shown"
        lines.append("shown = results.rsf.in_units()  # in MPa, um and s")
    points, names = dict(selection.points), part_names(dataset, selection)
    lines.append(f"part = {shown}[{names!r}]{f'.isel({points!r})' if points else ''}")
    lines += ["print(part.to_dataframe())", ""]
    if selection.kind == MAP:
        plane = f"transpose(..., {selection.second!r}, {selection.x!r})"
        selected = f"{shown}.isel({points!r})" if points else shown
        lines.append(f"figure = rsfstudy.plot({selected}.{plane}, {selection.variable!r})")
    else:
        options = ", ".join(f"{n}={v!r}" for n, v in _panel_options(dataset, selection).items())
        lines.append(f"panel = rsfstudy.Panel({options})")
        lines.append(f"figure = rsfstudy.plot({shown}, user_figure=rsfstudy.Figure([panel]))")
    lines.append('figure.savefig("figure.pdf")')
    if cell is not None:
        lines += ["", f"scene, outcome = rsfstudy.recompute_cell(results, {cell_place!r})"]
        lines += ["print(outcome.status.label, outcome.values)", cell.code]
    return "\n".join(lines) + "\n"


def write_commands(
    selection: Selection, file: str, state: str, cell_place: Mapping[str, Any] | None
) -> str:
    """Write commands that reproduce a selection.

    Parameters
    ----------
    selection : Selection
        Selection to reproduce.
    file : str
        Path of the results. If the string is empty, the results were not read from a file.
    state : str
        Settings of the view as JSON.
    cell_place : mapping of str to object, or None
        Coordinates of the chosen cell.

    Returns
    -------
    str
        Commands for a shell, or a comment if the results were not read from a file.
    """
    if not file:
        return "# The results were not read from a file. Save them with rsfstudy.run first.\n"
    commands = [
        ["rsfstudy", "export", file, "--csv", "--output", "table.csv"],
        ["rsfstudy", "plot", file, "--variable", selection.variable, "--output", "figure.pdf"],
        ["rsfstudy", "explore", file, "--state", state],
    ]
    if cell_place is not None:
        cells = [word for n, v in cell_place.items() for word in ("--cell", f"{n}={v}")]
        commands.append(["rsfstudy", "rerun", file, *cells])
    return "".join(f"{shlex.join(command)}\n" for command in commands)
