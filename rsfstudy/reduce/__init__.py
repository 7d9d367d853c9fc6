"""Reductions: from a lattice to boundaries and scaling slopes, kept in the same dataset.

A reduction never draws on failed or missing cells: where there are any within its support, the
result is NaN and says why, unless it is told to leave the failed ones out. Cells that answered
without a number (such as `stable_for_all_steps`) are left out, and counted. Numerical errors of
cells are carried to what is made of them (`rsfstudy.reduce.base.carried`).
"""

from __future__ import annotations

import xarray as xr

from rsfstudy.error_boundary import error_boundary
from rsfstudy.errors import InvalidValue
from rsfstudy.reduce.base import (
    Reduction,
    carried,
    failed,
    known,
    without_failures,
    worst,
)
from rsfstudy.reduce.boundaries import Boundary, Inverse
from rsfstudy.reduce.comparisons import Difference, OverClosedForm, Range, RelativeDifference
from rsfstudy.reduce.fits import DecadeFit, LinearFit, PowerLaw, ProportionalFit
from rsfstudy.reduce.samples import Logarithm, Mean, Quantile, StandardDeviation, StatusShares
from rsfstudy.reduce.sobol_indices import SobolIndices
from rsfstudy.reduce.units import described
from rsfstudy.status import Status
from rsfstudy.vocabulary import coverage, quantity

__all__ = [
    "Boundary",
    "DecadeFit",
    "Difference",
    "Inverse",
    "LinearFit",
    "Logarithm",
    "Mean",
    "OverClosedForm",
    "PowerLaw",
    "ProportionalFit",
    "Quantile",
    "Range",
    "Reduction",
    "RelativeDifference",
    "SobolIndices",
    "StandardDeviation",
    "StatusShares",
    "reduced",
]

#: What tells of the quality of a result, by the ends of their names.
_BESIDE = ("error", "stderr", "misfit", "points", "status")


def _names_of(dataset: xr.Dataset) -> list[str]:
    return list(map(str, dataset.data_vars))


@error_boundary
def reduced(
    dataset: xr.Dataset, reductions: tuple[Reduction, ...], *, despite_failures: bool = False
) -> xr.Dataset:
    """The dataset with the results of its reductions, each described by the vocabulary.

    Parameters
    ----------
    dataset : xarray.Dataset
    reductions : tuple of Reduction
    despite_failures : bool
        Leave failed cells out instead of refusing to draw on them; the results say so.
    """
    lost = int((failed(dataset["status"]) & (dataset["status"] != int(Status.PENDING))).sum())
    despite = {"despite": f"{lost} failed cells are left out"} if lost and despite_failures else {}
    drawn: dict[str, xr.DataArray] = {}
    for reduction in reductions:
        if reduction.of not in dataset:
            raise InvalidValue("of", reduction.of, "is not measured", choices=_names_of(dataset))
        leaves_out = despite and not reduction.of_failures
        support = without_failures(dataset) if leaves_out else dataset
        own = worst(support["status"], support[reduction.of].dims)
        if not reduction.of_failures:
            own = drawn.get(reduction.of, own)
        support = known(support, reduction.of, own)
        found: object = reduction(support)  # user-defined reductions may return anything
        if not isinstance(found, xr.Dataset):
            rule = "must return an xarray.Dataset of the new variables"
            remedy = "Write return self.results('how it was found', {'': values})."
            what = f"result of {reduction.kind}"
            raise InvalidValue(what, type(found).__name__, rule, remedy=remedy)
        made = carried(reduction, support, found)
        stated = {q.name: q for q in reduction.quantities}
        quantities = described(reduction, dataset, made)
        for name, values in made.data_vars.items():
            if name in dataset:
                rule = f"would replace {name!r} by what it makes of {reduction.of!r}"
                raise InvalidValue("reduction", reduction.name, rule)
            drawn[str(name)] = worst(reduction.draws_on(support["status"]), values.dims)
            if bool(failed(drawn[str(name)]).any()):
                values.attrs.setdefault("refused", "cells it draws on failed or are missing")
            said = {key: values.attrs[key] for key in ("comment", "refused") if key in values.attrs}
            about = quantity(str(name), quantities).attributes
            about |= {"coverage_content_type": coverage(str(name)), **said}
            if str(name) in stated and stated[str(name)].symbol:
                about["symbol"] = stated[str(name)].symbol
            if beside := [n for end in _BESIDE if (n := f"{name}_{end}") in made]:
                about["ancillary_variables"] = " ".join(beside)
            values.attrs = {**about, **despite}
            before = {key: along.attrs for key, along in dataset.coords.items()}
            dataset = dataset.assign({name: values})
            for coordinate, attributes in before.items():
                # results may lack the attributes of coordinates: older versions of xarray drop them
                dataset[coordinate].attrs = attributes
            for coordinate in values.dims:
                if coordinate in dataset.coords and not dataset[coordinate].attrs:
                    along = quantity(str(coordinate), stated)
                    dataset[coordinate].attrs = {"long_name": along.long_name, "units": along.units}
    return dataset.assign_attrs({f"reduced_{key}": text for key, text in despite.items()})
