"""Base class of reductions, and functions that all reductions share.

``Reduction`` is the base class. The functions exclude failed cells, select coordinate ranges, and
propagate numerical errors from cells to results. A reduction never uses failed cells, unless its
class sets ``uses_failed_cells``.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np
import xarray as xr

from rsfstudy._deprecation import add_former_member_names, copy_former_overrides_to_new_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import (
    ConstructorKeywordCheckMixin,
    make_methods_raise_rsfstudy_errors,
)
from rsfstudy.quantities import Quantity
from rsfstudy.status import Status
from rsfstudy.vocabulary import QUANTITY_BY_NAME

DatasetOrArray = TypeVar("DatasetOrArray", xr.Dataset, xr.DataArray)

#: Pairs of two items. The first item is the derivative of a result with respect to the values of
#: some cells. The second item contains coordinates of these cells along some dimensions.
DerivativesAndCellCoordinates = Sequence[tuple[xr.DataArray, Mapping[str, Any]]]

#: Names of the reduction fields that determine the units of a result, by the suffix of the result
#: name. Each field contains the name of a variable, and the units of the result are derived from
#: the units of these variables.
FieldsDeterminingUnitsByResultSuffix = Mapping[str, Sequence[str]]

#: Value of the attribute ``comment`` of propagated errors.
PROPAGATED_ERROR_COMMENT = (
    "sum of the errors of the cells, each multiplied by the absolute value of the derivative "
    "with respect to the cell"
)
#: Suffixes of the names of variables that contain standard errors, bounds of confidence intervals,
#: covariances or correlations.
_SUFFIXES_OF_UNCERTAINTY_VARIABLES = ("_stderr", "_low", "_high", "covariance", "correlation")
#: Relative tolerance at the ends of a coordinate range. A coordinate value may differ from the end
#: of a range by rounding errors.
COORDINATE_RANGE_RTOL = 1e-9


@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Reduction(ConstructorKeywordCheckMixin):
    """Base class of all reductions.

    Calling a reduction, as in ``reduction(dataset)``, returns a dataset with the new variables. To
    write your own reduction, derive a frozen dataclass from this class. All fields other than the
    name of the result (``name``) and the variable to reduce (``of``) are options of the reduction.
    A reduction must define one method::

        __call__(self, dataset) -> xarray.Dataset

    In ``dataset``, the values of failed cells are NaN, and the variable ``status`` contains the
    status of each cell. The following class attributes and methods are optional::

        kind: ClassVar[str]
        long_names: ClassVar[Mapping[str, str]]
        fields_determining_result_units: ClassVar[Mapping[str, Sequence[str]]]
        derivatives(self, dataset) -> Sequence[tuple[xarray.DataArray, Mapping]]

    ``kind`` is the name of the reduction in files, by default the class name. ``long_names`` and
    ``fields_determining_result_units`` define the long names and the units of the results.
    ``derivatives`` returns derivatives of the result. The derivatives are used to compute
    ``<name>_error`` from the numerical errors of the cells.

    Parameters
    ----------
    name : str
        Name of the result. The names of all further results begin with ``name``.
    of : str
        Name of the variable to reduce.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Reduction
    >>> @dataclass(frozen=True)
    ... class SquareRoot(Reduction):
    ...     def __call__(self, dataset):
    ...         return self.results("square root", {"": dataset[self.of] ** 0.5})
    >>> dataset = xr.Dataset({"area": ("cell", [4.0, 9.0])})
    >>> SquareRoot(name="side", of="area")(dataset)["side"].values.tolist()
    [2.0, 3.0]
    """

    #: Name of the reduction in declarations and files. The default is the name of the class.
    kind: ClassVar[str] = "Reduction"
    #: Long names of dimensionless results, by the suffix that follows ``name`` in the name of the
    #: result. The placeholder ``{name}`` is replaced by ``name`` with spaces instead of
    #: underscores.
    long_names: ClassVar[Mapping[str, str]] = {}
    #: Fields that determine the units of the results, by the suffix that follows ``name`` in the
    #: name of the result. For ``("of",)``, the result has the units of the variable that the field
    #: ``of`` names. For ``("of", "on")``, the result has the units of the first variable divided by
    #: the units of the second variable. Results without an entry are dimensionless.
    fields_determining_result_units: ClassVar[FieldsDeterminingUnitsByResultSuffix] = {}
    #: True if the reduction also uses failed cells. All other reductions reject failed cells.
    uses_failed_cells: ClassVar[bool] = False

    name: str
    of: str

    def __init_subclass__(cls) -> None:
        """Set the default of ``kind``, and accept overrides of members under their former names."""
        super().__init_subclass__()
        copy_former_overrides_to_new_names(cls)
        if "kind" not in vars(cls) and not cls.__name__.startswith("_"):
            cls.kind = cls.__name__

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Compute the new variables.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            New variables.

        Raises
        ------
        TypeError
            If a subclass does not override this method.
        """
        raise TypeError(f"{type(self).__name__} does not define __call__")

    def results(self, comment: str, values: Mapping[str, xr.DataArray]) -> xr.Dataset:
        """Assemble a dataset of results.

        Parameters
        ----------
        comment : str
            Description of the computation, which becomes the attribute ``comment`` of all results.
        values : mapping of str to xarray.DataArray
            Results by name suffix. The suffix ``""`` stands for the result ``name`` itself.

        Returns
        -------
        xarray.Dataset
            Results with their full names.
        """
        described = {end: found.assign_attrs(comment=comment) for end, found in values.items()}
        return xr.Dataset({f"{self.name}{end}": found for end, found in described.items()})

    def get_status_of_used_cells(self, status: xr.DataArray) -> xr.DataArray:
        """Return the status of the cells on which the results depend.

        The base class returns the status of all cells. A subclass that uses only some of the cells
        overrides this method. If several cells contribute to one value of the result, the status of
        this value is the largest status code of these cells.

        Parameters
        ----------
        status : xarray.DataArray
            Status codes of all cells.

        Returns
        -------
        xarray.DataArray
            Status codes of the cells on which the results depend.
        """
        return status

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Compute the derivatives of the result with respect to the cell values.

        A subclass must override this method to propagate the numerical errors of the cells to the
        result. The base class returns no derivatives, so errors are not propagated.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and a mapping that contains the position of the cells. If the
            mapping is empty, the cells are at the same position as the result. A mapping that is
            not empty contains coordinate values of the cells along some dimensions. If a derivative
            has dimensions that the result does not have, the result depends on all cells along
            these dimensions. The derivative is 0 for cells without a value.
        """
        return ()

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantities of the results that have an entry in ``long_names``."""
        words = {"name": self.name.replace("_", " "), "of": self.of.replace("_", " ")}
        given = self.long_names.items()
        return [Quantity(f"{self.name}{end}", "", "1", t.format(**words)) for end, t in given]

    def describe(self) -> dict[str, Any]:
        """Convert the reduction to a dictionary of plain values.

        Returns
        -------
        dict of str to object
            Kind and fields of the reduction.
        """
        return {"kind": self.kind, **asdict(self)}


