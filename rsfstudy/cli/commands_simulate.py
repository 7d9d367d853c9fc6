"""What the command `simulate` does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from rsfstudy.api import told
from rsfstudy.api.trajectory import BEYOND
from rsfstudy.api.trajectory import simulate as simulated
from rsfstudy.cli import assignments, layout, terminal
from rsfstudy.cli.console import console
from rsfstudy.cli.options import Given
from rsfstudy.compute import provenance
from rsfstudy.errors import InvalidValue
from rsfstudy.files import store
from rsfstudy.plots._motion import picture
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Exit status where a motion passes the instability norm with neither mass nor damping.
_NO_PHYSICS = 3
#: Units of the rig in what is printed.
_UNITS = {"stress": "MPa", "length": "um", "time": "s"}


def simulate(given: Given) -> int:
    """Follow one motion, draw it and write it."""
    check_replaceable(given.output.with_suffix(".nc"), _is_motion, "motion")
    scene, laboratory = _stated(given)
    motion = simulated(
        scene,
        duration=_duration(given.duration, laboratory),
        rtol=given.rtol,
        budget=given.budget,
        engine=given.engine,
    )
    motion = motion.assign_attrs(provenance.attributes(given.command))
    _write(motion, laboratory, given)
    if motion.attrs["status"] != Status.OK.label:
        return terminal.FAILED
    return _NO_PHYSICS if BEYOND in motion.attrs else terminal.OK


def check_replaceable(data: Path, is_one: Callable[[xr.Dataset], bool], kind: str) -> None:
    """What is there may be an earlier one of its kind, and nothing else."""
    if not data.exists():
        return
    try:
        with xr.open_dataset(data, engine="netcdf4") as there:
            if is_one(there):
                return
    except (OSError, RuntimeError, ValueError):
        pass  # whatever it is, it is none
    remedy = "Choose another --output, or move it away first."
    raise InvalidValue("--output", str(data), f"is there already, and no {kind}", remedy=remedy)


def _is_motion(there: xr.Dataset) -> bool:
    return "scene" in there.attrs and "time" in there.dims


def _stated(given: Given) -> tuple[Scene, Laboratory | None]:
    """The scene, and the rig if one is stated."""
    fields, rig = assignments.fields(given.settings), given.rig
    if (velocity := rig.pop("load_velocity", None)) is not None:
        fields["load_velocity"] = assignments.number_or_text(velocity)
    laboratory = assignments.laboratory(rig) if rig else None
    if given.protocol_file is not None:
        fields["loading"] = assignments.from_table(given.protocol_file, laboratory)
    elif "loading" in fields:
        fields["loading"] = assignments.loading(fields["loading"], laboratory)
    return (laboratory.scene(**fields) if laboratory else Scene(**fields)), laboratory


def _duration(text: str | None, laboratory: Laboratory | None) -> float | None:
    """In D_c/V_*."""
    time = None if text is None else assignments.number_or_text(text)
    if time is not None and laboratory is not None:
        return laboratory.dimensionless(time, name="--duration")
    if isinstance(time, str):
        remedy = "Give a number in D_c/V_*, or state the rig too."
        raise InvalidValue("--duration", time, "has units, and no rig is stated", remedy=remedy)
    return time


def _write(motion: xr.Dataset, laboratory: Laboratory | None, given: Given) -> None:
    """The picture, and the data beside it."""
    said = f"{motion.attrs['status']} {motion.attrs['message']}".strip()
    if not motion.sizes["time"]:
        console.print(f"{said}\nnothing moved: there is nothing to draw or to keep")
        return
    data = given.output.with_suffix(".nc")
    store.write(laboratory.in_units(motion) if laboratory else motion, data)
    terminal.write_figure(picture(motion, laboratory, against=given.against), given.output)
    if not given.quiet:
        found = [motion, motion.rsf.events()]
        if laboratory:
            found = [laboratory.in_units(of, **_UNITS) for of in found]
        layout.show(told.motion(found[0]))
        layout.show(told.events(found[1]))
    console.print(f"{said}\nwrote {given.output} and {data}")
