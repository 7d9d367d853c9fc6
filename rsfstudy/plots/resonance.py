"""Resonance: gain and lead of spring stress against period, dots on the lines of linear theory, and
how far the response departs from it, against amplitude.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import log_scale
from rsfstudy.plots._phase_plane import scene_of
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import number as written
from rsfstudy.plots._text import stiffness
from rsfstudy.slider.stability import response_to_normal_stress
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "stiffness_ratio", "oscillation_period", "oscillation_amplitude")

#: Of a panel, in mm.
HEIGHT = 50.0

#: Points of the lines, and by which factor they go on beyond the dots.
_POINTS, _BEYOND = 300, 2.0
#: Of laws: lines, and how markers are filled.
_STYLES = (("-", "full"), ("--", "none"))


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Gain of the smallest oscillations against period."""
    _against_period(dataset.isel(oscillation_amplitude=0), axes, "gain")
    log_scale(axes, "y")
    axes.set_ylabel(r"Gain, $|\hat\tau/\hat\sigma|$")
    return axes


def draw_lead(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Lead of spring stress in the smallest oscillations."""
    _against_period(dataset.isel(oscillation_amplitude=0), axes, "phase_lead")
    axes.set_ylabel("Lead (degree)")
    return axes


def draw_largest(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Gain against amplitude, at the period of the largest response."""
    _against_amplitude(dataset, axes, "gain")
    for place in range(dataset.sizes["stiffness_ratio"]):
        row = _at_resonance(dataset).isel(law=0, stiffness_ratio=place)
        theory = float(row["linear_gain"].max())
        axes.axhline(theory, color=look(place)["color"], linewidth=0.6, linestyle=":", zorder=0)
    log_scale(axes, "y")
    axes.set_ylabel(r"Gain, $|\hat\tau/\hat\sigma|$")
    return axes


def draw_departure(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Departure from linear theory against amplitude, at the period of the largest response."""
    _against_amplitude(dataset, axes, "departure_from_linear")
    axes.axhline(0.1, color="0.6", linewidth=0.8, zorder=0)
    log_scale(axes, "y")
    axes.set_ylabel("Relative departure")
    return axes


def _against_period(rows: xr.Dataset, axes: Axes, name: str) -> None:
    """One line of linear theory a stiffness, and dots for each law."""
    known = rows["oscillation_period"]
    periods = np.geomspace(float(known.min()) / _BEYOND, float(known.max()) * _BEYOND, _POINTS)
    for place in range(rows.sizes["stiffness_ratio"]):
        row = rows.isel(stiffness_ratio=place)
        colour = look(place)["color"]
        label = stiffness(float(row["stiffness_ratio"]))
        axes.plot(periods, _theory(row, periods, name), color=colour, linewidth=0.9, label=label)
        for law, (_line, fill) in zip(rows["law"].values, _STYLES, strict=False):
            size = 3.0 if fill == "full" else 5.5
            style = {"color": colour, "marker": marker(place), "fillstyle": fill}
            text = f"motions, {law} law" if place == 0 else None
            style |= {"linestyle": "", "markersize": size, "label": text}
            axes.plot(known, row[name].sel(law=law), **style)
    log_scale(axes, "x")
    axes.set_xlabel(f"Period, {quantity('oscillation_period').symbol}")
    amplitude = written(float(rows["oscillation_amplitude"]))
    what = "Gain" if name == "gain" else "Lead"
    axes.set_title(f"{what} of small oscillations, $A$ = {amplitude}")
    legend(axes, 3)


def _theory(row: xr.Dataset, periods: np.ndarray, name: str) -> np.ndarray:
    """Gain or lead of small oscillations."""
    scene = scene_of(row.isel(law=0, oscillation_period=0))
    responses = np.array(
        [response_to_normal_stress(scene, scene.log_load_rate, 2.0 * math.pi / t) for t in periods]
    )
    return np.asarray(np.abs(responses) if name == "gain" else np.degrees(np.angle(responses)))


def _at_resonance(dataset: xr.Dataset) -> xr.Dataset:
    """The rows of the period that linear theory has the largest gain at, on the softest machine."""
    gain = dataset["linear_gain"].isel(stiffness_ratio=0, law=0, oscillation_amplitude=0)
    return dataset.isel(oscillation_period=int(gain.values.argmax()))


def _against_amplitude(dataset: xr.Dataset, axes: Axes, name: str) -> None:
    rows = _at_resonance(dataset)
    for place in range(rows.sizes["stiffness_ratio"]):
        for law, (line, fill) in zip(rows["law"].values, _STYLES, strict=False):
            row = rows.isel(stiffness_ratio=place).sel(law=law)
            style = {"color": look(place)["color"], "marker": marker(place), "fillstyle": fill}
            label = f"{stiffness(float(row['stiffness_ratio']))}, {law} law"
            settled = row[name].where(row["settled"] == 1.0)
            x = row["oscillation_amplitude"]
            style |= {"linestyle": line, "linewidth": 0.9, "markersize": 3.5}
            axes.plot(x, settled, label=label, **style)
    log_scale(axes, "x")
    axes.set_xlabel(f"Amplitude, {quantity('oscillation_amplitude').symbol}")
    period = float(rows["oscillation_period"])
    what = "Gain" if name == "gain" else "Departure from linear theory"
    axes.set_title(f"{what}, period {period:.3g} $D_c/V_*$")
    legend(axes, 2)


PANELS: tuple[Panel, ...] = (draw, draw_lead, draw_largest, draw_departure)
