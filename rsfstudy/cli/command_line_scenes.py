"""Commands for single motions, laboratory records and benchmark problems.

The module defines the options and help texts of ``simulate``, ``fit``, ``problems`` and ``verify``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from rsfstudy.cli import options
from rsfstudy.cli.options import DecoratedFunction
from rsfstudy.defaults import FIT_EVALUATION_BUDGET
from rsfstudy.motion import DEFAULT_EVALUATION_BUDGET, DEFAULT_RTOL, ENGINES, SCIPY


@click.command(cls=options.LazilyLoadedCommand, does="commands_scenes")
@options.make_set_scene_fields_option(
    "A field of the scene, as in law=slowness; of a rig with units, as in hold_time='100 s'; "
    "a loading from a CSV file, as in loading=record.csv."
)
@click.option(
    "--protocol",
    "protocol_file",
    type=options.FilePath(dir_okay=False),
    help="CSV file of what the load point does: a header such as 'velocity (um/s), duration (s)', "
    "or, of a record, 'time (s), displacement (um)'. The same as --set loading=FILE.",
)
@click.option("--duration", help="Time to follow it for.  [default: that of the protocol, or 50]")
@options.abscissa_option
@options.rig_options
@click.option("--rtol", type=float, default=DEFAULT_RTOL, help="Accuracy.")
@options.make_count_option(
    "--budget", DEFAULT_EVALUATION_BUDGET, "Right-hand sides it may evaluate."
)
@click.option("--engine", type=click.Choice(ENGINES), default=SCIPY)
@options.make_image_option(
    "--output", Path("motion.png"), "File of the picture; the data stand beside it as NetCDF."
)
@click.option("--quiet", is_flag=True, help="Say how it ended, and not its peaks and events.")
def simulate() -> None:
    """Compute a single motion, and write its figure and its data.

    The figure shows friction and slip rate along the motion, and the path in the phase plane.

    The exit status is 1 if the motion ends early, and 2 for wrong usage. The exit status is 3 if
    the slip rate exceeds the instability norm without inertia and without radiation damping,
    because the motion is then unphysical. Otherwise the exit status is 0.
    """


def _split_commas(
    _context: click.Context, _option: click.Parameter, text: str | None
) -> tuple[str, ...]:
    """Split a comma-separated list."""
    return tuple(part.strip() for part in (text or "").split(",") if part.strip())


def _parse_number_or_text(
    _context: click.Context, _option: click.Parameter, text: str | None
) -> Any:
    """Convert the value of an option to a number if it has no units."""
    from rsfstudy.cli import assignment_parsing

    return None if text is None else assignment_parsing.parse_number_or_text(text)


def _make_comma_list_option(
    *option_names: str, help_text: str, default: str | None = None, metavar: str = "TEXT"
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Create an option for a comma-separated list."""
    return click.option(
        *option_names, callback=_split_commas, default=default, metavar=metavar, help=help_text
    )


