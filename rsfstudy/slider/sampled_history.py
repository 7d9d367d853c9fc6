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
from rsfstudy.quantities import Quantity, is_variable_name
from rsfstudy.slider.loading import Segment, ramp
from rsfstudy.slider.parameter_layout import SEGMENT_LOG_VELOCITY, SEGMENT_STRESS_FALL
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.protocols import UserLoading
from rsfstudy.slider.scene_view import SceneView

#: Columns of samples: time from the first, load point velocity from then on, and by how much normal
#: stress is below sigma_* then, and at which rate it rises from then on.
TIME_COLUMN, VELOCITY_COLUMN, STRESS_FALL_COLUMN, STRESS_RATE_COLUMN = range(4)
_STRESS_UNKNOWNS = (
    Quantity("recorded_fall", "$P$", "1", "imposed fall of normal stress", "sigma_*"),
)


class LazySegments(Sequence[Segment]):
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
class SampledHistory(UserLoading):
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
    first_reversal : tuple of (str, float, str), optional
        Name, value and place of the first sample that moves the load point back.
    """

    samples: bytes = field(repr=False)
    digest: str
    of_stress: bool
    of_pressure: bool = False  # type: ignore[misc]
    first_reversal: tuple[str, float, str] | None = field(default=None, compare=False, repr=False)

    auxiliary_rates = staticmethod(ramp.auxiliary_rates)
    auxiliary_steady_states = staticmethod(ramp.auxiliary_steady_states)

    @property
    def unknowns(self) -> tuple[Quantity, ...]:  # type: ignore[override]
        """The fall of normal stress, where that is sampled."""
        return _STRESS_UNKNOWNS if self.of_stress else ()

    def describe_reversal(self, index: int) -> tuple[str, float, str]:
        velocity = float(self.sample_table[index, VELOCITY_COLUMN])
        return self.first_reversal or ("velocity", velocity, f"sample {index + 1}")

    def initial_unknowns(self, scene: SceneView) -> Numbers:
        """The fall at the first sample."""
        return (float(self.sample_table[0, STRESS_FALL_COLUMN]),) if self.of_stress else ()

    def numbers(self, scene: SceneView) -> Numbers:
        """The rate from the first sample on."""
        return (float(self.sample_table[0, STRESS_RATE_COLUMN]),) if self.of_stress else ()

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: vars(self)[f.name] for f in fields(self)}

    @property
    def sample_table(self) -> np.ndarray:
        """The samples, shape (samples, 4)."""
        return np.frombuffer(self.samples).reshape(-1, STRESS_RATE_COLUMN + 1)

    @cached_property
    def segment_table(self) -> np.ndarray:
        columns = self.sample_table
        table = np.full((len(columns), SEGMENT_STRESS_FALL + 1), math.nan)
        table[:, : SEGMENT_LOG_VELOCITY + 1].T[:] = (
            columns[:, TIME_COLUMN],
            np.append(columns[1:, TIME_COLUMN], math.inf),
            columns[:, VELOCITY_COLUMN],
            _log_velocity(columns[:, VELOCITY_COLUMN]),
        )
        if self.of_stress:
            table[:, SEGMENT_LOG_VELOCITY + 1 :] = columns[
                :, [STRESS_RATE_COLUMN, STRESS_FALL_COLUMN]
            ]
        return table

    @property
    def segments(self) -> Any:
        """What is between samples; the last segment goes on for ever."""
        return LazySegments(self.segment_table)

    @property
    def jump_mask(self) -> np.ndarray:
        return np.zeros(len(self.sample_table), dtype=bool)

    @property
    def reported_segment_count(self) -> int:
        """The end of the record alone: each sample would be an event."""
        return min(1, len(self.sample_table) - 1)

    def _check_durations(self) -> None:
        """Nothing: samples are too many, and were checked where they were read."""

    def describe(self) -> dict[str, Any]:
        """The digest of its samples."""
        return {"samples": self.digest}

    @property
    def duration(self) -> float:
        return float(self.sample_table[-1, TIME_COLUMN])

    @property
    def changes_normal_stress(self) -> bool:
        return self.of_stress

    @property
    def perturbs_steady_sliding(self) -> bool:
        return True

    def isolate_segment(self, index: int) -> SampledHistory:
        one = self.sample_table[index].copy()
        one[TIME_COLUMN] = 0.0
        return replace(self, samples=one.tobytes())


def build_sampled_history(
    time: np.ndarray,
    velocity: np.ndarray,
    stress_fall: np.ndarray | None,
    name: str,
    *,
    of_pressure: bool = False,
    first_reversal: tuple[str, float, str] | None = None,
) -> SampledHistory:
    """A loading history of samples.

    Parameters
    ----------
    time : ndarray
        In D_c/V_*; the history begins with the first.
    velocity : ndarray
        Of the load point from each sample on, in V_*; the last goes on for ever.
    stress_fall : ndarray or None
        By how much normal stress is below sigma_* at the samples, over that; the last stays.
    name : str
        What the history is called in results.
    of_pressure : bool
        Whether all of the fall is pore pressure.
    first_reversal : tuple of (str, float, str), optional
        Name, value and place of the first sample that moves the load point back.

    Raises
    ------
    InvalidValue
        For a name that is none.
    """
    if not is_variable_name(name):
        raise InvalidValue("name", name, "must be a Python identifier: it names the history")
    columns = np.zeros((len(time), STRESS_RATE_COLUMN + 1))
    columns[:, TIME_COLUMN], columns[:, VELOCITY_COLUMN] = time - time[0], velocity
    if stress_fall is not None:
        columns[:, STRESS_FALL_COLUMN] = stress_fall
        columns[:-1, STRESS_RATE_COLUMN] = -np.diff(stress_fall) / np.diff(time)
    history = history_from_table(columns, stress_fall is not None, name, of_pressure=of_pressure)
    return replace(history, first_reversal=first_reversal)


def history_from_table(
    sample_table: np.ndarray, of_stress: bool, name: str, *, of_pressure: bool = False
) -> SampledHistory:
    """A loading history of its columns (see `SampledHistory.sample_table`)."""
    samples = np.ascontiguousarray(sample_table, dtype=float).tobytes()
    digest = hashlib.sha256(samples).hexdigest()[:16]
    return SampledHistory(
        name=name, samples=samples, digest=digest, of_stress=of_stress, of_pressure=of_pressure
    )


def _log_velocity(velocity: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(abs(velocity)))
