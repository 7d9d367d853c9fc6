"""Steps of normal stress: records of friction on machines of several stiffnesses beside a rigid
one, and alpha and slip distance as read off over what is true.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import log_scale, same_height
from rsfstudy.plots._phase_plane import scene_of
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import stiffness
from rsfstudy.reduce.base import stated_by
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "normal_stress_step", "stiffness_ratio")

#: Of a panel, in mm.
HEIGHT = 48.0

#: Slip that is shown of the records, in D_c, and friction beyond alpha ln r, over that.
_SHOWN, _OVER = 4.0, 0.4
_MACHINES = 3
#: Of laws: lines, and how markers are filled.
_STYLES = (("-", "full"), ("--", "none"))


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Records of the first law."""
    return _records(dataset, axes, 0)


def draw_slowness(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Records of the last law."""
    return _records(dataset, axes, -1)


def _records(dataset: xr.Dataset, axes: Axes, law: int) -> Axes:
    """The largest steps up and down, on some machines, from dark to light as they are stiffer, and
    on a rigid one.
    """
    rows = dataset.isel(law=law).sortby("normal_stress_step")
    places = np.unique(np.linspace(0, rows.sizes["stiffness_ratio"] - 1, _MACHINES).astype(int))
    for shade, place in zip(np.linspace(0.0, 0.8, len(places)), places, strict=True):
        for step in (0, -1):
            row = rows.isel(normal_stress_step=step, stiffness_ratio=place)
            label = stiffness(float(row["stiffness_ratio"])) if step else None
            seen = row["friction_coefficient"] - row["mu_star"]
            axes.plot(row["slip"], seen, "-", color=colormaps["viridis"](shade), label=label)
    highest = 0.0
    for step in (0, -1):
        slip, change = _rigid(rows.isel(normal_stress_step=step, stiffness_ratio=0))
        axes.plot(slip, change, ":", color="black", label="rigid" if step else None)
        highest = max(highest, float(np.abs(change).max()))
    axes.set_xlim(0.0, _SHOWN)
    axes.set_ylim(-(1.0 + _OVER) * highest, (1.0 + _OVER) * highest)
    axes.set_xlabel(r"Slip since the step, $\delta/D_c$")
    axes.set_ylabel(r"Change of friction, $\Delta\mu$")
    low, high = (float(rows["normal_stress_step"][n]) for n in (0, -1))
    name = f"{rows['law'].item()} law".capitalize()
    axes.set_title(rf"{name}, $\Delta\sigma/\sigma_*$ = ${low:+g}$ and ${high:+g}$")
    legend(axes, 4)
    return axes


def _rigid(row: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Slip, and the transient of a rigid slider by the closed form of its law."""
    scene, slip = scene_of(row), np.linspace(0.0, _SHOWN, 100)
    form = scene.parts.law.relaxation
    away = -scene.alpha / scene.b * math.log1p(float(row["normal_stress_step"]))
    left = [form(away, at) if form else math.nan for at in slip.tolist()]
    return slip, scene.b * np.array(left)


def _read(name: str, true: str | None, title: str, label: str) -> Panel:
    """What draws a number as read off, over the scene's own, against stiffness."""

    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        axes.axhline(1.0, color="0.6", linewidth=0.8, zorder=0)
        for law, (line, fill) in zip(dataset["law"].values, _STYLES, strict=False):
            for number, step in enumerate(dataset["normal_stress_step"].values):
                row = dataset.sel(law=law, normal_stress_step=step)
                style = {"color": look(number)["color"], "marker": marker(number)}
                style |= {"linestyle": line, "fillstyle": fill, "linewidth": 0.9}
                over = row[name] / (float(row[true]) if true else 1.0)
                text = rf"{law} law, ${step:+g}$"
                axes.plot(row["stiffness_ratio"], over, label=text, **style)
        same_height(axes, dataset[name] / (dataset[true] if true else 1.0))
        log_scale(axes, "x")
        axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
        axes.set_ylabel(label)
        axes.set_title(title)
        about = quantity("normal_stress_step", stated_by(dataset))
        legend(axes, title=about.symbol)
        return axes

    return panel


PANELS: tuple[Panel, ...] = (
    draw,
    draw_slowness,
    _read("apparent_alpha", "alpha", r"$\alpha$ as read off", r"$\alpha_{read}/\alpha$"),
    _read("apparent_slip_distance", None, "Slip distance as read off", "$D_{read}/D_c$"),
)
