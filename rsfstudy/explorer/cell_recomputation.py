"""Functions that recompute a single cell, and return the scene, the outcome and the motion."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from bokeh.plotting import figure

from rsfstudy.api import recompute_cell, simulate
from rsfstudy.explorer.curve_and_map_data import (
    choose_drawn_point_indices,
    convert_mathtext_to_unicode,
)
from rsfstudy.measures import Measure, Outcome
from rsfstudy.plots import format_axis_label
from rsfstudy.slider import Scene
from rsfstudy.storage import StoredDataset

#: Variables that can be along x in the plot of a motion. The first available variable is used.
_X_VARIABLES_OF_MOTION_PLOT = ("time", "load_point_displacement", "slip")
#: Load of the motion if a measure solves for this load and has found no value.
_FALLBACK_STEP_SIZE_BY_LOADING_FIELD = {
    "load_velocity_ratio": 2.0, "displacement_step": 1.0, "normal_stress_step": 0.1,
}  # fmt: skip
#: Load point velocity in V_* of the motion of a scene that has no step.
_VELOCITY_RATIO_IF_SCENE_HAS_NO_STEP = 1.01


@dataclass(frozen=True)
class RecomputedCell:
    """Cell that was computed again.

    Parameters
    ----------
    cell_number : int
        Number of the cell in row-major order.
    scene : Scene
        Scene of the cell.
    measure_outcome : Outcome
        Results of the measure.
    motion : xarray.Dataset
        Motion of the cell.
    motion_explanation : str
        Explanation of the motion.
    motion_python_code : str
        Python statement that computes the motion.
    """

    cell_number: int
    scene: Scene
    measure_outcome: Outcome
    motion: xr.Dataset
    motion_explanation: str
    motion_python_code: str


def find_cell_coordinates(results: xr.Dataset, cell_number: int) -> dict[str, Any]:
    """Return the coordinates of a cell.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study.
    cell_number : int
        Number of the cell in row-major order.

    Returns
    -------
    dict of str to object
        Value or label on each dimension of the lattice.
    """
    status = results["status"]
    index = np.unravel_index(cell_number, status.shape)
    return {
        str(d): results[d].values[i].item()
        if results[d].dtype.kind != "O"
        else results[d].values[i]
        for d, i in zip(status.dims, index, strict=True)
    }


def recompute_cell_and_motion(
    results: xr.Dataset, cell_number: int, report_progress: Callable[[float, str], None]
) -> RecomputedCell:
    """Compute the outcome and the motion of a cell again.

    If the measure records the motion, for example a limit cycle, the result contains the recorded
    motion. Otherwise, the motion of the scene is simulated. If the measure solves for a critical
    load, the motion is simulated at a load for which the measure has verified instability.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study.
    cell_number : int
        Number of the cell in row-major order.
    report_progress : callable
        Function that receives the progress as a fraction and a text.

    Returns
    -------
    RecomputedCell
        Scene, outcome and motion.
    """
    coordinates, study = find_cell_coordinates(results, cell_number), StoredDataset(results).study
    report_progress(0.1, "Computing the cell")
    scene, outcome = recompute_cell(results, coordinates)
    report_progress(0.6, "Computing the motion")
    motion, note, code = _extract_recorded_motion(study.measure, scene, outcome)
    if motion is None:
        measure = study.measure.with_(**study.cell(cell_number).measure_field_changes)
        loading, note = _choose_loading_of_recomputed_motion(measure, scene, outcome)
        moving = scene.with_(**{name: value for name, (value, _text) in loading.items()})
        options: dict[str, Any] = {"rtol": study.accuracy.rtol, "engine": study.accuracy.engine}
        motion = simulate(moving, **options)
        arguments = ", ".join(f"{name}={text}" for name, (_value, text) in loading.items())
        with_loading = f"scene.with_({arguments})" if arguments else "scene"
        texts = "".join(f", {name}={value!r}" for name, value in options.items())
        code = f"motion = rsfstudy.simulate({with_loading}{texts})"
    return RecomputedCell(cell_number, scene, outcome, motion, note, code)


def _extract_recorded_motion(
    measure: Measure, scene: Scene, outcome: Outcome
) -> tuple[xr.Dataset | None, str, str]:
    """Return the motion that a measure recorded, an explanation, and code for the motion."""
    dims = measure.variables.get("log10_slip_rate", ())
    names = [n for n in outcome.values if measure.variables[n] == dims]
    if len(dims) != 1 or not {*_X_VARIABLES_OF_MOTION_PLOT} & {*names}:
        return None, "", ""
    columns = {name: (dims, np.asarray(outcome.values[name])) for name in names}
    attributes = {"scene": json.dumps(scene.describe()), "title": f"Motion of {measure.name}"}
    note = f"The measure {measure.name} has recorded this motion."
    code = f"motion = {{name: outcome.values[name] for name in {names!r}}}"
    return xr.Dataset(columns, attrs=attributes), note, code


def _choose_loading_of_recomputed_motion(
    measure: Measure, scene: Scene, outcome: Outcome
) -> tuple[dict[str, tuple[float, str]], str]:
    """Choose the loading fields, with values and Python code, and explain the choice."""
    loads = [name for name in measure.solved_fields if name in _FALLBACK_STEP_SIZE_BY_LOADING_FIELD]
    if loads:
        verified = f"{measure.primary_output}_unstable"
        value = float(outcome.values.get(verified, np.nan))
        if np.isfinite(value):
            text = f'outcome.values["{verified}"]'
            note = "Motion after the step that the measure has verified as unstable."
        else:
            value = _FALLBACK_STEP_SIZE_BY_LOADING_FIELD[loads[0]]
            text = repr(value)
            note = f"The measure found no critical step. Motion after {loads[0]} = {value:g}."
        loading = {loads[0]: (value, text)}
        if loads[0] != "load_velocity_ratio" and scene.load_velocity_ratio is None:
            loading["load_velocity_ratio"] = (0.0, "0.0")
        return loading, note
    if scene.is_perturbed:
        return {}, "Motion of the scene, simulated from its loading."
    ratio = _VELOCITY_RATIO_IF_SCENE_HAS_NO_STEP
    note = f"The scene has no step. Motion after a step of the load point velocity to {ratio} V_*."
    return {"load_velocity_ratio": (ratio, repr(ratio))}, note


def tabulate_recomputed_outcome(
    recomputed_cell: RecomputedCell, results: xr.Dataset
) -> pd.DataFrame:
    """Return a table of the recomputed numbers, their errors and the stored values.

    Parameters
    ----------
    recomputed_cell : RecomputedCell
        Cell that was computed again.
    results : xarray.Dataset
        Results of the study.

    Returns
    -------
    pandas.DataFrame
        Table with one row per scalar result. The columns are ``result``, ``value``, ``error`` and
        ``stored``.
    """
    stored = results.sel(find_cell_coordinates(results, recomputed_cell.cell_number))
    values = {n: v for n, v in recomputed_cell.measure_outcome.values.items() if np.ndim(v) == 0}
    rows = [
        {
            "result": name,
            "value": float(value),
            "error": float(values.get(f"{name}_error", np.nan)),
            "stored": float(stored[name]),
        }
        for name, value in values.items()
        if not name.endswith("_error")
    ]
    return pd.DataFrame(rows, columns=["result", "value", "error", "stored"])


def draw_motion_figures(motion: xr.Dataset, figure_height: int = 240) -> list[Any]:
    """Return Bokeh figures of stress and slip rate against displacement or time.

    If a motion without inertia and damping becomes unstable, its slip rate exceeds the instability
    norm. The curves end at that time, because the rest of the motion has no physical meaning.

    Parameters
    ----------
    motion : xarray.Dataset
        Simulated or recorded motion.
    figure_height : int, default: 240
        Height of a figure in pixels.

    Returns
    -------
    list of bokeh.plotting.figure
        Two figures with a common x axis.
    """
    if "instability_time" in motion:
        motion = motion.sel(time=slice(None, float(motion["instability_time"])))
    x = next(name for name in _X_VARIABLES_OF_MOTION_PLOT if name in motion)
    stress = "friction_coefficient" if "friction_coefficient" in motion else "shear_stress"
    drawn: list[Any] = []
    for y in (stress, "log10_slip_rate"):
        kept = choose_drawn_point_indices(motion[y].values)
        shared = {"x_range": drawn[0].x_range} if drawn else {}
        panel: Any = figure(
            height=figure_height, sizing_mode="stretch_width", toolbar_location="above",
            tools="pan,wheel_zoom,box_zoom,reset,hover", active_drag="box_zoom", **shared,
        )  # fmt: skip
        panel.line(motion[x].values[kept], motion[y].values[kept], line_width=1.6, color="#0072B2")
        for axis, name in ((panel.xaxis, x), (panel.yaxis, y)):
            axis.axis_label_text_font_size = "12px"
            axis.axis_label = convert_mathtext_to_unicode(format_axis_label(motion, name, 200))
        panel.axis.axis_label_text_font_style = "normal"
        drawn.append(panel)
    return drawn