def is_failed_or_pending(status: xr.DataArray) -> xr.DataArray:
    """Return a mask of the cells that failed or were not computed.

    Parameters
    ----------
    status : xarray.DataArray
        Status codes of the cells.

    Returns
    -------
    xarray.DataArray
        True for cells that failed and for pending cells.
    """
    return status >= int(Status.WORK_BUDGET_SPENT)


def find_worst_status_along_other_dims(
    status: xr.DataArray, kept_dimensions: Collection[Hashable]
) -> xr.DataArray:
    """Return the largest status code over all dimensions that the result does not have.

    Failures have the largest status codes.

    Parameters
    ----------
    status : xarray.DataArray
        Status codes of the cells.
    kept_dimensions : collection of str
        Dimensions of the result.

    Returns
    -------
    xarray.DataArray
        Largest status code along all dimensions that the result does not have.
    """
    return status.max([d for d in status.dims if d not in kept_dimensions])


def set_failed_or_invalid_values_to_nan(
    dataset: xr.Dataset, variable_name: str, status: xr.DataArray
) -> xr.Dataset:
    """Set the values of failed cells, and error bounds that are invalid, to NaN.

    The values of failed cells are replaced by NaN. If the variable is a standard error or a bound
    of a confidence interval, values that are not valid are also replaced by NaN.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the cells.
    variable_name : str
        Name of the variable to reduce.
    status : xarray.DataArray
        Status of the cells on which ``variable_name`` depends. The status is added to the returned
        dataset.

    Returns
    -------
    xarray.Dataset
        Copy in which the values of failed cells and invalid error bounds are NaN.
    """
    bad = is_failed_or_pending(status)
    if variable_name.endswith(_SUFFIXES_OF_UNCERTAINTY_VARIABLES):
        bad = bad | (status == int(Status.ERRORS_NOT_VALID))
    if bool(bad.any()) and dataset[variable_name].dtype.kind == "f":
        dataset = dataset.assign({variable_name: dataset[variable_name].where(~bad)})
    return dataset.assign(status=status)


