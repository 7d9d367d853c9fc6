"""Command ``rsfstudy simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

import rsfstudy
from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_FAILED, EXIT_STATUS_OK
from rsfstudy.cli.printing import print_line, print_tables_and_sentences
from rsfstudy.errors import InvalidValue
from rsfstudy.motion import Accuracy, Engine
from rsfstudy.status import Status

if TYPE_CHECKING:
    import xarray as xr

    from rsfstudy import Rig, Scene

#: Exit status for a motion that has neither inertia nor radiation damping and whose slip rate
#: exceeds the instability norm.
_EXIT_STATUS_UNPHYSICAL_MOTION = 3


@click.command(cls=CommandWithOptionsObject)
@options.make_set_scene_fields_option(
    "Set a scene field. Values can have units if a rig is defined. The value of the field "
    "'loading' can be the path of a CSV file. Examples: law=slowness, hold_time='100 s' or "
    "loading=record.csv."
)
@click.option(
    "--protocol",
    "protocol_file",
    type=options.PathParameterType(dir_okay=False),
    help="CSV file with the load point history. This option is equivalent to --set "
    "loading=FILE. Examples of headers: 'velocity (um/s), duration (s)' for a protocol, "
    "'time (s), displacement (um)' for a record.",
)
@click.option(
    "--duration",
    metavar="QUANTITY",
    help="Duration of the motion. With a rig, pass a value with units, or a number in s. Without "
    "a rig, pass a number in units of D_c/V_*. Example: '100 s'.  [default: duration of the "
    "protocol if there is one, otherwise 50]",
)
@options.abscissa_option
@options.rig_options
@click.option(
    "--rtol", type=float, metavar="RTOL", default=Accuracy.DEFAULT_RTOL, help="Relative tolerance."
)
@options.make_positive_integer_option(
    "--budget", Accuracy.DEFAULT_BUDGET, "Maximum number of right-hand-side evaluations."
)
@click.option(
    "--engine", type=click.Choice(Engine.NAMES), default=Engine.SCIPY, help="Integration engine."
)
@options.make_image_path_option(
    "--output",
    Path("motion.png"),
    "Figure path. The data are written to a NetCDF file in the same directory.",
)
@options.figure_style_options
@options.figure_header_option
@click.option("--quiet", is_flag=True, help="Print only the status. Peaks and events are omitted.")
def simulate(command_options: options.CommandOptions) -> int:
    """Compute a single motion, and write its figure and its data.

    The figure shows friction and slip rate along the motion, and the path in the phase plane.

    The exit status is 1 if the motion ends early, and 2 if the command line is invalid. A motion
    without inertia and without radiation damping is unphysical if its slip rate exceeds the
    instability norm. In this case, the exit status is 3. Otherwise the exit status is 0.
    """
    from rsfstudy.cli.overwrite_checks import check_output_may_be_replaced
    from rsfstudy.execution import build_provenance_attributes
    from rsfstudy.reporting import is_motion_dataset

    check_output_may_be_replaced(
        command_options.output.with_suffix(".nc"), is_motion_dataset, "motion"
    )
    scene, rig = _build_scene_and_rig(command_options)
    duration, accuracy = (
        _parse_dimensionless_duration(command_options.duration, rig),
        ("rtol", "budget", "engine"),
    )
    motion = rsfstudy.simulate(
        scene, duration=duration, **command_options.collect_option_values(*accuracy)
    )
    motion = motion.assign_attrs(build_provenance_attributes(command_options.command_line))
    _write_motion_and_figure(motion, rig, command_options)
    return _find_exit_status_of_motion(motion)


def _find_exit_status_of_motion(motion: xr.Dataset) -> int:
    """Return the exit status for a motion."""
    from rsfstudy.api import UNPHYSICAL_MOTION_ATTRIBUTE_NAME

    if motion.attrs["status"] != Status.OK.label:
        return EXIT_STATUS_FAILED
    unphysical = UNPHYSICAL_MOTION_ATTRIBUTE_NAME in motion.attrs
    return _EXIT_STATUS_UNPHYSICAL_MOTION if unphysical else EXIT_STATUS_OK


def _build_scene_and_rig(command_options: options.CommandOptions) -> tuple[Scene, Rig | None]:
    """Build a scene, and a rig if the options define a rig."""
    from rsfstudy.cli import assignment_parsing as parsing

    fields = parsing.parse_scene_field_assignments(command_options.settings)
    quantities = command_options.rig_option_texts
    if (velocity := quantities.pop("load_velocity", None)) is not None:
        fields["load_velocity"] = parsing.parse_number_or_text(velocity)
    rig = parsing.build_rig_from_options(quantities) if quantities else None
    if command_options.protocol_file is not None:
        fields["loading"] = parsing.read_loading_file(command_options.protocol_file, rig)
    elif "loading" in fields:
        fields["loading"] = parsing.read_loading_if_csv_path(fields["loading"], rig)
    return (rig.scene(**fields) if rig else rsfstudy.Scene(**fields)), rig


def _parse_dimensionless_duration(text: str | None, rig: Rig | None) -> float | None:
    """Convert a duration to units of D_c/V_*."""
    from rsfstudy.cli.assignment_parsing import parse_number_or_text

    time = None if text is None else parse_number_or_text(text)
    if time is not None and rig is not None:
        return rig.dimensionless(time, name="--duration")
    if isinstance(time, str):
        remedy = "Pass a number in D_c/V_*, or define a rig."
        raise InvalidValue("--duration", time, "has units, which require a rig", remedy=remedy)
    return time


def _write_motion_and_figure(
    motion: xr.Dataset, rig: Rig | None, command_options: options.CommandOptions
) -> None:
    """Write the figure and the data of a motion, and print a summary."""
    from rsfstudy.cli.figure_files import write_figure
    from rsfstudy.reporting import build_motion_tables_and_sentences
    from rsfstudy.rig import DatasetUnits
    from rsfstudy.storage import write_dataset

    status = f"{motion.attrs['status']} {motion.attrs['message']}".strip()
    if not motion.sizes["time"]:
        reason = "the motion has no points, so no figure and no data are written"
        print_line(f"{status}\n{reason}")
        return
    data = command_options.output.with_suffix(".nc")
    write_dataset(rig.in_units(motion, **DatasetUnits.DISPLAY_UNITS) if rig else motion, data)
    appearance = command_options.collect_option_values("against", "style", "width", "header")
    write_figure(
        rsfstudy.plot_motion(motion, rig, **appearance),
        command_options.output,
        command_options.style,
    )
    if not command_options.quiet:
        found = [motion, motion.rsf.events()]
        if rig:
            found = [rig.in_units(of, **DatasetUnits.DISPLAY_UNITS) for of in found]
        print_tables_and_sentences(
            build_motion_tables_and_sentences(found[0], motion.rsf.scene, found[1])
        )
    print_line(f"{status}\nwrote {command_options.output} and {data}")
