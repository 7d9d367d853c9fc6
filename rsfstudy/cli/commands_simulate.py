"""The command `simulate`, and others with files of motions; how they are spelt is in
`command_line_simulate` and `command_line`.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import xarray as xr

from rsfstudy.api.accessor import Accessor
from rsfstudy.api.trajectory import BEYOND
from rsfstudy.api.trajectory import simulate as simulated
from rsfstudy.cli import assignments, terminal, terminal_numbers
from rsfstudy.cli.console import console
from rsfstudy.compute import provenance
from rsfstudy.declare.wording import stated
from rsfstudy.errors import InvalidValue
from rsfstudy.files import store
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Exit status where a motion passes the instability norm with neither mass nor damping.
_NO_PHYSICS = 3
#: Units of the rig in what is printed.
_UNITS = {"stress": "MPa", "length": "um", "time": "s"}


def simulate(
    settings: tuple[str, ...],
    protocol_file: Path | None,
    duration: str | None,
    against: str | None,
    rtol: float,
    budget: int,
    engine: str,
    output: Path,
    quiet: bool,
    **rig: str | None,
) -> int:
    """Follow one motion, draw it and write it."""
    check_replaceable(output.with_suffix(".nc"), _is_motion, "motion")
    fields, velocity = assignments.fields(settings), rig.pop("load_velocity")
    of_rig = {name: text for name, text in rig.items() if text is not None}
    laboratory = assignments.laboratory(of_rig) if of_rig else None
    if velocity is not None:
        fields["load_velocity"] = assignments.number_or_text(velocity)
    scene = _scene(fields, protocol_file, laboratory)
    lasts = None if duration is None else _duration(duration, laboratory)
    motion = simulated(scene, duration=lasts, rtol=rtol, budget=budget, engine=engine)
    motion = motion.assign_attrs(provenance.attributes(shlex.join(["rsfstudy", *sys.argv[1:]])))
    _write(motion, laboratory, output, against, quiet)
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


def _scene(
    fields: dict[str, Any], protocol_file: Path | None, laboratory: Laboratory | None
) -> Scene:
    if protocol_file is not None:
        fields["loading"] = assignments.from_table(protocol_file, laboratory)
    elif "loading" in fields:
        fields["loading"] = assignments.loading(fields["loading"], laboratory)
    return laboratory.scene(**fields) if laboratory else Scene(**fields)


def _duration(text: str, laboratory: Laboratory | None) -> float:
    """In D_c/V_*."""
    time = assignments.number_or_text(text)
    if laboratory is not None:
        return laboratory.dimensionless(time, name="--duration")
    if isinstance(time, str):
        remedy = "Give a number in D_c/V_*, or state the rig too."
        raise InvalidValue("--duration", time, "has units, and no rig is stated", remedy=remedy)
    return time


def _write(
    motion: xr.Dataset,
    laboratory: Laboratory | None,
    output: Path,
    against: str | None,
    quiet: bool,
) -> None:
    """The picture, and the data beside it."""
    data = output.with_suffix(".nc")
    said = f"{motion.attrs['status']} {motion.attrs['message']}".strip()
    if not motion.sizes["time"]:
        console.print(f"{said}\nnothing moved: there is nothing to draw or to keep")
        return
    store.write(laboratory.in_units(motion) if laboratory else motion, data)
    draw(motion, output, against, laboratory=laboratory)
    if not quiet:
        told = [motion, Accessor(motion).events()]
        if laboratory:
            told = [laboratory.in_units(of, **_UNITS) for of in told]
        terminal_numbers.record(told[0])
        terminal_numbers.events(told[1])
    console.print(f"{said}\nwrote {output} and {data}")


def draw(
    motion: xr.Dataset,
    path: Path,
    against: str | None,
    style: str | None = None,
    laboratory: Laboratory | None = None,
) -> None:
    """Draw a motion into a file."""
    from rsfstudy.plots._motion import picture

    terminal.write_figure(picture(motion, laboratory, against=against), path, style)


def show(answer: xr.Dataset) -> int:
    """Print what a motion, or another answer for one scene, holds, and where it comes from; FAILED
    where it ended early.
    """
    about, ours = answer.attrs, Accessor(answer)
    console.print(about.get("title", "answer for one scene"), style="bold")
    console.print(stated(ours.scene.as_dict()))
    made, source = (about.get(name, "unknown") for name in ("history", "source"))
    console.print(f"made by {made}, with {source}")
    if "load_point_displacement" in answer:
        terminal_numbers.record(answer)
        terminal_numbers.events(ours.events())
    else:
        for name, values in answer.data_vars.items():
            if not values.dims:
                console.print(f"{name} = {values.item()!r}")
    console.print(f"{about['status']} {about['message']}".strip())
    return terminal.OK if about["status"] == Status.OK.label else terminal.FAILED
