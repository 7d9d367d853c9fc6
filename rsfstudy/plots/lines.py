"""Any lattice: the headline number against the last axis, one line for each point of the others."""

from __future__ import annotations

import textwrap

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.reduce.base import stated_by
from rsfstudy.vocabulary import quantity


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Draw the first data variable along its last dimension."""
    name = str(next(iter(dataset.data_vars)))
    values = dataset[name]
    along = str(values.dims[-1])
    rows = values.stack(line=values.dims[:-1]) if values.ndim > 1 else values.expand_dims("line")
    for row in rows.transpose("line", along):
        label = ""
        if values.ndim > 1:
            points = np.atleast_1d(np.asarray(row["line"].item(), dtype=object))
            places = zip(map(str, values.dims[:-1]), points, strict=True)
            label = ", ".join(f"{dimension} = {point}" for dimension, point in places)
        axes.plot(row[along].values, row.values, marker="o", markersize=3, label=label or None)
    own = stated_by(dataset)
    axes.set_xlabel(textwrap.fill(quantity(along, own).axis_label, 60))
    axes.set_ylabel(textwrap.fill(quantity(name, own).axis_label, 45))
    axes.set_title(textwrap.fill(dataset.attrs.get("title", ""), 70), fontsize="medium")
    if 1 < rows.sizes["line"] <= 12:
        axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return axes
