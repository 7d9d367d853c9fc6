"""Implementation of the commands ``simulate`` and ``fit``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from rsfstudy import Rig, Scene, plot_motion, read_record
from rsfstudy import fit as fit_record_fit
from rsfstudy import simulate as simulated
from rsfstudy.api import BEYOND_INSTABILITY_NORM_ATTRIBUTE_NAME
from rsfstudy.cli import assignment_parsing, printed_reports, table_layout
from rsfstudy.cli.console import stdout_console
from rsfstudy.cli.options import CommandOptions
from rsfstudy.error_boundary import check_regular_file
from rsfstudy.errors import InvalidValue
from rsfstudy.execution import provenance_attributes
from rsfstudy.fitting import LoadingStep, Record
from rsfstudy.plots import save_figure
from rsfstudy.reporting import (
    TextTable,
    build_motion_tables_and_sentences,
    build_summary_tables_and_sentences,
    is_fit,
    is_motion,
)
from rsfstudy.rig import DISPLAY_BASE_UNITS
from rsfstudy.status import Status
from rsfstudy.storage import write_dataset

#: Exit status if the slip rate of a motion exceeds the instability norm without inertia and without
#: radiation damping.
_EXIT_STATUS_UNPHYSICAL_MOTION = 3
#: Maximum number of steps of a record that are printed.
_MAX_LISTED_STEPS = 24
#: Options that are passed to ``rsfstudy.fit`` unchanged.
_OPTIONS_PASSED_TO_FIT = (
    "stiffness", "slip_distance", "laws", "free", "together", "before", "after", "windows",
    "noise", "loading", "averaging", "low_pass", "posterior", "budget", "engine",
)  # fmt: skip


def simulate(options: CommandOptions) -> int:
    """Compute a single motion, draw its figure and write its data.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    _check_output_may_be_replaced(options.output.with_suffix(".nc"), is_motion, "motion")
    scene, laboratory = _build_scene_and_rig(options)
    duration, accuracy = _parse_duration(options.duration, laboratory), ("rtol", "budget", "engine")
    motion = simulated(scene, duration=duration, **options.collect_option_values(*accuracy))
    motion = motion.assign_attrs(provenance_attributes(options.command_line))
    _write_motion_and_figure(motion, laboratory, options)
    if motion.attrs["status"] != Status.OK.label:
        return printed_reports.EXIT_STATUS_FAILED
    return (
        _EXIT_STATUS_UNPHYSICAL_MOTION
        if BEYOND_INSTABILITY_NORM_ATTRIBUTE_NAME in motion.attrs
        else printed_reports.EXIT_STATUS_OK
    )


def _build_scene_and_rig(options: CommandOptions) -> tuple[Scene, Rig | None]:
    """Build the scene, and the rig if the options define a rig."""
    fields, rig = (
        assignment_parsing.parse_scene_field_assignments(options.settings),
        options.rig_option_texts,
    )
    if (velocity := rig.pop("load_velocity", None)) is not None:
        fields["load_velocity"] = assignment_parsing.parse_number_or_text(velocity)
    laboratory = assignment_parsing.parse_rig(rig) if rig else None
    if options.protocol_file is not None:
        fields["loading"] = assignment_parsing.read_loading_file(options.protocol_file, laboratory)
    elif "loading" in fields:
        fields["loading"] = assignment_parsing.parse_loading_file(fields["loading"], laboratory)
    return (laboratory.scene(**fields) if laboratory else Scene(**fields)), laboratory


def _parse_duration(text: str | None, rig: Rig | None) -> float | None:
    """Convert a duration to units of D_c/V_*."""
    time = None if text is None else assignment_parsing.parse_number_or_text(text)
    if time is not None and rig is not None:
        return rig.dimensionless(time, name="--duration")
    if isinstance(time, str):
        remedy = "Give a number in D_c/V_*, or state the rig too."
        raise InvalidValue("--duration", time, "has units, and no rig is stated", remedy=remedy)
    return time


