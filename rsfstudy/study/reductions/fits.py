"""Least-squares fits along one coordinate.

The result of a fit is the slope with its standard error. ``LinearFit`` is the base class of the
other fits, which transform the coordinate or the variable.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr

from rsfstudy._deprecation import accept_former_keyword_names, add_former_member_names
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.study.reductions.base import (
    DerivativesAndCellCoordinates,
    FieldsDeterminingUnitsByResultSuffix,
    Reduction,
    depends_on_failed_cells,
    find_dimension_of_coordinate,
    select_coordinate_range,
)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class LinearFit(Reduction):
    """Linear fit of a variable along one coordinate.

    The equation ``variable = constant + slope * coordinate`` is fitted by unweighted least squares.

    Parameters
    ----------
    name : str
        Name of the slope. Four more variables are returned: the standard error of the slope
        ``<name>_stderr``, the propagated numerical error of the cells ``<name>_error`` (if the
        cells have error estimates), the largest absolute residual ``<name>_misfit`` in the units of
        the variable, and the number of points ``<name>_points``. The standard error is computed
        from the residuals.
    of : str
        Name of the variable to fit.
    on : str
        Name of a one-dimensional coordinate.
    within : tuple of (float, float), optional
        Range of coordinate values that are fitted, including both ends. By default, all values of
        the coordinate are fitted.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import LinearFit
    >>> dataset = xr.Dataset(
    ...     {"drop": ("phi", [1.0, 3.0, 5.0]), "status": ("phi", [0, 0, 0])},
    ...     coords={"phi": [45.0, 46.0, 47.0]},
    ... )
    >>> fit = LinearFit(name="slope", of="drop", on="phi")(dataset)
    >>> float(fit["slope"]), int(fit["slope_points"])
    (2.0, 3)
    """

    on: str = ""
    within: tuple[float, float] | None = None
    #: Number of fitted parameters, followed by a template of the fitted equation. The placeholders
    #: are field names of the fit.
    fitted_parameter_count: ClassVar[int] = 2
    formula_template: ClassVar[str] = "{of} = constant + {name} * {on}"
    #: Template of an explanation of the slope, which is appended to the attribute ``comment``.
    _slope_note_template: ClassVar[str] = ""
    kind: ClassVar[str] = "linear_fit"
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {
        "": ("of", "on"),
        "_misfit": ("of",),
    }

    def centre_values(self, values: xr.DataArray, dimension: str) -> xr.DataArray:
        """Subtract the mean of the values, so that the fit needs no constant term.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the transformed coordinate or variable.
        dimension : str
            Dimension along which the variable is fitted.

        Returns
        -------
        xarray.DataArray
            Centred values.
        """
        return values - values.mean(dimension)

    def get_status_of_used_cells(self, status: xr.DataArray) -> xr.DataArray:
        """Return the status of the cells in the fitted range of the coordinate.

        Parameters
        ----------
        status : xarray.DataArray
            Status codes of all cells.

        Returns
        -------
        xarray.DataArray
            Status codes of the cells on which the results depend.
        """
        return select_coordinate_range(status, self.on, self.within)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Fit the variable separately for each point along the other dimensions.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Slope, standard error, largest residual and number of points. The dataset is empty if
            there are no points in the range. The propagated error ``<name>_error`` is added by
            ``apply_reductions``.

        Raises
        ------
        InvalidValue
            If ``on`` is not a one-dimensional numeric coordinate.
        """
        dimension = find_dimension_of_coordinate(dataset, self.on)
        support = select_coordinate_range(dataset, self.on, self.within)
        if support.sizes[dimension] == 0:
            return xr.Dataset()
        x, y = self._compute_centred_abscissa_and_ordinate(support)
        count = y.notnull().sum(dimension)
        slope = (x * y).sum(dimension) / (x**2).sum(dimension)
        misfit = y - slope * x
        freedom = count - self.fitted_parameter_count
        spread = (misfit**2).sum(dimension) / freedom.where(freedom > 0)
        error = (spread / (x**2).sum(dimension)) ** 0.5
        largest = abs(misfit).max(dimension)
        known = (count >= self.fitted_parameter_count) & ~depends_on_failed_cells(
            support, self.of, dimension
        )
        found = {
            "": slope.where(known),
            "_stderr": error.where(known),
            "_misfit": largest.where(known),
            "_points": count.astype("int32"),
        }
        span = "all {on}" if self.within is None else "{0:g} <= {on} <= {1:g}"
        span = span.format(*(self.within or ()), on=self.on)
        law = self.formula_template.format(**vars(self))
        note = self._slope_note_template.format(**vars(self))
        result = self.results(f"least-squares fit of {law} for {span}{note}", found)
        return result.drop_vars([c for c in result.coords if dimension in result[c].dims])

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the slope with respect to the cell values.

        The slope is a linear combination of the values, and the derivatives are the coefficients.

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
        x, _y = self._compute_centred_abscissa_and_ordinate(
            select_coordinate_range(dataset, self.on, self.within)
        )
        return [((x / (x**2).sum(find_dimension_of_coordinate(dataset, self.on))).fillna(0.0), {})]

    def _compute_centred_abscissa_and_ordinate(
        self, selected_points: xr.Dataset
    ) -> tuple[xr.DataArray, xr.DataArray]:
        """Transform and centre the coordinate and the variable of the fit.

        Points without a value are NaN.
        """
        dimension, of = (
            find_dimension_of_coordinate(selected_points, self.on),
            selected_points[self.of],
        )
        # The array is made contiguous, because sums over arrays with another memory layout differ
        # in the last bit.
        of = of.copy(data=np.ascontiguousarray(of.values))
        x = self.transform_abscissa(selected_points[self.on].astype(float))
        y = self.transform_ordinate(of).where(x.notnull())
        return self.centre_values(x.where(y.notnull()), dimension), self.centre_values(y, dimension)

    def transform_ordinate(self, values: xr.DataArray) -> xr.DataArray:
        """Transform the variable before the fit.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the variable.

        Returns
        -------
        xarray.DataArray
            Unchanged values.
        """
        return values

    def transform_abscissa(self, coordinate_values: xr.DataArray) -> xr.DataArray:
        """Transform the coordinate before the fit.

        Parameters
        ----------
        coordinate_values : xarray.DataArray
            Values of the coordinate.

        Returns
        -------
        xarray.DataArray
            Unchanged values.
        """
        return coordinate_values


