"""Comparison of results datasets.

``compare_results_of_same_study`` compares two datasets of the same study variable by variable.
``compare_results`` compares the results of any two studies, and also compares the declarations,
versions and machines.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.former_data_names import rename_former_declaration_fields
from rsfstudy.status import Status
from rsfstudy.storage.run_fingerprints import find_fingerprint_differences
from rsfstudy.storage.schema import is_of_single_scene, read_provenance
from rsfstudy.storage.study_reconstruction import find_primary_output_name
from rsfstudy.vocabulary import TIMING_VARIABLES

_AGREEMENT_TABLE_COLUMNS = [
    "variable",
    "values",
    "identical",
    "largest_difference",
    "beyond_errors",
]
#: Entries of a fingerprint that are also part of the declaration.
_FINGERPRINT_KEYS_ALSO_IN_DECLARATION = {"study", "measure", "rtol", "budget", "methods", "engine"}

ValuesInBothDatasets = tuple[Any, Any]


# ---- one lattice --------------------------------------------------------------------------------


def compare_results_of_same_study(first: xr.Dataset, second: xr.Dataset) -> pd.DataFrame:
    """Compare two datasets of the same study, variable by variable.

    Only cells that are finished in both datasets are compared. Some variables, such as the results
    of reductions, do not have the dimensions of the lattice. These variables are compared only if
    all cells are finished in both datasets. Measured times are not compared.

    Parameters
    ----------
    first, second : xarray.Dataset
        Results of one study, or two motions of one scene.

    Returns
    -------
    pandas.DataFrame
        Table with one row per variable. The column ``values`` contains the number of compared
        values, ``identical`` contains the number of identical values, and ``largest_difference``
        contains the largest absolute difference. The column ``beyond_errors`` contains the number
        of values that differ by more than the sum of both error estimates. If a variable has no
        error estimates, ``beyond_errors`` is NaN. In floating-point variables with flag values,
        every pair of different values is counted in ``beyond_errors``. The entry ``differs`` of
        ``attrs`` contains the differences between the fingerprints.
    """
    if is_of_single_scene(first):
        return _compare_motions(first, second)
    both = _find_finished_cells(first) & _find_finished_cells(second)
    rows = []
    for name, values in first.data_vars.items():
        if name in TIMING_VARIABLES:
            continue
        if set(both.dims) <= set(values.dims):
            known = both.broadcast_like(values).transpose(*values.dims).values
            rows.append(_compare_variable(name, first, second, known))
        elif bool(both.all()):  # Reductions of incomplete datasets may use different cells.
            rows.append(_compare_variable(name, first, second))
    return _build_agreement_table(
        rows, *(read_provenance(dataset)["fingerprint"] for dataset in (first, second))
    )


def _compare_motions(first: xr.Dataset, second: xr.Dataset) -> pd.DataFrame:
    """Compare two motions of one scene."""
    rows = [
        _compare_variable(n, first, second) for n, values in first.variables.items() if values.dims
    ]
    made = ({"source": str(d.attrs.get("source", "unknown"))} for d in (first, second))
    return _build_agreement_table(rows, *made)


def _build_agreement_table(
    variable_rows: Sequence[dict[str, Any]],
    first_fingerprint: Mapping[str, Any],
    second_fingerprint: Mapping[str, Any],
) -> pd.DataFrame:
    """Build the table of compared variables.

    The ``attrs`` of the table contain the differences between the fingerprints.
    """
    frame = pd.DataFrame(variable_rows, columns=_AGREEMENT_TABLE_COLUMNS)
    frame.attrs["differs"] = find_fingerprint_differences(first_fingerprint, second_fingerprint)
    return frame


def _find_finished_cells(dataset: xr.Dataset) -> xr.DataArray:
    """Return an array that is True for finished cells."""
    return dataset["status"] != int(Status.PENDING)


def _compare_variable(
    variable_name: Hashable, first: xr.Dataset, second: xr.Dataset, compared_cells_mask: Any = ...
) -> dict[str, Any]:
    """Compare one variable in the cells that are finished in both datasets.

    The number of identical values is 0 if the variables have different shapes, or if only one of
    the variables contains floating-point numbers.
    """
    a, b = first[variable_name], second.get(variable_name)
    found: dict[str, Any] = {"variable": variable_name, "values": a.size, "identical": 0}
    if b is None or a.shape != b.shape or (a.dtype.kind == "f") != (b.dtype.kind == "f"):
        return found
    x, y = a.values[compared_cells_mask], b.values[compared_cells_mask]
    if a.dtype.kind != "f":
        return found | {"values": x.size, "identical": int(np.sum(x == y))}
    gap = np.abs(x - y)
    same = (x == y) | (np.isnan(x) & np.isnan(y))
    found |= {"values": x.size, "identical": int(same.sum())}
    found["largest_difference"] = float(np.max(gap[~same], initial=0.0))
    errors = [d[f"{variable_name}_error"] for d in (first, second) if f"{variable_name}_error" in d]
    if [error.shape for error in errors] == [a.shape, a.shape]:
        allowed = errors[0].values[compared_cells_mask] + errors[1].values[compared_cells_mask]
        # Comparisons with NaN are False, so a missing value or a missing error estimate counts as a
        # difference beyond the errors.
        found["beyond_errors"] = int((~same & ~(gap <= allowed)).sum())
    elif "flag_values" in a.attrs:  # Status codes and other flag values have no error estimates.
        found["beyond_errors"] = int((~same).sum())
    return found


# ---- side by side -------------------------------------------------------------------------------


@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class ResultsComparison:
    """Differences between two results datasets.

    Parameters
    ----------
    differing_declaration_entries : mapping of str to tuple of (object, object)
        Entries of the declaration that differ. Each key is the path of an entry, and each value
        contains the entry of the first dataset and the entry of the second dataset. If an entry is
        missing in a dataset, None replaces the entry.
    differing_provenance : mapping of str to tuple of (object, object)
        Versions, code digests and machines that differ, by name. Each value contains the entries of
        both datasets.
    differing_axis_points : mapping of str to tuple of (list, list)
        Axes that have different points in the two datasets. Each value contains a list of the
        points that only the first dataset has, and a list of the points that only the second
        dataset has.
    finished_cell_counts : tuple of int
        Number of cells that are finished in both datasets, only in the first dataset, and only in
        the second dataset.
    differing_statuses : pandas.DataFrame
        Table of the cells that are finished in both datasets and have different statuses. The table
        has one column for each coordinate. The columns ``first`` and ``second`` contain the
        statuses in the first and in the second dataset.
    agreement_table : pandas.DataFrame
        Comparison of the variables in the cells that are finished in both datasets. The function
        ``compare_results_of_same_study`` documents the columns. If the primary output has no error
        estimates, every pair of different values of the primary output is counted in the column
        ``beyond_errors``.
    uncompared_variables : mapping of str to str
        Reason why a variable is not compared, by name of the variable.
    """

    differing_declaration_entries: Mapping[str, ValuesInBothDatasets]
    differing_provenance: Mapping[str, ValuesInBothDatasets]
    differing_axis_points: Mapping[str, tuple[list[Any], list[Any]]]
    finished_cell_counts: tuple[int, int, int]
    differing_statuses: pd.DataFrame
    agreement_table: pd.DataFrame
    uncompared_variables: Mapping[str, str]

    @property
    def variables_differing_beyond_errors(self) -> list[str]:
        """Names of variables whose difference exceeds the sum of both error estimates."""
        return list(self.agreement_table["variable"][self.agreement_table["beyond_errors"] > 0])

    @property
    def agrees(self) -> bool:
        """True if the datasets agree in the cells that are finished in both datasets.

        The datasets agree if at least one cell is finished in both datasets, if these cells have
        the same statuses, and if no variable differs by more than the sum of both error estimates.
        """
        return (
            self.finished_cell_counts[0] > 0
            and self.differing_statuses.empty
            and not self.variables_differing_beyond_errors
        )


def compare_results(first: xr.Dataset, second: xr.Dataset) -> ResultsComparison:
    """Compare two results datasets in the cells with equal coordinates.

    If a field is an axis in one dataset and has a fixed value in the other dataset, only the cells
    with this fixed value are compared.

    Parameters
    ----------
    first, second : xarray.Dataset
        Results of two studies, or two results of one study.

    Returns
    -------
    ResultsComparison
        Differences between the datasets.

    Raises
    ------
    InvalidValue
        If one dataset has an axis and the other dataset does not contain the field of this axis, or
        if points with the same label have different field values. For example, the points of two
        different random samples have equal labels and different field values.
    """
    both = [
        _add_axes_of_other_dataset(one, other) for one, other in ((first, second), (second, first))
    ]
    dims = [str(d) for d in both[0]["status"].dims]
    labelled = [
        dataset.assign_coords(_round_coordinates_for_alignment(dataset)) for dataset in both
    ]
    left_out = _find_uncomparable_variables(labelled)
    kept = [dataset.drop_vars(left_out, errors="ignore") for dataset in labelled]
    shared = [one.transpose(*dims, ...) for one in xr.align(*kept, join="inner")]
    _check_axis_points_have_same_values(*shared)
    indexes = [[dataset.indexes[d] for dataset in labelled] for d in dims]
    points = {
        d: (a.difference(b, sort=False).tolist(), b.difference(a, sort=False).tolist())
        for d, (a, b) in zip(dims, indexes, strict=True)
        if set(a) != set(b)
    }
    known = _find_finished_cells(shared[0]) & _find_finished_cells(shared[1])
    alone = [int(_find_finished_cells(dataset).sum() - known.sum()) for dataset in both]
    return ResultsComparison(
        differing_declaration_entries=find_fingerprint_differences(
            *(
                dict(
                    _flatten_declaration(
                        rename_former_declaration_fields(json.loads(d.attrs["declaration"]))
                    )
                )
                for d in both
            )
        ),
        differing_provenance=find_fingerprint_differences(
            *(_read_versions_and_machine(dataset) for dataset in both)
        ),
        differing_axis_points=points,
        finished_cell_counts=(int(known.sum()), alone[0], alone[1]),
        differing_statuses=_compare_statuses_of_shared_cells(shared, known),
        agreement_table=_compare_variables_of_shared_cells(shared),
        uncompared_variables=left_out,
    )


def _add_axes_of_other_dataset(dataset: xr.Dataset, other_dataset: xr.Dataset) -> xr.Dataset:
    """Add the missing axes to a dataset.

    If ``other_dataset`` has axes that ``dataset`` does not have, the function adds these axes to
    ``dataset``. Each added axis has a single point, which is the fixed value of the coordinate in
    ``dataset``.
    """
    cells = set(dataset["status"].dims)
    for dimension in other_dataset["status"].dims:
        if dimension in cells:
            continue
        if dimension not in dataset.coords or dataset[dimension].ndim:
            rule = (
                "is an axis of only one of the datasets, and the other dataset contains no "
                "value of this axis"
            )
            raise InvalidValue("axis", str(dimension), rule)
        measured = [n for n, values in dataset.data_vars.items() if cells <= set(values.dims)]
        wider = dataset[measured].expand_dims(dimension)
        dataset = dataset.drop_vars([dimension, *measured]).merge(wider)
    return dataset


def _round_coordinates_for_alignment(dataset: xr.Dataset) -> dict[str, Any]:
    """Round the coordinates to 12 digits, so that two datasets can be aligned.

    If rounding would make two points of a coordinate equal, this coordinate is not rounded.
    """
    labels = {}
    for name in map(str, dataset.dims):
        values = dataset[name]
        rounded = values.values
        if values.dtype.kind == "f":
            rounded = np.array([float(f"{value:.12g}") for value in values.values.tolist()])
            if len(np.unique(rounded)) < len(rounded):
                rounded = values.values
        labels[name] = (name, rounded, values.attrs)
    return labels


def _check_axis_points_have_same_values(first: xr.Dataset, second: xr.Dataset) -> None:
    """Check that points with the same label have the same field values.

    The check ignores differences that are as small as rounding errors.
    """
    for name, one in first.coords.items():
        if not one.dims or name in one.dims or name not in second.coords:
            continue
        x, y = one.values, second[name].values
        if x.shape == y.shape and x.dtype.kind == y.dtype.kind == "f":
            same = np.allclose(x, y, rtol=1e-11, atol=0.0, equal_nan=True)
        else:
            same = np.array_equal(x, y)
        if not same:
            rule = (
                f"has points with the same label but different values of {name} in the two datasets"
            )
            remedy = "The datasets contain different cells and cannot be compared."
            raise InvalidValue("axis", ", ".join(map(str, one.dims)), rule, remedy=remedy)


def _find_uncomparable_variables(aligned_datasets: Sequence[xr.Dataset]) -> dict[str, str]:
    """Find the variables that cannot be compared, and the reason for each variable."""
    first, second = aligned_datasets
    unequal = {
        str(d) for d in first["status"].dims if set(first.indexes[d]) != set(second.indexes[d])
    }
    why = {str(n): "only in the first dataset" for n in first.data_vars if n not in second}
    why |= {str(n): "only in the second dataset" for n in second.data_vars if n not in first}
    for name in map(str, first.data_vars):
        if name in why:
            continue
        if set(first[name].dims) != set(second[name].dims):
            why[name] = "the dimensions differ"
        elif not unequal <= set(first[name].dims):
            why[name] = "computed from cells that only one dataset contains"
    return why


def _compare_variables_of_shared_cells(shared_cells: Sequence[xr.Dataset]) -> pd.DataFrame:
    """Compare the numeric variables in the cells that both datasets share.

    If the primary output has no error estimates, ``beyond_errors`` is the number of values of the
    primary output that are not identical.
    """
    frame = compare_results_of_same_study(*shared_cells)
    about = find_primary_output_name(shared_cells[0])
    exact = (frame["variable"] == about) & frame["beyond_errors"].isna()
    frame.loc[exact, "beyond_errors"] = (frame["values"] - frame["identical"])[exact]
    return frame


def _compare_statuses_of_shared_cells(
    shared_cells: Sequence[xr.Dataset], compared_cells_mask: xr.DataArray
) -> pd.DataFrame:
    """Build a table of the cells with different statuses."""
    first, second = (one["status"].reset_coords(drop=True) for one in shared_cells)
    both = xr.Dataset(
        {"first": first, "second": second, "known": compared_cells_mask}
    ).reset_coords(drop=True)
    frame = both.to_dataframe(dim_order=[*map(str, first.dims)]).reset_index()
    ended = frame[frame["known"] & (frame["first"] != frame["second"])].drop(columns="known")
    labels = Status.labels_by_code()
    return ended.replace({"first": labels, "second": labels}).reset_index(drop=True)


def _flatten_declaration(
    declaration_part: Any, path_in_declaration: str = ""
) -> Iterator[tuple[str, Any]]:
    """Yield the path and value of each entry of a declaration.

    A list of plain values is yielded as a single entry.
    """
    if isinstance(declaration_part, dict) and declaration_part:
        for name, value in declaration_part.items():
            yield from _flatten_declaration(
                value, f"{path_in_declaration}.{name}" if path_in_declaration else name
            )
    elif isinstance(declaration_part, list) and any(
        isinstance(value, dict) for value in declaration_part
    ):
        for number, value in enumerate(declaration_part):
            named = value.get("dimension") if isinstance(value, dict) else None
            yield from _flatten_declaration(value, f"{path_in_declaration}[{named or number}]")
    else:
        yield path_in_declaration, declaration_part


def _read_versions_and_machine(dataset: xr.Dataset) -> dict[str, Any]:
    """Read the versions, code digests and machine description from a dataset."""
    about: Mapping[str, Any] = read_provenance(dataset)
    decided = {
        n: v
        for n, v in about["fingerprint"].items()
        if n not in _FINGERPRINT_KEYS_ALSO_IN_DECLARATION
    }
    others = {n: v for n, v in about.items() if isinstance(v, str)}
    for name in ("time", "command", "declared_in"):
        others.pop(name, None)
    return {**about["versions"], **decided, **others}
