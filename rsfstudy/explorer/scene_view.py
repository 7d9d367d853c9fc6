"""View of a scene: widgets for its fields, its stability and its motion."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import panel as pn
import xarray as xr
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure as bokeh_figure

from rsfstudy.errors import InvalidValue
from rsfstudy.explorer.jobs import Report
from rsfstudy.explorer.messages import escape_markdown
from rsfstudy.explorer.scene_controls import SceneControls
from rsfstudy.explorer.scene_presets import PRESETS
from rsfstudy.explorer.scene_settings import SceneSettings
from rsfstudy.explorer.view import View
from rsfstudy.plots import Figure, plot_motion
from rsfstudy.reporting import TextTable, build_motion_tables_and_sentences
from rsfstudy.rig import DatasetUnits, Rig
from rsfstudy.slider import Scene

#: Colours that readers with colour vision deficiency can distinguish (Okabe and Ito). The lines
#: also differ in their dashes.
_BLUE, _ORANGE, _GREY = "#0072B2", "#D55E00", "#555555"
#: Number of slip rates of the line of steady sliding, and its extension in decades.
_STEADY_POINTS, _STEADY_EXTENSION = 201, 0.3
_NO_PRESET = "own settings"
_PLOT_HEIGHT = 330
#: Style of the plots, which are in two columns if the page is wide enough.
_GRID_STYLE = {
    "display": "grid",
    "grid-template-columns": "repeat(auto-fit, minmax(400px, 1fr))",
}


class Result(NamedTuple):
    """Motion of a scene, with the sentences that describe it.

    Parameters
    ----------
    rig : Rig or None
        Rig of the scene.
    scene : Scene
        Scene of the motion.
    motion : xarray.Dataset
        Dimensionless motion.
    shown : xarray.Dataset
        Motion in the units of the page.
    summary : list
        Tables and sentences about the motion.
    """

    rig: Rig | None
    scene: Scene
    motion: xr.Dataset
    shown: xr.Dataset
    summary: list[Any]

    @classmethod
    def compute(cls, settings: SceneSettings) -> Result:
        """Compute the motion of a scene.

        Parameters
        ----------
        settings : SceneSettings
            Settings of the scene.

        Returns
        -------
        Result
            Motion and summary.
        """
        rig = settings.build_rig()
        scene = settings.build_scene(rig)
        motion = settings.simulate(scene, rig)
        shown = [motion, motion.rsf.events()]
        if rig:
            shown = [rig.in_units(each, **DatasetUnits.DISPLAY_UNITS) for each in shown]
        summary = build_motion_tables_and_sentences(shown[0], scene, shown[1])
        return cls(rig, scene, motion, shown[0], list(summary))

    @property
    def verdict(self) -> str:
        """Sentences about the stability of steady sliding and the end of the motion."""
        sentences = [text for text in self.summary if isinstance(text, str)]
        status, message = self.motion.attrs["status"], self.motion.attrs["message"]
        ending = "" if status == "ok" else f" Motion: {status}. {message}"
        ratio = f"k/k_cr = {self.scene.stiffness_ratio:.6g}"
        return f"{ratio}: {sentences[0]}.{ending}"

    @property
    def peaks(self) -> str:
        """Peak friction and peak slip rate of the motion."""
        values = next(each for each in self.summary if isinstance(each, Mapping))
        return "; ".join(f"{name}: {text}" for name, text in values.items())

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns of the plots.

        Returns
        -------
        dict of str to ndarray
            Time, load point displacement, friction, slip rate, and friction of the fault.
        """
        stress_name = next(
            name
            for name in ("normal_stress_ratio", "effective_normal_stress")
            if name in self.motion
        )
        fault = self.motion["frictional_stress"] / self.motion[stress_name]
        return {
            "time": self.shown["time"].values,
            "displacement": self.shown["load_point_displacement"].values,
            "friction": self.shown["friction_coefficient"].values,
            "rate": self._rates(self.motion["log10_slip_rate"].values),
            "fault": fault.values,
        }

    def steady_line(self) -> dict[str, np.ndarray]:
        """Return steady-state friction over the slip rate range of the motion.

        Returns
        -------
        dict of str to ndarray
            Slip rate and friction.
        """
        logs = self.motion["log10_slip_rate"].values
        logs = logs[np.isfinite(logs)]
        low, high = (logs.min(), logs.max()) if logs.size else (0.0, 0.0)
        rates = np.linspace(low - _STEADY_EXTENSION, high + _STEADY_EXTENSION, _STEADY_POINTS)
        excess = [
            self.scene.steady_friction_minus_reference(rate * math.log(10.0))
            for rate in rates.tolist()
        ]
        friction = np.array([math.nan if each is None else each for each in excess], float)
        return {"rate": self._rates(rates), "friction": self.scene.mu_star + friction}

    def _rates(self, log10_rates: np.ndarray) -> np.ndarray:
        """Return slip rates in the units of the page."""
        scale = self.rig.reference_velocity * 1e6 if self.rig else 1.0
        return np.asarray(scale * 10.0 ** np.minimum(log10_rates, 300.0))


