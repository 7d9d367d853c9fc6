"""Critical stiffness against slip rate for several driving angles, as in Fig. 2 of the paper, and
what mass adds to it.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._phase_plane import LN10, scene_of
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import number, pretty
from rsfstudy.slider.stability import critical_stiffness
from rsfstudy.slider.steady import slowest_steady
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("mass", "phi", "load_velocity_ratio")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """One curve an angle without mass; dots mark thresholds found from growth of the assembled
    equations, dotted lines where slower sliding has no steady state.
    """
    rate = np.log10(dataset["load_velocity_ratio"])
    for at, phi in enumerate(dataset["phi"].values):
        row, style = dataset.isel(mass=0).sel(phi=phi), look(at)
        axes.plot(*_closed_form(row), **style, label=_angle(row))
        grown = row["critical_stiffness_from_growth"]
        text = "from growth of the equations" if at == 0 else None
        axes.plot(rate, grown, marker(at), color=style["color"], markersize=2, label=text)
        slowest = slowest_steady(scene_of(row.isel(load_velocity_ratio=-1))) / LN10
        if slowest > float(rate.min()):
            across = axes.get_xaxis_transform()
            text = r" $\phi = \tan^{-1}\mu_{ss}$ "
            axes.axvline(slowest, color=style["color"], linestyle=":", linewidth=0.8)
            axes.text(slowest, 0.98, text, transform=across, ha="right", va="top", fontsize=7)
    axes.set_yscale("log")
    axes.set_xlabel(f"Slip rate, {quantity('log10_slip_rate').symbol}")
    axes.set_ylabel(f"Critical stiffness, {quantity('critical_stiffness').symbol}")
    axes.set_title("Stable above, unstable below")
    legend(axes, 2)
    return axes


def _closed_form(row: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Decades of slip rate and the critical stiffness there, closely where it grows without
    bound.
    """
    scene = scene_of(row.isel(load_velocity_ratio=-1))
    rates = np.log10(row["load_velocity_ratio"].values)
    slowest = max(slowest_steady(scene) / LN10, float(rates.min()))
    decades = slowest + np.geomspace(0.02, float(rates.max()) - slowest, 200)
    stiffnesses = [critical_stiffness(scene, x * LN10, quasi_static=True) for x in decades]
    return decades, np.array([k if k > 0.0 and math.isfinite(k) else math.nan for k in stiffnesses])


def _angle(row: xr.Dataset) -> str:
    text = rf"$\phi = {float(row['phi']):g}°$"
    if "stabilising_velocity" in row and np.isfinite(row["stabilising_velocity"]):
        velocity = number(float(row["stabilising_velocity"]))
        text += rf": $0.8\,k_{{cr}}(V_*)$ stable from {velocity} $V_*$"
    return text


def draw_mass(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Rise of critical stiffness by mass: closed form, and dots from growth of the equations."""
    rate = np.log10(dataset["load_velocity_ratio"])
    massless = dataset["critical_stiffness"].isel(mass=0)
    for at, phi in enumerate(dataset["phi"].values):
        colour = look(at)["color"]
        for mass, style in zip(dataset["mass"].values[1:], ("--", "-", ":"), strict=False):
            row = dataset.sel(mass=mass, phi=phi)
            rise = row["rise_by_dynamics"].where(row["rise_by_dynamics"] > 0.0)
            text = pretty(mass) if at == 0 else None
            axes.plot(rate, rise, style, color=colour, label=text)
            seen = row["critical_stiffness_from_growth"] / massless.sel(phi=phi) - 1.0
            axes.plot(rate, seen.where(seen > 1e-8), marker(at), color=colour, markersize=2)
    axes.set_yscale("log")
    axes.set_xlabel(f"Slip rate, {quantity('log10_slip_rate').symbol}")
    axes.set_ylabel(r"Rise of $k_{cr}$ by mass, as a fraction")
    axes.set_title("Rise by mass; colours as in (a)")
    legend(axes)
    return axes


PANELS = (draw, draw_mass)
