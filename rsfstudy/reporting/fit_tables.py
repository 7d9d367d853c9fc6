"""Functions that convert the results of fits to a table, or to dictionaries for JSON output."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.errors import DataError
from rsfstudy.fitting import (
    PARAMETERS,
    split_window_number,
)
from rsfstudy.former_data_names import TableAcceptingFormerColumnNames, rename_former_variables
from rsfstudy.quantities import read_units_or_reference_scale
from rsfstudy.reporting.text_tables import format_units
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset

#: Names that laboratories use for parameters, by parameter name in rsfstudy. The mapping contains
#: only the parameters whose names differ.
_LABORATORY_NOTATION_BY_PARAMETER = {
    "slip_distance": "Dc",
    "slip_distance_2": "Dc2",
    "mu_star": "mu_0",
    "stiffness": "k",
    "trend1": "trend",
}
#: Labels of the statuses of fits that have values and valid standard errors.
_STATUS_LABELS_OF_VALID_FITS = (Status.OK.label, Status.NOT_IDENTIFIED.label)


def contains_fits(dataset: xr.Dataset) -> bool:
    """Return True if a dataset contains fits of records.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to check.

    Returns
    -------
    bool
        True if the dataset contains fits.
    """
    return "rows_fitted" in dataset


def split_into_single_fits(dataset: xr.Dataset) -> list[xr.Dataset]:
    """Split a dataset of several fits into one dataset per fit.

    If the steps were fitted with several windows, the function returns only the fits with the
    longest window.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset from ``rsfstudy.fit``.

    Returns
    -------
    list of xarray.Dataset
        One dataset per fit.

    Raises
    ------
    DataError
        If the dataset contains no fits.
    """
    if not contains_fits(dataset):
        raise DataError("the dataset contains no fit. Use a dataset from rsfstudy.fit.")
    dataset = rename_former_variables(dataset)
    if "part" in dataset.dims:
        dataset = dataset.isel(part=0)
    dims = dataset["rows_fitted"].dims
    sizes = [dataset.sizes[d] for d in dims]
    return [dataset.isel(dict(zip(dims, at, strict=True))) for at in np.ndindex(*sizes)]


def find_record_and_step_of_fit(fit: xr.Dataset) -> dict[str, Any]:
    """Return the record name and the step number of a fit.

    Parameters
    ----------
    fit : xarray.Dataset
        Dataset with a single fit.

    Returns
    -------
    dict of str to object
        The keys are ``record`` and ``step``. If all fits belong to the same record, the key
        ``record`` is missing. If all fits belong to the same step, the key ``step`` is missing.
    """
    found = {n: fit[n].item() for n in ("record", "step") if n in fit.coords}
    return {n: value if n == "record" else int(value) for n, value in found.items()}


def find_parameter_headings(fit: xr.Dataset) -> dict[str, str]:
    """Return the column headings of the fitted parameters.

    Parameters
    ----------
    fit : xarray.Dataset
        Dataset with a single fit.

    Returns
    -------
    dict of str to str
        Heading of each variable in the notation of laboratories, such as ``Dc`` and ``mu_0``. The
        headings have the same order as the columns of the table.
    """
    names, found = [*map(str, fit["parameter"].values), "a_minus_b"], {}
    for short in dict.fromkeys(("a", "b", "b1", "b2", "a_minus_b", *PARAMETERS)):
        for name in (n for n in names if split_window_number(n)[0] == short):
            found[name] = _LABORATORY_NOTATION_BY_PARAMETER.get(short, short) + name.removeprefix(
                short
            )
    return found


def list_scene_fields_set_by_fit(dataset: xr.Dataset) -> set[str]:
    """Return the names of the scene fields determined by a fit or by its record.

    The declaration of a fit contains only the initial values of these fields.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study or of a fit.

    Returns
    -------
    set of str
        Names of scene fields. The set is empty if the dataset contains no fits.
    """
    if not contains_fits(dataset):
        return set()
    fitted = {split_window_number(str(name))[0] for name in dataset["parameter"].values}
    fields = fitted | {"stiffness", "stiffness_ratio", "reference_rate"}
    fields |= {f"{n}_over_a" for n in ("b", "b1", "b2") if fitted & {"a", n}}
    return fields | ({"length_ratio"} if fitted & {"slip_distance", "slip_distance_2"} else set())


class FitTable(TableAcceptingFormerColumnNames):
    """Table of fits, with one row per fit.

    Selections from the table are ordinary data frames.
    """

    NEW_COLUMN_BY_FORMER_COLUMN: ClassVar[Mapping[str, str]] = {
        "criterion": "aic",
        "_std": "_stderr",
    }


def build_fit_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Return a table of fits with the column names used in laboratories.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset from ``rsfstudy.fit``.

    Returns
    -------
    pandas.DataFrame
        Table with one row per fit. Lengths are in um. Parameters that were not fitted are NaN. The
        dictionary ``attrs["units"]`` contains the units of each numerical column.

        - ``step`` is the number of the step. For a joint fit, ``step`` is a string with the numbers
          of all steps, and the table has no columns ``V0``, ``V1`` and ``window``.
        - Columns ``<name>_stderr`` contain standard errors. The standard errors of a row with the
          status ``errors_not_valid`` are not valid.
        - Columns ``<name>_ci_low`` and ``<name>_ci_high`` contain the ends of the 95 % confidence
          intervals. With few degrees of freedom, the intervals are much wider than two standard
          errors. The column ``a_minus_b`` has no confidence interval.
        - Columns ``<name>_windows`` contain the range of a parameter over the windows.
        - ``k`` is the stiffness divided by the normal stress in 1/um.
        - ``normal_stress`` is the mean normal stress before the step in MPa.
        - ``p_value`` is the p-value of the autocorrelation test of the whitened residuals.

    Raises
    ------
    DataError
        If the dataset contains no fits.
    """
    rows = []
    units: dict[str, str] = {}
    step, joint_steps = _read_declared_steps(dataset)
    for one in split_into_single_fits(dataset):
        row: dict[str, Any] = dict(find_record_and_step_of_fit(one))
        row.setdefault("step", step)
        for name, short in find_parameter_headings(one).items():
            for suffix in ("", "_stderr", "_ci_low", "_ci_high", "_windows"):
                if f"{name}{suffix}" in one:
                    row[f"{short}{suffix}"] = one[f"{name}{suffix}"].item()
                    units[f"{short}{suffix}"] = read_units_or_reference_scale(one[name].attrs)
        for short, name in (("V0", "velocity_before"), ("V1", "velocity_after")):
            if not joint_steps:
                row[short] = one[name].item()
                units[short] = read_units_or_reference_scale(one[name].attrs)
        row |= {"law": one["law"].item() if "law" in one.coords else ""}
        stresses = find_normal_stresses_in_mpa(one)
        row |= stresses
        units |= dict.fromkeys(stresses, "MPa")
        if "window_stiffness" in one and "stiffness" not in one["parameter"].values:
            row["k"] = one["window_stiffness"].item()
            if stderr := find_stderr_of_fixed_stiffness(one):
                row["k_stderr"] = stderr
            units |= dict.fromkeys(
                ("k", "k_stderr"), read_units_or_reference_scale(one["window_stiffness"].attrs)
            )
        if not joint_steps:
            ends = [one[f"window_{end}"].item() for end in ("begins", "ends")]
            row["window"] = " to ".join(f"{x:g}" for x in ends if math.isfinite(x))
        row["R2"], row["aic"] = one["r_squared"].item(), one["aic"].item()
        row["p_value"], row["status"] = one["p_value"].item(), find_status_label_of_fit(one)
        rows.append(row)
    table = FitTable(rows)
    table.attrs["units"] = {
        str(name): units.get(str(name), "1") for name in table if table[name].dtype.kind in "iuf"
    }
    return table


