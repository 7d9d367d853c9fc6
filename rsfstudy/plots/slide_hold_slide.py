"""Slide-hold-slide: healing and relaxation against hold time, case by case, records of friction,
and healing per decade against stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import log_scale, same_height
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import number, pretty, slope_with_error
from rsfstudy.reduce.base import stated_by
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("case", "stiffness", "hold_time")

#: Of a panel, in mm.
HEIGHT = 48.0

#: Hold times whose records are drawn.
_RECORDS = 5


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """Healing, and relaxation beside it, for each case; records, and the rate of healing where
    holds are long enough for one.
    """
    cases = range(dataset.sizes["case"])
    both = [_against_time(name, case) for case in cases for name in ("healing", "relaxation")]
    fitted = "healing_per_decade" in dataset and bool(dataset["healing_per_decade"].notnull().any())
    return [*both, draw_records, *([draw_rate] if fitted else [])]


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Healing of the first case against hold time."""
    return _against_time("healing", 0)(dataset, axes)


def _against_time(name: str, case: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """One line a stiffness; as high for all cases."""
        for place in range(dataset.sizes["stiffness"]):
            row = dataset.isel(case=case, stiffness=place)
            style = look(place) | {"marker": marker(place), "markersize": 2.5}
            axes.plot(row["hold_time"], row[name], label=_stiffness(row), **style)
        same_height(axes, dataset[name])
        log_scale(axes, "x")
        axes.set_xlabel(quantity("hold_time").axis_label)
        axes.set_ylabel(f"{name.capitalize()}, {stated_by(dataset)[name].symbol}")
        axes.set_title(_sentence(_case(dataset.isel(case=case))))
        legend(axes)
        return axes

    return panel


def draw_records(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Friction against load point displacement by the slowness law, for some hold times."""
    rows = dataset.isel(
        case=min(1, dataset.sizes["case"] - 1), stiffness=dataset.sizes["stiffness"] // 2
    )
    last = dataset.sizes["hold_time"] - 1
    for drawn, place in enumerate(np.unique(np.linspace(0, last, _RECORDS).astype(int))):
        row = rows.isel(hold_time=place)
        change = row["friction_coefficient"] - row["mu_star"]
        label = number(float(row["hold_time"]))
        axes.plot(row["load_point_displacement"], change, label=label, **look(drawn))
    axes.axhline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axes.set_xlabel(quantity("load_point_displacement", stated_by(dataset)).axis_label)
    axes.set_ylabel(r"Change of friction, $\mu - \mu_*$")
    axes.set_title(f"{_sentence(_case(rows))}, {_stiffness(rows)}")
    legend(axes, 3, title=quantity("hold_time").axis_label)
    return axes


def draw_rate(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Healing per decade against stiffness, with the standard errors of the fits."""
    for case in range(dataset.sizes["case"]):
        row = dataset.isel(case=case)
        rate, error = row["healing_per_decade"], row["healing_per_decade_stderr"]
        last = slope_with_error(row.isel(stiffness=-1), "healing_per_decade", 5)
        label = f"{_case(row)}: {last}"
        x = row["stiffness"] / row["a"]
        axes.errorbar(x, rate, error, marker=marker(case), label=label, **look(case))
    log_scale(axes, "x")
    axes.set_xlabel(r"Stiffness, $k D_c/(a\,\sigma_*)$")
    axes.set_ylabel(r"Healing per decade, $\beta$")
    axes.set_title("Healing per decade of hold time, from $10^4$ on")
    legend(axes, 1, title="with $\\beta$ on the stiffest machine")
    return axes


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"


def _case(row: xr.Dataset) -> str:
    return pretty(row["case"].item()).replace("b < a", "$b < a$")


def _stiffness(row: xr.Dataset) -> str:
    over_a = float(row["stiffness"]) / float(row["a"])
    return rf"$k = {over_a:.3g}\,a\sigma_*/D_c$"
