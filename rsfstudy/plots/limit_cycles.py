"""Stick-slip cycles: stress against slip rate, as in Figs. 9 and 10 of the paper, and against slip,
as in Fig. 11.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._phase_plane import LN10, constant_state_line, coupling, label_axes, steady_line
from rsfstudy.vocabulary import quantity

#: Constant-state lines are drawn for -b ln(V/V_*) at these log10(V/V_*), where they cross the
#: steady state.
_STATES = (-8.0, -4.0, 0.0, 4.0, 8.0)


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Stress against slip rate for the first law (Fig. 9), with constant-state and steady-state
    lines.
    """
    return _phase_plane(dataset, axes, 0)


def _phase_plane(dataset: xr.Dataset, axes: Axes, law: int) -> Axes:
    cells = _cells(dataset, law)
    for number, (cell, label) in enumerate(cells):
        axes.plot(
            cell["log10_slip_rate"],
            cell["frictional_stress"],
            color=f"C{number}",
            linewidth=1.2,
            label=label,
        )
    reach, height = np.array(axes.get_xlim(), dtype=float), axes.get_ylim()
    rates = np.linspace(reach[0], reach[1], 200)
    drawn: set[tuple[str, float]] = set()
    top = height[0] + 0.96 * (height[1] - height[0])
    for number, (cell, _label) in enumerate(cells):
        if coupling(cell) in drawn:
            continue
        drawn.add(coupling(cell))
        axes.plot(rates, steady_line(cell, rates), "--", color=f"C{number}", linewidth=0.8)
        for state in _STATES:
            theta = -state * LN10 * float(cell["a"]) * float(cell["b_over_a"])
            line = constant_state_line(cell, theta, rates)
            axes.plot(rates, line, ":", color=f"C{number}", linewidth=0.6)
            inside = np.flatnonzero((line > height[0]) & (line < top))
            if inside.size and number == 0:  # the lines of the others meet these at the edges
                at = inside[-1]
                axes.text(
                    rates[at],
                    line[at],
                    f"{theta + 0.0:.2g}",
                    fontsize="xx-small",
                    color=f"C{number}",
                    ha="right",
                )
    axes.plot([], [], "--", color="0.4", linewidth=0.8, label="steady state")
    axes.plot([], [], ":", color="0.4", linewidth=0.8, label=r"constant state, $\Theta$")
    axes.set_xlim(*reach)
    axes.set_ylim(*height)
    label_axes(axes)
    axes.set_title(_title(dataset, law), fontsize="medium")
    axes.legend(fontsize="x-small")
    return axes


def _stress_slip(dataset: xr.Dataset, axes: Axes, law: int) -> Axes:
    """Two cycles, one after the other, against slip."""
    for number, (cell, label) in enumerate(_cells(dataset, law)):
        slip, stress = cell["slip"].values, cell["frictional_stress"].values
        both = np.concatenate([slip, slip + slip[-1] - slip[0]])
        axes.plot(both, np.tile(stress, 2), color=f"C{number}", linewidth=1.2, label=label)
        axes.plot(slip, cell["shear_stress"], "--", color=f"C{number}", linewidth=0.7)
        fastest = int(cell["log10_slip_rate"].values.argmax())
        axes.plot(slip[fastest], stress[fastest], "o", color=f"C{number}", markersize=4)
    axes.plot([], [], "o", color="0.4", markersize=4, label="fastest slip")
    axes.plot([], [], "--", color="0.4", linewidth=0.7, label="spring")
    axes.set_xlabel(quantity("slip").symbol)
    axes.set_ylabel(f"Frictional stress, {quantity('frictional_stress').symbol}")
    axes.set_title(_title(dataset, law), fontsize="medium")
    axes.legend(fontsize="x-small")
    axes.grid(alpha=0.3)
    return axes


def _of_law(function: Callable[[xr.Dataset, Axes, int], Axes], law: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        return function(dataset, axes, law)

    return panel


PANELS = (
    draw,
    _of_law(_phase_plane, -1),
    _of_law(_stress_slip, 0),
    _of_law(_stress_slip, -1),
)


def _title(dataset: xr.Dataset, law: int) -> str:
    return f"{np.atleast_1d(dataset['law'].values)[law]} law".capitalize()


def _cells(dataset: xr.Dataset, law: int) -> list[tuple[xr.Dataset, str]]:
    """The orbits of one law that exist and differ, each with a label."""
    chosen = dataset.isel(law=law) if "law" in dataset.dims else dataset
    dims = [str(d) for d in chosen["status"].dims]
    stacked = chosen.stack(cell=dims) if dims else chosen.expand_dims("cell")
    cells: list[tuple[xr.Dataset, str]] = []
    seen: set[tuple[float, ...]] = set()
    for number in range(stacked.sizes["cell"]):
        cell = stacked.isel(cell=number)
        numbers = tuple(cell["frictional_stress"].values.tolist())
        if int(cell["status"]) == 0 and numbers not in seen:
            seen.add(numbers)
            cells.append((cell, ", ".join(_place(cell, d) for d in dims if _counts(cell, d))))
    return cells


def _counts(cell: xr.Dataset, dimension: str) -> bool:
    """Whether a dimension says anything of a cell: angles do not at constant normal stress."""
    return not (dimension in ("phi", "alpha") and coupling(cell)[0] == "constant")


def _place(cell: xr.Dataset, dimension: str) -> str:
    value = cell[dimension].item()
    if dimension == "normal_stress":
        return f"{value} normal stress"
    return value if isinstance(value, str) else f"{quantity(dimension).symbol} = {value:g}"
