"""What the measures have in common that read numbers off a record, as an experimenter does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsfstudy.measures import Measure
from rsfstudy.motion.accuracy import Accuracy, error_between
from rsfstudy.motion.readings import FRICTION, LOAD_POINT
from rsfstudy.quantity import Quantity
from rsfstudy.slider.scene import Scene

#: Part of the accuracy asked for to which the errors of two runs may agree by chance.
_BY_CHANCE = 0.01
#: Part of the same, times a, by which the friction coefficient of two runs may agree by chance at
#: an instant: of 7,071 numbers of random holds 22 err by up to 22 times their estimates without it,
#: and four by up to 1.7 times with it (study coverage).
_AT_AN_INSTANT = 0.1


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


def errors_of(
    values: Mapping[str, float],
    refined: Mapping[str, float],
    by_friction: Mapping[str, float],
    scene: Scene,
    accuracy: Accuracy,
) -> dict[str, float]:
    """Error estimates of numbers that are read at single instants, as `<name>_error`.

    On a stiff machine stability limits the steps, so that the errors of two runs may agree at an
    instant by chance. What that hides is a part of the number, and of the friction that it is a
    difference of: of a, by which friction changes where ln V does by 1.

    Parameters
    ----------
    values, refined : mapping of str to float
        Results of the first run, and of the refined one.
    by_friction : mapping of str to float
        Change of each number by that of a friction coefficient which it is read from.
    """
    friction = _AT_AN_INSTANT * accuracy.rtol * scene.a
    return {
        f"{name}_error": error_between(value, refined[name], _BY_CHANCE * accuracy.rtol)
        + friction * abs(by_friction[name])
        for name, value in values.items()
    }
