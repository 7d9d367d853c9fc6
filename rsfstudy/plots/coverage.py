"""Coverage: histograms of errors over their estimates, one panel a question."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

#: Errors this far below their estimates are drawn there.
_FLOOR, _CEILING = 1e-3, 10.0
_BINS = np.logspace(np.log10(_FLOOR), np.log10(_CEILING), 33).tolist()
PANEL = (5.2, 3.4)


def _panel(number: int) -> Callable[[xr.Dataset, Axes], Axes]:
    def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Histogram of one question, one outline an accuracy."""
        questions = np.atleast_1d(dataset["question"].values)
        if number >= len(questions):
            axes.set_axis_off()
            return axes
        asked = dataset.expand_dims(
            [d for d in ("question", "requested_digits") if d not in dataset.dims]
        )
        ratios = asked["error_over_estimate"].isel(question=number)
        for digits in asked["requested_digits"].values:
            values = ratios.sel(requested_digits=digits).values.ravel()
            values = np.clip(values[np.isfinite(values)], _FLOOR, _CEILING)
            covered = f"{(values <= 1.0).sum()} of {values.size} covered"
            axes.hist(values, _BINS, histtype="step", label=f"rtol $10^{{-{digits:g}}}$: {covered}")
        axes.axvline(1.0, color="0.3", linestyle="--", linewidth=1.0)
        axes.set_xscale("log")
        axes.set_xlabel("Error over its estimate")
        axes.set_ylabel("Numbers")
        axes.set_title(str(questions[number]), fontsize="medium")
        axes.set_ylim(top=1.3 * axes.get_ylim()[1])  # room for the legend
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize="x-small", loc="upper left")
        return axes

    return draw


PANELS = tuple(_panel(number) for number in range(4))
draw = PANELS[0]
