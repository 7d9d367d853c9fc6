"""The command line: how `fit` is spelt, friction parameters of records with their errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from rsfstudy.cli import options
from rsfstudy.defaults import FIT_BUDGET
from rsfstudy.motion.engines import ENGINES


def _listed(_context: click.Context, _option: click.Parameter, text: str | None) -> tuple[str, ...]:
    """Parts of a comma list."""
    return tuple(part.strip() for part in (text or "").split(",") if part.strip())


def _quantity(_context: click.Context, _option: click.Parameter, text: str | None) -> Any:
    """A number in units of records, or a text with units."""
    from rsfstudy.cli import assignments

    return None if text is None else assignments.number_or_text(text)


@click.command()
@click.argument("records", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--columns",
    callback=_listed,
    metavar="NAME=HEADING,...",
    help="Which column is which, as in 'time=t (s),displacement=lp (um),friction=mu'; shear_stress "
    "and normal_stress are others; of raw numbers, 'lp (um) * 0.1 + 5'.  "
    "[default: by headings that are known]",
)
@click.option("--normal-stress", help="As in '20 MPa', where the record does not hold it.")
@click.option(
    "--stiffness",
    callback=_quantity,
    help="Over normal stress, as in '1.6e-3 /um', or as in '0.03 MPa/um'.",
)
@click.option("--slip-distance", callback=_quantity, help="First guess of D_c, as in '10 um'.")
@click.option(
    "--law",
    "laws",
    callback=_listed,
    default="slip,slowness",
    help="State evolution laws, a fit by each.",
)
@click.option(
    "--free",
    callback=_listed,
    default="a,b,slip_distance,mu_star,trend1",
    help="Parameters to look for; also stiffness, step_time, trend2, alpha and others.",
)
@click.option(
    "--step", "steps", callback=_listed, metavar="N,...", help="Steps to fit.  [default: all]"
)
@click.option(
    "--together", is_flag=True, help="Fit these steps, of all RECORDS, as one, by one a, b and D_c."
)
@click.option(
    "--before",
    callback=_quantity,
    default="0 um",
    show_default=False,
    help="Load point displacement that is fitted before a step.  [default: half the way back to "
    "the step before]",
)
@click.option(
    "--after",
    callback=_quantity,
    default="0 um",
    show_default=False,
    help="That after it, as in '250 um'.  [default: up to the next step]",
)
@options.count(
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
@click.option(
    "--posterior",
    type=click.IntRange(0),
    metavar="N",
    default=0,
    show_default=False,
    help="Draws from the posterior, by emcee.  [default: none]",
)
@options.fields("A field of the scene that is not looked for, as in a=0.01.")
@options.count("--budget", FIT_BUDGET, "Right-hand sides that a fit may evaluate.")
@click.option(
    "--engine",
    type=click.Choice(ENGINES),
    help="What integrates motions.  [default: compiled where Numba is installed, else scipy]",
)
@options.image(
    "--output", Path("fit.png"), "File of the figure; the data stand beside it as NetCDF."
)
def fit(**given: Any) -> int:
    """Fit friction parameters to RECORDS of velocity steps, with honest errors.

    Prints the steps that are found, and a table of a, b, D_c and their standard errors, which count
    the correlation of the noise. Says what the record does not tell, and writes figure and data.

    Exit status 1 where a fit gives no numbers, or none that are verified; 2 for wrong usage; else
    0, also where a parameter is not identified.
    """
    from rsfstudy.cli import commands_fit

    return commands_fit.fit(**given)
