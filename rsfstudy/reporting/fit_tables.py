"""Fits of records as laboratories tabulate them: tables, samples of parameters, scenes; and as a
command prints them and a report shows them, those of one step beside each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.errors import DataError
from rsfstudy.fitting import (
    PARAMETERS,
    describe_whiteness,
    split_window_number,
)
from rsfstudy.formatting import pluralize
from rsfstudy.reporting.tables import Table
from rsfstudy.status import STATUS_LABELS, Status
from rsfstudy.storage import read_declaration

#: What laboratories call parameters, where not as they are called here.
_LABORATORY_NAMES = {
    "slip_distance": "Dc",
    "slip_distance_2": "Dc2",
    "mu_star": "mu_0",
    "stiffness": "k",
    "trend1": "trend",
}
#: Most fits beside each other.
_MAX_FITS_PER_TABLE = 3
#: What is told of a fit in short.
_SUMMARY_PARAMETERS = ("a", "b", "b1", "b2", "Dc")
#: How fits end that have numbers.
_ANSWER_LABELS = (Status.OK.label, Status.NOT_IDENTIFIED.label)
#: Error over the number beyond which neither is printed.
_MAX_RELATIVE_ERROR = 1e4
#: Difference of criteria that decides between laws.
_DECISIVE_AIC_DIFFERENCE = 10.0
#: Mark of standard errors that are not valid.
_INVALID_ERROR_MARK = "*"


def is_fit(dataset: xr.Dataset) -> bool:
    """True of fits of records."""
    return "rows_fitted" in dataset


def split_fits(dataset: xr.Dataset) -> list[xr.Dataset]:
    """The fits that a dataset holds, one by one; of several windows, that of the whole one."""
    if not is_fit(dataset):
        raise DataError("the dataset holds no fit: it is not what rsfstudy.fit gives")
    if "part" in dataset.dims:
        dataset = dataset.isel(part=0)
    dims = dataset["rows_fitted"].dims
    sizes = [dataset.sizes[d] for d in dims]
    return [dataset.isel(dict(zip(dims, at, strict=True))) for at in np.ndindex(*sizes)]


def record_and_step(one: xr.Dataset) -> dict[str, Any]:
    """Record and step of a fit, where there are several."""
    found = {n: one[n].item() for n in ("record", "step") if n in one.coords}
    return {n: value if n == "record" else int(value) for n, value in found.items()}


def parameter_headings(one: xr.Dataset) -> dict[str, str]:
    """Return the column headings of the fitted parameters, in the order of the table.

    Returns
    -------
    dict of str to str
        Name of each variable of the dataset, and its heading in the notation of laboratories, such
        as ``Dc`` and ``mu_0``.
    """
    names, found = [*map(str, one["parameter"].values), "a_minus_b"], {}
    for short in dict.fromkeys(("a", "b", "b1", "b2", "a_minus_b", *PARAMETERS)):
        for name in (n for n in names if split_window_number(n)[0] == short):
            found[name] = _LABORATORY_NAMES.get(short, short) + name.removeprefix(short)
    return found


def fit_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Return a table with one row per fit and the column names used in laboratories.

    Lengths are in um. The columns ``<name>_std`` contain standard errors. If the status of a row is
    ``errors_not_valid``, the standard errors of the row are not valid. The columns
    ``<name>_windows`` contain the range of a parameter over the windows. The column ``p_value``
    contains the p-value of the autocorrelation test of the whitened residuals. The column
    ``normal_stress`` contains the mean normal stress before the step in MPa, and ``k`` contains the
    stiffness divided by this normal stress, in 1/um. Parameters that were not free are NaN.
    """
    rows = []
    for one in split_fits(dataset):
        row: dict[str, Any] = dict(record_and_step(one))
        for name, short in parameter_headings(one).items():
            row[short] = one[name].item()
            row[f"{short}_std"] = one[f"{name}_stderr"].item()
            if f"{name}_windows" in one:
                row[f"{short}_windows"] = one[f"{name}_windows"].item()
        row |= {"V0": one["velocity_before"].item(), "V1": one["velocity_after"].item()}
        row |= {"law": one["law"].item() if "law" in one.coords else ""}
        row |= _normal_stresses_in_mpa(one)
        if "window_stiffness" in one and "stiffness" not in one["parameter"].values:
            row["k"] = one["window_stiffness"].item()
        row["window"] = f"{one['window_begins'].item():g} to {one['window_ends'].item():g}"
        row["R2"], row["criterion"] = one["r_squared"].item(), one["criterion"].item()
        row["p_value"], row["status"] = one["whiteness"].item(), status_label(one)
        rows.append(row)
    return pd.DataFrame(rows)