class SceneView(View):
    """View of a scene with its stability, its motion and its phase plane.

    Parameters
    ----------
    source : Scene, Rig, xarray.Dataset or None
        Scene, rig whose scenes are shown, or motion whose scene is shown. By default, the view
        shows the rig of the README.
    """

    title = "Scene"
    file_stem = "motion"

    def __init__(self, source: Any = None) -> None:
        """Create the widgets and the plots."""
        super().__init__(source)
        self._result: Result | None = None
        self._preset = pn.widgets.Select(label="Preset", options=[_NO_PRESET, *PRESETS], width=275)
        self._preset.value = next(iter(PRESETS)) if source is None else _NO_PRESET
        self._preset.param.watch(lambda event: self._choose_preset(event.new), "value")
        self._duration = pn.widgets.TextInput(
            label="Duration (empty: whole loading)", width=270, placeholder="such as 60 s, or 50"
        )
        self._controls = SceneControls(_read_settings(source), self._settings_changed)
        self._duration.value = self._controls.settings.duration
        self._duration.param.watch(lambda _event: self._settings_changed(), "value")
        self._verdict = pn.pane.Markdown("", sizing_mode="stretch_width", margin=(0, 5))
        self._peaks = pn.pane.Markdown("", sizing_mode="stretch_width", margin=(0, 5))
        self._events = pn.Column(sizing_mode="stretch_width")
        self._motion_source = ColumnDataSource(
            {name: [] for name in ("time", "displacement", "friction", "rate", "fault")}
        )
        self._start_source = ColumnDataSource({"rate": [], "fault": []})
        self._steady_source = ColumnDataSource({"rate": [], "friction": []})
        self._figures = self._draw_figures()
        self._compute()

    # ---- interface of View ----------------------------------------------------------------------

    def controls(self) -> list[Any]:
        """Return the preset, the fields of the scene and the duration."""
        return [self._preset, self._controls.column, self._duration]

    def plots(self) -> list[Any]:
        """Return the verdict and the four plots."""
        grid = pn.Column(
            *map(pn.pane.Bokeh, self._figures.values()),
            sizing_mode="stretch_width", styles=_GRID_STYLE,
        )  # fmt: skip
        return [self._verdict, self._peaks, grid]

    def status(self) -> list[Any]:
        """Return the table of the events of the motion."""
        return [self._events]

    def state(self) -> dict[str, Any]:
        """Return the settings of the scene."""
        return self._controls.settings.as_state()

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Show other settings."""
        self._show_settings(SceneSettings.from_state(state))

    def python_code(self) -> str:
        """Return Python code that computes the motion."""
        return self._controls.settings.python_code()

    def command_line(self) -> str:
        """Return a command line that computes the motion."""
        return self._controls.settings.command_line()

    def figure(self) -> Figure:
        """Return the figure of the motion."""
        result = self._require_result()
        return plot_motion(result.motion, result.rig)

    def table(self) -> pd.DataFrame:
        """Return the motion with one row per time."""
        return self._require_result().shown.to_dataframe().reset_index()

    def dataset(self) -> xr.Dataset:
        """Return the motion in the units of the page."""
        return self._require_result().shown

    # ---- changes --------------------------------------------------------------------------------

    def _require_result(self) -> Result:
        """Return the result of the last computation."""
        if self._result is None:
            remedy = "Change a setting, and wait until the curves appear."
            raise InvalidValue("motion", None, "has not been computed", remedy=remedy)
        return self._result

    def _choose_preset(self, label: str) -> None:
        """Show the settings of a preset."""
        if label in PRESETS:
            self._show_settings(PRESETS[label])

    def _show_settings(self, settings: SceneSettings) -> None:
        """Show settings in the widgets, and compute the motion."""
        settings.build_scene(settings.build_rig())  # raises an error before the widgets change
        self._controls.show(settings)
        if self._duration.value == settings.duration:
            self._compute()
        else:
            self._duration.value = settings.duration  # which computes the motion

    def _settings_changed(self) -> None:
        """Compute the motion again after a setting has changed."""
        duration = self._duration.value.strip()
        self._controls.settings = replace(self._controls.settings, duration=duration)
        if self._controls.settings != PRESETS.get(self._preset.value):
            self._preset.value = _NO_PRESET
        self._compute()

    def _compute(self) -> None:
        """Start the computation of the motion."""
        settings = self._controls.settings

        def compute(_report: Report) -> Result:
            return Result.compute(settings)

        self.jobs.start(compute, self._show_result, self._show_failure, label="Computing")

    def _show_failure(self, error: Exception) -> None:
        """Show an error, and remove the curves that no longer match the settings."""
        self._result = None
        self._verdict.object = self._peaks.object = ""
        for source in (self._motion_source, self._start_source, self._steady_source):
            source.data = {name: [] for name in source.data}
        self.refresh()
        self.show_error(error)

    def _show_result(self, result: Result) -> None:
        """Draw the motion."""
        self._result = result
        self.hide_error()
        columns = result.columns()
        self._motion_source.data = columns
        self._start_source.data = {name: columns[name][:1] for name in ("rate", "fault")}
        self._steady_source.data = result.steady_line()
        self._verdict.object = f"**{escape_markdown(result.verdict)}**"
        self._peaks.object = escape_markdown(result.peaks)
        self._events.objects = [
            pn.pane.DataFrame(pd.DataFrame(each.rows), index=False)
            for each in result.summary
            if isinstance(each, TextTable)
        ] or [pn.pane.Str(str(result.summary[-1]))]
        time, length, rate = ("s", "µm", "µm/s") if result.rig else ("D_c/V_*", "D_c", "V_*")
        for name in ("friction_time", "rate_time"):
            self._figures[name].xaxis.axis_label = f"Time ({time})"
        self._figures["displacement"].xaxis.axis_label = f"Load point displacement ({length})"
        self._figures["plane"].xaxis.axis_label = f"Slip rate ({rate})"
        self._figures["rate_time"].yaxis.axis_label = f"Slip rate ({rate})"
        self.refresh()

    # ---- plots ----------------------------------------------------------------------------------

    def _draw_figures(self) -> dict[str, Any]:
        """Create the plots without data."""
        friction = "Friction coefficient"
        shared: dict[str, Any] = {
            "height": _PLOT_HEIGHT, "sizing_mode": "stretch_width", "min_width": 320,
            "tools": "pan,box_zoom,wheel_zoom,reset,hover", "active_drag": "box_zoom",
            "toolbar_location": "above",
        }  # fmt: skip
        figures = {
            "friction_time": bokeh_figure(y_axis_label=friction, **shared),
            "displacement": bokeh_figure(y_axis_label=friction, **shared),
            "rate_time": bokeh_figure(y_axis_type="log", **shared),
            "plane": bokeh_figure(
                y_axis_label="Friction coefficient of the fault", x_axis_type="log", **shared
            ),
        }
        figures["rate_time"].x_range = figures["friction_time"].x_range
        line = {"source": self._motion_source, "color": _BLUE, "line_width": 1.5}
        figures["friction_time"].line("time", "friction", **line)
        figures["displacement"].line("displacement", "friction", **line)
        figures["rate_time"].line("time", "rate", **line)
        plane = figures["plane"]
        plane.line(
            "rate", "friction", source=self._steady_source, color=_GREY, line_dash="dashed",
            line_width=2, legend_label="steady sliding",
        )  # fmt: skip
        plane.line("rate", "fault", legend_label="motion", **line)
        plane.scatter(
            "rate", "fault", source=self._start_source, color=_ORANGE, size=9, marker="diamond",
            legend_label="start",
        )  # fmt: skip
        for each in figures.values():
            each.toolbar.logo = None
        plane.legend.orientation = "horizontal"
        plane.add_layout(plane.legend[0], "above")
        return figures


def _read_settings(source: Any) -> SceneSettings:
    """Return the settings of a scene, a rig or a motion."""
    if source is None:
        return next(iter(PRESETS.values()))
    if isinstance(source, Rig):
        return SceneSettings.from_scene(source.scene(load_velocity_ratio=10.0), source)
    if isinstance(source, xr.Dataset):
        about = source.attrs.get("laboratory")
        rig = Rig(**json.loads(about)) if about else None
        return SceneSettings.from_scene(source.rsf.scene, rig)
    return SceneSettings.from_scene(source)