def depends_on_failed_cells(
    dataset: xr.Dataset, variable_name: str, *reduced_dimensions: str
) -> xr.DataArray:
    """Return a mask of the results that depend on failed cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of all cells of the lattice, including the variable ``status``.
    variable_name : str
        Name of the variable to reduce.
    *reduced_dimensions : str
        Dimensions along which the variable is reduced.

    Returns
    -------
    xarray.DataArray
        True if a cell failed along the reduced dimensions or along dimensions that the variable
        does not have.
    """
    bad = is_failed_or_pending(dataset["status"])
    return bad.any(
        [d for d in bad.dims if d in reduced_dimensions or d not in dataset[variable_name].dims]
    )


def set_failed_cells_to_nan(dataset: xr.Dataset) -> xr.Dataset:
    """Set the values of failed cells to NaN, and mark these cells as finished without a value.

    Pending cells are not changed.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of all cells of the lattice, including the variable ``status``.

    Returns
    -------
    xarray.Dataset
        Copy in which the values of failed cells are NaN, and the status of these cells is
        ``NO_STEP``.
    """
    lost = is_failed_or_pending(dataset["status"]) & (dataset["status"] != int(Status.PENDING))
    kept = {
        name: values.where(~lost)
        for name, values in dataset.data_vars.items()
        if values.dtype.kind == "f" and set(lost.dims) <= set(values.dims)
    }
    status = dataset["status"].where(~lost, int(Status.NO_STEP))
    return dataset.assign({**kept, "status": status})


def find_dimension_of_coordinate(dataset: xr.Dataset | xr.DataArray, coordinate_name: str) -> str:
    """Return the dimension of a one-dimensional numeric coordinate.

    Parameters
    ----------
    dataset : xarray.Dataset or xarray.DataArray
        Object with the coordinate.
    coordinate_name : str
        Name of the coordinate.

    Returns
    -------
    str
        Name of the dimension.

    Raises
    ------
    InvalidValue
        If the object has no one-dimensional coordinate with this name, or if the coordinate is not
        numeric.
    """
    if coordinate_name not in dataset.coords or dataset[coordinate_name].ndim != 1:
        choices = [
            str(n) for n, c in dataset.coords.items() if c.ndim == 1 and n != coordinate_name
        ]
        raise InvalidValue(
            "on", coordinate_name, "must be a coordinate with one dimension", choices=choices
        )
    if dataset[coordinate_name].dtype.kind not in "iuf":
        raise InvalidValue("on", coordinate_name, "must be a numeric coordinate")
    return str(dataset[coordinate_name].dims[0])


def select_coordinate_range(
    dataset: DatasetOrArray, coordinate_name: str, coordinate_range: tuple[float, float] | None
) -> DatasetOrArray:
    """Select the points within a range of a coordinate.

    Parameters
    ----------
    dataset : xarray.Dataset or xarray.DataArray
        Object to select from.
    coordinate_name : str
        Name of the coordinate.
    coordinate_range : tuple of (float, float) or None
        Lowest and highest value of the range. Both ends are included, with a tolerance for rounding
        errors. None selects all points.

    Returns
    -------
    xarray.Dataset or xarray.DataArray
        Selected points. If the object does not have the coordinate, the object is returned
        unchanged.
    """
    if coordinate_range is None or coordinate_name not in dataset.coords:
        return dataset
    values, (lowest, highest) = dataset[coordinate_name].values, coordinate_range
    inside = (values >= lowest - COORDINATE_RANGE_RTOL * abs(lowest)) & (
        values <= highest + COORDINATE_RANGE_RTOL * abs(highest)
    )
    return dataset.isel(
        {find_dimension_of_coordinate(dataset, coordinate_name): np.flatnonzero(inside)}
    )


