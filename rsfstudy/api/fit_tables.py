"""Tables of fits, those of one step beside each other, as a command prints them and a report shows
them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.analysis.fitting.joint import plain
from rsfstudy.api import fit_results
from rsfstudy.api.tables import Table
from rsfstudy.files import contents
from rsfstudy.status import Status

#: Most fits beside each other.
_BESIDE = 3
#: How fits end that have numbers.
_ANSWERS = (Status.OK.label, Status.NOT_IDENTIFIED.label)
#: Error over the number beyond which neither is printed.
_BOUNDLESS = 1e4
#: Chance below which residuals are called correlated.
_CHANCE = 0.01


def answered(dataset: xr.Dataset) -> bool:
    """True where every fit has numbers that are verified."""
    return all(fit_results.status(one) in _ANSWERS for one in fit_results.cells(dataset))


def told(dataset: xr.Dataset) -> Iterator[Table | str]:
    """All fits, and what is to be said of each; of several steps one row each in the end."""
    places: dict[str, list[xr.Dataset]] = {}
    for one in fit_results.cells(dataset):
        where = ", ".join(f"{n} {value}" for n, value in fit_results.place(one).items())
        places.setdefault(where, []).append(one)
    measure: Any = contents.declaration(dataset).measure
    together = ", ".join(f"step {step} of {record}" for record, step in measure.get("together", ()))
    for where, fits in places.items():
        if together:
            yield f"together: {together}; the window is that of the first"
        for first in range(0, len(fits), _BESIDE):
            yield _table(where, fits[first : first + _BESIDE])
        for one in fits:
            yield from _remarks(one)
    if len(places) > 1:
        yield Table([_row(one) for fits in places.values() for one in fits], "Of all:")


def _row(one: xr.Dataset) -> dict[str, str]:
    """A fit in short."""
    short = {called: name for name, (called, _units) in fit_results.shown(one).items()}
    few: dict[str, str] = {
        n: with_error(one, short[n]) for n in ("a", "b", "b1", "b2", "Dc") if n in short
    }
    place = {n: str(value) for n, value in fit_results.place(one).items()}
    return {**place, "law": str(one["law"].item()), **few, "status": fit_results.status(one)}


def _table(where: str, fits: Sequence[xr.Dataset]) -> Table:
    columns = {str(one["law"].item()): _column(one) for one in fits}
    headings = next(iter(columns.values()))
    rows = [{"parameter": h, **{law: c[h] for law, c in columns.items()}} for h in headings]
    windows = (_window(one) for one in fits if np.isfinite(one["rows_fitted"].item()))
    return Table(rows, "\n".join(filter(None, (where, next(windows, "")))))


def _column(one: xr.Dataset) -> dict[str, str]:
    """The parameters of a fit, how well it explains its rows, and the noise that is left."""
    found = {
        f"{short} ({units})" if units else short: with_error(one, name)
        for name, (short, units) in fit_results.shown(one).items()
    }
    quality = dict.fromkeys(("R2", "criterion", "noise", "worth"), "-")
    if np.isfinite(one["rows_fitted"].item()):
        order = int(one["noise_order"].item())
        process = f"AR({order})" if order else "white"
        quality = {
            "R2": f"{one['r_squared'].item():.4f}",
            "criterion": f"{one['criterion'].item():.1f}",
            "noise": f"{process}, sd {one['noise_size'].item():.2g}",
            "worth": f"{one['effective_samples'].item():,.0f} independent rows",
        }
    return found | quality | {"status": fit_results.status(one)}


def _window(one: xr.Dataset) -> str:
    """The step and the window of a fit."""
    speeds = (one[n].item() for n in ("velocity_before", "velocity_after"))
    ends = (one[n].item() for n in ("window_begins", "window_ends"))
    rows = int(one["rows_fitted"].item())
    return (
        f"{' to '.join(f'{v:.4g}' for v in speeds)} um/s, "
        f"fitted from {' to '.join(f'{x:.6g}' for x in ends)} um, {rows:,} rows"
    )


def with_error(one: xr.Dataset, name: str) -> str:
    """A number and its standard error, to two digits of the error."""
    value, error = one[name].item(), one[f"{name}_stderr"].item()
    if not math.isfinite(value):
        return "-"
    if error > _BOUNDLESS * abs(value) > 0.0:
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
    """What a fit does not tell, and whether noise is left that the errors do not count."""
    law, message = one["law"].item(), str(one["message"].item())
    if message:
        yield f"{law}: {fit_results.status(one).replace('_', ' ')}: {message}"
    spreads = {n: one[f"{n}_windows"] for n in fit_results.shown(one) if f"{n}_windows" in one}
    if spreads:
        each = ", ".join(
            f"{fit_results.SHORT[plain(n)][0]} {v.item():.2g}" for n, v in spreads.items()
        )
        yield f"{law}: among windows parameters differ by {each}"
    if "posterior" in one and math.isfinite(one["autocorrelation_time"].item()):
        drawn = one["posterior"].quantile([0.025, 0.975], "draw")
        ends = {n: drawn.sel(parameter=n).values for n in map(str, one["parameter"].values)}
        short = fit_results.shown(one)
        each = ", ".join(
            f"{short[n][0]} {low:.4g} to {high:.4g}" for n, (low, high) in ends.items()
        )
        time = f"{one['autocorrelation_time'].item():.2g} steps"
        yield f"{law}: 95 % of the posterior: {each} (autocorrelation time {time})"
    chance = one["whiteness"].item()
    if math.isfinite(chance):
        verdict = "white" if chance > _CHANCE else "still correlated"
        yield f"{law}: residuals freed of correlation are {verdict} (chance {chance:.2g})"
