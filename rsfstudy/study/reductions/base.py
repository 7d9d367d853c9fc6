"""Base of reductions: a name, a variable to reduce, and that they never use failed cells."""

from __future__ import annotations

import sys
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np
import xarray as xr

from rsfstudy._deprecation import adopt_former_members, renamed_members
from rsfstudy.error_boundary import CheckedKeywords, guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import Quantity
from rsfstudy.status import Status
from rsfstudy.vocabulary import QUANTITY_BY_NAME

DatasetOrArray = TypeVar("DatasetOrArray", xr.Dataset, xr.DataArray)

#: Derivatives of a result by cells, each with the place of those on some dimensions.
DerivativesByVariable = Sequence[tuple[xr.DataArray, Mapping[str, Any]]]

#: Fields that name what a result is measured in units of, by the end of its name.
UnitFieldsBySuffix = Mapping[str, Sequence[str]]

#: How a result comes by its error, for the attributes of that.
PROPAGATED_ERROR_COMMENT = (
    "errors of the cells it draws on, each times the derivative by it, in absolute value"
)
#: Endings of the names of variables that hold statistical errors.
_STATISTICAL_SUFFIXES = ("_stderr", "_low", "_high", "covariance", "correlation")
#: Rounding error by which a coordinate value may miss a range and still count as in it.
COORDINATE_RANGE_RTOL = 1e-9


@renamed_members
@guard_methods
@dataclass(frozen=True)
class Reduction(CheckedKeywords):
    """Base class of all reductions.

    Calling a reduction, as in ``reduction(dataset)``, returns a dataset of the new variables. To
    write your own reduction, derive a frozen dataclass from this class. Fields other than ``name``
    and ``of`` are options of the reduction. One method is required::

        __call__(self, dataset) -> xarray.Dataset

    ``name`` is the name of the result, and ``of`` is the variable to reduce. In ``dataset``, the
    values of failed cells are NaN, and the variable ``status`` contains the status of each cell.
    The following class attributes and methods are optional::

        kind: ClassVar[str]
        long_names: ClassVar[Mapping[str, str]]
        measured_in: ClassVar[Mapping[str, Sequence[str]]]
        derivatives(self, dataset) -> Sequence[tuple[xarray.DataArray, Mapping]]

    ``kind`` is the name of the reduction in files. The default is the class name. ``long_names``
    and ``unit_fields`` define the long names and the units of the results. ``derivatives`` returns
    the derivatives with which the numerical errors of cells are propagated to ``<name>_error``.
    """

    #: Name of the kind in declarations; by default that of the class.
    kind: ClassVar[str] = "Reduction"
    #: Long names of its results that are pure numbers, by what follows `name` in theirs; "{name}"
    #: in them is `name` in words.
    long_names: ClassVar[Mapping[str, str]] = {}
    #: What its results are in units of, by what follows `name` in theirs: the variable that a field
    #: names, as `("of",)`, or over that of others, as `("of", "on")`. All others are pure numbers.
    unit_fields: ClassVar[UnitFieldsBySuffix] = {}
    #: Whether it tells of cells that failed, which all others refuse to draw on.
    uses_failed_cells: ClassVar[bool] = False

    name: str
    of: str

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        adopt_former_members(cls)
        if "kind" not in vars(cls) and not cls.__name__.startswith("_"):
            cls.kind = cls.__name__

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Return the new variables."""
        raise TypeError(f"{type(self).__name__} reduces nothing")

    def results(self, comment: str, values: Mapping[str, xr.DataArray]) -> xr.Dataset:
        """The new variables, by what follows `name` in their names, with how they came about."""
        described = {end: found.assign_attrs(comment=comment) for end, found in values.items()}
        return xr.Dataset({f"{self.name}{end}": found for end, found in described.items()})

    def support_status(self, status: xr.DataArray) -> xr.DataArray:
        """The worst status among the cells that each result draws on, from the status of all cells;
        `worst_status` removes the dimensions that the results do not have.
        """
        return status

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """Derivatives of the result `name` by the cells that it draws on, 0 by those that have no
        number; none where the errors of cells do not carry over.

        Each is by the cells at the result's own place, or at the place on some dimensions that
        comes with it; along dimensions that the result does not have, by each of the cells.
        """
        return ()

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Names and units of its results that the vocabulary does not hold: of `long_names`."""
        words = {"name": self.name.replace("_", " ")}
        given = self.long_names.items()
        return [Quantity(f"{self.name}{end}", "", "1", t.format(**words)) for end, t in given]

    def describe(self) -> dict[str, Any]:
        """The reduction as plain data."""
        return {"kind": self.kind, **asdict(self)}


def failed_cell_mask(status: xr.DataArray) -> xr.DataArray:
    """Cells that failed or were not computed."""
    return status >= int(Status.WORK_BUDGET_SPENT)


def worst_status_along_other_dims(
    status: xr.DataArray, kept_dimensions: Collection[Hashable]
) -> xr.DataArray:
    """The worst status along all dimensions but `dims`; failures have the largest codes."""
    return status.max([d for d in status.dims if d not in kept_dimensions])


