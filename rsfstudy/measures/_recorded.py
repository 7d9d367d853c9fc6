"""Shared by the measures that keep points of a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
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


@dataclass(frozen=True)
class Recorded(Measure):
    """Base of them: the record is kept along `phase`, at so many points as the field `phases`
    says.
    """

    def __post_init__(self) -> None:
        if self.points < 2:
            raise InvalidValue("phases", self.points, "must be at least 2")

    @property
    def points(self) -> int:
        """Number of points of the record that are kept."""
        return int(self.plain_fields["phases"])

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"phase": np.linspace(0.0, 1.0, self.points)}
