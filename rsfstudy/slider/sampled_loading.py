"""Loading histories that interpolate sampled records.

The samples contain the load point motion and normal stress as functions of time. Between samples,
the load point velocity is constant and normal stress changes at a constant rate, so the record is
interpolated linearly. In results, a history is identified by its name and by a digest of its
samples.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.quantities import Quantity, is_valid_variable_name
from rsfstudy.slider.loading import Segment, ramp
from rsfstudy.slider.parameter_layout import SEGMENT_LOG_VELOCITY, SEGMENT_STRESS_FALL
from rsfstudy.slider.parts import FloatTuple
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.user_loadings import UserLoading

#: Columns of the sample table: time since the first sample, load point velocity after the sample,
#: decrease in normal stress from sigma_* at the sample, and rate of normal stress after the sample.
TIME_COLUMN, VELOCITY_COLUMN, STRESS_FALL_COLUMN, STRESS_RATE_COLUMN = range(4)
_UNKNOWNS_OF_RECORDED_NORMAL_STRESS = (
    Quantity("recorded_fall", "$P$", "1", "imposed decrease of normal stress", "sigma_*"),
)


class LazySegmentSequence(Sequence[Segment]):
    """Sequence of segments that creates each segment when the segment is accessed.

    Parameters
    ----------
    table : ndarray of shape (segments, 6)
        Segment table of a loading.
    """

    def __init__(self, table: np.ndarray) -> None:
        """Store the segment table."""
        self._table = table

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self._table)

    def __getitem__(self, number: Any) -> Any:
        """Return the segment at an index."""
        begins, ends, velocity, *_others = self._table[number].tolist()
        return Segment(velocity, duration=ends - begins)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class SampledHistory(UserLoading):
    """Loading history that interpolates recorded samples.

    Parameters
    ----------
    name : str
        Name of the history in results.
    sample_table_bytes : bytes
        Array of shape (samples, 4) as bytes. The columns are time, load point velocity, decrease in
        normal stress, and the rate of this decrease.
    digest : str
        Digest of the samples.
    of_stress : bool
        If True, the samples include normal stress or pore pressure.
    of_pressure : bool, default: False
        If True, the samples include pore pressure but not normal stress. If the scene has a fluid
        with pore pressure, the samples specify the pressure around the fault. Fluid then flows
        until the pore pressure in the fault equals the pressure around the fault.
    first_load_point_reversal : tuple of (str, float, str), optional
        Name, value and position of the first sample that moves the load point backwards. Error
        messages contain this information.
    """

    #: Number of columns of ``sample_table``.
    SAMPLE_TABLE_COLUMN_COUNT: ClassVar[int] = STRESS_RATE_COLUMN + 1

    sample_table_bytes: bytes = field(repr=False)
    digest: str
    of_stress: bool
    of_pressure: bool = False  # type: ignore[misc]
    first_load_point_reversal: tuple[str, float, str] | None = field(
        default=None, compare=False, repr=False
    )

    auxiliary_rates = staticmethod(ramp.compute_remaining_stress_change_rates)
    auxiliary_steady_states = staticmethod(ramp.return_zero_remaining_stress_change)

    @classmethod
    def from_samples(
        cls,
        time: np.ndarray,
        velocity: np.ndarray,
        normal_stress_fall: np.ndarray | None,
        name: str,
        *,
        of_pressure: bool = False,
        first_load_point_reversal: tuple[str, float, str] | None = None,
    ) -> SampledHistory:
        r"""Build a loading history from samples.

        Parameters
        ----------
        time : ndarray
            Sampling times in :math:`D_c/V_*`. The history starts at the first sample.
        velocity : ndarray
            Load point velocity between each sample and the next sample, in :math:`V_*`. The last
            velocity also applies after the end of the record.
        normal_stress_fall : ndarray or None
            Decrease in normal stress from :math:`\sigma_*` at the samples, in :math:`\sigma_*`.
            After the last sample, normal stress remains constant.
        name : str
            Name of the history in results.
        of_pressure : bool, default: False
            If True, pore pressure is the only cause of the decrease in effective normal stress.
        first_load_point_reversal : tuple of (str, float, str), optional
            Name, value and position of the first sample that moves the load point backwards.

        Returns
        -------
        SampledHistory
            Loading history.

        Raises
        ------
        InvalidValue
            If the name is not a Python identifier.
        """
        if not is_valid_variable_name(name):
            raise InvalidValue(
                "name", name, "must be a Python identifier, because it is the name of the history"
            )
        columns = np.zeros((len(time), STRESS_RATE_COLUMN + 1))
        columns[:, TIME_COLUMN], columns[:, VELOCITY_COLUMN] = time - time[0], velocity
        if normal_stress_fall is not None:
            columns[:, STRESS_FALL_COLUMN] = normal_stress_fall
            columns[:-1, STRESS_RATE_COLUMN] = -np.diff(normal_stress_fall) / np.diff(time)
        history = cls.from_table(
            columns, normal_stress_fall is not None, name, of_pressure=of_pressure
        )
        return replace(history, first_load_point_reversal=first_load_point_reversal)

    @classmethod
    def from_table(
        cls, sample_table: np.ndarray, of_stress: bool, name: str, *, of_pressure: bool = False
    ) -> SampledHistory:
        """Build a loading history from a table of samples.

        Parameters
        ----------
        sample_table : ndarray of shape (samples, 4)
            Samples with the columns of ``SampledHistory.sample_table``.
        of_stress : bool
            If True, the samples include normal stress or pore pressure.
        name : str
            Name of the history in results.
        of_pressure : bool, default: False
            If True, the samples include pore pressure but not normal stress.

        Returns
        -------
        SampledHistory
            Loading history.
        """
        samples = np.ascontiguousarray(sample_table, dtype=float).tobytes()
        digest = hashlib.sha256(samples).hexdigest()[:16]
        return cls(
            name=name,
            sample_table_bytes=samples,
            digest=digest,
            of_stress=of_stress,
            of_pressure=of_pressure,
        )

    @property
    def unknowns(self) -> tuple[Quantity, ...]:  # type: ignore[override]
        """Unknowns of the loading.

        If normal stress is sampled, the decrease in normal stress is an unknown of the loading.
        Otherwise the loading has no unknowns.
        """
        return _UNKNOWNS_OF_RECORDED_NORMAL_STRESS if self.of_stress else ()

    def describe_load_point_reversal(self, segment_index: int) -> tuple[str, float, str]:
        """Describe the input value that moves the load point backwards.

        See ``UserLoading.describe_load_point_reversal``.
        """
        velocity = float(self.sample_table[segment_index, VELOCITY_COLUMN])
        return self.first_load_point_reversal or (
            "velocity",
            velocity,
            f"sample {segment_index + 1}",
        )

    def initial_unknowns(self, scene: SceneView) -> FloatTuple:
        """Return the decrease in normal stress at the first sample.

        See ``Loading.initial_unknowns``.
        """
        return (float(self.sample_table[0, STRESS_FALL_COLUMN]),) if self.of_stress else ()

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the rate of change of normal stress after the first sample.

        See ``Part.parameter_values``.
        """
        return (float(self.sample_table[0, STRESS_RATE_COLUMN]),) if self.of_stress else ()

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields for pickling, without cached attributes."""
        return {f.name: vars(self)[f.name] for f in fields(self)}

    @property
    def sample_table(self) -> np.ndarray:
        """Samples as an array of shape (samples, 4)."""
        return np.frombuffer(self.sample_table_bytes).reshape(-1, STRESS_RATE_COLUMN + 1)

    @cached_property
    def segment_table(self) -> np.ndarray:
        """Segment table, an array of shape (samples, 6)."""
        columns = self.sample_table
        table = np.full((len(columns), SEGMENT_STRESS_FALL + 1), math.nan)
        table[:, : SEGMENT_LOG_VELOCITY + 1].T[:] = (
            columns[:, TIME_COLUMN],
            np.append(columns[1:, TIME_COLUMN], math.inf),
            columns[:, VELOCITY_COLUMN],
            _compute_log_velocity_magnitude(columns[:, VELOCITY_COLUMN]),
        )
        if self.of_stress:
            table[:, SEGMENT_LOG_VELOCITY + 1 :] = columns[
                :, [STRESS_RATE_COLUMN, STRESS_FALL_COLUMN]
            ]
        return table

    @property
    def segments(self) -> Any:
        """Segments between the samples. The last segment has no end."""
        return LazySegmentSequence(self.segment_table)

    @property
    def jump_at_segment_start_mask(self) -> np.ndarray:
        """False for every segment, because a record is continuous."""
        return np.zeros(len(self.sample_table), dtype=bool)

    @property
    def reported_segment_start_count(self) -> int:
        """Number of segments whose start is reported as an event.

        Only the end of the record is reported as an event, to avoid one event per sample.
        """
        return min(1, len(self.sample_table) - 1)

    def _check_segment_durations(self) -> None:
        """Do nothing, because the samples are checked when they are read."""

    def describe(self) -> dict[str, Any]:
        """Return the digest of the samples.

        See ``Loading.describe``.
        """
        return {"samples": self.digest}

    @property
    def duration(self) -> float:
        """Duration of the record in D_c/V_*."""
        return float(self.sample_table[-1, TIME_COLUMN])

    @property
    def changes_normal_stress(self) -> bool:
        """True if the history changes normal stress."""
        return self.of_stress

    @property
    def perturbs_steady_sliding(self) -> bool:
        """True, because a record generally differs from steady sliding."""
        return True

    def isolate_segment(self, segment_index: int) -> SampledHistory:
        """Return a history that contains only the segment with the given index.

        See ``Loading.isolate_segment``.
        """
        one = self.sample_table[segment_index].copy()
        one[TIME_COLUMN] = 0.0
        return replace(self, sample_table_bytes=one.tobytes())


def _compute_log_velocity_magnitude(velocity: np.ndarray) -> np.ndarray:
    """Return the logarithm of the magnitude of a velocity."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(abs(velocity)))
