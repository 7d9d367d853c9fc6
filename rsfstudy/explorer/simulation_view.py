"""View that shows the stability and the motion of a scene, and widgets for the scene fields."""

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
from rsfstudy.explorer.background_jobs import ReportProgressFunction
from rsfstudy.explorer.base_view import ExplorerView
from rsfstudy.explorer.error_messages import escape_markdown
from rsfstudy.explorer.scene_controls import SceneControls
from rsfstudy.explorer.scene_presets import SETTINGS_BY_PRESET_LABEL
from rsfstudy.explorer.scene_settings import SceneSettings
from rsfstudy.plots import Figure, plot_motion
from rsfstudy.reporting import TextTable, build_motion_tables_and_sentences
from rsfstudy.rig import DatasetUnits, Rig
from rsfstudy.slider import Scene

#: Colours that readers with colour vision deficiency can distinguish (Okabe and Ito). The lines
#: also differ in their dashes.
_BLUE, _ORANGE, _GREY = "#0072B2", "#D55E00", "#555555"
#: Number of slip rates of the line of steady sliding, and its extension in decades.
_STEADY_POINTS, _STEADY_EXTENSION = 201, 0.3
_LABEL_OF_NO_PRESET = "own settings"
_PLOT_HEIGHT_PIXELS = 330
#: Style of the plots, which are in two columns if the page is wide enough.
_TWO_COLUMN_GRID_STYLE = {
    "display": "grid",
    "grid-template-columns": "repeat(auto-fit, minmax(400px, 1fr))",
}


