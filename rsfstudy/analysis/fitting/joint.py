"""Joint fits of several windows.

The windows share the parameters of the material. If there are several windows, each window has its
own friction before the step, trend and step time.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.linalg import block_diag

from rsfstudy.analysis.fitting.filters import LOW_PASS
from rsfstudy.analysis.fitting.model import FINE, Differences, Model, Values
from rsfstudy.errors import InvalidValue
from rsfstudy.motion.meter import Halt
from rsfstudy.status import Status

T = TypeVar("T")
#: What parameters that each window may have for itself begin with.
_OWN = ("mu_star", "step_time", "trend")


def is_own(name: str) -> bool:
    """Return True if each window has its own value of a parameter."""
    return name.startswith(_OWN)


def numbered(names: Sequence[str], windows: int) -> tuple[str, ...]:
    """Return the names of the parameters of a number of windows.

    If there are several windows, the parameters of each window are numbered: ``mu_star_1``,
    ``mu_star_2`` and so on.
    """
    if windows == 1:
        return tuple(names)
    own = [name for name in names if is_own(name)]
    each = [f"{name}_{number}" for number in range(1, windows + 1) for name in own]
    return (*(name for name in names if not is_own(name)), *each)


def parted(name: str) -> tuple[str, int]:
    """Split the name of a parameter into its plain name and its window number.

    The number is 0 if all windows share the parameter.
    """
    before, _, number = name.rpartition("_")
    return (before, int(number)) if number.isdecimal() and is_own(name) else (name, 0)


def plain(name: str) -> str:
    """Return the name of a parameter without its window number."""
    return parted(name)[0]


def of_window(values: Mapping[str, T], number: int) -> dict[str, T]:
    """Return the values for one window, with plain parameter names as keys."""
    names = {name: parted(name) for name in values}
    return {own: values[name] for name, (own, of) in names.items() if of in (0, number)}


@dataclass(frozen=True)
class Joint:
    """Combined model of one or several windows, used in the same way as a ``Model``.

    Attributes
    ----------
    parts : tuple of Model
        Models of the windows.
    stiffness_factors : tuple of float
        Ratio of stiffness to normal stress in each window, relative to the first window. Empty if
        the ratio is the same in all windows.
    """

    parts: tuple[Model, ...]
    stiffness_factors: tuple[float, ...] = ()

    @cached_property
    def time(self) -> np.ndarray:
        """Times of all rows. The clock restarts at the first row of each window."""
        return np.concatenate([part.time - part.time[0] for part in self.parts])

    @cached_property
    def friction(self) -> np.ndarray:
        """Friction of all rows."""
        return np.concatenate([part.friction for part in self.parts])

    @property
    def averaging(self) -> float:
        """Averaging time of friction in s, or 0 if friction was not averaged."""
        passed = self.parts[0].filter
        return passed.size if passed is not None and passed.kind not in LOW_PASS else 0.0

    @property
    def frictions(self) -> list[np.ndarray]:
        """Friction of the rows, as one array per window."""
        return [part.friction for part in self.parts]

    @cached_property
    def displacement(self) -> np.ndarray:
        """Displacements of all rows, in um, relative to the step of each window."""
        return np.concatenate([part.displacement for part in self.parts])

    def is_linear(self, name: str) -> bool:
        """Return True if friction is a linear function of a parameter.

        Friction must be linear for all values of the other parameters.
        """
        return all(part.is_linear(plain(name)) for part in self.parts)

    def latest(self, name: str) -> float:
        """Return the largest delay in s of the loading of a window."""
        return self.parts[max(parted(name)[1] - 1, 0)].latest

    def check(self, values: Values) -> None:
        """Raise ``Halt`` if the parameters are invalid for the scene."""
        try:
            for part, own in self._each(values):
                part.scene_of(own)
        except InvalidValue as wrong:
            text = f"no slider has the first guess of the parameters: {wrong}"
            raise Halt(Status.NOT_APPLICABLE, text) from wrong

    def curve(self, values: Values, *, refined: bool = False, checked: bool = False) -> np.ndarray:
        """Compute friction of the rows of all windows, without trends.

        See ``Model.curve`` for the parameters.
        """
        told = {"refined": refined, "checked": checked}
        return np.concatenate([part.curve(own, **told) for part, own in self._each(values)])

    def trend(self, values: Values) -> np.ndarray:
        """Compute the trends of the rows of all windows."""
        return np.concatenate([part.trend(own) for part, own in self._each(values)])

    def jacobian(
        self, values: Values, free: Sequence[str], differences: Differences = FINE
    ) -> np.ndarray:
        """Compute the derivatives of friction in all windows.

        See ``Model.jacobian`` for the parameters.
        """
        blocks = []
        places = {name: place for place, name in enumerate(free)}
        for number, (part, own) in enumerate(self._each(values), start=1):
            acting = of_window(places, number)
            block = np.zeros((len(part.time), len(free)))
            block[:, [*acting.values()]] = part.jacobian(own, [*acting], differences)
            blocks.append(block)
        return np.concatenate(blocks)

    def by_loading(self, values: Values) -> np.ndarray:
        """Compute the change of friction due to errors of the loading of each window."""
        return np.asarray(block_diag(*(part.by_loading(own) for part, own in self._each(values))))

    def _each(self, values: Values) -> Iterator[tuple[Model, dict[str, float]]]:
        """Iterate over the models and the parameters of their windows."""
        factors = self.stiffness_factors or (1.0,) * len(self.parts)
        for number, (part, factor) in enumerate(zip(self.parts, factors, strict=True), start=1):
            own = of_window(values, number)
            yield part, own | {"stiffness": factor * own["stiffness"]}
