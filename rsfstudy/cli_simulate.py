"""The command line: one motion of one slider, its picture and its data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import xarray as xr

from rsfstudy import assignments, terminal
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.motion.accuracy import DEFAULT_RTOL
from rsfstudy.motion.engines import ENGINES, SCIPY
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.protocol_file import read_protocol
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: What a laboratory may state, and an example of it.
_RIG = {
    "normal_stress": "5 MPa",
    "slip_distance": "10 um",
    "reference_velocity": "1 um/s",
    "stiffness": "0.1 MPa/um",
    "period": "10 ms",
    "mass": "1e4 kg/m^2",
}
_AT_LEAST = ("normal_stress", "slip_distance", "reference_velocity")
_ABSCISSAE = {"displacement": "load_point_displacement", "slip": "slip", "time": "time"}


def _of_rig(command: Any) -> Any:
    """The options that state a laboratory."""
    for name, example in reversed(_RIG.items()):
        words = f"Of the rig, as in '{example}'; a plain number is in SI units."
        command = click.option(f"--{name.replace('_', '-')}", name, help=words)(command)
    return command


@click.command()
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="FIELD=VALUE",
    help="A field of the scene, as in law=slowness; of a rig with units, as in hold_time='100 s'.",
)
@click.option(
    "--protocol",
    "protocol_file",
    type=click.Path(path_type=Path, dir_okay=False),
    help="CSV file of what the load point does: a header such as 'velocity (um/s), duration (s)'.",
)
@click.option("--duration", help="Time to follow it for.  [default: that of the protocol, or 50]")
@click.option(
    "--against",
    type=click.Choice(list(_ABSCISSAE)),
    default="displacement",
    show_default=True,
    help="Abscissa of the picture; displacement is that of the load point.",
)
@_of_rig
@click.option("--rtol", type=float, default=DEFAULT_RTOL, show_default=True, help="Accuracy.")
@click.option("--engine", type=click.Choice(ENGINES), default=SCIPY, show_default=True)
@click.option(
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path("motion.png"),
    show_default=True,
    help="File of the picture; the data stand beside it as NetCDF.",
)
def simulate(
    settings: tuple[str, ...],
    protocol_file: Path | None,
    duration: str | None,
    against: str,
    rtol: float,
    engine: str,
    output: Path,
    **rig: str | None,
) -> int:
    """Follow one motion of one slider, draw it, and write it: friction and slip rate along it, and
    its path on the phase plane.
    """
    from rsfstudy.trajectory import simulate as simulated

    if output.suffix not in (".png", ".pdf", ".svg"):
        raise InvalidValue("--output", str(output), "must end in .png, .pdf or .svg")
    laboratory = _laboratory(rig)
    scene = _scene(_fields(settings), protocol_file, laboratory)
    lasts = None if duration is None else _duration(duration, laboratory)
    motion = simulated(scene, duration=lasts, rtol=rtol, engine=engine)
    _write(motion, laboratory, output, _ABSCISSAE[against])
    status = Status[motion.attrs["status"].upper()]
    return terminal.OK if status.is_answer else terminal.FAILED


def _laboratory(rig: dict[str, str | None]) -> Laboratory | None:
    """The rig that the options state, if they state one."""
    stated = {name: _number(text) for name, text in rig.items() if text is not None}
    for name in _AT_LEAST if stated else ():
        if name not in stated:
            remedy = "A rig is stated by these three at least."
            option = f"--{name.replace('_', '-')}"
            raise InvalidValue(option, None, "must be stated", remedy=remedy)
    return Laboratory(**stated) if stated else None


def _scene(
    fields: dict[str, Any], protocol_file: Path | None, laboratory: Laboratory | None
) -> Scene:
    if protocol_file is not None:
        fields["loading"] = read_protocol(protocol_file, laboratory)
    return laboratory.scene(**fields) if laboratory else Scene(**fields)


def _duration(text: str, laboratory: Laboratory | None) -> float:
    """In D_c/V_*."""
    stated = _number(text)
    if laboratory is not None:
        return laboratory.dimensionless(stated, name="--duration")
    if isinstance(stated, str):
        remedy = "Give a number in D_c/V_*, or state the rig too."
        raise InvalidValue("--duration", stated, "has units, and no rig is stated", remedy=remedy)
    return stated


def _write(motion: xr.Dataset, laboratory: Laboratory | None, output: Path, against: str) -> None:
    """The picture, and the data beside it."""
    from rsfstudy.plots import styled
    from rsfstudy.plots._motion import picture

    data = output.with_suffix(".nc")
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        with styled():
            picture(motion, laboratory, against=against).savefig(output)
        (laboratory.in_units(motion) if laboratory else motion).to_netcdf(data)
    except OSError as error:
        raise DataError(f"{output}: cannot be written ({error})") from error
    said = f"{motion.attrs['status']} {motion.attrs['message']}".strip()
    terminal.console.print(f"{said}\nwrote {output} and {data}", highlight=False)


def _fields(settings: tuple[str, ...]) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for text in settings:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise InvalidValue("--set", text, "must read FIELD=VALUE, as in law=slowness")
        if name in fields:
            raise InvalidValue("--set", text, f"sets {name} twice")
        fields[name] = assignments.value(value)
    return fields


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
