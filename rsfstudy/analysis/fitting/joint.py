"""Windows of records in one fit: parameters of the material are shared, and each of several windows
has friction before its step, trends and the time of its step for itself.
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
    """True for a parameter that each window may have for itself."""
    return name.startswith(_OWN)


def numbered(names: Sequence[str], windows: int) -> tuple[str, ...]:
    """Names of the parameters of so many windows: ``mu_star_1``, ``mu_star_2`` and so on."""
    if windows == 1:
        return tuple(names)
    own = [name for name in names if is_own(name)]
    each = [f"{name}_{number}" for number in range(1, windows + 1) for name in own]
    return (*(name for name in names if not is_own(name)), *each)


def parted(name: str) -> tuple[str, int]:
    """A parameter without the number of its window, and that number; 0 where all share it."""
    before, _, number = name.rpartition("_")
    return (before, int(number)) if number.isdecimal() and is_own(name) else (name, 0)


def plain(name: str) -> str:
    """A parameter without the number of its window."""
    return parted(name)[0]


def of_window(values: Mapping[str, T], number: int) -> dict[str, T]:
    """Values for the parameters of one window, by their plain names."""
    names = {name: parted(name) for name in values}
    return {own: values[name] for name, (own, of) in names.items() if of in (0, number)}


@dataclass(frozen=True)
class Joint:
    """The models of one or several windows, with the interface of a model.

    Attributes
    ----------
    parts : tuple of Model
    stiffness_factors : tuple of float
        Stiffness over normal stress of each window, relative to the first window. Empty if all
        windows have the same value.
    """

    parts: tuple[Model, ...]
    stiffness_factors: tuple[float, ...] = ()

    @cached_property
    def time(self) -> np.ndarray:
        """Times of all rows: a clock that begins again is that of another window."""
        return np.concatenate([part.time - part.time[0] for part in self.parts])

    @cached_property
    def friction(self) -> np.ndarray:
        """Friction of all rows."""
        return np.concatenate([part.friction for part in self.parts])

    @property
    def averaging(self) -> float:
        """Averaging time of friction in s; 0 if it was not averaged."""
        passed = self.parts[0].filter
        return passed.size if passed is not None and passed.kind not in LOW_PASS else 0.0

    @property
    def frictions(self) -> list[np.ndarray]:
        """Friction of the rows of each window."""
        return [part.friction for part in self.parts]

    @cached_property
    def displacement(self) -> np.ndarray:
        """Displacements of all rows, in um from the step of each window."""
        return np.concatenate([part.displacement for part in self.parts])

    def is_linear(self, name: str) -> bool:
        """True for a parameter in which friction is linear, whatever the others."""
        return all(part.is_linear(plain(name)) for part in self.parts)

    def latest(self, name: str) -> float:
        """Time in s by which the loading of a window may come late."""
        return self.parts[max(parted(name)[1] - 1, 0)].latest

    def check(self, values: Values) -> None:
        """Raise Halt if a scene cannot have these parameters."""
        try:
            for part, own in self._each(values):
                part.scene_of(own)
        except InvalidValue as wrong:
            text = f"no slider has the first guess of the parameters: {wrong}"
            raise Halt(Status.NOT_APPLICABLE, text) from wrong

    def curve(self, values: Values, *, refined: bool = False, checked: bool = False) -> np.ndarray:
        """Friction along the rows of all windows, without trends (see `Model.curve`)."""
        told = {"refined": refined, "checked": checked}
        return np.concatenate([part.curve(own, **told) for part, own in self._each(values)])

    def trend(self, values: Values) -> np.ndarray:
        """The trends along the rows of all windows."""
        return np.concatenate([part.trend(own) for part, own in self._each(values)])

    def jacobian(
        self, values: Values, free: Sequence[str], differences: Differences = FINE
    ) -> np.ndarray:
        """Derivatives along the rows of all windows (see `Model.jacobian`)."""
        blocks = []
        places = {name: place for place, name in enumerate(free)}
        for number, (part, own) in enumerate(self._each(values), start=1):
            acting = of_window(places, number)
            block = np.zeros((len(part.time), len(free)))
            block[:, [*acting.values()]] = part.jacobian(own, [*acting], differences)
            blocks.append(block)
        return np.concatenate(blocks)

    def by_loading(self, values: Values) -> np.ndarray:
        """By how much friction is off by errors of the loading of each window."""
        return np.asarray(block_diag(*(part.by_loading(own) for part, own in self._each(values))))

    def _each(self, values: Values) -> Iterator[tuple[Model, dict[str, float]]]:
        """Iterate over the models, each with the parameters of its window."""
        factors = self.stiffness_factors or (1.0,) * len(self.parts)
        for number, (part, factor) in enumerate(zip(self.parts, factors, strict=True), start=1):
            own = of_window(values, number)
            yield part, own | {"stiffness": factor * own["stiffness"]}
