"""What maps share: cells in colours with contours, and cells without a number hatched and named."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.contour import QuadContourSet
from matplotlib.patheffects import withStroke
from scipy.spatial import cKDTree

from rsfstudy.status import Status

#: Hatches of cells without a number, by the order in which their statuses are met.
_HATCHES = ("////", "\\\\\\\\", "....", "xxxx", "||||", "----", "++++", "oooo")
#: Part of a panel that a label needs around it.
_ROOM = 0.06
#: Part of a panel that a line has to go through for one.
_LONG = 0.2
#: Fewest points of an axis along which lines of equal value are drawn.
_FEWEST = 6
_NAMES = {int(status): status.label for status in Status}


def edges(points: np.ndarray, log: bool = False) -> np.ndarray:
    """Where cells end whose centres are these: halfway, on the scale they are drawn on."""
    at = np.log(points) if log else points.astype(float)
    halfway = 0.5 * (at[1:] + at[:-1])
    ends = np.concatenate([[2.0 * at[0] - halfway[0]], halfway, [2.0 * at[-1] - halfway[-1]]])
    return np.asarray(np.exp(ends) if log else ends)


def colours(
    axes: Axes, at: tuple[np.ndarray, np.ndarray], values: np.ndarray, **scale: Any
) -> QuadMesh:
    """Cells with their numbers in colours.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    at : tuple of array
        Edges of the cells along x and along y.
    values : array
        Along y, then x.
    **scale
        As `matplotlib.axes.Axes.pcolormesh` takes.
    """
    axes.grid(False)
    return axes.pcolormesh(*at, np.ma.masked_invalid(values), rasterized=True, **scale)


def contours(axes: Axes, values: xr.DataArray, levels: Sequence[float]) -> None:
    """Lines of equal value, labelled, where there are points enough on both axes; x and y are the
    coordinates of the last and the first dimension.
    """
    y, x = (values[dimension].values for dimension in values.dims)
    if min(values.shape) < _FEWEST or not len(levels):
        return
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "No contour levels were found")
        found = axes.contour(x, y, values, levels, colors="white", linewidths=0.6, linestyles="-")
    for text in axes.clabel(found, fontsize=6, fmt="%.3g", manual=_clear_places(axes, found)):
        text.set_path_effects([withStroke(linewidth=1.0, foreground="0.2")])


def _clear_places(axes: Axes, found: QuadContourSet) -> list[tuple[float, float]]:
    """Where the longest line of each level is farthest from those of other levels and from the
    frame; nowhere where that is too close for a label, or the line too short.
    """
    panel = axes.transData + axes.transAxes.inverted()
    levels = [[panel.transform(part) for part in parts if len(part)] for parts in found.allsegs]
    places = []
    for level in filter(None, levels):
        others = [part for other in levels if other is not level for part in other]
        line = max(level, key=len)
        apart = cKDTree(np.concatenate(others)).query(line)[0] if others else np.ones(len(line))
        room = np.minimum(apart, np.minimum(line, 1.0 - line).min(axis=1))
        if room.max() > _ROOM and np.ptp(line, axis=0).max() > _LONG:
            x, y = panel.inverted().transform(line[room.argmax()]).tolist()
            places.append((x, y))
    return places


def statuses(
    axes: Axes, at: tuple[np.ndarray, np.ndarray], status: np.ndarray, unknown: np.ndarray
) -> None:
    """Hatch the cells without a number, each status in its own way, and name it for the legend.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    at : tuple of array
        Edges of the cells along x and along y.
    status : array
        Along y, then x.
    unknown : array of bool
        The cells to hatch.
    """
    for hatch, code in zip(_HATCHES, np.unique(status[unknown]), strict=False):
        rows = [_run(at, *run) for run in _runs(unknown & (status == code))]
        name = _NAMES[int(code)].replace("_", " ") if code else "no number"
        axes.add_collection(
            PolyCollection(
                rows, facecolor="0.93", edgecolor="0.55", linewidth=0.0, hatch=hatch, label=name
            ),
            autolim=False,
        )


def _runs(here: np.ndarray) -> list[tuple[int, int, int]]:
    """Cells side by side: their row, and the first and the one after the last of their columns."""
    padded = np.pad(here.astype(int), ((0, 0), (1, 1)))
    change = np.diff(padded, axis=1)
    first, last = np.argwhere(change == 1), np.argwhere(change == -1)
    return [(int(r), int(a), int(b)) for (r, a), (_r, b) in zip(first, last, strict=True)]


def _run(at: tuple[np.ndarray, np.ndarray], row: int, a: int, b: int) -> list[tuple[float, float]]:
    (left, right), (low, high) = (at[0][a], at[0][b]), (at[1][row], at[1][row + 1])
    return [(left, low), (right, low), (right, high), (left, high)]
