"""Functions that list the stress drops in laboratory records."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.formatting import read_flag_meanings
from rsfstudy.reporting.text_tables import TextTable, format_number_or_dash, format_units

#: Variables of the printed table with their headings.
_HEADING_BY_EVENT_VARIABLE = {
    "time": "time",
    "displacement": "displacement",
    "duration": "duration",
    "interval": "interval",
    "static_stress_drop": "static stress drop",
    "static_stress_drop_error": "+- (95 %)",
    "dynamic_stress_drop": "dynamic stress drop",
    "slip": "slip",
    "peak_slip_rate": "peak slip rate",
}
#: Variables whose errors are printed in the same column.
_VARIABLES_WITH_ERROR_IN_COLUMN = ("dynamic_stress_drop", "slip", "peak_slip_rate")
#: Mark of a value that is a lower bound.
_LOWER_BOUND = ">= "
#: Maximum number of events that are printed.
_MAX_LISTED_EVENTS = 50


def build_record_events_tables_and_sentences(event_catalogue: xr.Dataset) -> list[TextTable | str]:
    """Build the printed summary of the stress drops in a record.

    Parameters
    ----------
    event_catalogue : xarray.Dataset
        Result of ``rsfstudy.events``.

    Returns
    -------
    list of TextTable or str
        Table of the first 50 events, and sentences about the detection.
    """
    count = event_catalogue.sizes["event"]
    heads = {
        name: words
        for name, words in _HEADING_BY_EVENT_VARIABLE.items()
        if name in event_catalogue and bool(np.isfinite(event_catalogue[name]).any())
    }
    flags = read_flag_meanings(event_catalogue["cut"].attrs) | {0: "-"}
    rows = []
    for place in range(min(count, _MAX_LISTED_EVENTS)):
        event = event_catalogue.isel(event=place)
        row = {"event": str(place + 1)}
        for name, words in heads.items():
            units = format_units(event_catalogue[name])
            heading = words if units == "1" else f"{words} ({units})"
            row[heading] = _format_event_value(event, name)
        rows.append({**row, "cut": flags[int(event["cut"])].replace("_", " ")})
    units = format_units(event_catalogue["noise"])
    stated = "" if units == "1" else f" {units}"
    pieces: list[TextTable | str] = [TextTable(rows)] if rows else []
    if count > len(rows):
        pieces.append(f"and {count - len(rows):,} more events")
    pieces.append(
        f"{count} drops of shear stress; smallest detectable drop: "
        f"{float(event_catalogue['smallest_drop']):.3g}{stated}; standard deviation of the noise: "
        f"{float(event_catalogue['noise']):.3g}{stated}"
    )
    if any(str(value).startswith(_LOWER_BOUND) for row in rows for value in row.values()):
        pieces.append(
            f"{_LOWER_BOUND.strip()} marks a lower bound: the sampling interval is too long to "
            "resolve the peak slip rate"
        )
    if event_catalogue.attrs["sign_of_shear_stress"] < 0:
        pieces.append("shear stress is negative in the record, so its sign was reversed")
    if processing := event_catalogue.attrs.get("processing"):
        pieces.append(str(processing))
    return pieces


def _format_event_value(event: xr.Dataset, name: str) -> str:
    """Format a quantity of an event, and append the error if it has no separate column."""
    value = format_number_or_dash(float(event[name]), ".4g")
    if name not in _VARIABLES_WITH_ERROR_IN_COLUMN or value == "-":
        return value
    error = float(event[f"{name}_error"])
    return f"{_LOWER_BOUND}{value}" if np.isnan(error) else f"{value} +- {error:.2g}"


def summarise_events_as_json_fields(event_catalogue: xr.Dataset) -> dict[str, Any]:
    """Return the stress drops in a record as numbers, strings and lists.

    Parameters
    ----------
    event_catalogue : xarray.Dataset
        Result of ``rsfstudy.events``.

    Returns
    -------
    dict of str to object
        Events with all variables, units by variable, and properties of the detection.
    """
    names = [
        str(name) for name in event_catalogue.data_vars if event_catalogue[name].dims == ("event",)
    ]
    flags = read_flag_meanings(event_catalogue["cut"].attrs)
    events = [
        {
            name: flags[int(value)] if name == "cut" else float(value)
            for name, value in ((name, event_catalogue[name].values[place]) for name in names)
        }
        for place in range(event_catalogue.sizes["event"])
    ]
    measured = [name for name in names if name != "cut"]
    return {
        "events": [{"event": n, **event} for n, event in enumerate(events, start=1)],
        "units": {name: event_catalogue[name].attrs.get("units") for name in measured},
        "noise": float(event_catalogue["noise"]),
        "smallest_drop": float(event_catalogue["smallest_drop"]),
        "sign_of_shear_stress": event_catalogue.attrs["sign_of_shear_stress"],
        "processing": event_catalogue.attrs.get("processing"),
        "comment": event_catalogue.attrs.get("comment"),
    }
