"""Coverage: histograms of errors over their estimates, one panel a question."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from rsfstudy.plots import Panel
from rsfstudy.plots._style import legend, look
from rsfstudy.plots._text import pretty

#: Errors this far below their estimates are drawn there.
_FLOOR, _CEILING = 1e-3, 10.0
_BINS = np.logspace(np.log10(_FLOOR), np.log10(_CEILING), 33).tolist()


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """One panel a question."""
    return [_panel(number) for number in range(dataset.sizes.get("question", 1))]


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first question."""
    return _panel(0)(dataset, axes)


def _panel(number: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Histogram of one question, one outline an accuracy."""
        asked = dataset.expand_dims(
            [d for d in ("question", "requested_digits") if d not in dataset.dims]
        )
        ratios = asked["error_over_estimate"].isel(question=number)
        for place, digits in enumerate(asked["requested_digits"].values):
            values = ratios.sel(requested_digits=digits).values.ravel()
            values = np.clip(values[np.isfinite(values)], _FLOOR, _CEILING)
            covered = f"{(values <= 1.0).sum()} of {values.size} covered"
            label = f"rtol $10^{{-{digits:g}}}$: {covered}"
            axes.hist(values, _BINS, histtype="step", **look(place), label=label)
        axes.axvline(1.0, color="0.3", linestyle="-", linewidth=0.8)
        axes.set_xscale("log")
        axes.set_xlabel("Error over its estimate")
        axes.set_ylabel("Numbers")
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_title(pretty(asked["question"].values[number]))
        legend(axes)
        return axes

    return panel
