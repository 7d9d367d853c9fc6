"""Functions that apply reductions to the results of a study.

``apply_reductions`` is the main function. A reduction never uses failed or missing cells. If a
result depends on failed or missing cells, the result is NaN, and its ``refused`` attribute contains
the reason. With the option ``despite_failures``, reductions omit failed cells and use the remaining
cells. Finished cells without a value, such as cells with the status ``stable_for_all_steps``, are
omitted.
"""

from __future__ import annotations

import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.status import Status
from rsfstudy.study.reductions.base import (
    Reduction,
    add_propagated_errors,
    find_worst_status_along_other_dims,
    is_failed_or_pending,
    set_failed_cells_to_nan,
    set_failed_or_invalid_values_to_nan,
)
from rsfstudy.study.reductions.boundaries import Boundary, Inverse
from rsfstudy.study.reductions.comparisons import (
    ClosedFormRatio,
    Difference,
    Range,
    RelativeDifference,
)
from rsfstudy.study.reductions.fits import LinearFit, PowerLaw, ProportionalFit, SemilogFit
from rsfstudy.study.reductions.result_units import build_result_quantities
from rsfstudy.study.reductions.sobol_indices import SobolIndices
from rsfstudy.study.reductions.statistics import (
    Logarithm,
    Mean,
    Quantile,
    StandardDeviation,
    StatusShares,
)
from rsfstudy.vocabulary import find_coverage_content_type, find_quantity

__all__ = [
    "Boundary",
    "SemilogFit",
    "Difference",
    "Inverse",
    "LinearFit",
    "Logarithm",
    "Mean",
    "ClosedFormRatio",
    "PowerLaw",
    "ProportionalFit",
    "Quantile",
    "Range",
    "Reduction",
    "RelativeDifference",
    "SobolIndices",
    "StandardDeviation",
    "StatusShares",
    "apply_reductions",
]

#: Suffixes of the names of variables that describe the quality of a result.
_SUFFIXES_OF_ANCILLARY_VARIABLES = ("error", "stderr", "misfit", "points", "status")


def _list_data_variable_names(dataset: xr.Dataset) -> list[str]:
    """Return the names of all data variables."""
    return list(map(str, dataset.data_vars))


@raise_only_rsfstudy_errors
def apply_reductions(
    dataset: xr.Dataset, reductions: tuple[Reduction, ...], *, despite_failures: bool = False
) -> xr.Dataset:
    """Add the results of reductions to a dataset.

    The attributes of the results, such as units and long names, are taken from the vocabulary or
    from the reductions.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of all cells of the lattice, including the variable ``status``.
    reductions : tuple of Reduction
        Reductions to apply, in order. A reduction may use the results of the preceding reductions.
    despite_failures : bool, default: False
        If True, omit failed cells. If False, all results that depend on failed cells are NaN.

    Returns
    -------
    xarray.Dataset
        Dataset with the results. If failed cells were omitted, the attribute ``despite`` of each
        result contains the number of omitted cells.

    Raises
    ------
    InvalidValue
        If the dataset does not contain the variable to reduce, if a result would replace a variable
        of the dataset, or if a user-defined reduction does not return a dataset.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import Range, apply_reductions
    >>> dataset = xr.Dataset(
    ...     {"stress_drop": ("phi", [2.0, 5.0]), "status": ("phi", [0, 0])},
    ...     coords={"phi": [45.0, 60.0]},
    ... )
    >>> spread = Range(name="spread", of="stress_drop", over="phi")
    >>> reduced = apply_reductions(dataset, (spread,))
    >>> float(reduced["spread"])
    3.0
    """
    lost = int(
        (is_failed_or_pending(dataset["status"]) & (dataset["status"] != int(Status.PENDING))).sum()
    )
    despite = {"despite": f"{lost} failed cells are omitted"} if lost and despite_failures else {}
    drawn: dict[str, xr.DataArray] = {}
    for reduction in reductions:
        if reduction.of not in dataset:
            raise InvalidValue(
                "of",
                reduction.of,
                "is not a result of the study",
                choices=_list_data_variable_names(dataset),
            )
        leaves_out = despite and not reduction.uses_failed_cells
        support = set_failed_cells_to_nan(dataset) if leaves_out else dataset
        own = find_worst_status_along_other_dims(support["status"], support[reduction.of].dims)
        if not reduction.uses_failed_cells:
            own = drawn.get(reduction.of, own)
        support = set_failed_or_invalid_values_to_nan(support, reduction.of, own)
        found: object = reduction(support)  # A user-defined reduction may return any object.
        if not isinstance(found, xr.Dataset):
            rule = "must return an xarray.Dataset of the new variables"
            remedy = "Write, for example, return self.results('description', {'': values})."
            what = f"result of {reduction.kind}"
            raise InvalidValue(what, type(found).__name__, rule, remedy=remedy)
        made = add_propagated_errors(reduction, support, found)
        stated = {q.name: q for q in reduction.quantities}
        quantities = build_result_quantities(reduction, dataset, made)
        for name, values in made.data_vars.items():
            if name in dataset:
                rule = (
                    f"would replace the variable {name!r} by a result computed from "
                    f"{reduction.of!r}"
                )
                raise InvalidValue("reduction", reduction.name, rule)
            drawn[str(name)] = find_worst_status_along_other_dims(
                reduction.get_status_of_used_cells(support["status"]), values.dims
            )
            if bool(is_failed_or_pending(drawn[str(name)]).any()):
                values.attrs.setdefault(
                    "refused", "some of the required cells failed or are missing"
                )
            texts = ("comment", "refused", "note")
            said = {key: values.attrs[key] for key in texts if key in values.attrs}
            about = find_quantity(str(name), quantities).variable_attributes
            about |= {"coverage_content_type": find_coverage_content_type(str(name)), **said}
            if str(name) in stated and stated[str(name)].symbol:
                about["symbol"] = stated[str(name)].symbol
            if beside := [
                n for end in _SUFFIXES_OF_ANCILLARY_VARIABLES if (n := f"{name}_{end}") in made
            ]:
                about["ancillary_variables"] = " ".join(beside)
            values.attrs = {**about, **despite}
            before = {key: along.attrs for key, along in dataset.coords.items()}
            dataset = dataset.assign({name: values})
            for coordinate, attributes in before.items():
                # Older versions of xarray drop the attributes of coordinates, so the attributes are
                # restored.
                dataset[coordinate].attrs = attributes
            for coordinate in values.dims:
                if coordinate in dataset.coords and not dataset[coordinate].attrs:
                    along = find_quantity(str(coordinate), stated)
                    dataset[coordinate].attrs = {"long_name": along.long_name, "units": along.units}
    return dataset.assign_attrs({f"reduced_{key}": text for key, text in despite.items()})
