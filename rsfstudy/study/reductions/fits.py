"""Fits along one coordinate: slopes with their standard errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy.error_boundary import guard_methods
from rsfstudy.study.reductions.base import (
    DerivativesByVariable,
    Reduction,
    UnitFieldsBySuffix,
    dimension_of_coordinate,
    refused_result_mask,
    select_coordinate_range,
)


@guard_methods
@dataclass(frozen=True)
class LinearFit(Reduction):
    """Unweighted least squares of ``of = constant + name * on`` along one coordinate.

    Parameters
    ----------
    name : str
        Name of the slope; ``<name>_stderr`` (the standard error, which measures the misfit of the
        law), ``<name>_error`` (what the numerical errors of the cells make of it, where they have
        any), ``<name>_misfit`` (the largest misfit, in units of `of`) and ``<name>_points`` come
        with it.
    of : str
        Variable to fit.
    on : str
        Coordinate along one dimension.
    within : tuple of float
        Range of `on` that is fitted, both ends included; all of it by default.
    """

    on: str = ""
    within: tuple[float, float] | None = None
    #: Parameters of the law, and the law with the names of the fields of the fit.
    parameter_count: ClassVar[int] = 2
    formula: ClassVar[str] = "{of} = constant + {name} * {on}"
    kind: ClassVar[str] = "linear_fit"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {"": ("of", "on"), "_misfit": ("of",)}

    def centre_values(self, values: xr.DataArray, dimension: str) -> xr.DataArray:
        """Values as they enter a fit through the origin: less their mean, which takes care of the
        constant.
        """
        return values - values.mean(dimension)

    def support_status(self, status: xr.DataArray) -> xr.DataArray:
        """The points in range."""
        return select_coordinate_range(status, self.on, self.within)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Fit along the dimension of `on`, for each point of the others; nothing where no point is
        in range.

        Raises
        ------
        InvalidValue
            Where `on` is no coordinate along one dimension.
        """
        dimension = dimension_of_coordinate(dataset, self.on)
        support = select_coordinate_range(dataset, self.on, self.within)
        if support.sizes[dimension] == 0:
            return xr.Dataset()
        x, y = self._centred_fit_coordinates(support)
        count = y.notnull().sum(dimension)
        slope = (x * y).sum(dimension) / (x**2).sum(dimension)
        misfit = y - slope * x
        freedom = count - self.parameter_count
        spread = (misfit**2).sum(dimension) / freedom.where(freedom > 0)
        error = (spread / (x**2).sum(dimension)) ** 0.5
        largest = abs(misfit).max(dimension)
        known = (count >= self.parameter_count) & ~refused_result_mask(support, self.of, dimension)
        found = {
            "": slope.where(known),
            "_stderr": error.where(known),
            "_misfit": largest.where(known),
            "_points": count.astype("int32"),
        }
        span = "all {on}" if self.within is None else "{0:g} <= {on} <= {1:g}"
        span = span.format(*(self.within or ()), on=self.on)
        law = self.formula.format(**vars(self))
        result = self.results(f"least squares of {law} over {span}", found)
        return result.drop_vars([c for c in result.coords if dimension in result[c].dims])

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """The weights of least squares."""
        x, _y = self._centred_fit_coordinates(
            select_coordinate_range(dataset, self.on, self.within)
        )
        return [((x / (x**2).sum(dimension_of_coordinate(dataset, self.on))).fillna(0.0), {})]

    def _centred_fit_coordinates(
        self, selected_points: xr.Dataset
    ) -> tuple[xr.DataArray, xr.DataArray]:
        """Both coordinates of the points as they enter a fit through the origin; NaN for those
        without a number.
        """
        dimension, of = dimension_of_coordinate(selected_points, self.on), selected_points[self.of]
        # sums over arrays with another memory layout differ in the last bit
        of = of.copy(data=np.ascontiguousarray(of.values))
        x = self.transform_abscissa(selected_points[self.on].astype(float))
        y = self.transform_ordinate(of).where(x.notnull())
        return self.centre_values(x.where(y.notnull()), dimension), self.centre_values(y, dimension)

    def transform_ordinate(self, values: xr.DataArray) -> xr.DataArray:
        """Values less what the law holds fixed."""
        return values

    def transform_abscissa(self, on: xr.DataArray) -> xr.DataArray:
        """Abscissa in which the law is linear."""
        return on


@guard_methods
@dataclass(frozen=True)
class ProportionalFit(LinearFit):
    """Least squares of ``of - minus = name * on``, without intercept; `minus` is the value of `of`
    at the origin. With one, as in V0/V_* - 1, the slope is that of numbers without dimension.
    """

    minus: float = 0.0
    parameter_count: ClassVar[int] = 1
    kind: ClassVar[str] = "proportional_fit"
    formula: ClassVar[str] = "{of} = {minus:g} + {name} * {on}"

    def centre_values(self, values: xr.DataArray, dimension: str) -> xr.DataArray:
        """As they are: the line goes through the origin."""
        return values

    def transform_ordinate(self, values: xr.DataArray) -> xr.DataArray:
        """Values less the value at the origin."""
        return values - self.minus


@guard_methods
@dataclass(frozen=True)
class SemilogFit(LinearFit):
    """Least squares of ``of = constant + name * log10(on)``: the slope per decade. Points where
    `on` is 0 or less are left out. Of a power law see `PowerLaw`, not this of a `Logarithm`, which
    is natural: that slope is 2.303 times the exponent.
    """

    kind: ClassVar[str] = "decade_fit"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {"": ("of",)}
    formula: ClassVar[str] = "{of} = constant + {name} * log10({on})"

    def transform_abscissa(self, on: xr.DataArray) -> xr.DataArray:
        """The decimal logarithm."""
        logarithms: xr.DataArray = xr.apply_ufunc(np.log10, on.where(on > 0.0))
        return logarithms


@guard_methods
@dataclass(frozen=True)
class PowerLaw(SemilogFit):
    """Least squares of ``log10(of) = constant + name * log10(on)``: the exponent of a power law,
    with its largest misfit in decades. Points where either is 0 or less are left out.
    """

    kind: ClassVar[str] = "power_law"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {}
    formula: ClassVar[str] = "log10({of}) = constant + {name} * log10({on})"

    def transform_ordinate(self, values: xr.DataArray) -> xr.DataArray:
        """The decimal logarithm."""
        return self.transform_abscissa(values)

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """The weights of least squares, over ``ln(10) of``."""
        of = select_coordinate_range(dataset[self.of], self.on, self.within)
        ((weights, place),) = super().derivatives(dataset)
        return [((weights / (np.log(10.0) * of)).where(weights != 0.0, 0.0), place)]
