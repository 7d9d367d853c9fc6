"""Static stress drop (filled) and dynamic stress drop (open) against ln V_0, with the fitted
lines.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._text import with_error
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "case", "stiffness_ratio", "load_velocity_ratio")

_DROPS = {"static": "full", "dynamic": "none"}
_MARKERS = {"static": "o", "dynamic": "s"}


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first law, on its stiffest spring."""
    return _drops(dataset, axes, 0)


def _drops(dataset: xr.Dataset, axes: Axes, law: int) -> Axes:
    x = dataset["log_load_velocity_ratio"]
    stiffest = float(dataset["stiffness_ratio"].max())
    name = str(dataset["law"].values[law])
    for number, case in enumerate(dataset["case"].values):
        row = dataset.isel(law=law).sel(case=case, stiffness_ratio=stiffest)
        for drop, fill in _DROPS.items():
            values = row[f"{drop}_stress_drop"]
            text = f"{case}, {drop}"
            if f"{drop}_slope" in row:
                slope, error = float(row[f"{drop}_slope"]), float(row[f"{drop}_slope_stderr"])
                text += f": {with_error(slope, error)}"
                centre = float(x.where(values.notnull()).mean())
                line = (float(values.mean()) + slope * (x - centre)).where(values.notnull())
                axes.plot(x, line, color=f"C{number}", linewidth=0.8)
            points = axes.plot(x, values, _MARKERS[drop], label=text)[0]
            points.set(color=f"C{number}", fillstyle=fill, markersize=5)
    axes.set_xlabel(quantity("log_load_velocity_ratio").symbol)
    axes.set_ylabel(r"Stress drop, $\Delta\tau/\sigma_*$")
    title = rf"{name.capitalize()} law, $k = {stiffest:g}\,k_{{cr}}$; slopes"
    axes.set_title(title, fontsize="medium")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize="x-small")
    axes.grid(alpha=0.3)
    return axes


def draw_slowness(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The last law."""
    return _drops(dataset, axes, -1)


def draw_scaled(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Slopes of the static drop over (a-b) sigma_*, against stiffness: f(k)."""
    if "static_slope_scaled" in dataset:
        for law, style in zip(dataset["law"].values, ("-", "--"), strict=False):
            for number, case in enumerate(dataset["case"].values):
                row = dataset["static_slope_scaled"].sel(law=law, case=case)
                label = f"{law} law, {case}"
                axes.plot(row["stiffness_ratio"], row, f"o{style}", color=f"C{number}", label=label)
    axes.set_xlabel(quantity("stiffness_ratio").symbol)
    axes.set_ylabel(r"Slope of static drop over $(a-b)\,\sigma_*$")
    axes.set_title("Dependence of the slopes on stiffness, $f(k)$", fontsize="medium")
    axes.legend(fontsize="x-small", handlelength=4.0)
    axes.grid(alpha=0.3)
    return axes


def draw_drift(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Local slopes between neighbouring points: where a law in ln V_0 holds, they are level."""
    x = dataset["log_load_velocity_ratio"].values
    for law, style in zip(dataset["law"].values, ("-", "--"), strict=False):
        for number, case in enumerate(dataset["case"].values):
            row = dataset["static_stress_drop"].sel(law=law, case=case).isel(stiffness_ratio=-1)
            slopes = np.diff(row.values) / np.diff(x)
            middle = 0.5 * (x[1:] + x[:-1])
            axes.plot(middle, slopes, style, color=f"C{number}", label=f"{law} law, {case}")
    axes.set_ylim(-0.14, 0.0)
    axes.set_xlabel(quantity("log_load_velocity_ratio").symbol)
    axes.set_ylabel(r"Local slope of static drop, $\sigma_*$")
    axes.set_title("Local slopes: level where the law holds", fontsize="medium")
    axes.legend(fontsize="x-small")
    axes.grid(alpha=0.3)
    return axes


PANELS = (draw, draw_slowness, draw_scaled, draw_drift)
