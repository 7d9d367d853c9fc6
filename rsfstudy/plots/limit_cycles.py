"""Stick-slip cycles: stress against slip rate, as in Figs. 9 and 10 of the paper, and against slip,
as in Fig. 11.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import place
from rsfstudy.plots._phase_plane import (
    LN10,
    constant_state_line,
    coupling,
    label_axes,
    mark_reversed,
    scene_of,
    steady_line,
)
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.vocabulary import quantity

#: Numbers on lines are wider than high.
_SHAPE = (1.0, 2.0)
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
            color=look(number)["color"],
            linestyle="-",
            linewidth=1.2 + 0.8 * (number == 0),
            label=label,
        )
    _lines_of_state(axes, [cell for cell, _label in cells])
    mark_reversed(axes)
    label_axes(axes)
    axes.set_title(_title(dataset, law))
    legend(axes)
    return axes


def _lines_of_state(axes: Axes, cells: Sequence[xr.Dataset]) -> None:
    """Steady state and constant states, for each coupling of stress and slip that there is; numbers
    stand where nothing else is.
    """
    reach, height = axes.get_xlim(), axes.get_ylim()
    axes.set(xlim=reach, ylim=height)
    rates = np.linspace(*reach, 400)
    drawn: set[tuple[str | float, ...]] = set()
    taken = [_on(axes, cell["log10_slip_rate"], cell["frictional_stress"]) for cell in cells]
    for number, cell in enumerate(cells):
        if coupling(cell) in drawn:
            continue
        colour, first = look(number)["color"], not drawn
        drawn.add(coupling(cell))
        steady = steady_line(cell, rates)
        text = "steady state" if first else None
        axes.plot(rates, steady, "--", color=colour, linewidth=0.8, label=text)
        taken.append(_on(axes, rates, steady))
        for state in _STATES:
            theta = -state * LN10 * scene_of(cell).b
            line = constant_state_line(cell, theta, rates)
            text = r"constant state, with its $\Theta$" if first and state == _STATES[0] else None
            axes.plot(rates, line, ":", color=colour, linewidth=0.7, label=text)
            taken.append(
                _numbered(axes, _on(axes, rates, line), (f"${theta + 0.0:.2g}$", colour), taken)
            )


def _on(axes: Axes, x: xr.DataArray | np.ndarray, y: xr.DataArray | np.ndarray) -> np.ndarray:
    """Places on the axes, as fractions of their sides."""
    sides = np.array([axes.get_xlim(), axes.get_ylim()])
    points = np.column_stack([np.asarray(x), np.asarray(y)])
    return np.asarray((points - sides[:, 0]) / (sides[:, 1] - sides[:, 0]))


def _numbered(
    axes: Axes, line: np.ndarray, what: tuple[str, str], taken: Sequence[np.ndarray]
) -> np.ndarray:
    """Write a number in a colour on what is seen of a line, far from all else; where that is."""
    seen = line[((line > 0.06) & (line < 0.94)).all(axis=1)][::8]
    others = np.concatenate([points[np.isfinite(points).all(axis=1)] for points in taken])
    if not len(seen):
        return seen
    apart = np.hypot(*((seen[:, None, :] - others[None, :, :]) * _SHAPE).T).min(axis=0)
    place = seen[int(apart.argmax())]
    white = {"facecolor": "white", "edgecolor": "none", "pad": 0.4}
    axes.text(
        place[0],
        place[1],
        what[0],
        color=what[1],
        fontsize=6,
        ha="center",
        va="center",
        bbox=white,
        zorder=1.5,  # below the orbits
        transform=axes.transAxes,
    )
    return np.asarray(place + np.outer(np.linspace(-0.07, 0.07, 5), (1.0, 0.0)))


def _stress_slip(dataset: xr.Dataset, axes: Axes, law: int) -> Axes:
    """Two cycles, one after the other, against slip."""
    for number, (cell, label) in enumerate(_cells(dataset, law)):
        slip, stress, first = cell["slip"].values, cell["frictional_stress"].values, number == 0
        both = np.concatenate([slip, slip + slip[-1] - slip[0]])
        colour = look(number)["color"]
        axes.plot(both, np.tile(stress, 2), "-", color=colour, linewidth=1.2, label=label)
        fastest = int(cell["log10_slip_rate"].values.argmax())
        axes.plot(
            slip,
            cell["shear_stress"],
            "--",
            color=colour,
            linewidth=0.7,
            label="spring" if first else None,
        )
        axes.plot(
            slip[fastest],
            stress[fastest],
            marker(number),
            color=colour,
            markersize=4,
            label="fastest slip" if first else None,
        )
    mark_reversed(axes)
    axes.set_xlabel(f"Slip, {quantity('slip').symbol}")
    axes.set_ylabel(f"Frictional stress, {quantity('frictional_stress').symbol}")
    axes.set_title(_title(dataset, law))
    legend(axes)
    return axes


def _of_law(function: Callable[[xr.Dataset, Axes, int], Axes], law: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        return function(dataset, axes, law)

    return panel


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """Stress against slip rate for each law, and then against slip."""
    laws = range(dataset.sizes.get("law", 1))
    return [_of_law(kind, law) for kind in (_phase_plane, _stress_slip) for law in laws]


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
    text = place(cell, dimension)
    return f"{text} normal stress" if dimension == "normal_stress" else text
