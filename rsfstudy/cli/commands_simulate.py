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
from rsfstudy.declare.wording import short
from rsfstudy.errors import DataError, InvalidValue
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
    **rig: str | None,
) -> int:
    """Follow one motion, draw it and write it."""
    if output.suffix not in (".png", ".pdf", ".svg"):
        raise InvalidValue("--output", str(output), "must end in .png, .pdf or .svg")
    check_replaceable(output.with_suffix(".nc"), _is_motion, "motion")
    stated_fields, velocity = fields(settings), rig.pop("load_velocity")
    stated = {name: text for name, text in rig.items() if text is not None}
    laboratory = assignments.laboratory(stated) if stated else None
    if velocity is not None:
        stated_fields["load_velocity"] = assignments.number_or_text(velocity)
    scene = _scene(stated_fields, protocol_file, laboratory)
    lasts = None if duration is None else _duration(duration, laboratory)
    motion = simulated(scene, duration=lasts, rtol=rtol, budget=budget, engine=engine)
    motion = motion.assign_attrs(provenance.attributes(shlex.join(["rsfstudy", *sys.argv[1:]])))
    _write(motion, laboratory, output, against)
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
    stated = assignments.number_or_text(text)
    if laboratory is not None:
        return laboratory.dimensionless(stated, name="--duration")
    if isinstance(stated, str):
        remedy = "Give a number in D_c/V_*, or state the rig too."
        raise InvalidValue("--duration", stated, "has units, and no rig is stated", remedy=remedy)
    return stated


def _write(
    motion: xr.Dataset, laboratory: Laboratory | None, output: Path, against: str | None
) -> None:
    """The picture, and the data beside it."""
    data = output.with_suffix(".nc")
    said = f"{motion.attrs['status']} {motion.attrs['message']}".strip()
    if not motion.sizes["time"]:
        console.print(f"{said}\nnothing moved: there is nothing to draw or to keep")
        return
    store.write(laboratory.in_units(motion) if laboratory else motion, data)
    draw(motion, output, against, laboratory=laboratory)
    for tell, of in (
        (terminal_numbers.record, motion),
        (terminal_numbers.events, Accessor(motion).events()),
    ):
        tell(laboratory.in_units(of, **_UNITS) if laboratory else of)
    console.print(f"{said}\nwrote {output} and {data}")


def draw(
    motion: xr.Dataset,
    path: Path,
    against: str | None,
    style: str | None = None,
    laboratory: Laboratory | None = None,
) -> None:
    """Draw a motion into a file."""
    from rsfstudy.plots import rendered, styled, write_image
    from rsfstudy.plots._motion import picture

    drawn = picture(motion, laboratory, against=against)
    try:
        with styled(style):
            write_image(rendered(drawn, path.suffix[1:]), path)
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error})") from error


def show(answer: xr.Dataset) -> int:
    """Print what a motion, or another answer for one scene, holds, and where it comes from; FAILED
    where it ended early.
    """
    about, ours = answer.attrs, Accessor(answer)
    console.print(about.get("title", "answer for one scene"), style="bold")
    stated = {name: value for name, value in ours.scene.as_dict().items() if value is not None}
    console.print(", ".join(f"{name} = {short(value)}" for name, value in stated.items()))
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


def fields(settings: tuple[str, ...]) -> dict[str, Any]:
    """Fields of a scene that ``--set`` states."""
    stated: dict[str, Any] = {}
    for text in settings:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise InvalidValue("--set", text, "must read FIELD=VALUE, as in law=slowness")
        if name in stated:
            raise InvalidValue("--set", text, f"sets {name} twice")
        stated[name] = assignments.value(value)
    return stated
