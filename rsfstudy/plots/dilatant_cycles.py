"""Cycles of a dilatant fault: peak slip rate and stress drop against dilatancy, and slip rate in
time.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import place, same_height
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "drainage", "dilatancy")

#: Time, in D_c/V_*, before and after the fastest slip is on log scales that meet in a linear one of
#: this width: slip speeds up to a rupture as one over the time that is left.
_LINEAR = 1e-6
_TIMES = (-1.0, -1e-3, 0.0, 1e-3, 1.0)
_SHOWN = (-10.0, 400.0)
_DILATANCY = f"Dilatancy, {quantity('dilatancy').symbol}"


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Peak slip rate."""
    axes.set_ylabel(r"Fastest slip, $\log_{10}(V/V_*)$")
    axes.set_title("Ruptures become slow slip")
    return _against_dilatancy(dataset, axes, "max_log10_slip_rate")


def draw_drop(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Stress drop of a cycle."""
    axes.set_ylabel(f"Static stress drop, {quantity('static_stress_drop').symbol}")
    axes.set_title("Stress drop")
    return _against_dilatancy(dataset, axes, "static_stress_drop")


def _rows(dataset: xr.Dataset) -> Iterator[tuple[xr.Dataset, str, dict[str, Any]]]:
    """Each law and drainage, what it is called, and its line: a colour and a marker for drainage,
    filled and solid for the first law.
    """
    dataset = _whole(dataset)
    styles = (("-", "full"), ("--", "none"))
    for law, (line, fill) in zip(dataset["law"].values, styles, strict=False):
        for number, drainage in enumerate(dataset["drainage"].values):
            row = dataset.sel(law=law, drainage=drainage)
            style = {"color": look(number)["color"], "marker": marker(number)}
            text = f"{law} law, {place(row, 'drainage')}"
            yield row, text, style | {"linestyle": line, "fillstyle": fill}


def _whole(dataset: xr.Dataset) -> xr.Dataset:
    """With all dimensions, of one point if need be."""
    return dataset.expand_dims([d for d in DIMENSIONS if d not in dataset.dims])


def _against_dilatancy(dataset: xr.Dataset, axes: Axes, name: str) -> Axes:
    for row, label, style in _rows(dataset):
        axes.plot(row["dilatancy"], row[name], label=label, **style)
    weakening = float(dataset["a"]) * (float(dataset["b_over_a"]) - 1.0)
    critical = (weakening - float(dataset["stiffness"])) / float(dataset["mu_star"])
    axes.axvline(
        critical, color="0.4", linestyle=":", label="spring as stiff as the undrained critical one"
    )
    axes.set_xlabel(_DILATANCY)
    legend(axes)
    return axes


def _in_time(law: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Slip rate along one cycle, for some dilatancies, at the slowest drainage."""
        chosen = _whole(dataset).isel(law=law, drainage=0)
        for number, dilatancy in enumerate(chosen["dilatancy"].values[::2]):
            cell = chosen.sel(dilatancy=dilatancy)
            if int(cell["status"]) == 0:
                time = cell["time"] - cell["time"][int(np.argmax(cell["log10_slip_rate"].values))]
                axes.plot(time, cell["log10_slip_rate"], **look(number), label=f"{dilatancy:g}")
        same_height(axes, dataset["log10_slip_rate"])
        axes.set_xscale("symlog", linthresh=_LINEAR, linscale=0.5)
        axes.set_xlim(*_SHOWN)
        axes.set_xticks(_TIMES, ["$-1$", "$-10^{-3}$", "0", "$10^{-3}$", "1"])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel(r"Time from fastest slip, $t V_*/D_c$")
        axes.set_ylabel(r"Slip rate, $\log_{10}(V/V_*)$")
        name = f"{chosen['law'].item()} law".capitalize()
        axes.set_title(f"{name}, {place(chosen, 'drainage')}")
        legend(axes, 3, title=_DILATANCY)
        return axes

    return panel


PANELS = (draw, draw_drop, _in_time(0), _in_time(-1))
