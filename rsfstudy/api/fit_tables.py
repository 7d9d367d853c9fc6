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
    """All fits, and what is to be said of each."""
    places: dict[tuple[str, ...], list[xr.Dataset]] = {}
    for one in fit_results.cells(dataset):
        where = tuple(f"{n} {value}" for n, value in fit_results.place(one).items())
        places.setdefault(where, []).append(one)
    measure: Any = contents.declaration(dataset).measure
    together = measure.get("together", ())
    for where, fits in places.items():
        if together:
            each = ", ".join(f"step {step} of {record}" for record, step in together)
            yield f"together: {each}; the window is that of the first"
        for first in range(0, len(fits), _BESIDE):
            yield _table(", ".join(where), fits[first : first + _BESIDE])
        for one in fits:
            yield from _remarks(one)


def _table(where: str, fits: Sequence[xr.Dataset]) -> Table:
    has = [np.isfinite(one["rows_fitted"].item()) for one in fits]
    window = _window(fits[has.index(True)]) if any(has) else ""
    lines: dict[str, list[str]] = {}
    for name, (short, units) in fit_results.shown(fits[0]).items():
        lines[f"{short} ({units})" if units else short] = [with_error(one, name) for one in fits]
    told = [_quality(one) if fitted else {} for one, fitted in zip(fits, has, strict=True)]
    for heading in ("R2", "criterion", "noise", "worth"):
        lines[heading] = [one.get(heading, "-") for one in told]
    lines["status"] = [fit_results.status(one) for one in fits]
    laws = [str(one["law"].item()) for one in fits]
    rows = [
        {"parameter": heading, **dict(zip(laws, texts, strict=True))}
        for heading, texts in lines.items()
    ]
    return Table(rows, "\n".join(filter(None, (where, window))))


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
        return f"{value:.{digits}f} +- {error:.{digits}f}"
    scale = 10.0**size
    digits = max(digits + size, 0)
    return f"({value / scale:.{digits}f} +- {error / scale:.{digits}f})e{size:+03d}"


def _quality(one: xr.Dataset) -> dict[str, str]:
    """How well a fit explains its rows, and the noise that is left."""
    order = int(one["noise_order"].item())
    process = f"AR({order})" if order else "white"
    return {
        "R2": f"{one['r_squared'].item():.4f}",
        "criterion": f"{one['criterion'].item():.1f}",
        "noise": f"{process}, sd {one['noise_size'].item():.2g}",
        "worth": f"{one['effective_samples'].item():,.0f} independent rows",
    }


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