@accept_former_keyword_names
@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class ProportionalFit(LinearFit):
    """Linear fit with a fixed intercept.

    The equation ``variable = intercept + slope * coordinate`` is fitted by unweighted least
    squares. If the intercept is not 0, the variable and the slope are assumed to be dimensionless.
    An example is the velocity ratio ``V_0/V_*``, with an intercept of 1.

    Parameters
    ----------
    name : str
        Name of the slope.
    of : str
        Name of the variable to fit.
    on : str
        Name of a one-dimensional coordinate.
    within : tuple of (float, float), optional
        Range of coordinate values that are fitted, including both ends. By default, all values of
        the coordinate are fitted.
    intercept : float, default: 0.0
        Value of the variable at the origin of the coordinate.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import ProportionalFit
    >>> dataset = xr.Dataset(
    ...     {"step": ("ratio", [1.5, 2.0]), "status": ("ratio", [0, 0])},
    ...     coords={"ratio": [1.0, 2.0]},
    ... )
    >>> fit = ProportionalFit(name="zeta", of="step", on="ratio", intercept=1.0)
    >>> float(fit(dataset)["zeta"])
    0.5
    """

    intercept: float = 0.0
    fitted_parameter_count: ClassVar[int] = 1
    kind: ClassVar[str] = "proportional_fit"
    formula_template: ClassVar[str] = "{of} = {intercept:g} + {name} * {on}"

    def centre_values(self, values: xr.DataArray, dimension: str) -> xr.DataArray:
        """Return the values unchanged, because the intercept is fixed.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the transformed coordinate or variable.
        dimension : str
            Dimension along which the variable is fitted.

        Returns
        -------
        xarray.DataArray
            Unchanged values.
        """
        return values

    def transform_ordinate(self, values: xr.DataArray) -> xr.DataArray:
        """Subtract the intercept from the variable.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the variable.

        Returns
        -------
        xarray.DataArray
            Values minus the intercept.
        """
        return values - self.intercept


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class SemilogFit(LinearFit):
    """Linear fit of a variable against the decimal logarithm of a coordinate.

    The equation ``variable = constant + slope * log10(coordinate)`` is fitted by unweighted least
    squares. The slope is the change in the variable per decade. A slope per unit of the natural
    logarithm is smaller by a factor of ln(10) = 2.303. Points are omitted if the coordinate is not
    positive. To fit a power law, use `PowerLaw`. The result of `Logarithm` is a natural logarithm.
    If you apply `SemilogFit` to this result, the slope is therefore 2.303 times the exponent of the
    power law.

    Parameters
    ----------
    name : str
        Name of the slope.
    of : str
        Name of the variable to fit.
    on : str
        Name of a one-dimensional coordinate.
    within : tuple of (float, float), optional
        Range of coordinate values that are fitted, including both ends. By default, all values of
        the coordinate are fitted.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import SemilogFit
    >>> dataset = xr.Dataset(
    ...     {"drop": ("hold_time", [1.0, 3.0, 5.0]), "status": ("hold_time", [0, 0, 0])},
    ...     coords={"hold_time": [1.0, 10.0, 100.0]},
    ... )
    >>> fit = SemilogFit(name="slope", of="drop", on="hold_time")(dataset)
    >>> round(float(fit["slope"]), 6)
    2.0
    """

    kind: ClassVar[str] = "decade_fit"
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {"": ("of",)}
    formula_template: ClassVar[str] = "{of} = constant + {name} * log10({on})"
    _slope_note_template: ClassVar[str] = "; the slope is the change of {of} per decade of {on}"

    def transform_abscissa(self, coordinate_values: xr.DataArray) -> xr.DataArray:
        """Compute the decimal logarithm of the coordinate.

        Parameters
        ----------
        coordinate_values : xarray.DataArray
            Values of the coordinate.

        Returns
        -------
        xarray.DataArray
            Decimal logarithm. NaN if the value is not positive.
        """
        logarithms: xr.DataArray = xr.apply_ufunc(
            np.log10, coordinate_values.where(coordinate_values > 0.0)
        )
        return logarithms


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class PowerLaw(SemilogFit):
    """Fit of a power law to a variable as a function of a coordinate.

    The equation ``log10(variable) = constant + exponent * log10(coordinate)`` is fitted by
    unweighted least squares. The result is the exponent of the power law. The largest residual is
    reported in decades. Points are omitted if the coordinate or the variable is not positive.

    Parameters
    ----------
    name : str
        Name of the exponent.
    of : str
        Name of the variable to fit.
    on : str
        Name of a one-dimensional coordinate.
    within : tuple of (float, float), optional
        Range of coordinate values that are fitted, including both ends. By default, all values of
        the coordinate are fitted.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import PowerLaw
    >>> dataset = xr.Dataset(
    ...     {"interval": ("rate", [8.0, 4.0, 2.0]), "status": ("rate", [0, 0, 0])},
    ...     coords={"rate": [1.0, 2.0, 4.0]},
    ... )
    >>> fit = PowerLaw(name="exponent", of="interval", on="rate")(dataset)
    >>> round(float(fit["exponent"]), 6)
    -1.0
    """

    kind: ClassVar[str] = "power_law"
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {}
    formula_template: ClassVar[str] = "log10({of}) = constant + {name} * log10({on})"
    _slope_note_template: ClassVar[str] = "; the slope is the exponent of the power law"

    def transform_ordinate(self, values: xr.DataArray) -> xr.DataArray:
        """Compute the decimal logarithm of the variable.

        Parameters
        ----------
        values : xarray.DataArray
            Values of the variable.

        Returns
        -------
        xarray.DataArray
            Decimal logarithm. NaN if the value is not positive.
        """
        return self.transform_abscissa(values)

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the exponent with respect to the cell values.

        The derivatives are the coefficients of the linear fit, divided by ln(10) and by the value
        of the variable.

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
        of = select_coordinate_range(dataset[self.of], self.on, self.within)
        ((weights, place),) = super().derivatives(dataset)
        return [((weights / (np.log(10.0) * of)).where(weights != 0.0, 0.0), place)]
