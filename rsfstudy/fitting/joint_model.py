"""Joint fits of several windows.

The windows share the parameters of the material. If there are several windows, each window has its
own friction before the step, trend and step time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.linalg import block_diag

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.filters import LOW_PASS_ORDERS
from rsfstudy.fitting.window_model import (
    FINE_DIFFERENCES,
    DifferenceScheme,
    Values,
    WindowModel,
    parameters_to_fields,
    scene_to_parameters,
)
from rsfstudy.motion import MotionStopped
from rsfstudy.slider import Scene
from rsfstudy.status import Status

T = TypeVar("T")
#: What parameters that each window may have for itself begin with.
_WINDOW_PREFIXES = ("mu_star", "step_time", "trend")


def is_window_parameter(name: str) -> bool:
    """Return True if each window has its own value of a parameter."""
    return name.startswith(_WINDOW_PREFIXES)


def number_parameters(names: Sequence[str], windows: int) -> tuple[str, ...]:
    """Return the names of the parameters of a number of windows.

    If there are several windows, the parameters of each window are numbered: ``mu_star_1``,
    ``mu_star_2`` and so on.
    """
    if windows == 1:
        return tuple(names)
    own = [name for name in names if is_window_parameter(name)]
    each = [f"{name}_{number}" for number in range(1, windows + 1) for name in own]
    return (*(name for name in names if not is_window_parameter(name)), *each)


def split_window_number(name: str) -> tuple[str, int]:
    """Split the name of a parameter into its plain name and its window number.

    The number is 0 if all windows share the parameter.
    """
    before, _, number = name.rpartition("_")
    return (before, int(number)) if number.isdecimal() and is_window_parameter(name) else (name, 0)


def strip_window_number(name: str) -> str:
    """Return the name of a parameter without its window number."""
    return split_window_number(name)[0]


def window_values(values: Mapping[str, T], number: int) -> dict[str, T]:
    """Return the values for one window, with plain parameter names as keys."""
    names = {name: split_window_number(name) for name in values}
    return {own: values[name] for name, (own, of) in names.items() if of in (0, number)}


@dataclass(frozen=True)
class JointModel:
    """Combined model of one or several windows, used in the same way as a ``Model``.

    Attributes
    ----------
    models : tuple of WindowModel
        Models of the windows.
    stiffness_factors : tuple of float
        Ratio of stiffness to normal stress in each window, relative to the first window. Empty if
        the ratio is the same in all windows.
    """

    models: tuple[WindowModel, ...]
    stiffness_factors: tuple[float, ...] = ()

    @cached_property
    def time(self) -> np.ndarray:
        """Times of all rows. The clock restarts at the first row of each window."""
        return np.concatenate([part.time - part.time[0] for part in self.models])

    @cached_property
    def friction(self) -> np.ndarray:
        """Friction of all rows."""
        return np.concatenate([part.friction for part in self.models])

    @property
    def averaging_time(self) -> float:
        """Averaging time of friction in s, or 0 if friction was not averaged."""
        passed = self.models[0].filter
        return passed.size if passed is not None and passed.kind not in LOW_PASS_ORDERS else 0.0

    @property
    def friction_per_window(self) -> list[np.ndarray]:
        """Friction of the rows, as one array per window."""
        return [part.friction for part in self.models]

    @cached_property
    def displacement(self) -> np.ndarray:
        """Displacements of all rows, in um, relative to the step of each window."""
        return np.concatenate([part.displacement for part in self.models])

    def is_linear(self, name: str) -> bool:
        """Return True if friction is a linear function of a parameter.

        Friction must be linear for all values of the other parameters.
        """
        return all(part.is_linear(strip_window_number(name)) for part in self.models)

    def max_delay(self, name: str) -> float:
        """Return the largest delay in s of the loading of a window."""
        return self.models[max(split_window_number(name)[1] - 1, 0)].max_delay

    def check_parameters(self, values: Values) -> None:
        """Raise ``MotionStopped`` if the parameters are invalid for the scene."""
        try:
            for part, own in self._iterate_windows(values):
                part.build_scene(own)
        except InvalidValue as wrong:
            text = f"no slider has the first guess of the parameters: {wrong}"
            raise MotionStopped(Status.NOT_APPLICABLE, text) from wrong

    def model_friction(
        self, values: Values, *, refined: bool = False, require_stable: bool = False
    ) -> np.ndarray:
        """Compute friction of the rows of all windows, without trends.

        See ``Model.model_friction`` for the parameters.
        """
        told = {"refined": refined, "require_stable": require_stable}
        return np.concatenate(
            [part.model_friction(own, **told) for part, own in self._iterate_windows(values)]
        )

    def trend(self, values: Values) -> np.ndarray:
        """Compute the trends of the rows of all windows."""
        return np.concatenate([part.trend(own) for part, own in self._iterate_windows(values)])

    def jacobian(
        self,
        values: Values,
        free: Sequence[str],
        difference_scheme: DifferenceScheme = FINE_DIFFERENCES,
    ) -> np.ndarray:
        """Compute the derivatives of friction in all windows.

        See ``Model.jacobian`` for the parameters.
        """
        blocks = []
        places = {name: place for place, name in enumerate(free)}
        for number, (part, own) in enumerate(self._iterate_windows(values), start=1):
            acting = window_values(places, number)
            block = np.zeros((len(part.time), len(free)))
            block[:, [*acting.values()]] = part.jacobian(own, [*acting], difference_scheme)
            blocks.append(block)
        return np.concatenate(blocks)

    def loading_sensitivity(self, values: Values) -> np.ndarray:
        """Compute the change of friction due to errors of the loading of each window."""
        return np.asarray(
            block_diag(
                *(part.loading_sensitivity(own) for part, own in self._iterate_windows(values))
            )
        )

    def _iterate_windows(self, values: Values) -> Iterator[tuple[WindowModel, dict[str, float]]]:
        """Iterate over the models and the parameters of their windows."""
        factors = self.stiffness_factors or (1.0,) * len(self.models)
        for number, (part, factor) in enumerate(zip(self.models, factors, strict=True), start=1):
            own = window_values(values, number)
            yield part, own | {"stiffness": factor * own["stiffness"]}


def fitted_fields(
    scene: Scene,
    distances: Iterable[float],
    found: Mapping[str, float],
    stiffness: float | None,
    velocity: float,
) -> dict[str, float]:
    """Fields of the scene of the first window with the parameters that a fit found.

    Parameters
    ----------
    scene : Scene
        Scene at which the fit started.
    distances : iterable of float
        First guesses of the slip distances in um.
    found : mapping of str to float
        Values of the fitted parameters.
    stiffness : float or None
        Stiffness of the window, if it was not fitted.
    velocity : float
        Load point velocity before the step in um/s.
    """
    values = scene_to_parameters(scene, *distances)
    if stiffness is not None:
        values["stiffness"] = stiffness
    values |= {n: value for n, value in window_values(found, 1).items() if n in values}
    return parameters_to_fields(values, velocity)
