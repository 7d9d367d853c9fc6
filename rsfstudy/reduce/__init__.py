"""Reductions: from a lattice to boundaries and scaling slopes, kept in the same dataset.

A reduction never draws on failed or missing cells: where there are any within its support, the
result is NaN and says why. Cells that answered without a number (such as `stable_for_all_steps`)
are left out, and counted.
"""

from __future__ import annotations

import xarray as xr

from rsfstudy.reduce.base import Reduction
from rsfstudy.reduce.boundaries import Boundary, Inverse
from rsfstudy.reduce.comparisons import Difference, OverClosedForm, RelativeDifference, Spread
from rsfstudy.reduce.fits import LinearFit, ProportionalFit
from rsfstudy.reduce.paths import Parting
from rsfstudy.reduce.work import Cheapest
from rsfstudy.vocabulary import quantity

__all__ = [
    "Boundary",
    "Cheapest",
    "Difference",
    "Inverse",
    "LinearFit",
    "OverClosedForm",
    "Parting",
    "ProportionalFit",
    "Reduction",
    "RelativeDifference",
    "Spread",
    "reduced",
]


def reduced(dataset: xr.Dataset, reductions: tuple[Reduction, ...]) -> xr.Dataset:
    """The dataset with the results of its reductions, each described by the vocabulary."""
    for reduction in reductions:
        for name, values in reduction(dataset).data_vars.items():
            about = quantity(str(name))
            own = {key: values.attrs[key] for key in ("comment", "refused") if key in values.attrs}
            scale = {"scale": about.scale} if about.scale and about.units == "1" else {}
            values.attrs = {"long_name": about.long_name, "units": about.units, **scale, **own}
            dataset = dataset.assign({name: values})
            for coordinate in values.dims:
                if coordinate in dataset.coords and not dataset[coordinate].attrs:
                    about = quantity(str(coordinate))
                    dataset[coordinate].attrs = {"long_name": about.long_name, "units": about.units}
    return dataset
