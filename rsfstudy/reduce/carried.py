"""Numerical errors of cells, carried to what is made of them."""

from __future__ import annotations

import sys

import xarray as xr

from rsfstudy.reduce.base import Reduction

#: How a result comes by its error, for the attributes of that.
COMMENT = "errors of the cells it draws on, each times the derivative by it, in absolute value"


def carried(reduction: Reduction, dataset: xr.Dataset, made: xr.Dataset) -> xr.Dataset:
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
    made : xarray.Dataset
        The results.
    """
    of, name = f"{reduction.of}_error", f"{reduction.name}_error"
    if of not in dataset or reduction.name not in made:
        return made
    result = made[reduction.name]
    errors = dataset[of] + sys.float_info.epsilon * abs(dataset[reduction.of])
    parts = []
    for derivative, place in reduction.derivatives(dataset):
        felt = abs(derivative) * errors.sel(place, drop=True)
        felt = felt.where(derivative != 0.0, 0.0)  # a cell without a number may have no error
        parts.append(felt.sum([d for d in felt.dims if d not in result.dims], skipna=False))
    if not parts:
        return made
    error = sum(parts[1:], start=parts[0]).where(result.notnull()).transpose(*result.dims)
    about = {key: result.attrs[key] for key in ("refused", "measured_as") if key in result.attrs}
    comment = COMMENT
    if name in made:
        error, comment = error + made[name], f"{made[name].attrs['comment']}; and {COMMENT}"
    return made.assign({name: error.assign_attrs(comment=comment, **about)})
