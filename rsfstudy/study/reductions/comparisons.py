"""Comparisons: with a reference point of the lattice, among points, and with a closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.slider import CLOSED_FORMS
from rsfstudy.study.reductions.base import (
    DerivativesByVariable,
    Reduction,
    UnitFieldsBySuffix,
    dimension_of_coordinate,
    refused_result_mask,
    select_coordinate_range,
)

ValueAndReferenceDerivatives = tuple[xr.DataArray, xr.DataArray]


@guard_methods
@dataclass(frozen=True)
class Difference(Reduction):
    """Difference of a variable above its value at a reference point: ``of - of_reference``.

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
    kind: ClassVar[str] = "difference"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {"": ("of",)}
    formula: ClassVar[str] = "{of} less {reference}"

    def compare(self, values: xr.DataArray, reference: xr.DataArray) -> xr.DataArray:
        """The comparison: of - of_reference."""
        return values - reference

    def partial_derivatives(
        self, values: xr.DataArray, reference: xr.DataArray
    ) -> ValueAndReferenceDerivatives:
        """Derivatives of the comparison by the value and by the reference: 1 and -1."""
        return xr.ones_like(values), -xr.ones_like(values)

    def support_status(self, status: xr.DataArray) -> xr.DataArray:
        """The point itself and the reference: where one failed, there is nothing to compare."""
        reference = status.sel({self.along: self.reference}, drop=True)
        return status.where(status >= reference, reference)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare along `along`; nothing if the lattice has no reference point."""
        values = dataset[self.of]
        if self.along not in values.dims or self.reference not in dataset[self.along].values:
            return xr.Dataset()
        compared = self.compare(values, values.sel({self.along: self.reference}, drop=True))
        place = f"{self.along} = {self.reference}"
        note = self.formula.format(of=self.of, reference=f"its value at {place}")
        return xr.Dataset({self.name: compared.assign_attrs(comment=note)})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """By the cell and by the reference; where they are one, the result is the same whatever it
        is.
        """
        values, place = dataset[self.of], {self.along: self.reference}
        own, others = self.partial_derivatives(values, values.sel(place, drop=True))
        apart = dataset[self.along] != self.reference
        return [(own.where(apart, 0.0), {}), (others.where(apart, 0.0), place)]


@guard_methods
@dataclass(frozen=True)
class RelativeDifference(Difference):
    """Difference of a variable below its value at a reference point: ``1 - of/of_reference``."""

    kind: ClassVar[str] = "relative_difference"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {}
    formula: ClassVar[str] = "1 - {of} over {reference}"

    def compare(self, values: xr.DataArray, reference: xr.DataArray) -> xr.DataArray:
        """1 - of/of_reference."""
        return 1.0 - values / reference

    def partial_derivatives(
        self, values: xr.DataArray, reference: xr.DataArray
    ) -> ValueAndReferenceDerivatives:
        """-1/of_reference and of/of_reference^2."""
        return -xr.ones_like(values) / reference, values / reference**2


@guard_methods
@dataclass(frozen=True)
class Range(Reduction):
    """Largest less least value along a dimension, of two at least.

    Parameters
    ----------
    name : str
        Name of the result.
    of : str
        Variable to reduce.
    over : str
        The dimension, or a coordinate of numbers along one.
    within : tuple of float
        Part of that coordinate, both ends included; all of it by default.
    """

    over: str = ""
    within: tuple[float, float] | None = None
    kind: ClassVar[str] = "range"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {"": ("of",)}

    def support_status(self, status: xr.DataArray) -> xr.DataArray:
        """The points in range."""
        return select_coordinate_range(status, self.over, self.within)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Reduce along the dimension; nothing where fewer than two points are in range."""
        dimension, support = self._select_points_in_range(dataset)
        if support.sizes[dimension] < 2:
            return xr.Dataset()
        of = support[self.of].reset_coords(drop=True)
        known = ~refused_result_mask(support, self.of, dimension) & (
            of.notnull().sum(dimension) > 1
        )
        found = (of.max(dimension) - of.min(dimension)).where(known)
        span = "" if self.within is None else " from {:g} to {:g}".format(*self.within)
        note = f"largest less least {self.of} over {self.over}{span}"
        return xr.Dataset({self.name: found.assign_attrs(comment=note)})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """1 by the cell that, within its error, may be the largest, -1 by that which may be the
        least: the sizes of both count.
        """
        dimension, support = self._select_points_in_range(dataset)
        values, errors = support[self.of], support[f"{self.of}_error"]
        number = support[dimension].copy(data=np.arange(support.sizes[dimension]))
        reaches = [(sign * values + errors.fillna(np.inf)).fillna(-np.inf) for sign in (1.0, -1.0)]
        return [((number == reach.argmax(dimension)).astype(float), {}) for reach in reaches]

    def _select_points_in_range(self, dataset: xr.Dataset) -> tuple[str, xr.Dataset]:
        """The dimension, and the points in range."""
        along = self.over in dataset[self.of].dims
        dimension = self.over if along else dimension_of_coordinate(dataset, self.over)
        return dimension, select_coordinate_range(dataset, self.over, self.within)


@guard_methods
@dataclass(frozen=True)
class ClosedFormRatio(Reduction):
    """A variable over a published closed form.

    Parameters
    ----------
    name : str
        Name of the ratio; ``<name>_closed_form``, the closed form itself, comes with it.
    of : str
        Variable to compare.
    form : str
        Name in `rsfstudy.slider.closed_forms`.
    """

    form: str = ""
    kind: ClassVar[str] = "over_closed_form"
    unit_fields: ClassVar[UnitFieldsBySuffix] = {"_closed_form": ("of",)}

    def __post_init__(self) -> None:
        if self.form not in CLOSED_FORMS:
            raise InvalidValue("form", self.form, "is no closed form", choices=CLOSED_FORMS)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare in every cell; nothing where the lattice lacks a field of the formula."""
        form = CLOSED_FORMS[self.form]
        if not all(name in dataset.coords for name in form.scene_field_names):
            return xr.Dataset()
        exact = self._evaluate_closed_form(dataset)
        note = f"{form.formula}: {form.literature_citation}"
        ratio = (dataset[self.of] / exact).assign_attrs(comment=f"{self.of} over {note}")
        beside = {f"{self.name}_closed_form": exact.assign_attrs(comment=note)}
        return xr.Dataset({self.name: ratio, **beside})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """One over the closed form."""
        return [(1.0 / self._evaluate_closed_form(dataset), {})]

    def _evaluate_closed_form(self, dataset: xr.Dataset) -> xr.DataArray:
        form = CLOSED_FORMS[self.form]
        fields = [dataset[name].astype(float) for name in form.scene_field_names]
        exact: xr.DataArray = xr.apply_ufunc(form.function, *fields, vectorize=True)
        return exact
