"""Statistics over samples: mean, standard deviation and quantiles with their errors, and the share
of each status.

Each has two errors, told apart: ``<name>_stderr`` is that of sampling, the standard error if the
samples were independent, which those of Sobol points and Latin hypercubes rarely exceed;
``<name>_error`` is what the numerical errors of the cells make of it.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import Quantity
from rsfstudy.status import Status
from rsfstudy.study.reductions.base import (
    DerivativesByVariable,
    Reduction,
    UnitFieldsBySuffix,
    refused_result_mask,
)
from rsfstudy.study.reductions.result_units import find_varying_scale


@dataclass(frozen=True)
class _SampleStatistic(Reduction):
    """A statistic over samples; members say which.

    Parameters
    ----------
    name : str
        Name of the result; ``<name>_stderr``, ``<name>_error`` and ``<name>_points`` (the number of
        samples that have a number) come with it.
    of : str
        Variable to reduce.
    over : str
        Dimension of the samples.
    """

    over: str = "sample"
    long_names: ClassVar[Mapping[str, str]] = {
        "_stderr": "standard error, by sampling, of {name}",
        "_points": "samples with a number for {name}",
    }
    unit_fields: ClassVar[UnitFieldsBySuffix] = {"": ("of",), "_stderr": ("of",)}
    #: What it is, in words.
    description: ClassVar[str]

    #: Fewest samples of which it can be told with its error.
    min_samples: ClassVar[int] = 2

    def compute(self, of: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
        """The statistic, and its standard error."""
        raise TypeError(f"{type(self).__name__} is no statistic")

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Reduce along the dimension of the samples.

        Raises
        ------
        InvalidValue
            Where `of` does not lie along it.
        """
        of, why = _select_sampled_variable(self, dataset), ""
        count = of.notnull().sum(self.over)
        bad = refused_result_mask(dataset, self.of, self.over)
        if varied := find_varying_scale(dataset, of.attrs.get("scale", ""), {self.over}):
            bad, why = xr.ones_like(bad), f"{self.of} is in units of {varied}, which varies"
        elif bool(bad.any()):
            why = "samples failed or are missing"
        elif bool((count < self.min_samples).any()):
            why = f"needs {self.min_samples} samples with a number"
        known, said = (count >= self.min_samples) & ~bad, {"refused": why} if why else {}
        value, stderr = (
            result.where(known).drop_attrs(deep=False).assign_attrs(said)
            for result in self.compute(of)
        )
        found = {"": value, "_stderr": stderr, "_points": count.astype("int32")}
        return self.results(f"{self.description} of {self.of} over {self.over}", found)


def standard_deviation(
    values: xr.DataArray, sample_dimension: str, degrees_of_freedom_lost: int = 1
) -> xr.DataArray:
    """Compute the standard deviation of samples, with n - ddof degrees of freedom.

    The result is NaN if there are no more than ``degrees_of_freedom_lost`` samples.
    """
    with warnings.catch_warnings():  # older versions of xarray let it through
        warnings.filterwarnings("ignore", "Degrees of freedom", RuntimeWarning)
        return values.std(sample_dimension, ddof=degrees_of_freedom_lost)


