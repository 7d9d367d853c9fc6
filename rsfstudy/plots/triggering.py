"""Triggers as changes of stress against stiffness, and how they compare; a column a law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import same_height
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import pretty
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "case", "stiffness_ratio")
#: Of a panel, in mm.
HEIGHT = 58.0

_TITLE = "Filled markers: fall of normal stress, case by case"
_FALL, _PULL, _FASTER = (
    "coulomb_stress_of_normal_stress",
    "coulomb_stress_of_displacement",
    "direct_stress_of_velocity",
)
_RUN: dict[str, Any] = {"linestyle": "-", "marker": "x", "markersize": 3.5, "linewidth": 0.5}
_PULLED: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 6.0,
    "markeredgewidth": 0.6,
    "fillstyle": "none",
}
#: What is drawn beside falls of normal stress: what it is called, and how.
_OTHERS = {
    _PULL: ("displacement step", _PULLED),
    _FASTER: (r"velocity step, $a\,\ln(V_0/V_*)$", _RUN),
}


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """Stresses by each law, and their ratios below."""
    laws = range(dataset.sizes["law"])
    return [*(_stresses(law) for law in laws), *(_ratios(law) for law in laws)]


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first panel."""
    return _stresses(0)(dataset, axes)


def _stresses(law: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """All three triggers, over a sigma_*, with the first order behind; as high for each law."""
        part, scale = dataset.isel(law=law), 1.0 / float(dataset["a"])
        stiffness = part["stiffness_ratio"]
        reach = np.linspace(float(stiffness.min()), float(stiffness.max()), 200)
        axes.plot(
            reach,
            reach,
            "-",
            color="0.82",
            linewidth=2.5,
            label="Coulomb, first order, imposed",
        )
        for number, case in enumerate(part["case"].values):
            row = part.sel(case=case)
            axes.plot(stiffness, scale * row[_FALL], label=pretty(case), **_line(number))
            for variable, (_name, style) in _OTHERS.items():
                line = style | {"color": look(number)["color"]}
                axes.plot(stiffness, scale * row[variable], label="_", **line)
        for variable, (name, style) in _OTHERS.items():
            if part[variable].notnull().any():
                _in_grey(axes, name, style)
        axes.set_xlim(left=0.0)
        same_height(axes, scale * dataset[_FALL], scale * dataset[_PULL], log=True)
        axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
        axes.set_ylabel(r"Critical stress change over $a\sigma_*$")
        axes.set_title(_law(part))
        legend(axes, title=_TITLE)
        return axes

    return panel


def _ratios(law: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Falls of normal stress, and velocity steps, over displacement steps."""
        part = dataset.isel(law=law)
        stiffness, faster = part["stiffness_ratio"], _OTHERS[_FASTER][0]
        axes.axhline(1.0, color="0.82", linewidth=2.5)
        for number, case in enumerate(part["case"].values):
            row = part.sel(case=case)
            axes.plot(stiffness, row["coulomb_ratio"], label=pretty(case), **_line(number))
            run = _RUN | {"color": look(number)["color"]}
            axes.plot(stiffness, row["direct_ratio"], label="_", **run)
        if part["direct_ratio"].notnull().any():
            _in_grey(axes, faster, _RUN)
        axes.set_xlim(left=0.0)
        axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
        axes.set_ylabel("Stress change over that by\na displacement step")
        axes.set_title(_law(part))
        legend(axes, title=_TITLE)
        return axes

    return panel


def _in_grey(axes: Axes, name: str, style: dict[str, Any]) -> None:
    """Name in the legend what is drawn in the colours of all cases; the line is out of sight."""
    axes.add_artist(
        Line2D([-1.0], [-1.0], transform=axes.transAxes, label=name, color="0.3", **style)
    )


def _line(number: int) -> dict[str, Any]:
    return {"marker": marker(number), "markersize": 2.6, **look(number)}


def _law(part: xr.Dataset) -> str:
    return f"{str(part['law'].item()).capitalize()} law"