def mask_unusable_values(
    dataset: xr.Dataset, variable_name: str, status: xr.DataArray
) -> xr.Dataset:
    """Return a copy of the dataset in which values that must not be used are NaN.

    The values of failed cells are replaced by NaN. If ``variable_name`` is a standard error or the
    bound of a confidence interval, values that are not valid are replaced by NaN as well.

    Parameters
    ----------
    dataset : xarray.Dataset
    variable_name : str
        Variable to reduce.
    status : xarray.DataArray
        Status of the cells on which ``variable_name`` depends. The status is added to the result.
    """
    bad = failed_cell_mask(status)
    if variable_name.endswith(_STATISTICAL_SUFFIXES):
        bad = bad | (status == int(Status.ERRORS_NOT_VALID))
    if bool(bad.any()) and dataset[variable_name].dtype.kind == "f":
        dataset = dataset.assign({variable_name: dataset[variable_name].where(~bad)})
    return dataset.assign(status=status)


def refused_result_mask(
    dataset: xr.Dataset, variable_name: str, *reduced_dimensions: str
) -> xr.DataArray:
    """True if a result must be refused because a cell failed along these dimensions, or along those
    that `of` does not have.
    """
    bad = failed_cell_mask(dataset["status"])
    return bad.any(
        [d for d in bad.dims if d in reduced_dimensions or d not in dataset[variable_name].dims]
    )


def mask_failures(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with failed cells changed to cells that have an answer but no number."""
    lost = failed_cell_mask(dataset["status"]) & (dataset["status"] != int(Status.PENDING))
    kept = {
        name: values.where(~lost)
        for name, values in dataset.data_vars.items()
        if values.dtype.kind == "f" and set(lost.dims) <= set(values.dims)
    }
    status = dataset["status"].where(~lost, int(Status.NO_STEP))
    return dataset.assign({**kept, "status": status})


def dimension_of_coordinate(dataset: xr.Dataset | xr.DataArray, coordinate_name: str) -> str:
    """The one dimension a coordinate lies along.

    Raises
    ------
    InvalidValue
        Where `on` is no coordinate along one dimension.
    """
    if coordinate_name not in dataset.coords or dataset[coordinate_name].ndim != 1:
        choices = [
            str(n) for n, c in dataset.coords.items() if c.ndim == 1 and n != coordinate_name
        ]
        raise InvalidValue(
            "on", coordinate_name, "must be a coordinate along one dimension", choices=choices
        )
    if dataset[coordinate_name].dtype.kind not in "iuf":
        raise InvalidValue("on", coordinate_name, "must be a coordinate of numbers")
    return str(dataset[coordinate_name].dims[0])


def select_coordinate_range(
    dataset: DatasetOrArray, coordinate_name: str, coordinate_range: tuple[float, float] | None
) -> DatasetOrArray:
    """The part of a dataset in a range of a coordinate, both ends included; all of what does not
    lie along that coordinate.
    """
    if coordinate_range is None or coordinate_name not in dataset.coords:
        return dataset
    values, (lowest, highest) = dataset[coordinate_name].values, coordinate_range
    inside = (values >= lowest - COORDINATE_RANGE_RTOL * abs(lowest)) & (
        values <= highest + COORDINATE_RANGE_RTOL * abs(highest)
    )
    return dataset.isel({dimension_of_coordinate(dataset, coordinate_name): np.flatnonzero(inside)})


def read_undocumented_quantities(dataset: xr.Dataset) -> dict[str, Quantity]:
    """Quantities that a dataset states for variables that the vocabulary does not hold, or calls
    something else, or holds in other units.
    """
    return {
        str(name): Quantity(
            str(name),
            str(values.attrs.get("symbol", "")),
            str(values.attrs.get("units", "1")),
            str(values.attrs["long_name"]),
            str(values.attrs.get("scale", "")),
        )
        for name, values in dataset.variables.items()
        if values.attrs.get("long_name") and not _is_in_vocabulary(str(name), values.attrs)
    }


def _is_in_vocabulary(variable_name: str, variable_attributes: Mapping[Any, Any]) -> bool:
    about = QUANTITY_BY_NAME.get(variable_name)
    if about is None or variable_attributes["long_name"] != about.long_name:
        return False
    return bool(variable_attributes.get("units", about.units) == about.units)


# ---- numerical errors ----------------------------------------------------------------------------


def with_propagated_errors(
    reduction: Reduction, dataset: xr.Dataset, reduction_results: xr.Dataset
) -> xr.Dataset:
    """The results of a reduction with ``<name>_error``, what the errors of its cells make of them;
    added to the error that the reduction has of its own.

    The error of each cell, and its rounding, count with the derivative of the result by that cell,
    all in absolute value: errors of a solver are systematic, so that those of neighbours add up.
    To first order this is a bound where those of the cells are. It is NaN where a cell that the
    result depends on has no error estimate. Nothing is carried where none has, or where the
    reduction has no derivatives.

    Parameters
    ----------
    reduction : Reduction
    dataset : xarray.Dataset
        What was reduced.
    reduction_results : xarray.Dataset
        The results.
    """
    of, name = f"{reduction.of}_error", f"{reduction.name}_error"
    if of not in dataset or reduction.name not in reduction_results:
        return reduction_results
    result = reduction_results[reduction.name]
    errors = dataset[of] + sys.float_info.epsilon * abs(dataset[reduction.of])
    parts = []
    for derivative, place in reduction.derivatives(dataset):
        felt = abs(derivative) * errors.sel(place, drop=True)
        felt = felt.where(derivative != 0.0, 0.0)  # a cell without a number may have no error
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