@guard_methods
@dataclass(frozen=True)
class Mean(_SampleStatistic):
    """Mean over samples."""

    kind: ClassVar[str] = "mean"
    description: ClassVar[str] = "mean"

    def compute(self, of: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
        """The mean, and sd/sqrt(n)."""
        count = of.notnull().sum(self.over)
        return of.mean(self.over), standard_deviation(of, self.over) / count**0.5

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """1/n."""
        has = _select_sampled_variable(self, dataset).notnull()
        return [(has / has.sum(self.over), {})]


@guard_methods
@dataclass(frozen=True)
class StandardDeviation(_SampleStatistic):
    """Standard deviation over samples, of three at least.

    References
    ----------
    Efron and Stein (1981), Annals of Statistics 9, 586-596: its standard error.
    """

    kind: ClassVar[str] = "standard_deviation"
    description: ClassVar[str] = "standard deviation"
    min_samples = 3

    def compute(self, of: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
        """Compute the standard deviation and its standard error.

        The standard deviation has n - 1 degrees of freedom. Its standard error is estimated by the
        jackknife, from the standard deviations of the samples without one sample each. The estimate
        requires independent samples but no particular distribution.
        """
        count, apart = of.notnull().sum(self.over), of - of.mean(self.over)
        rest = (apart**2).sum(self.over) - apart**2 * count / (count - 1.0)
        without = (rest.clip(min=0.0) / (count - 2.0).where(count > 2)) ** 0.5
        scatter = standard_deviation(without, self.over, 0) * (count - 1.0) ** 0.5
        return standard_deviation(of, self.over), scatter

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """(y - mean)/((n - 1) sd)."""
        of = _select_sampled_variable(self, dataset)
        freedom = of.notnull().sum(self.over) - 1
        by = (of - of.mean(self.over)) / (freedom * standard_deviation(of, self.over))
        return [(by.fillna(0.0), {})]


@guard_methods
@dataclass(frozen=True)
class Quantile(_SampleStatistic):
    """Quantile over samples, between neighbours by their distance; its standard error is half the
    distance of the quantiles a standard deviation of the binomial above and below.

    Parameters
    ----------
    level : float
        Share of the samples below it.
    """

    level: float = 0.5
    kind: ClassVar[str] = "quantile"

    def __post_init__(self) -> None:
        if not isinstance(self.level, int | float) or not 0.0 < self.level < 1.0:
            raise InvalidValue("level", self.level, "must be between 0 and 1")

    @property
    def description(self) -> str:  # type: ignore[override]
        """What it is, in words."""
        return f"quantile at {self.level:g}"

    @property
    def min_samples(self) -> int:  # type: ignore[override]
        """So many that a standard deviation of the binomial stays between 0 and 1."""
        rarer = min(self.level, 1.0 - self.level)
        return max(2, math.ceil((1.0 - rarer) / rarer - 1e-9))

    def compute(self, of: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
        """By the order of the samples."""
        apart = (self.level * (1.0 - self.level) / of.notnull().sum(self.over)) ** 0.5
        found = [
            _interpolated_quantile(of, self.over, self.level + sign * apart)
            for sign in (0.0, -1.0, 1.0)
        ]
        return found[0], 0.5 * (found[2] - found[1])

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Reduce along the dimension of the samples; with what the errors of cells make of it: the
        quantiles of values less and plus their errors bound it, however these change their order.
        """
        found, beside = super().__call__(dataset), f"{self.of}_error"
        if beside not in dataset:
            return found
        of, at = _select_sampled_variable(self, dataset), xr.DataArray(self.level)
        errors = dataset[beside].reset_coords(drop=True)
        errors = (errors + sys.float_info.epsilon * abs(of)).fillna(np.inf)
        low, high = (
            _interpolated_quantile(of + sign * errors, self.over, at) for sign in (-1.0, 1.0)
        )
        down, up = found[self.name] - low, high - found[self.name]
        error = down.where(down > up, up)
        note = "by quantiles of values less and plus errors"
        error = error.where(abs(error) < np.inf).assign_attrs(comment=note)
        return found.assign({f"{self.name}_error": error})


def _interpolated_quantile(
    values: xr.DataArray, sample_dimension: str, quantile_level: xr.DataArray
) -> xr.DataArray:
    """A quantile: between the two samples whose ranks are beside it, by their distance."""
    place = values.get_axis_num(sample_dimension)
    ranks = values.copy(
        data=np.argsort(np.argsort(values.values, axis=place), axis=place).astype(float)
    )
    at = quantile_level.clip(0.0, 1.0) * (values.notnull().sum(sample_dimension) - 1)
    weights = (1.0 - abs(ranks - at)).clip(min=0.0).where(values.notnull(), 0.0)
    return (weights * values.where(weights > 0.0, 0.0)).sum(sample_dimension)


@guard_methods
@dataclass(frozen=True)
class StatusShares(Reduction):
    """Share of the samples that ended by each status, failures among them; its standard error is
    that of a share of which one more ended so, and one more did not.

    Parameters
    ----------
    name : str
        Name of the shares, along the dimension ``ended``; ``<name>_stderr`` comes with it.
    of : str
        A variable that was measured.
    over : str
        Dimension of the samples.
    """

    over: str = "sample"
    kind: ClassVar[str] = "status_shares"
    uses_failed_cells: ClassVar[bool] = True
    long_names: ClassVar[Mapping[str, str]] = {
        "": "share of samples that ended so",
        "_stderr": "standard error, by sampling, of {name}",
    }

    @property
    def quantities(self) -> Sequence[Quantity]:
        return [*super().quantities, Quantity("ended", "", "", "status with which a sample ended")]

    def support_status(self, status: xr.DataArray) -> xr.DataArray:
        """Cells that are there, however they ended."""
        return status.where(status == int(Status.PENDING), int(Status.OK))

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Count along the dimension of the samples."""
        _select_sampled_variable(self, dataset)
        status = dataset["status"].reset_coords(drop=True)
        statuses = [status for status in Status if status is not Status.PENDING]
        codes = xr.DataArray(
            [int(each) for each in statuses], {"ended": [s.label for s in statuses]}, "ended"
        )
        count, ended = status.sizes[self.over], (status == codes).sum(self.over)
        smoothed = (ended + 1) / (count + 2)
        stderr = (smoothed * (1.0 - smoothed) / (count + 3)) ** 0.5
        known = ~(status == int(Status.PENDING)).any(self.over)
        found = {self.name: ended / count, f"{self.name}_stderr": stderr}
        return xr.Dataset({name: values.where(known) for name, values in found.items()})


@guard_methods
@dataclass(frozen=True)
class Logarithm(Reduction):
    """Natural logarithm of a variable, in each cell where that is positive. Slopes of it over
    natural logarithms are exponents; see `PowerLaw`.
    """

    kind: ClassVar[str] = "logarithm"

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Ln of it, a pure number."""
        of = dataset[self.of]
        logarithm: xr.DataArray = xr.apply_ufunc(np.log, of.where(of > 0.0))
        note = {"comment": f"natural logarithm of {self.of} in its unit"}
        return xr.Dataset({self.name: logarithm.drop_attrs(deep=False).assign_attrs(note)})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """One over the variable."""
        of = dataset[self.of]
        return [((1.0 / of.where(of > 0.0)).fillna(0.0), {})]


def _select_sampled_variable(
    reduction: _SampleStatistic | StatusShares, dataset: xr.Dataset
) -> xr.DataArray:
    """What is reduced, without the coordinates beside its dimensions, which sums would carry."""
    of = dataset[reduction.of].reset_coords(drop=True)
    if reduction.over not in of.dims:
        rule = f"is no dimension of {reduction.of}"
        raise InvalidValue("over", reduction.over, rule, choices=map(str, of.dims))
    return of