def _normal_stresses_in_mpa(one: xr.Dataset) -> dict[str, float]:
    """Return the normal stress before each step in MPa.

    If the fit has one step, the key is ``normal_stress``. If the fit has several steps, there is
    one numbered key per step. Normal stresses that are not finite are left out.
    """
    names = [str(n) for n in one.data_vars if str(n).startswith("normal_stress_before_")]
    stresses = {n: one[n].item() * 1e-6 for n in names or ["normal_stress_before"] if n in one}
    known = {n: stress for n, stress in stresses.items() if math.isfinite(stress)}
    return {n.replace("_before", ""): stress for n, stress in known.items()}


def status_label(one: xr.Dataset) -> str:
    """Label of the status of a fit."""
    return STATUS_LABELS[int(one["status"])]


# ---- as it is printed and shown -----------------------------------------------------------------


def all_answered(dataset: xr.Dataset) -> bool:
    """Return True if each fit has verified values and valid standard errors.

    The status ``not_identified`` counts as answered.
    """
    return all(status_label(one) in _ANSWER_LABELS for one in split_fits(dataset))


def fit_summary(dataset: xr.Dataset) -> Iterator[Table | str]:
    """All fits, and what is to be said of each; of several steps one row each in the end."""
    places: dict[str, list[xr.Dataset]] = {}
    for one in split_fits(dataset):
        where = ", ".join(f"{n} {value}" for n, value in record_and_step(one).items())
        places.setdefault(where, []).append(one)
    measure: Any = read_declaration(dataset).measure
    together = ", ".join(f"step {step} of {record}" for record, step in measure.get("together", ()))
    for where, fits in places.items():
        if together:
            yield f"together: {together}; the window is that of the first"
        for first in range(0, len(fits), _MAX_FITS_PER_TABLE):
            yield _parameter_table(where, fits[first : first + _MAX_FITS_PER_TABLE])
        for one in fits:
            yield from _remarks(one)
        yield from _law_comparison(fits)
    if len(places) > 1:
        yield Table([_summary_row(one) for fits in places.values() for one in fits], "Of all:")


def _law_comparison(fits: Sequence[xr.Dataset]) -> Iterator[str]:
    """Which law explains a record best, and whether by enough."""
    known = [(one["criterion"].item(), str(one["law"].item())) for one in fits]
    known = sorted(pair for pair in known if math.isfinite(pair[0]))
    if len(known) > 1:
        (best, law), (next_best, _other) = known[:2]
        by = next_best - best
        enough = (
            "decides"
            if by >= _DECISIVE_AIC_DIFFERENCE
            else f"does not decide: {_DECISIVE_AIC_DIFFERENCE:g} would"
        )
        yield f"{law} explains the record best; its criterion is lower by {by:.1f}, which {enough}"


def _summary_row(one: xr.Dataset) -> dict[str, str]:
    """Row of a fit in the table of all."""
    few = {
        n: format_with_stderr(one, name)
        for name, n in parameter_headings(one).items()
        if n in _SUMMARY_PARAMETERS
    }
    at = {n: str(value) for n, value in record_and_step(one).items()}
    return {**at, "law": str(one["law"].item()), **few, "status": status_label(one)}


def _parameter_table(where: str, fits: Sequence[xr.Dataset]) -> Table:
    columns = {str(one["law"].item()): _parameter_column(one) for one in fits}
    headings = next(iter(columns.values()))
    rows = [{"parameter": h, **{law: c[h] for law, c in columns.items()}} for h in headings]
    windows = (_describe_window(one) for one in fits if np.isfinite(one["rows_fitted"].item()))
    return Table(rows, "\n".join(filter(None, (where, next(windows, "")))))