def read_quantities_not_in_vocabulary(dataset: xr.Dataset) -> dict[str, Quantity]:
    """Build quantities for the variables that are not in the vocabulary.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset whose variables have the attributes ``long_name``, ``units``, ``symbol`` and
        ``scale``.

    Returns
    -------
    dict of str to Quantity
        Quantities by variable name. The dictionary contains the variables that have no entry in the
        vocabulary, or whose long name or units differ from the vocabulary. Variables without a long
        name are omitted.
    """
    return {
        str(name): Quantity(
            str(name),
            str(values.attrs.get("symbol", ""))
            or _find_symbol_after_unit_conversion(str(name), values.attrs),
            str(values.attrs.get("units", "1")),
            str(values.attrs["long_name"]),
            str(values.attrs.get("scale", "")),
        )
        for name, values in dataset.variables.items()
        if values.attrs.get("long_name") and not _is_in_vocabulary(str(name), values.attrs)
    }


def _find_symbol_after_unit_conversion(
    variable_name: str, variable_attributes: Mapping[Any, Any]
) -> str:
    """Return the vocabulary symbol of a variable whose units have been converted.

    If the vocabulary quantity is dimensionless, the function returns an empty string. The symbol of
    a normalised quantity is a quotient, which would be wrong for a variable with units.
    """
    about = QUANTITY_BY_NAME.get(variable_name)
    same = about is not None and variable_attributes["long_name"] == about.long_name
    return about.symbol if about and same and about.units not in ("", "1") else ""


def _is_in_vocabulary(variable_name: str, variable_attributes: Mapping[Any, Any]) -> bool:
    """Return True if the vocabulary has the long name and units of a variable."""
    about = QUANTITY_BY_NAME.get(variable_name)
    if about is None or variable_attributes["long_name"] != about.long_name:
        return False
    return bool(variable_attributes.get("units", about.units) == about.units)


# ---- numerical errors ----------------------------------------------------------------------------


def add_propagated_errors(
    reduction: Reduction, dataset: xr.Dataset, reduction_results: xr.Dataset
) -> xr.Dataset:
    r"""Propagate the numerical errors of cells to the result of a reduction.

    If the reduction has already computed its own error, the propagated error is added to this
    error. No errors are propagated if the reduced variable has no error estimates or if the
    reduction has no derivatives.

    Parameters
    ----------
    reduction : Reduction
        Reduction that computed the results.
    dataset : xarray.Dataset
        Dataset to which the reduction was applied.
    reduction_results : xarray.Dataset
        Results of the reduction.

    Returns
    -------
    xarray.Dataset
        Results with the variable ``<name>_error``. The error is NaN if the result depends on a cell
        without an error estimate.

    Notes
    -----
    The error of a result :math:`r` that depends on cells with values :math:`y_i` and errors
    :math:`e_i` is

    .. math:: e_r = \sum_i \left|\frac{\partial r}{\partial y_i}\right| (e_i + \epsilon |y_i|),

    with the rounding error :math:`\epsilon` of double precision. Absolute values are added because
    the errors of a solver are systematic, so the errors of neighbouring cells do not cancel. To
    first order, the sum is an upper bound on the error of the result if the error estimate of each
    cell is an upper bound on the error of the cell.
    """
    of, name = f"{reduction.of}_error", f"{reduction.name}_error"
    if of not in dataset or reduction.name not in reduction_results:
        return reduction_results
    result = reduction_results[reduction.name]
    errors = dataset[of] + sys.float_info.epsilon * abs(dataset[reduction.of])
    parts = []
    for derivative, place in reduction.derivatives(dataset):
        felt = abs(derivative) * errors.sel(place, drop=True)
        felt = felt.where(derivative != 0.0, 0.0)  # A cell without a value may have no error.
        parts.append(felt.sum([d for d in felt.dims if d not in result.dims], skipna=False))
    if not parts:
        return reduction_results
    error = sum(parts[1:], start=parts[0]).where(result.notnull()).transpose(*result.dims)
    about = {key: result.attrs[key] for key in ("refused",) if key in result.attrs}
    comment = PROPAGATED_ERROR_COMMENT
    if name in reduction_results:
        error, comment = (
            error + reduction_results[name],
            f"{reduction_results[name].attrs['comment']}; and {PROPAGATED_ERROR_COMMENT}",
        )
    return reduction_results.assign({name: error.assign_attrs(comment=comment, **about)})
