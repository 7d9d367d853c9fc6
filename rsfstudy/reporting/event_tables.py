"""Tables of the stress drops in laboratory records."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.formatting import read_flag_meanings
from rsfstudy.reporting.tables import TextTable, format_number_or_dash, format_units

#: Variables of the printed table with their headings.
_HEADINGS = {
    "time": "time",
    "displacement": "displacement",
    "duration": "duration",
    "interval": "interval",
    "static_stress_drop": "static stress drop",
    "static_stress_drop_error": "+-",
    "dynamic_stress_drop": "dynamic stress drop",
    "slip": "slip",
    "peak_slip_rate": "peak slip rate",
}
#: Maximum number of events that are printed.
_MAX_LISTED_EVENTS = 50


def build_record_events_pieces(catalogue: xr.Dataset) -> list[TextTable | str]:
    """Build the printed summary of the stress drops in a record.

    Parameters
    ----------
    catalogue : xarray.Dataset
        Result of ``rsfstudy.events``.

    Returns
    -------
    list of TextTable or str
        Table of the first 50 events, and sentences about the detection.
    """
    count = catalogue.sizes["event"]
    heads = {
        name: words
        for name, words in _HEADINGS.items()
        if name in catalogue and bool(np.isfinite(catalogue[name]).any())
    }
    flags = read_flag_meanings(catalogue["cut"].attrs) | {0: "-"}
    rows = []
    for place in range(min(count, _MAX_LISTED_EVENTS)):
        event = catalogue.isel(event=place)
        row = {"event": str(place + 1)}
        for name, words in heads.items():
            units = format_units(catalogue[name])
            heading = words if units == "1" or words == "+-" else f"{words} ({units})"
            row[heading] = format_number_or_dash(float(event[name]), ".4g")
        rows.append({**row, "cut": flags[int(event["cut"])].replace("_", " ")})
    units = format_units(catalogue["noise"])
    stated = "" if units == "1" else f" {units}"
    pieces: list[TextTable | str] = [TextTable(rows)] if rows else []
    if count > len(rows):
        pieces.append(f"and {count - len(rows):,} more events")
    pieces.append(
        f"{count} drops of shear stress; smallest detectable drop: "
        f"{float(catalogue['smallest_drop']):.3g}{stated}; standard deviation of the noise: "
        f"{float(catalogue['noise']):.3g}{stated}"
    )
    if catalogue.attrs["sign_of_shear_stress"] < 0:
        pieces.append("shear stress is negative in the record, so its sign was reversed")
    if processing := catalogue.attrs.get("processing"):
        pieces.append(str(processing))
    return pieces


def list_record_events(catalogue: xr.Dataset) -> dict[str, Any]:
    """Return the stress drops in a record as numbers, strings and lists.

    Parameters
    ----------
    catalogue : xarray.Dataset
        Result of ``rsfstudy.events``.

    Returns
    -------
    dict of str to object
        Events with all variables, units by variable, and properties of the detection.
    """
    names = [str(name) for name in catalogue.data_vars if catalogue[name].dims == ("event",)]
    flags = read_flag_meanings(catalogue["cut"].attrs)
    events = [
        {
            name: flags[int(value)] if name == "cut" else float(value)
            for name, value in ((name, catalogue[name].values[place]) for name in names)
        }
        for place in range(catalogue.sizes["event"])
    ]
    measured = [name for name in names if name != "cut"]
    return {
        "events": [{"event": n, **event} for n, event in enumerate(events, start=1)],
        "units": {name: catalogue[name].attrs.get("units") for name in measured},
        "noise": float(catalogue["noise"]),
        "smallest_drop": float(catalogue["smallest_drop"]),
        "sign_of_shear_stress": catalogue.attrs["sign_of_shear_stress"],
        "processing": catalogue.attrs.get("processing"),
        "comment": catalogue.attrs.get("comment"),
    }
