"""Numbers that commands print: how two files compare, and the peaks and events of a motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.api.tables import MOST_CELLS, Table, number
from rsfstudy.cli import layout
from rsfstudy.cli.console import console
from rsfstudy.declare.wording import listed, short, stated
from rsfstudy.errors import brief
from rsfstudy.files.comparison import Comparison
from rsfstudy.files.contents import provenance
from rsfstudy.vocabulary import coverage

#: Most cells that ended otherwise.
_MOST_ENDS = 10
#: What is printed of events; the last has units of a rig only.
_OF_EVENTS = {
    "time": "time",
    "duration": "duration",
    "interval": "interval",
    "slip": "slip",
    "static_stress_drop": "static drop",
    "dynamic_stress_drop": "dynamic drop",
    "peak_log10_slip_rate": "lg peak rate",
    "peak_slip_rate": "peak rate",
}
#: Most characters of a value that differs.
_MOST_CHARACTERS = 60


def comparison(files: Sequence[Path], datasets: Sequence[xr.Dataset], found: Comparison) -> int:
    """Print how two results files compare; 1 where a number or a status differs beyond the error
    estimates, or there is nothing to compare.
    """
    for letter, file, dataset in zip("AB", files, datasets, strict=True):
        about = provenance(dataset)
        console.print(f"{letter}: {file}, {about['time']}, {about['command']}")
    _pairs("declaration", found.declaration)
    _pairs("made by", found.origin)
    _cells(found)
    _ends(found.statuses)
    _agreement(found.numbers)
    for why in dict.fromkeys(found.left_out.values()):
        names = [name for name, reason in found.left_out.items() if reason == why]
        console.print(f"not compared, because {why}: {', '.join(names)}")
    console.print(_verdict(found), style="green" if found.agrees else "red")
    return 0 if found.agrees else 1


def _pairs(title: str, pairs: Mapping[str, tuple[Any, Any]]) -> None:
    """Print what is not the same in both."""
    heads = f"{title} differs", "A", "B"
    told = [(n, *(brief(short(v), _MOST_CHARACTERS) for v in both)) for n, both in pairs.items()]
    layout.show(Table([dict(zip(heads, row, strict=True)) for row in told], prose=heads))


def _cells(found: Comparison) -> None:
    """Print which cells both have, and which only one."""
    both, first, second = found.cells
    console.print(f"{both:,} cells in both, {first:,} only in A, {second:,} only in B")
    for axis, alone in found.points.items():
        for letter, points in zip("AB", alone, strict=True):
            if points:
                console.print(f"{axis} only in {letter} ({len(points)}): {listed(points)}")


def _ends(statuses: pd.DataFrame) -> None:
    """Print the cells that ended otherwise."""
    rows = []
    for row in statuses[:_MOST_ENDS].to_dict("records"):
        *place, (_, first), (_, second) = row.items()
        cell = stated({str(name): value for name, value in place})
        rows.append({"cell": cell, "A": first, "B": second})
    layout.show(Table(rows, prose={"cell"}))
    if len(statuses) > _MOST_ENDS:
        console.print(f"and {len(statuses) - _MOST_ENDS} more")


def _agreement(frame: pd.DataFrame) -> None:
    """Print the numbers that have an error estimate, and the others that are not the same."""
    rows = []
    for row in frame.to_dict("records"):
        known = not np.isnan(row["beyond_errors"])
        result = coverage(row["variable"]) == "modelResult"
        if result and (known or row["identical"] < row["values"]):
            rows.append({
                "variable": row["variable"],
                "values": str(row["values"]),
                "same": str(row["identical"]),
                "beyond errors": f"{row['beyond_errors']:.0f}" if known else "no estimate",
                "largest gap": number(row["largest_difference"], ".3g"),
            })  # fmt: skip
    layout.show(Table(rows))


def _verdict(found: Comparison) -> str:
    if not found.cells[0]:
        return "nothing to compare: no finished cell is in both"
    wrong = [f"{name} differs beyond error estimates" for name in found.beyond_errors]
    wrong += [f"{len(found.statuses)} cells ended otherwise"] if len(found.statuses) else []
    return "; ".join(wrong) or "nothing differs beyond error estimates"


def record(motion: xr.Dataset) -> None:
    """Print what a reader of a motion looks for first, if it moved at all."""
    if not motion.sizes["time"]:
        return
    time, friction = motion["time"], motion["friction_coefficient"]
    rate, per = motion.get("slip_rate"), "V_*"
    if rate is None:
        rate = 10.0 ** motion["log10_slip_rate"]
    else:
        per = str(rate.attrs["units"]).replace(" s-1", "/s")
    unit = time.attrs.get("scale", time.attrs["units"])
    told = {"duration": f"{float(time[-1]):.6g} {unit}"}
    for name, values, of in (("peak friction", friction, ""), ("peak slip rate", rate, f" {per}")):
        peak = int(np.argmax(values.values))
        told[name] = f"{float(values[peak]):.6g}{of} after {float(time[peak]):.6g} {unit}"
    if "instability_time" in motion:
        since = f"{float(motion['instability_time']):.6g} {unit}"
        told["beyond the instability norm"] = f"no physics after {since}"
    told["friction at the end"] = f"{float(friction[-1]):.6g}"
    layout.pairs(told)


def events(catalogue: xr.Dataset) -> None:
    """Print the events of a motion, without their errors."""
    limit = f"faster than {catalogue.attrs['slip_rate_threshold']:g} V_*"
    if not catalogue.sizes["event"]:
        console.print(f"no event {limit}")
        return
    names = {name: words for name, words in _OF_EVENTS.items() if name in catalogue}
    if "peak_slip_rate" in names:
        del names["peak_log10_slip_rate"]
    for name, words in names.items():
        about = catalogue[name].attrs
        unit = about.get("scale", about["units"]).replace(" s-1", "/s")
        names[name] = words if unit == "1" else f"{words} ({unit})"
    flags = catalogue["cut"].attrs["flag_meanings"].replace("whole", "-").split()
    shown = catalogue.isel(event=slice(MOST_CELLS))
    rows = []
    for place in shown["event"].values:
        event = shown.isel(event=place)
        row = {words: number(float(event[name]), ".4g") for name, words in names.items()}
        rows.append({**row, "cut": flags[int(event["cut"])].replace("_", " ")})
    layout.show(Table(rows, f"Events {limit}"))
    if left := catalogue.sizes["event"] - shown.sizes["event"]:
        console.print(f"and {left} more: dataset.rsf.events() has all, with their errors")
