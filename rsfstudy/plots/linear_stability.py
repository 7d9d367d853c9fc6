"""Critical stiffness against slip rate for several driving angles, as in Fig. 2 of the paper, and
what mass adds to it.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("mass", "phi", "load_velocity_ratio")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """One curve an angle without mass; dots mark thresholds found from growth of the assembled
    equations, dotted lines where slower sliding has no steady state.
    """
    massless = dataset.isel(mass=0)
    rate = np.log10(dataset["load_velocity_ratio"])
    for number, phi in enumerate(dataset["phi"].values):
        row = massless.sel(phi=phi)
        label = f"{phi:g}°"
        if "stabilising_velocity" in row and np.isfinite(row["stabilising_velocity"]):
            velocity = float(row["stabilising_velocity"])
            label += rf": $0.8\,k_{{cr}}(V_*)$ is stable from {velocity:,.3g} $V_*$"
        axes.plot(rate, row["critical_stiffness"], color=f"C{number}", label=label)
        axes.plot(
            rate, row["critical_stiffness_from_growth"], ".", color=f"C{number}", markersize=3
        )
        known = np.flatnonzero(np.isfinite(row["critical_stiffness"].values))
        if known.size and known[0] > 0:
            axes.axvline(float(rate[known[0]]), color=f"C{number}", linestyle=":", linewidth=0.8)
            axes.text(
                float(rate[known[0]]),
                0.99,
                r" $\varphi = \tan^{-1}\mu_{ss}$ ",
                transform=axes.get_xaxis_transform(),
                ha="right",
                va="top",
                fontsize="small",
                color=f"C{number}",
            )
    axes.set_yscale("log")
    axes.set_xlabel(quantity("log10_slip_rate").symbol)
    axes.set_ylabel(quantity("critical_stiffness").symbol)
    axes.set_title("Stable above, unstable below; dots: from growth", fontsize="medium")
    axes.legend(title=quantity("phi").symbol, fontsize="x-small")
    axes.grid(alpha=0.3, which="both")
    return axes


def draw_mass(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Rise of critical stiffness by mass: closed form, and dots from growth of the equations."""
    rate = np.log10(dataset["load_velocity_ratio"])
    massless = dataset["critical_stiffness"].isel(mass=0)
    for number, phi in enumerate(dataset["phi"].values):
        for mass, style in zip(dataset["mass"].values[1:], ("--", "-", ":"), strict=False):
            row = dataset.sel(mass=mass, phi=phi)
            first = number == 0
            rise = row["rise_by_dynamics"].where(row["rise_by_dynamics"] > 0.0)
            axes.plot(rate, rise, style, color=f"C{number}", label=str(mass) if first else None)
            seen = row["critical_stiffness_from_growth"] / massless.sel(phi=phi) - 1.0
            axes.plot(rate, seen.where(seen > 1e-8), ".", color=f"C{number}", markersize=3)
    axes.set_yscale("log")
    axes.set_ylim(1e-18, 1e2)
    axes.set_xlabel(quantity("log10_slip_rate").symbol)
    axes.set_ylabel(r"Rise of $k_{cr}$ by mass, as a fraction")
    axes.set_title("Rise by mass; colours as left; dots: from growth", fontsize="medium")
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return axes


PANELS = (draw, draw_mass)
