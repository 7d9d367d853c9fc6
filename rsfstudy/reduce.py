"""Reductions: from a lattice to boundaries and scaling slopes, kept in the same dataset.

A reduction never draws on failed or missing cells: where there are any within its support, the
result is NaN and says why. Cells that answered without a number (such as `stable_for_all_steps`)
are left out, and counted.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.status import Status
from rsfstudy.vocabulary import quantity

#: Values of a coordinate count as within a range they miss by a rounding error.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Reduction:
    """Base of all reductions: ``reduction(dataset)`` gives a dataset of the new variables."""

    #: Name of the kind in declarations.
    kind: ClassVar[str]

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """The new variables."""
        raise TypeError(f"{type(self).__name__} reduces nothing")

    def describe(self) -> dict[str, Any]:
        """The reduction as plain data."""
        return {"kind": self.kind, **asdict(self)}


@dataclass(frozen=True)
class ProportionalFit(Reduction):
    """Least squares of ``of - minus = name * on``, without intercept and unweighted.

    Parameters
    ----------
    name : str
        Name of the slope; ``<name>_stderr`` (the standard error, which measures the misfit of the
        law, not numerical error), ``<name>_misfit`` (the largest misfit, in units of `of`) and
        ``<name>_points`` come with it.
    of : str
        Variable to fit.
    on : str
        Coordinate along one dimension.
    minus : float
        Value of `of` at the origin.
    within : tuple of float
        Range of `on` that is fitted, both ends included; all of it by default.
    """

    name: str
    of: str
    on: str
    minus: float = 0.0
    within: tuple[float, float] | None = None
    kind: ClassVar[str] = "proportional_fit"

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Fit along the dimension of `on`, for each point of the others.

        Raises
        ------
        InvalidValue
            Where `on` is no coordinate along one dimension.
        """
        if self.on not in dataset.coords or dataset[self.on].ndim != 1:
            raise InvalidValue(
                "on",
                self.on,
                "must be a coordinate along one dimension",
                choices=map(str, dataset.coords),
            )
        dimension = str(dataset[self.on].dims[0])
        lowest, highest = self.within or (-np.inf, np.inf)
        inside = (dataset[self.on] >= lowest * (1.0 - _ROUNDING)) & (
            dataset[self.on] <= highest * (1.0 + _ROUNDING)
        )
        support = dataset.isel({dimension: np.flatnonzero(inside.values)})
        x, y = support[self.on].astype(float), support[self.of] - self.minus
        used = y.notnull()
        x, y = x.where(used), y.where(used)
        count = used.sum(dimension)
        slope = (x * y).sum(dimension) / (x**2).sum(dimension)
        misfit = y - slope * x
        spread = (misfit**2).sum(dimension) / (count - 1).where(count > 1)
        error = (spread / (x**2).sum(dimension)) ** 0.5
        largest = abs(misfit).max(dimension)
        failed = _failed(support["status"]).any(dimension)
        result = xr.Dataset(
            {
                self.name: slope.where((count > 0) & ~failed),
                f"{self.name}_stderr": error.where(~failed),
                f"{self.name}_misfit": largest.where((count > 0) & ~failed),
                f"{self.name}_points": count.astype("int32"),
            }
        )
        law = f"{self.of} = {self.minus:g} + {self.name} * {self.on}"
        span = f"{lowest:g} <= {self.on} <= {highest:g}"
        for name in result:
            result[name].attrs["comment"] = f"least squares of {law} over {span}"
            if bool(failed.any()):
                result[name].attrs["refused"] = (
                    "cells within the fitted range failed or are missing"
                )
        return result.drop_vars([c for c in result.coords if dimension in result[c].dims])


@dataclass(frozen=True)
class RelativeDifference(Reduction):
    """How far a variable lies below its value at a reference point of one dimension: ``1 -
    of/of_reference``.

    Parameters
    ----------
    name : str
        Name of the result.
    of : str
        Variable to compare.
    along : str
        Dimension of the reference.
    reference : str or float
        Label of the reference point on that dimension.
    """

    name: str
    of: str
    along: str
    reference: str | float
    kind: ClassVar[str] = "relative_difference"

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare along `along`; NaN everywhere if the lattice has no reference point."""
        values = dataset[self.of]
        if self.reference in dataset[self.along].values:
            difference = 1.0 - values / values.sel({self.along: self.reference}, drop=True)
            note = f"1 - {self.of} over its value at {self.along} = {self.reference}"
        else:
            difference = xr.full_like(values, np.nan)
            note = f"the lattice has no {self.along} = {self.reference} to compare with"
        return xr.Dataset({self.name: difference.assign_attrs(comment=note)})


def _failed(status: xr.DataArray) -> xr.DataArray:
    """Where a cell failed or was not computed."""
    return status > int(Status.NORM_UNREACHABLE)


def reduced(dataset: xr.Dataset, reductions: tuple[Reduction, ...]) -> xr.Dataset:
    """The dataset with the results of its reductions, each described by the vocabulary."""
    for reduction in reductions:
        for name, values in reduction(dataset).data_vars.items():
            about = quantity(str(name))
            values.attrs = {"long_name": about.long_name, "units": about.units, **values.attrs}
            dataset = dataset.assign({name: values})
    return dataset
