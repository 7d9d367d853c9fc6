"""Work-precision diagrams, two a problem: error against right-hand sides, and against time."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

from rsfstudy.plots import Panel
from rsfstudy.status import Status

#: Dimensions the figure has room for.
DIMENSIONS = ("problem", "integrator", "requested_digits")
#: Small panels on one page.
PANEL, COLUMNS = (3.8, 2.9), 4

_MARKERS = "os^vD<>P*"
_LABELS = {
    "run_evaluations": "Right-hand sides (x: out of reach)",
    "relative_time": "Time over that of DOP853 for 3 digits",
}


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first problem, against right-hand sides."""
    return _diagram(dataset, axes, 0, "run_evaluations")


def _diagram(dataset: xr.Dataset, axes: Axes, problem: int, work: str) -> Axes:
    if problem >= dataset.sizes["problem"]:
        axes.set_axis_off()
        return axes
    cell = dataset.isel(problem=problem)
    for number, integrator in enumerate(cell["integrator"].values):
        runs = cell.sel(integrator=integrator)
        axes.plot(
            runs[work],
            runs["measured_error"],
            f"{_MARKERS[number % len(_MARKERS)]}-",
            linewidth=2.0 if integrator == "DOP853" else 0.8,
            label=str(integrator),
            color=f"C{number}",
            markersize=4,
        )
        if work == "run_evaluations":
            lost = runs["status"] == Status.ACCURACY_OUT_OF_REACH
            asked = 10.0 ** -runs["requested_digits"]
            axes.plot(runs[work].where(lost), asked, "x", color=f"C{number}", markersize=4)
    floor = float(cell["measured_error_error"].max())
    axes.axhline(max(floor, 1e-16), color="0.7", linewidth=0.8, linestyle=":")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(_LABELS[work], fontsize="small")
    axes.set_ylabel("Measured error", fontsize="small")
    axes.set_title(str(cell["problem"].item()), fontsize="medium")
    axes.tick_params(labelsize="small")
    if problem == 0 and work == "run_evaluations":  # the same integrators in every panel
        axes.legend(fontsize="xx-small")
    axes.grid(alpha=0.3)
    return axes


def draw_digits(dataset: xr.Dataset, axes: Axes) -> Axes:
    """For so many digits you pay this much: right-hand sides of the default."""
    if "cheapest_default_work" not in dataset:
        axes.set_axis_off()
        return axes
    wanted = dataset["digits"].values
    position = np.arange(dataset.sizes["problem"])
    for number, digits in enumerate(wanted):
        cell = dataset.sel(digits=digits)
        work = cell["cheapest_default_work"].values
        width = 0.8 / len(wanted)
        at = position + (number - 0.5 * (len(wanted) - 1)) * width
        axes.barh(at, work, height=width, color=f"C{number}", label=f"{digits:g} digits")
        for place, evaluations in zip(at, work, strict=True):
            if np.isfinite(evaluations):
                text = f" {evaluations:,.0f}"
                axes.text(evaluations, place, text, va="center", fontsize="xx-small")
    axes.set_yticks(position, [str(p) for p in dataset["problem"].values], fontsize="x-small")
    axes.tick_params(axis="x", labelsize="small")
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlim(right=20.0 * np.nanmax(dataset["cheapest_default_work"].values))
    axes.set_xlabel("Right-hand sides of DOP853", fontsize="small")
    axes.set_ylabel("Problem", fontsize="small")
    axes.set_title("What correct digits cost", fontsize="medium")
    axes.legend(fontsize="xx-small")
    return axes


def _other(problem: int, work: str) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        return _diagram(dataset, axes, problem, work)

    return panel


def draw_proportionality(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Digits reached against digits asked for, by the default integrator."""
    if "DOP853" not in dataset["integrator"].values:
        axes.set_axis_off()
        return axes
    default = dataset.sel(integrator="DOP853")
    for problem in dataset["problem"].values:
        row = default.sel(problem=problem)
        reached = row["achieved_digits"]
        axes.plot(row["requested_digits"], reached, "o-", label=str(problem), markersize=4)
    reach = dataset["requested_digits"].values
    axes.plot(reach, reach, "--", color="0.5", label="as asked")
    axes.set_xlabel("Digits asked for, -log10 rtol", fontsize="small")
    axes.set_ylabel("Digits reached", fontsize="small")
    axes.tick_params(labelsize="small")
    axes.set_title("Tolerance proportionality of DOP853", fontsize="medium")
    axes.legend(fontsize="xx-small")
    axes.grid(alpha=0.3)
    return axes


PANELS = (
    draw,
    _other(0, "relative_time"),
    *(_other(p, work) for p in range(1, 5) for work in _LABELS),
    draw_digits,
    draw_proportionality,
)
