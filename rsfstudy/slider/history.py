"""A loading history that was sampled: what the load point does, and normal stress, against time.

Between samples the load point moves at a steady velocity, and normal stress changes at a steady
rate: what was recorded is linear. Its name stands for it in results; a digest tells its samples.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity, is_name
from rsfstudy.slider.loading import Segment, ramp
from rsfstudy.slider.parts import Numbers, Scene
from rsfstudy.slider.places import LOG_VELOCITY, RELIEF
from rsfstudy.slider.protocol import Stated

#: Columns of samples: time from the first, load point velocity from then on, and by how much normal
#: stress is below sigma_* then, and at which rate it rises from then on.
TIME, VELOCITY, FALL, RISING = range(4)
_UNKNOWNS = (Quantity("recorded_fall", "$P$", "1", "imposed fall of normal stress", "sigma_*"),)


class Segments(Sequence[Segment]):
    """The segments of a table, each made when it is asked for."""

    def __init__(self, table: np.ndarray) -> None:
        self._table = table

    def __len__(self) -> int:
        return len(self._table)

    def __getitem__(self, number: Any) -> Any:
        begins, ends, velocity, *_others = self._table[number].tolist()
        return Segment(velocity, duration=ends - begins)


@guard_methods
@dataclass(frozen=True, kw_only=True)
class History(Stated):
    """A loading history by its samples.

    Attributes
    ----------
    samples : bytes
        Numbers in columns: time, load point velocity, and fall and rate of normal stress.
    digest : str
        Tells the samples.
    of_stress : bool
        Whether normal stress or pore pressure is among them.
    of_pressure : bool
        Whether it is pore pressure alone. Beside a fluid that has pressure too, that is the
        pressure around the fault; fluid flows in or out until both are the same.
    back : tuple of (str, float, str), optional
        Name, value and place of the first sample that moves the load point back.
    """

    samples: bytes = field(repr=False)
    digest: str
    of_stress: bool
    of_pressure: bool = False  # type: ignore[misc]
    back: tuple[str, float, str] | None = field(default=None, compare=False, repr=False)

    auxiliary_rates = staticmethod(ramp.auxiliary_rates)
    auxiliary_steady_states = staticmethod(ramp.auxiliary_steady_states)

    @property
    def unknowns(self) -> tuple[Quantity, ...]:  # type: ignore[override]
        """The fall of normal stress, where that is sampled."""
        return _UNKNOWNS if self.of_stress else ()

    def stated_at(self, number: int) -> tuple[str, float, str]:
        velocity = float(self.columns[number, VELOCITY])
        return self.back or ("velocity", velocity, f"sample {number + 1}")

    def begins(self, scene: Scene) -> Numbers:
        """The fall at the first sample."""
        return (float(self.columns[0, FALL]),) if self.of_stress else ()

    def numbers(self, scene: Scene) -> Numbers:
        """The rate from the first sample on."""
        return (float(self.columns[0, RISING]),) if self.of_stress else ()

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: vars(self)[f.name] for f in fields(self)}

    @property
    def columns(self) -> np.ndarray:
        """The samples, shape (samples, 4)."""
        return np.frombuffer(self.samples).reshape(-1, RISING + 1)

    @cached_property
    def table(self) -> np.ndarray:
        columns = self.columns
        table = np.full((len(columns), RELIEF + 1), math.nan)
        table[:, : LOG_VELOCITY + 1].T[:] = (
            columns[:, TIME],
            np.append(columns[1:, TIME], math.inf),
            columns[:, VELOCITY],
            _log(columns[:, VELOCITY]),
        )
        if self.of_stress:
            table[:, LOG_VELOCITY + 1 :] = columns[:, [RISING, FALL]]
        return table

    @property
    def segments(self) -> Any:
        """What is between samples; the last segment goes on for ever."""
        return Segments(self.table)

    @property
    def jumps(self) -> np.ndarray:
        return np.zeros(len(self.columns), dtype=bool)

    @property
    def told(self) -> int:
        """The end of the record alone: each sample would be an event."""
        return min(1, len(self.columns) - 1)

    def _check_durations(self) -> None:
        """Nothing: samples are too many, and were checked where they were read."""

    def describe(self) -> dict[str, Any]:
        """The digest of its samples."""
        return {"samples": self.digest}

    @property
    def lasts(self) -> float:
        return float(self.columns[-1, TIME])

    @property
    def imposes(self) -> bool:
        return self.of_stress

    @property
    def is_a_step(self) -> bool:
        return True

    def alone(self, number: int) -> History:
        one = self.columns[number].copy()
        one[TIME] = 0.0
        return replace(self, samples=one.tobytes())


def sampled(
    time: np.ndarray,
    velocity: np.ndarray,
    fall: np.ndarray | None,
    name: str,
    *,
    of_pressure: bool = False,
    back: tuple[str, float, str] | None = None,
) -> History:
    """A loading history of samples.

    Parameters
    ----------
    time : ndarray
        In D_c/V_*; the history begins with the first.
    velocity : ndarray
        Of the load point from each sample on, in V_*; the last goes on for ever.
    fall : ndarray or None
        By how much normal stress is below sigma_* at the samples, over that; the last stays.
    name : str
        What the history is called in results.
    of_pressure : bool
        Whether all of the fall is pore pressure.
    back : tuple of (str, float, str), optional
        Name, value and place of the first sample that moves the load point back.

    Raises
    ------
    InvalidValue
        For a name that is none.
    """
    if not is_name(name):
        raise InvalidValue("name", name, "must be a Python identifier: it names the history")
    columns = np.zeros((len(time), RISING + 1))
    columns[:, TIME], columns[:, VELOCITY] = time - time[0], velocity
    if fall is not None:
        columns[:, FALL] = fall
        columns[:-1, RISING] = -np.diff(fall) / np.diff(time)
    history = of_samples(columns, fall is not None, name, of_pressure=of_pressure)
    return replace(history, back=back)


def of_samples(
    columns: np.ndarray, of_stress: bool, name: str, *, of_pressure: bool = False
) -> History:
    """A loading history of its columns (see `History.columns`)."""
    samples = np.ascontiguousarray(columns, dtype=float).tobytes()
    digest = hashlib.sha256(samples).hexdigest()[:16]
    return History(
        name=name, samples=samples, digest=digest, of_stress=of_stress, of_pressure=of_pressure
    )


def _log(velocity: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(abs(velocity)))