def _parameter_column(one: xr.Dataset) -> dict[str, str]:
    """The parameters of a fit, how well it explains its rows, and the noise that is left."""
    found = {
        n + _bracketed_units(split_window_number(name)[0]): format_with_stderr(one, name)
        for name, n in parameter_headings(one).items()
    }
    if "window_stiffness" in one and "stiffness" not in one["parameter"].values:
        found["k" + _bracketed_units("stiffness")] = f"{one['window_stiffness'].item():.6g}"
    stresses = [f"{stress:.6g}" for stress in _normal_stresses_in_mpa(one).values()]
    if stresses:
        found["normal stress (MPa)"] = ", ".join(stresses)
    quality = dict.fromkeys(("R2", "criterion", "noise", "worth"), "-")
    if np.isfinite(one["rows_fitted"].item()):
        order = int(one["noise_order"].item())
        process = f"AR({order})" if order else "white"
        quality = {
            "R2": f"{one['r_squared'].item():.4f}",
            "criterion": f"{one['criterion'].item():.1f}",
            "noise": f"{process}, sd {one['noise_size'].item():.2g}",
            "worth": pluralize(round(one["effective_samples"].item()), "independent row"),
        }
    return found | quality | {"status": status_label(one)}


def _bracketed_units(name: str) -> str:
    """Units of a parameter, in brackets behind its name."""
    units = PARAMETERS[name].units if name in PARAMETERS else "1"
    if units.startswith("um-"):
        units = f"1/um^{units[3:]}".removesuffix("^1")
    return "" if units == "1" else f" ({units})"


def _describe_window(one: xr.Dataset) -> str:
    """The step and the window of a fit."""
    speeds = (one[n].item() for n in ("velocity_before", "velocity_after"))
    ends = (one[n].item() for n in ("window_begins", "window_ends"))
    rows = int(one["rows_fitted"].item())
    return (
        f"{' to '.join(f'{v:.4g}' for v in speeds)} um/s, "
        f"fitted from {' to '.join(f'{x:.6g}' for x in ends)} um, {rows:,} rows"
    )


def format_with_stderr(one: xr.Dataset, name: str) -> str:
    """Format a value with its standard error, rounded to two digits of the error.

    An asterisk marks a standard error that is not valid.
    """
    text = _format_rounded(one[name].item(), one[f"{name}_stderr"].item())
    is_marked = " +- " in text and status_label(one) == Status.ERRORS_NOT_VALID.label
    return text + _INVALID_ERROR_MARK * is_marked


def _format_rounded(value: float, error: float) -> str:
    """Format a value with its standard error, rounded to two digits of the error."""
    if not math.isfinite(value):
        return "-"
    if error > _MAX_RELATIVE_ERROR * abs(value) > 0.0:
        return "not told"
    if not (math.isfinite(error) and error > 0.0):
        return f"{value:.6g} +- {error:g}"
    digits = 1 - math.floor(math.log10(error))
    size = math.floor(math.log10(max(abs(value), error)))
    if -5 <= size < 6 and digits <= 9:
        digits = max(digits, 0)
        return f"{value:z.{digits}f} +- {error:.{digits}f}"
    scale = 10.0**size
    digits = max(digits + size, 0)
    return f"({value / scale:z.{digits}f} +- {error / scale:.{digits}f})e{size:+03d}"


def _remarks(one: xr.Dataset) -> Iterator[str]:
    """Yield remarks on a fit.

    The remarks are the message of the fit, the differences between windows, the intervals of the
    posterior, and the result of the autocorrelation test.
    """
    law, message = one["law"].item(), str(one["message"].item())
    if status_label(one) == Status.ERRORS_NOT_VALID.label:
        yield f"{law}: standard errors marked by {_INVALID_ERROR_MARK} are not valid: {message}"
    elif message:
        yield f"{law}: {status_label(one).replace('_', ' ')}: {message}"
    short = parameter_headings(one)
    spreads = ((short[n], one[f"{n}_windows"].item()) for n in short if f"{n}_windows" in one)
    if each := ", ".join(f"{n} {value:.2g}" for n, value in spreads if not math.isnan(value)):
        yield f"{law}: among windows parameters differ by {each}"
    if "posterior" in one and math.isfinite(one["autocorrelation_time"].item()):
        drawn = one["posterior"].quantile([0.025, 0.975], "draw")
        each = ", ".join(
            f"{short[str(of.parameter.values)]} {of.values[0]:.4g} to {of.values[1]:.4g}"
            for of in drawn.dropna("parameter").transpose("parameter", ...)
        )
        time = f"{one['autocorrelation_time'].item():.2g} steps"
        yield f"{law}: 95 % of the posterior: {each} (autocorrelation time {time})"
    p_value = one["whiteness"].item()
    if math.isfinite(p_value):
        order, rows = int(one["noise_order"]), int(one["rows_fitted"])
        yield f"{law}: {describe_whiteness(p_value, order, rows)}"
