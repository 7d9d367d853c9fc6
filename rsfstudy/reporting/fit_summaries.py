"""Functions that build tables of fits and add remarks on each fit, for commands and reports."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import t as student_t

from rsfstudy.fitting import PARAMETERS, describe_whiteness, split_window_number
from rsfstudy.reporting.fit_tables import (
    find_normal_stresses_in_mpa,
    find_parameter_headings,
    find_record_and_step_of_fit,
    find_status_label_of_fit,
    find_stderr_of_fixed_stiffness,
    split_into_single_fits,
)
from rsfstudy.reporting.text_tables import TextTable, format_number_or_dash
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset

#: Maximum number of fits in one table. Each fit has one column.
_MAX_FITS_PER_TABLE = 3
#: Headings of the parameters in the table that has one row per fit.
_PARAMETERS_IN_FIT_SUMMARY = ("a", "b", "b1", "b2", "Dc")
#: Maximum ratio of the standard error of a parameter to its value. If the ratio is larger, neither
#: the value nor the standard error is printed.
_MAX_PRINTED_RELATIVE_ERROR = 1e4
#: If the AIC values of two friction laws differ by more than this limit, the comparison of the laws
#: is decisive.
_DECISIVE_AIC_DIFFERENCE = 10.0
#: Smallest half-width of the confidence intervals, in standard errors, at which a remark lists the
#: confidence intervals.
_MIN_REPORTED_HALF_WIDTH_IN_STDERRS = 2.5
#: Symbol that marks invalid standard errors.
_MARK_OF_INVALID_STDERRS = "*"


def summarise_fits(dataset: xr.Dataset) -> Iterator[TextTable | str]:
    """Yield tables of all fits, and remarks on each fit.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset from ``rsfstudy.fit``.

    Yields
    ------
    TextTable or str
        Parameter tables with up to three fits of the same step side by side. The tables are
        followed by remarks and a comparison of the laws. If there are several steps or records, a
        final table has one row per fit, and a sentence replaces the tables of each step that was
        not fitted.
    """
    places: dict[str, list[xr.Dataset]] = {}
    for one in split_into_single_fits(dataset):
        where = ", ".join(f"{n} {value}" for n, value in find_record_and_step_of_fit(one).items())
        places.setdefault(where, []).append(one)
    measure: Any = StoredDataset(dataset).study_declaration.measure
    together = ", ".join(f"step {step} of {record}" for record, step in measure.get("together", ()))
    several, unfitted = len(places) > 1, []
    for where, fits in places.items():
        if several and not any(np.isfinite(one["rows_fitted"].item()) for one in fits):
            yield _describe_unfitted_step(where, fits)
            unfitted.append(where)
            continue
        if together:
            yield f"joint fit: {together}; the window of the first step is shown"
        for first in range(0, len(fits), _MAX_FITS_PER_TABLE):
            yield _build_parameter_table(where, fits[first : first + _MAX_FITS_PER_TABLE])
        for one in fits:
            yield from _iterate_fit_remarks(one)
        yield from _compare_laws_by_aic(fits)
    fitted = [one for where, fits in places.items() if where not in unfitted for one in fits]
    if several and fitted:
        yield TextTable([_build_summary_row_of_fit(one) for one in fitted], "All fits:")


def _describe_unfitted_step(record_and_step: str, fits: Sequence[xr.Dataset]) -> str:
    """Return a sentence that explains why no law was fitted to a step."""
    reasons = {
        str(one["message"].item()) or find_status_label_of_fit(one).replace("_", " "): None
        for one in fits
    }
    return f"{record_and_step} is not fitted: {'; '.join(reasons)}"


def _compare_laws_by_aic(fits: Sequence[xr.Dataset]) -> Iterator[str]:
    """Yield a sentence that names the law with the lowest AIC.

    The sentence also states whether the AIC of the second-best law is significantly higher. If the
    standard errors of either law are not valid, the noise model is wrong and the difference cannot
    be interpreted.
    """
    invalid = {
        str(one["law"].item())
        for one in fits
        if find_status_label_of_fit(one) == Status.ERRORS_NOT_VALID.label
    }
    known = [(one["aic"].item(), str(one["law"].item())) for one in fits]
    known = sorted(pair for pair in known if math.isfinite(pair[0]))
    if len(known) > 1:
        (best, law), (next_best, second) = known[:2]
        by = next_best - best
        if {law, second} & invalid:
            yield (
                f"{law} has the lowest AIC, by {by:.1f}, but the difference is not conclusive, "
                "because the AIC requires valid standard errors"
            )
            return
        enough = (
            "decisive"
            if by >= _DECISIVE_AIC_DIFFERENCE
            else f"not decisive ({_DECISIVE_AIC_DIFFERENCE:g} is required)"
        )
        yield f"{law} fits best: its AIC is lower by {by:.1f}, which is {enough}"


def _build_summary_row_of_fit(fit: xr.Dataset) -> dict[str, str]:
    """Return the row that represents a fit in the summary table."""
    few = {
        n: format_parameter_with_stderr(fit, name)
        for name, n in find_parameter_headings(fit).items()
        if n in _PARAMETERS_IN_FIT_SUMMARY
    }
    at = {n: str(value) for n, value in find_record_and_step_of_fit(fit).items()}
    return {**at, "law": str(fit["law"].item()), **few, "status": find_status_label_of_fit(fit)}


def _build_parameter_table(table_title: str, fits: Sequence[xr.Dataset]) -> TextTable:
    """Return a table of the parameters with one column per fit."""
    columns = {str(one["law"].item()): _build_parameter_column(one) for one in fits}
    # A law that could not be fitted has no normal stress, so its column is shorter.
    headings = max(columns.values(), key=len)
    rows = [
        {"parameter": h, **{law: c.get(h, "-") for law, c in columns.items()}} for h in headings
    ]
    windows = (_describe_fit_window(one) for one in fits if np.isfinite(one["rows_fitted"].item()))
    return TextTable(rows, "\n".join(filter(None, (table_title, next(windows, "")))))


def _build_parameter_column(fit: xr.Dataset) -> dict[str, str]:
    """Build the table column that shows the parameters, quality and noise of a fit."""
    found = {
        n + _format_units_in_brackets(split_window_number(name)[0]): format_parameter_with_stderr(
            fit, name
        )
        for name, n in find_parameter_headings(fit).items()
    }
    if "window_stiffness" in fit and "stiffness" not in fit["parameter"].values:
        value, stderr = fit["window_stiffness"].item(), find_stderr_of_fixed_stiffness(fit)
        text = (
            format_value_with_stderr(value, stderr)
            if stderr
            else format_number_or_dash(value, ".6g")
        )
        found["k" + _format_units_in_brackets("stiffness")] = text
    stresses = [f"{stress:.6g}" for stress in find_normal_stresses_in_mpa(fit).values()]
    if stresses:
        found["normal stress (MPa)"] = ", ".join(stresses)
    quality = dict.fromkeys(("R2", "AIC", "noise", "effective sample size"), "-")
    if np.isfinite(fit["rows_fitted"].item()):
        order = int(fit["noise_order"].item())
        process = f"AR({order})" if order else "white"
        quality = {
            "R2": f"{fit['r_squared'].item():.4f}",
            "AIC": f"{fit['aic'].item():.1f}",
            "noise": f"{process}, sd {fit['noise_sd'].item():.2g}",
            "effective sample size": f"{fit['n_eff'].item():.0f}",
        }
    return found | quality | {"status": find_status_label_of_fit(fit)}


def _format_units_in_brackets(parameter_name: str) -> str:
    """Return the units of a parameter in brackets.

    The string is empty if the parameter is dimensionless.
    """
    units = PARAMETERS[parameter_name].units if parameter_name in PARAMETERS else "1"
    if units.startswith("um-"):
        units = f"1/um^{units[3:]}".removesuffix("^1")
    return "" if units == "1" else f" ({units})"


def _describe_fit_window(fit: xr.Dataset) -> str:
    """Describe the velocities before and after the step, and the fitted window."""
    speeds = (fit[n].item() for n in ("velocity_before", "velocity_after"))
    ends = (fit[n].item() for n in ("window_begins", "window_ends"))
    rows = int(fit["rows_fitted"].item())
    return (
        f"{' to '.join(f'{v:.4g}' for v in speeds)} um/s, "
        f"fitted from {' to '.join(f'{x:.6g}' for x in ends)} um, {rows:,} rows"
    )


def format_parameter_with_stderr(fit: xr.Dataset, parameter_name: str) -> str:
    """Format the value of a fitted parameter with its standard error.

    The error is rounded to two significant digits, and the value is rounded to the same decimal
    place.

    Parameters
    ----------
    fit : xarray.Dataset
        Dataset with a single fit.
    parameter_name : str
        Name of the parameter.

    Returns
    -------
    str
        Formatted parameter. An asterisk marks a standard error that is not valid.
    """
    text = format_value_with_stderr(
        fit[parameter_name].item(), fit[f"{parameter_name}_stderr"].item()
    )
    is_marked = " +- " in text and find_status_label_of_fit(fit) == Status.ERRORS_NOT_VALID.label
    return text + _MARK_OF_INVALID_STDERRS * is_marked


def format_value_with_stderr(value: float, stderr: float) -> str:
    """Format a value with its standard error.

    The error is rounded to two significant digits, and the value is rounded to the same decimal
    place.

    Parameters
    ----------
    value, stderr : float
        Value and standard error.

    Returns
    -------
    str
        Formatted value and error, or a dash if the value is not finite.
    """
    if not math.isfinite(value):
        return "-"
    if stderr > _MAX_PRINTED_RELATIVE_ERROR * abs(value) > 0.0:
        return "unconstrained"
    if not (math.isfinite(stderr) and stderr > 0.0):
        return f"{value:.6g} +- {stderr:g}"
    digits = 1 - math.floor(math.log10(stderr))
    size = math.floor(math.log10(max(abs(value), stderr)))
    if -5 <= size < 6 and digits <= 9:
        digits = max(digits, 0)
        return f"{value:z.{digits}f} +- {stderr:.{digits}f}"
    scale = 10.0**size
    digits = max(digits + size, 0)
    return f"({value / scale:z.{digits}f} +- {stderr / scale:.{digits}f})e{size:+03d}"


def _describe_wide_confidence_intervals(fit: xr.Dataset) -> Iterator[str]:
    """Yield a sentence that lists the confidence intervals if there are few degrees of freedom.

    The half-width of the intervals is then much larger than two standard errors. Fits with
    unconstrained parameters or invalid standard errors are omitted.
    """
    freedom = fit["degrees_of_freedom"].item() if "degrees_of_freedom" in fit else math.nan
    half_width = float(student_t.ppf(0.975, freedom)) if freedom > 0.0 else math.nan
    if (
        find_status_label_of_fit(fit) != Status.OK.label
        or not half_width >= _MIN_REPORTED_HALF_WIDTH_IN_STDERRS
    ):
        return
    ends = (
        (heading, fit[f"{name}_ci_low"].item(), fit[f"{name}_ci_high"].item())
        for name, heading in find_parameter_headings(fit).items()
        if f"{name}_ci_low" in fit
    )
    each = ", ".join(f"{n} {low:.4g} to {high:.4g}" for n, low, high in ends if math.isfinite(low))
    yield (
        f"{fit['law'].item()}: the fit has {freedom:.2g} degrees of freedom, so the half-width of "
        f"95 % confidence intervals is about {half_width:.1f} standard errors: {each}"
    )


def _iterate_fit_remarks(fit: xr.Dataset) -> Iterator[str]:
    """Yield remarks on a fit.

    The remarks include the message of the fit and the result of the autocorrelation test. If the
    fit has few degrees of freedom, the remarks include the confidence intervals. If the
    record was fitted with several windows, the remarks include the differences between the windows.
    If there are posterior samples, the remarks include credible intervals.
    """
    law, message = fit["law"].item(), str(fit["message"].item())
    if find_status_label_of_fit(fit) == Status.ERRORS_NOT_VALID.label:
        mark = _MARK_OF_INVALID_STDERRS
        yield f"{law}: standard errors marked by {mark} are not valid: {message}"
    elif message:
        yield f"{law}: {find_status_label_of_fit(fit).replace('_', ' ')}: {message}"
    yield from _describe_wide_confidence_intervals(fit)
    short = find_parameter_headings(fit)
    spreads = ((short[n], fit[f"{n}_windows"].item()) for n in short if f"{n}_windows" in fit)
    if each := ", ".join(f"{n} {value:.2g}" for n, value in spreads if not math.isnan(value)):
        yield f"{law}: range of the parameters over the windows: {each}"
    if "posterior" in fit and math.isfinite(fit["autocorrelation_time"].item()):
        drawn = fit["posterior"].dropna("parameter", how="all").quantile([0.025, 0.975], "draw")
        each = ", ".join(
            f"{short[str(of.parameter.values)]} {of.values[0]:.4g} to {of.values[1]:.4g}"
            for of in drawn.transpose("parameter", ...)
        )
        time = f"{fit['autocorrelation_time'].item():.2g} steps"
        yield f"{law}: 95 % credible intervals: {each} (autocorrelation time {time})"
    p_value = fit["p_value"].item()
    if math.isfinite(p_value):
        order, rows = int(fit["noise_order"]), int(fit["rows_fitted"])
        yield f"{law}: {describe_whiteness(p_value, order, rows)}"
