"""Reductions that compare the values of a variable.

A variable is compared with its value at a reference point, with its other values along a dimension,
or with a closed-form solution.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.slider import CLOSED_FORMS
from rsfstudy.study.reductions.base import (
    DerivativesAndCellCoordinates,
    FieldsDeterminingUnitsByResultSuffix,
    Reduction,
    depends_on_failed_cells,
    find_dimension_of_coordinate,
    select_coordinate_range,
)

DerivativesWrtValueAndReference = tuple[xr.DataArray, xr.DataArray]


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Difference(Reduction):
    """Difference between a variable and its value at a reference point.

    The result is ``of - of_reference``.

    Parameters
    ----------
    name : str
        Name of the result, which is ``of - of_reference``.
    of : str
        Name of the variable to compare.
    along : str
        Dimension along which the reference point is selected.
    reference : str or float
        Coordinate value of the reference point on the dimension ``along``.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Difference
    >>> dataset = xr.Dataset(
    ...     {"drop": ("law", [2.0, 5.0]), "status": ("law", [0, 0])},
    ...     coords={"law": ["slip", "slowness"]},
    ... )
    >>> excess = Difference(name="excess", of="drop", along="law", reference="slip")
    >>> excess(dataset)["excess"].values.tolist()
    [0.0, 3.0]
    """

    along: str = ""
    reference: str | float = ""
    kind: ClassVar[str] = "difference"
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {"": ("of",)}
    formula_template: ClassVar[str] = "{of} minus {reference}"

    def compute_difference(self, values: xr.DataArray, reference: xr.DataArray) -> xr.DataArray:
        """Subtract the reference from the values.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the variable.
        reference : xarray.DataArray
            Value of the variable at the reference point.

        Returns
        -------
        xarray.DataArray
            Difference.
        """
        return values - reference

    def compute_partial_derivatives(
        self, values: xr.DataArray, reference: xr.DataArray
    ) -> DerivativesWrtValueAndReference:
        """Compute the derivatives of the result with respect to value and reference.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the variable.
        reference : xarray.DataArray
            Value of the variable at the reference point.

        Returns
        -------
        by_value : xarray.DataArray
            Derivative with respect to ``values``, equal to 1.
        by_reference : xarray.DataArray
            Derivative with respect to ``reference``, equal to -1.
        """
        return xr.ones_like(values), -xr.ones_like(values)

    def get_status_of_used_cells(self, status: xr.DataArray) -> xr.DataArray:
        """Combine the status of each point with the status of the reference point.

        Parameters
        ----------
        status : xarray.DataArray
            Status codes of all cells.

        Returns
        -------
        xarray.DataArray
            Status codes of the cells on which the results depend.
        """
        reference = status.sel({self.along: self.reference}, drop=True)
        return status.where(status >= reference, reference)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compare each value with the value at the reference point.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Result of the comparison. The dataset is empty if the lattice has no reference point.
        """
        values = dataset[self.of]
        if self.along not in values.dims or self.reference not in dataset[self.along].values:
            return xr.Dataset()
        compared = self.compute_difference(
            values, values.sel({self.along: self.reference}, drop=True)
        )
        place = f"{self.along} = {self.reference}"
        note = self.formula_template.format(of=self.of, reference=f"its value at {place}")
        return xr.Dataset({self.name: compared.assign_attrs(comment=note)})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the result.

        At the reference point, the derivatives are 0 because the result does not depend on the
        value at this point.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and the position of the cells, as described in
            `Reduction.derivatives`.
        """
        values, place = dataset[self.of], {self.along: self.reference}
        own, others = self.compute_partial_derivatives(values, values.sel(place, drop=True))
        apart = dataset[self.along] != self.reference
        return [(own.where(apart, 0.0), {}), (others.where(apart, 0.0), place)]


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class RelativeDifference(Difference):
    """Relative difference between a variable and its reference value.

    The result is ``1 - of/of_reference``. The result is positive if the value is smaller than the
    reference.

    Parameters
    ----------
    name : str
        Name of the result, which is ``1 - of/of_reference``.
    of : str
        Name of the variable to compare.
    along : str
        Dimension along which the reference point is selected.
    reference : str or float
        Coordinate value of the reference point on the dimension ``along``.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import RelativeDifference
    >>> dataset = xr.Dataset(
    ...     {"drop": ("law", [4.0, 3.0]), "status": ("law", [0, 0])},
    ...     coords={"law": ["slip", "slowness"]},
    ... )
    >>> lowering = RelativeDifference("lowering", of="drop", along="law", reference="slip")
    >>> lowering(dataset)["lowering"].values.tolist()
    [0.0, 0.25]
    """

    kind: ClassVar[str] = "relative_difference"
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {}
    formula_template: ClassVar[str] = "1 - {of} / {reference}"

    def compute_difference(self, values: xr.DataArray, reference: xr.DataArray) -> xr.DataArray:
        """Compute the relative difference.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the variable.
        reference : xarray.DataArray
            Value of the variable at the reference point.

        Returns
        -------
        xarray.DataArray
            Relative difference, ``1 - values / reference``.
        """
        return 1.0 - values / reference

    def compute_partial_derivatives(
        self, values: xr.DataArray, reference: xr.DataArray
    ) -> DerivativesWrtValueAndReference:
        """Compute the derivatives of the result with respect to value and reference.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the variable.
        reference : xarray.DataArray
            Value of the variable at the reference point.

        Returns
        -------
        by_value : xarray.DataArray
            Derivative with respect to ``values``, equal to ``-1 / reference``.
        by_reference : xarray.DataArray
            Derivative with respect to ``reference``, equal to ``values / reference**2``.
        """
        return -xr.ones_like(values) / reference, values / reference**2


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Range(Reduction):
    """Difference between the largest and the smallest value along a dimension.

    Parameters
    ----------
    name : str
        Name of the result.
    of : str
        Name of the variable to reduce.
    over : str
        Dimension to reduce, or a numeric coordinate along this dimension.
    within : tuple of (float, float), optional
        Range of the coordinate ``over``, including both ends. By default, all values of the
        coordinate are included.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Range
    >>> dataset = xr.Dataset(
    ...     {"drop": ("phi", [2.0, 5.0, 9.0]), "status": ("phi", [0, 0, 0])},
    ...     coords={"phi": [45.0, 60.0, 75.0]},
    ... )
    >>> spread = Range(name="spread", of="drop", over="phi", within=(45, 60))
    >>> float(spread(dataset)["spread"])
    3.0
    """

    over: str = ""
    within: tuple[float, float] | None = None
    kind: ClassVar[str] = "range"
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {"": ("of",)}

    def get_status_of_used_cells(self, status: xr.DataArray) -> xr.DataArray:
        """Return the status of the cells inside the coordinate range (``within``).

        Parameters
        ----------
        status : xarray.DataArray
            Status codes of all cells.

        Returns
        -------
        xarray.DataArray
            Status codes of the cells on which the results depend.
        """
        return select_coordinate_range(status, self.over, self.within)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the range of the values along the dimension.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Range of the values. The dataset is empty if there are fewer than two points. The range
            is NaN if fewer than two points have a value, or if a cell failed.

        Raises
        ------
        InvalidValue
            If ``over`` is neither a dimension of the variable nor a one-dimensional numeric
            coordinate.
        """
        dimension, support = self._select_points_in_range(dataset)
        if support.sizes[dimension] < 2:
            return xr.Dataset()
        of = support[self.of].reset_coords(drop=True)
        known = ~depends_on_failed_cells(support, self.of, dimension) & (
            of.notnull().sum(dimension) > 1
        )
        found = (of.max(dimension) - of.min(dimension)).where(known)
        span = "" if self.within is None else " from {:g} to {:g}".format(*self.within)
        note = f"largest minus smallest {self.of} along {self.over}{span}"
        return xr.Dataset({self.name: found.assign_attrs(comment=note)})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the range.

        The derivative is 1 for the cell whose value plus error is largest, and for the cell whose
        value minus error is smallest. The sign of a derivative has no influence on the propagated
        error.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and the position of the cells, as described in
            `Reduction.derivatives`.
        """
        dimension, support = self._select_points_in_range(dataset)
        values, errors = support[self.of], support[f"{self.of}_error"]
        number = support[dimension].copy(data=np.arange(support.sizes[dimension]))
        reaches = [(sign * values + errors.fillna(np.inf)).fillna(-np.inf) for sign in (1.0, -1.0)]
        return [((number == reach.argmax(dimension)).astype(float), {}) for reach in reaches]

    def _select_points_in_range(self, dataset: xr.Dataset) -> tuple[str, xr.Dataset]:
        """Return the dimension to reduce, and the dataset restricted to the coordinate range."""
        along = self.over in dataset[self.of].dims
        dimension = self.over if along else find_dimension_of_coordinate(dataset, self.over)
        return dimension, select_coordinate_range(dataset, self.over, self.within)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class ClosedFormRatio(Reduction):
    """Ratio of a variable to a published closed-form solution.

    Parameters
    ----------
    name : str
        Name of the ratio. The closed-form solution is returned as ``<name>_closed_form``.
    of : str
        Name of the variable to compare.
    form : str
        Name of the solution in ``rsfstudy.slider.CLOSED_FORMS``, such as ``"displacement_step"``.

    Raises
    ------
    InvalidValue
        If there is no closed-form solution with this name.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import ClosedFormRatio
    >>> dataset = xr.Dataset(
    ...     {"critical_displacement": ("b_over_a", [1.1, 0.5]), "status": ("b_over_a", [0, 0])},
    ...     coords={"b_over_a": [2.0, 3.0]},
    ... )
    >>> ratio = ClosedFormRatio("ratio", of="critical_displacement", form="displacement_step")
    >>> ratio(dataset)["ratio"].values.round(6).tolist()
    [1.1, 1.0]
    """

    form: str = ""
    kind: ClassVar[str] = "over_closed_form"
    long_names: ClassVar[Mapping[str, str]] = {
        "": "ratio of {of} to its closed-form value",
        "_closed_form": "closed-form value of {of}",
        "_error": "numerical error estimate of the ratio of {of} to its closed-form value",
    }
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {
        "_closed_form": ("of",)
    }

    def __post_init__(self) -> None:
        """Check that the closed-form solution exists."""
        if self.form not in CLOSED_FORMS:
            raise InvalidValue(
                "form", self.form, "is not a closed-form solution", choices=CLOSED_FORMS
            )

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the ratio in each cell.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Ratio and closed-form solution. The dataset is empty if a parameter of the closed-form
            solution is not a coordinate of the dataset.
        """
        form = CLOSED_FORMS[self.form]
        if not all(name in dataset.coords for name in form.scene_field_names):
            return xr.Dataset()
        exact = self._evaluate_closed_form(dataset)
        note = f"{form.formula_text}: {form.literature_citation}"
        ratio = (dataset[self.of] / exact).assign_attrs(comment=f"{self.of} divided by {note}")
        beside = {f"{self.name}_closed_form": exact.assign_attrs(comment=note)}
        return xr.Dataset({self.name: ratio, **beside})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the ratio.

        Each derivative is the reciprocal of the closed-form solution.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and the position of the cells, as described in
            `Reduction.derivatives`.
        """
        return [(1.0 / self._evaluate_closed_form(dataset), {})]

    def _evaluate_closed_form(self, dataset: xr.Dataset) -> xr.DataArray:
        """Evaluate the closed-form solution in each cell."""
        form = CLOSED_FORMS[self.form]
        fields = [dataset[name].astype(float) for name in form.scene_field_names]
        exact: xr.DataArray = xr.apply_ufunc(form.formula_function, *fields, vectorize=True)
        return exact
