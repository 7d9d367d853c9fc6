"""Stick-slip limit cycles under the slip law and the slowness law (Figs. 9, 10 and 11).

The figures show complete stick-slip cycles with inertia at constant and at variable normal stress,
after the motion has reached its limit cycle. Under the slip law, variable normal stress lowers the
minimum slip rate by ten orders of magnitude. Under the slowness law, variable normal stress has
little influence on the range of slip rate, and a segment of nearly constant stress follows each
rupture.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import LimitCycle
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._paper import PAPER, REFERENCE
from ._phase_plane import (
    LN10,
    constant_state_line,
    hatch_reversed_stress,
    scene_from_coordinates,
    steady_line,
    steady_line_key,
)


def cycle_place(law: str, normal_stress: str) -> dict[str, str]:
    """Return the coordinates of a limit cycle.

    Parameters
    ----------
    law : str
        State evolution law.
    normal_stress : str
        Normal stress condition.

    Returns
    -------
    dict
        Coordinates of the lattice cell.
    """
    return {"law": law, "normal_stress": normal_stress}


#: Values of log10(V/V_*) at which the lines of constant state intersect the line of steady sliding.
#: The state of a line is -b ln(V/V_*).
CONSTANT_STATE_LOG_RATES = (-8.0, -4.0, 0.0, 4.0, 8.0)
#: Maximum number of couplings between normal stress and shear stress for which a panel shows
#: separate lines of constant state. With more couplings, it only shows the lines of the first.
MAX_COUPLINGS_WITH_STATE_LINES = 2


def distinct_orbits(dataset: xr.Dataset) -> list[tuple[xr.Dataset, str]]:
    """Return the distinct limit cycles and their names.

    If several cells contain the same motion, the function returns only the first of these cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.

    Returns
    -------
    list of tuple
        Results of a cell, and its name.
    """
    from rsfstudy.plots import describe_point

    found: dict[bytes, tuple[xr.Dataset, str]] = {}
    dims = dataset["status"].dims
    for at in np.ndindex(*dataset["status"].shape):
        cell = dataset.isel(dict(zip(dims, at, strict=True)))
        constant = steady_line_key(cell)[0] == "constant"  # The driving angle has no effect here.
        words = [
            describe_point(cell, str(d)) for d in dims if not (constant and d in ("phi", "alpha"))
        ]
        if int(cell["status"]) == 0:
            found.setdefault(cell["frictional_stress"].values.tobytes(), (cell, ", ".join(words)))
    return list(found.values())


def plot_orbits(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Plot stress against slip rate, with lines of steady sliding and constant state.

    The relation between normal stress and shear stress may differ between cells. The line of steady
    sliding is drawn once for each relation. If there are more than two relations, the lines of
    constant state are drawn only for the first relation, because otherwise too many lines would
    overlap.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    cells = [cell for cell, _name in distinct_orbits(dataset)]
    for number, (cell, name) in enumerate(distinct_orbits(dataset)):
        style = {"color": cycle_style(number)["color"], "linewidth": 1.2 + 0.8 * (number == 0)}
        axes.plot(cell["log10_slip_rate"], cell["frictional_stress"], "-", label=name, **style)
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
    low, high = axes.get_xlim()
    rates = np.linspace(low, high, 400)
    taken = [
        _axes_fractions(axes, cell["log10_slip_rate"], cell["frictional_stress"]) for cell in cells
    ]
    drawn: set[tuple[str | float, ...]] = set()
    coupling_count = len({steady_line_key(cell) for cell in cells})
    for number, cell in enumerate(cells):
        if steady_line_key(cell) in drawn:
            continue
        drawn.add(steady_line_key(cell))
        colour, steady = cycle_style(number)["color"], steady_line(cell, rates)
        axes.plot(rates, steady, "--", color=colour, linewidth=0.8, label="steady state")
        taken.append(_axes_fractions(axes, rates, steady))
        if number and coupling_count > MAX_COUPLINGS_WITH_STATE_LINES:
            continue
        for state in CONSTANT_STATE_LOG_RATES:
            theta = -state * LN10 * scene_from_coordinates(cell).b
            line, text = (
                constant_state_line(cell, theta, rates),
                r"constant state, with its $\Theta$",
            )
            axes.plot(rates, line, ":", color=colour, linewidth=0.7, label=text)
            taken.append(
                _label_line(
                    axes, _axes_fractions(axes, rates, line), f"${theta + 0.0:.2g}$", colour, taken
                )
            )


def _axes_fractions(axes: MatplotlibAxes, x: Any, y: Any) -> np.ndarray:
    """Convert data coordinates to fractions of the axes."""
    panel = axes.transData + axes.transAxes.inverted()
    return np.asarray(panel.transform(np.column_stack([np.asarray(x), np.asarray(y)])))


def _label_line(
    axes: MatplotlibAxes, line: np.ndarray, number: str, colour: str, taken: Sequence[np.ndarray]
) -> np.ndarray:
    """Place the label of a line where it is visible and far from other points.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes to draw on.
    line : ndarray
        Points of the line as fractions of the axes.
    number : str
        Text of the label.
    colour : str
        Colour of the label.
    taken : sequence of ndarray
        Points of all other lines and labels, as fractions of the axes.

    Returns
    -------
    ndarray
        Points that the label covers. The array is empty if the line is not visible.
    """
    seen = line[((line > 0.06) & (line < 0.94)).all(axis=1)][::8]
    others = np.concatenate([points[np.isfinite(points).all(axis=1)] for points in taken])
    if not len(seen):
        return seen
    wide = (1.0, 2.0)  # The distance is scaled because labels are wider than high.
    apart = np.hypot(*((seen[:, None, :] - others[None, :, :]) * wide).T).min(axis=0)
    place = seen[int(apart.argmax())]
    white = {"facecolor": "white", "edgecolor": "none", "pad": 0.4}
    style = {"color": colour, "fontsize": 6, "bbox": white, "zorder": 1.5}  # below the limit cycles
    axes.text(*place, number, ha="center", va="center", transform=axes.transAxes, **style)
    return np.asarray(place + np.outer(np.linspace(-0.07, 0.07, 5), (1.0, 0.0)))


def plot_along_slip(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Plot stress against slip over two periods of each limit cycle.

    Dashed lines show the spring stress during the first period, and markers show the point of
    fastest slip.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_marker, cycle_style

    for number, (cell, name) in enumerate(distinct_orbits(dataset)):
        slip, stress = cell["slip"].values, cell["frictional_stress"].values
        colour, fastest = cycle_style(number)["color"], int(cell["log10_slip_rate"].values.argmax())
        both = np.concatenate([slip, slip + slip[-1] - slip[0]])
        axes.plot(both, np.tile(stress, 2), "-", color=colour, linewidth=1.2, label=name)
        thin = {"linewidth": 0.7, "label": "spring"}
        axes.plot(slip, cell["shear_stress"], "--", color=colour, **thin)
        dot = {"marker": cycle_marker(number), "markersize": 4, "label": "peak slip rate"}
        axes.plot(slip[fastest], stress[fastest], linestyle="none", color=colour, **dot)


panel = Panel(y_label=r"Frictional stress, $\tau_f/\sigma_*$", facet=["law"])
figure = Figure(
    [
        replace(
            panel,
            overlays=[plot_orbits, hatch_reversed_stress],
            x_label=r"Slip rate, $\log_{10}(V/V_*)$",
        ),
        replace(
            panel, overlays=[plot_along_slip, hatch_reversed_stress], x_label=r"Slip, $\delta/D_c$"
        ),
    ],
    allow_extra_dims=True,
)


study = Study(
    name="limit_cycles",
    title="Stick-slip limit cycles, k = 0.8 k_cr(V_*), b/a = 2, V_0 = 2 V_*",
    summary=Study.caption(__doc__),
    base=Scene(
        b_over_a=2.0, alpha=0.56, stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True
    ),
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("normal_stress", ["constant", "variable"]),
    ],
    measure=LimitCycle(),
    claims=[
        Claim(
            id="C12",
            statement="slip law: variable normal stress lowers the minimum slip rate by 10 decades",
            source=f"{PAPER}, Fig. 9",
            variable="min_log10_slip_rate",
            where=cycle_place("slip", "variable"),
            baseline=cycle_place("slip", "constant"),
            published=-10.0,
            tolerance=0.5,
            reason="'by 10 orders of magnitude'",
        ),
        Claim.above(
            id="C12",
            statement="slip law: larger stress drop with variable normal stress",
            source=f"{PAPER}, Fig. 9",
            variable="static_stress_drop",
            where=cycle_place("slip", "variable"),
            baseline=cycle_place("slip", "constant"),
            published=0.0,
        ),
        Claim(
            id="C13",
            statement="slowness law: similar range of slip rate, constant and variable",
            source=f"{PAPER}, Fig. 10",
            variable="min_log10_slip_rate",
            where=cycle_place("slowness", "variable"),
            baseline=cycle_place("slowness", "constant"),
            published=0.0,
            tolerance=0.5,
            reason="'similar', compared with ten decades for the slip law",
        ),
        *(
            Claim(
                id="C13",
                statement=f"slowness law, {stress}: theta ~ V^(-a/b) = V^(-1/2) after the rupture",
                source=f"{PAPER}, section 3.4",
                variable="healing_exponent",
                where=cycle_place("slowness", stress),
                published=-0.5,
                tolerance=0.05,
                reason="'approximately': stress is not exactly constant, because the spring is "
                "loaded",
            )
            for stress in ("constant", "variable")
        ),
        *(
            Claim.above(
                id="C14",
                statement=(
                    f"slowness law, {stress}: stress drops in acceleration and deceleration differ"
                ),
                source=f"{PAPER}, section 3.4, Fig. 11",
                variable="drop_asymmetry",
                where=cycle_place("slowness", stress),
                published=1.5,
                reason="'strongly asymmetrical'; symmetrical drops have a ratio of 1",
            )
            for stress in ("constant", "variable")
        ),
        Claim.above(
            id="C14",
            statement="constant normal stress: the asymmetry is larger than under the slip law",
            source=f"{PAPER}, section 3.4, Rice and Tse (1986)",
            variable="drop_asymmetry",
            where=cycle_place("slowness", "constant"),
            baseline=cycle_place("slip", "constant"),
            published=1.0,
            reason="'different to the slip law', under which the two drops differ by less than 25 "
            "%",
        ),
    ],
    plot=figure,
    references=[REFERENCE, "Rice and Tse (1986), J. Geophys. Res. 91, 521-530"],
)