def _make_quantity_option(
    option_name: str, help_text: str, default: str | None = None
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Create an option for a number with units.

    The help text of the option describes the default.
    """
    about: dict[str, Any] = {"default": default, "show_default": False, "help": help_text}
    return click.option(option_name, callback=_parse_number_or_text, **about)


@click.command(cls=options.LazilyLoadedCommand, does="commands_scenes")
@click.argument("records", nargs=-1, required=True, type=options.FilePath())
@click.option(
    "--columns",
    metavar="NAME=HEADING,...",
    help="Which column is which, as in 'time=t (s),displacement=lp (um),friction=mu'; "
    "shear_stress and normal_stress are others; of raw numbers, 'lp (um) * 0.1 + 5'.  "
    "[default: by headings that are known]",
)
@click.option("--normal-stress", help="As in '20 MPa', where the record does not hold it.")
@_make_quantity_option(
    "--stiffness", "Over normal stress, as in '1.6e-3 /um', or as in '0.03 MPa/um'."
)
@_make_quantity_option("--slip-distance", "First guess of D_c, as in '10 um'.")
@_make_comma_list_option(
    "--law", "laws", default="slip,slowness", help_text="State evolution laws, a fit by each."
)
@_make_comma_list_option(
    "--free",
    help_text="Parameters to look for, of which each law is fitted with those that it has; also "
    "stiffness, step_time, trend2, alpha; of law=family law_exponent.  [default: a, b (b1 and b2 "
    "of two states), slip_distance (slip_distance_2), mu_star, trend1]",
)
@_make_comma_list_option(
    "--step", "steps", metavar="N,...", help_text="Steps to fit.  [default: all]"
)
@click.option(
    "--together", is_flag=True, help="Fit these steps, of all RECORDS, as one, by one a, b and D_c."
)
@_make_quantity_option(
    "--before",
    "Load point displacement that is fitted before a step.  [default: half the way back to the "
    "step before]",
    "0 um",
)
@_make_quantity_option(
    "--after", "That after it, as in '250 um'.  [default: up to the next step]", "0 um"
)
@options.make_count_option(
    "--windows", 1, "Windows, from half of what follows a step to all of it: how parameters differ."
)
@click.option(
    "--noise",
    default="ar",
    help="white, ar (autoregressive, its order found), or ar1, ar2 and so on.",
)
@click.option(
    "--loading",
    type=click.Choice(["steps", "recorded"]),
    default="steps",
    help="The load point by its steps, or as it was recorded.",
)
@_make_quantity_option(
    "--averaging",
    "Time over which the data logger averaged friction, as in '1 s', or 'trailing 1 s' if the "
    "average ends at the row.  [default: none]",
)
@click.option(
    "--low-pass",
    default="",
    show_default=False,
    help="Low-pass filter that friction passed: first_order, butterworth_2 or butterworth_4 with "
    "its corner frequency, as in 'butterworth_2 2 Hz'.  [default: none]",
)
@click.option(
    "--posterior",
    type=click.IntRange(0),
    metavar="N",
    default=0,
    show_default=False,
    help="Draws from the posterior, by emcee.  [default: none]",
)
@options.make_set_scene_fields_option("A field of the scene that is not looked for, as in a=0.01.")
@options.make_count_option(
    "--budget", FIT_EVALUATION_BUDGET, "Right-hand sides that a fit may evaluate."
)
@click.option(
    "--engine",
    type=click.Choice(ENGINES),
    help="What integrates motions.  [default: compiled where Numba is installed, else scipy]",
)
@options.make_image_option(
    "--output", Path("fit.png"), "File of the figure; the data stand beside it as NetCDF."
)
def fit() -> None:
    """Fit friction parameters to velocity steps in RECORDS.

    The command prints the detected steps and a table of a, b, D_c and their standard errors, which
    include the correlation of the noise. The command also lists the parameters that the record does
    not constrain, and writes a figure and a data file.

    The exit status is 1 if a fit has no values, values that are not verified or standard errors
    that are not valid, and 2 for wrong usage. Otherwise the exit status is 0, even if a parameter
    is not identified.
    """


@click.command(cls=options.LazilyLoadedCommand, does="commands_referee")
@click.argument("directory", metavar="DIR", type=options.FilePath())
def problems() -> None:
    """Write all benchmark problems to a new directory.

    Each problem includes its reference solution, a table to fill in, and an example in plain SciPy.
    """


@click.command(cls=options.LazilyLoadedCommand, does="commands_referee")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=options.FilePath())
@click.option(
    "--problem",
    metavar="N|TOML",
    help="Number of the problem, or a file that states another.  [default: what FILE begins with]",
)
@click.option(
    "--columns",
    metavar="MAP",
    help="What its columns are, as in 'time=t (s), friction=mu, slip_rate=v (um/s)'.  [default: as "
    "its header says]",
)
@click.option(
    "--digits", type=click.FloatRange(1.0, 12.0), default=6.0, help="Digits that make a pass."
)
@options.make_image_option("--figure", None, "Draw where they agree, into this .png, .pdf or .svg.")
def verify() -> None:
    """Compare solutions of another code with reference solutions.

    For each quantity, the command prints the number of correct digits, the first row with a larger
    difference, and a possible explanation. The last line summarises all files. The exit status is 1
    if a problem is not passed.
    """


SCENE_COMMANDS = (simulate, fit, problems, verify)