def _read_declared_steps(dataset: xr.Dataset) -> tuple[int | str, bool]:
    """Return the declared steps of a fit, and a flag that is True for a joint fit.

    The steps of a joint fit are returned as a string, for example "1, 2". The string is empty if
    the dataset has no declaration.
    """
    if "declaration" not in dataset.attrs:
        return "", False
    measure: Any = StoredDataset(dataset).study_declaration.measure
    joint = measure.get("together", ())
    if not joint:
        return measure.get("step", ""), False
    has_one_record = len({record for record, _step in joint}) == 1
    steps = [f"{step}" if has_one_record else f"{step} of {record}" for record, step in joint]
    return ", ".join(steps), True


def summarise_fits_as_json_fields(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Return the results of each fit as a dictionary for JSON output.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset from ``rsfstudy.fit``.

    Returns
    -------
    list of dict
        One dictionary per fit. The documentation page "JSON output" describes the keys of the
        dictionaries. The fitted parameters have the same names, values and units as in the dataset.

    Raises
    ------
    DataError
        If the dataset contains no fits.
    """
    numbers = (
        *("velocity_before", "velocity_after", "window_begins", "window_ends", "rows_fitted"),
        *("r_squared", "aic", "noise_order", "noise_sd", "n_eff", "p_value"),
    )
    return [
        {
            **dict.fromkeys(("record", "step")),
            **find_record_and_step_of_fit(one),
            "law": str(one["law"].item()) if "law" in one.coords else None,
            "status": find_status_label_of_fit(one),
            "message": str(one["message"].item()),
            "parameters": [
                {
                    "name": name,
                    "units": format_units(one[name]),
                    "value": one[name].item(),
                    "stderr": one[f"{name}_stderr"].item(),
                }
                for name in find_parameter_headings(one)
            ],
            **{name: one[name].item() for name in numbers},
        }
        for one in split_into_single_fits(dataset)
    ]


def find_normal_stresses_in_mpa(fit: xr.Dataset) -> dict[str, float]:
    """Return the normal stress before each step in MPa.

    Parameters
    ----------
    fit : xarray.Dataset
        Dataset with a single fit.

    Returns
    -------
    dict of str to float
        Normal stresses in MPa. If the fit has one step, the only key is ``normal_stress``. If the
        fit has several steps, the keys contain the number of the step. Normal stresses that are not
        finite are omitted.
    """
    names = [str(n) for n in fit.data_vars if str(n).startswith("normal_stress_before_")]
    stresses = {n: fit[n].item() * 1e-6 for n in names or ["normal_stress_before"] if n in fit}
    known = {n: stress for n, stress in stresses.items() if math.isfinite(stress)}
    return {n.replace("_before", ""): stress for n, stress in known.items()}


def find_stderr_of_fixed_stiffness(fit: xr.Dataset) -> float:
    """Return the standard error of a stiffness that is not fitted.

    Parameters
    ----------
    fit : xarray.Dataset
        Dataset with a single fit.

    Returns
    -------
    float
        Standard error in 1/um, or 0 if the stiffness is exact.
    """
    if "window_stiffness_stderr" not in fit:
        return 0.0
    return float(np.nan_to_num(fit["window_stiffness_stderr"].item()))


def find_status_label_of_fit(fit: xr.Dataset) -> str:
    """Return the status label of a fit.

    Parameters
    ----------
    fit : xarray.Dataset
        Dataset with a single fit.

    Returns
    -------
    str
        Status label, such as ``ok`` or ``not_identified``.
    """
    return Status.labels_by_code()[int(fit["status"])]


def are_all_fits_valid(dataset: xr.Dataset) -> bool:
    """Return True if each fit has values and valid standard errors.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset from ``rsfstudy.fit``.

    Returns
    -------
    bool
        True if the status of each fit is ``ok`` or ``not_identified``.

    Raises
    ------
    DataError
        If the dataset contains no fits.
    """
    return all(
        find_status_label_of_fit(one) in _STATUS_LABELS_OF_VALID_FITS
        for one in split_into_single_fits(dataset)
    )
