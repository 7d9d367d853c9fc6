"""The command line: how `simulate` is spelt, one motion of one slider with its picture and data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from rsfstudy.cli import options
from rsfstudy.motion.accuracy import DEFAULT_BUDGET, DEFAULT_RTOL
from rsfstudy.motion.engines import ENGINES, SCIPY


@click.command()
@options.fields(
    "A field of the scene, as in law=slowness; of a rig with units, as in hold_time='100 s'; "
    "a loading from a CSV file, as in loading=record.csv."
)
@click.option(
    "--protocol",
    "protocol_file",
    type=click.Path(path_type=Path, dir_okay=False),
    help="CSV file of what the load point does: a header such as 'velocity (um/s), duration (s)', "
    "or, of a record, 'time (s), displacement (um)'. The same as --set loading=FILE.",
)
@click.option("--duration", help="Time to follow it for.  [default: that of the protocol, or 50]")
@options.against
@options.rig
@click.option("--rtol", type=float, default=DEFAULT_RTOL, help="Accuracy.")
@options.count("--budget", DEFAULT_BUDGET, "Right-hand sides it may evaluate.")
@click.option("--engine", type=click.Choice(ENGINES), default=SCIPY)
@options.image(
    "--output", Path("motion.png"), "File of the picture; the data stand beside it as NetCDF."
)
@click.option("--quiet", is_flag=True, help="Say how it ended, and not its peaks and events.")
def simulate(**given: Any) -> int:
    """Follow one motion of one slider, draw it and write it.

    The picture shows friction and slip rate along it, and its path on the phase plane.

    Exit status 1 where the motion ends early, whatever the reason; 2 for wrong usage; 3 where it
    passes the instability norm with neither mass nor radiation damping, beyond which it is no
    physics; else 0.
    """
    from rsfstudy.cli import commands_simulate

    return commands_simulate.simulate(**given)