class ComputedMotion(NamedTuple):
    """Motion of a scene, with tables and sentences that describe the motion.

    Parameters
    ----------
    rig : Rig or None
        Rig of the scene.
    scene : Scene
        Scene of the motion.
    dimensionless_motion : xarray.Dataset
        Dimensionless motion.
    motion_in_display_units : xarray.Dataset
        Motion in the units of the page.
    summary_tables_and_sentences : list
        Tables and sentences about the motion.
    """

    rig: Rig | None
    scene: Scene
    dimensionless_motion: xr.Dataset
    motion_in_display_units: xr.Dataset
    summary_tables_and_sentences: list[Any]

    @classmethod
    def compute_from_settings(cls, settings: SceneSettings) -> ComputedMotion:
        """Compute the motion of a scene.

        Parameters
        ----------
        settings : SceneSettings
            Settings of the scene.

        Returns
        -------
        ComputedMotion
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
    def stability_summary(self) -> str:
        """Sentences that describe the stability of steady sliding and the end of the motion."""
        sentences = [text for text in self.summary_tables_and_sentences if isinstance(text, str)]
        status, message = (
            self.dimensionless_motion.attrs["status"],
            self.dimensionless_motion.attrs["message"],
        )
        ending = "" if status == "ok" else f" Motion: {status}. {message}"
        ratio = f"k/k_cr = {self.scene.stiffness_ratio:.6g}"
        return f"{ratio}: {sentences[0]}.{ending}"

    @property
    def peak_values_text(self) -> str:
        """Peak friction and peak slip rate of the motion."""
        values = next(
            each for each in self.summary_tables_and_sentences if isinstance(each, Mapping)
        )
        return "; ".join(f"{name}: {text}" for name, text in values.items())

    def build_plot_columns(self) -> dict[str, np.ndarray]:
        """Return the columns of the plots.

        Returns
        -------
        dict of str to ndarray
            Time, load point displacement, friction, slip rate, and friction of the fault.
        """
        stress_name = next(
            name
            for name in ("normal_stress_ratio", "effective_normal_stress")
            if name in self.dimensionless_motion
        )
        fault = (
            self.dimensionless_motion["frictional_stress"] / self.dimensionless_motion[stress_name]
        )
        return {
            "time": self.motion_in_display_units["time"].values,
            "displacement": self.motion_in_display_units["load_point_displacement"].values,
            "friction": self.motion_in_display_units["friction_coefficient"].values,
            "rate": self._convert_slip_rates_to_display_units(
                self.dimensionless_motion["log10_slip_rate"].values
            ),
            "fault": fault.values,
        }

    def compute_steady_state_friction_curve(self) -> dict[str, np.ndarray]:
        """Return steady-state friction over the slip rate range of the motion.

        Returns
        -------
        dict of str to ndarray
            Slip rate and friction.
        """
        logs = self.dimensionless_motion["log10_slip_rate"].values
        logs = logs[np.isfinite(logs)]
        low, high = (logs.min(), logs.max()) if logs.size else (0.0, 0.0)
        rates = np.linspace(low - _STEADY_EXTENSION, high + _STEADY_EXTENSION, _STEADY_POINTS)
        excess = [
            self.scene.steady_friction_minus_reference(rate * math.log(10.0))
            for rate in rates.tolist()
        ]
        friction = np.array([math.nan if each is None else each for each in excess], float)
        return {
            "rate": self._convert_slip_rates_to_display_units(rates),
            "friction": self.scene.mu_star + friction,
        }

    def _convert_slip_rates_to_display_units(self, log10_slip_rates: np.ndarray) -> np.ndarray:
        """Convert logarithms of slip rates to slip rates in the units shown on the page."""
        scale = self.rig.reference_velocity * 1e6 if self.rig else 1.0
        return np.asarray(scale * 10.0 ** np.minimum(log10_slip_rates, 300.0))


class SimulationView(ExplorerView):
    """View that shows the stability, the motion and the phase plane of a scene.

    Parameters
    ----------
    source : Scene, Rig, xarray.Dataset or None
        Scene, rig whose scenes are shown, or motion whose scene is shown. By default, the view
        shows the rig of the README.
    """

    title = "Scene"
    download_file_stem = "motion"

    def __init__(self, source: Any = None) -> None:
        """Create the widgets and the plots."""
        super().__init__(source)
        self._result: ComputedMotion | None = None
        self._preset = pn.widgets.Select(
            label="Preset", options=[_LABEL_OF_NO_PRESET, *SETTINGS_BY_PRESET_LABEL], width=275
        )
        self._preset.value = (
            next(iter(SETTINGS_BY_PRESET_LABEL)) if source is None else _LABEL_OF_NO_PRESET
        )
        self._preset.param.watch(lambda event: self._show_preset(event.new), "value")
        self._duration = pn.widgets.TextInput(
            label="Duration (empty: whole loading)", width=270, placeholder="such as 60 s, or 50"
        )
        self._controls = SceneControls(
            _create_settings_from_source(source), self._handle_changed_settings
        )
        self._duration.value = self._controls.settings.duration
        self._duration.param.watch(lambda _event: self._handle_changed_settings(), "value")
        self._verdict = pn.pane.Markdown("", sizing_mode="stretch_width", margin=(0, 5))
        self._peaks = pn.pane.Markdown("", sizing_mode="stretch_width", margin=(0, 5))
        self._events = pn.Column(sizing_mode="stretch_width")
        self._motion_source = ColumnDataSource(
            {name: [] for name in ("time", "displacement", "friction", "rate", "fault")}
        )
        self._start_source = ColumnDataSource({"rate": [], "fault": []})
        self._steady_source = ColumnDataSource({"rate": [], "friction": []})
        self._figures = self._create_empty_figures()
        self._start_computation()

    # ---- interface of View ----------------------------------------------------------------------

    def list_control_widgets(self) -> list[Any]:
        """Return the widgets for the preset, the scene fields and the duration."""
        return [self._preset, self._controls.column, self._duration]

    def list_plot_panes(self) -> list[Any]:
        """Return panes that describe the stability, list the peak values and plot the motion."""
        grid = pn.Column(
            *map(pn.pane.Bokeh, self._figures.values()),
            sizing_mode="stretch_width", styles=_TWO_COLUMN_GRID_STYLE,
        )  # fmt: skip
        return [self._verdict, self._peaks, grid]

    def build_status_tables(self) -> list[Any]:
        """Return the table of the events of the motion."""
        return [self._events]

    def get_widget_state(self) -> dict[str, Any]:
        """Return the settings of the scene."""
        return self._controls.settings.as_widget_state()

    def set_widget_state(self, widget_state: Mapping[str, Any]) -> None:
        """Show other settings."""
        self._show_settings_and_compute(SceneSettings.from_widget_state(widget_state))

    def format_equivalent_python_code(self) -> str:
        """Return Python code that computes the motion."""
        return self._controls.settings.format_equivalent_python_code()

    def format_equivalent_command_line(self) -> str:
        """Return a command line that computes the motion."""
        return self._controls.settings.format_equivalent_command_line()

    def draw_figure_for_download(self) -> Figure:
        """Return the figure of the motion."""
        result = self._require_computed_motion()
        return plot_motion(result.dimensionless_motion, result.rig)

    def build_table_for_download(self) -> pd.DataFrame:
        """Return the motion as a table with one row per time."""
        return self._require_computed_motion().motion_in_display_units.to_dataframe().reset_index()

    def build_dataset_for_download(self) -> xr.Dataset:
        """Return the motion as a dataset, in the units shown on the page."""
        return self._require_computed_motion().motion_in_display_units

    # ---- changes --------------------------------------------------------------------------------

    def _require_computed_motion(self) -> ComputedMotion:
        """Return the result of the last computation."""
        if self._result is None:
            remedy = "Change a setting, and wait until the curves appear."
            raise InvalidValue("motion", None, "has not been computed", remedy=remedy)
        return self._result

    def _show_preset(self, preset_label: str) -> None:
        """Show the settings of a preset."""
        if preset_label in SETTINGS_BY_PRESET_LABEL:
            self._show_settings_and_compute(SETTINGS_BY_PRESET_LABEL[preset_label])

    def _show_settings_and_compute(self, settings: SceneSettings) -> None:
        """Show settings in the widgets, and compute the motion."""
        settings.build_scene(settings.build_rig())  # raises an error before the widgets change
        self._controls.rebuild_widgets(settings)
        if self._duration.value == settings.duration:
            self._start_computation()
        else:
            self._duration.value = settings.duration  # which computes the motion

    def _handle_changed_settings(self) -> None:
        """Compute the motion again after a setting has changed."""
        duration = self._duration.value.strip()
        self._controls.settings = replace(self._controls.settings, duration=duration)
        if self._controls.settings != SETTINGS_BY_PRESET_LABEL.get(self._preset.value):
            self._preset.value = _LABEL_OF_NO_PRESET
        self._start_computation()

    def _start_computation(self) -> None:
        """Start the computation of the motion."""
        settings = self._controls.settings

        def compute(_report: ReportProgressFunction) -> ComputedMotion:
            return ComputedMotion.compute_from_settings(settings)

        self.jobs.start(
            compute,
            self._show_computed_motion,
            self._show_computation_error,
            progress_label="Computing",
        )

    def _show_computation_error(self, error: Exception) -> None:
        """Show an error, and remove the curves that no longer match the settings."""
        self._result = None
        self._verdict.object = self._peaks.object = ""
        for source in (self._motion_source, self._start_source, self._steady_source):
            source.data = {name: [] for name in source.data}
        self.update_displayed_code_and_url()
        self.show_error(error)

    def _show_computed_motion(self, computed_motion: ComputedMotion) -> None:
        """Draw the motion."""
        self._result = computed_motion
        self.hide_error()
        columns = computed_motion.build_plot_columns()
        self._motion_source.data = columns
        self._start_source.data = {name: columns[name][:1] for name in ("rate", "fault")}
        self._steady_source.data = computed_motion.compute_steady_state_friction_curve()
        self._verdict.object = f"**{escape_markdown(computed_motion.stability_summary)}**"
        self._peaks.object = escape_markdown(computed_motion.peak_values_text)
        self._events.objects = [
            pn.pane.DataFrame(pd.DataFrame(each.rows), index=False)
            for each in computed_motion.summary_tables_and_sentences
            if isinstance(each, TextTable)
        ] or [pn.pane.Str(str(computed_motion.summary_tables_and_sentences[-1]))]
        time, length, rate = (
            ("s", "µm", "µm/s") if computed_motion.rig else ("D_c/V_*", "D_c", "V_*")
        )
        for name in ("friction_time", "rate_time"):
            self._figures[name].xaxis.axis_label = f"Time ({time})"
        self._figures["displacement"].xaxis.axis_label = f"Load point displacement ({length})"
        self._figures["plane"].xaxis.axis_label = f"Slip rate ({rate})"
        self._figures["rate_time"].yaxis.axis_label = f"Slip rate ({rate})"
        self.update_displayed_code_and_url()

    # ---- plots ----------------------------------------------------------------------------------

    def _create_empty_figures(self) -> dict[str, Any]:
        """Create the plots without data."""
        friction = "Friction coefficient"
        shared: dict[str, Any] = {
            "height": _PLOT_HEIGHT_PIXELS, "sizing_mode": "stretch_width", "min_width": 320,
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


def _create_settings_from_source(source: Any) -> SceneSettings:
    """Return the settings of a scene, a rig or a motion."""
    if source is None:
        return next(iter(SETTINGS_BY_PRESET_LABEL.values()))
    if isinstance(source, Rig):
        return SceneSettings.from_scene(source.scene(load_velocity_ratio=10.0), source)
    if isinstance(source, xr.Dataset):
        about = source.attrs.get("laboratory")
        rig = Rig(**json.loads(about)) if about else None
        return SceneSettings.from_scene(source.rsf.scene, rig)
    return SceneSettings.from_scene(source)
