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

    name: str
    of: str

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """The new variables."""
        raise TypeError(f"{type(self).__name__} reduces nothing")

    def describe(self) -> dict[str, Any]:
        """The reduction as plain data."""
        return {"kind": self.kind, **asdict(self)}


@dataclass(frozen=True)
class _Fit(Reduction):
    """Unweighted least squares along one coordinate; members say of which law.

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
    within : tuple of float
        Range of `on` that is fitted, both ends included; all of it by default.
    """

    on: str = ""
    within: tuple[float, float] | None = None
    #: Parameters of the law.
    unknowns: ClassVar[int] = 1

    def law(self) -> str:
        """The law in words."""
        raise TypeError(f"{type(self).__name__} fits no law")

    def centred(self, values: xr.DataArray, dimension: str) -> xr.DataArray:
        """Values as they enter a fit through the origin."""
        raise TypeError(f"{type(self).__name__} fits no law")

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Fit along the dimension of `on`, for each point of the others; nothing where no point is
        in range.

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
                choices=[str(n) for n, c in dataset.coords.items() if c.ndim == 1 and n != self.on],
            )
        dimension = str(dataset[self.on].dims[0])
        lowest, highest = self.within or (-np.inf, np.inf)
        inside = (dataset[self.on] >= lowest - _ROUNDING * abs(lowest)) & (
            dataset[self.on] <= highest + _ROUNDING * abs(highest)
        )
        support = dataset.isel({dimension: np.flatnonzero(inside.values)})
        if support.sizes[dimension] == 0:
            return xr.Dataset()
        used = support[self.of].notnull()
        x = self.centred(support[self.on].astype(float).where(used), dimension)
        y = self.centred(self.offset(support[self.of]), dimension)
        count = used.sum(dimension)
        slope = (x * y).sum(dimension) / (x**2).sum(dimension)
        misfit = y - slope * x
        freedom = count - self.unknowns
        spread = (misfit**2).sum(dimension) / freedom.where(freedom > 0)
        error = (spread / (x**2).sum(dimension)) ** 0.5
        largest = abs(misfit).max(dimension)
        failed = _failed(support["status"]).any(dimension)
        known = (count >= self.unknowns) & ~failed
        result = xr.Dataset(
            {
                self.name: slope.where(known),
                f"{self.name}_stderr": error.where(known),
                f"{self.name}_misfit": largest.where(known),
                f"{self.name}_points": count.astype("int32"),
            }
        )
        span = f"{lowest:g} <= {self.on} <= {highest:g}" if self.within else f"all {self.on}"
        for name in result:
            result[name].attrs["comment"] = f"least squares of {self.law()} over {span}"
            if bool(failed.any()):
                result[name].attrs["refused"] = (
                    "cells within the fitted range failed or are missing"
                )
        return result.drop_vars([c for c in result.coords if dimension in result[c].dims])

    def offset(self, values: xr.DataArray) -> xr.DataArray:
        """Values less what the law holds fixed."""
        return values


@dataclass(frozen=True)
class ProportionalFit(_Fit):
    """Least squares of ``of - minus = name * on``, without intercept; `minus` is the value of `of`
    at the origin.
    """

    minus: float = 0.0
    kind: ClassVar[str] = "proportional_fit"

    def law(self) -> str:
        """The law in words."""
        return f"{self.of} = {self.minus:g} + {self.name} * {self.on}"

    def centred(self, values: xr.DataArray, dimension: str) -> xr.DataArray:
        """As they are: the line goes through the origin."""
        return values

    def offset(self, values: xr.DataArray) -> xr.DataArray:
        """Values less the value at the origin."""
        return values - self.minus


@dataclass(frozen=True)
class LinearFit(_Fit):
    """Least squares of ``of = constant + name * on``."""

    unknowns: ClassVar[int] = 2
    kind: ClassVar[str] = "linear_fit"

    def law(self) -> str:
        """The law in words."""
        return f"{self.of} = constant + {self.name} * {self.on}"

    def centred(self, values: xr.DataArray, dimension: str) -> xr.DataArray:
        """Less their mean, which takes care of the constant."""
        return values - values.mean(dimension)


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

    along: str = ""
    reference: str | float = ""
    kind: ClassVar[str] = "relative_difference"

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare along `along`; nothing if the lattice has no reference point."""
        values = dataset[self.of]
        if self.reference not in dataset[self.along].values:
            return xr.Dataset()
        difference = 1.0 - values / values.sel({self.along: self.reference}, drop=True)
        note = f"1 - {self.of} over its value at {self.along} = {self.reference}"
        return xr.Dataset({self.name: difference.assign_attrs(comment=note)})


def _failed(status: xr.DataArray) -> xr.DataArray:
    """Where a cell failed or was not computed."""
    return status > int(Status.NORM_UNREACHABLE)


def reduced(dataset: xr.Dataset, reductions: tuple[Reduction, ...]) -> xr.Dataset:
    """The dataset with the results of its reductions, each described by the vocabulary."""
    for reduction in reductions:
        for name, values in reduction(dataset).data_vars.items():
            about = quantity(str(name))
            own = {key: values.attrs[key] for key in ("comment", "refused") if key in values.attrs}
            scale = {"scale": about.scale} if about.scale and about.units == "1" else {}
            values.attrs = {"long_name": about.long_name, "units": about.units, **scale, **own}
            dataset = dataset.assign({name: values})
    return dataset
