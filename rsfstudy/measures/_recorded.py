"""Shared by the measures that keep points of a motion."""

from __future__ import annotations

from rsfstudy.motion.readings import FRICTION, LOAD_POINT
from rsfstudy.quantity import Output

#: Described beside what reads them; the vocabulary has the others.
_READINGS = {about.name: about for about in (FRICTION, LOAD_POINT)}


def recorded(*names: str) -> tuple[Output, ...]:
    """Outputs along `phase`: what these names say of each point that is kept."""
    abouts = [_READINGS.get(name) or Output(name) for name in names]
    return tuple(
        Output(q.name, q.symbol, q.units, q.long_name, q.scale, dims=("phase",)) for q in abouts
    )
