"""Numbers that commands print: the headline of a results file, how two files compare, and the
peaks of a motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from rich import box
from rich.table import Column, Table

from rsfstudy.cli.console import console
from rsfstudy.declare.wording import listed, short
from rsfstudy.errors import brief
from rsfstudy.files import numbers
from rsfstudy.files.comparison import Comparison
from rsfstudy.files.contents import provenance
from rsfstudy.rig.scales import in_units_of_rig, renamed
from rsfstudy.status import Status
from rsfstudy.vocabulary import coverage, quantity

#: Most cells of a lattice that are shown, and most that ended otherwise.
_MOST_CELLS, _MOST_ENDS = 24, 10
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


def headline(dataset: xr.Dataset) -> None:
    """Print the headline along the axes, with its error estimate and how each cell ended."""
    name = numbers.headline(dataset)
    if name is None:
        return
    dataset = in_units_of_rig(dataset)
    name = name if name in dataset else renamed(name)
    status = dataset["status"]
    dims = [str(d) for d in status.dims]
    at = numbers.sample({d: status.sizes[d] for d in dims}, _MOST_CELLS)
    shown = [n for n in (name, f"{name}_error", "status") if n in dataset]
    few = dataset[shown].isel(at).transpose(*dims).load()
    has_error = f"{name}_error" in few
    others = bool((few["status"] != int(Status.OK)).any())
    table = Table(
        *(Column(with_units(dataset[d]), overflow="fold") for d in dims),
        Column(name, justify="right", overflow="fold"),
        *([Column("error", justify="right")] if has_error else []),
        *(["status"] if others else []),
        box=box.SIMPLE_HEAD,
    )
    labels = {int(s): s.label for s in Status}
    for index in np.ndindex(few["status"].shape):
        cell = few.isel(dict(zip(dims, index, strict=True)))
        row = [short(cell[d].item()) for d in dims]
        row.append(_number(cell[name].item()))
        row += [_number(cell[f"{name}_error"].item(), ".1e")] if has_error else []
        row += [labels[int(cell["status"])]] if others else []
        table.add_row(*row)
    console.print(f"\n{_caption(dataset, name, few['status'].size)}")
    console.print(table)


def _caption(dataset: xr.Dataset, name: str, shown: int) -> str:
    """Meaning of the headline, its units, and how much of it is shown."""
    about, cells = dataset[name].attrs, dataset["status"].size
    units = about.get("scale") or about.get("units", "1")
    text = about.get("long_name", name) + (f", in {units}" if units != "1" else "")
    return text if shown == cells else f"{text} ({shown} of {cells:,} cells)"


def with_units(along: xr.DataArray) -> str:
    """The name of an axis, and its units where it is that of a rig."""
    name, units = str(along.name), along.attrs.get("units", "1")
    return name if units in ("1", quantity(name).units) else f"{name} ({units})"


def _number(value: float, form: str = ".8g") -> str:
    return "-" if np.isnan(value) else format(value, form)


# ---- two files ----------------------------------------------------------------------------------


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
    table = Table(Column(f"{title} differs", overflow="fold"), "A", "B", box=box.SIMPLE_HEAD)
    for name, values in pairs.items():
        table.add_row(name, *(brief(short(value), _MOST_CHARACTERS) for value in values))
    if pairs:
        console.print(table)


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
    if statuses.empty:
        return
    table = Table("cell", "A", "B", box=box.SIMPLE_HEAD)
    for row in statuses[:_MOST_ENDS].to_dict("records"):
        *place, (_, first), (_, second) = row.items()
        table.add_row(", ".join(f"{n} = {short(v)}" for n, v in place), first, second)
    console.print(table)
    if len(statuses) > _MOST_ENDS:
        console.print(f"and {len(statuses) - _MOST_ENDS} more")


def _agreement(frame: pd.DataFrame) -> None:
    """Print the numbers that have an error estimate, and the others that are not the same."""
    table = Table(
        Column("variable", overflow="fold"),
        *(Column(n, justify="right") for n in ("values", "same", "beyond errors")),
        Column("largest gap", justify="right"),
        box=box.SIMPLE_HEAD,
    )
    for row in frame.to_dict("records"):
        known = not np.isnan(row["beyond_errors"])
        result = coverage(row["variable"]) == "modelResult"
        if result and (known or row["identical"] < row["values"]):
            beyond = f"{row['beyond_errors']:.0f}" if known else "no estimate"
            gap = _number(row["largest_difference"], ".3g")
            table.add_row(row["variable"], str(row["values"]), str(row["identical"]), beyond, gap)
    console.print(table)


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
    table = Table("", "", "", box=None, show_header=False)
    table.add_row("duration", f"{float(time[-1]):.6g} {unit}", "")
    for name, values, of in (("peak friction", friction, ""), ("peak slip rate", rate, per)):
        peak = int(np.argmax(values.values))
        at = f"after {float(time[peak]):.6g} {unit}"
        table.add_row(name, f"{float(values[peak]):.6g} {of}", at)
    if "instability_time" in motion:
        since = f"after {float(motion['instability_time']):.6g} {unit}"
        table.add_row("beyond the instability norm", "no physics", since)
    table.add_row("friction at the end", f"{float(friction[-1]):.6g}", "")
    console.print(table)


def events(catalogue: xr.Dataset) -> None:
    """Print the events of a motion, without their errors."""
    limit = f"faster than {catalogue.attrs['slip_rate_threshold']:g} V_*"
    if not catalogue.sizes["event"]:
        console.print(f"no event {limit}")
        return
    table = Table(box=None, pad_edge=False, title=f"Events {limit}")
    names = {name: words for name, words in _OF_EVENTS.items() if name in catalogue}
    if "peak_slip_rate" in names:
        del names["peak_log10_slip_rate"]
    for name, words in names.items():
        about = catalogue[name].attrs
        unit = about.get("scale", about["units"]).replace(" s-1", "/s")
        table.add_column(words if unit == "1" else f"{words}\n{unit}", justify="right")
    flags = catalogue["cut"].attrs["flag_meanings"].replace("whole", "-").split()
    table.add_column("cut")
    shown = catalogue.isel(event=slice(_MOST_CELLS))
    for place in shown["event"].values:
        event = shown.isel(event=place)
        values = ["" if np.isnan(event[n]) else f"{float(event[n]):.4g}" for n in names]
        table.add_row(*values, flags[int(event["cut"])].replace("_", " "))
    console.print(table)
    if left := catalogue.sizes["event"] - shown.sizes["event"]:
        console.print(f"and {left} more: dataset.rsf.events() has all, with their errors")