def _write_motion_and_figure(motion: xr.Dataset, rig: Rig | None, options: CommandOptions) -> None:
    """Write the figure and the data of a motion, and print a summary."""
    said = f"{motion.attrs['status']} {motion.attrs['message']}".strip()
    if not motion.sizes["time"]:
        stdout_console.print(f"{said}\nnothing moved: there is nothing to draw or to keep")
        return
    data = options.output.with_suffix(".nc")
    write_dataset(rig.in_units(motion, **DISPLAY_BASE_UNITS) if rig else motion, data)
    printed_reports.write_figure(plot_motion(motion, rig, against=options.against), options.output)
    if not options.quiet:
        found = [motion, motion.rsf.events()]
        if rig:
            found = [rig.in_units(of, **DISPLAY_BASE_UNITS) for of in found]
        for piece in build_motion_tables_and_sentences(found[0], motion.rsf.scene, found[1]):
            table_layout.print_summary_piece(piece)
    stdout_console.print(f"{said}\nwrote {options.output} and {data}")


def fit(options: CommandOptions) -> int:
    """Fit records, print the parameters, and write figure and data.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    data = options.output.with_suffix(".nc")
    _check_output_may_be_replaced(data, is_fit, "fit")
    columns = assignment_parsing.parse_column_assignments(options.columns)
    stress = options.normal_stress
    about = {"normal_stress": stress, "stiffness": options.stiffness}
    records = [read_record(path, columns, **about) for path in options.records]
    for record in records:
        _print_steps(record)
    dataset = fit_record_fit(
        records,
        steps=[_parse_step_number(text) for text in options.steps],
        command=options.command_line,
        **options.collect_option_values(*_OPTIONS_PASSED_TO_FIT),
        **assignment_parsing.parse_scene_field_assignments(options.settings),
    )
    dataset = write_dataset(dataset, data)
    save_figure(dataset, options.output)
    for piece in build_summary_tables_and_sentences(dataset):
        table_layout.print_summary_piece(piece)
    stdout_console.print(f"wrote {options.output} and {data}", soft_wrap=True)
    return printed_reports.exit_status_of_dataset(dataset)


def _parse_step_number(text: str) -> int:
    """Convert a step number of the option ``--step``."""
    if not text.isdecimal():
        raise InvalidValue("--step", text, "must be a whole number, or several: 1,2")
    return int(text)


def _print_steps(record: Record) -> None:
    """Print the steps of a record."""
    stdout_console.print(f"{record.name}: {len(record):,} rows, {len(record.loading_steps)} steps")
    stressed = any(step.stress_ratio != 1.0 for step in record.loading_steps)
    rows = [
        {
            "step": str(number),
            "time (s)": f"{step.start:.6g}",
            "lasts (s)": f"{step.end - step.start:.6g}",
            "V0 (um/s)": f"{step.velocity_before:.6g}",
            "V1 (um/s)": f"{step.velocity_after:.6g}",
            **_format_normal_stresses_of_step(step, stressed),
        }
        for number, step in enumerate(record.loading_steps[:_MAX_LISTED_STEPS], start=1)
    ]
    table_layout.print_summary_piece(TextTable(rows))
    if (left := len(record.loading_steps) - _MAX_LISTED_STEPS) > 0:
        stdout_console.print(f"and {left} more")


def _format_normal_stresses_of_step(step: LoadingStep, is_shown: bool) -> dict[str, str]:
    """Return the normal stresses of a step in MPa, or an empty dictionary."""
    stresses = {"sigma0 (MPa)": step.stress_before, "sigma1 (MPa)": step.stress_after}
    return {heading: f"{of * 1e-6:.6g}" for heading, of in stresses.items() if is_shown}


def _check_output_may_be_replaced(
    output_path: Path, is_of_same_kind: Callable[[xr.Dataset], bool], kind_of_contents: str
) -> None:
    """Raise ``InvalidValue`` if the output file contains another kind of data."""
    check_regular_file("--output", output_path)
    if not output_path.exists():
        return
    try:
        with xr.open_dataset(output_path, engine="netcdf4") as there:
            if is_of_same_kind(there):
                return
    except (OSError, RuntimeError, ValueError):
        pass  # the file has no dataset
    remedy = "Choose another --output, or move it away first."
    raise InvalidValue(
        "--output", str(output_path), f"is there already, and no {kind_of_contents}", remedy=remedy
    )
