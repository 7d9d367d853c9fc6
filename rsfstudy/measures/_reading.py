"""What the measures have in common that read numbers off a record, as an experimenter does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsfstudy.measures import Measure
from rsfstudy.motion.readings import FRICTION, LOAD_POINT
from rsfstudy.quantity import Quantity


@dataclass(frozen=True)
class Reading(Measure):
    """Base of them: each number that is read has an error, and the record is kept along `phase`, at
    so many points as the field `phases` says.
    """

    #: What is read; what is told beside it; and names of what is kept.
    read: ClassVar[Sequence[Quantity]]
    beside: ClassVar[Sequence[Quantity]] = ()
    kept: ClassVar[Sequence[str]] = (
        "time",
        "load_point_displacement",
        "slip",
        "friction_coefficient",
        "normal_stress_ratio",
        "log10_slip_rate",
    )

    @property
    def points(self) -> int:
        """How many points of the record are kept."""
        return int(self.plain_fields["phases"])

    @property
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        read = [about.name for about in self.read]
        errors, beside = (f"{name}_error" for name in read), (about.name for about in self.beside)
        return dict.fromkeys((*read, *errors, *beside), ()) | dict.fromkeys(self.kept, ("phase",))

    @property
    def quantities(self) -> Sequence[Quantity]:
        return (*self.read, *self.beside, FRICTION, LOAD_POINT)

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"phase": np.linspace(0.0, 1.0, self.points)}
