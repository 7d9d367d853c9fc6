"""Shared by the measures that read numbers off a record, as an experimenter does."""

from __future__ import annotations

from collections.abc import Mapping

from rsfstudy.motion.accuracy import Accuracy, error_between
from rsfstudy.slider.scene import Scene

#: Part of the accuracy asked for to which the errors of two runs may agree by chance.
_BY_CHANCE = 0.01
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
