"""Catalogues of events as datasets: the quantities of an event, in the units of what it was read
from.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.quantity import Quantity

#: The numbers of an event, each with its error, and which part of it is missing, by its flag.
Found = tuple[dict[str, tuple[float, float]], int]

_QUANTITIES = (
    Quantity("time", "", "1", "time at which the event begins", "D_c/V_*"),
    Quantity("duration", "", "1", "duration of the event", "D_c/V_*"),
    Quantity("interval", "", "1", "time since the event before began", "D_c/V_*"),
    Quantity("peak_log10_slip_rate", "", "1", "decimal logarithm of peak slip rate over V_star"),
    Quantity("peak_slip_rate", "", "1", "peak slip rate", "V_*"),
    Quantity("slip", "", "1", "slip during the event", "D_c"),
    Quantity("stress_before", "", "1", "highest shear stress before the event", "sigma_*"),
    Quantity("stress_after", "", "1", "lowest shear stress after the event", "sigma_*"),
    Quantity("static_stress_drop", "", "1", "highest less lowest shear stress", "sigma_*"),
    Quantity(
        "dynamic_stress_drop",
        "",
        "1",
        "highest shear stress less that at peak slip rate",
        "sigma_*",
    ),
)
#: What part of an event is missing, by its flag.
_CUT = ("whole", "begins_before", "lasts_beyond", "both")


def catalogue(found: Sequence[Found], about: Mapping[str, Mapping[Any, Any]]) -> xr.Dataset:
    """Events as a dataset, in the units of what they were read from."""
    rows = [numbers for numbers, _cut in found]
    for row, earlier in zip(rows, [{}, *rows], strict=False):
        (time, error), (before, unsure) = row["time"], earlier.get("time", (math.nan, math.nan))
        row["interval"] = time - before, error + unsure
    dataset = xr.Dataset(coords={"event": np.arange(len(rows))})
    for quantity in _QUANTITIES:
        if rows and quantity.name not in rows[0]:
            continue
        units = _units(quantity, about)
        for place, (name, of) in enumerate((("", ""), ("_error", "error estimate of "))):
            values = np.array([row[quantity.name][place] for row in rows])
            attrs = {"long_name": of + quantity.long_name, **units}
            dataset[quantity.name + name] = ("event", values, attrs)
    dataset["cut"] = (
        "event",
        np.array([cut for _numbers, cut in found], dtype=np.int8),
        {
            "long_name": "what of the event the record leaves out",
            "flag_values": np.arange(len(_CUT), dtype=np.int8),
            "flag_meanings": " ".join(_CUT),
        },
    )
    return dataset.assign_attrs(title="Catalogue of events", Conventions="CF-1.11")


#: What quantities are measured in: as these variables, by their scales.
_MEASURED_AS = {"D_c/V_*": "time", "D_c": "slip", "sigma_*": "shear_stress"}


def _units(quantity: Quantity, about: Mapping[str, Mapping[Any, Any]]) -> dict[str, str]:
    """Units and scale of a quantity, where times, slip and stresses have theirs."""
    if quantity.scale in _MEASURED_AS:
        source = about[_MEASURED_AS[quantity.scale]]
        return {key: str(source[key]) for key in ("units", "scale") if key in source}
    if quantity.scale:
        if "scale" in about["slip"]:
            return {"units": quantity.units, "scale": quantity.scale}
        time, slip = (about[name].get("units") for name in ("time", "slip"))
        return {"units": f"{slip} {time}-1"} if time and slip else {}
    return {"units": quantity.units}
