"""What the commands `simulate` and `fit` do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from rsfstudy import plots
from rsfstudy.analysis.fitting.record import Record
from rsfstudy.analysis.fitting.steps import Step
from rsfstudy.api import fit_results, fitting, summaries
from rsfstudy.api.tables import Table
from rsfstudy.api.trajectory import BEYOND
from rsfstudy.api.trajectory import simulate as simulated
from rsfstudy.cli import assignments, layout, terminal
from rsfstudy.cli.console import console
from rsfstudy.cli.options import Given
from rsfstudy.compute import provenance
from rsfstudy.error_boundary import check_file
from rsfstudy.errors import InvalidValue
from rsfstudy.files import store
from rsfstudy.plots._motion import picture
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.records import read_record
from rsfstudy.rig.scales import TOLD_IN
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Exit status where a motion passes the instability norm with neither mass nor damping.
_NO_PHYSICS = 3
#: Most steps of a record that are listed.
_MOST_STEPS = 24
#: Options that `rsfstudy.fit` takes as they are.
_TAKEN = ("stiffness", "slip_distance", "laws", "free", "together", "before", "after", "windows",
    "noise", "loading", "averaging", "low_pass", "posterior", "budget", "engine")  # fmt: skip


def simulate(given: Given) -> int:
    """Follow one motion, draw it and write it."""
    _check_replaceable(given.output.with_suffix(".nc"), summaries.is_motion, "motion")
    scene, laboratory = _stated(given)
    duration, accuracy = _duration(given.duration, laboratory), ("rtol", "budget", "engine")
    motion = simulated(scene, duration=duration, **given.only(*accuracy))
    motion = motion.assign_attrs(provenance.attributes(given.command))
    _write(motion, laboratory, given)
    if motion.attrs["status"] != Status.OK.label:
        return terminal.FAILED
    return _NO_PHYSICS if BEYOND in motion.attrs else terminal.OK


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
    store.write(laboratory.in_units(motion, **TOLD_IN) if laboratory else motion, data)
    terminal.write_figure(picture(motion, laboratory, against=given.against), given.output)
    if not given.quiet:
        found = [motion, motion.rsf.events()]
        if laboratory:
            found = [laboratory.in_units(of, **TOLD_IN) for of in found]
        layout.show(summaries.motion(found[0]))
        layout.show(summaries.stability(motion.rsf.scene))
        layout.show(summaries.events(found[1]))
    console.print(f"{said}\nwrote {given.output} and {data}")


def fit(given: Given) -> int:
    """Fit records, print the parameters, draw the fits and write them."""
    data = given.output.with_suffix(".nc")
    _check_replaceable(data, fit_results.is_fit, "fit")
    columns = assignments.columns(given.columns)
    stress = given.normal_stress
    about = {"normal_stress": stress, "stiffness": given.stiffness}
    records = [read_record(path, columns, **about) for path in given.records]
    for record in records:
        _list_steps(record)
    dataset = fitting.fit(
        records,
        steps=[_number(text) for text in given.steps],
        command=given.command,
        **given.only(*_TAKEN),
        **assignments.fields(given.settings),
    )
    dataset = store.write(dataset, data)
    plots.save(dataset, given.output)
    for piece in summaries.numbers(dataset):
        layout.show(piece)
    console.print(f"wrote {given.output} and {data}", soft_wrap=True)
    return terminal.status_of(dataset)


def _number(text: str) -> int:
    if not text.isdecimal():
        raise InvalidValue("--step", text, "must be a whole number, or several: 1,2")
    return int(text)


def _list_steps(record: Record) -> None:
    """Print the steps of a record."""
    console.print(f"{record.name}: {len(record):,} rows, {len(record.found)} steps")
    stressed = any(step.stress_ratio != 1.0 for step in record.found)
    rows = [
        {
            "step": str(number),
            "time (s)": f"{step.begins:.6g}",
            "lasts (s)": f"{step.ends - step.begins:.6g}",
            "V0 (um/s)": f"{step.before:.6g}",
            "V1 (um/s)": f"{step.after:.6g}",
            **_normal_stresses(step, stressed),
        }
        for number, step in enumerate(record.found[:_MOST_STEPS], start=1)
    ]
    layout.show(Table(rows))
    if (left := len(record.found) - _MOST_STEPS) > 0:
        console.print(f"and {left} more")


def _normal_stresses(step: Step, listed: bool) -> dict[str, str]:
    """Format the normal stresses of a step in MPa if ``listed`` is True."""
    stresses = {"sigma0 (MPa)": step.stress_before, "sigma1 (MPa)": step.stress_after}
    return {heading: f"{of * 1e-6:.6g}" for heading, of in stresses.items() if listed}


def _check_replaceable(data: Path, is_one: Callable[[xr.Dataset], bool], kind: str) -> None:
    """Raise ``InvalidValue`` if the output file exists and has different contents."""
    check_file("--output", data)
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
