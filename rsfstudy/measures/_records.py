"""Shared by the measures that keep points of a motion, or read numbers off it as an experimenter
does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.motion.accuracy import Accuracy, error_between
from rsfstudy.motion.events import Event
from rsfstudy.motion.readings import FRICTION, LOAD_POINT
from rsfstudy.quantity import Output
from rsfstudy.slider.scene import Scene

#: Part of the accuracy asked for to which the errors of two runs may agree by chance.
BY_CHANCE = 0.01
#: Part of the same, times a, by which the friction coefficient of two runs may agree by chance at
#: an instant: of 7,071 numbers of random holds 22 err by up to 22 times their estimates without it,
#: and four by up to 1.7 times with it (study coverage).
_AT_AN_INSTANT = 0.1

#: What is kept of a record while normal stress changes.
KEPT = (
    "time",
    "load_point_displacement",
    "slip",
    "friction_coefficient",
    "normal_stress_ratio",
    "log10_slip_rate",
)
#: Described beside what reads them; the vocabulary has the others.
_READINGS = {about.name: about for about in (FRICTION, LOAD_POINT)}


def recorded(*names: str) -> tuple[Output, ...]:
    """Outputs along `phase`: what these names say of each point that is kept."""
    abouts = [_READINGS.get(name) or Output(name) for name in names]
    return tuple(
        Output(q.name, q.symbol, q.units, q.long_name, q.scale, dims=("phase",)) for q in abouts
    )


def since(begin: Event, path: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Quantities of a record along its path, with time and slip since its beginning."""
    found = {name: path[name] for name in ("friction_coefficient", "log10_slip_rate")}
    return {"time": path["time"] - begin.time, "slip": path["slip"] - path["slip"][0], **found}


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


def error_of(
    value: float, refined: float, by_friction: float, scene: Scene, accuracy: Accuracy
) -> float:
    """Error estimate of a number that is read at single instants.

    On a stiff machine stability limits the steps, so that the errors of two runs may agree at an
    instant by chance. What that hides is a part of the number, and of the friction that it is a
    difference of: of a, by which friction changes where ln V does by 1. So of y, of y' by the
    refined run, and with eps the accuracy asked for, the error is ``3 |y - y'| + 0.01 eps |y| + 0.1
    eps a |dy/dmu|``.

    Parameters
    ----------
    value, refined : float
        Results of the first run, and of the refined one.
    by_friction : float
        Change of the number by that of a friction coefficient which it is read from, dy/dmu.
    scene : Scene
    accuracy : Accuracy

    Returns
    -------
    float
        In the units of the number.
    """
    friction = _AT_AN_INSTANT * accuracy.rtol * scene.a
    chance = BY_CHANCE * accuracy.rtol
    return error_between(value, refined, chance) + friction * abs(by_friction)


def errors_of(
    values: Mapping[str, float],
    refined: Mapping[str, float],
    by_friction: Mapping[str, float],
    scene: Scene,
    accuracy: Accuracy,
) -> dict[str, float]:
    """Error estimates of several numbers, as `<name>_error` (see `error_of`)."""
    return {
        f"{name}_error": error_of(value, refined[name], by_friction[name], scene, accuracy)
        for name, value in values.items()
    }
